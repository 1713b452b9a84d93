"""A bed from a saved state on every engine: set down where it was, it stays there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import load_state
from adapters.procedure.run import run_scene
from tests.engine_sample import QUIET, REAL, TINY
from trackbed.scenes import find_scene_file

JUMP = "jump_000005_1"


@pytest.mark.parametrize("name", REAL)
def test_settled_bed_stays(name: str, tmp_path: Path) -> None:
    """Springs along the tangent alone are lost, which friction holds below the overlaps (times mu
    and 1/(1 - nu), of the order of 1): half of the grains move by less than the greatest overlap.
    Floor and walls carry all of the weight, and load cycles and a jump follow."""
    overrides = (f'engine.name="{name}"', *TINY)
    scene = find_scene_file("karrech-coarse")
    run_scene(scene, tmp_path / "rain", overrides=overrides, progress=QUIET)
    settled = load_state(tmp_path / "rain" / "preparation" / "state.npz")
    stored = f'sample.state="{tmp_path / "rain" / "preparation" / "state.npz"}"'
    run_scene(scene, tmp_path / "run", overrides=(*overrides, stored), progress=QUIET)
    bed = load_state(tmp_path / "run" / "preparation" / "state.npz")
    np.testing.assert_array_equal(bed.radius, settled.radius)
    move = np.linalg.norm(bed.position - settled.position, axis=1)
    assert np.median(move) < settled.contacts.overlap.max()
    carried = sum(force[:, 2].sum() for force in bed.wall_force.values())
    assert carried == pytest.approx(GRAVITY * bed.mass.sum(), rel=0.01)
    assert (tmp_path / "run" / JUMP / "relaxed.npz").exists()
