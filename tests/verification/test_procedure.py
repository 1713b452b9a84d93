"""The flow chart of Fig. 10 on the fake engine, whose settlement is known in closed form."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.bed.state import FloatArray, State, load_state
from adapters.engines import fake as engine_fake
from adapters.engines.contract import get_engine
from adapters.engines.fake import SETTLEMENT, FakeBed
from adapters.errors import NotConverged, NotCredible, UsageError
from adapters.files.run_folder import Outcome, RunFolder
from adapters.files.window import Window, load_window
from adapters.jumps import Jumped
from adapters.moves import Jump
from adapters.procedure import fixed as jump_fixed
from adapters.procedure import room as jump_room
from adapters.procedure import run as procedure
from adapters.procedure import stages
from adapters.procedure.fixed import find_known_room
from adapters.procedure.forecast import bound_burst
from adapters.procedure.progress import Progress
from adapters.procedure.stages import Run, Variant
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.small_bed import BY_HAND, read_rows, small_bed
from trackbed.command import main
from trackbed.scenes import find_scene_file

QUIET = Progress(quiet=True)


def settle(folder: Path, *overrides: str, control: bool = False) -> list[dict[str, str]]:
    """Run the coarse scene on the fake engine; the rows of settlement.csv."""
    procedure.run_scene(
        find_scene_file("karrech-coarse"),
        folder,
        control=control,
        overrides=['engine.name="fake"', *BY_HAND, *overrides],
        progress=QUIET,
    )
    return read_rows(folder)


def stages_of(folder: Path) -> list[str]:
    return RunFolder(folder).stage_names()


def test_flow_chart(tmp_path: Path) -> None:
    """k_i cycles, k cycles, then jumps of h, each followed by healing and k cycles, to the end."""
    rows = settle(
        tmp_path / "run",
        "procedure.k_i=10",
        "procedure.k=5",
        "procedure.h=[10, 20]",
        "procedure.healing_cycles=2",
        "procedure.total_cycles=70",
    )
    assert stages_of(tmp_path / "run") == [
        "preparation", "window_000000", "window_000010", "jump_000015_1", "window_000025",
        "jump_000032_1", "window_000052", "window_000059", "window_000064", "window_000069",
    ]  # fmt: skip
    kinds = {int(row["cycle"]): row["kind"] for row in rows}
    assert [cycle for cycle, kind in kinds.items() if kind == "jumped"] == [25, 52]
    assert [cycle for cycle, kind in kinds.items() if kind == "healing"] == [26, 27, 53, 54]
    assert max(kinds) == 70


@pytest.mark.parametrize("total", [24, 15, 14, 60])
def test_a_dry_run_tells_the_plan_that_the_run_follows(total: int, tmp_path, capsys) -> None:
    """Jumps, cycles computed and cost; a run without room for a jump says so before it starts."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=2, h=8, total_cycles=total))
    assert main(["run", str(scene), "--dry-run"]) == 0
    told = capsys.readouterr()
    assert main(["run", str(scene)]) == 0
    outcomes = RunFolder(tmp_path / "run").outcomes()
    jumps = [f"{one.first_cycle} to {one.last_cycle}" for one in outcomes if one.stage == "jump"]
    computed = sum(o.last_cycle - o.first_cycle for o in outcomes if o.stage == "window")
    assert f"# plan: {total} cycles, {computed} of them computed" in told.out
    assert ", ".join(jumps) in told.out
    assert "# estimated CPU time: at least" in told.out
    lacks = "no jump fits into 14 cycles, so every one is computed"
    for said in (told.err, capsys.readouterr().err):
        assert (lacks in said) is (total == 14) is (not jumps)


def test_healing_cycles_stay_out_of_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fit after a jump sees k + 1 states, and none of the healing ones."""
    seen: list[np.ndarray] = []
    real = stages.get_move("smoothed")

    def spy(jump: Jump) -> np.ndarray:
        seen.append(jump.cycle)
        return real.displacement(jump)

    monkeypatch.setattr(stages, "get_move", lambda name: replace(real, displacement=spy))
    settle(tmp_path / "run", "procedure.h=10", "procedure.total_cycles=120")
    first, second = seen[:2]
    assert first.tolist() == list(range(20, 41))
    assert second.tolist() == list(range(55, 76))  # 40 + 10 jumped + 5 healing, then k = 20


def test_no_jump_h_zero(tmp_path: Path) -> None:
    """h = 0 resubmits without a jump: it ends where the control does, to the relaxation's bar."""
    still = settle(tmp_path / "still", "procedure.h=0", control=True)
    control = read_rows(tmp_path / "still" / "control")
    assert any(name.startswith("jump") for name in stages_of(tmp_path / "still"))
    assert float(still[-1]["mean_grain_settlement"]) == pytest.approx(
        float(control[-1]["mean_grain_settlement"]), abs=1e-6
    )


def test_jump_that_lifts_a_bed_is_no_jump(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A law that says so, by more than the bed moved in its window: shorter jumps, then exit code
    6; a rise of less is let be."""
    real = stages.estimate
    metres_a_cycle = 1e-3

    def lifted(
        run: stages.Run, window: Window, healing: int, h: int
    ) -> tuple[State, FloatArray, float]:
        before, _, height = real(run, window, healing, h)
        return before, before.position + np.array([0.0, 0.0, metres_a_cycle * h]), height

    monkeypatch.setattr(stages, "estimate", lifted)
    with pytest.raises(NotCredible, match="the law lifts the bed by 2000 um"):
        settle(tmp_path / "run")
    failed = [e for e in RunFolder(tmp_path / "run").events() if e["event"] == "jump failed"]
    assert len(failed) == 4
    metres_a_cycle = 1e-9
    settle(tmp_path / "little")


def no_room(
    monkeypatch: pytest.MonkeyPatch, where: Callable[[State, FloatArray, float], bool]
) -> None:
    """No relaxation finds room ``where`` bed before, target and piston's height say so."""
    real = jump_room.relax_target

    def relaxed(
        scene: Scene, before: State, target: FloatArray, piston_height: float
    ) -> tuple[FloatArray, dict[str, Any]]:
        if where(before, target, piston_height):
            raise NotConverged("made to fail")
        return real(scene, before, target, piston_height)

    monkeypatch.setattr(jump_room, "relax_target", relaxed)


def drop(before: State, target: FloatArray) -> float:
    """Settlement of the mean grain [m]."""
    return float((before.position - target)[:, 2].mean())


def test_piston_waits_where_grains_have_no_room_below_it(tmp_path, monkeypatch) -> None:
    """A given settlement with no room under a piston that goes down: the bed is relaxed under the
    old one, settles by its gain all the same, and the piston comes to lie on it."""
    no_room(monkeypatch, lambda before, target, height: height < before.piston_height)
    settle(tmp_path / "run", 'procedure.settlement="history"', "procedure.total_cycles=90")
    folder = RunFolder(tmp_path / "run")
    outcome = folder.outcome("jump_000040_1")
    assert outcome is not None
    assert outcome.notes["relaxation"]["piston"] == "on the bed"
    jump = folder.path / "jump_000040_1"
    estimated, relaxed = (load_state(jump / f"{name}.npz") for name in ("estimated", "relaxed"))
    assert relaxed.position[:, 2].mean() == pytest.approx(estimated.position[:, 2].mean(), abs=1e-8)
    before = load_window(folder.path / "window_000020" / "states.npz").state(-1)
    top = float((relaxed.position[:, 2] + relaxed.radius).max())
    assert relaxed.piston_height == min(top, before.piston_height)


def test_what_a_bed_has_no_room_for_is_left_to_the_next_jump(tmp_path, monkeypatch) -> None:
    """u = a ln(1 + N) and jumps by history of 20 and 15 cycles, of which the first may move by no
    more than 6 um: a ln(61 / 41) = 7.9 um is halved.  The next is asked for a ln(101 / 86) and for
    that half; a differs by 2 % from N in place of 1 + N."""
    no_room(monkeypatch, lambda start, target, _: start.cycle == 40 and drop(start, target) > 6e-6)
    keys = ('procedure.settlement="history"', "procedure.h=[20, 15]", "procedure.total_cycles=125")
    rows = settle(tmp_path / "run", *keys)
    jumps = [one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump"]
    (first, asked), (second, owed) = ((one.notes["gain"], one.notes["asked"]) for one in jumps)
    assert [one.last_cycle - one.first_cycle for one in jumps] == [20, 15]
    assert asked == pytest.approx(SETTLEMENT * np.log(61 / 41), rel=0.02)
    assert first == asked / 2
    assert second == owed == pytest.approx(first + SETTLEMENT * np.log(101 / 86), rel=0.02)
    end = float(rows[-1]["mean_grain_settlement"])
    assert end == pytest.approx(SETTLEMENT * np.log(126), rel=0.01)


@pytest.mark.parametrize("sinking", [0.0, 1e-6])
def test_a_jump_by_history_lowers_the_loaded_body_by_its_own_cycles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sinking: float
) -> None:
    """A piston that sinks by a ln(1 + N) + s N goes down over a jump by what its own cycles say,
    not by a strain of the mean grain's gain, twice that here: with s = 0 it is a ln(61 / 41).
    With s it sinks 20 um more, of which cycles 2 to 40 as a walk in ln N tell two thirds."""
    monkeypatch.setattr(engine_fake, "BED", FakeBed(sinking=sinking))
    settle(tmp_path / "run", 'procedure.settlement="history"', "procedure.h=20")
    outcomes = RunFolder(tmp_path / "run").outcomes()
    jump = next(one for one in outcomes if one.stage == "jump")
    before = [one.rows[-1] for one in outcomes if one.last_cycle == jump.first_cycle][-1]
    lowered = before["piston_height"] - jump.rows[0]["piston_height"]
    assert jump.notes["sinking"] == pytest.approx(lowered, rel=1e-9)
    assert jump.notes["gain"] == pytest.approx(SETTLEMENT * np.log(61 / 41), rel=0.02)
    more = lowered - SETTLEMENT * np.log(61 / 41)
    assert more == pytest.approx(0, abs=1e-7) if not sinking else 12e-6 < more < 20e-6


def test_no_burst_is_extrapolated() -> None:
    """By hand: 80 um from cycle 60 to 150, jump and window, are 87.3 um a unit of ln N; a jump from
    150 to 300 may sink by twice that times ln 2.  Before any jump, or where it never sank: no
    bound."""
    jumped = Jumped(np.array([60, 125, 150]), np.array([0.0, 70e-6, 80e-6]))
    assert bound_burst([jumped], 150, 150) == pytest.approx(160e-6 * np.log(2) / np.log(2.5))
    assert bound_burst([], 150, 150) == np.inf
    assert bound_burst([replace(jumped, settlement=-jumped.settlement)], 150, 150) == np.inf
    # a burst of 200 um in the window behind a second jump: 330 um since cycle 60 are the bound
    burst = Jumped(np.array([150, 285, 300]), np.array([80e-6, 130e-6, 330e-6]))
    since_first = 2 * 330e-6 * np.log(2) / np.log(5)
    assert bound_burst([jumped, burst], 300, 300) == pytest.approx(since_first)
    # a body that rose in the last window is bounded by all before it
    risen = Jumped(np.array([150, 285, 300]), np.array([80e-6, 70e-6, 60e-6]))
    since_first = 2 * 60e-6 * np.log(2) / np.log(5)
    assert bound_burst([jumped, risen], 300, 300) == pytest.approx(since_first)


def test_room_that_jumps_found() -> None:
    """By hand, in um: all is tried until a jump fails; then twice what had room, half of the
    smallest try where nothing had; what is asked for within the room leaves it."""

    def jump(cycle: int, asked: float, got: float, attempt: int) -> Outcome:
        notes = {"asked": 1e-6 * asked, "gain": 1e-6 * got, "attempt": attempt}
        return Outcome("jump", cycle, cycle + 10, [], {}, notes=notes)

    made = [
        (jump(10, 30, 30, 1), np.inf),
        (jump(40, 100, 50, 2), 100),
        (jump(70, 150, 25, 3), 50),
        (jump(100, 400, 0, 4), 50 / 8),
        (jump(130, 500, 6.25, 1), 12.5),
        (jump(160, 2, 2, 1), 12.5),
        (jump(190, 0, 0, 1), 12.5),
        (jump(220, 400, 8, 1), 16),
        (jump(250, 60, 20, 1), 40),
    ]
    jumps = [one for one, _ in made]
    assert find_known_room([], 1000) == np.inf
    for one, room in made:
        assert 1e6 * find_known_room(jumps, one.last_cycle) == pytest.approx(room)


def test_a_jump_of_no_settlement_is_tried_with_less_of_its_move(tmp_path, monkeypatch) -> None:
    """History asks the first jump for nothing, and what its grains move beside one another has no
    room: tried with less and less of that, the run goes on from where they were."""
    no_room(
        monkeypatch,
        lambda before, target, _: (
            before.cycle == 40 and not np.array_equal(target, before.position)
        ),
    )
    monkeypatch.setattr(jump_fixed, "estimate_gains", lambda *_: stages.Gains(0.0, 0.0))
    settle(tmp_path / "run", 'procedure.settlement="history"', "procedure.total_cycles=90")
    jump = next(one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump")
    assert (jump.notes["attempt"], jump.notes["gain"]) == (4, 0.0)


@pytest.mark.long
def test_a_jammed_bed_is_moved_by_what_it_has_room_for(tmp_path, monkeypatch) -> None:
    """No move of more than 2 um has room, where 8, 4 and less are asked for: every jump but the
    first ones moves the bed, and by no less than half of that from then on."""
    no_room(monkeypatch, lambda before, target, _: drop(before, target) > 2e-6)
    keys = ('procedure.settlement="history"', "procedure.h=20", "procedure.total_cycles=400")
    settle(tmp_path / "run", *keys)
    jumps = [one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump"]
    got = [one.notes["gain"] for one in jumps]
    assert len(got) == 8
    assert all(1e-6 <= move <= 2e-6 for move in got[1:])
    assert jumps[-1].notes["asked"] > 8e-6


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Window]:
    """A finished run on the fake engine, with its control, and its window from cycle 20 to 40."""
    path = tmp_path_factory.mktemp("finished") / "run"
    settle(path, control=True)
    manifest = RunFolder(path).manifest()
    scene = load_scene(path / "scene.toml", manifest["overrides"])
    run = Run(scene, RunFolder(path), get_engine("fake"), Variant(), QUIET)
    return run, load_window(path / "window_000020" / "states.npz")


def test_a_run_and_its_control(finished: tuple[Run, Window]) -> None:
    """Against u = a ln(1 + N): the log law fits N, which differs by 1/N, less than 1 % here; the
    piston goes down with the bed, never up.  The control has no jump, and its files before the
    first jump are those of the procedure."""
    run = finished[0].folder.path
    rows, control = read_rows(run), read_rows(run / "control")
    assert float(rows[-1]["mean_grain_settlement"]) == pytest.approx(
        SETTLEMENT * np.log(1 + 100), rel=0.01
    )
    assert next(float(row["mean_grain_settlement"]) for row in rows if row["kind"] == "jumped") > 0
    start = load_window(run / "window_000000" / "states.npz").piston_start
    for row in rows:  # the loaded body's own settlement, jumped rows too
        sunk = start - float(row["piston_height"])
        assert float(row["loaded_body_settlement"]) == pytest.approx(sunk, abs=1e-15)
    # the fake bed gives way by 1 um a newton under the quarter of the piston that is computed
    assert float(rows[-1]["stiffness"]) == pytest.approx(4e6, rel=0.05)
    before = load_window(run / "window_000020" / "states.npz").piston_heights()[-1]
    after = load_window(run / "window_000060" / "states.npz").piston_start
    assert after <= before
    assert before - after == pytest.approx(SETTLEMENT * np.log(61 / 41), rel=0.05)
    assert all(row["kind"] == "computed" for row in control)
    assert [int(row["cycle"]) for row in control] == list(range(1, 101))
    shared = Path("window_000020") / "states.npz"
    assert (run / "control" / shared).samefile(run / shared)


@pytest.mark.parametrize("per_cycle", [-2e-6, 0.0, 3e-6])
def test_a_jump_lowers_the_piston_by_its_law_and_never_lifts_it(
    finished: tuple[Run, Window], per_cycle: float
) -> None:
    """Heights that go as a ln N give a drop of a ln(60 / 40) over 20 cycles where they fall; a
    piston that rose in the window, as a loose grain may lift it, is placed where it is."""
    run, window = finished
    heights = 0.05 + per_cycle * np.log(window.cycle[1:])
    at_ends = np.searchsorted(window.piston.time_step, window.time_step[1:])
    height = window.piston.height.copy()
    height[at_ends] = heights
    seen = replace(window, piston=replace(window.piston, height=height), piston_start=0.05)
    _, _, placed = stages.estimate(run, seen, 0, 20)
    expected = heights[-1] + min(per_cycle, 0.0) * np.log(60 / 40)
    assert placed == pytest.approx(expected, abs=1e-15)
    assert placed <= heights[-1]


def test_rolling_spheres_have_two_fifths_of_their_motion_in_their_spin(
    finished: tuple[Run, Window],
) -> None:
    """A solid sphere has I = 2/5 m r^2: where v = omega r, of any radius, a row of settlement.csv
    has kinetic energies in the ratio 2/5."""
    run, window = finished
    assert np.ptp(window.radius) > 0
    spin = np.random.default_rng(0).standard_normal(window.spin.shape)
    rolling = replace(window, spin=spin, velocity=spin * window.radius[:, None])
    rows = stages.make_settlement_rows(run, rolling, 0)
    for row in rows:
        assert row["kinetic_rotational"] / row["kinetic_translational"] == pytest.approx(0.4)
    linear = 0.5 * np.einsum("n,ni->", window.mass * window.radius**2, spin[1] ** 2)
    assert rows[0]["kinetic_translational"] == pytest.approx(float(linear), rel=1e-12)


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    """Nothing is written among a user's own files."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.txt").write_text("mine")
    with pytest.raises(UsageError, match="something else"):
        settle(tmp_path / "run")


def test_costs_add_up(tmp_path: Path) -> None:
    """Every stage names its CPU time by purpose, none negative, and the sum is what was spent."""
    import time

    start = time.process_time()
    settle(tmp_path / "run")
    spent = time.process_time() - start
    costs = [
        json.loads((tmp_path / "run" / name / "outcome.json").read_text())["cost"]
        for name in stages_of(tmp_path / "run")
    ]
    assert all(value >= -1e-9 for cost in costs for value in cost.values())
    inside = sum(v for cost in costs[1:] for k, v in cost.items() if k != "start_up")
    assert inside <= 1.1 * spent + 0.05
