"""Rivals of the settlement procedure: schedules, what their figures mean, the study's sums."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from adapters.engine_fake import FakeEngine
from adapters.procedure import run_scene
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene_file import scene_load
from adapters.stages import Run, Variant
from tests.small_bed import small_bed
from validation.settlement_bars import BARS, EVEN, gained_time_even, settled_more, table_bars
from validation.settlement_ensemble import COARSE, CONFINED
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import (
    BLOCK,
    FEWER,
    FIRST_WINDOW,
    HEALING,
    K_I,
    METHODS,
    METHODS_OF,
    STATE,
    Row,
    deck_extend,
    figures_of,
    jump_length,
    masses_scaled,
)
from validation.settlement_rivals_budget import EVERY
from validation.settlement_rivals_continuity import (
    COLUMNS,
    CYCLES,
    change_of,
    continues,
    scatters_off,
    sides_of,
    sides_without_jump,
    stays,
)
from validation.settlement_rivals_page import packings_needed
from validation.settlement_rivals_reading import (
    FIGURES,
    beside,
    chaos,
    judged,
    profile_chaos,
    profile_error,
)
from validation.settlement_rivals_reference import LAWS, law_name
from validation.settlement_rivals_runs import plan_reference
from validation.settlement_rivals_studies import STUDIES

LAST = 500


@pytest.mark.parametrize("jumps", [1, 2, 5, 10])
def test_equal_jumps_end_at_the_last_cycle(jumps: int) -> None:
    h = jump_length(jumps, LAST)
    assert K_I + FIRST_WINDOW + jumps * (h + HEALING + FIRST_WINDOW) == LAST


def test_jumps_that_miss_the_last_cycle_are_refused() -> None:
    for jumps in (3, 19):  # 380 / 3 is no number of cycles; 380 / 19 leaves none to jump
        with pytest.raises(ValueError, match="miss cycle 500"):
            jump_length(jumps, LAST)


def test_methods_at_paper_scale_are_its_scene_and_gain_what_the_issue_asks() -> None:
    """Two jumps compute 70 of 450 cycles, a gained time of 380 / 70 = 543 %; five growing ones from
    windows of ten 85, 429 %."""
    reference = CONFINED.scene(1)
    for method in METHODS_OF[CONFINED.name]:
        scene = method.kind(LAST).scene(1)
        changed = scene.material.grain.young / reference.material.grain.young
        softness = int(method.name.removeprefix("E/")) if method.family == "softer" else 1
        assert changed == pytest.approx(1 / softness)
        assert scene.material.wall == reference.material.wall
        assert scene.grain_count == reference.grain_count
        if method.jumps:
            assert scene.procedure is not None
            jumped = sum(scene.procedure.jump_cycles(number) for number in range(method.jumps))
            again = jumped + method.jumps * (HEALING + method.window)
            assert CONFINED.k_i + method.window + again == LAST
        if method.growing:
            computed = method.window + method.jumps * (HEALING + method.window)
            assert (LAST - CONFINED.k_i) / computed - 1 > 4.0


def test_jumps_of_the_other_studies_gain_what_the_issue_asks() -> None:
    """One cycle in twenty to 10,000 on the coarse bed; where the piston covers a part gained times
    of 300 % and of the paper's 120 %, the last block of cycles computed whole."""
    for name, least in (("far", dict.fromkeys((13, 31, 40), 20.0)), ("partial", {1: 4.0, 3: 2.2})):
        study = STUDIES[name]
        for method in study.methods:
            procedure = method.kind(study.last).scene(1).procedure
            assert procedure is not None
            assert procedure.total_cycles == study.last
            if not method.jumps:
                continue
            behind = method.healing + method.window
            computed = method.window + method.jumps * behind
            assert behind >= BLOCK
            assert (study.last - study.kind.k_i) / computed >= least[method.jumps]
            jumped = sum(procedure.jump_cycles(number) for number in range(method.jumps))
            assert study.kind.k_i + computed + jumped == study.last


def test_no_law_is_fitted_to_cycles_that_there_are_not() -> None:
    """Of partially confined runs 80 cycles are computed: a law from 100 of them has no row."""
    study = STUDIES["partial"]
    plan = plan_reference(study.kind, EnsembleRecord(), study.last)
    laws = {head["method"] for head, _ in plan if head["part"] == "law"}
    assert laws == {law_name(law, cycles) for law, cycles in LAWS if cycles < 80}
    assert len(laws) == 2


def test_methods_are_scenes_of_their_own() -> None:
    """Every method but E/100 is a scene, of the reference's bed but for what its name says."""
    reference = COARSE.scene(1)
    assert len({method.name for method in METHODS}) == len(METHODS)
    for method in METHODS:
        if method.name == "E/100":
            continue
        scene = method.kind(LAST).scene(1)
        assert scene.procedure is not None
        assert scene.procedure.total_cycles == LAST
        changed = scene.model_dump()["material"] != reference.model_dump()["material"]
        assert changed == (method.family in ("softer", "density"))
        steps = scene.steps_per_cycle / reference.steps_per_cycle
        shorter = method.family in ("softer", "density", "longer step", "frequency")
        assert (steps < 0.75) == shorter


def test_scaled_masses_keep_weights() -> None:
    """Gravity falls as the density rises."""
    method = next(method for method in METHODS if method.name == "density x 10")
    scene = method.kind(LAST).scene(1)
    (lines,) = masses_scaled(scene, method.heavier).values()
    density = float(lines[0].rpartition(" ")[2])
    gravity = float(lines[-1].split()[4])
    assert density * gravity == pytest.approx(COARSE.scene(1).material.grain.density * 9.81)


def test_lines_come_behind_their_line(tmp_path: Path) -> None:
    deck = tmp_path / "in.cycles"
    deck.write_text("one\ntwo\n")
    deck_extend(deck, "one", "and", "more")
    assert deck.read_text() == "one\nand\nmore\ntwo\n"
    with pytest.raises(ValueError, match="three"):
        deck_extend(deck, "three", "more")


def test_figures_leave_out_blocks_that_a_jump_skipped() -> None:
    """Settlement is that of a block's mean less the mean of the block up to k_i."""
    cycles = [*range(K_I - BLOCK + 1, K_I + 2 * BLOCK + 1), *range(K_I + 3 * BLOCK + 4, 151)]
    found = {c: {"settlement": 1e-6 * c} | dict.fromkeys(STATE, float(c)) for c in cycles}
    figures = figures_of(found, K_I)
    assert figures["settlement"] == pytest.approx(
        {"110": 1e-5, "120": 2e-5, "150": 5e-5}, rel=1e-12
    )
    assert figures["state"] == pytest.approx(dict.fromkeys(STATE, 145.5))


# --- sums of the study, on made-up runs --------------------------------------------------------


def made_up(part: str, method: str, seed: int, member: int, value: float) -> Row:
    """A row whose every figure is ``value``."""
    return {
        "part": part, "method": method, "seed": seed, "member": member, "last": LAST,
        "settlement": {str(LAST): value}, "profile": [value, 1.0], "cpu_s": 1.0, "refused": "",
        "state": dict.fromkeys(STATE, value),
    }  # fmt: skip


def ensemble(generator: np.random.Generator, within: float, profile: float = 0.0) -> list[Row]:
    """Five packings, two members each, scatter between packings 0.3 about 1."""
    rows = []
    for seed in range(1, 6):
        own = 1 + 0.3 * generator.standard_normal()
        for member in range(2):
            row = made_up(
                "reference", EVERY, seed, member, own + within * generator.standard_normal()
            )
            row["profile"] = list(1 + profile * generator.standard_normal(400))
            rows.append(row)
    return rows


def test_band_of_chaos_holds_full_runs() -> None:
    """A third run of each packing lies within the band in 95 % of ensembles.

    Of 400 ensembles the share has a standard error of at most 1.1 %; the bar is three of them.
    """
    generator = np.random.default_rng(1)
    inside = []
    for _ in range(400):
        own = 10 + generator.standard_normal(5)
        members = own[:, None] + generator.standard_normal((5, 2))
        rows = [
            made_up("reference", EVERY, seed + 1, member, members[seed, member])
            for seed in range(5)
            for member in range(2)
        ]
        band = chaos(rows, LAST, "settlement")
        for _ in range(2):
            third = own + generator.standard_normal(5)
            rows[10:] = [made_up("rivals", "full", s + 1, 0, third[s]) for s in range(5)]
            found = judged(rows, "full", LAST, "settlement")
            assert found is not None
            inside.append(abs(found.mean) <= band)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.033)


def test_band_of_profiles_is_that_of_a_third_run() -> None:
    """Layers of independent errors, 400 of them: both tell s sqrt(3/2), within 5 %."""
    rows = ensemble(np.random.default_rng(2), 0.0, profile=0.01)
    third = ensemble(np.random.default_rng(3), 0.0, profile=0.01)
    rows += [row | {"part": "rivals", "method": "full"} for row in third if row["member"] == 0]
    expected = 0.01 * np.sqrt(1.5)
    assert profile_chaos(rows, LAST) == pytest.approx(expected, rel=0.05)
    assert profile_error(rows, "full", LAST).mean() == pytest.approx(expected, rel=0.05)


def test_nearer_is_told_from_sizes_of_errors() -> None:
    """Moving that is off by 0.1 to the other side is nearer than nothing moved, off by 0.3."""
    rows = [made_up("reference", EVERY, s, m, 1.0) for s in (1, 2) for m in (0, 1)]
    rows += [made_up("rivals", "5 jumps", s, 0, 1.1) for s in (1, 2)]
    assert beside(rows, 5, LAST) is None
    rows += [made_up("rivals", "5 jumps, nothing moved", 2, 0, 0.7)]
    found = beside(rows, 5, LAST)
    assert found is not None
    assert found.difference == pytest.approx([0.4])
    assert found.nearer == pytest.approx([0.2])


def test_packings_that_could_tell_are_counted_by_student() -> None:
    """Mean 1 and deviation 1 need t(n - 1) <= sqrt(n): n = 7, as 2.447 < 2.646 and 2.571 > 2.449.

    Not (2 s / mean)^2 = 4, whose own interval is 1 +- 1.59.
    """
    assert packings_needed(np.array([0.0, 1.0, 2.0])) == 7
    assert packings_needed(np.array([0.0, -1.0, -2.0])) == 7


def test_fewer_grains_are_scaled_to_the_bed() -> None:
    """Half as many grains stand half as high: lengths count twice, stiffness half."""
    row = made_up("rivals", "75 grains", 1, 0, 1.0)
    values = {key: figure.value(row) for key, figure in FIGURES.items()}
    assert values == {"settlement": 2.0, "coordination": 1.0, "deflection": 2.0, "stiffness": 0.5}


# --- bars -----------------------------------------------------------------------------------------


def test_bars_of_a_made_up_study() -> None:
    """Two packings that settle 1 and 3 behind 6 before; a method 0.2 more on each, at a fifth of
    the cost: bias 0.2 / 8, the interval is by the scatter within, the spread the same.

    At the 1.6 s that its 50 cycles cost the engine the 400 of the reference are 12.8 s, over 2.0 s
    that the method cost in all: 540 %; at twice the steps a cycle they are half of it, 220 %; with
    .4 of these 1.6 s for starts, 9.6 s and 380 %.
    """
    rows = [
        made_up("reference", EVERY, seed, member, value + 0.01 * (-1) ** member)
        | {"begun": 6.0, "cpu_s": 10.0, "computed": 400, "steps_per_cycle": 10}
        for seed, value in ((1, 1.0), (2, 3.0))
        for member in (0, 1)
    ]
    rows += [
        made_up("rivals", "5 jumps", seed, member, value + 0.01 * (-1) ** member)
        | {"cpu_s": 2.0, "cost": {"engine": 1.6}, "computed": 50, "steps_per_cycle": 10}
        for seed, value in ((1, 1.2), (2, 3.2))
        for member in (0, 1)
    ]
    values = {bar.words: bar.value(rows, "5 jumps", LAST) for bar in BARS}
    assert values["bias over the total settlement"] == pytest.approx(100 * 0.2 / 8)
    half = 4.303 * 0.01 * np.sqrt(2) / 2
    assert values["bias over half the reference's interval"] == pytest.approx(0.2 / half, rel=1e-3)
    assert values["spread over the reference's"] == pytest.approx(1)
    assert values["coordination number"] == pytest.approx(100 * 0.2 / 2)
    assert values["gained time"] == pytest.approx(400)
    assert values[EVEN] == pytest.approx(540)
    finer = [row | {"steps_per_cycle": 20} if row["part"] == "rivals" else row for row in rows]
    assert gained_time_even(finer, "5 jumps", LAST) == pytest.approx(220)
    begun = [
        row | {"cost": {"engine": 1.6, "start_up": 0.4}} if row["part"] == "rivals" else row
        for row in rows
    ]
    assert gained_time_even(begun, "5 jumps", LAST) == pytest.approx(380)
    assert np.isnan(gained_time_even(rows, FEWER.name, LAST))
    assert values["rate goes on"] != values["rate goes on"]
    met = {bar.words for bar in BARS if bar.met(values[bar.words])}
    assert met == {"spread over the reference's", "gained time", EVEN}
    assert "| 5 jumps | 2.5 | 6.6 | **1.0** |" in table_bars(rows, ["5 jumps", "none"], LAST)
    assert "none" not in table_bars(rows, ["5 jumps", "none"], LAST)


# --- how a bed goes on behind a jump -------------------------------------------------------------


def sides(seed: int, first: int, last: int, shock: float = 0.0) -> Row:
    """u = ln N with gains that scatter by their own size about it, a ``shock`` behind the jump."""
    random = np.random.default_rng(seed)
    parts = {}
    for name, start in (("before", first - CYCLES), ("after", last)):
        cycle = start + 1 + np.arange(CYCLES)
        gain = 1 / cycle * (1 + random.normal(size=CYCLES) + (shock if name == "after" else 0))
        level = 3.0 + 0.1 * random.normal(size=CYCLES) + (0.1 * shock if name == "after" else 0)
        parts[name] = {"settlement": gain, "coordination_number": level, "piston_stiffness": level}
    return {"first": first, "last": last, **parts}


def test_a_bed_that_goes_on_is_seen_to_and_a_shock_is_not_passed() -> None:
    """Beside six full runs: of one more of the same kind 95 % pass (400 of them: 3 standard errors
    are 3.3 %), though the bed slows down fivefold; with a shock that doubles what ten cycles
    scatter by, fewer than a tenth."""
    same, shocked = (
        [
            (sides(seed, 100, 500, shock), [sides(9999 + 6 * seed + n, 100, 500) for n in range(6)])
            for seed in range(400)
        ]
        for shock in (0.0, 4.0)
    )
    for column in COLUMNS:
        went_on, stopped = (
            np.mean(
                [
                    continues(
                        change_of(one, column),
                        np.array([change_of(other, column) for other in others]),
                    )
                    for one, others in pairs
                ]
            )
            for pairs in (same, shocked)
        )
        assert went_on == pytest.approx(0.95, abs=0.033)
        assert stopped < 0.1


def test_full_runs_beside_a_shocked_bed_go_on() -> None:
    """In brackets: what full runs do between the same cycles, each beside the others.

    Two hundred jumps beside six runs of a kind of their own: 95 % of 1,200, of which six share a
    spread (3 standard errors of two hundred: 4.7 %).
    """
    jumps = [
        sides(seed, 100, 500, 4.0)
        | {"others": [sides(9999 + 6 * seed + n, 100, 500) for n in range(6)]}
        for seed in range(200)
    ]
    rows = [made_up("rivals", "1 jumps", 1, 0, 1.0) | {"sides": jumps}]
    bar = next(bar for bar in BARS if bar.words == "coordination goes on")
    assert bar.full is not None
    assert bar.value(rows, "1 jumps", LAST) < 10
    assert bar.full(rows, "1 jumps", LAST) == pytest.approx(95, abs=4.7)
    assert bar.full(rows, "none", LAST) != bar.full(rows, "none", LAST)
    cell = table_bars(rows, ["1 jumps"], LAST, [bar]).splitlines()[-1]
    assert re.fullmatch(r"\| 1 jumps \| \d \(9\d\) \|", cell)


def test_what_a_moved_bed_settles_more_is_told_packing_by_packing() -> None:
    """3 less 1 in the first cycle and 0 less 1 in each of the next nine; half of that in another
    packing's two jumps, of which one is no different from full runs."""
    full = {"after": {"settlement": [1.0] * 10}}
    jump = {"after": {"settlement": [3.0] + [0.0] * 9}, "others": [full] * 3}
    same = full | {"others": [full] * 3}
    rows = [
        made_up("rivals", "1 jumps", seed, 0, 1.0) | {"sides": jumps}
        for seed, jumps in ((1, [jump]), (2, [jump, same]))
    ]
    assert settled_more(rows, "1 jumps", LAST).tolist() == [[2.0, -9.0], [1.0, -4.5]]


def test_what_stays_is_within_the_scatter_of_single_cycles() -> None:
    """Means of ten and of five of one distribution part by 0.55 of its standard deviation s, 2 s
    with Student's nine degrees of freedom in one case of two hundred; the shock is one of six s.
    Cycles that are left out do not count."""
    random = np.random.default_rng(3)
    held: dict[float, list[bool]] = {shock: [] for shock in (0.0, 6.0)}
    for shock, found in held.items():
        for _ in range(400):
            before, after = 1 + random.normal(size=(2, CYCLES))
            after += np.where(np.arange(CYCLES) < 5, 50.0, shock)
            one = {"before": {"settlement": before}, "after": {"settlement": after}}
            found.append(stays(one, "settlement", 5))
            assert not stays(one, "settlement", 0)
    assert np.mean(held[0.0]) > 0.98
    assert np.mean(held[6.0]) < 0.02


def test_a_bed_that_settles_by_the_logarithm_slows_down_and_stays_by_its_slope() -> None:
    """1/N a cycle to cycle 100 and from 201 on: a half of it, far off; by the slope of ln N not."""
    number = np.arange(91.0, 101), np.arange(201.0, 211)
    sides = {
        side: {"settlement": 1 / of} for side, of in zip(("before", "after"), number, strict=True)
    }
    sides |= {"first": 100, "last": 200}
    assert scatters_off(sides, "settlement", 5) < -10
    assert scatters_off(sides, "settlement", 5, slowing=True) == pytest.approx(0, abs=1e-9)


def run_of_small_bed(folder: Path, h: int, total_cycles: int, k: int = 12) -> Run:
    """A finished run of the small bed on the fake engine, from windows of ``k`` cycles."""
    scene = folder / "scene.toml"
    scene.write_text(small_bed(k=k, h=h, total_cycles=total_cycles))
    run_scene(scene, folder / "run", progress=Progress(quiet=True))
    quiet = Progress(quiet=True)
    return Run(scene_load(scene, ()), RunFolder(folder / "run"), FakeEngine(), Variant(), quiet)


def test_sides_of_a_jump_behind_a_short_window(tmp_path: Path) -> None:
    """The first cycle of a window of ten counts from the end of what came before it."""
    run = run_of_small_bed(tmp_path, h=8, total_cycles=60, k=CYCLES)
    settled = [row["settlement"] for outcome in run.folder.outcomes() for row in outcome.rows]
    one = sides_of(run)[0]
    gains = np.diff(settled[: one["first"]])[-CYCLES:]
    assert one["before"]["settlement"] == pytest.approx(gains, rel=1e-6)


def test_a_cycle_that_is_not_known_is_left_out() -> None:
    """The change of a steady logarithm is nought, whether all ten cycles before it are known."""
    number = np.arange(41.0, 51), np.arange(101.0, 111)
    before, after = ((2e-6 / cycle).tolist() for cycle in number)
    sides = {"first": 50, "last": 100, "after": {"settlement": after}}
    for known in (before, [np.nan, *before[1:]]):
        found = change_of(sides | {"before": {"settlement": known}}, "settlement", 5)
        assert found == pytest.approx(0.0, abs=1e-18)


def test_sides_of_a_jump_of_no_cycle(tmp_path: Path) -> None:
    """h = 0 leaves no row of its own: the first cycle behind it counts from the one before."""
    run = run_of_small_bed(tmp_path, h=0, total_cycles=40)
    one = sides_of(run)[0]
    assert one["first"] == one["last"] == 14
    settled = [row["settlement"] for outcome in run.folder.outcomes() for row in outcome.rows]
    assert one["after"]["settlement"][0] == pytest.approx(settled[14] - settled[13], rel=1e-6)


def test_sides_of_a_run_are_its_table(tmp_path: Path) -> None:
    """Cycles before and behind both jumps, settlement cycle by cycle; a full run has the same."""
    run = run_of_small_bed(tmp_path, h=8, total_cycles=60)
    found = sides_of(run)
    assert [(one["first"], one["last"]) for one in found] == [(14, 22), (35, 43)]
    with (run.folder.path / "settlement.csv").open() as stream:
        rows = {int(row["cycle"]): row for row in csv.DictReader(stream)}
    settled = {cycle: float(row["settlement"]) for cycle, row in rows.items()}
    for one in found:
        for name, start in (("before", one["first"] - CYCLES), ("after", one["last"])):
            gain = [settled[start + n + 1] - settled[start + n] for n in range(CYCLES)]
            assert one[name]["settlement"] == pytest.approx(gain, rel=1e-6)
            touching = [float(rows[start + n + 1]["coordination_number"]) for n in range(CYCLES)]
            assert one[name]["coordination_number"] == pytest.approx(touching)
    cycle = np.arange(1.0, 61)
    columns = {column: np.log(cycle) for column in COLUMNS}
    full = sides_without_jump(columns, cycle, 14, 22)
    assert full["before"]["settlement"] == pytest.approx(
        np.log(np.arange(5, 15) / np.arange(4, 14))
    )
    assert full["after"]["settlement"][0] == pytest.approx(np.log(23 / 22))
    assert full["after"]["piston_stiffness"] == pytest.approx(np.log(np.arange(23, 33)))
