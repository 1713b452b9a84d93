"""What single impacts must end in: closed forms for Hertz' contact and for rigid bodies that slide.

Symbols as in Chung and Ooi (2011): V_n, V_t speeds of approach of the contact point along normal
and tangent, omega spin, mu friction, e restitution; primes mark what is after the impact.  Hertz'
collision itself is `adapters.contact_law.hertz_collision`.
"""

from __future__ import annotations

from math import gamma

from adapters import contact_law
from adapters.state import FloatArray


def contact_time(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Duration of an elastic impact [s]: t_c = 2.87 (m*^2/(R* E*^2 V))^(1/5) (Timoshenko, Goodier).

    ``mass`` m* [kg], ``radius`` R* [m], ``modulus`` E* [Pa], ``speed`` V [m/s].
    """
    return float(2.87 * (mass**2 / (radius * modulus**2 * speed)) ** 0.2)


def peak_force(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Greatest force [N], 4/3 E* sqrt(R*) delta_max^(3/2) (eq. 5); arguments as `contact_time`."""
    overlap = contact_law.hertz_collision(speed, modulus, radius, mass).overlap_max
    return float(contact_law.normal_force(overlap, modulus, radius))


def mean_overlap(mass: float, radius: float, modulus: float, speed: float) -> float:
    """Mean overlap [m] of an elastic impact, weighted with the force: 0.8176 delta_max.

    1/2 B(7/5, 1/2) delta_max, from dt = d delta/(V sqrt(1 - (delta/delta_max)^(5/2))); arguments
    as `contact_time`.
    """
    deepest = contact_law.hertz_collision(speed, modulus, radius, mass).overlap_max
    return 0.5 * gamma(1.4) * gamma(0.5) / gamma(1.9) * deepest


def sliding_tangential_restitution(
    tangent: FloatArray, friction: float, restitution: float
) -> FloatArray:
    """V_t'/V_t of the centre, 1 - mu (1 + e)/tan(theta): a grain that slides all the time.

    Tests 4 and 5; ``tangent`` of the angle of incidence theta from the normal, no spin before.
    """
    return 1 - friction * (1 + restitution) / tangent


def sliding_spin(friction: float, restitution: float) -> float:
    """Spin that sliding adds, 5/2 mu (1 + e), in the unit V_n/R (of two grains: times m*/m)."""
    return 2.5 * friction * (1 + restitution)


def sliding_rebound_tangent(tangent: FloatArray, friction: float, restitution: float) -> FloatArray:
    """tan of the contact point's rebound angle, (tan(theta) - 7/2 mu (1 + e))/e.

    ``tangent`` is the slip of the contact point before over V_n: V_t/V_n in tests 4 and 5,
    R omega/V_n in test 6.  In units of mu, with e = 1, the rebound angle is that of incidence
    less 7 and the spin 5, the limits of test 5.
    """
    return (tangent - sliding_begins(friction, restitution)) / restitution


def sliding_begins(friction: float, restitution: float) -> float:
    """tan(theta) from which a rigid sphere slides all the time: 7/2 mu (1 + e)."""
    return 3.5 * friction * (1 + restitution)
