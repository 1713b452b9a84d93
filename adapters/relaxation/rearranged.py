"""Room for a jump where no move leaves any: grains change places, as they do in a full run.

The smallest move keeps every grain among its neighbours, and a jammed bed has no room so.  A full
run makes it: whenever its cycles double, its grains part from the mean profile by 0.3 to 0.4 radii
(root mean square; coarse bed, 10 runs), ten times what the mean grain settles by.  Here the bed
hops from one state near equilibrium to the next (basin hopping: Wales and Doye, J. Phys. Chem. A
101 (1997) 5111, where a state is kept only if its energy is lower).  A hop kicks every grain at
random and lets the bed flow, without friction and under its weight, towards a minimum of the energy
of eq. 29.  The piston rests meanwhile, where the jump lowered it to.

The contacts are those of a bed without friction, more than before; from the first load on friction
has them back at what they were.
"""

from __future__ import annotations

import time

import numpy as np

from adapters.bed import FloatArray, HertzStiffness, State, Walls
from adapters.relaxation.measured import (
    Estimated,
    Relaxation,
    RelaxationNotConverged,
    estimated,
    measure_relaxation,
)
from adapters.relaxation.printed import minimise_energy

KICK = 0.5
"""Root mean square of a grain's first kick, in mean radii: what full runs do while their cycles
double twice."""
KICK_GROWS, KICK_SHRINKS = 1.1, 0.9
"""Factors of the next kick after a hop that is kept, and after one that is not."""
HOPS_MAX = 30
"""Most hops; on the coarse bed half of the jumps that find room do in 13 at most."""
EVALUATIONS_OF_HOP = 600
"""Most evaluations of the energy in a hop: under its next load a bed moves on anyway."""
ENOUGH = 0.9
"""Share of the settlement asked for that ends the search."""
LEAST, MOST = 0.5, 1.5
"""Shares of it between which the settlement of a state has to be."""
OVERLAP_MAX = 1.2
"""Greatest overlap that a state may have, over the greatest before the jump."""


def rearrange(
    estimate: FloatArray,
    before: State,
    walls: Walls,
    stiffness: HertzStiffness,
    generator: np.random.Generator,
    *,
    walls_after: Walls | None = None,
    gravity: float = 9.81,
    hops_max: int = HOPS_MAX,
) -> tuple[Relaxation, int]:
    """A bed near equilibrium that has settled by what ``estimate`` (n, 3) [m] asks, or near it.

    ``walls`` are those that ``before`` touches, ``walls_after`` the same with the piston where it
    is to be; ``gravity`` [m/s^2] acts along -z.  Returns, of the states visited, the one whose mean
    grain has settled by most, between `LEAST` and `MOST` of what is asked (the caller corrects the
    difference), and the number of hops made.  On one machine the same
    ``generator`` gives the same bed.

    Raises `UsageError` for input that is no bed, and `RelaxationNotConverged`, with the state of
    least energy attached, where no state has settled so without overlaps beyond those of before.
    Do not use it where single grains or contacts are to be kept, nor for a bed that its friction
    holds up: without friction that flows further than is asked, which is refused.
    """
    started = time.process_time()
    bed = estimated(estimate, before, walls, walls_after, stiffness, gravity)
    allowed = OVERLAP_MAX * max(bed.carried.overlap.max(initial=0.0), bed.length)
    start = float(before.position[:, 2].mean())
    asked = start - float(bed.position[:, 2].mean())
    lowest, least, evaluations = _flow(bed, bed.position)
    found, got, kick, hops = None, LEAST * asked, KICK, 0
    for hops in range(hops_max + 1):
        if hops:
            kicks = kick * before.radius.mean() * generator.standard_normal(lowest.shape)
            trial, energy, more = _flow(bed, lowest + kicks / np.sqrt(3))
            evaluations += more
            kept = energy < least and start - float(trial[:, 2].mean()) <= MOST * asked
            kick *= KICK_GROWS if kept else KICK_SHRINKS
            if not kept:
                continue
            lowest, least = trial, energy
        settled = start - float(lowest[:, 2].mean())
        if settled > MOST * asked:
            break
        fits = bed.scene.search(lowest, 0.0).overlap.max(initial=0.0) <= allowed
        if fits and settled >= got:
            found, got = lowest, settled
            if settled >= ENOUGH * asked:
                break
    reached = lowest if found is None else found
    relaxation = measure_relaxation(
        bed, reached, "rearranged", found is not None, evaluations, started
    )
    if found is None:
        settled = start - float(lowest[:, 2].mean())
        error = RelaxationNotConverged(
            f"relaxation 'rearranged' settled by {1e6 * settled:.3g} um with overlaps up to "
            f"{1e6 * relaxation.relaxed.max_penetration:.3g} um in {hops} hops, where "
            f"{1e6 * asked:.3g} um with at most {1e6 * allowed:.3g} um were asked for",
            remedy="ask for less settlement at a time, by more jumps or shorter ones; where a bed "
            "settles by more than asked, its friction holds it, and it wants another relaxation",
        )
        error.best = relaxation
        raise error
    return relaxation, hops


def _flow(bed: Estimated, start: FloatArray) -> tuple[FloatArray, float, int]:
    """From ``start`` (n, 3) [m] towards a minimum: positions, energy [J], and evaluations."""
    position, _, evaluations, energy = minimise_energy(
        bed.energy(bed.weight()), start, np.ones(len(start), bool), bed.length,
        0.3 * bed.mean_weight, EVALUATIONS_OF_HOP,
    )  # fmt: skip
    return position, energy, evaluations
