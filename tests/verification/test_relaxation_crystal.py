"""Relaxation of crystals: twelve contacts a grain where six would do, and no disorder to help."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.bed.container import Container
from adapters.bed.overlaps import find_pairs
from adapters.bed.state import FloatArray, State
from adapters.relaxation.methods import relax
from tests.made_beds import STIFFNESS, state_at_rest

RADIUS, OVERLAP = 3.2e-3, 6e-8
WALLS = Container("box", size_x=1.0, size_y=1.0).walls()


def crystal(layers: int, side: int) -> State:
    """A face-centred cubic block on the floor, every pair of neighbours with the same overlap."""
    distance = 2 * RADIUS - OVERLAP
    cell = np.array(list(np.ndindex(layers, side, side)))[:, ::-1].astype(float)
    shift = (cell[:, 2] % 2) / 2
    place = distance * np.column_stack(
        [cell[:, 0] + shift, cell[:, 1] + shift, cell[:, 2] / np.sqrt(2)]
    )
    place += [0.3, 0.3, RADIUS - OVERLAP]
    return state_at_rest(place, np.full(len(place), RADIUS))


def contacts_inside(position: FloatArray) -> int:
    """Greatest number of contacts of a grain."""
    rows = find_pairs(position, np.full(len(position), RADIUS), WALLS)
    ends = np.concatenate([rows.first, rows.second[rows.second >= 0]])
    return int(np.bincount(ends).max())


@pytest.mark.parametrize("noise", [0.0, 1e-8, 1e-6, 4e-5])
def test_crystal_comes_back_from_a_jump(noise: float) -> None:
    """Shaken by ``noise`` [m], a crystal has its contacts and no greater overlap than before."""
    state = crystal(5, 6)
    assert contacts_inside(state.position) == 12
    generator = np.random.default_rng(5)
    estimate = state.position + noise * generator.standard_normal(state.position.shape)
    found = relax(estimate, state, WALLS, STIFFNESS, keep_height=False)
    assert found.converged
    assert found.relaxed.max_penetration <= 1.05 * OVERLAP
    assert abs(found.coordination_change) < 0.03


@pytest.mark.parametrize("strain", [1e-4, 1e-2])
def test_crystal_that_is_to_settle_loses_contacts_and_says_so(strain: float) -> None:
    """Nothing packs closer: a settled crystal has to spread, and its record tells the loss."""
    state = crystal(5, 6)
    found = relax(state.position * [1, 1, 1 - strain], state, WALLS, STIFFNESS)
    assert found.relaxed.max_penetration <= 1.05 * OVERLAP
    assert found.relaxed.mean_height == pytest.approx(found.estimated.mean_height, abs=1e-9)
    assert np.ptp(found.position[:, 0]) > np.ptp(state.position[:, 0])
    assert found.coordination_change < -0.03
    assert found.record()["coordination_change"] == found.coordination_change
