"""Relaxation: bring the overlaps of an estimated configuration back to what a bed can carry.

After a jump the estimated positions penetrate by up to millimetres and have lost most contacts.
`relax` offers two methods behind one call and one result:

``smallest-move``   nearest positions in which the force network has its overlaps again, nothing
                    else penetrates, and the mean settlement of the jump is kept (the default)
``karrech2007``     least energy of eq. 29, frictionless Hertz contacts under gravity, the grains
                    at the frontier fixed as in section 4.2 of the paper, or free

On Karrech's bed of 1,085 grains, cycle 50 to 100 by the log law of each grain, the smallest move
keeps 3.34 contacts a grain and 43 um of settlement in 0.06 s; eq. 29 with its frontier fixed keeps
the overlaps that the fixed grains were estimated with (Fig. 9 ends at 6e-5 m for the same reason),
and with free grains the bed flows, as nothing replaces friction: docs/jumps.md.
"""

import time

import numpy as np

from adapters.bed import (
    CHAIN_FACTOR,
    GRAVITY,
    BoolArray,
    FloatArray,
    HertzStiffness,
    IntArray,
    State,
    Walls,
    check_bed,
    find_overlap_under_force,
    list_wall_names,
    list_wall_rows,
)
from adapters.errors import UsageError
from adapters.relaxation.measured import (
    Estimated,
    Relaxation,
    RelaxationNotConverged,
    Surroundings,
    make_estimate,
    measure_relaxation,
)
from adapters.relaxation.printed import minimise_energy
from adapters.relaxation.smallest import find_smallest_move
from trackbed.choices import explain_retired

METHODS = ("smallest-move", "karrech2007")
"""What a user may name."""
RETIRED = {"proximal": "smallest-move"}
"""Methods that left trackbed, and the nearest one that is here."""
GAP_FACTOR = 5.0
"""Pairs nearer than so many mean overlaps belong to the network: they close under any load."""


def relax(
    position: FloatArray, before: State, walls: Walls, stiffness: HertzStiffness, *,
    walls_after: Walls | None = None, method: str = "smallest-move",
    frontier: BoolArray | None = None, keep_height: bool = True, overlap_cap: float = np.inf,
    tolerance: float = 0.01, evaluations_max: int = 40_000,
) -> Relaxation:  # fmt: skip
    """Relax the estimated ``position`` (n, 3) [m] of the grains of ``before``.

    ``walls`` are those that ``before`` touches, ``walls_after`` the same with the piston where it
    is now.

    ``smallest-move``: every pair in contact before the jump gets back its overlap, as far as the
    network does not turn over; ``keep_height`` keeps the mean height of ``position``;
    ``overlap_cap`` [m] bounds what counts as carried (``before`` was not in equilibrium itself).
    ``karrech2007`` holds the grains of ``frontier`` (n,) where they are estimated: those that touch
    a wall before the jump where it is not given.

    ``tolerance`` is relative: an error of an overlap over the mean carried overlap, or a residual
    force over the mean weight.  Raises `UsageError` for input that is no bed, and
    `RelaxationNotConverged`, with the best configuration attached.  Do not use ``karrech2007`` on
    a bed that friction holds: it flows, or loses its contacts.
    """
    started = time.process_time()
    bed = make_estimate(position, before, walls, walls_after, stiffness)
    if method not in METHODS:
        raise UsageError(
            f"there is no relaxation '{method}'{explain_retired(method, RETIRED)}",
            remedy=f"name one of {', '.join(METHODS)}",
        )
    if tolerance <= 0:
        raise UsageError("a relaxation wants a tolerance above 0")
    if method == "smallest-move":
        relaxed, converged, evaluations = relax_by_move(
            bed, overlap_cap, keep_height, tolerance, evaluations_max
        )
    else:
        if frontier is None:
            frontier = np.zeros(len(bed.position), bool)
            frontier[bed.carried.first[bed.carried.second < 0]] = True
        relaxed, converged, evaluations = minimise_energy(
            bed, ~frontier, tolerance * bed.mean_weight, evaluations_max
        )
    result = measure_relaxation(bed, relaxed, method, converged, evaluations, started)
    if not converged:
        error = RelaxationNotConverged(
            f"relaxation '{method}' stopped after {evaluations} evaluations with overlaps up to "
            f"{result.relaxed.max_penetration:.2g} m",
            remedy="extrapolate over fewer cycles, or smooth and clip the displacements"
            if np.isinf(overlap_cap)
            else "look whether the scene is that of this bed: its walls, and grains of its size",
        )
        error.best = result
        raise error
    return result


def relax_bare(
    state: State, walls: Walls, stiffness: HertzStiffness, *, method: str = "smallest-move",
    load: float = 0.0,
) -> Relaxation:  # fmt: skip
    """Relax a state of which no earlier one is known; arguments and errors as `relax`.

    Overlaps up to what a bed in equilibrium under its weight and ``load`` [N] can show are taken
    as carried, so that such a bed stays as it is; larger ones are brought down.
    """
    check_bed(state.position, state.radius)
    cap = bound_equilibrium_overlap(state, stiffness, load)
    return relax(
        state.position, state, walls, stiffness, method=method, keep_height=False, overlap_cap=cap
    )


def bound_equilibrium_overlap(state: State, stiffness: HertzStiffness, load: float = 0.0) -> float:
    """Greatest Hertz overlap [m] that weight and ``load`` [N] cause in a bed at rest.

    The whole vertical force goes through each layer; a contact carries at most `CHAIN_FACTOR`
    times its share among the grains of a layer, and never more than all of it.
    """
    if len(state.radius) == 0:
        return 0.0
    top, bottom = state.position[:, 2] + state.radius, state.position[:, 2] - state.radius
    layer = len(state.radius) * 2 * state.radius.mean() / float(top.max() - bottom.min())
    force = (GRAVITY * state.mass.sum() + load) * min(1.0, CHAIN_FACTOR / layer)
    return float(find_overlap_under_force(force, stiffness.grain, state.radius.min() / 2))


def relax_by_move(
    bed: Estimated, overlap_cap: float, keep_height: bool, tolerance: float, evaluations_max: int
) -> tuple[FloatArray, bool, int]:
    """`find_smallest_move` of grains sorted in space; centres [m], whether converged,
    evaluations."""
    carried = bed.carried.overlap[bed.carried.overlap <= overlap_cap]
    scale = float(carried.mean()) if len(carried) else bed.length
    position_before = bed.before.position
    order = sort_in_space(position_before, bed.scene.radius)
    before, after = bed.scene_before.reorder(order), bed.scene.reorder(order)
    network = before.search(position_before[order], GAP_FACTOR * scale)
    estimate = bed.position[order]
    moved, converged, evaluations = find_smallest_move(
        estimate, _bring_inside(after, estimate), after, network, overlap_cap, scale,
        GAP_FACTOR * scale, keep_height=keep_height, tolerance=tolerance * scale,
        accepted=min(overlap_cap, max(scale, network.overlap.max(initial=0.0))),
        evaluations_max=evaluations_max,
    )  # fmt: skip
    position = np.empty_like(estimate)
    position[order] = moved
    return position, converged, evaluations


def sort_in_space(position: FloatArray, radius: FloatArray) -> IntArray:
    """Order in which neighbours in space are neighbours in memory: half the time at 1e5 grains."""
    cell = np.floor(position / (4 * np.median(radius)))
    return np.lexsort((position[:, 0], cell[:, 0], cell[:, 1], cell[:, 2]))


def _bring_inside(scene: Surroundings, position: FloatArray) -> FloatArray:
    """Positions [m] where grains with their centre beyond a wall are brought to touch it."""
    start = position.copy()
    for wall in range(len(list_wall_names(scene.walls))):
        rows = scene.rows(
            start, *list_wall_rows(start, scene.radius, scene.walls, scene.behind, 0.0)
        )
        beyond = (rows.second == -1 - wall) & (rows.overlap > scene.radius[rows.first])
        start[rows.first[beyond]] += rows.overlap[beyond, None] * rows.normal[beyond]
    return start
