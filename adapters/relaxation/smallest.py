"""The smallest move that gives a force network back the overlaps that it carried.

Among all positions x the one nearest to the estimated ones x_hat,

    minimise  1/2 sum_beta |x_beta - x_hat_beta|^2
    with      delta_c(x) = delta_c    in each contact c of the network            (two-sided)
              delta_c(x) <= -gap      for every other pair, and grain and wall    (one-sided)
              mean height of x = mean height of x_hat,

solved as a sequence of linearised problems, each in its multipliers mu: x = x_hat - J^T mu with
J = d delta/dx.  Spheres are convex, so a linearised "stay apart" is on the safe side.

The *network* is every pair with delta > -gap before the jump: contacts, and those so near that
they close under the next load.  It turns over: a pair outside that is pressed (mu > 0) takes the
place, and the overlap, of a member that is torn (mu < 0), the most pressed for the most torn.
So the number of contacts and the distribution of overlaps are those of before.
"""

from dataclasses import dataclass

import numpy as np

from adapters.bed import BoolArray, FloatArray, IntArray, Neighbours
from adapters.relaxation.kernel import estimate_norm, fill_changes, fill_moves, solve_multipliers
from adapters.relaxation.measured import Surroundings


@dataclass(frozen=True)
class SmallestNumbers:
    """Iterations, the linearised problem of each, and what the network gives way by."""

    slack: float = 1e-5  # weight of multipliers in their own equations, for redundant contacts [-]
    swap_share: float = 0.5  # of the pressed pairs that join the network at a time [-]
    skin: float = 0.2  # reach of the neighbour list beyond contact [median radii]
    nearest_iterations: int = 20  # that look for the nearest positions; later ones for any that fit
    open_iterations: int = 25  # after which contacts that cannot be closed are let go,
    open_share: float = 0.1  # and the share of them each time [-]
    accept_iterations: int = 45  # after which any bed with no overlap beyond the network's will do,
    iterations_max: int = 100  # and the most of them
    step_max: float = 0.5  # greatest step of a grain [radii]: beyond, linearised contacts mislead
    products_nearest: int = 100  # with J J^T at most while normals still turn,
    products_fit: int = 1000  # and in later iterations


SMALLEST = SmallestNumbers()


@dataclass
class _Rows:
    """All rows of a linearised problem, sorted by ``key``."""

    key: IntArray
    first: IntArray
    second: IntArray
    member: BoolArray  # true for a contact of the network
    target: FloatArray  # overlap of a member, greatest overlap of any other row [m]
    multiplier: FloatArray  # mu of each row, and that of the mean height last


def find_smallest_move(
    estimate: FloatArray, start: FloatArray, scene: Surroundings, network: Neighbours,
    overlap_cap: float, bound: float, gap: float, *, keep_height: bool, tolerance: float,
    accepted: float, evaluations_max: int,
) -> tuple[FloatArray, bool, int]:  # fmt: skip
    """Move grains from ``estimate`` (n, 3) [m] as little as the network allows.

    Returns their centres (n, 3) [m], whether all demands are met, and the evaluations of all
    overlaps, the products with J J^T counted in.

    ``start`` (n, 3) is where the iteration begins.  The overlaps of ``network`` are those to get
    back; above ``overlap_cap`` [m] a pair only stays below ``bound`` [m]; all others stay ``gap``
    [m] apart. ``tolerance`` [m] is the greatest error of an overlap. Where the demands contradict
    each other, late iterations end as soon as no overlap is above ``accepted`` [m]. Gives up
    after about ``evaluations_max`` evaluations.
    """
    radius, n = scene.radius, len(scene.radius)
    height_share = 1 / np.sqrt(n) if keep_height else 0.0
    skin = SMALLEST.skin * float(np.median(radius))
    x, anchor = start.copy(), estimate
    rows = start_rows(network, overlap_cap, bound, n)
    listed_at = None
    norm, evaluations = 1.0, 0
    for iteration in range(SMALLEST.iterations_max):
        if evaluations > evaluations_max:
            break
        if listed_at is None or np.linalg.norm(x - listed_at, axis=1).max() > skin / 2:
            rows, listed_at = renew_rows(rows, scene.search(x, skin), gap, n), x
            near = scene.rows(x, rows.first, rows.second)
            norm = estimate_norm(rows.first, rows.second, near.normal, height_share, n, 20)
        near = scene.rows(x, rows.first, rows.second)
        evaluations += 1
        excess = near.overlap - rows.target
        error = np.where(rows.member, np.abs(excess), np.maximum(excess, 0.0))
        violation = float(error.max(initial=0.0))
        lift = height_share * float((x - estimate)[:, 2].sum())
        swapped = 0
        if 0 < iteration < SMALLEST.nearest_iterations and violation < skin / 10:
            swapped = _swap(rows, gap)
        done = violation <= tolerance or (
            iteration >= SMALLEST.accept_iterations and near.overlap.max() <= accepted + tolerance
        )
        if iteration and not swapped and done and abs(lift) <= tolerance:
            return x, True, evaluations
        products_max = SMALLEST.products_nearest
        if iteration >= SMALLEST.nearest_iterations:
            anchor, products_max = x, SMALLEST.products_fit
            if iteration >= SMALLEST.open_iterations:
                _release(rows, excess, tolerance)
            rows.multiplier[:] = 0.0
        # x = anchor - J^T mu in delta(x_k) + J (x - x_k) = target, the slack's share put back
        right = np.empty(len(rows.key) + 1)
        fill_changes(rows.first, rows.second, near.normal, height_share, anchor - x, right)
        right[:-1] += near.overlap - rows.target
        right[-1] = height_share * float((anchor - estimate)[:, 2].sum())
        right += SMALLEST.slack * rows.multiplier
        products, _ = solve_multipliers(
            rows.first, rows.second, near.normal, height_share, SMALLEST.slack,
            np.append(rows.member, True), right, norm, max(0.3 * tolerance, 0.1 * violation),
            products_max, n, rows.multiplier,
        )  # fmt: skip
        evaluations += products
        move = np.empty((n, 3))
        fill_moves(rows.first, rows.second, near.normal, height_share, rows.multiplier, move)
        step = anchor + move - x
        length, limit = np.linalg.norm(step, axis=1), SMALLEST.step_max * radius
        x = x + step * np.minimum(1.0, limit / np.maximum(length, limit))[:, None]
    return x, False, evaluations


def _make_key(first: IntArray, second: IntArray, n: int) -> IntArray:
    """One number for each row of n grains, the same wherever the row is listed."""
    return (first << 32) + np.where(second >= 0, second, n - 1 - second)


def start_rows(network: Neighbours, overlap_cap: float, bound: float, n: int) -> _Rows:
    """Members of the network, and its pairs above the cap with a bound instead."""
    member = network.overlap <= overlap_cap
    key = _make_key(network.first, network.second, n)
    order = np.argsort(key)
    return _Rows(
        key[order], network.first[order], network.second[order], member[order],
        np.where(member, network.overlap, bound)[order], np.zeros(len(key) + 1),
    )  # fmt: skip


def renew_rows(rows: _Rows, near: Neighbours, gap: float, n: int) -> _Rows:
    """Rows nearby, and those of ``rows`` whose target is not that of any pair."""
    key = _make_key(near.first, near.second, n)
    own = rows.member | (rows.target != -gap)
    extra = own & ~np.isin(rows.key, key)
    key = np.concatenate([key, rows.key[extra]])
    order = np.argsort(key)
    key = key[order]
    first = np.concatenate([near.first, rows.first[extra]])[order]
    second = np.concatenate([near.second, rows.second[extra]])[order]
    member, target = np.zeros(len(key), bool), np.full(len(key), -gap)
    multiplier = np.append(np.zeros(len(key)), rows.multiplier[-1])
    known = np.isin(rows.key, key)
    place = np.searchsorted(key, rows.key[known])
    member[place], target[place] = rows.member[known], rows.target[known]
    multiplier[place] = rows.multiplier[:-1][known]
    return _Rows(key, first, second, member, target, multiplier)


def _swap(rows: _Rows, gap: float) -> int:
    """Let the most pressed rows outside the network take the places of its most torn members.

    Pairs of grains replace pairs and wall contacts wall contacts; forces that would move a grain
    by less than ``gap`` [m] change nothing.  Returns how many changed places.
    """
    mu, swapped = rows.multiplier[:-1], 0
    for kind in (rows.second >= 0, rows.second < 0):
        pressed = np.flatnonzero(kind & ~rows.member & (mu > gap))
        torn = np.flatnonzero(kind & rows.member & (mu < -gap))
        count = min(int(np.ceil(SMALLEST.swap_share * len(pressed))), len(torn))
        pressed = pressed[np.argsort(-mu[pressed])[:count]]
        torn = torn[np.argsort(mu[torn])[:count]]
        rows.target[pressed] = np.sort(rows.target[torn])[::-1]
        rows.target[torn] = -gap
        rows.member[pressed], rows.member[torn] = True, False
        mu[torn] = 0.0
        swapped += count
    return swapped


def _release(rows: _Rows, excess: FloatArray, tolerance: float) -> None:
    """Let go of the widest open members of the network; their overlap stays an upper bound."""
    gaping = np.flatnonzero(rows.member & (excess < -tolerance) & (rows.multiplier[:-1] < 0))
    count = int(np.ceil(SMALLEST.open_share * len(gaping)))
    rows.member[gaping[np.argsort(excess[gaping])[:count]]] = False
