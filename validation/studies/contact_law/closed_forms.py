"""What single impacts must end in: closed forms for Hertz' contact and for rigid bodies that slide.

Symbols as in Chung and Ooi (2011): V_n, V_t speeds of approach of the contact point along normal
and tangent, omega spin, mu friction, e restitution; primes mark what is after the impact.  Hertz'
collision itself is `adapters.bed.contact_law.solve_hertz_collision`.  Between rebound without
sliding and rebound that slides all the time there is no closed form for a spring that stiffens:
there an engine's own law is integrated, in units of m*, V_n and the stiffness of eq. 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gamma, sqrt

import numpy as np

from adapters.bed import contact_law
from adapters.bed.contact_law import CONTACT_TIME_FACTOR, DAMPING_FACTOR
from adapters.bed.state import FloatArray
from validation.studies.contact_law.engine_runs import can_pull, has_damping


def find_contact_time(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Duration of an elastic impact [s]: t_c = 2.87 (m*^2/(R* E*^2 V))^(1/5) (Timoshenko, Goodier).

    ``mass`` m* [kg], ``radius`` R* [m], ``modulus`` E* [Pa], ``speed`` V [m/s].
    """
    return float(2.87 * (mass**2 / (radius * modulus**2 * speed)) ** 0.2)


def find_peak_force(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Greatest force [N], 4/3 E* sqrt(R*) delta_max^(3/2) (eq. 5); arguments as
    `find_contact_time`.
    """
    overlap = contact_law.solve_hertz_collision(speed, modulus, radius, mass).overlap_max
    return float(contact_law.find_normal_force(overlap, modulus, radius))


def find_mean_overlap(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Mean overlap [m] of an elastic impact, weighted with the force: 0.8176 delta_max.

    1/2 B(7/5, 1/2) delta_max, from dt = d delta/(V sqrt(1 - (delta/delta_max)^(5/2))); arguments
    as `find_contact_time`.
    """
    deepest = contact_law.solve_hertz_collision(speed, modulus, radius, mass).overlap_max
    return 0.5 * gamma(1.4) * gamma(0.5) / gamma(1.9) * deepest


def find_sliding_restitution(
    tangent: FloatArray, friction: float, restitution: float
) -> FloatArray:
    """V_t'/V_t of the centre, 1 - mu (1 + e)/tan(theta): a grain that slides all the time.

    Tests 4 and 5; ``tangent`` of the angle of incidence theta from the normal, no spin before.
    """
    return 1 - friction * (1 + restitution) / tangent


def find_sliding_spin(friction: float, restitution: float) -> float:
    """Spin that sliding adds, 5/2 mu (1 + e), in the unit V_n/R (of two grains: times m*/m)."""
    return 2.5 * friction * (1 + restitution)


def find_rebound_tangent(tangent: FloatArray, friction: float, restitution: float) -> FloatArray:
    """tan of the contact point's rebound angle, (tan(theta) - 7/2 mu (1 + e))/e.

    ``tangent`` is the slip of the contact point before over V_n: V_t/V_n in tests 4 and 5,
    R omega/V_n in test 6.  In units of mu, with e = 1, the rebound angle is that of incidence
    less 7 and the spin 5, the limits of test 5.
    """
    return (tangent - find_sliding_start(friction, restitution)) / restitution


def find_sliding_start(friction: float, restitution: float) -> float:
    """tan(theta) from which a rigid sphere slides all the time: 7/2 mu (1 + e)."""
    return 3.5 * friction * (1 + restitution)


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


def find_law(engine: str, law: str) -> Law:
    """An engine's law under a name of `validation.studies.contact_law.engine_runs.LAWS`."""
    own = LAW_OF_ENGINE[engine]
    return Law(own.rule, own.pulls and can_pull(law), own.damping if has_damping(law) else "none")


def integrate_impulse(
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
        damping = 2 * DAMPING_FACTOR * contact_law.find_alpha(restitution)
    else:
        damping = 2 * contact_law.find_rebound_damping(restitution)
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


def find_pull_factor(restitution: float) -> float:
    """Integral of |F_n| over that of F_n, for eq. 7, whose contacts pull before they part.

    Friction mu |F_n| makes the impulse of a grain that slides larger than mu (1 + e) V_n by it.
    1.067 for e = 0.5, 1.0001 for e = 0.98.
    """
    ratio = DAMPING_FACTOR * contact_law.find_alpha(restitution)
    kept = contact_law.solve_collision(1.0, 1.0, 1.0, 1.0, ratio, may_pull=False).restitution
    return (1 + 2 * kept - restitution) / (1 + restitution)
