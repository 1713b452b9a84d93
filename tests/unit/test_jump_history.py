"""Settlement over a jump from all cycles computed: a walk of the slope du / d ln N, kriged."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.jump_history import (
    DRIFT,
    LONGEST_BLOCK,
    Jumped,
    asked_gain,
    blocks_of,
    gain_of,
    slope_weights,
)
from adapters.jump_rates import Stretch
from adapters.state import FloatArray

SLOPE = 3e-5


def stretch(first: int, gain: FloatArray) -> Stretch:
    """Cycles behind ``first`` with these gains [m]."""
    return Stretch(first, gain, np.full(len(gain), 3.0), np.full(len(gain), 1e-5))


def log_stretch(first: int, last: int, slope: float = SLOPE) -> Stretch:
    """u = slope ln N."""
    return stretch(first, np.diff(slope * np.log(np.arange(first, last + 1))))


def noisy(seed: int, slope: float, burst: float) -> list[Stretch]:
    """Windows of 20 cycles whose slopes scatter by ``burst`` times the slope, as bursts do."""
    random = np.random.default_rng(seed)
    first = (10, 100, 200, 400, 800)
    return [log_stretch(n, n + 20, slope * (1 + burst * random.normal())) for n in first]


def test_logarithm_is_continued() -> None:
    """u = a ln N gains a ln((N + h) / N), whatever windows it was seen through."""
    for windows in ([(10, 70)], [(10, 50), (50, 70)], [(3, 20), (40, 60), (500, 520)]):
        known = [log_stretch(*window) for window in windows]
        last = windows[-1][1]
        for h in (1, 30, 100 * last):
            assert gain_of(known, h).mean == pytest.approx(SLOPE * np.log1p(h / last), rel=1e-6)


def test_error_is_that_of_the_walk() -> None:
    """Slopes by the model's own walk and noise: their gains miss by the standard error told.

    2000 walks: the mean square of the error over its standard error is 1 +- 4 sqrt(2 / 2000).
    """
    random = np.random.default_rng(1)
    place = np.array([0.3, 0.5, 1.4, 2.0, 2.2])
    variance = np.array([0.01, 0.3, 0.05, 1.0, 0.2])
    end, length = 2.3, 1.7
    weights, unsure = slope_weights(place, variance, end)
    assert weights.sum() == pytest.approx(1)
    grid = np.linspace(0.3, end + length, 401)
    walk = np.cumsum(random.normal(size=(2000, 401)) * np.sqrt(grid[1] - grid[0]), axis=1)
    seen = np.stack([np.interp(place, grid, one) for one in walk])
    seen += random.normal(size=seen.shape) * np.sqrt(variance)
    later = walk[:, grid >= end].mean(axis=1)
    missed = (seen @ weights - later) / np.sqrt(unsure + length / 3)
    assert np.mean(missed**2) == pytest.approx(1, abs=4 * np.sqrt(2 / 2000))


def test_quiet_cycles_leave_the_last_slope_noise_takes_the_mean() -> None:
    """Without noise the last block alone counts; with noise beyond all drift, blocks by 1/s^2."""
    place = np.array([0.0, 1.0, 3.0])
    weights, unsure = slope_weights(place, np.zeros(3), 3.5)
    assert weights == pytest.approx([0, 0, 1], abs=1e-12)
    assert unsure == pytest.approx(0.5)
    loud = np.array([1e6, 2e6, 4e6])
    weights, unsure = slope_weights(place, loud, 3.5)
    assert weights == pytest.approx((1 / loud) / (1 / loud).sum(), rel=1e-4)
    assert unsure == pytest.approx(1 / (1 / loud).sum(), rel=1e-4)


def test_bursts_err_less_than_by_the_last_window() -> None:
    """Slopes that scatter about one value: five windows know it better than the last does."""
    missed, alone = [], []
    for seed in range(40):
        known = noisy(seed, SLOPE, 0.6)
        truth = SLOPE * np.log(2)
        missed.append(gain_of(known, 820).mean / truth - 1)
        alone.append(known[-1].gain.sum() / np.log(820 / 800) * np.log(2) / truth - 1)
    assert np.mean(np.square(missed)) < 0.7 * np.mean(np.square(alone))


@given(
    st.floats(1e-9, 1e3), st.lists(st.floats(-1, 3), min_size=6, max_size=40), st.integers(1, 10**6)
)
def test_unit_of_length_is_free(unit: float, gains: list[float], h: int) -> None:
    """Gains times a factor: the same gain and error, times the factor."""
    one, other = (gain_of([stretch(10, np.array(gains) * u)], h) for u in (1.0, unit))
    assert other.mean == pytest.approx(unit * one.mean, rel=1e-6, abs=1e-9 * unit)
    assert other.error == pytest.approx(unit * one.error, rel=1e-6, abs=1e-9 * unit)
    assert one.mean >= 0


def test_what_a_jump_leaves_too_much_is_taken_off_the_next() -> None:
    """u = a ln N, and 3 um more in the healing cycles of every jump: behind the second jump, and
    every one after it, the bed is where the logarithm has it; behind the first 3 um too low."""
    more, k, h, healing, end = 3e-6, 20, 60, 5, 70
    settled = {n: SLOPE * np.log(n) for n in range(10, end + 1)}
    windows = [(10, end)]
    jumps: list[Jumped] = []
    for number in range(4):
        known = [stretch(a, np.diff([settled[n] for n in range(a, b + 1)])) for a, b in windows]
        gain = asked_gain(known, h, jumps)
        settled[end + h] = settled[end] + gain
        healed, last = end + h + healing, end + h + healing + k
        for n in range(end + h + 1, last + 1):
            settled[n] = settled[end + h] + SLOPE * np.log(n / (end + h)) + more
        cycles = np.array([end, end + h, healed])
        jumps.append(Jumped(tuple(known), cycles, np.array([settled[n] for n in cycles])))
        windows.append((healed, last))
        missed = settled[last] - SLOPE * np.log(last)
        assert missed == pytest.approx(more if number == 0 else 0.0, abs=1e-12)
        end = last
    assert asked_gain(known, 1, jumps) == 0  # never less than nothing


def test_blocks_cut_no_cycle_and_lose_none() -> None:
    """Blocks follow one another, no longer than they may be, or one cycle."""
    known = [log_stretch(1, 50), log_stretch(90, 110), log_stretch(5000, 5020)]
    blocks = blocks_of(known)
    for one in known:
        inside = [b for b in blocks if one.first_cycle <= b.first_cycle < one.last_cycle]
        assert np.concatenate([b.gain for b in inside]) == pytest.approx(one.gain)
        assert inside[0].first_cycle == one.first_cycle
        for block in inside:
            ratio = block.last_cycle / block.first_cycle
            assert len(block.gain) == 1 or ratio < np.exp(1.5 * LONGEST_BLOCK)


def test_bed_without_motion_and_bed_that_rises() -> None:
    """Nothing is gained, and no number is not finite."""
    still = gain_of([stretch(10, np.zeros(20))], 100)
    assert (still.mean, still.error) == (0, 0)
    rising = gain_of([stretch(10, np.full(20, -1e-6))], 100)
    assert rising.mean == 0
    assert np.isfinite(rising.error)
    one = gain_of([stretch(1, np.array([1e-6]))], 10)
    assert one.mean == pytest.approx(1e-6 / np.log(2) * np.log(6))
    assert one.error >= DRIFT * one.mean * np.sqrt(np.log(6) / 3) * 0.99
