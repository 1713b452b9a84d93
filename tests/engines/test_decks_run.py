"""Runs of adopted decks: what is moved in a restart file moves in the engine, and jumps go on."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from adapters.decks.adopt import adopt
from adapters.decks.check import check_cut
from adapters.decks.engine import Adopted, run_deck
from adapters.decks.parse import BEGIN
from adapters.decks.run import run_deck_scene
from adapters.decks.scene import load_deck_scene
from adapters.decks.split import format_whole, format_window
from adapters.decks.states import States, load_states, read_states
from adapters.errors import SceneError
from adapters.files import EXCHANGE, RunFolder, read_frames
from adapters.files.restart import find_mesh, move_grains, move_stones
from tests import own_decks
from tests.unit.test_own_decks import write_deck
from trackbed import command

HEAD = own_decks.LIGGGHTS.partition(BEGIN)[0]
STEP = f"{BEGIN}\nrun 1\n# trackbed: end\n"
SHIFT = np.array([2e-6, -1e-6, 1e-5])
"""Of all grains together [m]: no overlap changes but those with walls."""


def step_moved(bed: Adopted, folder: Path, shift: np.ndarray = SHIFT) -> tuple[States, States]:
    """States before a step of time, and behind it from grains and plate moved by ``shift``."""
    run_deck(bed, format_whole(bed.deck, bed.engine, 0), folder / "prepare.in")
    before = read_states(folder, 0, 0, bed)
    restart = bytearray((folder / "cycle_0.restart").read_bytes())
    move = np.broadcast_to(shift, before.position[0].shape)
    if bed.stones:
        move_stones(restart, bed.stones, before.identifier, move)
    else:
        place, velocity = before.last[:, 1:4], before.last[:, 4:]
        move_grains(restart, before.identifier, place, velocity, move, before.period)
    for height in find_mesh(restart, *bed.loaded) if bed.loaded else ():
        height += shift[2]
    (folder / "cycle_0.restart").write_bytes(restart)
    run_deck(bed, format_window(bed.deck, bed.engine, 1), folder / "window.in")
    return before, read_states(folder, 1, 1, bed)


@pytest.mark.long
@pytest.mark.parametrize(("engine", "text"), [
    pytest.param("liggghts", HEAD + own_decks.PLATE + STEP, marks=pytest.mark.engine("liggghts")),
    pytest.param("liggghts", own_decks.STONES.partition(BEGIN)[0] + STEP,
                 marks=pytest.mark.engine("liggghts")),
    pytest.param("lammps", own_decks.LAMMPS.partition(BEGIN)[0] + STEP,
                 marks=pytest.mark.engine("lammps")),
], ids=["spheres and plate", "stones", "lammps"])  # fmt: skip
def test_the_engine_goes_on_from_where_grains_were_put(engine: str, text: str, tmp_path) -> None:
    """From rest a step of 2e-5 s carries none further than a dt^2, 4e-6 m under a thousand weights.
    Bodies take their spheres with them; the plate is where it was put, to round-off."""
    bed = load_deck_scene(adopt(write_deck(tmp_path, text), engine).scene, [
        f'deck.loaded_body="{"plate" if "fix plate" in text else ""}"'
    ])[1]  # fmt: skip
    before, after = step_moved(bed, tmp_path)
    far = after.position[0] - before.position[0] - SHIFT
    assert np.abs(far).max() < 1000 * 9.81 * 2e-5**2
    frames = (next(iter(read_frames(tmp_path / f"cycle_{c}.dump"))) for c in (0, 1))
    first, last = (frame.block("x", "y", "z") for frame in frames)
    assert np.abs(last - first - SHIFT).max() < 1000 * 9.81 * 2e-5**2
    if bed.loaded:
        assert after.height[0] - before.height[0] == pytest.approx(SHIFT[2], abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(("engine", "text"), [
    pytest.param("liggghts", HEAD + STEP, marks=pytest.mark.engine("liggghts")),
    pytest.param("lammps", own_decks.LAMMPS.partition(BEGIN)[0] + STEP,
                 marks=pytest.mark.engine("lammps")),
])  # fmt: skip
def test_a_periodic_bed_is_the_same_wherever_it_is_put(engine: str, text: str, tmp_path) -> None:
    """Moved by half a period, and over the side, all grains go on as from where they were: from
    rest, a step carries none further than a thousand weights do, and no period is lost."""
    text = text.replace("boundary f f f", "boundary p p f").replace(
        "block -0.001 0.061 -0.001 0.061", "block 0 0.06 0 0.06", 1
    )
    text = text.replace("include walls.in\n", own_decks.WALLS.splitlines()[-1] + "\n").replace(
        "region bed block 0 0.06 0 0.06 0 0.2", "region bed block -1 1 -1 1 0 0.2"
    )
    bed = load_deck_scene(adopt(write_deck(tmp_path, text), engine).scene)[1]
    shift = np.array([0.03, -0.03, 0.0])
    before, after = step_moved(bed, tmp_path, shift)
    assert before.period[:2].tolist() == [[0, 0.06]] * 2
    assert np.ptp(before.last[:, 1]) > 0.05
    far = after.position[0] - before.position[0] - shift
    assert np.abs(far).max() < 1000 * 9.81 * 2e-5**2


KEYS = {"total_cycles": 30, "k_i": 6, "k": 4, "h": 5, "healing_cycles": 2, "settlement": '"law"'}


@pytest.mark.long
@pytest.mark.parametrize(("engine", "text"), [
    pytest.param("liggghts", own_decks.LIGGGHTS, marks=pytest.mark.engine("liggghts")),
    pytest.param("lammps", own_decks.LAMMPS, marks=pytest.mark.engine("lammps")),
])  # fmt: skip
def test_a_deck_is_run_with_jumps_and_a_full_run_beside_it(
    engine: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every cycle is computed or jumped once; the full run is the deck itself, to the last bit."""
    scene = adopt(write_deck(tmp_path, text), engine).scene
    words = [word for key, value in KEYS.items() for word in ("--set", f"procedure.{key}={value}")]
    assert command.main(["run", str(scene), "--control", *words]) == 0
    run = RunFolder(scene.parent / "run")
    spans = [(one.stage, one.first_cycle, one.last_cycle) for one in run.outcomes()]
    assert [last for _, _, last in spans][:-1] == [first for _, first, _ in spans][1:]
    assert ("jump", 10, 15) in spans
    assert spans[-1][2] == 30
    bed = load_deck_scene(scene)[1]
    (tmp_path / "whole").mkdir()
    run_deck(bed, format_whole(bed.deck, engine, 30), tmp_path / "whole" / "whole.in")
    last = read_states(tmp_path / "whole", 30, 30, bed).position[0]
    control = RunFolder(run.path / "control")
    states = load_states(control.path / control.stage_names()[-1] / "states.npz")
    assert np.array_equal(states.position[-1], last)
    assert command.main(["status", str(run.path)]) == 0
    said = capsys.readouterr().out
    assert "; error " in said.splitlines()[-1]
    assert re.search(r"control cycle +30\n", said)
    assert command.main(["report", str(run.path)]) == 0
    assert "mean grain settles" in (run.path / "report.html").read_text()
    # once more: nothing is left to compute, and a longer run is another run
    events = len(run.events())
    assert command.main(["resume", str(run.path)]) == 0
    assert [one["event"] for one in run.events()[events:]] == ["engine"]
    with pytest.raises(SceneError, match="differs from the one this run was started with"):
        run_deck_scene(scene, run.path, overrides=["procedure.total_cycles=50"])


@pytest.mark.long
@pytest.mark.parametrize("engine", [
    pytest.param(name, marks=pytest.mark.engine(name)) for name in ("liggghts", "lammps")
])  # fmt: skip
def test_grains_that_break_and_wear_are_followed(engine: str, tmp_path: Path, capsys) -> None:
    """Grain 7 breaks in two in the second and in the eighth cycle: windows are one process to the
    last bit; a jump moves who is there, and throws nobody; masses are those of spheres."""
    (tmp_path / "early").mkdir()
    early = write_deck(tmp_path / "early", own_decks.break_grains(engine, 2))
    found = check_cut(load_deck_scene(adopt(early, engine).scene)[1], tmp_path)
    assert found.place.tolist() == [0, 0]
    new = [found.grains - 1, found.grains]
    scene = adopt(write_deck(tmp_path, own_decks.break_grains(engine, 8)), engine).scene
    keys = [f"procedure.{key}={value}" for key, value in (KEYS | {"h": 2}).items()]
    run_deck_scene(scene, scene.parent / "run", overrides=[*keys, "procedure.total_cycles=18"])
    run = RunFolder(scene.parent / "run")
    assert [(o.stage, o.last_cycle) for o in run.outcomes()][3:5] == [("jump", 12), ("window", 18)]
    rows = {row["cycle"]: row for one in run.outcomes() for row in one.rows}
    grain = 2500 * np.pi / 6 * 0.01**3
    worn = grain * (0.994**3 - 0.993**3)  # the seventh cycle's wear was the sixth
    assert [rows[8][key] for key in EXCHANGE] == pytest.approx([2, grain / 4, 1, grain, worn])
    assert not any(rows[cycle]["grains_came"] for cycle in rows.keys() - {8})  # None where jumped
    after = load_states(run.path / "window_000012/states.npz")
    assert after.identifier.tolist() == [n for n in range(1, new[1] + 1) if n != 7]
    assert after.radius[[4, -1]] == pytest.approx([0.005 * (1 - 0.001 * 15), 0.0025], rel=1e-9)
    assert np.ptp(after.position, axis=0).max() < 0.01  # a diameter in six cycles
    assert command.main(["status", str(run.path)]) == 0
    assert "2 grains of 0.000327 kg came, 1 of 0.00131 kg went, " in capsys.readouterr().out
    assert command.main(["export", str(run.path), "--to", "csv"]) == 0
    last = (run.path / "export" / "grains.csv").read_text().splitlines()[-len(after.identifier) :]
    assert [int(line.split(",")[1]) for line in last if "nan" in line] == new
