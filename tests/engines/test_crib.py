"""The weight of ballast beside a sleeper's block: each engine's bed bears it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import State, load_state
from adapters.engines.crib import find_crib_forces
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from tests.engine_sample import FIRST, QUIET, REAL, SECOND, window_of
from trackbed.scenes import find_scene_file

SMALL = (
    "sample.count=40", "sample.size_x=0.2", "sample.size_y=0.18", "loading.footprint=[0.08, 0.07]",
    "material.grain.young=1e8", "loading.amplitude=1e2", "loading.mean=5e3", "loading.crib=0.15",
    "procedure.k_i=2", "procedure.k=2", "procedure.h=1", "procedure.healing_cycles=1",
    "procedure.total_cycles=8",
)  # fmt: skip


def sum_forces(state: State) -> np.ndarray:
    """Contacts and weight of each grain along z, shape (n,) [N]."""
    force = sum(one[:, 2] for one in state.wall_force.values()) - GRAVITY * state.mass
    on_first = state.contacts.normal_force + state.contacts.tangential_force
    np.add.at(force, state.contacts.pair[:, 0] - 1, on_first[:, 2])
    np.subtract.at(force, state.contacts.pair[:, 1] - 1, on_first[:, 2])
    return np.asarray(force)


@pytest.mark.parametrize("name", REAL)
@pytest.mark.long
def test_bed_bears_the_crib(name: str, tmp_path: Path) -> None:
    """Under a load that hardly changes, what carries each grain is its weight and its share of the
    crib, and floor, walls and block carry all of both: in the first window, in one from its restart
    file and behind a jump, to half the force by which the load changes in a cycle."""
    overrides = (f'engine.name="{name}"', *SMALL)
    run_scene(find_scene_file("ballast"), tmp_path, overrides=overrides, progress=QUIET)
    scene = load_scene(find_scene_file("ballast"), overrides)
    crib = find_crib_forces(scene, load_state(tmp_path / "preparation" / "state.npz"))
    change = 1e2 * scene.loaded_area
    assert crib.max() > 5 * change
    for window in (window_of(tmp_path, stage) for stage in (FIRST, SECOND, "window_000005")):
        for index in range(len(window) + 1):
            net = sum_forces(window.state(index)) - crib
            assert np.abs(net).max() < change / 2
            assert abs(net.sum()) < change / 2
