"""The smallest move of stones, six freedoms each, that gives a moved bed its overlaps back.

A sphere's centre at r from its stone's centre of mass moves by u + omega x r.  With the stone's
radius R the unknowns are u and R omega; n . (u_i + omega_i x r_i - u_j - omega_j x r_j) = excess
is a row a contact.  Their least squares are found by LSMR, again and again as normals turn.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import lsmr

from adapters.bed import (
    FloatArray,
    IntArray,
    Neighbours,
    State,
    Walls,
    find_behind_discs,
    measure_bed,
    measure_rows,
)
from adapters.bed.stones import Form, find_touching, spread_spheres, turn_stones
from adapters.errors import NotConverged


@dataclass(frozen=True)
class StepNumbers:
    """How far the solution goes."""

    most: int = 40  # linear solutions at most
    tolerance: float = 0.01  # greatest error of an overlap over the mean carried one [-]
    accepted: float = 1.0  # the same, where contacts are too many to have all of theirs [-]
    reach: float = 0.05  # greatest move in a step, over the radius: rows are linear [-]
    residual: float = 1e-10  # of a linear solution [-]


STEPS = StepNumbers()
SHIFT = 1 << 32
"""A row of grains i and j, or of wall w = -1 - j, as one number: i `SHIFT` + j."""


def relax_stones(
    form: Form, target: State, before: State, walls: Walls, walls_after: Walls
) -> tuple[State, dict[str, Any]]:
    """Stones near ``target`` whose contacts have the overlaps of ``before``, and what changed.

    What else touches on the way is parted; the mean height stays.  ``walls_after`` are the
    ``walls`` with the piston where it is now.  Raises `NotConverged`.
    """
    carried = find_touching(form, before, walls)
    behind = find_behind_discs(spread_spheres(form, before)[0], walls)
    scale = float(carried.overlap.mean()) if len(carried) else float(before.radius.min())
    now, fresh, error = target, np.empty(0, np.int64), np.inf
    for _ in range(STEPS.most):
        found = encode(find_touching(form, now, walls_after))
        fresh = np.setdiff1d(np.union1d(fresh, found), encode(carried))  # once met, it stays a row
        first = (fresh + SHIFT // 2) // SHIFT
        rows = measure_rows(
            *spread_spheres(form, now), np.concatenate([carried.first, first]),
            np.concatenate([carried.second, fresh - SHIFT * first]), walls_after, behind,
        )  # fmt: skip
        allowed = np.minimum(rows.overlap[len(carried) :], 0.0)
        excess = rows.overlap - np.concatenate([carried.overlap, allowed])
        error = float(np.abs(excess).max(initial=0.0)) / scale
        if error <= STEPS.tolerance:
            break
        now = step_stones(form, now, rows, excess)
    if error > STEPS.accepted:
        raise NotConverged(
            f"overlaps of stones err by {error:.3g} of the mean one after {STEPS.most} steps",
            remedy="jump over fewer cycles (procedure.h)",
        )
    beds = {"before": (before, walls), "estimated": (target, walls_after)}
    beds["relaxed"] = (now, walls_after)
    return now, {"method": "smallest-move", "error": error} | {
        name: asdict(measure_bed(state.position, find_touching(form, state, around)))
        for name, (state, around) in beds.items()
    }


def encode(rows: Neighbours) -> IntArray:
    """Each row as one number: `SHIFT`."""
    return np.asarray(rows.first * SHIFT + rows.second)


def step_stones(form: Form, now: State, rows: Neighbours, excess: FloatArray) -> State:
    """Stones moved and turned by the least that takes the ``excess`` [m] off each of the ``rows``
    and keeps the mean height."""
    centre, stones, size = spread_spheres(form, now)[0], len(now.radius), len(excess)
    places, values = [], []
    for side, sign in ((rows.first, 1.0), (rows.second, -1.0)):
        row = np.flatnonzero(side >= 0)
        stone, normal = side[row] // len(form.radius), sign * rows.normal[row]
        arm = (centre[side[row]] - now.position[stone]) / now.radius[stone, None]
        places.append(np.stack([np.repeat(row, 6), (6 * stone[:, None] + np.arange(6)).ravel()]))
        values.append(np.column_stack([normal, np.cross(arm, normal)]).ravel())
    places.append(np.stack([np.full(stones, size), 6 * np.arange(stones) + 2]))
    values.append(np.full(stones, stones**-0.5))
    shape, entries = (size + 1, 6 * stones), (np.concatenate(values), np.hstack(places))
    solved = lsmr(
        coo_array(entries, shape).tocsr(), np.append(excess, 0.0), atol=STEPS.residual,
        btol=STEPS.residual, maxiter=10 * max(shape),
    )[0].reshape(-1, 6)  # fmt: skip
    solved *= min(1.0, STEPS.reach / float(np.abs(solved / now.radius[:, None]).max(initial=1e-9)))
    return turn_stones(
        now.move_to(now.position + solved[:, :3]), solved[:, 3:] / now.radius[:, None]
    )
