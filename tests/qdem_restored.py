"""A simulation that is saved, restored elsewhere and goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import qdem_fem as q


def go_on(
    made: Callable[[], q.Simulation], file: Path, before: float, after: float
) -> tuple[q.Simulation, q.Simulation]:
    """A run without a stop, and one that went on from a file: the same bits.

    Saved after ``before`` seconds, ``after`` seconds from their end.
    """
    whole, half, again = made(), made(), made()
    for run in (whole, half):
        run.advance(before)
    half.save(file)
    again.restore(file)
    for run in (whole, again):
        run.advance(after)
    for one, other in zip(whole.bodies, again.bodies, strict=True):
        assert np.array_equal(one.displacement, other.displacement)
        assert np.array_equal(one.velocity, other.velocity)
    assert again.energy() == whole.energy()
    return whole, again
