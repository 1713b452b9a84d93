"""Relaxation: bring the overlaps of an estimated configuration back to what a bed can carry.

After a jump the estimated positions penetrate by up to millimetres and have lost most contacts.
(Where a jammed bed has no room for them: `adapters.relaxation_rearranged`.)
`relax` offers three methods behind one call and one result:

``smallest-move``   nearest positions in which the force network has its overlaps again, nothing
                    else penetrates, and the mean settlement of the jump is kept (the default)
``karrech2007``     least energy of eq. 29, frictionless Hertz contacts under gravity, the grains
                    at the frontier fixed as in section 4.2 of the paper, or free
``proximal``        Hertz contacts without gravity, each grain tied to its estimate by a spring

Measured on Karrech's bed of 1,085 grains, cycle 50 to 100 by the log law of each grain:

| after               | contacts a grain | overlap, greatest, mean | settlement | evaluations, CPU |
|---------------------|------------------|-------------------------|------------|------------------|
| cycle 50            | 3.34             | 3.0e-7 m, 5.7e-8 m      | 0          |                  |
| the estimate        | 1.05             | 8.1e-4 m, 2.8e-5 m      | 43 um      |                  |
| smallest-move       | 3.34             | 3.0e-7 m, 5.7e-8 m      | 43 um      | 1,058, 0.06 s    |
| proximal            | 3.63             | 8.5e-7 m, 1.5e-7 m      | 34 um      | 597, 0.5 s       |
| karrech2007, fixed  | 3.24             | 3.6e-4 m, 2.1e-6 m      | 341 um     | > 20,000, 13 s   |
| karrech2007, free   | 3.76             | 2.4e-7 m, 5.8e-8 m      | > 1,700 um | > 20,000, 15 s   |

Fixed grains keep the overlaps they were estimated with (Fig. 9 ends at 6e-5 m for the same
reason); free ones flow, as nothing stands for friction.  LIGGGHTS, continued at paper scale after
a jump of 60 cycles (25 um): contacts a grain at the restart and after each cycle, settlement of
each cycle in um; one run each:

| no jump             | 3.47  3.46  3.43  3.36  3.39  3.38  3.39  |  0.5  0.8  0.6  0.7  0.9  1.2 |
| smallest-move       | 3.47  3.41  3.43  3.44  3.44  3.46  3.41  |  3.0  1.2  0.7  0.8  0.7  0.7 |
| proximal            | 4.18  3.32  3.37  3.38  3.43  3.47  3.46  |  1.6  1.4  1.2  0.9  0.7  0.7 |
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from adapters.contact_law import HertzStiffness, overlap_under_force
from adapters.container import Walls
from adapters.errors import NotConverged, UsageError
from adapters.overlaps import (
    Bed,
    Neighbours,
    bed_check,
    bed_measure,
    behind_discs,
    wall_names,
    wall_rows,
)
from adapters.relaxation_kernel import BoolArray
from adapters.relaxation_printed import Energy, energy_minimise
from adapters.relaxation_smallest import smallest_move
from adapters.relaxation_surroundings import Surroundings
from adapters.state import FloatArray, IntArray, State

Method = Literal["smallest-move", "karrech2007", "proximal"]
METHODS: tuple[Method, ...] = ("smallest-move", "karrech2007", "proximal")

GAP_FACTOR = 5.0
"""Pairs nearer than so many mean overlaps belong to the network: they close under any load."""
CHAIN_FACTOR = 10.0
"""Greatest contact force over the mean one: force chains have an exponential tail, and the
largest of a hundred thousand contacts stays below it."""
PROXIMAL_STIFFNESS = 1e3
"""Stiffness that ties a grain to its estimate in ``proximal`` [N/m]."""


@dataclass(frozen=True)
class Relaxation:
    """Relaxed positions, and what was changed to reach them."""

    position: FloatArray
    """Centres [m], (n, 3)."""
    method: str
    """One of `METHODS`, or ``rearranged``."""
    converged: bool
    before: Bed
    """Measures of the state before the jump."""
    estimated: Bed
    """Measures of the estimated positions."""
    relaxed: Bed
    """Measures of the relaxed positions."""
    energy: float
    """Hertz energy of all contacts plus that of the weights above z = 0 [J]."""
    residual_force: float
    """Root mean square over the grains of the unbalanced force [N]: Hertz contacts, weight, and
    the tangential forces that surviving contacts carried before (when the state names them)."""
    residual_force_before: float
    """The same in the state before the jump [N]: its kinetic rest, and friction if unnamed."""
    evaluations: int
    """Evaluations of all contacts; for ``smallest-move`` products with its matrix count too."""
    cpu_s: float
    """Processor time [s]."""
    largest_move: float
    """Greatest distance of a grain from its estimate [m]."""
    median_move: float
    """Median distance of a grain from its estimate [m]."""

    @property
    def coordination_change(self) -> float:
        """Relative change of the coordination number over the jump; a sound jump stays in 3 %."""
        before = self.before.coordination_with_walls
        return self.relaxed.coordination_with_walls / before - 1 if before else 0.0

    def record(self) -> dict[str, Any]:
        """All but the positions, for the run folder and the command line."""
        record = asdict(self)
        del record["position"]
        record["coordination_change"] = self.coordination_change
        return record


class RelaxationNotConverged(NotConverged):
    """A relaxation stopped short of its tolerance; ``best`` is what it had reached."""

    best: Relaxation


def relax(
    position: FloatArray,
    before: State,
    walls: Walls,
    stiffness: HertzStiffness,
    *,
    walls_after: Walls | None = None,
    method: Method = "smallest-move",
    gravity: float = 9.81,
    frontier: Literal["fixed", "free"] | BoolArray = "fixed",
    external_force: FloatArray | None = None,
    keep_height: bool = True,
    overlap_cap: float = np.inf,
    tolerance: float = 0.01,
    evaluations_max: int = 40_000,
) -> Relaxation:
    """Relax the estimated ``position`` (n, 3) [m] of the grains of ``before``.

    ``walls`` are those that ``before`` touches, ``walls_after`` the same with the piston where it
    is now.  ``gravity`` [m/s^2] acts along -z.

    ``smallest-move``: every pair in contact before the jump gets back its overlap, as far as the
    network does not turn over; ``overlap_cap`` [m] bounds what counts as carried (a state that
    was not in equilibrium itself); ``keep_height`` keeps the mean height of ``position``.
    ``karrech2007``: ``frontier`` fixed holds the grains that touch a wall before the jump where
    they are estimated, an array (n,) of bool names the grains to hold; ``external_force`` (n, 3)
    [N] acts at the unloaded instant (a piston's weight, say).

    ``tolerance`` is relative: an error of an overlap over the mean carried overlap, or a residual
    force over the mean weight.  Raises `UsageError` for input that is no bed, and
    `RelaxationNotConverged`, with the best configuration attached.  Do not use ``karrech2007`` on
    a bed that friction holds: it flows, or loses its contacts.
    """
    started = time.process_time()
    bed = estimated(position, before, walls, walls_after, stiffness, gravity)
    if method not in METHODS:
        raise UsageError(f"there is no relaxation '{method}'", remedy=f"choose of {METHODS}")
    if tolerance <= 0:
        raise UsageError("a relaxation wants a tolerance above 0")
    if method == "smallest-move":
        relaxed, converged, evaluations = _relax_by_move(
            bed, overlap_cap, keep_height, tolerance, evaluations_max
        )
    else:
        held = np.zeros(len(bed.scene.radius), bool)
        if method == "proximal":
            energy = bed.energy(np.zeros_like(bed.position), PROXIMAL_STIFFNESS)
        else:
            force = bed.weight()
            force += 0.0 if external_force is None else external_force
            energy = bed.energy(force)
            held = _frontier(bed.carried, len(held), frontier)
        relaxed, converged, evaluations, _ = energy_minimise(
            energy, bed.position, ~held, bed.length, tolerance * bed.mean_weight, evaluations_max
        )
    result = relaxation_measured(bed, relaxed, method, converged, evaluations, started)
    if not converged:
        error = RelaxationNotConverged(
            f"relaxation '{method}' stopped after {evaluations} evaluations with overlaps up to "
            f"{result.relaxed.max_penetration:.2g} m",
            remedy="extrapolate over fewer cycles, or smooth and clip the displacements",
        )
        error.best = result
        raise error
    return result


@dataclass(frozen=True)
class Estimated:
    """The bed that a jump estimates, the state it came from, and what both touch."""

    position: FloatArray
    """Estimated centres [m], (n, 3)."""
    before: State
    scene_before: Surroundings
    scene: Surroundings
    """The same with the piston where it is now."""
    carried: Neighbours
    """Contacts of ``before``."""
    gravity: float
    """Acceleration along -z [m/s^2]."""

    @property
    def mean_weight(self) -> float:
        """Mean weight of a grain [N]."""
        return self.gravity * float(self.before.mass.mean())

    @property
    def length(self) -> float:
        """Overlap of two mean grains under the mean weight [m]."""
        stiffness, radius = self.scene.stiffness.grain, self.scene.radius.mean()
        return float(overlap_under_force(self.mean_weight, stiffness, radius / 2))

    def weight(self) -> FloatArray:
        """Weight of each grain [N], (n, 3)."""
        force = np.zeros_like(self.position)
        force[:, 2] = -self.gravity * self.before.mass
        return force

    def energy(self, force: FloatArray, proximal: float = 0.0) -> Energy:
        """The functional of eq. 29 with a ``force`` (n, 3) [N] on the grains.

        ``proximal`` [N/m] ties each to its estimate.
        """
        scene = self.scene
        return Energy(
            scene.radius, force, self.position, proximal, scene.rows, scene.search,
            scene.row_stiffness,
        )  # fmt: skip


def estimated(
    position: FloatArray,
    before: State,
    walls: Walls,
    walls_after: Walls | None,
    stiffness: HertzStiffness,
    gravity: float,
) -> Estimated:
    """Arguments of `relax` taken together; raises `UsageError` for what is no bed."""
    position = np.ascontiguousarray(position, float)
    radius = np.ascontiguousarray(before.radius, float)
    after = walls if walls_after is None else walls_after
    bed_check(position, radius)
    if wall_names(after) != wall_names(walls):
        raise UsageError(
            f"the walls before, {wall_names(walls)}, are not those after, {wall_names(after)}",
            remedy="the same walls belong to both; a piston may only move",
        )
    if not (len(radius) and gravity > 0):
        raise UsageError("a relaxation wants grains and gravity above 0")
    behind = behind_discs(before.position, walls)
    scene_before = Surroundings(radius, walls, behind, stiffness)
    scene = Surroundings(radius, after, behind, stiffness)
    carried = scene_before.search(before.position, 0.0)
    return Estimated(position, before, scene_before, scene, carried, gravity)


def relaxation_measured(
    bed: Estimated,
    relaxed: FloatArray,
    method: str,
    converged: bool,
    evaluations: int,
    started: float,
) -> Relaxation:
    """What a relaxation to ``relaxed`` (n, 3) [m] changed, ``started`` at a CPU time [s]."""
    before, scene, gravity = bed.before, bed.scene, bed.gravity
    touching = scene.search(relaxed, 0.0)
    move = np.linalg.norm(relaxed - bed.position, axis=1)
    return Relaxation(
        position=relaxed,
        method=method,
        converged=converged,
        before=bed_measure(before.position, bed.carried),
        estimated=bed_measure(bed.position, scene.search(bed.position, 0.0)),
        relaxed=bed_measure(relaxed, touching),
        energy=_energy(scene, relaxed, touching, before, gravity),
        residual_force=_residual_force(scene, touching, before, gravity),
        residual_force_before=_residual_force(bed.scene_before, bed.carried, before, gravity),
        evaluations=evaluations,
        cpu_s=time.process_time() - started,
        largest_move=float(move.max(initial=0.0)),
        median_move=float(np.median(move)) if len(move) else 0.0,
    )


def relax_bare(
    state: State,
    walls: Walls,
    stiffness: HertzStiffness,
    *,
    method: Method = "smallest-move",
    gravity: float = 9.81,
    load: float = 0.0,
    tolerance: float = 0.01,
) -> Relaxation:
    """Relax a state of which no earlier one is known; arguments and errors as `relax`.

    Overlaps up to what a bed in equilibrium under its weight and ``load`` [N] can show are taken
    as carried, so that such a bed stays as it is; larger ones are brought down.
    """
    bed_check(state.position, state.radius)
    return relax(
        state.position,
        state,
        walls,
        stiffness,
        method=method,
        gravity=gravity,
        keep_height=False,
        overlap_cap=equilibrium_overlap(state, stiffness, gravity, load),
        tolerance=tolerance,
    )


def equilibrium_overlap(
    state: State, stiffness: HertzStiffness, gravity: float, load: float = 0.0
) -> float:
    """Greatest Hertz overlap [m] that weight and ``load`` [N] cause in a bed at rest.

    The whole vertical force goes through each layer; a contact carries at most `CHAIN_FACTOR`
    times its share among the grains of a layer, and never more than all of it.
    """
    if len(state.radius) == 0:
        return 0.0
    top, bottom = state.position[:, 2] + state.radius, state.position[:, 2] - state.radius
    layer = len(state.radius) * 2 * state.radius.mean() / float(top.max() - bottom.min())
    force = (gravity * state.mass.sum() + load) * min(1.0, CHAIN_FACTOR / layer)
    return float(overlap_under_force(force, stiffness.grain, state.radius.min() / 2))


def _relax_by_move(
    bed: Estimated,
    overlap_cap: float,
    keep_height: bool,
    tolerance: float,
    evaluations_max: int,
) -> tuple[FloatArray, bool, int]:
    """`smallest_move` of grains sorted in space; centres [m], whether converged, evaluations."""
    scale = _overlap_scale(bed, overlap_cap)
    estimate, position_before = bed.position, bed.before.position
    order = _spatial_order(position_before, bed.scene.radius)
    before, after = bed.scene_before.taken(order), bed.scene.taken(order)
    network = before.search(position_before[order], GAP_FACTOR * scale)
    capped = network.overlap > overlap_cap
    moved = smallest_move(
        estimate[order],
        _inside(after, estimate[order]),
        after.radius,
        _chosen(network, ~capped),
        _chosen(network, capped, scale),
        GAP_FACTOR * scale,
        after.rows,
        after.search,
        keep_height=keep_height,
        tolerance=tolerance * scale,
        accepted=min(overlap_cap, max(scale, network.overlap.max(initial=0.0))),
        evaluations_max=evaluations_max,
    )
    position = np.empty_like(estimate)
    position[order] = moved.position
    return position, moved.converged, moved.evaluations


def _frontier(
    carried: Neighbours, n: int, frontier: Literal["fixed", "free"] | BoolArray
) -> BoolArray:
    """Grains (n,) that eq. 29 holds where they are estimated."""
    if isinstance(frontier, np.ndarray):
        return frontier
    held = np.zeros(n, bool)
    if frontier == "fixed":
        held[carried.first[carried.second < 0]] = True
    return held


def _overlap_scale(bed: Estimated, overlap_cap: float) -> float:
    """Mean carried overlap [m]; without any, that of one grain's weight on another."""
    overlap = bed.carried.overlap[bed.carried.overlap <= overlap_cap]
    return float(overlap.mean()) if len(overlap) else bed.length


def _spatial_order(position: FloatArray, radius: FloatArray) -> IntArray:
    """Order in which neighbours in space are neighbours in memory: half the time at 1e5 grains."""
    cell = np.floor(position / (4 * np.median(radius)))
    return np.lexsort((position[:, 0], cell[:, 0], cell[:, 1], cell[:, 2]))


def _chosen(rows: Neighbours, which: BoolArray, overlap: float | None = None) -> Neighbours:
    """Some of the rows, with another overlap [m] when given."""
    kept = rows.overlap[which] if overlap is None else np.full(int(which.sum()), overlap)
    return Neighbours(rows.first[which], rows.second[which], rows.normal[which], kept)


def _inside(scene: Surroundings, position: FloatArray) -> FloatArray:
    """Positions [m] where grains with their centre beyond a wall are brought to touch it."""
    start = position.copy()
    for wall in range(len(wall_names(scene.walls))):
        rows = scene.rows(start, *wall_rows(start, scene.radius, scene.walls, scene.behind, 0.0))
        beyond = (rows.second == -1 - wall) & (rows.overlap > scene.radius[rows.first])
        start[rows.first[beyond]] += rows.overlap[beyond, None] * rows.normal[beyond]
    return start


def _energy(
    scene: Surroundings, position: FloatArray, touching: Neighbours, state: State, gravity: float
) -> float:
    """Hertz energy 2/5 lambda delta^(5/2) plus m g z [J]."""
    hertz = 0.4 * scene.row_stiffness(touching) @ touching.overlap**2.5
    return float(hertz + gravity * state.mass @ position[:, 2])


def _residual_force(
    scene: Surroundings, touching: Neighbours, state: State, gravity: float
) -> float:
    """Root mean square of the unbalanced force over the grains [N]."""
    force = np.zeros((len(scene.radius), 3))
    force[:, 2] = -gravity * state.mass
    pair = touching.second >= 0
    normal = (scene.row_stiffness(touching) * touching.overlap**1.5)[:, None] * touching.normal
    np.add.at(force, touching.first, normal)
    np.add.at(force, touching.second[pair], -normal[pair])
    held = np.searchsorted(state.identifier, state.contacts.pair)
    alive = np.isin(_pair_key(held), _pair_key(np.column_stack([touching.first, touching.second])))
    np.add.at(force, held[alive, 0], state.contacts.tangential_force[alive])
    np.add.at(force, held[alive, 1], -state.contacts.tangential_force[alive])
    for wall, name in enumerate(wall_names(scene.walls)):
        rows = touching.second == -1 - wall
        # the engine names a mesh wall after its fix: the piston's is piston_wall
        force_on_grains = state.wall_force.get(name, state.wall_force.get(f"{name}_wall"))
        if force_on_grains is not None:
            push = force_on_grains[touching.first[rows]]
            along = np.einsum("ma,ma->m", push, touching.normal[rows])
            force[touching.first[rows]] += push - along[:, None] * touching.normal[rows]
    return float(np.sqrt(np.mean(np.sum(force**2, axis=1)))) if len(force) else 0.0


def _pair_key(pair: IntArray) -> IntArray:
    """One number for each pair of grain indices, (m, 2)."""
    return np.asarray((pair.min(axis=1) << 32) + pair.max(axis=1))
