"""What a fit claims: nothing good from few readings, far ahead, or once a rate has grown."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from adapters.bed import FloatArray
from adapters.errors import JumpRefused
from adapters.files import Series
from adapters.laws import get_law
from adapters.laws.fit.growth import find_fall, find_growth, measure_growth
from adapters.laws.fit.prediction import fit_auto, fit_series
from trackbed.command import main

LEAST = 2000.0  # about where the rate of `quicken` is least; at cycle 3,400 it is 1.5 times that


def read_cycles(per_decade: int, last: float) -> FloatArray:
    """Whole cycles, so many a decade, up to ``last``."""
    cycle = np.unique(np.round(10 ** (np.arange(6 * per_decade) / per_decade)))
    return cycle[cycle <= last]


def quicken(cycle: FloatArray) -> FloatArray:
    """A three-stage curve [m]: 1200 N^0.3 + 30 (exp(0.0012 N) - 1) microstrain of a metre."""
    return 1e-6 * (1200 * cycle**0.3 + 30 * np.expm1(0.0012 * cycle))


@pytest.mark.parametrize("per_decade", [6, 8, 48])
@pytest.mark.parametrize("last", [4300.0, 5700.0, 7600.0])
def test_a_rate_that_grew_is_refused_and_stays_so(per_decade: int, last: float) -> None:
    """The rate is 1.5 to 136 times its least: collapse, however many readings say so."""
    cycle = read_cycles(per_decade, last)
    if quicken(cycle[-1] + 1) - quicken(cycle[-1]) < 1.5 * (quicken(LEAST + 1) - quicken(LEAST)):
        return
    series = Series(cycle, quicken(cycle))
    for to_cycle in (1.05 * cycle[-1], 1e4):
        with pytest.raises(JumpRefused) as raised:
            fit_auto(series, to_cycle, fail_at=100.0)
        assert raised.value.regime == "collapse"
    named = fit_series(series, get_law("log"), 1e4, fail_at=100.0)
    assert (named.regime, named.failure_excluded) == ("collapse", False)


@pytest.mark.parametrize("last", [8e3, 1.5e4, 5e4, 5e5])
@pytest.mark.parametrize("per_decade", [8, 20])
def test_a_burst_that_has_calmed_is_refused_too(per_decade: int, last: float) -> None:
    """ln(1 + N) with a burst of twenty times as much around cycle 6,000: no number of readings
    behind it makes a prediction of the refusal; what came behind it is predicted by itself."""
    cycle = read_cycles(per_decade, last)
    settled = 1e-3 * np.log1p(cycle) + 0.02 / (1 + np.exp(-(cycle - 6000) / 800))
    with pytest.raises(JumpRefused, match=r"rate|laws differ"):
        fit_auto(Series(cycle, settled), 2 * last, fail_at=1.0)
    named = fit_series(Series(cycle, settled), get_law("log"), 2 * last, fail_at=1.0)
    assert (named.regime, named.failure_excluded) == ("collapse", False)
    if last > 1e5:
        behind = Series(cycle, settled).restart_after(1e4)
        assert fit_auto(behind, 1.1 * behind.cycle[-1]).regime is not None


@pytest.mark.parametrize("exponent", [0.2, 0.3, 0.45])
def test_scatter_seldom_looks_like_a_burst(exponent: float) -> None:
    """Readings that scatter by 1 %: at most 3 of 60 series seem to have grown at any time."""
    random, cycle = np.random.default_rng(5), read_cycles(20, 1e4)
    noisy = cycle**exponent * (1 + 0.01 * random.standard_normal((60, len(cycle))))
    assert sum(find_growth(cycle, one) is not None for one in noisy) <= 3


def test_growth_is_that_of_the_rate() -> None:
    """1 while the rate falls; 1 at a constant one; then its ratio, which a mean over an eighth of a
    decade lags behind: 3.1 and 136 are seen as 1.6 to 3 and 40 to 136; no unit matters."""
    for exponent in (0.1, 0.3, 0.6, 1.0):
        cycle = read_cycles(12, 1e4)
        assert measure_growth(cycle, cycle[:, None] ** exponent) == pytest.approx(1.0)
    for last, low, high in ((4217.0, 1.6, 3.1), (7499.0, 40.0, 136.0)):
        cycle = read_cycles(24, last)
        found = [
            measure_growth(time * cycle, unit * quicken(cycle)[:, None])
            for time, unit in ((1.0, 1.0), (0.02, -1e3))
        ]
        assert low < found[0] < high
        assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_a_growth_is_judged_by_what_came_half_a_decade_before_the_end() -> None:
    """ln N, and behind N0, that long before the end, N/N0 - 1 more, read to +-0.8: by what came
    before N0 the end is missed by 10^(1/2) - 1 + 0.8, above three times 0.8; by what came nearly
    to the end it is not.  Rates are over two readings, in which the scatter cancels."""
    cycle, missed = 10 ** (np.arange(65) / 16), 0.8 * (-1) ** np.arange(65)
    series = np.log(cycle) + np.maximum(cycle / 10**3.5 - 1, 0) + missed
    growth = 10**-0.5 * (1 + 8 * (10**0.5 - 10**0.375) / np.log(10))
    assert measure_growth(cycle, series[:, None]) == pytest.approx(growth)


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_rate_that_falls_is_let_go_ahead(noise: float) -> None:
    """Powers and logarithms read to 0.5 % of their range: none of 120 is said to quicken."""
    random = np.random.default_rng(2)
    cycle = read_cycles(10, 1e4)
    for law in (np.log(cycle), cycle**0.3, cycle**0.2, cycle / (50 + cycle)):
        read = law[:, None] + noise * np.ptp(law) * random.standard_normal((len(cycle), 30))
        assert (measure_growth(cycle, read) == 1).all()


def say(cycle: FloatArray, to_cycle: float, probability: float = 0.9) -> set[tuple[object, ...]]:
    """Regimes and claims of auto and of the law log on ln N + 1."""
    series = Series(cycle, np.log(cycle) + 1)
    found = (
        fit_auto(series, to_cycle, probability, 40.0),
        fit_series(series, get_law("log"), to_cycle, probability, 40.0),
    )
    return {(one.regime, one.failure_excluded) for one in found}


def test_claims_need_data() -> None:
    """Steady, and failure excluded, with 8 readings, 3 of the last decade, to 10 N: not with 7, not
    with one a decade, not farther.  Predictions go ahead all the same."""
    enough = np.geomspace(1, 1e3, 8)
    assert say(enough, 1e4) == {("steady", True)}
    for cycle in (np.geomspace(1, 1e3, 7), np.geomspace(1, 1e8, 9)):
        assert say(cycle, 2 * cycle[-1]) == {(None, False)}
    assert say(enough, 1.1e4) == {(None, False)}


def test_a_narrow_band_excludes_no_failure() -> None:
    """At 9 N, where the logarithm is 9.1, the 90 % band reaches 9.2, that of 5 % does not."""
    cycle = np.geomspace(1, 1e3, 22)
    series = Series(cycle, np.log(cycle))
    for law in (None, get_law("log")):

        def excluded(bound: float, probability: float, law=law) -> bool | None:
            if law is None:
                return fit_auto(series, 9e3, probability, bound).failure_excluded
            return fit_series(series, law, 9e3, probability, bound).failure_excluded

        assert excluded(9.2, 0.05) is False
        assert excluded(40.0, 0.05) is True


def test_a_fall_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tamped by 3 mm between cycles 774 and 1000: auto refuses, a named law warns, and what came
    behind is fitted as the sentence says; an outlier is no fall, nor is a heave."""
    cycle = np.unique(np.geomspace(1, 1e5, 46).round())
    row = int(np.searchsorted(cycle, 1000))
    tamped = 1 + np.log(cycle)
    tamped[row:] = 1 + np.log(cycle[row:]) - 6
    path = tmp_path / "tamped.csv"
    np.savetxt(
        path, np.transpose([cycle, tamped]), delimiter=",", header="N,settlement_mm", comments=""
    )
    words = ["fit", str(path), "--to-cycle", "2e5"]
    assert main([*words, "--law", "auto"]) == 6
    said = capsys.readouterr().err
    assert "the settlement falls by" in said
    assert f"between cycles {cycle[row - 1]:g} and {cycle[row]:g}" in said
    assert "tamped" in said
    assert main([*words, "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["regime"] is None
    assert "warning: the settlement falls" in printed.err
    assert main([*words, "--law", "auto", *said.split(": ")[-1].split()]) == 0
    outlier = np.log(cycle)
    outlier[row] -= 4
    assert find_fall(outlier) is find_fall(-np.log(cycle)) is None


@pytest.mark.parametrize(("fail_at", "excluded"), [(1.0, True), (0.0045, False)])
def test_whether_failure_is_excluded_is_said(tmp_path, capsys, fail_at, excluded):
    """Of a series that has come to rest just below the bound or far below it, in JSON and words."""
    cycle = read_cycles(10, 1e3)
    path = tmp_path / "rest.csv"
    table = np.column_stack([cycle, 0.004 * (1 - np.exp(-cycle / 100))])
    np.savetxt(path, table, header="cycle,strain", comments="", delimiter=",")
    words = ["fit", str(path), "--law", "auto", "--to-cycle", "1e4", "--fail-at", str(fail_at)]
    assert main(words) == 0
    assert ("is not excluded" in capsys.readouterr().out) is not excluded
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["failure_excluded"] is excluded
    assert main([*words, "--json", "--to-cycle", "1.2e4"]) == 0  # more than ten times ahead
    assert json.loads(capsys.readouterr().out)["failure_excluded"] is False
