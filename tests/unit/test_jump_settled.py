"""A jump whose mean settlement is given: grains and piston together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from adapters.bed.state import FloatArray, State
from adapters.procedure.stages import settle_by
from tests.verification.test_moves import bed


def at_rest(position: FloatArray, radius: FloatArray) -> State:
    """A bed under a piston that touches its highest grain."""
    zero = np.zeros_like(position)
    top = float((position[:, 2] + radius).max())
    return State(
        identifier=np.arange(len(radius)), position=position, radius=radius,
        mass=np.full(len(radius), 1e-3), velocity=zero, spin=zero, piston_height=top, cycle=50,
    )  # fmt: skip


@given(some.floats(0.0, 1e-3), some.floats(-1e-3, 1e-3), some.integers(0, 5))
def test_piston_is_strained_with_the_bed(gain: float, wrong: float, seed: int) -> None:
    """Whatever the window's law said (``wrong`` of the mean, and noise), the mean grain settles by
    the gain, and the piston keeps its share of the bed's mean height."""
    path, radius = bed(seed)
    state = at_rest(path[0], radius)
    noise = np.random.default_rng(seed).normal(scale=1e-4, size=path[0].shape)
    target, piston = settle_by(gain, state, path[0] + noise - [0.0, 0.0, wrong])
    assert (state.position - target)[:, 2].mean() == pytest.approx(gain, abs=1e-15)
    low = state.position[:, 2].min()
    mean = float((state.position[:, 2] - low).mean())
    share = (piston - low) / (state.piston_height - low)
    assert share == pytest.approx((mean - gain) / mean, rel=1e-12)
    assert piston <= state.piston_height
