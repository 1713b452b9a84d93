"""A problem as the pivoting methods hold it, and the answer that comes out of it, judged.

That there is no solution is shown by a proof, a linear programme, not by forces that grow: those
can have a small residual, as that is relative to them.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.pivots.drive import (
    CYCLED,
    DONE,
    OFFSET,
    PATH,
    RAY,
    SINGULAR,
    TOO_MANY,
    drive,
    settle_values,
)
from rigid_lcp.friction.pivots.updates import LISTS, Geometry, Reduced, start_reduced
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    Status,
    find_natural_map,
    prove_forces_insufficient,
    require_finite,
)

MOST_APPROACH = 1e-3
"""That a solution may leave, over the greatest of q [-], however small its residual:
relative to |r| it falls to nothing as forces grow without bound, which hide the approach."""


class Pivots(NamedTuple):
    """A problem in the kernels' arrays, and where its solution stands."""

    geometry: Geometry
    reduced: Reduced
    b: Floats
    f: Floats
    a: Floats
    rows: Ints  # numbers of the kept rows in the problem: all but tangential ones without friction
    unit: float  # the mean of the diagonal of A
    shift: Floats  # (1,) what is added to the diagonal of A now
    diagonal: tuple[Ints, Ints]
    """Where the diagonal of A stands among its values by rows and by columns."""
    codes: Ints
    events: Ints  # (1,) changes of lists so far


def start_pivots(
    problem: FrictionProblem,
    shift: float,
    perturbation: float,
    tangential_velocity: ArrayLike | None,
) -> Pivots:
    """The kernels' arrays of a 2D problem, or of normal equations alone where mu = 0.

    Raises `ProblemError` in 3D with friction and for a tangential velocity that is none.
    """
    nc, dim = problem.contacts, problem.dim
    mu = problem.friction
    if dim == 3 and mu.any():
        raise ProblemError(
            "pivoting knows two directions of sliding, in 3D there is a circle of them",
            where="dim", remedy="use a Newton or interior-point method",
        )  # fmt: skip
    remedy = "give one finite tangential velocity a contact"
    velocity = np.zeros(nc) if tangential_velocity is None else require_finite(
        tangential_velocity, "tangential_velocity", remedy
    )  # fmt: skip
    if velocity.shape != (nc,):
        raise ProblemError(
            f"it has the shape {velocity.shape} for {nc} contacts", where="tangential_velocity",
            remedy=remedy,
        )  # fmt: skip
    keep = np.zeros((nc, dim), dtype=bool)
    keep[:, 0] = True
    keep[:, 1] |= mu > 0
    rows = np.flatnonzero(keep)
    number = np.full(nc * dim, -1)
    number[rows] = np.arange(len(rows))
    w = problem.delassus[rows][:, rows]
    diagonal = w.diagonal()
    unit = (float(diagonal.mean()) if len(rows) else 0.0) or 1.0
    w = sp.csr_array(w + shift * unit * sp.eye_array(len(rows)))
    wc = sp.csc_array(w)
    inside = (find_diagonal_places(w), find_diagonal_places(wc))
    generator = np.random.default_rng(0)
    b = problem.offset[rows]
    # by forces, as only what lies in the range of A leaves redundant contacts at rest
    size = problem.rho * (float(np.abs(b).max(initial=0.0)) or 1.0)
    b = b + perturbation * size * (w @ generator.uniform(-1.0, 1.0, len(rows)))
    geometry = Geometry(
        w.indptr.astype(np.int64), w.indices.astype(np.int64), w.data,
        wc.indptr.astype(np.int64), wc.indices.astype(np.int64), wc.data,
        number.reshape(nc, dim)[:, 0].copy(), number.reshape(nc, dim)[:, 1].copy(),
        rows // dim, mu, (-np.sign(velocity) * (mu > 0)).astype(np.int64),
    )  # fmt: skip
    return Pivots(
        geometry, start_reduced(nc, len(rows)), b, np.zeros(len(rows)), b.copy(), rows, unit,
        np.array([shift * unit]), inside,
        generator.integers(2**62, size=(nc, LISTS)), np.zeros(1, dtype=np.int64),
    )  # fmt: skip


def drive_offset(state: Pivots, change: Floats, reversal: bool, limit: int) -> int:
    """Add ``change`` to b, all contacts kept consistent; returns how it ended."""
    if not len(state.b):
        return DONE
    target = state.b + change
    ended, _ = drive(
        state.geometry, state.reduced, state.b, state.f, state.a, change,
        PATH if reversal else OFFSET, 0, max(limit - int(state.events[0]), 0), state.codes,
        state.events,
    )  # fmt: skip
    if ended == DONE:
        state.b[:] = target
        settle_values(
            state.geometry, state.reduced, state.b, np.zeros_like(target), state.f, state.a
        )
    return ended


def find_diagonal_places(matrix: sp.csr_array | sp.csc_array) -> Ints:
    """Where the values of the diagonal are stored."""
    line = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return np.flatnonzero(matrix.indices == line)


def read_pivots(problem: FrictionProblem, state: Pivots) -> Floats:
    """Forces of all rows (nc * dim,): no round-off outside the cones."""
    force = np.zeros(len(problem.offset))
    force[state.rows] = state.f
    normal = np.maximum(force[:: problem.dim], 0.0)
    force[:: problem.dim] = normal
    if problem.dim == 2:
        bound = problem.friction * normal
        force[1::2] = np.clip(force[1::2], -bound, bound)
    return force


def measure_residual(problem: FrictionProblem, state: Pivots, force: Floats) -> float:
    """Scale-free residual; contacts that slide already have a friction force of known sign."""
    slip = state.geometry.slip
    if not slip.any():
        return problem.residual(force)
    velocity = problem.velocity(force)
    size = float(np.linalg.norm(force)) or problem.rho * float(np.linalg.norm(velocity))
    # as a fast sliding of that sign: the projection then falls on that edge of the cone alone
    far = 10.0 * (np.abs(velocity).max() + np.abs(force).max() / problem.rho)
    velocity[1::2][slip != 0] = -slip[slip != 0] * far
    shape = (problem.contacts, problem.dim)
    error = find_natural_map(
        force.reshape(shape), velocity.reshape(shape), problem.friction, problem.rho
    )
    return float(np.linalg.norm(error)) / size if size > 0.0 else 0.0


_ENDS: dict[int, tuple[Status, str]] = {
    DONE: ("not converged", "the shift of the diagonal came out to a residual of {res:.2g} only"),
    RAY: ("not converged", "what is driven grows without bound (a ray){where}"),
    CYCLED: ("cycled", "the lists repeat without progress{where}"),
    SINGULAR: ("singular", "the reduced equations (28) became singular{where}"),
    TOO_MANY: ("not converged", "the pivots allowed were used up{where}"),
}
_REMEDIES = {
    "dantzig": "use `pivoting` or a Newton method, or another order of contacts",
    "pivoting": "give a nearer start or more pivots, or use a Newton or interior-point method",
}


def judge_pivots(
    problem: FrictionProblem, state: Pivots, force: Floats, tolerance: float, method: str,
    ended: int, where: int,
) -> FrictionSolution:  # fmt: skip
    """Judge the forces; a ray, or a shift that stays, become ``no solution`` if that is proved."""
    residual = measure_residual(problem, state, force)
    work = {"pivots": float(state.events[0])}
    velocity = problem.velocity(force)
    size = float(np.abs(problem.offset).max(initial=0.0))
    diverged = bool(velocity[:: problem.dim].min(initial=0.0) < -MOST_APPROACH * size)
    if residual <= tolerance and not diverged:
        return FrictionSolution(force, velocity, residual, "solved", method, work)
    status, text = _ENDS[RAY if diverged and ended == DONE else ended]
    remedy = _REMEDIES[method]
    if ended in (RAY, DONE) and prove_forces_insufficient(problem, state.geometry.slip):
        status = "no solution"
        text = "no finite forces keep the contacts from approaching (Painleve)"
        remedy = "use impulses: a velocity-level time step or a collision"
    place = f" at contact {where}" if where >= 0 else ""
    message = f"{method}: {text.format(where=place, res=residual)}\n  -> {remedy}"
    return FrictionSolution(force, velocity, residual, status, method, work, message)
