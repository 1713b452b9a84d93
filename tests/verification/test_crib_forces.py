"""The surface of a bed beside a block, and the weight of ballast that is shared out on it."""

from __future__ import annotations

from math import acos, pi, sqrt

import numpy as np
import pytest

from adapters.bed.state import State
from adapters.engines.crib import CELL_SHARE, count_seen_cells, find_crib_forces
from adapters.errors import NotCredible
from adapters.scene.file import load_scene
from trackbed.scenes import find_scene_file


def test_seen_areas_are_those_of_circles() -> None:
    """A sphere alone is seen as its circle, one under a higher of its size as a circle less a lens;
    half a circle is left of one on a block's edge.  To 2 %: the cells on a rim, 4 r / cell of
    pi (r / cell)^2, are right to a third of one on average and differ in sign."""
    r, apart = 0.02, 0.025
    position = np.array([[0.05, 0.05, 0.02], [0.15, 0.05, 0.02], [0.15 + apart, 0.05, 0.05]])
    sizes, radius = (0.3, 0.1), np.full(3, r)
    cell = (CELL_SHARE * r) ** 2
    lens = 2 * r**2 * acos(apart / (2 * r)) - apart / 2 * sqrt(4 * r**2 - apart**2)
    circle = pi * r**2
    seen = cell * count_seen_cells(position, radius, sizes, (-1.0, -0.5, 0.0, 1.0))
    assert seen == pytest.approx([circle, circle - lens, circle], rel=0.02)
    beside = cell * count_seen_cells(position, radius, sizes, (-np.inf, 0.05, 0.0, 1.0))
    assert beside[0] == pytest.approx(circle / 2, rel=0.02)
    assert beside[1:] == pytest.approx(seen[1:])


def make_layers() -> State:
    """A full box of cubic packing, six layers of spheres of 10 mm."""
    lines = (np.arange(0.01, size, 0.02) for size in (0.3, 0.28, 0.12))
    position = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    one, still = np.ones(len(position)), np.zeros_like(position)
    return State(np.arange(1, len(one) + 1), position, 0.01 * one, one, still, still)


def test_forces_are_the_weight_of_the_crib() -> None:
    """Cubic packing fills pi/6: the forces sum to pi/6 rho g h on the section beside the block, to
    the part by which a tenth of a bed of six layers is filled otherwise.  They press the highest
    grains beside the block alone, and each that is wholly beside it as the next."""
    path = find_scene_file("ballast")
    scene, twice = (load_scene(path, [f"loading.crib={height}"]) for height in (0.15, 0.3))
    bed = make_layers()
    force = find_crib_forces(scene, bed)
    section = 0.3 * 0.28 - 0.13 * 0.20
    assert force.sum() == pytest.approx(pi / 6 * 2700 * 9.81 * 0.15 * section, rel=0.05)
    x, y, z = bed.position.T
    whole = (z > 0.1) & ((x > 0.15) | (y > 0.21))
    assert force[whole] == pytest.approx(force[whole].mean(), rel=0.01)
    assert not force[(z < 0.1) | ((x < 0.12) & (y < 0.19))].any()
    assert find_crib_forces(twice, bed) == pytest.approx(2 * force)


def test_a_bed_that_is_not_seen_beside_the_block_is_a_sentence() -> None:
    one, still = np.ones(1), np.zeros((1, 3))
    under = State(np.array([1]), np.array([[0.03, 0.03, 0.01]]), 0.01 * one, one, still, still)
    with pytest.raises(NotCredible, match="no grain is seen"):
        find_crib_forces(load_scene(find_scene_file("ballast")), under)
