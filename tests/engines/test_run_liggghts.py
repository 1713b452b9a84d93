"""Whole runs on LIGGGHTS with forty soft grains: what it does to the last bit, and other scenes.

What every engine promises is in ``test_engine_contract.py``, its kills and decks in
``test_liggghts.py``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import Contacts
from adapters.engines import decks
from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, load_window, read_window
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from trackbed.scenes import scene_path

pytestmark = pytest.mark.engine("liggghts")

ENGINE = LiggghtsEngine()
COARSE = scene_path("karrech-coarse")
QUIET = Progress(quiet=True)
TINY = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=1e9",
    "loading.piston_mass=0.001",
    "procedure.k_i=6",
    "procedure.k=4",
    "procedure.h=6",
    "procedure.healing_cycles=2",
    "procedure.total_cycles=22",
)
"""Forty grains, about 6,000 steps a cycle, one jump from cycle 10 to 16."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the tiny scene."""
    folder = tmp_path_factory.mktemp("tiny") / "run"
    run_scene(COARSE, folder, overrides=TINY, progress=QUIET)
    return folder


def window_of(run: Path, name: str) -> Window:
    return load_window(run / name / "states.npz")


def springs(contacts: Contacts) -> dict[tuple[int, int], bytes]:
    """Tangential springs by pair, bit for bit."""
    return {
        (int(i), int(j)): spring.tobytes()
        for (i, j), spring in zip(contacts.pair, contacts.tangential_spring, strict=True)
    }


def test_resubmission_keeps_every_tangential_spring(run: Path, tmp_path: Path) -> None:
    """h = 0: positions and springs before the first step are those saved, bit for bit."""
    scene, stage, folder = load_scene(COARSE, TINY), "window_000006", tmp_path / "again"
    before = window_of(run, stage).state(-1)
    still = np.zeros_like(before.position)
    outcome = RunFolder(run).outcome(stage)
    assert outcome is not None
    folder.mkdir()
    start = EngineStart(
        run / stage / "end.restart",
        outcome.notes["time_step"],
        outcome.notes["piston_mesh"] + 1,
        before.piston_height,
        moved=before.moved(before.position, velocity=still, spin=still),
    )
    digests = ENGINE.write_cycles(scene, start, 1, folder)
    ENGINE.run(scene, "in.cycles", folder, lambda: None, digests)
    names = ENGINE.wall_names(scene, piston=True)
    window = read_window(folder, before.cycle, names, before.piston_height)
    assert np.array_equal(window.position[0], before.position)
    assert not window.velocity[0].any()
    assert len(before.contacts) > 20
    assert springs(window.contacts[0]) == springs(before.contacts)


def test_piston_follows_its_target_and_is_not_lifted(run: Path) -> None:
    """Root mean square of the force error below 3 % of the peak after three cycles; behind the
    jump it stands where the relaxed bed has it, no higher than before."""
    steps = load_scene(COARSE, TINY).steps_per_cycle
    before, after = (window_of(run, name) for name in ("window_000006", "window_000016"))
    for window in (window_of(run, "window_000000"), after):
        assert window.piston.force_error(steps)[3:].max() < 0.03
    assert after.piston_start <= before.piston_heights()[-1]


@pytest.mark.parametrize(
    "changes",
    [
        ("material.grain.friction=0.0", "material.wall.friction=0.0"),
        ("sample.symmetry=[]",),
        ("loading.area_share=0.8",),
    ],
    ids=["frictionless", "whole cylinder", "partial piston"],
)
@pytest.mark.long
def test_other_scenes_run(changes: tuple[str, ...], tmp_path: Path) -> None:
    """A scene with less, or another, physics is prepared, loaded and read."""
    short = ("procedure.k_i=2", "procedure.k=2", "procedure.total_cycles=4")
    run_scene(COARSE, tmp_path / "run", overrides=[*TINY, *short, *changes], progress=QUIET)
    table = (tmp_path / "run" / "settlement.csv").read_text().splitlines()
    assert len(table) == 5


def test_digests_are_those_of_the_shipped_decks(run: Path) -> None:
    """The record of a window names every static deck it used, by content."""
    outcome = RunFolder(run).outcome("window_000006")
    assert outcome is not None
    copies = decks.copy_deck(run.parent, tuple(outcome.notes["decks"]), "liggghts_inputs")
    assert copies == outcome.notes["decks"]
