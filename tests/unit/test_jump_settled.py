"""A jump whose mean settlement is given."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from adapters.bed.state import State
from adapters.procedure.stages import settle_by
from tests.verification.test_moves import bed


@given(some.floats(0.0, 1e-3), some.floats(-1e-3, 1e-3), some.integers(0, 5))
def test_mean_grain_settles_by_the_gain(gain: float, wrong: float, seed: int) -> None:
    """Whatever the window's law said (``wrong`` of the mean, and noise), the mean grain settles by
    the gain, and the rest is a uniform vertical strain."""
    path, radius = bed(seed)
    zero = np.zeros_like(path[0])
    state = State(
        identifier=np.arange(len(radius)), position=path[0], radius=radius,
        mass=np.full(len(radius), 1e-3), velocity=zero, spin=zero, cycle=50,
    )  # fmt: skip
    noise = np.random.default_rng(seed).normal(scale=1e-4, size=path[0].shape)
    said = path[0] + noise - [0.0, 0.0, wrong]
    target = settle_by(gain, state, said)
    assert (state.position - target)[:, 2].mean() == pytest.approx(gain, abs=1e-15)
    height = path[0][:, 2] - path[0][:, 2].min()
    strain = (target - said)[:, 2] @ height / (height @ height)
    np.testing.assert_allclose((target - said)[:, 2], strain * height, atol=1e-15)
