"""Bodies that would pass each other within a step: in how many parts it is made instead.

At the midpoint of a step a contact is where two bodies come out of each other by the shortest way.
Once one is in the other by more than half the thickness of the thinner one, that way is out at the
far side.  So a pair that may meet within a step moves by no more than a share of that thickness.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from rigid_lcp.errors import NotConverged
from rigid_lcp.motion.equations import find_relative_velocity
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.struck_bodies import find_margin
from rigid_lcp.motion.world import World


@dataclass(frozen=True)
class PassingNumbers:
    """Parts of a step."""

    share: float = 0.5  # of the thinner body's thickness, the way of a pair that may meet [-]
    parts: int = 1000  # of a step at most; beyond it the step is refused [-]


PASSING = PassingNumbers()


def count_parts(world: World, motion: Motion, h: float) -> int:
    """In how many equal parts a step of ``h`` [s] is made so that no bodies pass each other.

    Counts what gravity adds to the velocities within it, not loads.  Raises `NotConverged`, with
    the step to take, for more than `PASSING.parts`.
    """
    accelerations = world.accelerations(motion, None, gyroscopic=False)
    margin = find_margin(world, motion, accelerations, h)
    if 2 * margin.max() <= PASSING.share * world.thickness.min():
        return 1
    found = world.contacts(motion, margin)
    after = replace_rates(motion, motion.rates + h * accelerations)
    velocity = np.stack([find_relative_velocity(found, each) for each in (motion, after)])
    both = world.thickness[np.array([found.body_a, found.body_b])]
    thickness = np.where(np.isinf(both).any(axis=0), np.inf, both.min(axis=0))  # half-spaces
    way = h * np.linalg.norm(velocity, axis=2).max(axis=0)
    meeting = h * velocity[:, :, 0].min(axis=0) < -found.gap
    parts = np.where(meeting, way / (PASSING.share * thickness), 0.0)
    if parts.max(initial=0.0) > PASSING.parts:
        worst = int(np.argmax(parts))
        names = [world.scene.name_body(int(k[worst])) for k in (found.body_a, found.body_b)]
        raise NotConverged(
            f"they approach each other by {way[worst]:.3g} m within a step, at "
            f"{way[worst] / h:.3g} m/s, where one is {thickness[worst]:.3g} m thick",
            where=" and ".join(names),
            remedy=f"take a step shorter than {h * PASSING.parts / parts[worst]:.3g} s",
        )
    return max(ceil(parts.max(initial=0.0)), 1)
