"""Room for a jump where no move leaves any: grains change places, as they do in a full run.

The smallest move keeps every grain among its neighbours, and a jammed bed has no room so.  A full
run makes it: whenever its cycles double, its grains part from the mean profile by 0.3 to 0.4 radii
(root mean square; coarse bed, 10 runs), ten times what the mean grain settles by.  Here the bed
hops from one state of equilibrium to the next (basin hopping: Wales and Doye, J. Phys. Chem. A 101
(1997) 5111, with a state kept only if its energy is lower).  A hop kicks every grain at random and
lets the bed flow, without friction and under its weight, to the nearest minimum of the energy of
eq. 29.  A minimum is a bed near equilibrium, without overlaps beyond those of before if the piston
above it, which stands still meanwhile, is not too low.

Contacts are those of a bed without friction, some four a grain and not three: under load, friction
has them back at what they were within two cycles.
"""

from __future__ import annotations

import time

import numpy as np

from adapters.contact_law import HertzStiffness, overlap_under_force
from adapters.container import Walls
from adapters.overlaps import bed_check, behind_discs
from adapters.relaxation import Relaxation, RelaxationNotConverged, relaxation_measured
from adapters.relaxation_printed import Energy, EnergyRows, energy_minimise
from adapters.relaxation_surroundings import Surroundings
from adapters.state import FloatArray, State

KICK = 0.5
"""Root mean square of a grain's first kick, in mean radii: what full runs do while their cycles
double twice."""
KICK_GROWS, KICK_SHRINKS = 1.1, 0.9
"""Factors of the next kick behind a hop to a lower energy, and behind one to a higher."""
HOPS_MAX = 30
"""Most hops; in beds of 150 grains that had jammed, 31 of 32 got 50 um in 8 in the mean."""
EVALUATIONS_OF_HOP = 600
"""Most evaluations of the energy in a hop: equilibrium need not be exact, the next window's is."""
ENOUGH = 0.9
"""Share of the settlement that ends the search; what lacks is asked of the next jump."""
OVERLAP_MAX = 1.2
"""Greatest overlap that a state may have, over the greatest before the jump."""


def rearrange(
    estimate: FloatArray,
    before: State,
    walls: Walls,
    walls_after: Walls,
    stiffness: HertzStiffness,
    generator: np.random.Generator,
    *,
    gravity: float = 9.81,
    hops_max: int = HOPS_MAX,
) -> tuple[Relaxation, int]:
    """A bed in equilibrium that has settled by what ``estimate`` (n, 3) [m] asks, or near it.

    ``walls`` are those that ``before`` touches, ``walls_after`` the same with the piston where it
    is to be; ``gravity`` [m/s^2] acts along -z.  Returns the bed, of the states visited that whose
    mean grain is nearest to the mean height of ``estimate``, and the number of hops: it may have
    settled by more than asked, or by less, and the caller has to make that good.  The same
    ``generator`` gives the same bed.

    Raises `UsageError` for input that is no bed, and `RelaxationNotConverged`, with the deepest
    state attached, where none without overlaps has settled at all.  Do not use it where single
    grains or contacts are to be kept, nor for a bed that its friction holds up, such as a heap:
    without friction it flows.
    """
    started = time.process_time()
    bed_check(estimate, before.radius)
    behind = behind_discs(before.position, walls)
    scene_before = Surroundings(before.radius, walls, behind, stiffness)
    scene = Surroundings(before.radius, walls_after, behind, stiffness)
    weight = np.zeros_like(estimate)
    weight[:, 2] = -gravity * before.mass
    energy = Energy(
        before.radius, weight, estimate, 0.0, scene.rows, scene.search, scene.row_stiffness
    )
    allowed = OVERLAP_MAX * scene_before.search(before.position, 0.0).overlap.max(initial=0.0)
    start = float(before.position[:, 2].mean())
    asked = start - float(estimate[:, 2].mean())
    lowest, least, evaluations = _flow(energy, estimate, stiffness)
    nearest, got, kick, hops = None, 0.0, KICK, 0
    for hops in range(hops_max + 1):
        if hops:
            kicks = generator.standard_normal(estimate.shape) / np.sqrt(3)
            trial, value, more = _flow(
                energy, lowest + kick * before.radius.mean() * kicks, stiffness
            )
            evaluations += more
            kick *= KICK_GROWS if value < least else KICK_SHRINKS
            if value >= least:
                continue
            lowest, least = trial, value
        settled = start - float(lowest[:, 2].mean())
        fits = scene.search(lowest, 0.0).overlap.max(initial=0.0) <= allowed
        if fits and settled > 0 and (nearest is None or abs(settled - asked) < abs(got - asked)):
            nearest, got = lowest, settled
        if fits and settled >= ENOUGH * asked:
            break
    found = nearest is not None
    relaxation = relaxation_measured(
        nearest if nearest is not None else lowest, estimate, before, scene_before, scene, gravity,
        "rearranged", found, evaluations, time.process_time() - started,
    )  # fmt: skip
    if not found:
        error = RelaxationNotConverged(
            f"relaxation 'rearranged' found no state without overlaps in {hops} hops: up to "
            f"{relaxation.relaxed.max_penetration:.2g} m",
            remedy="ask for less settlement at a time: more jumps, or shorter ones",
        )
        error.best = relaxation
        raise error
    return relaxation, hops


def _flow(
    energy: Energy, start: FloatArray, stiffness: HertzStiffness
) -> tuple[FloatArray, float, int]:
    """The minimum of the energy near ``start`` (n, 3) [m], its energy [J], and the evaluations."""
    weight = float(-energy.force[:, 2].mean())
    length = float(overlap_under_force(weight, stiffness.grain, energy.radius.mean() / 2))
    position, _, evaluations = energy_minimise(
        energy, start, np.ones(len(start), bool), length, 0.3 * weight, EVALUATIONS_OF_HOP
    )
    return position, EnergyRows(energy, position)(position)[0], evaluations
