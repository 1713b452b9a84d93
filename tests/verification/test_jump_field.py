"""Displacement field of a jump: the paper's estimate as a limit, the exact mean, symmetries."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import Law, get_law
from adapters.laws.karrech2007 import Karrech2007
from adapters.moves.smoothed import clipped, estimate_jump_field, smoothed

LOG = get_law("log")
CYCLE = np.arange(30.0, 51.0)
every_law = pytest.mark.parametrize(
    "law",
    [get_law(name) for name in ("karrech2007", "linear", "log", "log-linear", "hyperbolic")],
)
every_free_law = pytest.mark.parametrize(
    "law", [get_law(name) for name in ("karrech2007", "linear", "log")]
)
"""Without constraints the law of the mean is the mean of the laws."""
seeds = st.integers(0, 2**32 - 1)


def bed(seed: int = 0, count: int = 60) -> tuple[FloatArray, FloatArray]:
    """Positions at 21 cycle ends [m], shape (21, n, 3), and radii [m]: a settling random bed."""
    random = np.random.default_rng(seed)
    place = random.uniform(0.0, 0.02, (count, 3))
    drop = np.multiply.outer(np.log(CYCLE), -1e-5 * place[:, 2] / 0.01)
    path = 1e-6 * random.standard_normal((21, count, 3)).cumsum(axis=0)
    path[:, :, 2] += drop
    return place + path, random.uniform(2e-3, 4e-3, count)


@every_free_law
def test_without_clip_and_smoothing_it_is_the_law_of_each_grain(law: Law) -> None:
    """Limit clip 1, smoothing 0: the paper's per-grain estimate, to round-off of the mean."""
    position, radius = bed()
    move = estimate_jump_field(CYCLE, position, radius, law, 30, smoothing_radii=0, clip_quantile=1)
    rows = slice(law.first_state, None)
    parameters = law.fit(CYCLE[rows], position[rows] - position[0])
    expected = law.increment(parameters, 50.0, 80.0)
    np.testing.assert_allclose(move, expected, atol=1e-12 * np.abs(expected).max())


def test_limits_are_eq_16_and_eq_17_as_printed() -> None:
    """The same limits, written out: h/k of the window, and a ln t + b t from eqs 18, 20, 21."""
    position, radius = bed()
    limit = {"smoothing_radii": 0.0, "clip_quantile": 1.0}
    linear = estimate_jump_field(CYCLE, position, radius, get_law("linear"), 30, **limit)
    np.testing.assert_allclose(linear, 30 / 20 * (position[-1] - position[0]), atol=1e-15)
    t = 0.02 * CYCLE[1:]
    columns = np.stack([np.log(t), t], axis=1)
    displacement = (position[1:] - position[0]).reshape(20, -1)
    a, b = np.linalg.lstsq(columns, displacement, rcond=None)[0]
    expected = (a * np.log(1.6) + b * 1.6).reshape(-1, 3)
    printed = estimate_jump_field(CYCLE, position, radius, Karrech2007(period=0.02), 30, **limit)
    np.testing.assert_allclose(printed, expected, atol=1e-10 * np.abs(expected).max())


@every_law
@given(seed=seeds, reach=st.floats(0.0, 5.0), quantile=st.floats(0.3, 1.0))
@settings(max_examples=25, deadline=None)
def test_mean_settlement_is_the_law_of_the_mean(
    law: Law, seed: int, reach: float, quantile: float
) -> None:
    """However much is clipped and smoothed, the mean vertical move is the law's own."""
    position, radius = bed(seed)
    move = estimate_jump_field(
        CYCLE, position, radius, law, 30, smoothing_radii=reach, clip_quantile=quantile
    )
    rows = slice(law.first_state, None)
    mean = (position[rows] - position[0])[:, :, 2].mean(axis=1)
    expected = float(law.increment(law.fit(CYCLE[rows], mean), 50.0, 80.0))
    assert move[:, 2].mean() == pytest.approx(expected, abs=1e-12 * np.abs(move).max())


def test_loose_grains_are_not_flung() -> None:
    """A grain that hops 3 mm a cycle, twice the bed in a jump, moves like its surroundings."""
    position, radius = bed()
    calm = estimate_jump_field(CYCLE, position, radius, LOG, 30)
    top = int(position[-1, :, 2].argmax())
    loose = position.copy()
    loose[:, top] += np.multiply.outer(np.arange(21.0), [0.0, 1e-3, 3e-3])
    alone = estimate_jump_field(CYCLE, loose, radius, LOG, 30, smoothing_radii=0, clip_quantile=1)
    move = estimate_jump_field(CYCLE, loose, radius, LOG, 30)
    assert alone[top, 2] > 0.04
    bound = np.linalg.norm(clipped(alone, 0.95), axis=1).max()
    assert bound < 1e-4
    lost = (alone[top, 2] + 2 * bound) / len(radius)  # what the strain must make up for, mean
    share = loose[-1, :, 2] - loose[-1, :, 2].min()
    assert abs(move[top, 2]) < bound + lost * share[top] / share.mean()
    steady = np.delete(np.arange(len(radius)), top)
    assert np.abs(move - calm)[steady, :2].max() < bound


def test_one_loose_grain_in_a_large_bed_changes_nothing_else() -> None:
    """One of 2,000 grains rises by 3 mm in the window: the others shift by its share only."""
    position, radius = bed(count=2000)
    radius[:] = 0.5e-3
    top = int(position[-1, :, 2].argmax())
    loose = position.copy()
    loose[:, top, 2] += np.linspace(0.0, 3e-3, 21)
    change = estimate_jump_field(CYCLE, loose, radius, LOG, 30) - estimate_jump_field(
        CYCLE, position, radius, LOG, 30
    )
    increment = LOG.increment(LOG.fit(CYCLE[1:], loose[1:, top, 2]), 50.0, 80.0)
    far = np.linalg.norm(position[-1] - position[-1, top], axis=1) > 5e-3
    assert np.abs(change[far]).max() < 3 * float(increment) / 2000


def test_deficit_is_laid_on_as_a_strain() -> None:
    """What clipping takes from the mean comes back in proportion to height, none at the floor."""
    position, radius = bed()
    options = {"smoothing_radii": 0.0, "clip_quantile": 0.5}
    move = estimate_jump_field(CYCLE, position, radius, LOG, 30, **options)
    increments = LOG.increment(LOG.fit(CYCLE[1:], position[1:] - position[0]), 50.0, 80.0)
    added = move - clipped(increments, 0.5)
    height = position[-1, :, 2] - position[-1, :, 2].min()
    strain = added[:, 2].mean() / height.mean()
    assert abs(strain) > 1e-6
    np.testing.assert_allclose(added[:, 2], strain * height, atol=1e-16)
    assert np.abs(added[:, :2]).max() < 1e-16


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_field_turns_and_shifts_with_the_bed(seed: int) -> None:
    """Rotation about the vertical, translation and renumbering of grains commute with the jump."""
    position, radius = bed(seed)
    move = estimate_jump_field(CYCLE, position, radius, LOG, 30)
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    turn = np.array(
        [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    turned = estimate_jump_field(CYCLE, position @ turn + [0.5, -0.2, 0.1], radius, LOG, 30)
    # Positions of 0.5 m are rounded to 1e-16; the law sums 20 of them, amplified by 1 / ln(50/30).
    np.testing.assert_allclose(turned, move @ turn, atol=1e-14)
    order = np.random.default_rng(seed).permutation(len(radius))
    renumbered = estimate_jump_field(CYCLE, position[:, order], radius[order], LOG, 30)
    np.testing.assert_allclose(renumbered, move[order], atol=1e-16)


def test_smoothing_is_its_defining_sum() -> None:
    """The weighted mean equals a double loop over grains, each with its own reach."""
    position, radius = bed(3)
    move = np.random.default_rng(1).standard_normal(position[-1].shape)
    reach = 1.7 * radius
    expected = np.empty_like(move)
    for grain, centre in enumerate(position[-1]):
        weights, total = 0.0, np.zeros(3)
        for other, place in enumerate(position[-1]):
            weight = 1 - (np.linalg.norm(place - centre) / reach[grain]) ** 2
            if weight > 0:
                weights, total = weights + weight, total + weight * move[other]
        expected[grain] = total / weights
    np.testing.assert_allclose(smoothed(position[-1], move, reach), expected, rtol=1e-10)
    assert (np.abs(expected - move).max(axis=1) > 0.1).mean() > 0.5  # it does smooth


def test_uniform_move_is_not_changed() -> None:
    """A bed that moves as one body goes on as one body, whatever is clipped and smoothed."""
    place, radius = bed()
    drift = np.multiply.outer(np.log(CYCLE / 30.0), np.ones((60, 1)) * [1e-5, 0.0, -3e-5])
    move = estimate_jump_field(CYCLE, place[0] + drift, radius, LOG, 30)
    np.testing.assert_allclose(move, np.log(1.6) * np.array([[1e-5, 0, -3e-5]] * 60), atol=1e-15)


@given(seed=seeds, quantile=st.floats(0.01, 1.0))
@settings(max_examples=50, deadline=None)
def test_clip_shortens_without_turning(seed: int, quantile: float) -> None:
    """Clipped moves keep their direction; the share below the bound is untouched; 1 keeps all."""
    move = np.random.default_rng(seed).standard_cauchy((40, 3))
    short = clipped(move, quantile)
    length, before = np.linalg.norm(short, axis=1), np.linalg.norm(move, axis=1)
    assert (length <= before * (1 + 1e-12)).all()
    assert (short == move).all(axis=1).sum() >= int(quantile * 39)
    np.testing.assert_allclose(np.cross(short, move) / before.max() ** 2, 0, atol=1e-12)
    np.testing.assert_array_equal(clipped(move, 1.0), move)


def test_no_jump_no_move() -> None:
    """h = 0 moves nothing, to the last bit."""
    position, radius = bed()
    assert not estimate_jump_field(CYCLE, position, radius, LOG, 0).any()


def test_window_may_begin_before_the_first_cycle() -> None:
    """The unloaded state at cycle 0 is where displacement counts from, and no datum of ln N."""
    position, radius = bed()
    cycle = np.arange(21.0)
    options = {"smoothing_radii": 0.0, "clip_quantile": 1.0}
    move = estimate_jump_field(cycle, position, radius, LOG, 20, **options)
    later = estimate_jump_field(cycle[1:], position[1:], radius, LOG, 20, **options)
    assert np.isfinite(move).all()
    assert np.abs(move - later).max() > 1e-8  # cycle 1 is a datum of the first, not of the second


def test_single_grain_and_flat_layer() -> None:
    """A bed without height takes the deficit as a shift: no division by zero."""
    path = np.zeros((21, 1, 3))
    path[:, 0, 2] = -1e-5 * np.log(CYCLE)
    move = estimate_jump_field(CYCLE, path, np.array([3e-3]), LOG, 30)
    assert move[0] == pytest.approx([0, 0, -1e-5 * np.log(1.6)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"h": -1.0}, "a jump of -1 cycles"),
        ({"h": np.nan}, "a jump of nan"),
        ({"smoothing_radii": -1.0}, "smoothing_radii -1"),
        ({"smoothing_radii": np.inf}, "smoothing_radii inf"),
        ({"clip_quantile": 0.0}, "clip_quantile 0"),
        ({"clip_quantile": 1.5}, "clip_quantile 1.5"),
        ({"radius": np.ones(59)}, "not those of states of the same grains"),
        ({"position": np.zeros((21, 0, 3)), "radius": np.ones(0)}, "no grains"),
        ({"cycle": CYCLE[:-1]}, "do not fit displacements"),
    ],
)
def test_arguments_out_of_range_are_refused(change: dict[str, object], message: str) -> None:
    """Each argument that makes no sense is named."""
    position, radius = bed()
    arguments = {"cycle": CYCLE, "position": position, "radius": radius, "law": LOG, "h": 30.0}
    with pytest.raises(UsageError, match=message):
        estimate_jump_field(**(arguments | change))  # type: ignore[arg-type]


@pytest.mark.parametrize("row", [0, 7, 20])
def test_damaged_position_is_named(row: int) -> None:
    """A position that is not finite in any state of the window stops the jump."""
    position, radius = bed()
    position[row, 4, 1] = np.nan
    with pytest.raises(UsageError, match=r"not finite.*4, 1"):
        estimate_jump_field(CYCLE, position, radius, LOG, 30)


@pytest.mark.long
def test_hundred_thousand_grains_take_seconds() -> None:
    """1e5 grains and 20 cycles: under 3 s of processor time (0.7 s measured), by a tree."""
    random = np.random.default_rng(0)
    place = random.uniform(0, 0.36, (100_000, 3))  # as dense as a bed of 3.2 mm grains
    position = place - np.multiply.outer(1e-5 * np.log(CYCLE), np.ones((100_000, 3)))
    start = time.process_time()
    estimate_jump_field(CYCLE, position, np.full(100_000, 3.2e-3), LOG, 30)
    assert time.process_time() - start < 3.0
