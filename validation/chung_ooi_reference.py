"""One impact integrated on paper: Hertz, Coulomb, and each engine's tangential rule.

Between rebound without sliding and rebound that slides all the time there is no closed form for a
spring that stiffens; what an engine should give there is its own law, worked out by other code
with a far shorter step.  All in units of m*, V_n and the stiffness of eq. 5, which leaves the
numbers mu, e, 6 G*/E* and the slip of the contact point over V_n.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from adapters import contact_law
from adapters.contact_law import CONTACT_TIME_FACTOR, DAMPING_FACTOR
from adapters.state import FloatArray
from validation.chung_ooi_runs import law_damps, law_pulls

LIGHTNESS = 3.5
"""m* over the mass that a sphere's contact point has along the tangent: 1 + m R^2/I."""


@dataclass(frozen=True)
class Law:
    """What an engine makes of eqs 6 and 7 along the tangent."""

    rule: str
    """When F_n changes: "secant" (F_t = k_t delta_t), "incremental" (dF_t = k_t d delta_t),
    "rescaled" (incremental, and F_t follows k_t down)."""
    pulls: bool = False
    """The contact ends at delta = 0, and pulls before that; else at the first tension."""
    damping: str = "none"
    """Viscous force along the tangent: "none", "beyond" Coulomb's limit (added to a spring that is
    within it), or "within" it (the limit cuts the sum)."""


LAW_OF_ENGINE = {
    "liggghts": Law("secant", pulls=True, damping="beyond"),
    "lammps": Law("rescaled", pulls=True, damping="within"),
    "yade": Law("incremental", pulls=False, damping="beyond"),
}
"""The law that a scene gets: docs/contact-law.md."""


def law_of(engine: str, law: str) -> Law:
    """An engine's law under a name of `validation.chung_ooi_runs.LAWS`."""
    own = LAW_OF_ENGINE[engine]
    return Law(own.rule, own.pulls and law_pulls(law), own.damping if law_damps(law) else "none")


def friction_impulse(
    slip: FloatArray,
    friction: float,
    restitution: float,
    stiffness_ratio: float,
    law: Law,
    steps: int = 20_000,
) -> FloatArray:
    """Tangential impulse over m* V_n of impacts under a law.

    ``slip`` of the contact point over V_n, shape (n,); ``friction`` mu; ``restitution`` e, made by
    the damping that the law needs for it; ``stiffness_ratio`` 6 G*/E*, that of k_t to the secant
    stiffness F_n/delta.  Leapfrog, ``steps`` in an undamped contact.
    """
    overlap_max = 1.25**0.4  # of m* = V = 1 and F_n = delta^(3/2)
    dt = CONTACT_TIME_FACTOR * overlap_max / steps
    if law.pulls:
        damping = 2 * DAMPING_FACTOR * contact_law.alpha_of_restitution(restitution)
    else:
        damping = 2 * contact_law.damping_of_rebound(restitution)
    slip = np.array(slip, dtype=float)
    spring, stretch, impulse = (np.zeros_like(slip) for _ in range(3))
    overlap, speed, root = 0.5 * dt, 1.0, 0.0
    while overlap > 0:
        before, root = root, sqrt(overlap)
        normal = overlap * root + damping * sqrt(1.5 * root) * speed
        if normal <= 0 and speed < 0 and not law.pulls:
            break
        stiffness = stiffness_ratio * root
        if law.rule == "secant":
            stretch += slip * dt
            spring = stiffness * stretch
        else:
            if law.rule == "rescaled" and root < before:
                spring *= root / before
            spring = spring + stiffness * slip * dt
        limit = friction * abs(normal)
        viscous = damping * sqrt(stiffness) * slip
        if law.damping == "within":
            force = np.clip(spring + viscous, -limit, limit)
            spring = force - viscous
        else:
            slides = np.abs(spring) > limit
            spring = np.clip(spring, -limit, limit)
            force = spring + (law.damping == "beyond") * np.where(slides, 0.0, viscous)
        stretch = spring / stiffness
        impulse += force * dt
        slip -= LIGHTNESS * force * dt
        speed -= normal * dt
        overlap += speed * dt
    return impulse


def pull_factor(restitution: float) -> float:
    """Integral of |F_n| over that of F_n, for eq. 7, whose contacts pull before they part.

    Friction mu |F_n| makes the impulse of a grain that slides larger than mu (1 + e) V_n by it.
    1.067 for e = 0.5, 1.0001 for e = 0.98.
    """
    ratio = DAMPING_FACTOR * contact_law.alpha_of_restitution(restitution)
    kept = contact_law.collision(1.0, 1.0, 1.0, 1.0, ratio, may_pull=False).restitution
    return (1 + 2 * kept - restitution) / (1 + restitution)
