"""The parts of the interior point and of Newton's method, against definitions and differences."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp.friction.linear.factorisation import (
    BodyFactorisation,
    ContactFactorisation,
    DenseFactorisation,
    SingularSystem,
)
from rigid_lcp.friction.linear.lorentz_cones import (
    divide_cones,
    find_cone_step,
    find_scaling,
    multiply_cones,
    scale_cones,
    square_scaling,
)
from rigid_lcp.friction.methods.interior_point import (
    Path,
    find_coulomb_velocity,
    solve_interior_point,
)
from rigid_lcp.friction.methods.newton import find_alart_curnier, solve_newton
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from tests.rigid_networks import random_bodies
from validation.bench.rigid.packings import build_tower


def inside(generator: np.random.Generator, contacts: int, dim: int) -> np.ndarray:
    x = generator.standard_normal((contacts, dim))
    x[:, 0] = np.linalg.norm(x[:, 1:], axis=1) + generator.uniform(0.01, 2.0, contacts)
    return x


def chain(bodies: int, dim: int, seed: int = 0) -> FrictionProblem:
    """Bodies, each bound to the one before and to the ground by contacts at random."""
    g = np.random.default_rng(seed)
    pairs = [pair for k in range(bodies) for pair in ((k, -1), (k, k - 1))]
    space = random_bodies(pairs, bodies, dim, g)
    velocity = space.jacobian @ g.standard_normal(bodies * space.body_size)
    return make_problem(space, velocity, g.uniform(0.1, 0.9, 2 * bodies), dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_scaling_maps_both_points_onto_one(dim):
    g = np.random.default_rng(1)
    x, s = inside(g, 50, dim), inside(g, 50, dim)
    eta, point = find_scaling(x, s)
    scaled = scale_cones(eta, point, x, False)
    np.testing.assert_allclose(scaled, scale_cones(eta, point, s, True), rtol=1e-9, atol=1e-11)
    square = square_scaling(eta, point)
    np.testing.assert_allclose(np.einsum("cij,cj->ci", square, x), s, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(multiply_cones(x, divide_cones(x, s)), s, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_step_ends_on_the_boundary(dim):
    """The determinant x_N^2 - |x_T|^2 is zero there for one contact, and negative for none."""
    g = np.random.default_rng(2)
    for _ in range(200):
        x, d = inside(g, 3, dim), g.standard_normal((3, dim))
        step = find_cone_step(x, d)
        if step > 1e20:
            continue
        y = x + step * d
        determinant = y[:, 0] ** 2 - np.sum(y[:, 1:] ** 2, axis=1)
        assert abs(determinant.min()) < 1e-9 * (y**2).sum()
        assert (y[:, 0] > -1e-12).all()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("convex", [False, True])
def test_the_derivative_of_the_rounded_velocity(dim, convex):
    g = np.random.default_rng(3)
    s, mu, h = inside(g, 20, dim), g.uniform(0.1, 1.0, 20), 1e-6
    _, slope = find_coulomb_velocity(s, mu, 0.3, convex)
    for k in range(dim):
        d = np.zeros(dim)
        d[k] = h
        ahead, behind = (find_coulomb_velocity(s + w, mu, 0.3, convex)[0] for w in (d, -d))
        np.testing.assert_allclose((ahead - behind) / (2 * h), slope[:, :, k], atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("mu", [0.1, 0.7])
def test_the_lagged_path_ends_at_coulombs_law_where_one_block_slides(dim, mu):
    """A block of mass one pressed down by 1 and pushed by 1 slides: ``r = (1, -mu)``, where the
    convex answer lifts it: ``r_N = (1 + mu) / (1 + mu^2)``.

    |u_T| of the step before is wrong by ``mu^2 / (1 + mu^2)`` of its error there, 1/3 at most, so
    the ten and more steps that the gap takes to vanish leave less than 3^-10 of 1.
    """
    offset = np.zeros(dim)
    offset[0], offset[1] = -1.0, 1.0
    problem = make_problem(np.eye(dim), offset, mu, dim)
    exact = np.zeros(dim)
    exact[:2] = 1.0, -mu
    found = solve_interior_point(
        problem, None, 1e-9, Path(rounding=1e-3, compliance=1e-4, lagged=True)
    )
    np.testing.assert_allclose(found.r, exact, atol=3.0**-10)
    convex = solve_interior_point(problem, None, 1e-9, Path(convex=True, compliance=1e-4))
    assert convex.r[0] == pytest.approx((1.0 + mu) / (1.0 + mu**2), rel=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_derivatives_of_the_contact_law(dim):
    """A = dF/dr and B = dF/du by central differences, away from changes of status."""
    g = np.random.default_rng(4)
    r, u = g.standard_normal((2, 60, dim))
    mu, rho, h = g.uniform(0.1, 3.0, 60), g.uniform(0.5, 2.0, 60), 1e-6
    _, a, b, status = find_alart_curnier(r, u, mu, rho)
    assert set(status) == {0, 1, 2}
    for k in range(dim):
        d = np.zeros(dim)
        d[k] = h
        by_r = (
            find_alart_curnier(r + d, u, mu, rho)[0] - find_alart_curnier(r - d, u, mu, rho)[0]
        ) / (2 * h)
        by_u = (
            find_alart_curnier(r, u + d, mu, rho)[0] - find_alart_curnier(r, u - d, mu, rho)[0]
        ) / (2 * h)
        np.testing.assert_allclose(by_r, a[:, :, k], atol=1e-7)
        np.testing.assert_allclose(by_u, b[:, :, k], atol=1e-7)


@pytest.mark.parametrize("dim", [2, 3])
def test_all_factorisations_solve_the_same_system(dim):
    """``(A + B W) x = b`` with A, B at random: residual at round-off, non-symmetric as they are."""
    g = np.random.default_rng(5)
    problem = chain(20, dim)
    a = g.standard_normal((40, dim, dim)) + 4 * np.eye(dim)
    b = 0.2 * g.standard_normal((40, dim, dim)) + np.eye(dim)
    right = g.standard_normal(40 * dim)
    full = sp.block_diag(list(a)) + sp.block_diag(list(b)) @ problem.delassus
    for made in (DenseFactorisation, ContactFactorisation, BodyFactorisation):
        x = made(problem).factor(a, b)(right)
        assert np.linalg.norm(full @ x - right) < 1e-10 * np.linalg.norm(right), made.__name__


def test_a_body_that_nothing_touches_and_one_with_a_full_mass():
    """It keeps its own rows of the body matrix; the answer is that of the contacts' matrix."""
    g = np.random.default_rng(6)
    jacobian = np.zeros((9, 18))
    jacobian[:6, :6] = g.standard_normal((6, 6))
    jacobian[3:, 12:] = g.standard_normal((6, 6))
    turned = g.standard_normal((6, 6))
    inverse_mass = sp.block_diag([np.eye(6), np.eye(6), turned @ turned.T + np.eye(6)])
    space = BodySpace(sp.csr_array(jacobian), sp.csr_array(inverse_mass), 6)
    problem = make_problem(space, g.standard_normal(9), 0.4, 3)
    a = np.broadcast_to(0.3 * np.eye(3), (3, 3, 3)).copy()
    b = g.standard_normal((3, 3, 3)) * 0.1 + np.eye(3)
    full = sp.block_diag(list(a)) + sp.block_diag(list(b)) @ problem.delassus
    right = g.standard_normal(9)
    x = BodyFactorisation(problem).factor(a, b)(right)
    np.testing.assert_allclose(full @ x, right, rtol=0, atol=1e-12)


def test_a_singular_system_is_named():
    problem = chain(2, 2)
    with pytest.raises(SingularSystem):
        BodyFactorisation(problem).factor(np.zeros((4, 2, 2)), np.ones((4, 2, 2)))
    with pytest.raises(SingularSystem):
        DenseFactorisation(problem).factor(np.zeros((4, 2, 2)), np.zeros((4, 2, 2)))


@pytest.mark.parametrize("dim", [2, 3])
def test_newton_converges_quadratically_from_near(dim):
    """From 1e-4 beside a solution, three steps reach round-off; a shift of 1e-9 adds no error."""
    for seed in range(5):
        problem = chain(15, dim, seed)
        rough = solve_interior_point(problem, None, 1e-8, Path())
        exact = solve_newton(problem, rough.r, 1e-13)
        assert exact.residual < 1e-13
        g = np.random.default_rng(seed)
        near = exact.r * (1 + 1e-4 * g.standard_normal(len(exact.r)))
        again = solve_newton(problem, near, 1e-12)
        assert again.solved
        assert again.work["iterations"] <= 4


def test_the_shift_falls_where_only_it_holds_the_steps_up():
    """A tower whose contacts all stick: W's least eigenvalue falls as height^-2 and less, and
    proximal steps with a shift kept at 1e-5 would take off but a part of the error each."""
    space = build_tower(60, 2).bodies
    offset = space.jacobian @ np.tile([0.2, -1.0, 0.0], 60)
    problem = make_problem(space, offset, 0.9, 2)
    rough = solve_interior_point(problem, None, 1e-4, Path(convex=True))
    exact = solve_newton(problem, rough.r, 1e-13)
    assert exact.solved
    assert exact.work["iterations"] <= 12


def test_the_shift_leaves_no_error_on_redundant_contacts():
    """Four legs of one block: W has rank 3 of 8; 1e-9 shift, residual at 1e-14."""
    at = np.array([-1.5, -0.5, 0.5, 1.5])
    jacobian = np.zeros((8, 3))
    jacobian[::2, 1], jacobian[::2, 2] = 1.0, at
    jacobian[1::2, 0], jacobian[1::2, 2] = 1.0, 0.5
    space = BodySpace(sp.csr_array(jacobian), sp.csr_array(np.eye(3)), 3)
    problem = make_problem(space, np.tile([-9.81, 0.3], 4), 0.5, 2)
    start = np.tile([3.0, 0.0], 4)
    assert solve_newton(problem, start, 1e-14).residual <= 1e-14


def test_the_convex_path_is_coulombs_where_all_stick_and_not_where_they_slide():
    """Block of unit mass on a slope: mu = 1 holds it, mu = 0.2 does not; convex then lifts off.

    The convex law has u_N = mu |u_T| where it slides (Anitescu and Tasora): residual not small.
    """
    slope = np.radians(20)
    q = 9.81 * np.array([-np.cos(slope), np.sin(slope)])
    held = make_problem(np.eye(2), q, 1.0, 2)
    assert solve_interior_point(held, None, 1e-9, Path(convex=True)).solved
    loose = make_problem(np.eye(2), q, 0.2, 2)
    convex = solve_interior_point(loose, None, 1e-9, Path(convex=True))
    assert convex.residual > 1e-3
    assert convex.u[0] == pytest.approx(0.2 * abs(convex.u[1]), rel=0.05)
    assert solve_interior_point(loose, None, 1e-9).solved


def test_impatient_newton_ends_at_the_first_step_that_does_not_halve_the_residual():
    """The twin counts steps by asking for one more at a time."""
    short = 0
    for seed in range(6):
        problem = chain(6, 3, seed)
        start = 3.0 * np.random.default_rng(seed).standard_normal(len(problem.offset))
        mark, count = problem.residual(start), 0
        while mark > 1e-12:
            count += 1
            reached = solve_newton(problem, start, 1e-12, iterations=count).residual
            if reached > 1e-12 and not reached < 0.5 * mark:
                break
            mark = reached
        found = solve_newton(problem, start, 1e-12, patience=1)
        assert found.work["iterations"] == count
        short += not found.solved
    assert short > 0
