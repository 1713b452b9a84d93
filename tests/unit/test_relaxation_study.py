"""The study of relaxations: its minimisers, its measures, and its record."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.container import Container
from adapters.state import Contacts
from adapters.window import PistonTrack, Window
from validation import relaxation_runs
from validation.cases.relaxation import STIFFNESS, state_at_rest
from validation.relaxation_beds import cycles_of, history_kept
from validation.relaxation_engine import drag_critical
from validation.relaxation_jumps import Jumped, per_grain
from validation.relaxation_measures import figures_before, measured
from validation.relaxation_rivals import minimised

RADIUS, CARRIED, PRESSED = 3e-3, 1e-7, 2e-5
MARKS = (10, 100, 1000, 3000)


def two_grains(height: float = 0.05) -> Jumped:
    """Two grains in touch, far from every wall or on the floor, pressed together by a jump."""
    x = np.array([[0.05, 0.05, height], [0.05 + 2 * RADIUS - CARRIED, 0.05, height]])
    estimate = x + np.array([[PRESSED / 2, 0, 0], [-PRESSED / 2, 0, 0]])
    walls = Container("box", size_x=0.1, size_y=0.1).walls()
    return Jumped("two", state_at_rest(x, np.full(2, RADIUS)), estimate, walls, STIFFNESS)


@pytest.mark.parametrize("method", ["gradient", "lbfgs", "fire"])
def test_minimisers_part_two_grains(method: str) -> None:
    """Contacts alone: two equal grains part symmetrically, until next to nothing presses them.

    Each gives at least half the overlap; a first step that pays may overshoot.
    """
    if method == "fire":
        pytest.importorskip("ase")
    jump = two_grains()
    way = minimised(jump, "hertz", method, MARKS)
    assert way[-1].ended
    moved = way[-1].position - jump.estimate
    np.testing.assert_allclose(moved[0], -moved[1], atol=1e-15)
    found = measured(jump, way[-1].position)
    assert found["overlap"] < 1e-2 * CARRIED
    half = (PRESSED + CARRIED) / 2
    assert 0.99 * half < found["move_greatest"] < 4.1 * half
    evaluations = [noted.evaluations for noted in way]
    assert evaluations == sorted(evaluations)


@pytest.mark.parametrize("method", ["gradient", "lbfgs"])
def test_frontier_is_held(method: str) -> None:
    """Eq. 29: grains that touch a wall before the jump stay where they are estimated."""
    jump = two_grains(height=RADIUS - CARRIED)
    for noted in minimised(jump, "eq29", method, (10,)):
        np.testing.assert_array_equal(noted.position, jump.estimate)


def test_measures_by_hand() -> None:
    """One contact of two grains: kept, its overlaps, and the error of the contacts a grain."""
    jump = two_grains()
    before = figures_before(jump)
    assert before["overlap"] == pytest.approx(CARRIED)
    assert before["coordination"] == 1
    pressed = measured(jump, jump.estimate)
    assert pressed["overlap"] == pytest.approx(CARRIED + PRESSED)
    assert (pressed["kept"], pressed["coordination_error"], pressed["move_rms"]) == (1, 0, 0)
    apart = measured(jump, jump.before.position + np.array([[0, 0, 0], [1e-3, 0, 2e-3]]))
    assert (apart["kept"], apart["coordination_error"], apart["overlap"]) == (0, -1, 0)
    assert apart["height"] == pytest.approx(1e-3)


def test_drag_damps_the_mean_contact_critically() -> None:
    """c = 2 sqrt(m S_n) with S_n = 2 E* sqrt(R* delta), R* = r/2."""
    jump = two_grains()
    stiffness = 2 * STIFFNESS.grain * np.sqrt(RADIUS / 2 * CARRIED)
    expected = 2 * np.sqrt(jump.before.mass[0] * stiffness)
    assert drag_critical(jump) == pytest.approx(expected, rel=1e-6)


def test_estimate_is_the_law_of_each_grain() -> None:
    """Paths c - a ln N of each grain are met exactly, without clipping or smoothing."""
    generator = np.random.default_rng(0)
    start, rate = generator.random((5, 3)), 1e-5 * generator.random((5, 3))
    cycle = np.arange(10, 21).astype(float)

    def at(cycles: np.ndarray) -> np.ndarray:
        return start - rate * np.log(cycles)[:, None, None]

    found = per_grain(cycle, at(cycle), np.full(5, RADIUS), 30)
    np.testing.assert_allclose(found, at(np.array([50.0]))[0], atol=1e-14)


def contacts(pairs: list[list[int]], force: list[float]) -> Contacts:
    """Contacts with tangential forces along x and normal forces twice as great along z [N]."""
    vector = np.outer(force, [1.0, 0, 0])
    normal = 2 * np.outer(force, [0, 0, 1.0])
    return Contacts(np.array(pairs), np.ones(len(pairs)), normal, vector, vector)


def test_history_by_hand() -> None:
    """Two of three pairs stay and carry half; behind the first cycle a new one carries more."""
    before = contacts([[1, 2], [1, 3], [2, 3]], [1.0, 2.0, 1.0])
    start = contacts([[1, 2], [2, 3], [3, 4]], [1.0, 1.0, 0.0])
    found = history_kept(before, start, contacts([[3, 4]], [6.0]))
    assert found == pytest.approx(
        {
            "pairs_kept": 2 / 3,
            "tangential_start": 0.5,
            "tangential_first": 1.5,
            "normal_start": 0.5,
        }
    )


def test_cycles_cut_from_a_window() -> None:
    """States, piston's record and heights of the cycles asked for, and of these only."""
    cycles, steps = 5, 100
    step = 1000 + steps * np.arange(cycles + 1)
    position = np.arange(cycles + 1.0)[:, None, None] * np.ones((1, 2, 3))
    track_step = np.arange(1010, 1501, 10)
    ramp = track_step.astype(float)
    track = PistonTrack(track_step, ramp, ramp, 1e-6 * ramp, ramp, ramp)
    none = contacts([[1, 2]], [1.0])
    one, still = np.ones(2), 0 * position
    window = Window(
        40, step, np.arange(1, 3), one, one, position, still, still,
        {"floor": position}, (none,) * (cycles + 1), track, 7.0,
    )  # fmt: skip
    part = cycles_of(window, 2, 4)
    assert (part.first_cycle, len(part)) == (42, 2)
    np.testing.assert_array_equal(part.position, position[2:5])
    np.testing.assert_array_equal(part.wall_force["floor"], position[2:5])
    np.testing.assert_array_equal(part.piston.time_step, np.arange(1210, 1401, 10))
    np.testing.assert_allclose(part.piston_heights(), 1e-6 * np.array([1200, 1300, 1400]))
    assert len(cycles_of(window, 0, 5)) == 5
    assert cycles_of(window, 0, 5).piston_start == 7.0
    assert replace(part, first_cycle=0).cycle.tolist() == [0, 1, 2]


def test_record_goes_on_where_it_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that is in the record is not run again; one that fails leaves the others."""
    ran: list[str] = []

    def rows(_work: Path):  # type: ignore[no-untyped-def]
        for way in ("a", "b", "c"):

            def filled(way: str = way) -> dict[str, int]:
                if way == "c" and len(ran) < 3:
                    ran.append("stopped")
                    raise KeyboardInterrupt
                ran.append(way)
                return {"value": 1}

            yield {"kind": "bed", "bed": "one", "way": way}, filled

    monkeypatch.setattr(relaxation_runs, "bed_rows", rows)
    record = tmp_path / "record.jsonl"
    (tmp_path / "work").mkdir()
    with pytest.raises(KeyboardInterrupt):
        relaxation_runs.go_on(["bed"], tmp_path / "work", record)
    assert [row["way"] for row in relaxation_runs.record_read(record)] == ["a", "b"]
    relaxation_runs.go_on(["bed"], tmp_path / "work", record)
    assert [row["way"] for row in relaxation_runs.record_read(record)] == ["a", "b", "c"]
    assert ran == ["a", "b", "stopped", "c"]
