"""What a fit leans on besides its readings, and what it shows: formula with units, picture."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.errors import JumpRefused
from adapters.files import Series
from adapters.laws.fit.candidates import find_candidates
from adapters.laws.fit.outlook import find_outlook
from adapters.laws.fit.prediction import fit_auto
from adapters.laws.fit.prior import PRIOR, predict_growth, shrink_to_tail
from trackbed.command import main

READ = np.geomspace(1, 1000, 22)


@pytest.mark.parametrize(("miss", "held", "laws"), [(0, 0, 0.0), (0, 1, 1.0), (1, 1, 0.5)])
def test_laws_that_missed_are_shrunk_to_a_tail(miss: int, held: int, laws: float) -> None:
    """A tail c - N^-0.7 goes on exactly where no block was held out; the laws' increment stands
    where they met it, and counts for half where they missed `PRIOR.missed` times 22^2 of it."""
    series = 3 - READ[:, None] ** PRIOR.exponent
    tried = find_candidates(READ, series, 1e4)
    missed, happened = miss * PRIOR.missed * 22**2 * tried.happened, held * tried.happened
    tried = replace(tried, combined_miss=missed, happened=happened)
    found = shrink_to_tail(READ, series, np.array([7.0]), tried, 1e4)
    tail = 3 - 1e4**PRIOR.exponent - series[-1]
    assert found == pytest.approx(laws * 7 + (1 - laws) * tail, rel=0.02)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_burst_is_foreseen_by_frequency_alone(sign: int) -> None:
    """Strain as in the tests, or a heave, known to cycle 100: with the frequency at most the laws'
    share of ln u is missing at 1,000; without it a quarter is.  Refusals are judged alike."""
    cycle = np.geomspace(1, 1000, 19)
    strain = sign * 0.01 * np.exp(predict_growth(np.array([np.ones(19), cycle]), 20.0))
    known = (cycle[:13], strain[:13, None])
    lean, alone = (find_outlook(*known, 1e3, frequency=f) for f in (20.0, None))
    missing = 1 - (strain[12] / strain[-1]) ** (1 - PRIOR.share)
    assert lean.prediction[0] == pytest.approx(strain[-1], rel=missing)
    assert lean.low[0] < strain[-1] < lean.high[0]
    assert abs(alone.prediction[0]) < 0.75 * abs(strain[-1])
    np.testing.assert_array_equal(lean.judged, alone.judged)


def test_no_prior_undoes_a_refusal() -> None:
    """A constant rate, and a failure that the laws predict, are refused at 5 Hz, too, where the
    tests had nearly come to rest; what they did excludes no failure."""
    with pytest.raises(JumpRefused, match="falls too slowly"):
        fit_auto(Series(READ, READ), 1e4, frequency=5.0)
    series = Series(READ, np.log(READ) + 1)
    lean, alone = (fit_auto(series, 1e4, frequency=f) for f in (5.0, None))
    assert lean.prediction < 9.9 < alone.prediction
    with pytest.raises(JumpRefused, match="given as failure"):
        fit_auto(series, 1e4, fail_at=9.9, frequency=5.0)
    bound = 0.999 * alone.band[1]
    assert lean.band[1] < bound
    assert fit_auto(series, 1e4, fail_at=bound, frequency=5.0).failure_excluded is False


def test_fit_shows_its_formula_and_a_picture(tmp_path: Path, capsys) -> None:
    """The formula of auto gives its prediction, parameters have units, a refusal is drawn."""
    path, picture = tmp_path / "series.csv", tmp_path / "fit.svg"
    rows = "".join(f"{n},{4 * n**0.2}\n" for n in READ)
    path.write_text("cycle,settlement_mm\n" + rows)
    words = ["fit", str(path), "--to-cycle", "1e4", "--figure", str(picture), "--law"]
    assert main([*words, "auto"]) == 0
    said = capsys.readouterr().out
    form = re.search(r"u\(N\) = (.*), N in cycles: from", said)[1].replace("^", "**")
    form = form.replace(" mm ((", " * ((").replace(" mm", "")
    shown = re.search(r"at cycle 10000: (\S+) mm, with probability 0.9 in (\S+) ... (\S+) mm", said)
    assert main([*words, "auto", "--json"]) == 0
    exact = json.loads(capsys.readouterr().out)
    assert eval(form, {"N": 1e4}) == pytest.approx(exact["prediction"], rel=1e-4)
    half_a_digit = 0.025 * (exact["band"][1] - exact["band"][0])  # the second of half the band
    for number, value in zip(shown.groups(), (exact["prediction"], *exact["band"]), strict=True):
        assert float(number) == pytest.approx(value, abs=half_a_digit)
    assert "<!-- band -->" in picture.read_text()
    assert main([*words, "hyperbolic"]) == 0
    assert re.search(r"N\).*\n.* mm\n.* mm\n  tau = \S+ cycles", capsys.readouterr().out)
    assert main([*words, "auto", "--fail-at", "20"]) == 6
    assert "<!-- refused: collapse -->" in picture.read_text()
    for wrong in (
        "--figure fit.pdf",
        "--figure none/fit.png",
        "--to-cycle 0",
        "--frequency 2",
        "--load-change 9 --frequency 9",
    ):
        assert main([*words, "auto", *wrong.split()]) == 2


@pytest.mark.parametrize(("readings", "said"), [(5, True), (9, True), (120, False)])
def test_what_the_prior_changes_is_printed(
    readings: int, said: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """u = N^0.3 to 1e4 is 31.6 at 1e5: few readings of it are drawn to an end, many are not."""
    cycle = np.unique(np.rint(np.geomspace(1, 1e4, readings)))
    table = tmp_path / "a.csv"
    table.write_text("N,settlement [mm]\n" + "".join(f"{n:g},{n**0.3:.9f}\n" for n in cycle))
    assert main(["fit", str(table), "--law", "auto", "--to-cycle", "1e5"]) == 0
    printed = capsys.readouterr().out
    assert ("the laws alone: " in printed) == said
    if said:
        alone = float(printed.partition("the laws alone: ")[2].split()[0])
        joint = float(printed.partition("at cycle 100000: ")[2].split()[0])
        assert joint < alone < 31.7
