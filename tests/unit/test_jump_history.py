"""Settlement over a jump from all cycles computed: a walk of the slope du / d ln N, kriged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.bed.state import FloatArray
from adapters.jumps.rates import Stretch
from adapters.jumps.slopes import (
    LOADED_BODY,
    SLOPES,
    Jumped,
    Landing,
    SlopeNumbers,
    Slopes,
    assemble_kriging,
    cut_slope_blocks,
    estimate_slopes,
    find_asked_gain,
    remove_moves,
)

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


def walked(place: FloatArray, slope: FloatArray, noise: FloatArray) -> Slopes:
    """Blocks of a walk of variance 1 in a unit of ln N, before any jump."""
    nothing = np.zeros(len(place))
    return Slopes(place, slope, nothing, assemble_kriging(place, noise, np.diag(nothing)))


def jumping(
    cycle_gain: Callable[[int], float],
    more: Callable[[int, float], float],
    jumps: int,
    h: int = 60,
    k: int = 20,
    numbers: SlopeNumbers = SLOPES,
) -> list[float]:
    """Settlement too much [m] at the end of each window, with k + 5 cycles behind each jump.

    Cycle N gains ``cycle_gain(N)``, and ``more(n, G)`` where it is the n-th behind a move by G.
    """
    end, healing = 70, 5
    known = [stretch(10, np.array([cycle_gain(n) for n in range(11, end + 1)]))]
    made: list[Jumped] = []
    missed, settled = [], 0.0
    for _ in range(jumps):
        gain = find_asked_gain(known, h, made, numbers)
        behind, last = end + h, end + h + healing + k
        gains = [cycle_gain(behind + n) + more(n, gain) for n in range(1, healing + k + 1)]
        after = [settled, settled + gain, settled + gain + sum(gains)]
        made.append(Jumped(np.array([end, behind, last]), np.array(after)))
        known.append(stretch(behind + 1, np.array(gains[1:])))
        end, settled = last, after[2]
        missed.append(settled - sum(cycle_gain(n) for n in range(71, last + 1)))
    return missed


def log_gain(n: int) -> float:
    """Of cycle n of u = `SLOPE` ln N."""
    return SLOPE * float(np.log(n / (n - 1)))


def test_logarithm_is_continued() -> None:
    """u = a ln N gains a ln((N + h) / N), whatever windows it was seen through."""
    for windows in ([(10, 70)], [(10, 50), (50, 70)], [(3, 20), (40, 60), (500, 520)]):
        known = [log_stretch(*window) for window in windows]
        last = windows[-1][1]
        for h in (1, 30, 100 * last):
            assert find_asked_gain(known, h) == pytest.approx(SLOPE * np.log1p(h / last), rel=1e-6)


def test_a_loaded_body_that_sinks_ever_faster_in_ln_n_lags_less() -> None:
    """u = c N^.4, as pistons of full runs sink: its slope in ln N grows by 1.5 in each unit, so a
    logarithm lags; with the loaded body's walk the jump misses less than with the mean grain's."""
    known = [stretch(n, np.diff(np.arange(n, n + 21.0) ** 0.4)) for n in (10, 30, 50)]
    truth = 150**0.4 - 70**0.4
    short, less = (1 - find_asked_gain(known, 80, (), one) / truth for one in (SLOPES, LOADED_BODY))
    assert 0 < less < short < 0.25


def test_error_is_least_among_linear_estimates() -> None:
    """Slopes by the model's own walk and noise: no other weights of sum 1 miss by less.

    4000 walks, two of whose places lie between blocks: the mean square error is that of the
    kriging weights within 3 %, and grows when they are changed by a tenth at random.
    """
    random = np.random.default_rng(1)
    place = np.array([0.3, 0.5, 1.4, 2.0, 2.2])
    noise = np.array([0.01, 0.3, 0.05, 1.0, 0.2])
    grid = np.linspace(0.3, 2.2, 401)
    walk = np.cumsum(random.normal(size=(4000, 401)) * np.sqrt(grid[1] - grid[0]), axis=1)
    seen = np.stack([np.interp(place, grid, one) for one in walk])
    seen += random.normal(size=seen.shape) * np.sqrt(noise)
    for at in (0.9, 1.7, 2.2):
        weights = np.array([weight_of(b, place, noise, at) for b in range(5)])
        truth = np.stack([np.interp(at, grid, one) for one in walk])
        least = np.mean((seen @ weights - truth) ** 2)
        for _ in range(20):
            other = weights + 0.1 * random.normal(size=5)
            other += (1 - other.sum()) / 5
            assert np.mean((seen @ other - truth) ** 2) > least


def weight_of(block: int, place: FloatArray, noise: FloatArray, at: float) -> float:
    """Weight of one block: the estimate's change by its slope, from slopes far above zero."""
    slope = np.full(len(place), 100.0)
    raised = slope + (np.arange(len(place)) == block)
    both = (walked(place, one, noise).at(np.array([at]))[0] for one in (slope, raised))
    return float(-np.subtract(*both))


def test_quiet_cycles_leave_the_nearest_slopes_noise_takes_the_mean() -> None:
    """Without noise behind the last block its own slope, between two blocks the straight line;
    with noise beyond all drift, blocks by 1/s^2."""
    place, slope = np.array([0.0, 1.0, 3.0]), np.array([2.0, 5.0, 9.0])
    quiet = walked(place, slope, np.zeros(3))
    assert quiet.at(np.array([3.5, 1.0, 2.0, 2.5])) == pytest.approx([9, 5, 7, 8], abs=1e-12)
    loud = np.array([1e6, 2e6, 4e6])
    mean = slope @ (1 / loud) / (1 / loud).sum()
    assert walked(place, slope, loud).at(np.array([3.5])) == pytest.approx(mean, rel=1e-4)


def test_bursts_err_less_than_by_the_last_window() -> None:
    """Slopes that scatter about one value: five windows know it better than the last does."""
    missed, alone = [], []
    for seed in range(40):
        known = noisy(seed, SLOPE, 0.6)
        truth = SLOPE * np.log(2)
        missed.append(find_asked_gain(known, 820) / truth - 1)
        alone.append(known[-1].gain.sum() / np.log(820 / 800) * np.log(2) / truth - 1)
    assert np.mean(np.square(missed)) < 0.7 * np.mean(np.square(alone))


@given(
    st.floats(1e-9, 1e3),
    st.lists(st.floats(-1, 3).map(lambda gain: round(gain, 9)), min_size=6, max_size=40),
    st.integers(1, 10**6),
)
def test_unit_of_length_is_free(unit: float, gains: list[float], h: int) -> None:
    """Gains times a factor, with a jump between: the same gain, times the factor."""
    one, other = (
        find_asked_gain(
            [stretch(10, np.array(gains[:3]) * u), stretch(31, np.array(gains[3:]) * u)],
            h,
            [Jumped(np.array([13, 30, 28 + len(gains)]), np.array([0.0, 1.0, 1.5]) * u)],
        )
        for u in (1.0, unit)
    )
    assert other == pytest.approx(unit * one, rel=1e-6, abs=1e-9 * unit)
    assert one >= 0


def test_what_a_jump_missed_is_made_good_by_the_next() -> None:
    """The slope doubles inside of the first jump: the window behind it tells so, and the second
    jump carries half of what lacked (the other half may be the moved bed's), the third the rest but
    for the straight line between both windows, as nothing tells when."""
    turn = 100

    def gain(n: int) -> float:
        return log_gain(n) * (1 + (n > turn))

    missed = jumping(gain, lambda n, moved: 0.0, 3)
    whole = SLOPE * np.log(130 / turn)
    assert missed[0] == pytest.approx(-whole, rel=0.05)
    assert abs(missed[1]) < 0.6 * whole
    assert abs(missed[2]) < 0.2 * whole


def test_what_a_moved_bed_settles_more_is_taken_off() -> None:
    """A share of G in the first cycle, and KAPPA G / n in the later ones: the first jump is that
    much too low, each further one by less than half of it, and less each time; without the term for
    it, by more and more, as the windows behind jumps then tell slopes that are none."""

    def more(n: int, gain: float) -> float:
        return gain * (0.15 if n == 1 else 0.1 / n)

    missed = jumping(log_gain, more, 4)
    assert missed[0] > 0.25 * SLOPE * np.log(130 / 70)
    assert np.abs(missed[1:]).max() < 0.5 * missed[0]
    assert (np.diff(np.abs(missed)) < 0).all()
    blind = jumping(log_gain, more, 4, numbers=replace(SLOPES, reseating=1e-6))
    assert np.abs(blind[1:]).max() > 5 * np.abs(missed[1:]).max()


def test_nothing_is_asked_where_too_much_was_gained() -> None:
    """A jump that went too far by more than the next may gain: the next moves nothing."""
    known = [log_stretch(10, 70), log_stretch(101, 120)]
    far = [Jumped(np.array([70, 100, 120]), np.array([0.0, 1e-3, 1e-3 + SLOPE]))]
    assert find_asked_gain(known, 10, far) == 0


def test_blocks_cut_no_cycle_and_lose_none() -> None:
    """Blocks follow one another, no longer than they may be, or one cycle; behind a jump each
    knows what kappa = 1 would add: G over the cycle since."""
    jump = Landing(4990, 7.0)
    for one, made in (
        (log_stretch(1, 50), []),
        (log_stretch(90, 110), []),
        (log_stretch(5000, 5020), [jump]),
        (log_stretch(4991, 5020), [jump]),
    ):
        found = cut_slope_blocks(one, made)
        blocks = [block for block, _ in found]
        assert np.concatenate([b.gain for b in blocks]) == pytest.approx(one.gain)
        assert [b.first_cycle for b in blocks[1:]] == [b.last_cycle for b in blocks[:-1]]
        assert (blocks[0].first_cycle, blocks[-1].last_cycle) == (one.first_cycle, one.last_cycle)
        start, longest = (4990, SLOPES.longest_reseating) if made else (0, SLOPES.longest_block)
        for block, extra in found:
            ratio = (block.last_cycle - start) / (block.first_cycle - start)
            assert len(block.gain) == 1 or ratio < np.exp(1.5 * longest)
            since = np.arange(block.first_cycle, block.last_cycle) + 1 - start
            assert extra == pytest.approx(7 * (1 / since).sum() if made else 0.0)


def test_bed_without_motion_and_bed_that_rises() -> None:
    """Nothing is gained, and no number is not finite."""
    assert find_asked_gain([stretch(10, np.zeros(20))], 100) == 0
    assert find_asked_gain([stretch(10, np.full(20, -1e-6))], 100) == 0
    assert find_asked_gain([stretch(1, np.array([1e-6]))], 10) == pytest.approx(
        1e-6 / np.log(2) * np.log(6)
    )
    nothing = [Jumped(np.array([30, 100, 120]), np.zeros(3))]
    assert find_asked_gain([stretch(10, np.zeros(20)), stretch(101, np.zeros(19))], 9, nothing) == 0


def test_kappa_is_found_with_its_error_and_taken_out() -> None:
    """u = a ln N and kappa G / n behind two jumps: kappa within a fifth and within two standard
    errors that are three tenths of those before; taken out, three quarters of it are gone."""
    kappa, landings = 0.08, [Landing(150, 2 * SLOPE), Landing(400, 3 * SLOPE)]
    known = [log_stretch(10, 70)]
    for one in landings:
        bare = log_stretch(one.cycle + 1, one.cycle + 25)
        known.append(remove_moves(bare, [one], -kappa))
    slopes = estimate_slopes(known, landings)
    found, error = slopes.kappa()
    assert found == pytest.approx(kappa, rel=0.2)
    assert abs(found - kappa) < 2 * error
    assert error < 0.3 * SLOPES.reseating
    bare = log_stretch(151, 175).gain.sum()
    left = remove_moves(known[1], landings, found).gain.sum() - bare
    assert abs(left) < 0.25 * (known[1].gain.sum() - bare)


def test_no_jump_tells_no_kappa() -> None:
    """Nothing is taken out, and the standard error stays what it was before."""
    assert estimate_slopes([log_stretch(10, 70)]).kappa() == (0.0, SLOPES.reseating)
