"""Hertz-Mindlin contact with viscous damping: Karrech et al. (2007), eqs 5 to 7, and LIGGGHTS' law.

Normal force on two grains that overlap by delta and approach at v = d delta/dt:

    F_n = 4/3 E* sqrt(R*) delta^(3/2) + c v        (eqs 5 and 7)
    F_t = 8 G* sqrt(R* delta) delta_t              (eq. 6), cut at mu F_n

**The damping c.**  Eq. 7 writes the force as (m/2) gamma v with gamma = 2 alpha sqrt(m k), which
is not a force by its units.  With m* = m/2, the effective mass of two equal grains, and gamma a
rate, 2 alpha sqrt(k/m*), it reads c = 2 alpha sqrt(m* k): the oscillator's damping ratio alpha.
For k we take the tangent stiffness S_n = dF_n/d delta = 2 E* sqrt(R* delta).

LIGGGHTS uses c = 2 sqrt(5/6) alpha sqrt(m* S_n), smaller by `DAMPING_FACTOR` = 0.913, with alpha
from its restitution.  The factor makes e = exp(-pi alpha/sqrt(1 - alpha^2)) exact at every speed:
in x = delta^(5/4) the damped Hertz contact is a linear oscillator of damping ratio alpha.
docs/contact-law.md compares the engines' laws term by term.
"""

from dataclasses import dataclass
from math import exp, inf, log, pi, sqrt

import numpy as np

from adapters.bed.state import FloatArray

DAMPING_FACTOR = sqrt(5 / 6)
"""LIGGGHTS' damping over 2 alpha sqrt(m* S_n), dimensionless."""
OVERLAP_BOUND = 0.05
"""Greatest overlap over the smallest radius: Hertz contact is a law of small overlaps."""
CHAIN_FACTOR = 10.0
"""Greatest contact force over the mean one: force chains have an exponential tail, and the
largest of a hundred thousand contacts stays below it."""
CONTACT_TIME_FACTOR = 2.943275
"""Contact time of an undamped Hertz collision times speed over greatest overlap, dimensionless."""


def find_shear_modulus(young: float, poisson: float) -> float:
    """Shear modulus G = E/(2 (1 + nu)) [Pa] from Young's modulus [Pa] and Poisson's ratio."""
    return young / (2 * (1 + poisson))


def combine_moduli(young_i: float, poisson_i: float, young_j: float, poisson_j: float) -> float:
    """E* [Pa] of two materials: 1/E* = (1 - nu_i^2)/E_i + (1 - nu_j^2)/E_j.

    E/(2 (1 - nu^2)) for two alike, as below eq. 5; ``young_j`` = inf is a rigid wall.
    """
    return 1 / ((1 - poisson_i**2) / young_i + (1 - poisson_j**2) / young_j)


def combine_shear_moduli(
    young_i: float, poisson_i: float, young_j: float, poisson_j: float
) -> float:
    """G* [Pa] of two materials: 1/G* = (2 - nu_i)/G_i + (2 - nu_j)/G_j.

    G/(2 (2 - nu)) for two alike, as below eq. 6.
    """
    return 1 / (
        (2 - poisson_i) / find_shear_modulus(young_i, poisson_i)
        + (2 - poisson_j) / find_shear_modulus(young_j, poisson_j)
    )


@dataclass(frozen=True)
class HertzStiffness:
    """Equivalent moduli E* of eq. 5 [Pa]."""

    grain: float  # between two grains
    wall: float  # between a grain and a wall
    mirror: float  # between a grain and its own mirror image, that is, a rigid symmetry plane


def make_hertz_stiffness(
    young: float, poisson: float, wall_young: float, wall_poisson: float
) -> HertzStiffness:
    """Moduli from Young's modulus [Pa] and Poisson's ratio of grains and walls."""
    return HertzStiffness(
        combine_moduli(young, poisson, young, poisson),
        combine_moduli(young, poisson, wall_young, wall_poisson),
        combine_moduli(young, poisson, inf, poisson),
    )


def find_normal_force(
    overlap: float | FloatArray, modulus: float, radius: float | FloatArray
) -> FloatArray:
    """Elastic normal force 4/3 E* sqrt(R*) delta^(3/2) [N] (eq. 5); zero without overlap.

    ``overlap`` delta [m], ``modulus`` E* [Pa], ``radius`` R* [m]; arrays broadcast.
    """
    return 4 / 3 * modulus * np.sqrt(radius) * np.maximum(overlap, 0.0) ** 1.5


def find_tangential_stiffness(
    overlap: float | FloatArray, shear: float, radius: float | FloatArray
) -> FloatArray:
    """Stiffness F_t/delta_t = 8 G* sqrt(R* delta) [N/m] (eq. 6); zero without overlap.

    ``overlap`` delta [m], ``shear`` G* [Pa], ``radius`` R* [m]; arrays broadcast.
    """
    return 8 * shear * np.sqrt(radius * np.maximum(overlap, 0.0))


def find_overlap_under_force(
    force: float | FloatArray, modulus: float, radius: float | FloatArray
) -> FloatArray:
    """Overlap [m] that carries an elastic normal ``force`` [N]: the inverse of eq. 5.

    ``modulus`` E* [Pa], ``radius`` R* [m]; arrays broadcast.
    """
    return (0.75 * np.asarray(force) / (modulus * np.sqrt(radius))) ** (2 / 3)


def find_rayleigh_time(radius: float, density: float, young: float, poisson: float) -> float:
    """Time of a Rayleigh wave over a grain [s]: pi R sqrt(rho/G)/(0.1631 nu + 0.8766).

    ``radius`` [m] of the smallest grain, ``density`` [kg/m^3], ``young`` [Pa].  The formula of
    LIGGGHTS' ``check/timestep/gran``; time steps are chosen as a share of it.
    """
    wave = sqrt(density / find_shear_modulus(young, poisson))
    return pi * radius * wave / (0.1631 * poisson + 0.8766)


def find_restitution(alpha: float) -> float:
    """Restitution e = exp(-pi alpha/sqrt(1 - alpha^2)) of a viscous coefficient, 0 <= alpha < 1."""
    return exp(-pi * alpha / sqrt(1 - alpha**2))


def find_alpha(restitution: float) -> float:
    """Viscous coefficient alpha = -ln e/sqrt(pi^2 + ln^2 e) of a restitution, 0 < e <= 1."""
    logarithm = log(restitution)
    return -logarithm / sqrt(pi**2 + logarithm**2)


def find_literal_restitution(alpha: float) -> float:
    """Restitution that makes LIGGGHTS damp with c = 2 alpha sqrt(m* S_n), eq. 7 as printed.

    It is that of alpha/`DAMPING_FACTOR`, so ``alpha`` must be below 0.913.
    """
    return find_restitution(alpha / DAMPING_FACTOR)


def find_rebound_damping(restitution: float) -> float:
    """Damping ratio a of c = 2 a sqrt(m* S_n) with which a contact that cannot pull rebounds so.

    For an engine that ends a contact at the first tension; ``restitution`` 0 < e <= 1, the same at
    every speed, stiffness and size.  Without a pull some of the damping is missing, so a is above
    `DAMPING_FACTOR` times `find_alpha`.
    """
    from scipy.optimize import brentq

    if restitution == 1:
        return 0.0
    least = DAMPING_FACTOR * find_alpha(restitution)

    def find_excess(ratio: float) -> float:
        return solve_collision(1.0, 1.0, 1.0, 1.0, ratio, may_pull=False).restitution - restitution

    return float(brentq(find_excess, least, 10 * least, xtol=1e-12))


@dataclass(frozen=True)
class Collision:
    """Outcome of two grains, or a grain and a wall, that meet head-on."""

    restitution: float  # speed after over speed before, dimensionless
    overlap_max: float  # greatest overlap [m]
    contact_time: float  # time in contact [s]


def solve_hertz_collision(speed: float, modulus: float, radius: float, mass: float) -> Collision:
    """The undamped collision in closed form (Hertz; Johnson, Contact Mechanics, section 11.4).

    ``speed`` of approach [m/s], ``modulus`` E* [Pa], ``radius`` R* [m], ``mass`` m* [kg]:
    delta_max = (15 m* v^2/(16 E* sqrt(R*)))^(2/5), contact time 2.943 delta_max/v.
    """
    overlap = (15 * mass * speed**2 / (16 * modulus * sqrt(radius))) ** 0.4
    return Collision(1.0, overlap, CONTACT_TIME_FACTOR * overlap / speed)


def solve_collision(
    speed: float, modulus: float, radius: float, mass: float, damping_ratio: float, *,
    may_pull: bool = True,
) -> Collision:  # fmt: skip
    """Integrate m* delta'' = -F_n - 2 a sqrt(m* S_n) delta' through one collision.

    ``damping_ratio`` a is alpha for a literal eq. 7, `DAMPING_FACTOR` alpha for LIGGGHTS.
    ``may_pull``: the contact ends at delta = 0 (eq. 7; ``limitForce off``), else as soon as the
    force would pull (``limitForce on``).  Units as in `solve_hertz_collision`.  For verification:
    solve_ivp at a relative tolerance of 1e-10.
    """
    from scipy.integrate import solve_ivp

    free = solve_hertz_collision(speed, modulus, radius, mass)
    unit_time = free.overlap_max / speed
    stiffness = find_normal_force(free.overlap_max, modulus, radius) * unit_time / (mass * speed)

    def find_repulsion(overlap: float, velocity: float) -> float:
        open_overlap = max(overlap, 0.0)
        tangent = 1.5 * stiffness * sqrt(open_overlap)
        return float(stiffness * open_overlap**1.5 + 2 * damping_ratio * sqrt(tangent) * velocity)

    def find_rate(_: float, state: FloatArray) -> list[float]:
        return [state[1], -find_repulsion(state[0], state[1])]

    def detect_parting(_: float, state: FloatArray) -> float:
        overlap = float(state[0])
        return overlap if may_pull else min(overlap, find_repulsion(overlap, float(state[1])))

    def detect_turning(_: float, state: FloatArray) -> float:
        return float(state[1])

    detect_parting.terminal, detect_parting.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        find_rate, (0.0, 1e3), [0.0, 1.0], method="DOP853", events=(detect_parting, detect_turning),
        rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    overlap_max = float(solution.y_events[1][0][0])
    end_time, end_velocity = float(solution.t_events[0][0]), float(solution.y_events[0][0][1])
    return Collision(-end_velocity, overlap_max * free.overlap_max, end_time * unit_time)
