"""The rail on beds that only push: closed forms, independent solutions, balance of forces."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from track_line.beam import (
    GRAVITY,
    Rail,
    Track,
    assemble_rail,
    make_support,
    rest_wheels,
    roll_axle,
)
from track_line.beam.kernel import choose_bearing
from trackbed.errors import NotConverged

TRACK = Track()
WEIGHT = TRACK.sleeper_mass * GRAVITY
BED, WHEEL = 28e6, 100e3
SERIES = TRACK.pad * BED / (TRACK.pad + BED)
ROUND_OFF = 1e-12  # of forces over the wheel load


def make_matrix(rail: Rail) -> np.ndarray:
    """The dense matrix of a rail, deflection and slope of each seat by turns."""
    n = len(rail.diagonal)
    dense = np.zeros((2 * n, 2 * n))
    for i, (ww, ws, ss) in enumerate(rail.diagonal):
        dense[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[ww, ws], [ws, ss]]
    for i, block in enumerate(rail.upper):
        dense[2 * i : 2 * i + 2, 2 * i + 2 : 2 * i + 4] = block.reshape(2, 2)
        dense[2 * i + 2 : 2 * i + 4, 2 * i : 2 * i + 2] = block.reshape(2, 2).T
    return dense


def rest(track: Track, settled: Any, load: Any, bed: Any = BED, **keys: Any) -> Any:
    """One line at rest."""
    settled = np.atleast_2d(np.asarray(settled, float))
    rail = assemble_rail(track.spacing * np.arange(settled.shape[1]), track)
    support = make_support(track, np.broadcast_to(bed, settled.shape).astype(float))
    return rest_wheels(rail, support, settled, np.asarray(load, float))


def point_load(n: int, *places: int, wheel: float = WHEEL) -> np.ndarray:
    load = np.zeros(n)
    load[list(places)] = wheel
    return load


def bear_all(track: Track, n: int, load: np.ndarray) -> np.ndarray:
    """Forces on beds that also pull, densely."""
    matrix = make_matrix(assemble_rail(track.spacing * np.arange(n), track))
    matrix[::2, ::2] += SERIES * np.eye(n)
    return SERIES * np.linalg.solve(matrix, np.stack([load, 0 * load], axis=1).ravel())[::2]


def test_beam_on_a_continuous_bed_is_of_fourth_order() -> None:
    """Deflection under a load on a Winkler foundation u, P beta/(2 u), beta^4 = u/(4 E I): halving
    elements divides the error by 16, and 8 a bay are within 2e-7.

    The foundation's matrix is the Hermite element's own (consistent, exact).
    """
    modulus, errors = SERIES / TRACK.spacing, []
    beta = (modulus / (4 * TRACK.bending)) ** 0.25
    exact = WHEEL * beta / (2 * modulus)
    assert exact == pytest.approx(1.499359e-3, rel=1e-6)
    for parts in (1, 2, 4, 8):
        h = TRACK.spacing / parts
        n = 2 * round(12 / h) + 1
        matrix = make_matrix(assemble_rail(h * np.arange(n), TRACK))
        a, b, c, d, e, f = 156, 22 * h, 54, -13 * h, 4 * h * h, -3 * h * h
        element = [[a, b, c, d], [b, e, -d, f], [c, -d, a, -b], [d, f, -b, e]]
        for i in range(n - 1):
            matrix[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += modulus * h / 420 * np.array(element)
        load = np.zeros(2 * n)
        load[n - 1] = WHEEL
        errors.append(abs(np.linalg.solve(matrix, load)[n - 1] / exact - 1))
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert rates == pytest.approx(4.0, abs=0.1)
    assert errors[-1] < 2e-7


@pytest.mark.parametrize(
    ("kappa", "share"),
    [(0.740619, 0.3274552), (0.1, 0.1987797), (1.0, 0.3527611), (3.0, 0.4618002)],
)
def test_share_of_a_seat_is_that_of_the_endless_lattice(kappa: float, share: float) -> None:
    """Bed to rail, H(q) = 1/(1 + 12/kappa (1 - cos q)^2/(2 + cos q)); the loaded seat takes its
    mean over q of the wheel, kappa = k_s a^3/(E I).  A line of 161 seats does not see its ends."""
    track = Track(bending=SERIES * TRACK.spacing**3 / kappa, rail_mass=0.0, sleeper_mass=1e3)
    q = (np.arange(20_000) + 0.5) * np.pi / 20_000
    lattice = 1 / (1 + 12 / kappa * (1 - np.cos(q)) ** 2 / (2 + np.cos(q)))
    force = rest(track, np.zeros(161), point_load(161, 80)).force[0, 80]
    found = force - track.sleeper_mass * GRAVITY
    assert found / WHEEL == pytest.approx(lattice.mean(), rel=1e-9)
    assert found / WHEEL == pytest.approx(share, abs=5e-7 if kappa == 0.740619 else 5e-8)


def test_two_wheels_add_up_where_all_sleepers_bear_and_only_there() -> None:
    """With heavy sleepers nothing lifts: forces of two wheels are the sum of those of each, less
    the weight counted twice.  With a void between the wheels they are not."""
    heavy = Track(sleeper_mass=1e3)
    one, two, both, none = (
        rest(heavy, np.zeros(61), point_load(61, *at)).force for at in ((28,), (31,), (28, 31), ())
    )
    assert np.abs(one + two - both - none).max() < ROUND_OFF * WHEEL
    expected = bear_all(heavy, 61, point_load(61, 28, 31))
    assert np.abs(both - none - expected).max() < ROUND_OFF * WHEEL
    hollow = np.where(np.arange(61) == 30, 2.4e-3, 0.0)
    one, two, both, none = (
        rest(TRACK, hollow, point_load(61, *at)).force[0] for at in ((28,), (31,), (28, 31), ())
    )
    assert one[30] == two[30] == none[30] == 0 < both[30]  # two wheels close what neither does
    assert np.abs(one + two - both - none).max() > 0.01 * WHEEL


@pytest.mark.parametrize(
    ("void", "here", "beside"), [(1e-3, 19_859.50, 30_884.03), (2.350679e-3, 0.05, 37_936.04)]
)
def test_one_void_takes_load_as_it_closes(void: float, here: float, beside: float) -> None:
    """A sleeper over a void bears once the rail has bent so far: with weight a void of 2.350679 mm
    closes under 100 kN.  The force at 1 mm is linear in between."""
    settled = np.where(np.arange(121) == 60, void, 0.0)
    found = rest(TRACK, settled, point_load(121, 60))
    assert found.force[0, 60] == pytest.approx(here, abs=0.05)
    assert found.force[0, [59, 61]] == pytest.approx(beside, abs=0.1)
    free = rest(TRACK, np.where(settled > 0, 3e-3, 0.0), point_load(121, 60))
    assert free.force[0, 60] == 0
    assert free.gap[0, 60] == pytest.approx(3e-3 - 2.350679e-3, abs=1e-8)


def make_uneven(seed: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Beds with voids and a stiff end, and a load."""
    rng = np.random.default_rng(seed)
    settled = 1e-3 * rng.normal(size=n)
    bed = BED * np.exp(0.3 * rng.normal(size=n)) * np.where(np.arange(n) > 2 * n // 3, 10.0, 1.0)
    return settled, bed, point_load(n, *rng.choice(n, 2, replace=False))


def solve_dense(settled: np.ndarray, bed: np.ndarray, load: np.ndarray, bears: Any) -> tuple:
    """Rail, sleepers and beds of a given set that bears, sleepers not eliminated: deflections of
    sleepers, forces on the beds."""
    n = len(load)
    rail = assemble_rail(TRACK.spacing * np.arange(n), TRACK)
    pads = np.zeros((3 * n, 3 * n))
    pads[: 2 * n, : 2 * n] = make_matrix(rail)
    over, below = 2 * np.arange(n), 2 * n + np.arange(n)
    pads[over, over] += TRACK.pad
    pads[below, below] += TRACK.pad + bed * bears
    pads[over, below] -= TRACK.pad
    pads[below, over] -= TRACK.pad
    right = np.concatenate(
        [
            (np.stack([load, 0 * load], axis=1) + rail.weight).ravel(),
            WEIGHT + bed * settled * bears,
        ]
    )
    sunk = np.linalg.solve(pads, right)[below]
    return sunk, bed * (sunk - settled) * bears


@pytest.mark.parametrize("seed", range(1, 7))
def test_the_set_that_bears_is_the_only_one_of_all(seed: int) -> None:
    """Of all 2^8 sets of a line of 8 sleepers, solved with sleepers as unknowns, one has no pull
    and no overlap; its forces are ours."""
    settled, bed, load = make_uneven(seed, 8)
    sound = []
    for bears in product((0.0, 1.0), repeat=8):
        if sum(bears) > 1:
            sunk, force = solve_dense(settled, bed, load, np.array(bears))
            open_or_pressed = np.where(np.array(bears) > 0, force >= 0, sunk <= settled)
            sound += [force] * bool(open_or_pressed.all())
    assert len(sound) == 1
    found = rest(TRACK, settled, load, bed).force[0]
    assert np.abs(found - sound[0]).max() < 1e-10 * WHEEL
    assert (found == 0).any(), "nothing hangs, so nothing was chosen"


def test_forces_balance() -> None:
    """Beds carry wheels, rail and sleepers, and their moment, to round-off: 10 random lines, which
    a dense solution of the sleepers that bear finds, too."""
    for seed in range(10):
        settled, bed, load = make_uneven(seed, 200)
        force = rest(TRACK, settled, load, bed).force[0]
        assert (force >= 0).all()
        sunk, dense = solve_dense(settled, bed, load, force > 0)
        assert (sunk[force == 0] <= settled[force == 0]).all()
        assert np.abs(dense - force).max() < 1e-10 * WHEEL
        place = TRACK.spacing * np.arange(200)
        rail = TRACK.rail_mass * GRAVITY * place[-1]
        down = load.sum() + rail + 200 * WEIGHT
        assert force.sum() == pytest.approx(down, rel=ROUND_OFF)
        moment = (load + WEIGHT) @ place + rail * place[-1] / 2
        assert force @ place == pytest.approx(moment, rel=1e-10)


def test_an_axle_that_rolls_is_each_of_its_places() -> None:
    """The comb of wheels gives each sleeper the force of a wheel on it alone, to 1e-5, and so does
    a passage that begins where another one ended."""
    settled, bed, _ = make_uneven(3, 121)
    settled *= 0.3
    rail, support = assemble_rail(0.6 * np.arange(121), TRACK), make_support(TRACK, bed[None])
    passage = roll_axle(rail, support, settled[None], WHEEL)
    for i in (30, 41, 60, 77, 90):
        alone = rest(TRACK, settled, point_load(121, i), bed)
        assert passage.force[0, i] == pytest.approx(alone.force[0, i], abs=1e-5 * WHEEL)
        assert passage.level[0, i] == pytest.approx(alone.rail[0, i], abs=1e-7)
    assert passage.bears.shape == (1, support.period, 121)
    moved = roll_axle(rail, support, settled[None] * 1.5, WHEEL)
    warm = roll_axle(rail, support, settled[None] * 1.5, WHEEL, passage.bears)
    np.testing.assert_allclose(warm.force, moved.force, rtol=0, atol=1e-9 * WHEEL)
    assert (passage.force != moved.force).any()


def test_a_rail_on_one_sleeper_is_refused() -> None:
    """In balance on its middle, it would turn at a touch; off its middle it finds a second one."""
    settled = np.full(31, 1.0)
    settled[15] = 0.0
    with pytest.raises(NotConverged, match="no two sleepers bear"):
        rest(TRACK, settled, np.zeros(31))
    assert (rest(TRACK, np.roll(settled, 1), np.zeros(31)).force > 0).sum() == 2


def test_late_turns_change_one_sleeper() -> None:
    """The least index of those that are wrong, as Murty's method has it."""
    bears = np.array([True, True, False])
    rail = np.array([1.0, -1.0, 1.0])
    assert choose_bearing(rail, np.zeros(3), bears, 1) == 1
    assert bears.tolist() == [True, False, False]
    assert choose_bearing(rail, np.zeros(3), bears, 3) == 1
    assert bears.tolist() == [True, False, True]
