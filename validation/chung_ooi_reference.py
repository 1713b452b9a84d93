"""One impact integrated on paper: Hertz, Coulomb, and each engine's tangential rule.

Between rebound without sliding and rebound that slides all the time there is no closed form for a
spring that stiffens; what an engine should give there is its own law, worked out by other code
with a far shorter step.  All in units of m*, V_n and the stiffness of eq. 5, which leaves the
numbers mu, e, 6 G*/E* and the slip of the contact point over V_n.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from adapters import contact_law
from adapters.contact_law import CONTACT_TIME_FACTOR, DAMPING_FACTOR
from adapters.state import FloatArray

RULE_OF_ENGINE = {"liggghts": "secant", "lammps": "rescaled", "yade": "incremental"}
"""What becomes of the tangential force when the normal force changes: docs/contact-law.md."""

LIGHTNESS = 3.5
"""m* over the mass that a sphere's contact point has along the tangent: 1 + m R^2/I."""


def friction_impulse(
    slip: FloatArray,
    friction: float,
    restitution: float,
    stiffness_ratio: float,
    rule: str,
    steps: int = 20_000,
) -> FloatArray:
    """Tangential impulse over m* V_n of impacts that never pull, without tangential damping.

    ``slip`` of the contact point over V_n, shape (n,); ``friction`` mu; ``restitution`` e;
    ``stiffness_ratio`` 6 G*/E*, that of k_t to the secant stiffness F_n/delta; ``rule`` one of
    "secant" (F_t = k_t delta_t), "incremental" (dF_t = k_t d delta_t), "rescaled" (incremental,
    and F_t follows k_t down).  Leapfrog, ``steps`` in an undamped contact.
    """
    overlap_max = 1.25**0.4  # of m* = V = 1 and F_n = delta^(3/2)
    dt = CONTACT_TIME_FACTOR * overlap_max / steps
    damping = 2 * contact_law.damping_of_rebound(restitution)
    slip = np.array(slip, dtype=float)
    force, spring, impulse = (np.zeros_like(slip) for _ in range(3))
    overlap, speed, root = 0.5 * dt, 1.0, 0.0
    while overlap > 0:
        before, root = root, sqrt(overlap)
        normal = overlap * root + damping * sqrt(1.5 * root) * speed
        if normal <= 0 and speed < 0:  # it would pull
            break
        stiffness = stiffness_ratio * root
        if rule == "secant":
            spring += slip * dt
            force = stiffness * spring
        else:
            if rule == "rescaled" and root < before:
                force *= root / before
            force = force + stiffness * slip * dt
        force = np.clip(force, -friction * normal, friction * normal)
        spring = force / stiffness
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
