"""Schedules of jumps: they end where they are to, evenly in ln N."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.scene.procedures import schedule_jumps


@pytest.mark.parametrize("jumps", [1, 5, 13])
def test_growing_jumps_have_one_ratio(jumps: int) -> None:
    """Ends of jumps with the window behind each: N_i = N_0 q^i, rounded to cycles."""
    lengths = np.array(schedule_jumps(jumps, 10_000, 100, 20, 5))
    ends = 120 + np.cumsum(np.append(0, lengths + 25))
    assert ends[-1] == 10_000
    ratio = (10_000 / ends[0]) ** (1 / jumps)
    assert np.abs(ends - ends[0] * ratio ** np.arange(jumps + 1)).max() <= 0.5


def test_jumps_without_room_are_refused() -> None:
    with pytest.raises(ValueError, match="no cycle"):
        schedule_jumps(40, 1_000, 100, 20, 5)
    with pytest.raises(ValueError, match="no cycle"):
        schedule_jumps(1, 0, 100, 20, 5)


@given(
    st.integers(1, 40), st.integers(2, 1_000_000), st.integers(1, 1000), st.integers(2, 100),
    st.integers(0, 20),
)  # fmt: skip
def test_any_schedule_ends_at_the_last_cycle(
    jumps: int, last: int, k_i: int, window: int, healing: int
) -> None:
    """k_i, a window, and of each jump h, healing and a window; growing ones never shrink by more
    than rounding."""
    try:
        lengths = schedule_jumps(jumps, last, k_i, window, healing)
    except ValueError:
        return
    assert len(lengths) == jumps
    assert k_i + window + sum(lengths) + jumps * (healing + window) == last
    assert min(lengths) >= 1
    assert np.diff(lengths).min(initial=0) >= -2
