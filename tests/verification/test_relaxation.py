"""Relaxation: kernels against NumPy and SciPy, closed forms, what a jump must keep, hard cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.spatial.distance import pdist

from adapters.bed import GOLDEN_ANGLE
from adapters.bed.contact_law import find_normal_force, find_overlap_under_force
from adapters.bed.container import Container, Walls
from adapters.bed.overlaps import find_behind_discs, find_pairs, measure_rows
from adapters.bed.state import FloatArray, State
from adapters.errors import NotConverged, UsageError
from adapters.relaxation.kernel import (
    add_hertz_energy,
    estimate_norm,
    fill_changes,
    fill_moves,
    solve_multipliers,
)
from adapters.relaxation.measured import Relaxation, RelaxationNotConverged
from adapters.relaxation.methods import bound_equilibrium_overlap, relax, relax_bare
from tests.deepest_overlap import deepest
from tests.made_beds import STIFFNESS, bed_made, jump, parted, state_at_rest

BOX = Container("box", size_x=0.1, size_y=0.1)
GRAVITY = 9.81
Bed = tuple[State, Walls]


@pytest.fixture(scope="module")
def bed() -> Bed:
    """A disordered bed with the contacts of a frictional one."""
    return bed_made(400)


@pytest.fixture(scope="module")
def settled() -> Bed:
    """A bed in the equilibrium of eq. 29 without friction: every force is balanced."""
    generator = np.random.default_rng(0)
    radius = generator.uniform(2e-3, 4e-3, 14)
    walls = Container("cylinder", ("x", "y"), radius=0.014).walls()
    start = generator.random((14, 3)) * [0.009, 0.009, 0.03]
    start = parted(start, radius, walls)
    state = state_at_rest(start, radius)
    free = np.zeros(14, bool)
    found = relax(start, state, walls, STIFFNESS, method="karrech2007", frontier=free)
    return state.move_to(found.position), walls


def column(count: int, overlap: FloatArray) -> Bed:
    """Equal grains on top of each other on the floor, overlaps [m] from the floor upwards."""
    radius = np.full(count, 3e-3)
    x = np.full((count, 3), 0.05)
    x[:, 2] = 3e-3 + 6e-3 * np.arange(count) - np.cumsum(overlap)
    return state_at_rest(x, radius), BOX.walls()


@pytest.mark.long
def test_hertz_potential_is_that_of_eq_5(settled: Bed) -> None:
    """psi and its gradient, the force of eq. 5, against a NumPy twin."""
    state, walls = settled
    behind = find_behind_discs(state.position, walls)
    rows = find_pairs(state.position, state.radius, walls)
    other = np.where(rows.second >= 0, state.radius[np.maximum(rows.second, 0)], np.inf)
    lambda_n = find_normal_force(
        1.0, STIFFNESS.grain, 1 / (1 / state.radius[rows.first] + 1 / other)
    )

    def energy(position: FloatArray) -> tuple[float, FloatArray]:
        near = measure_rows(position, state.radius, rows.first, rows.second, walls, behind)
        gradient = np.zeros_like(position)
        value = add_hertz_energy(
            near.first, near.second, near.normal, near.overlap, lambda_n, gradient
        )
        return value, gradient

    value, gradient = energy(state.position)
    assert value == pytest.approx(np.sum(lambda_n / 2.5 * rows.overlap**2.5))
    force = (lambda_n * rows.overlap**1.5)[:, None] * rows.normal
    twin = np.zeros_like(state.position)
    np.add.at(twin, rows.first, -force)
    pair = rows.second >= 0
    np.add.at(twin, rows.second[pair], force[pair])
    np.testing.assert_allclose(gradient, twin, rtol=1e-12, atol=1e-15)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_multipliers_against_scipy(seed: int) -> None:
    """The multipliers are those of SciPy's bounded least squares on the same small problem."""
    generator = np.random.default_rng(seed)
    n, m = 8, int(generator.integers(1, 20))
    first = generator.integers(0, n - 1, m)
    second = np.where(generator.random(m) < 0.3, -1, generator.integers(first + 1, n))
    normal = generator.standard_normal((m, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    two_sided = np.append(generator.random(m) < 0.5, True)
    right = generator.standard_normal(m + 1)
    share, slack = 1 / np.sqrt(n), 1e-3
    j = np.zeros((m + 1, 3 * n))
    for c in range(m):
        j[c, 3 * first[c] : 3 * first[c] + 3] = -normal[c]
        if second[c] >= 0:
            j[c, 3 * second[c] : 3 * second[c] + 3] = normal[c]
    j[m, 2::3] = share
    move, change = np.empty((n, 3)), np.empty(m + 1)
    fill_moves(first, second, normal, share, right, move)
    fill_changes(first, second, normal, share, move, change)
    np.testing.assert_allclose(move.ravel(), -right @ j, atol=1e-13)
    np.testing.assert_allclose(change, j @ move.ravel(), atol=1e-13)
    gram = j @ j.T + slack * np.eye(m + 1)
    norm = estimate_norm(first, second, normal, share, n, 200)
    # the norms |A v_k| of power iteration grow and their product is |A^200 v|, >= c lambda^200 for
    # the cosine c of the start v and the mode: so the last one is >= c^(1/200) lambda
    values, modes = np.linalg.eigh(j @ j.T)
    start = 1.0 + 0.5 * np.sin(GOLDEN_ANGLE * np.arange(m + 1))
    cosine = abs(modes[:, -1] @ start) / np.linalg.norm(start)
    assert cosine ** (1 / 200) * values[-1] <= norm * (1 + 1e-12) <= values[-1] * (1 + 2e-12)
    mu = np.zeros(m + 1)
    products, error = solve_multipliers(
        first, second, normal, share, slack, two_sided, right, norm, 1e-10, 5000, n, mu
    )
    assert error <= 1e-10
    assert products < 5000
    # 1/2 mu.G mu - right.mu is least squares in L^T mu - L^-1 right, G = L L^T
    root = np.linalg.cholesky(gram)
    bound = np.where(two_sided, -np.inf, 0.0)
    peer = lsq_linear(
        root.T, np.linalg.solve(root, right), (bound, np.inf), method="bvls", tol=1e-15
    )
    # both within 1e-10 of their optimality conditions, amplified by 1/slack at most
    np.testing.assert_allclose(mu, peer.x, atol=1e-6)


# --- closed forms ----------------------------------------------------------------------------


def test_two_grains_share_the_move() -> None:
    """Two equal grains pressed together by 2 a part by a each, down to the overlap they carried."""
    radius, carried = np.full(2, 3e-3), 5e-8
    x = np.array([[0.05, 0.05, 0.05], [0.05 + 6e-3 - carried, 0.05, 0.05]])
    state = state_at_rest(x, radius)
    estimate = x + np.array([[1e-5, 0, 0], [-1e-5, 0, 0]])
    found = relax(estimate, state, BOX.walls(), STIFFNESS)
    np.testing.assert_allclose(found.position, x, atol=0.01 * carried)
    assert found.largest_move == pytest.approx(1e-5, rel=1e-3)


@pytest.mark.parametrize("keep_height", [True, False])
def test_column_moves_as_least_squares_says(keep_height: bool) -> None:
    """On a line the problem is linear: x = x_hat - J^+ (violation), by NumPy's pseudo-inverse.

    With the mean height kept there is one equation more than the floor allows, so the floor's
    contact is left out of the column.
    """
    overlap = np.array([-1e-4, 4e-8, 6e-8, 5e-8]) if keep_height else np.full(4, 5e-8)
    state, walls = column(4, overlap)
    lift = np.array([2e-5, -3e-5, 1e-5, 4e-5])
    estimate = state.position + lift[:, None] * [0, 0, 1]
    j = -np.eye(4) + np.eye(4, k=-1)
    if keep_height:
        j[0] = 0.5
    missed = j @ lift
    if keep_height:
        missed[0] = 0.0
    expected = lift - np.linalg.pinv(j) @ missed
    found = relax(estimate, state, walls, STIFFNESS, keep_height=keep_height)
    moved = found.position - state.position
    np.testing.assert_allclose(moved[:, 2], expected, atol=0.05 * 5e-8)
    np.testing.assert_allclose(moved[:, :2], 0, atol=1e-15)
    assert found.evaluations < 50


def test_a_torn_contact_is_replaced_by_a_pressed_one() -> None:
    """One grain leaves its wall, another meets a wall: the second gets the overlap of the first."""
    walls, carried = BOX.walls(), 7e-8
    x = np.array([[3e-3 - carried, 0.03, 0.05], [0.09, 0.07, 0.05]])
    estimate = x + np.array([[2e-4, 0, 0], [0.0072, 0, 0]])
    found = relax(estimate, state_at_rest(x, np.full(2, 3e-3)), walls, STIFFNESS)
    np.testing.assert_allclose(found.position[0], estimate[0], atol=1e-9)
    np.testing.assert_allclose(found.position[1], [0.097 + carried, 0.07, 0.05], atol=1e-9)


@pytest.mark.long
def test_move_is_the_smallest(bed: Bed) -> None:
    """At the end the move is a combination of contact normals alone: no floppy part is left.

    x - x_hat = -J^T mu holds to the share by which the normals turn, move/distance.
    """
    state, walls = bed
    estimate = jump(state)
    found = relax(estimate, state, walls, STIFFNESS)
    rows = find_pairs(found.position, state.radius, walls, 1e-5)
    n, m = len(state.radius), len(rows)
    j = np.zeros((m + 1, n, 3))
    j[np.arange(m), rows.first] = -rows.normal
    pair = rows.second >= 0
    j[np.arange(m)[pair], rows.second[pair]] = rows.normal[pair]
    j[m, :, 2] = 1
    move = (found.position - estimate).ravel()
    mu = np.linalg.lstsq(j.reshape(m + 1, -1).T, move, rcond=None)[0]
    rest = np.linalg.norm(move - j.reshape(m + 1, -1).T @ mu) / np.linalg.norm(move)
    assert rest < found.largest_move / state.radius.min()


# --- what a jump keeps -----------------------------------------------------------------------


def test_equilibrium_does_not_move(settled: Bed) -> None:
    """A bed whose forces balance stays as it is beside its own contacts.

    Without them known it moves by less than 1 um: a contact that wedges carries more than the
    weight, of which the bound of overlaps knows nothing, and is brought down to that.
    """
    state, walls = settled
    found = relax(state.position, state, walls, STIFFNESS)
    assert found.largest_move < 1e-12
    assert found.coordination_change == 0
    assert relax_bare(state, walls, STIFFNESS).largest_move < 1e-6


def test_printed_functional_holds_its_own_equilibrium(settled: Bed) -> None:
    """eq. 29 started from its minimum stays there, frontier fixed or free."""
    state, walls = settled
    for frontier in (None, np.zeros(len(state.radius), bool)):
        found = relax(
            state.position,
            state,
            walls,
            STIFFNESS,
            method="karrech2007",
            frontier=frontier,
            tolerance=0.02,
        )
        assert found.largest_move < 1e-6


def kept(found: Relaxation) -> None:
    """The bars of a jump: contacts within 3 %, height within 5 %, overlaps as carried."""
    assert found.converged
    assert abs(found.coordination_change) < 0.03
    change = found.relaxed.coordination_number / found.before.coordination_number - 1
    assert abs(change) < 0.03
    settlement = found.before.mean_height - found.estimated.mean_height
    kept_settlement = found.before.mean_height - found.relaxed.mean_height
    assert abs(kept_settlement - settlement) < 0.05 * abs(settlement) + 1e-9
    assert found.relaxed.max_penetration < 1.01 * found.before.max_penetration
    assert found.relaxed.mean_penetration == pytest.approx(found.before.mean_penetration, rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_jump_keeps_contacts_height_and_overlaps(bed: Bed, seed: int) -> None:
    """From overlaps of 0.2 mm back to those carried, at the jump's own settlement."""
    state, walls = bed
    found = relax(jump(state, seed), state, walls, STIFFNESS)
    assert found.estimated.max_penetration > 1e-4
    kept(found)
    assert deepest(found.position, state.radius, walls) == pytest.approx(
        found.relaxed.max_penetration, abs=1e-15
    )


def test_jump_under_a_piston_that_sinks(bed: Bed) -> None:
    """A grain that carried the piston, which sinks more than grains move, carries it as before."""
    state, _ = bed
    top = float((state.position[:, 2] + state.radius).max())
    container = Container("box", size_x=1.0, size_y=1.0)
    before, after = container.walls(top - 1e-7), container.walls(top - 1e-7 - 2e-4)
    middle = state.move_to(state.position + np.array([0.3, 0.3, 0]))
    found = relax(jump(middle), middle, before, STIFFNESS, walls_after=after)
    kept(found)
    rows = find_pairs(found.position, middle.radius, after)
    assert rows.overlap[rows.second == -6] == pytest.approx([1e-7], rel=0.01)


def test_scale_and_order_do_not_matter(bed: Bed) -> None:
    """Bit for bit: lengths times 1024 give moves times 1024, another order of grains the same."""
    state, walls = bed
    estimate = jump(state)
    found = relax(estimate, state, walls, STIFFNESS).position
    order = np.random.default_rng(0).permutation(len(state.radius))
    shuffled = state_at_rest(state.position[order], state.radius[order])
    np.testing.assert_array_equal(
        relax(estimate[order], shuffled, walls, STIFFNESS).position, found[order]
    )
    wide = replace(walls, plane_point=1024 * walls.plane_point)
    large = state_at_rest(1024 * state.position, 1024 * state.radius)
    np.testing.assert_array_equal(
        relax(1024 * estimate, large, wide, STIFFNESS).position, 1024 * found
    )


# --- Fig. 8 and hard cases -------------------------------------------------------------------


def nine_grains() -> tuple[State, Walls]:
    """Fig. 8: nine grains, three by three in a vertical plane between walls, all in touch."""
    pitch = 6e-3 - 1e-7
    x = np.array([[i * pitch, 0.0, k * pitch] for k in range(3) for i in range(3)])
    x += [3e-3 - 5e-8, 3e-3, 3e-3 - 5e-8]
    walls = Container("box", size_x=3 * pitch, size_y=6e-3).walls(piston_height=3 * pitch)
    return state_at_rest(x, np.full(9, 3e-3)), walls


@pytest.mark.parametrize("method", ["smallest-move", "karrech2007"])
def test_nine_grain_cell(method: str) -> None:
    """The displaced centre grain of Fig. 8 penetrates by a millimetre and comes back out.

    Eq. 29 with the eight frontier grains fixed is symmetric but for the weight, so the grain
    returns to the centre, lower by W/(two contacts' stiffness), far below 1e-8 m.
    """
    state, walls = nine_grains()
    estimate = state.position.copy()
    estimate[4] += [1.5e-3, 0.0, 1e-3]
    found = relax(estimate, state, walls, STIFFNESS, method=method, keep_height=False)
    assert found.estimated.max_penetration > 1e-3
    assert found.relaxed.max_penetration < 2e-7
    if method == "karrech2007":
        np.testing.assert_allclose(found.position, state.position, atol=1e-8)


def coincident(state: State) -> FloatArray:
    estimate = state.position.copy()
    estimate[100] = estimate[101]
    estimate[[200, 201]] = estimate[202]
    return estimate


def through_walls(state: State) -> FloatArray:
    estimate = state.position.copy()
    estimate[np.argmin(estimate[:, 2]), 2] = -0.01
    estimate[np.argmin(estimate[:, 0]), 0] = -0.02
    estimate[np.argmax(estimate[:, 1]), 1] += 0.01
    return estimate


def half_overlap(state: State) -> FloatArray:
    estimate = state.position.copy()
    i, j = np.triu_indices(len(estimate), 1)
    touching = pdist(estimate) < state.radius[i] + state.radius[j]
    i, j = i[touching][::20], j[touching][::20]
    estimate[i] += 0.5 * (state.position[j] - state.position[i])
    return estimate


def compressed(state: State) -> FloatArray:
    return state.position * [1, 1, 0.98]


@pytest.mark.parametrize("make", [coincident, through_walls, half_overlap, compressed])
def test_hard_cases_end_valid(bed: Bed, make: object) -> None:
    """Coincident centres, grains far outside, half overlaps, all pressed: no overlap above those
    that the network carried, and the mean height of the estimate."""
    state, walls = bed
    estimate = make(state)  # type: ignore[operator]
    found = relax(estimate, state, walls, STIFFNESS)
    assert found.relaxed.mean_height == pytest.approx(found.estimated.mean_height, abs=1e-8)
    assert found.converged
    assert found.estimated.max_penetration > 5e-5
    assert deepest(found.position, state.radius, walls) <= 1.01 * found.before.max_penetration


def test_radii_of_one_to_twenty() -> None:
    """A random gas of grains of 0.5 to 10 mm, all overlapping, ends without any deep overlap."""
    generator = np.random.default_rng(0)
    radius = 5e-4 * 20 ** generator.random(500)
    side = (4 / 3 * np.pi * np.sum(radius**3) / 0.5) ** (1 / 3)
    walls = Container("box", size_x=side, size_y=side).walls()
    gas = radius[:, None] + generator.random((500, 3)) * (side - 2 * radius[:, None])
    assert deepest(gas, radius, walls) > 1e-3
    assert deepest(parted(gas, radius, walls), radius, walls) <= 0.0


@pytest.mark.parametrize("height", [3e-3, 0.03, -0.02, -1.0])
def test_single_grain(height: float) -> None:
    """One grain on the floor or in the air stays; far below the floor it comes up to it."""
    x = np.array([[0.05, 0.05, height]])
    found = parted(x, np.array([3e-3]), BOX.walls())
    assert found[0] == pytest.approx([0.05, 0.05, max(height, 3e-3)], abs=1e-6)


def test_grains_without_contacts_may_fly() -> None:
    """Without any contact before and after, the estimate is taken as it is."""
    x = np.array([[0.02, 0.02, 0.02], [0.05, 0.05, 0.05]])
    state = state_at_rest(x, np.full(2, 3e-3))
    estimate = x + np.array([[1e-3, 0, 0], [0, 0, -1e-3]])
    np.testing.assert_array_equal(relax(estimate, state, BOX.walls(), STIFFNESS).position, estimate)


def test_what_can_not_fit_is_said() -> None:
    """A grain thicker than its cylinder: `NotConverged` with the best configuration attached."""
    walls = Container("cylinder", radius=2.9e-3).walls()
    with pytest.raises(RelaxationNotConverged, match="smallest-move") as error:
        parted(np.array([[0.0, 0.0, 3e-3]]), np.array([3e-3]), walls)
    assert isinstance(error.value, NotConverged)
    assert not error.value.best.converged
    assert error.value.best.relaxed.max_penetration >= 1e-4
    assert np.isfinite(error.value.best.position).all()


def test_a_printed_functional_cut_short_is_said(bed: Bed) -> None:
    """Eq. 29 on a bed that friction would hold flows; cut short it says so and keeps its best."""
    state, walls = bed
    with pytest.raises(RelaxationNotConverged) as error:
        relax(
            jump(state),
            state,
            walls,
            STIFFNESS,
            method="karrech2007",
            frontier=np.zeros(len(state.radius), bool),
            evaluations_max=2000,
        )
    best = error.value.best
    fall = best.before.mean_height - best.relaxed.mean_height
    assert fall > 2 * (best.before.mean_height - best.estimated.mean_height)
    assert "position" not in best.record()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["estimate", "before", "radius"])
def test_numbers_that_are_not_finite(bed: Bed, bad: float, where: str) -> None:
    """NaN and infinity in the input are refused by name of the grain."""
    state, walls = bed
    estimate = state.position.copy()
    if where == "estimate":
        estimate[5, 1] = bad
    elif where == "before":
        position = state.position.copy()
        position[5, 1] = bad
        state = state.move_to(position)
    else:
        radius = state.radius.copy()
        radius[5] = bad
        state = replace(state, radius=radius)
    with pytest.raises(UsageError, match="grain 5"):
        relax(estimate, state, walls, STIFFNESS)


def test_arguments_that_do_not_fit(bed: Bed) -> None:
    """Other walls, an unknown method, a wrong count and an empty bed: `UsageError`."""
    state, walls = bed
    x = state.position
    with pytest.raises(UsageError, match="walls"):
        relax(x, state, walls, STIFFNESS, walls_after=BOX.walls(piston_height=0.1))
    with pytest.raises(UsageError, match="no relaxation"):
        relax(x, state, walls, STIFFNESS, method="magic")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="belong together"):
        relax(x[1:], state, walls, STIFFNESS)
    empty = state_at_rest(np.empty((0, 3)), np.empty(0))
    with pytest.raises(UsageError, match="wants grains"):
        relax(np.empty((0, 3)), empty, walls, STIFFNESS)


def test_pressed_bed_without_a_past(bed: Bed) -> None:
    """Overlaps of a bed pressed by 2 % come down to what a bed at rest can carry."""
    state, walls = bed
    pressed = state.move_to(state.position * [1, 1, 0.98])
    found = relax_bare(pressed, walls, STIFFNESS)
    limit = 1.01 * bound_equilibrium_overlap(pressed, STIFFNESS)
    assert found.estimated.max_penetration > 5e-5
    assert deepest(found.position, state.radius, walls) <= limit


def test_bound_of_overlaps_is_above_the_heaviest_contact_of_a_column() -> None:
    """There each contact carries all weight above it; Hertz: overlap grows as force^(2/3)."""
    state, _ = column(6, np.zeros(6))
    weight = GRAVITY * state.mass
    carried = find_overlap_under_force(weight[1:].sum(), STIFFNESS.grain, 1.5e-3)
    bound = bound_equilibrium_overlap(state, STIFFNESS)
    assert carried < bound < 1.2 * carried
    loaded = bound_equilibrium_overlap(state, STIFFNESS, 7 * weight.sum())
    assert loaded == pytest.approx(4 * bound)
