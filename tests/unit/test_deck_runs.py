"""Runs of decks beside a bed that settles by a law: what is computed, jumped, tried again, kept."""

from __future__ import annotations

import csv
import re
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adapters.decks import run as decks
from adapters.decks.adopt import adopt
from adapters.decks.check import is_checked, keep_check
from adapters.decks.jump import jump
from adapters.decks.record import read_deck_record
from adapters.decks.scene import load_deck_scene
from adapters.decks.states import load_states
from adapters.errors import EngineFailed, SceneError
from adapters.files import RunFolder
from adapters.procedure import describe_result
from adapters.procedure.run import STATE_BYTES
from tests.unit.test_yade_scripts import cut, write_script
from trackbed import command

RATE = np.array([1.0, 2.0, 1.5, 1.5]) * 1e-4
"""Settlement of each grain a unit of ln N [m]; the loaded body's is thrice that of the first."""
PLACES = np.array([[0.0, 0, 0], [0, 0, 0.01], [0.1, 0, 0], [0, 0.1, 0]])
RADIUS = 0.005
KEYS = {"k_i": 5, "k": 4, "h": 10, "healing_cycles": 2, "total_cycles": 60,
        "move": '"per-grain"'}  # fmt: skip


@dataclass
class Bed:
    """An engine that knows a law: grains sink by rate ln N, and go on from where they are put."""

    rate: np.ndarray = field(default_factory=RATE.copy)
    radius: float = RADIUS  # [m]; 0 of clumps
    bend: float = 0.0  # of the law: ln N + bend (ln N)^2
    thrown: float = np.inf  # greatest move that a bed takes calmly [m]
    speed: float = 1.0  # of grains thrown by a greater one, over those at rest
    stopped: int = 0  # windows until something from outside ends the engine; 0: never
    texts: list[str] = field(default_factory=list)

    def run(self, bed: Any, text: str, path: Path) -> float:
        """Do what `run_deck` does with a deck; returns a CPU time."""
        folder, window = path.parent, re.search(r"'window', .*\), (\d+), ", text)
        assert window or re.search(r"'prepare', .*\), 0, ", text)
        self.texts.append(folder.name)
        self.stopped -= 1
        if self.stopped == 0:
            error = EngineFailed("ended by SIGTERM")
            error.from_outside = True
            raise error
        start, speed, healed = [0.0, *PLACES[:, 2], 1.0 if bed.loaded else np.nan], 1.0, 1.0
        if window:
            with (folder / "cycle_0.restart").open("rb") as stream:
                start = [*np.load(stream)]
            if (folder / "moved.npz").exists():
                moved = np.load(folder / "moved.npz")
                start[1:-1] += moved["move"][:, 2]
                start[-1] -= moved["drop"]
                start[0] = np.exp((PLACES[0, 2] - start[1]) / self.rate[0])
                speed = self.speed if np.abs(moved["move"]).max() > self.thrown else 1.0
                healed = 5.0
        for number in range(int(window[1]) + 1 if window else 1):
            cycle = start[0] + number
            before, after = (np.log(max(at, 1)) for at in (start[0], cycle))
            grown = after - before + self.bend * (after**2 - before**2)
            place = np.column_stack([PLACES[:, :2], start[1:-1] - self.rate * grown])
            height, size = start[-1] - 3 * self.rate[0] * grown, np.full(4, self.radius)
            moving = np.full((4, 3), speed * (healed if number == 1 else 1.0))
            np.savez(folder / f"cycle_{number}.npz", identifier=np.arange(4), radius=size,
                     mass=np.ones(4), position=place, height=height, velocity=moving)  # fmt: skip
            with (folder / f"cycle_{number}.restart").open("wb") as stream:
                np.save(stream, [cycle, *place[:, 2], height])
        return 1.0


@pytest.fixture
def bed(monkeypatch: pytest.MonkeyPatch) -> Bed:
    """The bed in place of an engine."""
    there = Bed()
    monkeypatch.setattr(decks, "run_deck", lambda *given: there.run(*given))
    monkeypatch.setattr(decks, "get_engine", lambda name: SimpleNamespace(version=lambda: "1"))
    return there


def settle(
    folder: Path, body: str = "plate", control: bool = False, made: str = "append", **keys: object
) -> RunFolder:
    """A run of a script on the bed, whose bodies are ``made`` by a method of YADE's."""
    path = folder / "bed" / "scene.toml"
    if not path.exists():
        text = cut("O.run(5)", f"plate = O.bodies[3]\nO.bodies.{made}(sphere)")
        path = adopt(write_script(folder, text), "yade").scene
    words = [f"procedure.{key}={value}" for key, value in (KEYS | keys).items()]
    words.append(f'deck.loaded_body="{body}"')
    decks.run_deck_scene(path, folder / "run", control=control, overrides=words)
    return RunFolder(folder / "run")


def list_spans(run: RunFolder) -> list[tuple[str, int, int]]:
    """Stages of a run with the cycles before and behind them."""
    return [(one.stage[0], one.first_cycle, one.last_cycle) for one in run.outcomes()]


SPANS = [("p", 0, 0), ("w", 0, 5), ("w", 5, 9), ("j", 9, 19), ("w", 19, 25), ("j", 25, 35),
         ("w", 35, 41), ("j", 41, 51), ("w", 51, 57), ("w", 57, 60)]  # fmt: skip


@pytest.mark.parametrize("settlement", ['"law"', '"history"'])
def test_a_bed_that_follows_the_law_is_jumped_without_error(
    settlement: str, bed: Bed, tmp_path: Path
) -> None:
    """u = a ln N: every cycle once, healing cycles named, and the full run's settlement to
    round-off of places of a centimetre and of a few logarithms."""
    run = settle(tmp_path, control=True, settlement=settlement)
    assert list_spans(run) == SPANS
    full = RunFolder(run.path / "control")
    assert [last for _, _, last in list_spans(full)] == [0, 5, *range(9, 60, 4), 60]
    rows, all_rows = ([row for one in each.outcomes() for row in one.rows] for each in (run, full))
    healing = [row["cycle"] for row in rows if row["kind"] == "healing"]
    assert healing == [20, 21, 36, 37, 52, 53]
    assert bed.texts.count("window_000005") == 1  # the full run begins with the same windows
    truth = {row["cycle"]: row for row in all_rows}
    for row in rows:
        at = truth[row["cycle"]]
        assert at["settlement"] == pytest.approx(RATE.mean() * np.log(row["cycle"]), abs=1e-15)
        assert at["loaded_body"] == pytest.approx(3 * RATE[0] * np.log(row["cycle"]), abs=1e-15)
        for key, scale in (("settlement", 1), ("loaded_body", 3), ("piston_height", 3)):
            assert row[key] == pytest.approx(at[key], abs=1e-10 * scale)
    with (run.path / "settlement.csv").open() as stream:
        assert [int(row["cycle"]) for row in csv.DictReader(stream)] == [r["cycle"] for r in rows]
    mean, body = describe_result(read_deck_record(run.path))
    assert "30 of 60 cycles computed" in mean
    assert body.startswith("sleeper settles 1.23 mm (one member, so no band) by cycle 60;")
    export = tmp_path / "export"
    assert command.main(["export", str(run.path), "--to", "csv", "--into", str(export)]) == 0
    with (export / "grains.csv").open() as stream:
        last = [row for row in csv.DictReader(stream) if row["cycle"] == "60"]
    sunk = [-float(row["displacement_z"]) for row in last]
    assert np.allclose(sunk, RATE * np.log(60), rtol=0, atol=1e-10)
    assert [one.name for one in export.iterdir()] == ["grains.csv"]
    # gone on with, nothing is left to do, though control is not asked for again
    done = len(bed.texts)
    settle(tmp_path, settlement=settlement)
    assert len(bed.texts) == done


def test_history_knows_more_than_the_last_window(bed: Bed, tmp_path: Path) -> None:
    """A bed whose law bends: by law a jump goes on from the window before it, grain by grain, by
    history all cycles have a say."""
    bed.bend, jumped = 0.2, []
    for settlement in ("law", "history"):
        (tmp_path / settlement).mkdir()
        run = settle(tmp_path / settlement, total_cycles=25, settlement=f'"{settlement}"')
        assert list_spans(run) == [*SPANS[:4], ("w", 19, 25)]  # as long as can be, and no longer
        jumped.append(run.outcomes()[3].rows[-1]["settlement"])
        states = load_states(run.path / "window_000005" / "states.npz")
    target = jump(states.position, 10, RADIUS, move="per-grain", first_cycle=5)
    moved = float((PLACES - target)[:, 2].mean())
    assert jumped[0] == pytest.approx(moved, abs=1e-15)
    assert abs(jumped[1] - moved) > 1e-7


@pytest.mark.parametrize(("total", "h", "jumps"), [
    (7, 10, 0), (24, 10, 0), (25, 10, 1), (22, [4, 10], 1),
])  # fmt: skip
def test_a_jump_needs_room_behind_it(
    total: int, h: object, jumps: int, bed: Bed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For itself, its healing and a window: 9 + 10 + 2 + 4 cycles.  States go on from stage to
    stage, and each has its own cost and its room in memory."""
    needed: list[float] = []
    monkeypatch.setattr(decks, "refuse_more_memory", lambda size, *_: needed.append(size))
    began = time.process_time()
    run = settle(tmp_path, total_cycles=total, h=h)
    assert needed[0] == STATE_BYTES * 4 * 6  # four grains at the ends of five cycles, and before
    spent, outcomes = time.process_time() - began, run.outcomes()
    assert sum(one.stage == "jump" for one in outcomes) == jumps
    assert outcomes[-1].last_cycle == total
    first, second = (load_states(run.path / f"window_{n:06d}/states.npz") for n in (0, 5))
    assert second.height[0] == first.height[-1]
    assert np.array_equal(second.position[0], first.position[-1])
    for one in outcomes:
        assert one.cost["engine"] == (one.stage != "jump")
        assert one.cost["other"] >= 0
    assert sum(one.cost["other"] for one in outcomes) <= spent


@pytest.mark.parametrize(("limit", "kept"), [(1.2, 10), (0.6, 5), (0.25, 2), (0.05, 0)])
def test_a_jump_that_throws_grains_is_tried_half_as_long(
    limit: float, kept: int, bed: Bed, tmp_path: Path
) -> None:
    """Thrice in all, each time half as long; then cycles are computed.  A jump from cycle 9 moves
    the fastest grain by its rate times ln(1 + h/9), 0.75, 0.44, 0.20 of it."""
    bed.thrown, bed.speed = limit * RATE.max(), 4.0
    run = settle(tmp_path, total_cycles=30)
    spans = list_spans(run)
    assert spans[3] == (("j", 9, 9 + kept) if kept else ("w", 9, 13))
    assert spans[-1][2] == 30
    failed = [why for one in range(1, 6) if (why := run.failure(f"jump_000009_{one}"))]
    assert len(failed) == {10: 0, 5: 1, 2: 2, 0: 3}[kept]
    assert all("behind the jump the bed moves with" in why for why in failed)


def test_no_try_is_shorter_than_a_cycle(bed: Bed, tmp_path: Path) -> None:
    """From cycle 9 two cycles, then one, then one."""
    bed.thrown, bed.speed = 0.0, 4.0
    settle(tmp_path, h=2, total_cycles=18)
    assert bed.texts[3:6] == ["window_000011", "window_000010", "window_000010"]


@pytest.mark.parametrize(("ratio", "calm"), [(9.5, True), (10.5, False)])
def test_calm_is_ten_times_the_energy_before(ratio: float, calm: bool, bed: Bed, tmp_path) -> None:
    """Of cycle ends behind the healing; the first of it, five times as fast, is no measure."""
    bed.thrown, bed.speed = 0.0, float(np.sqrt(ratio))
    assert (("j", 9, 19) in list_spans(settle(tmp_path, total_cycles=30))) is calm


@pytest.mark.parametrize(("share", "made", "allowed"), [
    (0.95, "append", True), (1.05, "append", False), (1.05, "appendClumped", True),
])  # fmt: skip
def test_a_jump_that_presses_grains_is_tried_half_as_long(
    share: float, made: str, allowed: bool, bed: Bed, tmp_path: Path
) -> None:
    """A tenth of a radius nearer is allowed: two grains that touch come D ln(19/9) nearer.  Of
    clumps no surface is known."""
    bed.radius *= made == "append"
    bed.rate[1] = bed.rate[0] + share * 0.1 * RADIUS / np.log(19 / 9)
    run = settle(tmp_path, total_cycles=30, made=made)
    assert (("j", 9, 19) in list_spans(run)) is allowed
    assert bool(run.failure("jump_000009_1")) is not allowed


def test_what_ends_the_engine_from_outside_ends_the_run(bed: Bed, tmp_path: Path) -> None:
    """No jump is to blame for it; the run goes on where it was, and tries no jump again."""
    bed.stopped, bed.thrown, bed.speed = 5, 0.6 * RATE.max(), 4.0  # behind the second try
    with pytest.raises(EngineFailed, match="SIGTERM"):
        settle(tmp_path)
    run = RunFolder(tmp_path / "run")
    spans = list_spans(run)
    assert spans == [*SPANS[:3], ("j", 9, 14)]
    assert [bool(run.failure(f"jump_000009_{n}")) for n in (1, 2)] == [True, False]
    decks.resume_deck(run.path)
    assert list_spans(run)[:4] == spans
    assert list_spans(run)[-1][2] == 60
    assert not (run.path / "control").exists()
    assert bed.texts.count("window_000019") == 1


def test_a_bed_without_a_loaded_body_has_its_mean_grain(bed: Bed, tmp_path: Path) -> None:
    run = settle(tmp_path, body="")
    row = run.outcomes()[-1].rows[-1]
    assert (row["loaded_body"], row["piston_height"]) == (None, None)
    assert row["settlement"] == pytest.approx(RATE.mean() * np.log(60), abs=1e-10)
    said = describe_result(read_deck_record(run.path))
    assert len(said) == 1
    assert said[0].startswith("mean grain settles 614 um; 30 of 60 cycles computed")


def test_a_deck_that_was_never_checked_is_named(bed: Bed, tmp_path, capsys) -> None:
    settle(tmp_path, total_cycles=6)
    said = capsys.readouterr().err
    assert "never checked that windows compute its bed" in said
    first = "cycle 5, settlement of the mean grain 241.42 um, of the loaded body 482.83 um"
    assert f"window_000000: {first}" in said
    scene = tmp_path / "bed" / "scene.toml"
    keep_check(scene, load_deck_scene(scene, ['deck.loaded_body="plate"'])[1])
    settle(tmp_path, total_cycles=6)
    assert "never checked" not in capsys.readouterr().err
    copy = scene.with_name("bed.py")
    copy.write_text(copy.read_text().replace("O.run(5)", "O.run(6)"))
    with pytest.raises(SceneError, match="differs from the one this run was started with"):
        settle(tmp_path, total_cycles=6)
    copy.write_text(copy.read_text().replace("O.run(6)", "O.run()"))
    with pytest.raises(SceneError, match="never ends"):
        settle(tmp_path, total_cycles=6)


def test_what_a_deck_calls_after_cycles_stays(bed: Bed, tmp_path: Path) -> None:
    """Pictures and folders of the user's, beside states of ours, which go."""
    run = bed.run
    bed.run = lambda given, text, path: (  # type: ignore[method-assign]
        (path.parent / "cycle_frames").mkdir() or (path.parent / "cycle_1.png").touch()
        or run(given, text, path)
    )  # fmt: skip
    window = settle(tmp_path, total_cycles=6).path / "window_000000"
    assert [one.name for one in sorted(window.glob("cycle*"))] == ["cycle_1.png", "cycle_frames"]


def test_a_file_that_the_deck_reads_is_part_of_it(bed: Bed, tmp_path: Path) -> None:
    """Changed between two runs, nothing is gone on with, and the check counts no more."""
    text = cut("O.run(5)", "import helpers\nplate = O.bodies[3]")
    scene = adopt(write_script(tmp_path, text), "yade").scene
    settle(tmp_path, total_cycles=6)
    keep_check(scene, load_deck_scene(scene)[1])
    scene.with_name("helpers.py").write_text("def pull(g):\n    return 0, 0, -2 * g\n")
    assert not is_checked(scene, load_deck_scene(scene)[1])
    with pytest.raises(SceneError, match="differs from the one this run was started with"):
        settle(tmp_path, total_cycles=6)
