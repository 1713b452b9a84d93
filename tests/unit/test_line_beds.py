"""Beds as measured: law, load, scatter and persistence are found again where they are known."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import curve_fit
from scipy.signal import lfilter
from scipy.stats import chi2, t

from track_line.beds import Beds, Scatter, renew_scores, spread_around_one
from track_line.measured import fit_beds, read_beds
from track_line.measured.fit import (
    estimate_variation,
    find_correlation,
    find_ends,
    find_length,
    find_likeness,
    find_memory,
    share_kept,
)
from trackbed.command import main
from trackbed.scenes import read_template

CYCLES = np.unique(np.rint(np.geomspace(1, 1e4, 80)))
A, B, M, AREA = 0.8e-3, 0.22, 1.4, 0.325


def write_sweep(folder: Path, factor: np.ndarray, *pressures: float, friction: float = 0.5):
    """A folder as `trackbed sweep` leaves one: packings of the law c + A (p/46 kPa)^M N^B times
    their ``factor`` (n,), which spring by 50 um for each 46 kPa, times their factor."""
    members = ["member,material.friction,sample.seed,state,run_folder"]
    rows = ["member,cycle,loaded_body_settlement,elastic_deflection,kind"]
    for pressure in pressures:
        for seed, one in enumerate(factor):
            name = f"{pressure:g}-{seed}"
            members.append(f'"{name}",{friction if seed else 0.5},{seed},finished,"members/{name}"')
            scene = {"loading": {"amplitude": pressure, "mean": pressure / 2}}
            (folder / "members" / name).mkdir(parents=True)
            (folder / "members" / name / "manifest.json").write_text(json.dumps({"scene": scene}))
            law = 2e-4 + A * (pressure / 46e3) ** M * one * CYCLES**B
            spring = 50e-6 * pressure / 46e3 * one
            rows += [f"{name},{n},{s},{spring},computed" for n, s in zip(CYCLES, law, strict=True)]
    (folder / "members.csv").write_text("\n".join(members))
    (folder / "settlement.csv").write_text("\n".join(rows))
    return folder


def draw_factors(beds: int) -> np.ndarray:
    """Lasting factors of beds (n,), with a coefficient of variation of 0.3."""
    return spread_around_one(np.random.default_rng(1).normal(size=beds), 0.3)


def test_law_load_and_scatter_are_found_again(tmp_path, capsys):
    """Three loads on 40 packings: m exactly, as the scatter is a factor; a and b but for what is
    lost between rows; the variation is that of the draws; beds that settle more are softer, r = -1;
    scatter lasts."""
    factor = draw_factors(40)
    folder = write_sweep(tmp_path, factor, 23e3, 46e3, 92e3)
    assert main(["line", "--beds", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["beds"], found["packings"], found["loads"]) == (120, 40, 3)
    assert found["b"] == pytest.approx(B, abs=5e-4)
    assert found["m"] == pytest.approx(M, abs=1e-6)
    assert found["m_low"] <= found["m"] <= found["m_high"] < M + 1e-3
    assert found["force_n"] == pytest.approx(92e3 * AREA)
    assert found["law"] == "power"
    assert found["a"] == pytest.approx(A * 2**M * factor.mean(), rel=5e-3)
    assert found["seated_m"] == pytest.approx(2e-4, rel=0.05)
    spread = np.log(factor).std(ddof=1)
    assert found["variation_of_gain"] == pytest.approx(np.expm1(spread**2) ** 0.5, rel=0.02)
    assert found["variation_of_gain_low"] < 0.3 < found["variation_of_gain_high"]
    assert found["gain_with_stiffness"] == pytest.approx(-1)
    bed = 46e3 * AREA / 50e-6 * (1 / factor).mean()
    assert found["bed_n_per_m"] == pytest.approx(bed, rel=1e-6)
    assert found["persistence_1"] == pytest.approx(1)
    assert found["memory_m"] is None  # for ever
    assert not any("persistence is not shown" in one for one in found["doubts"])
    assert not any("settlement goes as the load to the" in one for one in found["doubts"])
    assert main(["line", "--beds", str(folder), "--law", "shenton"]) == 0
    assert "settlement goes as the load to the 1 by this law" in capsys.readouterr().out


@pytest.mark.long
def test_a_scene_runs_with_measured_beds(tmp_path, capsys):
    """The keys go into the scene before the user's own, and the run's manifest has them."""
    folder = write_sweep(tmp_path / "sweep", draw_factors(9), 46e3)
    scene = tmp_path / "line.toml"
    scene.write_text(read_template("line"))
    words = ["line.length=60", "line.realisations=2", "line.axles=1e3", "scatter.stiffness=0.1"]
    sets = [word for key in words for word in ("--set", key)]
    assert main(["line", str(scene), "--beds", str(folder), *sets, "--no-pictures"]) == 0
    doubt = "one load shows no load dependence: the law keeps its exponent of the force"
    assert f"note: {doubt}" in capsys.readouterr().err
    assert doubt in (tmp_path / "line-run" / "report.html").read_text()
    manifest = json.loads((tmp_path / "line-run" / "manifest.json").read_text())["scene"]
    assert set(manifest["law"]["parameters"]) == {"a", "b", "force"}
    assert manifest["law"]["parameters"]["force"] == pytest.approx(46e3 * AREA, rel=1e-3)
    assert manifest["scatter"]["stiffness"] == 0.1
    assert manifest["scatter"]["together"] == pytest.approx(-1)


def iterate_gains(memory: float, seed: int, beds: int = 400) -> Iterator[np.ndarray]:
    """Settlements at `CYCLES` [mm] of beds whose scatter a line renews, from the first cycle on."""
    score, flat = np.random.default_rng(seed).normal(size=(1, beds)), np.zeros((1, beds))
    line = Beds(np.arange(beds) * 0.6, flat, score, flat[0] + 1, flat,
                Scatter(settlement=0.3, memory=memory), seed)  # fmt: skip
    settled, mean = np.zeros(beds), 0.0
    for then in A * CYCLES**B:
        score, factor = renew_scores(line, score, mean, then)
        settled, mean = settled + 1e3 * factor[0] * (then - mean), float(then)
        yield settled


@pytest.mark.long
@pytest.mark.parametrize("memory", [1e-3, 4e-3])
def test_memory_of_a_line_is_found_in_its_beds(tmp_path, memory):
    """`fit_beds` is the inverse of what a line does: memory and variation of its beds.  A draw of
    400 has an error of a tenth; the mean of six is within three of its own, and of the 2 % by which
    logarithms of means differ from scores.  No load is known, and neighbours are strangers."""
    found = []
    for seed in range(6):
        path = tmp_path / "beds.csv"
        head = ",".join(["cycle", *(f"s{i} [mm]" for i in range(400))])
        table = np.column_stack([CYCLES, list(iterate_gains(memory, seed))])
        np.savetxt(path, table, delimiter=",", header=head, comments="")
        fit = fit_beds(read_beds(path))
        found.append((fit.memory.value, fit.settlement))
        assert fit.memory.low < fit.memory.value < fit.memory.high
        assert np.isnan(fit.force)
        assert fit.length.value < 0.4
    assert np.mean(found, axis=0) == pytest.approx([memory, 0.3], rel=0.14)


@pytest.mark.parametrize(("late", "early", "memory"), [(2.0, 1.0, 3.0), (1.0, 4.0, 0.5)])
def test_memory_is_the_double_integral(late, early, memory):
    """Correlation of means over adjacent windows under e^(-|x - y|/L), by quadrature; the mean over
    both scatters less than a reading by the square root of the double integral over both."""

    def overlap(x: tuple[float, float], y: tuple[float, float]) -> float:
        def split(a: float) -> float:
            return min(max(a, y[0]), y[1])

        def alike(b: float, a: float) -> float:
            return float(np.exp(-abs(a - b) / memory))

        left = dblquad(alike, *x, lambda a: y[0], split, epsabs=1e-10)[0]
        return float(left + dblquad(alike, *x, split, lambda a: y[1], epsabs=1e-10)[0])

    first, second = (0.0, early), (early, early + late)
    own = overlap(first, first) * overlap(second, second)
    found = find_memory(overlap(first, second) / own**0.5, late, early)
    assert found == pytest.approx(memory, rel=1e-6)
    whole = (0.0, early + late)
    kept = overlap(whole, whole) ** 0.5 / (early + late)
    assert share_kept(early + late, memory) == pytest.approx(kept, rel=1e-6)


def test_intervals_hold_what_they_are_of():
    """90 % of 1,000 draws of twelve lognormal beds: variation, and correlation of 0.6, and that of
    400 neighbours; give or take three errors of the count, and 2 % by which Fisher's normal is off.
    """
    rng, alike = np.random.default_rng(7), np.exp(-0.2)
    width, load, held = np.sqrt(np.log1p(0.3**2)), np.zeros(12, int), np.zeros(3)
    for _ in range(1000):
        x, other = rng.normal(size=(2, 12))
        y = 0.6 * x + 0.8 * other
        one = estimate_variation(width * (x - x.mean()), load, 12)
        two = find_correlation(x, y, 12)
        along = lfilter([(1 - alike**2) ** 0.5], [1.0, -alike], rng.normal(size=500))[100:]
        three = find_likeness(along - along.mean())
        held += one.low < 0.3 < one.high, two.low < 0.6 < two.high, three.low < alike < three.high
    assert held / 1000 == pytest.approx([0.9] * 3, abs=3 * (0.09 / 1000) ** 0.5 + 0.02)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("cycle,a,b\n1,1,1\n100,2,2\n", "2 beds show no scatter"),
        ("cycle,a,b,c\n1,1,1,1\n5,2,2,2\n", "cycles 1 to 5 only"),
        ("cycle,a,b,c\n100,1,1,1\n5,2,2,2\n", "cycles do not ascend"),
        ("cycle,a,b,c\n1,1,1,1\n100,2,2,0.5\n", "1 of 3 beds rise from cycle 1 to 100: c"),
        ("cycle;a\n1;1\n100;2\n", "1 bed shows no scatter"),
        ("cycle,a,b,c\n1,1,1,1\n100,2,2,x\n", "'x' is not a number"),
        ("cycle,a [kN],b,c\n1,1,1,1\n100,2,2,2\n", "is in kN, which is not known here"),
        ("day,a,b,c\n1,1,1,1\n10,2,2,2\n100,3,3,3\n", "tonnes over those of an axle are cycles"),
        ("1,1,1,1\n10,2,2,2\n100,3,3,3\n", "there is no column cycle"),
        ("no,cycle,a [mm],b [mm]\n1,1,1,1\n2,9,2,2\n3,99,3,3\n", "only some columns have this"),
        ("cycle,a,b,c\n0,0,0,0\n1,1,1,1\n100,2,2,2\n", "no readings of all beds divide"),
        ("cycle,a,b,c\n0,0,0,0\n", "cycles 1 to 0 only"),
        ("cycle,a,b,c\n1,1,1,1\n10,5,5,5\n100,3,3,3\n1000,4,4,4\n", "rises from cycle 10 to 100"),
    ],
)
def test_a_table_that_shows_no_scatter_is_refused(tmp_path, text, said, capsys):
    """Exit code 2, with the place and what to do."""
    path = tmp_path / "beds.csv"
    path.write_text(text)
    assert main(["line", "--beds", str(path)]) == 2
    assert said in capsys.readouterr().err


def test_readings_far_apart_lend_no_persistence(tmp_path, capsys):
    """Gains from 1 to 30 and from 30 to 1e4 cycles that are strangers, of 400 beds: r = 0 within
    three errors; a straight line from 30 on would make it 0.4 in windows that end at 100.  The
    reading at cycle 0 changes nothing, and 6 m are hardly meant.  The preamble is skipped."""
    path, rng = tmp_path / "beds.csv", np.random.default_rng(3)
    gains = spread_around_one(rng.normal(size=(2, 400)), 0.3)
    table = np.cumsum([np.full(400, 9.0), np.full(400, -8.0), *gains * [[1.0], [3.0]]], axis=0)
    head = "km 12\n" + ",".join(["axles", *(f"s{i}" for i in range(400))])
    np.savetxt(path, np.column_stack([[0, 1, 30, 1e4], table]), delimiter=",", header=head,
               comments="")  # fmt: skip
    assert main(["line", "--beds", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert abs(found["persistence_1"]) < 3 / 400**0.5
    assert found["window"] == pytest.approx(1e4 / 30, rel=0.06)  # within half a step of 10^0.05
    for said in ("readings at cycle 0 are left out", "as mm it would be 0.0"):
        assert any(said in one for one in found["doubts"])


def test_gaps_are_no_readings_and_a_tamped_sleeper_is_named(tmp_path, capsys):
    """Sleepers of s = N^0.2 mm times lasting factors: where one is not read a straight line joins
    its neighbours, so that nothing is lost but there; one that is tamped is named; one without
    readings is left out."""
    path, factor = tmp_path / "beds.csv", draw_factors(12)
    table = np.outer(np.geomspace(1, 1e5, 26) ** 0.2, factor)
    table[18:, 4] -= 4
    cells = [[f"{n:.6g}", "", *(f"{s:.9g}" for s in row)]
             for n, row in zip(np.geomspace(1, 1e5, 26), table, strict=True)]  # fmt: skip
    cells[9][5], cells[14][9] = "", "NaN"
    head = ",".join(["cycle", "dead (mm)", *(f"s{i} (mm)" for i in range(12))])
    path.write_text("\n".join([head, *map(",".join, cells)]))
    assert main(["line", "--beds", str(path), "--law", "power", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["beds"] == 12
    assert found["b"] == pytest.approx(0.2, rel=0.03)  # 4 of 10 mm of one in twelve are gone
    said = " ".join(found["doubts"])
    assert "28 cells without a number are no readings" in said
    assert "are in no correlation of that window: s4 (mm) (1 of 12)" in said


@pytest.mark.parametrize(
    ("linear", "law", "said"),
    [(0.0, "power", "shenton, varandas would do as well"), (8e-6, "shenton", "last for ever, ")],
)
def test_a_term_in_proportion_is_found_where_it_shows(linear, law, said, tmp_path, capsys):
    """Nine beds of N^0.2 mm, and a rate, times a factor and each gain times another: the law that
    has such a term is taken where the power law leaves more beyond uncertainty; the others that
    these beds can not tell from it are named.  A law that hangs on a load is refused without."""
    path, cycle, rng = tmp_path / "beds.csv", np.geomspace(1, 1e6, 61), np.random.default_rng(3)
    gains = np.diff(cycle**0.2 + linear * cycle, prepend=0.0)[:, None] * draw_factors(9)
    gains *= spread_around_one(rng.normal(size=gains.shape), 0.3)
    head = ",".join(["cycle", *(f"s{i} [mm]" for i in range(9))])
    table = np.column_stack([cycle, np.cumsum(gains, axis=0)])
    np.savetxt(path, table, delimiter=",", header=head, comments="")
    assert main(["line", "--beds", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["law"] == law
    assert any(said in one for one in found["doubts"])
    if linear:
        mean = 1e-3 * linear * draw_factors(9).mean() / 1.1  # the law's quality K
        assert 0 < found["linear_low"] < mean < found["linear_high"]
    assert main(["line", "--beds", str(path), "--law", "guerin"]) == 2
    assert "the law guerin hangs on load or stiffness" in capsys.readouterr().err
    assert main(["line", "--law", "guerin", "scene.toml"]) == 2
    assert "--law is of --beds" in capsys.readouterr().err


def test_a_logarithm_is_a_harmonic_sum_and_beds_that_stop_have_no_law_nor_memory(tmp_path, capsys):
    """s = ln N as a N^b would settle a hundred times as far by the first axle; the harmonic sum
    of Varandas' law, beta = 1, does not.  Beds that stop at 100 cycles follow no law, and do not
    say what they forget: their scatter counts as lasting."""
    path, factor = tmp_path / "beds.csv", draw_factors(9)
    for cycles, said, law in (
        (CYCLES, "the beds settle as the logarithm or slower", "varandas"),
        (np.minimum(CYCLES, 100), "persistence is not shown: nan", None),
        (np.minimum(CYCLES, 100), "no law describes the beds", None),
    ):
        table = np.column_stack([CYCLES, 1e-3 * np.outer(np.log(cycles), factor)])
        head = ",".join(["cycle", *(f"s{i}" for i in range(9))])
        np.savetxt(path, table, delimiter=",", header=head, comments="")
        assert main(["line", "--beds", str(path), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["law"] == law
        assert sum(one.startswith("law=") for one in found["settings"]) == (law is not None)
        assert law is None or found["beta"] == pytest.approx(1, abs=0.02)
        assert "scatter.memory=1000" in found["settings"]
        assert found["variation_of_rate"] == found["variation_of_gain"]
        assert any(said in one for one in found["doubts"])
    table = np.column_stack([CYCLES, 1e-3 * np.outer(CYCLES**0.05, factor)])
    np.savetxt(path, table, delimiter=",", header=head, comments="")
    for law, early in ((["--law", "power"], True), ([], False)):  # another is taken by default
        assert main(["line", "--beds", str(path), *law]) == 0
        said = capsys.readouterr().out
        assert ("settles more by this law than was read in all" in said) == early


def test_beds_that_quicken_have_an_exponent_without_an_interval(tmp_path, capsys):
    """s = N^1.3 at three uneven readings: b is held at 1, and its jackknife would have no width."""
    table = np.column_stack([[1, 500, 1000], np.outer(1e-6 * np.array([1, 500, 1000]) ** 1.3,
                                                      draw_factors(5))])  # fmt: skip
    path, head = tmp_path / "beds.csv", ",".join(["cycle", *(f"s{i}" for i in range(5))])
    np.savetxt(path, table, delimiter=",", header=head, comments="")
    assert main(["line", "--beds", str(path), "--law", "power", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["b"] == pytest.approx(1, abs=1e-4)
    assert found["b_low"] is found["b_high"] is None
    for said in ("settle at a constant rate or faster", "power does not describe the beds"):
        assert any(said in one for one in found["doubts"])


def test_few_packings_count_once_and_windows_in_their_order(tmp_path):
    """Four packings under three loads leave one degree of freedom for a correlation and three for a
    variation, of 12 - 3 numbers; the memory is that of windows that were read; the
    rate that may hide is the last window's gain over its cycles; b's interval is the jackknife's,
    to steps of 0.0023 b; the deflection is the late one; neighbours of r = e^-1 are alike over
    their spacing."""
    factor = draw_factors(4)
    folder = write_sweep(tmp_path, factor, 23e3, 46e3, 92e3)
    path = folder / "settlement.csv"
    head, *rows = (one.split(",") for one in path.read_text().splitlines())
    rows = [[*one[:3], "1.0", one[4]] if float(one[1]) < 900 else one for one in rows]
    wild = np.random.default_rng(2).lognormal(sigma=0.2, size=(12, 3))
    for place, row in enumerate(rows):  # gains of each decade by a factor of its own
        decade, bed = min(int(np.log10(float(row[1]))), 3), place // len(CYCLES)
        shift = 1e-4 * sum(wild[bed][: max(decade, 0)]) * float(row[1]) ** 0.2
        row[2] = str(float(row[2]) + shift)
    path.write_text("\n".join(map(",".join, [head, *rows])))
    beds = read_beds(folder)
    fit = fit_beds(beds)
    gain = beds.settled[:, -1] - beds.settled[:, 0]
    logs = np.concatenate([x - x.mean() for x in np.log(gain).reshape(3, 4)])
    spread = (logs @ logs / 9) ** 0.5
    assert fit.total.value == pytest.approx(np.expm1(spread**2) ** 0.5)
    assert fit.total.high == pytest.approx(np.expm1(spread**2 * 3 / chi2.ppf(0.05, 3)) ** 0.5)
    here = np.arange(8, 12)
    last, middle, first = find_ends(beds)[:3]
    late, early = -np.diff(beds.settled[here][:, [last, middle, first]].mean(axis=0))
    memory = find_memory(fit.persistence[0].value, late, early)
    assert fit.memory.value == pytest.approx(memory, rel=1e-6)
    assert fit.unseen == pytest.approx(late / (beds.cycle[last] - beds.cycle[middle]))
    cycle, settled = beds.middle[beds.read], 1e3 * beds.settled[here][:, beds.read]
    left = [curve_fit(lambda n, c, a, b: c + a * n**b, cycle,
                      settled[np.delete(np.arange(4), i)].mean(axis=0), (0.0, 1.0, 0.2))[0][2]
            for i in range(4)]  # fmt: skip
    error = (3 / 4 * ((np.array(left) - np.mean(left)) ** 2).sum()) ** 0.5
    b = fit.laws["power"].parameters["b"]
    assert b.high - b.value == pytest.approx(t.ppf(0.95, 3) * error, abs=b.value * 2.4e-3)
    assert fit.bed == pytest.approx(46e3 * AREA / 50e-6 * (1 / factor).mean(), rel=1e-6)
    assert find_length(np.exp(-1)) == pytest.approx(0.6)


def test_a_sweep_with_holes_says_what_it_knows(tmp_path, capsys):
    """One bed without deflection, one without its manifest, one that ends early: stiffness and m
    come from the others; a settlement that is no number is refused with its line."""
    folder = write_sweep(tmp_path, draw_factors(6), 23e3, 46e3)
    (folder / "members" / "23000-1" / "manifest.json").unlink()
    path = folder / "settlement.csv"
    rows = [one.split(",") for one in path.read_text().splitlines()]
    rows = [[*one[:3], "", one[4]] if one[0] == "46000-2" else one for one in rows
            if not (one[0] == "46000-3" and one[1] == "10000.0")]  # fmt: skip
    path.write_text("\n".join(map(",".join, rows)))
    assert main(["line", "--beds", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["m"] == pytest.approx(M, abs=1e-6)
    assert found["bed_n_per_m"] > 0
    for said in ("23000-1: its load is not known", "to 10000 are left out: some beds have none"):
        assert any(said in one for one in found["doubts"])
    path.write_text(
        "\n".join(map(",".join, [*rows[:7], [*rows[7][:2], "nan", *rows[7][3:]], *rows[8:]]))
    )
    assert main(["line", "--beds", str(folder)]) == 2
    assert "settlement.csv:8: a settlement is not a finite number" in capsys.readouterr().err


def test_a_sweep_that_is_none_is_refused(tmp_path, capsys):
    """A folder without tables; beds that differ by another key; run flags without a scene."""
    folder = write_sweep(tmp_path / "s", draw_factors(4), 46e3, friction=0.6)
    for words, said in (
        ([str(tmp_path)], "give the folder that trackbed sweep --into wrote"),
        ([str(folder)], "the beds differ by material.friction"),
        ([str(folder), "--dry-run"], "no scene is given"),
    ):
        assert main(["line", "--beds", *words]) == 2
        assert said in capsys.readouterr().err
    assert main(["line"]) == 2


def test_members_that_are_not_finished_are_named(tmp_path, capsys):
    """Left out, with a sentence; without its manifest a member's load is not known."""
    folder = write_sweep(tmp_path, draw_factors(5), 46e3)
    path = folder / "members.csv"
    path.write_text(path.read_text().replace('"46000-2",0.5,2,finished', '"46000-2",0.5,2,failed'))
    for one in folder.glob("members/*/manifest.json"):
        one.unlink()
    assert main(["line", "--beds", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert f"46000-2 is failed with {len(CYCLES)} cycles, and left out" in printed
    assert "the load is not known" in printed
    assert "force=" not in printed
