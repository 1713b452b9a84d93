"""Contact forces at acceleration level, of contacts that slide already and of others (eq. 27)."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import NoSolution, NotConverged
from rigid_lcp.friction.auto import solve_problem
from rigid_lcp.friction.methods import solve_dantzig, solve_pivoting
from rigid_lcp.friction.problem import BodySpace, FrictionSolution, make_problem
from rigid_lcp.motion.time_stepping import find_forces_error


@dataclass(frozen=True)
class LastingNumbers:
    """Forces that go on as they were, and what is accepted."""

    contacts: int = 200  # above which a dense solve is no short cut [-]
    rank: float = 1e-13  # singular values are zero below this part of the greatest [-]
    most_error: float = 1e-8  # of forces or impulses with which a step is made [-]


LASTING = LastingNumbers()


def find_forces(
    bodies: BodySpace, offset: Floats, friction: Floats, slip: Floats, tolerance: float,
    gravity: float,
) -> tuple[FrictionSolution, float]:  # fmt: skip
    """Contact forces (eqs 26, 27), and their error over the forces that ``gravity`` [m/s^2] asks.

    Where ``slip`` (nc, dim - 1) is not zero, friction opposes it: ``f_T = -mu f_N slip/|slip|``;
    elsewhere it opposes the tangential acceleration.  Raises `NoSolution` or `NotConverged`.
    """
    dim = 1 + slip.shape[1]
    lasting = try_lasting_forces(bodies, offset, friction, slip)
    if lasting is not None and lasting.residual <= tolerance:
        return lasting, find_forces_error(bodies, lasting, gravity)
    problem = make_problem(bodies, offset, friction, dim)
    if not (slip.any(axis=1) & (friction > 0)).any():
        solution = solve_problem(problem, tolerance=tolerance)
    elif dim == 2:
        solution = solve_pivoting(problem, None, tolerance, tangential_velocity=slip[:, 0])
        if not solution.solved:
            solution = solve_dantzig(problem, None, tolerance, tangential_velocity=slip[:, 0])
    else:
        solution = _find_sliding_forces(bodies, offset, friction, slip, tolerance)
    if solution.status == "no solution":
        raise NoSolution(
            "no finite contact forces obey Coulomb's law (Painleve)", where="contact forces",
            remedy='use method="time-stepping", whose impulses always exist',
        )  # fmt: skip
    error = find_forces_error(bodies, solution, gravity)
    endless = not solution.solved and solution.residual <= tolerance  # so small only beside them
    if endless or not error <= LASTING.most_error:
        raise NotConverged(
            f"the contact forces have a residual of {error:.2g}, and are"
            f" {np.abs(solution.r).max():.2g} N at most",
            where=f"{len(friction)} contacts",
            remedy='use method="time-stepping"; ' + solution.message,
        )
    return solution, error


def try_lasting_forces(
    bodies: BodySpace, offset: Floats, friction: Floats, slip: Floats
) -> FrictionSolution | None:
    """Forces if every contact presses, sticks where ``slip`` is zero and slides on elsewhere.

    With ``r = S s``, s the forces that are not known from others, eq. 28 is ``S0^T (W S s + b) =
    0``; one dense solve, redundant contacts by least squares.  Most steps between two events need
    no more.  None where a contact would pull, or grip by more than its friction.
    """
    dim, count = 1 + slip.shape[1], len(friction)
    if count > LASTING.contacts:
        return None
    known = np.zeros((count, dim), dtype=bool)
    known[:, 1:] = (slip.any(axis=1) | (friction == 0))[:, None]
    free = np.flatnonzero(~known.ravel())
    speed = np.linalg.norm(slip, axis=1)
    along = -friction[:, None] * slip / np.where(speed > 0.0, speed, 1.0)[:, None]
    mixing = np.eye(count * dim)
    for c in np.flatnonzero(speed > 0.0):
        mixing[c * dim + 1 : (c + 1) * dim, c * dim] = along[c]
    jacobian = bodies.jacobian.toarray()
    w = jacobian @ (bodies.inverse_mass @ jacobian.T)
    mixed = (w @ mixing)[free][:, free]
    force = mixing[:, free] @ np.linalg.lstsq(mixed, -offset[free], rcond=LASTING.rank)[0]
    error = offset + w @ force
    force -= mixing[:, free] @ np.linalg.lstsq(mixed, error[free], rcond=LASTING.rank)[0]
    found = force.reshape(count, dim)
    grip = np.linalg.norm(found[:, 1:], axis=1) * (speed == 0.0)
    size = float(np.linalg.norm(force))
    if size == 0.0 or (found[:, 0] < 0.0).any() or (grip > friction * found[:, 0]).any():
        return None
    u = offset + w @ force
    # no longer than this, as forces are within their cones
    # (`rigid_lcp.friction.problem.find_natural_map`)
    residual = float(np.linalg.norm(u[free])) / float(w.diagonal().mean()) / size
    return FrictionSolution(force, u, residual, "solved", "lasting contacts", {})


def _find_sliding_forces(
    bodies: BodySpace, offset: Floats, friction: Floats, slip: Floats, tolerance: float
) -> FrictionSolution:
    """3D: the columns of a sliding contact's normal force take its friction along.

    With ``r = S s``, ``S`` the identity but for ``(1, -mu slip/|slip|)`` in the normal column of
    a sliding contact, s is a friction problem of the matrix ``W S`` without friction there.
    """
    speed = np.linalg.norm(slip, axis=1)
    sliding = np.flatnonzero(speed > 0)
    dim = 1 + slip.shape[1]
    along = -friction[sliding, None] * slip[sliding] / speed[sliding, None]
    rows = (sliding[:, None] * dim + np.arange(1, dim)).ravel()
    size = len(offset)
    mixing = sp.eye_array(size, format="csr") + sp.csr_array(
        (along.ravel(), (rows, np.repeat(sliding * dim, dim - 1))), shape=(size, size)
    )
    limits = np.where(speed > 0, 0.0, friction)
    mixed = make_problem(bodies.matrix @ mixing, offset, limits, dim)
    solution = solve_problem(mixed, tolerance=tolerance)
    return replace(solution, r=np.asarray(mixing @ solution.r))
