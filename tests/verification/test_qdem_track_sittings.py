"""A stage of a track's preparation outlives its process, and goes on to the same bits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from qdem_fem.bodies.rigid_mass import RigidMass
from qdem_fem.files.errors import CheckpointError, NotConverged
from qdem_fem.march.kinetic_damping import Rest
from qdem_fem.rigid.holds import find_hold
from qdem_fem.rigid.step import FREE, STILL
from qdem_fem.track import bed as track_bed
from qdem_fem.track.bed import STAGES, Bed, name_file, prepare_bed, read_bed, run_stage, write_bed
from qdem_fem.track.recipe import BedRecipe, make_bed_grains
from validation.bench.track_trials import load_track

JUDGEMENTS = 3  # after so many the process is killed; the stage of 20 grains takes more


class Killed(Exception):
    """As by a signal."""


def recipe_at(folder: Path) -> BedRecipe:
    """A bed of 20 grains that rests within a third of a second, whatever a processor rounds."""
    return load_track(folder, "track.seed=2").recipe


def fallen(recipe: BedRecipe, part: Path | None, killed_after: int | None = None) -> Bed:
    """The stage ``bed``; a process that is killed after some judgements."""
    seen = 0

    def progress(_stage: str, _rest: Rest) -> None:
        nonlocal seen
        seen += 1
        if seen == killed_after:
            raise Killed

    return run_stage(recipe, make_bed_grains(recipe), "bed", None, 1, progress, part)


def said(bed: Bed) -> tuple[bytes, dict[str, Any]]:
    """Where all nodes lie, to the bit, and how the stage went."""
    rest = {key: value for key, value in bed.rests["bed"].items() if key != "cpu_s"}
    return np.concatenate(bed.positions).tobytes(), rest


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Bed:
    return fallen(recipe_at(tmp_path_factory.mktemp("whole")), None)


@pytest.mark.long
def test_a_killed_stage_goes_on_to_the_same_bits(whole: Bed, tmp_path, monkeypatch) -> None:
    """Killed three times: peaks, steps, places are those of a stage that was not."""
    monkeypatch.setattr(track_bed, "BED", replace(track_bed.BED, saving_interval=0.0))
    recipe, part = recipe_at(tmp_path), tmp_path / "bed.part.npz"
    for _ in range(3):
        with pytest.raises(Killed):
            fallen(recipe, part, JUDGEMENTS)
    bed = fallen(recipe, part)
    assert whole.rests["bed"]["steps"] > 3 * JUDGEMENTS * 1000
    assert said(bed) == said(whole)
    assert bed.rests["bed"]["cpu_s"] > 0


@pytest.mark.long
def test_more_patience_goes_on_where_less_gave_up(whole: Bed, tmp_path: Path) -> None:
    """The message names the time; what was computed is not lost, whatever the saving interval."""
    recipe, part = recipe_at(tmp_path), tmp_path / "bed.part.npz"
    short = replace(recipe, patience=0.5 * whole.rests["bed"]["time"])
    with pytest.raises(
        NotConverged, match=r"^stage bed .* no equilibrium after .*\n.*track\.patience"
    ):
        fallen(short, part)
    seen = part.stat().st_mtime_ns
    assert said(fallen(recipe, part)) == said(whole)
    assert part.stat().st_mtime_ns == seen


@pytest.mark.long
def test_a_stage_of_something_else_is_refused(tmp_path: Path) -> None:
    """Another recipe's part, and a damaged one: a sentence that says to remove it."""
    recipe, part = recipe_at(tmp_path), tmp_path / "bed.part.npz"
    with pytest.raises(NotConverged):
        fallen(replace(recipe, patience=0.0), part)
    for other in (replace(recipe, seed=recipe.seed + 1), replace(recipe, softness=1e-3)):
        with pytest.raises(CheckpointError, match="remove it: the stage then begins again"):
            fallen(other, part)
    part.write_bytes(part.read_bytes()[:-9])
    with pytest.raises(
        CheckpointError, match=r"bed\.part\.npz: a stage .* whole checkpoint.*\n  -> remove it"
    ):
        fallen(recipe, part)


@pytest.mark.long
def test_what_a_kill_left_of_a_stage_that_is_done_is_not_read(
    whole: Bed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the bed's file and the removal of the part: the next stages begin all the same."""
    recipe, path = recipe_at(tmp_path), tmp_path / "bed.npz"
    write_bed(path, recipe, whole)
    parts = {name_file(path, stage) for stage in STAGES}
    assert len(parts) == len(STAGES)
    name_file(path, "bed").write_bytes(b"left by a kill")
    nothing = Rest(0.0, 0.0, 0.0, 0, 0, 0, 0.0)
    monkeypatch.setattr(track_bed, "find_rest", lambda *given, **more: nothing)
    assert prepare_bed(recipe, path, 1).stage == "rest"
    assert not [part for part in parts - {name_file(path, "bed")} if part.exists()]


@pytest.mark.long
def test_patience_is_no_part_of_a_bed(whole: Bed, tmp_path: Path) -> None:
    """A bed is read by a recipe of more patience."""
    recipe, path = recipe_at(tmp_path), tmp_path / "bed.npz"
    write_bed(path, recipe, whole)
    assert read_bed(path, replace(recipe, patience=99.0)).stage == "bed"
    with pytest.raises(CheckpointError, match="softness differ"):
        read_bed(path, replace(recipe, softness=1e-3))


@pytest.mark.parametrize(("components", "turning"), [("xy", FREE), ("xyz", STILL)])
def test_many_held_nodes_of_a_rigid_body(components: str, turning: int) -> None:
    """100,000 components of a body: memory goes with their number, not with its square.

    A sleeper of 54,873 nodes held along x and y asked for 90 GB.
    """
    rng = np.random.default_rng(1)
    arm = rng.uniform(-1, 1, (50_000, 3))
    if components == "xy":
        arm[:] = 0.0  # all at the centre: turns are free
    own = RigidMass(2.0, np.zeros(3), np.array([0.5, 0.6, 0.7]), np.eye(3))
    which = np.tile(np.arange(len(components)), len(arm))
    places = np.repeat(arm, len(components), axis=0)
    nothing = np.zeros(len(which), dtype=int)
    given, _, found = find_hold(own, places, which, nothing, np.zeros(len(which)), "body")
    assert given.tolist() == [0, 0, -1 if components == "xy" else 0]
    assert found == turning
