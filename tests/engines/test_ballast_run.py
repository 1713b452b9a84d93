"""The scene of a sleeper's block on ballast, made small: what each engine's block pushes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.contact_law import find_normal_force
from adapters.bed.overlaps import find_pairs
from adapters.engines.contract import get_engine
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from tests.engine_sample import QUIET, REAL, window_of
from trackbed.scenes import find_scene_file

SMALL = (
    "sample.fill_height=0.06", "loading.footprint=[0.08, 0.07]", "material.grain.young=1e9",
    "loading.amplitude=5e3", "loading.mean=1e4", "procedure.total_cycles=3", "procedure.k_i=2",
    "procedure.k=2", "procedure.h=1",
)  # fmt: skip


@pytest.mark.parametrize("name", REAL)
@pytest.mark.long
def test_block_pushes_what_lies_under_it(name: str, tmp_path: Path) -> None:
    """The face's force on each grain is Hertz's for its overlap with the nearest point of the block
    to 1 % of the greatest, which dampers take."""
    overrides = (f'engine.name="{name}"', *SMALL)
    run_scene(find_scene_file("ballast"), tmp_path, overrides=overrides, progress=QUIET)
    scene = load_scene(find_scene_file("ballast"), overrides)
    window = window_of(tmp_path, "window_000002")
    state = window.state(-1)
    walls = scene.walls(state.piston_height)
    rows = find_pairs(state.position, state.radius, walls)
    under = (rows.second == -len(walls.plane_name)) & (rows.overlap > 0)
    grain = rows.first[under]
    expected = np.zeros(len(state.radius))
    expected[grain] = find_normal_force(
        rows.overlap[under], scene.stiffness.wall, state.radius[grain]
    )
    normal = np.zeros_like(state.position)
    normal[grain] = rows.normal[under]
    force = state.wall_force[get_engine(name).wall_names(scene, piston=True)[-1]]
    found = np.einsum("na,na->n", force, normal)
    assert found == pytest.approx(expected, abs=0.01 * expected.max())
    assert 0 < len(grain) < len(state.radius)
