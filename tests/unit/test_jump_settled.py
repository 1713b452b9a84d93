"""A jump whose mean settlement is given: grains and piston together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from adapters.jump_strain import EXPONENTS, piston_ratio, settled_by, strain_exponent
from adapters.run_folder import Outcome
from adapters.state import FloatArray, State
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
    target, piston = settled_by(gain, state, path[0] + noise - [0.0, 0.0, wrong])
    assert (state.position - target)[:, 2].mean() == pytest.approx(gain, abs=1e-15)
    low = state.position[:, 2].min()
    mean = float((state.position[:, 2] - low).mean())
    share = (piston - low) / (state.piston_height - low)
    assert share == pytest.approx((mean - gain) / mean, rel=1e-12)
    assert piston <= state.piston_height


@given(some.floats(0.0, 1e-3), some.floats(2.0, 6.0), some.integers(0, 5))
def test_piston_sinks_by_its_ratio(gain: float, ratio: float, seed: int) -> None:
    """Mean settlement the gain, the piston's that times what it sank by over the mean before,
    within what the exponents allow."""
    path, radius = bed(seed)
    state = at_rest(path[0], radius)
    target, piston = settled_by(gain, state, path[0], ratio)
    assert (state.position - target)[:, 2].mean() == pytest.approx(gain, abs=1e-15)
    low = state.position[:, 2].min()
    share = (state.position[:, 2] - low) / (state.piston_height - low)
    least, most = (1 / float((share**p).mean()) for p in EXPONENTS)
    sunk = gain * min(max(ratio, least), most)
    assert state.piston_height - piston == pytest.approx(sunk, rel=1e-9, abs=1e-15)


def test_exponent_of_a_column() -> None:
    """Heights spread evenly over [0, 1]: mean s^p = 1 / (p + 1), so p = ratio - 1, to 1 / n^2.
    Not known or below 2: uniform."""
    share = (np.arange(100_000) + 0.5) / 100_000
    for ratio, p in ((4.5, 3.5), (2.5, 1.5), (1.5, 1.0), (np.nan, 1.0), (-1.0, 1.0), (90.0, 5.0)):
        assert strain_exponent(share, ratio) == pytest.approx(p, rel=1e-5)


def test_ratio_counts_the_windows_alone() -> None:
    """Two windows of a bed whose piston sinks by 3 um where the mean grain settles 1; cycles of the
    seating, healing and a jump between them do otherwise."""

    def row(cycle: int, kind: str, settled: float, sunk: float) -> dict[str, float | str | int]:
        return {
            "cycle": cycle, "kind": kind, "settlement": 1e-6 * settled,
            "piston_height": 0.1 - 1e-6 * sunk,
        }  # fmt: skip

    first = [row(1, "computed", 50, 10), *(row(n, "computed", n, 3 * n) for n in (10, 11, 12))]
    second = [row(31, "healing", 90, 40), *(row(n, "computed", n, 3 * n) for n in (32, 34))]
    outcomes = [
        Outcome("window", 0, 12, first, {}),
        Outcome("jump", 12, 30, [row(30, "jumped", 80, 0)], {}),
        Outcome("window", 30, 34, second, {}),
    ]  # fmt: skip
    assert piston_ratio(outcomes, 10, 34) == pytest.approx(3)
    assert piston_ratio(outcomes, 10, 12) == pytest.approx(3)
    assert np.isnan(piston_ratio(outcomes, 40, 50))
