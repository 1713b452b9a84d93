"""The central path of Coulomb's law by smoothing: Newton's method that need not stay inside cones.

A contact's forces and velocities, scaled into Lorentz cones that are their own duals
(`rigid_lcp.friction.methods.interior_point`),

    x = (mu r_N, r_T),    s = rho (u_N / mu + |u_T|, u_T)

obey Coulomb's law exactly if ``x o s = 0`` in the cones (De Saxce), and its central path where
``x o s = sigma e``.  Both are one equation without inequalities (Fukushima, Luo and Tseng, SIAM J.
Optim. 12 (2002) 436, after Chen, Harker, Kanzow and Smale)

    F = x + s - sqrt((x - s)^2 + 4 sigma e) = 0        (squares and root of the Jordan product)

that is smooth for sigma > 0.  So Newton's method with a line search on |F| finds the point of each
sigma from that of the last, a few times as large, from wherever it stands.  An interior point,
whose steps are cut where the first contact leaves its cone, jams there once some contacts have come
near the boundary before others.  The smoothed path goes on to 1e-9 and below, where Newton's method
on the law itself (`rigid_lcp.friction.methods.newton`) ends it.

|u_T| is rounded to ``u_T^2 / sqrt(u_T^2 + eps^2)``, eps far below the velocities of sticking
contacts on the path.  Where redundant contacts stick, the matrix of a step has an eigenvalue near
``sigma / |x|^2`` for every self-stress; a small shift of W in it, not in F, bounds them and leaves
the point what it is.

The path of a non-monotone law may still fold.  Then that of another rounding is followed, which
folds elsewhere, from a sigma some times as great.  When none leads on the best point is given back,
from which `rigid_lcp.friction.attempts.proximal_points` often ends.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import Factorisation, SingularSystem, choose_factorisation
from rigid_lcp.friction.methods import find_spring_size, solve_newton
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, judge_forces, norm


@dataclass(frozen=True)
class SmoothedNumbers:
    """Points of the path, its other roundings, and its end."""

    compliance: float = 1e-4
    """The path begins at forces as large as those of springs [-],
    ``(W + compliance / rho) r = -q``."""
    roundings: tuple[float, ...] = (1e-2, 1e-1, 1e-3, 1e-4)
    """eps over ``sqrt(sigma) / rho``, the velocity of a sticking contact on the path [-]: every one
    is another path, and they are followed in turn."""
    shrink: float = 0.3  # sigma of the next point over that of the last [-],
    less: float = 0.55  # and where that was not found
    back: tuple[float, float] = (3.0, 10.0)
    """sigma with which another path is begun where one folds, over that of its last point [-]: the
    greater when all paths have folded."""
    hops: int = 6  # so many other paths at most are followed
    shift: float = 1e-8  # of W in the matrices, over the mean of its diagonal [-]
    found: float = 0.03  # a point is found where |F| is so small a part of ``sqrt(sigma nc)`` [-]
    first_steps: int = 20  # Newton steps in which the first point of a path has to be found,
    steps: int = 10  # and each other
    decrease: float = 1e-2  # part of a step [-] by which |F| has to fall;
    least_step: float = 2e-3  # a shorter step is none [-]
    near: float = 3e-8  # residual [-] from which Newton's method tries to end the path,
    end_steps: int = 5  # its steps
    end_patience: int = 3  # and those that may fail to halve the residual
    factorisations: int = 150  # at most


SMOOTHED = SmoothedNumbers()


def follow_smoothed(
    problem: FrictionProblem, begin: tuple[Floats, float] | None = None, tolerance: float = 1e-12,
    *, linear: Factorisation | None = None, factorisations: int = SMOOTHED.factorisations,
) -> FrictionSolution:  # fmt: skip
    """Follow the path from a great sigma until the residual is at or below ``tolerance``.

    ``begin``: forces r (nc * dim,) and sigma [N^2] of a point near the path, as another method left
    them; else it begins at the forces of springs.  ``linear``: factorisations of this problem's W,
    made if not given; at most ``factorisations`` are spent.  Some 40 to 100 factorisations solve
    most settled beds; for what sticks or hardly slides `rigid_lcp.friction.methods.interior_point`
    and Newton need a third of that.  ``work``: ``points`` and ``factorisations``.
    """
    linear = linear or choose_factorisation(problem)
    best, least = np.zeros(problem.offset.shape), np.inf
    spent, points = 0 if begin else 1, 0
    try:
        force, sigma = begin or begin_path(problem, linear)
    except SingularSystem:
        return judge_forces(problem, best, tolerance, "smoothed path", status="singular")
    found_force, found_sigma, shrink = force, sigma, 1.0
    most, rounding, hopped = SMOOTHED.first_steps, SMOOTHED.roundings[0], 0
    while least > tolerance and spent < factorisations:
        force, found, steps = find_smoothed_point(
            problem, found_force, shrink * found_sigma, linear, min(most, factorisations - spent),
            rounding,
        )  # fmt: skip
        spent += steps
        residual = problem.residual(force)
        if residual < least:
            best, least = force, residual
        if found:
            found_force, found_sigma, points = force, shrink * found_sigma, points + 1
            shrink, most = SMOOTHED.shrink, SMOOTHED.steps
            if tolerance < residual < SMOOTHED.near:
                ended = solve_newton(
                    problem, force, tolerance, linear=linear, iterations=SMOOTHED.end_steps,
                    patience=SMOOTHED.end_patience,
                )  # fmt: skip
                spent += int(ended.work["factorisations"])
                if ended.residual < least:
                    best, least = ended.r, ended.residual
        elif shrink == SMOOTHED.shrink:
            shrink = SMOOTHED.less
        elif hopped < SMOOTHED.hops:
            hopped, most = hopped + 1, SMOOTHED.first_steps
            rounding, shrink = choose_other_path(hopped)
        else:
            break
    return judge_forces(
        problem, best, tolerance, "smoothed path",
        {"points": float(points), "factorisations": float(spent)},
    )  # fmt: skip


def choose_other_path(hop: int) -> tuple[float, float]:
    """Rounding [-] and sigma (over that of the last point) of the path that is followed after
    ``hop`` folds."""
    return SMOOTHED.roundings[hop % len(SMOOTHED.roundings)], SMOOTHED.back[
        hop // len(SMOOTHED.roundings)
    ]


def begin_path(problem: FrictionProblem, linear: Factorisation) -> tuple[Floats, float]:
    """Normal forces r (nc * dim,) of one size, that of springs, and the sigma [N^2] of such forces
    and of velocities as great as those of q.  Raises `SingularSystem`."""
    force = np.zeros((problem.contacts, problem.dim))
    speed = float(np.sqrt(np.mean(problem.offset**2))) or 1.0
    size = find_spring_size(problem, linear, SMOOTHED.compliance) or problem.rho * speed
    slides = problem.friction > 0.0
    force[:, 0] = size / np.where(slides, problem.friction, 1.0)
    return force.ravel(), float(np.mean(problem.contact_rho)) * speed * size


def find_smoothed_point(
    problem: FrictionProblem, force: Floats, sigma: float, linear: Factorisation, steps: int,
    rounding: float = SMOOTHED.roundings[0],
) -> tuple[Floats, bool, int]:  # fmt: skip
    """Forces of the path's point at ``sigma`` [N^2], from ``force``: whether they were found, and
    the factorisations it took."""
    shape = (problem.contacts, problem.dim)
    rho = problem.contact_rho
    eps = rounding * np.sqrt(sigma) / float(rho.mean())
    enough = SMOOTHED.found * np.sqrt(sigma * problem.contacts)

    def find_map(r: Floats) -> tuple[Floats, Floats, Floats]:
        velocity = problem.velocity(r).reshape(shape)
        made: tuple[Floats, Floats, Floats] = find_smoothed_map(
            r.reshape(shape), velocity, problem.friction, rho, sigma, eps
        )
        return made

    f, a, b = find_map(force)
    error = norm(f)
    for done in range(steps):
        if error < enough:
            return force, True, done
        try:
            step = linear.factor(a + (SMOOTHED.shift / problem.rho) * b, b)(f.ravel())
        except SingularSystem:
            return force, False, done + 1
        part = 1.0
        while True:
            f, a, b = find_map(force - part * step)
            now = norm(f)
            if now <= (1.0 - SMOOTHED.decrease * part) * error:
                break
            part *= 0.5
            if part < SMOOTHED.least_step:
                return force, False, done + 1
        force, error = force - part * step, now
    return force, error < enough, steps


@njit(cache=True)
def find_smoothed_map(
    force: Floats, velocity: Floats, mu: Floats, rho: Floats, sigma: float, eps: float
) -> tuple[Floats, Floats, Floats]:
    """F and its derivatives A = dF/dr, B = dF/du.

    ``force`` and ``velocity`` (nc, dim); ``mu`` and ``rho`` (nc,), rho force per velocity;
    ``sigma`` force squared, ``eps`` a velocity.  F (nc, dim) a force, A (nc, dim, dim), B (nc, dim,
    dim) force per velocity.  Without friction x and s are the normal parts, and ``F_T = r_T``.
    """
    nc, dim = force.shape
    f = np.zeros((nc, dim))
    a = np.zeros((nc, dim, dim))
    b = np.zeros((nc, dim, dim))
    x, s, turn = np.empty(dim), np.empty(dim), np.empty(dim)
    slope = np.zeros((dim, dim))  # h', the derivative of the root by x - s
    for c in range(nc):
        if mu[c] == 0.0:
            z = force[c, 0] - rho[c] * velocity[c, 0]
            root = np.sqrt(z * z + 4.0 * sigma)
            f[c, 0] = force[c, 0] + rho[c] * velocity[c, 0] - root
            a[c, 0, 0] = 1.0 - z / root
            b[c, 0, 0] = rho[c] * (1.0 + z / root)
            for i in range(1, dim):
                f[c, i], a[c, i, i] = force[c, i], 1.0
            continue
        squares = 0.0
        for i in range(1, dim):
            squares += velocity[c, i] ** 2
        rounded = np.sqrt(squares + eps**2)
        x[0] = mu[c] * force[c, 0]
        s[0] = rho[c] * (velocity[c, 0] / mu[c] + squares / rounded)
        across = 0.0  # |z_T| of z = x - s
        for i in range(1, dim):
            x[i], s[i] = force[c, i], rho[c] * velocity[c, i]
            across += (x[i] - s[i]) ** 2
        across = np.sqrt(across)
        z = x[0] - s[0]
        high, low = z + across, z - across  # the two eigenvalues of z
        root_high, root_low = np.sqrt(high**2 + 4.0 * sigma), np.sqrt(low**2 + 4.0 * sigma)
        middle, half = 0.5 * (root_high + root_low), 0.5 * (root_high - root_low)
        along = 0.5 * (high / root_high + low / root_low)
        skew = 0.5 * (high / root_high - low / root_low)
        sideways = half / across if across > 0.0 else along
        f[c, 0] = x[0] + s[0] - middle
        slope[0, 0] = along
        for i in range(1, dim):
            turn[i] = (x[i] - s[i]) / across if across > 0.0 else 0.0
            f[c, i] = x[i] + s[i] - half * turn[i]
            slope[0, i] = slope[i, 0] = skew * turn[i]
        for i in range(1, dim):
            for j in range(1, dim):
                slope[i, j] = (along - sideways) * turn[i] * turn[j]
            slope[i, i] += sideways
        bend = (squares + 2.0 * eps**2) / rounded**3  # of the rounded |u_T|, over u_T
        for i in range(dim):
            for j in range(dim):
                same = 1.0 if i == j else 0.0
                a[c, i, j] = (same - slope[i, j]) * (mu[c] if j == 0 else 1.0)
                b[c, i, j] = rho[c] * (same + slope[i, j]) * (1.0 / mu[c] if j == 0 else 1.0)
            for j in range(1, dim):
                same = 1.0 if i == 0 else 0.0
                b[c, i, j] += rho[c] * (same + slope[i, 0]) * bend * velocity[c, j]
    return f, a, b
