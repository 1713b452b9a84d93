"""Coulomb friction by a primal-dual interior point, with or without its non-convex term.

Forces and velocities of a contact are scaled into Lorentz cones, which are their own duals:

    x = (mu r_N, r_T),    s = (u_N / mu + |u_T|, u_T),    x, s in the cone,    x . s = 0

and followed along ``x o s = sigma e`` (Jordan product).  On that path

    r_T = -mu r_N u_T / (u_N / mu + |u_T|),    u_N > 0:

friction that is viscous far from the answer and Coulomb's at its end.  One Newton step, scaled
after Nesterov and Todd (``H x = s``), is a system ``(C + W) dr = b``
(`rigid_lcp.friction.linear.factorisation`):

    C = U H X,    X = dx/dr = diag(mu, 1, 1),    U = du/ds = [[mu, -mu s_T / |s_T|], [0, 1]]

Without the term |u_T| (``convex``) U is X, C is symmetric, and the problem is the convex one of
Anitescu and Tasora (Comput. Optim. Appl. 47 (2010) 207): it can hardly fail, and its answer is
right where nothing slides.  The term makes it Coulomb's law (De Saxce), non-convex, and the path
may fold back; |s_T| is rounded to ``s_T^2 / sqrt(s_T^2 + eps^2)``, which is right to eps^2 where
a contact slides; eps falls with sigma, and another ``rounding`` is another path.  Predictor and
corrector after Mehrotra.

A contact without friction is a half line: r_T stays zero.  For a problem that has no solution
the steps become ever smaller, and the best point is given back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import (
    Factorisation,
    SingularSystem,
    choose_factorisation,
    divide_cones,
    find_cone_step,
    find_scaling,
    multiply_cones,
    scale_cones,
    square_scaling,
)
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    require_number,
    require_whole,
)
from rigid_lcp.sparse import multiply_blocks


@dataclass(frozen=True)
class InteriorNumbers:
    """Steps, and what ends them."""

    iterations: int = 50  # at most
    boundary_share: float = 0.99
    """Part of the way to the nearest cone's boundary [-] that a step may go."""
    least_centring: float = 1e-6
    """The predictor never aims lower than so many times the present gap [-]."""
    back_off_step: float = 0.05
    """A step shorter than this [-] is replaced by one towards the middle,"""
    back_off_gap: float = 3.0  # with a gap so many times as large [-] and the lack left as it is
    short_step: float = 0.03  # where steps are shorter than this [-],
    short_steps: int = 4  # so many in a row: the path has folded, or there is no solution


INTERIOR = InteriorNumbers()
LEAST_CENTRING = INTERIOR.least_centring


@dataclass(frozen=True)
class Path:
    """Which path is followed to the answer."""

    rounding: float = 0.3
    """eps over ``sqrt(sigma / rho)``, the velocity at which a contact's forces turn over [-]."""
    compliance: float = 0.01
    """The path begins at forces as large as those of springs, ``(W + compliance / rho) r = -q``."""
    convex: bool = False
    """Leave out the term |u_T|: the answer is Coulomb's only where nothing slides."""
    lagged: bool = False
    """Take the term |u_T| as it is where a step begins, as if it were given: every step is one of a
    convex problem and the path can not fold, but its end is only near the answer."""


def solve_interior_point(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-8,
    path: Path = Path(), *, linear: Factorisation | None = None,
    iterations: int = INTERIOR.iterations, begun: PathStep | None = None,
) -> FrictionSolution:  # fmt: skip
    """Follow the path until the residual is at or below ``tolerance``.

    ``start`` is not used: a point on the boundary is a bad one for this method.  ``linear``:
    factorisations of this problem's W, made if not given; ``begun``: the path, to go on where an
    earlier call left it.  About 1e-10 is what it can reach, as its matrices become singular;
    `rigid_lcp.friction.methods.newton` goes on from there.

    Raises `UsageError` for a tolerance that is no number of zero or more, and for no count.
    """
    tolerance = require_number(tolerance, "tolerance", zero=True)
    iterations = require_whole(iterations, "iterations")
    contacts, dim = problem.contacts, problem.dim
    best, best_residual, done, short = np.zeros(contacts * dim), np.inf, 0, 0
    try:
        step = begun or PathStep(problem, path, linear or choose_factorisation(problem))
    except SingularSystem:
        return judge_forces(problem, best, tolerance, "interior-point", status="singular")
    while True:
        force = step.force()
        residual = problem.residual(force)
        if residual < best_residual:
            best, best_residual = force, residual
        if not residual > tolerance or done == iterations or short == INTERIOR.short_steps:
            break
        try:
            length = step.take()
        except SingularSystem:
            break
        done, short = done + 1, short + 1 if length < INTERIOR.short_step else 0
    return judge_forces(
        problem, best, tolerance, "interior-point",
        {"iterations": float(done), "factorisations": float(done + (begun is None))},
    )  # fmt: skip


class PathStep:
    """The point x, s (nc, dim) on its way, and how it goes one step."""

    def __init__(
        self, problem: FrictionProblem, path: Path, linear: Factorisation, size: float = 0.0
    ) -> None:
        """``size`` of the forces to begin with [N or N s]; those of springs if it is zero."""
        contacts, dim = problem.contacts, problem.dim
        self.problem, self.path, self.linear = problem, path, linear
        slides = problem.friction > 0.0
        self.mu = np.where(slides, problem.friction, 1.0)
        self.unit = np.zeros((contacts, dim))
        self.unit[:, 0] = 1.0
        self.tangent = np.where(slides[:, None], 1.0, self.unit)  # r_T = 0 without friction
        speed = float(np.sqrt(np.mean(problem.offset**2))) or 1.0
        size = size or find_spring_size(problem, linear, path.compliance)
        self.x = self.unit * (size or problem.rho * speed)
        self.s = self.unit * speed
        self.stretch = np.ones((contacts, dim))
        self.stretch[:, 0] = self.mu

    def force(self) -> Floats:
        """r of the point x."""
        return (self.x / self.stretch).ravel()

    def sigma(self) -> float:
        """The mean of ``x . s`` as the path of `rigid_lcp.friction.attempts.smoothed_path` measures
        it [N^2]."""
        return float(np.mean(self.problem.contact_rho)) * float(find_path_gap(self.x, self.s))

    def take(self) -> float:
        """One predictor-corrector step; returns its length.  Raises `SingularSystem`."""
        x, s, path = self.x, self.s, self.path
        gap = find_path_gap(x, s)
        if not gap > 0.0:  # round-off has put a point on the boundary of its cone, or beyond
            raise SingularSystem
        eps = path.rounding * np.sqrt(gap / self.problem.rho)
        velocity, slope = find_coulomb_velocity(s, self.mu, eps, path.convex)
        if path.lagged:
            slope[:, 0, 1:] = 0.0
        at = self.problem.velocity(self.force()).reshape(x.shape)
        eta, point = find_scaling(x, s)
        scaled = scale_cones(eta, point, x, False)
        solve = self.linear.factor(
            *build_path_blocks(eta, point, slope, self.tangent, self.stretch)
        )

        def find_direction(target: Floats, share: float = 1.0) -> tuple[Floats, Floats]:
            """dx, ds that bring ``x o s`` to the target and ``W r + q`` nearer to u(s)."""
            lack = share * (at - velocity)
            part, right = build_path_right(eta, point, scaled, slope, target, lack, self.tangent)
            force = solve(right.ravel()).reshape(x.shape)
            return find_path_direction(eta, point, part, force, self.tangent, self.stretch)

        square = multiply_cones(scaled, scaled)
        dx, ds = find_direction(-square)
        dx, ds = find_direction(aim_corrector(x, s, dx, ds, eta, point, square))
        length = INTERIOR.boundary_share * find_step_length(x, s, dx, ds)
        if length < INTERIOR.back_off_step:  # off the path: back to its middle, higher up
            dx, ds = find_direction(INTERIOR.back_off_gap * gap * self.unit - square, 0.0)
            length = INTERIOR.boundary_share * find_step_length(x, s, dx, ds)
        length = min(1.0, length)
        if not np.isfinite(length) or not (np.isfinite(dx).all() and np.isfinite(ds).all()):
            raise SingularSystem
        self.x, self.s = x + length * dx, s + length * ds
        return length


def find_spring_size(problem: FrictionProblem, linear: Factorisation, compliance: float) -> float:
    """Size of what contacts would bear as springs, soft enough to share the load: the root of the
    mean square of r [N or N s] in ``(W + compliance / rho) r = -q``.  Raises `SingularSystem`."""
    contacts, dim = problem.contacts, problem.dim
    identity = np.broadcast_to(np.eye(dim), (contacts, dim, dim)).copy()
    springs = linear.factor(identity * (compliance / problem.rho), identity)
    return float(np.sqrt(np.mean(springs(-problem.offset) ** 2)))


@njit(cache=True)
def find_path_gap(x: Floats, s: Floats) -> float:
    """``x . s`` of a contact, on average."""
    total = 0.0
    for c in range(x.shape[0]):
        for k in range(x.shape[1]):
            total += x[c, k] * s[c, k]
    return total / x.shape[0]


@njit(cache=True)
def find_step_length(x: Floats, s: Floats, dx: Floats, ds: Floats) -> float:
    """How far x and s may go before one leaves its cone."""
    return min(find_cone_step(x, dx), find_cone_step(s, ds))


@njit(cache=True)
def aim_corrector(
    x: Floats, s: Floats, dx: Floats, ds: Floats, eta: Floats, point: Floats, square: Floats
) -> Floats:
    """``sigma e - x o x - (W dx) o (W^-1 ds)`` in scaled x (Mehrotra), dx and ds the predictor's:
    sigma is the less the further that can go."""
    gap, length = find_path_gap(x, s), min(1.0, find_step_length(x, s, dx, ds))
    ahead = max(0.0, find_path_gap(x + length * dx, s + length * ds) / gap)
    centring = max(LEAST_CENTRING, min(1.0, ahead**2))
    second = multiply_cones(scale_cones(eta, point, dx, False), scale_cones(eta, point, ds, True))
    target = -square - second
    target[:, 0] += centring * gap
    return target


@njit(cache=True)
def build_path_blocks(
    eta: Floats, point: Floats, slope: Floats, tangent: Floats, stretch: Floats
) -> tuple[Floats, Floats]:
    """A and B of ``(A + B W) dr = b``, (nc, dim, dim): C of the module's head, and one.

    Where ``tangent`` is zero (no friction) the row says ``dr = 0``.
    """
    blocks = np.zeros(slope.shape)
    identity = np.zeros(slope.shape)
    square = square_scaling(eta, point)
    for c in range(len(eta)):
        for i in range(slope.shape[1]):
            identity[c, i, i] = tangent[c, i]
            if tangent[c, i] == 0.0:
                blocks[c, i, i] = 1.0
                continue
            for j in range(slope.shape[1]):
                if tangent[c, j] != 0.0:
                    for k in range(slope.shape[1]):
                        blocks[c, i, j] += slope[c, i, k] * square[c, k, j] * stretch[c, j]
    return blocks, identity


@njit(cache=True)
def build_path_right(
    eta: Floats, point: Floats, scaled: Floats, slope: Floats, target: Floats, lack: Floats,
    tangent: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """What ds is at dx = 0 for ``x o s`` to reach the ``target``, and b of the system."""
    part = scale_cones(eta, point, divide_cones(scaled, target), False)
    return part, (multiply_blocks(slope, part) - lack) * tangent


@njit(cache=True)
def find_path_direction(
    eta: Floats, point: Floats, part: Floats, force: Floats, tangent: Floats, stretch: Floats
) -> tuple[Floats, Floats]:
    """dx and ds of the change of the forces, dr (nc, dim)."""
    dx = force * stretch
    there = scale_cones(eta, point, scale_cones(eta, point, dx, False), False)
    return dx, (part - there) * tangent


@njit(cache=True)
def find_coulomb_velocity(s: Floats, mu: Floats, eps: float, convex: bool) -> tuple[Floats, Floats]:
    """u(s) = ``(mu (s_N - s_T^2 / sqrt(s_T^2 + eps^2)), s_T)`` and U = du/ds.

    ``s`` (nc, dim), ``mu`` (nc,), ``eps`` a velocity; ``convex`` leaves out the term in s_T.
    """
    nc, dim = s.shape
    share = 0.0 if convex else 1.0
    velocity, slope = s.copy(), np.zeros((nc, dim, dim))
    for c in range(nc):
        squares = 0.0
        for k in range(1, dim):
            squares += s[c, k] ** 2
        rounded = np.sqrt(squares + eps**2)
        if rounded > 0.0:
            velocity[c, 0] -= share * squares / rounded
        velocity[c, 0] *= mu[c]
        slope[c, 0, 0] = mu[c]
        for k in range(1, dim):
            slope[c, k, k] = 1.0
            if rounded > 0.0:
                turn = (squares + 2.0 * eps**2) / rounded**2
                slope[c, 0, k] = -share * mu[c] * turn * s[c, k] / rounded
    return velocity, slope


METHOD = solve_interior_point
POLISHED = True
"""Newton's method is called from its end."""
