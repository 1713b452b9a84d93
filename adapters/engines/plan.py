"""How long a bed settles and how a piston is seated: the same on every engine."""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from adapters.bed import GRAVITY, contact_law
from adapters.scene import Scene


@dataclass(frozen=True)
class PlanNumbers:
    """When a bed counts as settled, how it is tapped, and how a piston finds it."""

    equilibrium_ratio: float = 1e-6  # translational kinetic over potential energy [-]; section 2.3
    settle_times: int = 40  # falling times after which a bed that still moves is given up [-]
    tap_fall: float = 0.3
    """By which a tap drops the bed, in mean diameters: 0.1 takes more taps, 1 at times loosens."""

    taps_most: int = 100  # after which a porosity that is not reached is given up
    porosity_step: float = 0.005  # by which a bed may be denser than asked [-]
    seat_speed: float = 0.1  # greatest one of the piston while it finds the bed [m/s]
    seat_share: float = 1.0  # force that seats the piston, over the peak of the load [-]
    seat_drag_share: float = 0.5
    """Greatest drag of the seating times the time step over the piston's mass [-]: an explicit step
    turns a drag above 2 into growing oscillations, and one above 1 into oscillations."""


PLAN = PlanNumbers()


@dataclass(frozen=True)
class SettlePlan:
    """Time steps of the rain of grains."""

    check_steps: int
    """Between two looks at the energies; load cycles then start at multiples of their length."""
    check_limit: int  # looks after which a bed that still moves is given up
    minimum_steps: int  # before the first look that counts: at the start nothing moves yet
    history_steps: int  # between two rows of ``history.txt``


@dataclass(frozen=True)
class SeatPlan:
    """How the piston is pressed on the bed and let go before the first cycle."""

    force: float  # that presses [N], held up by a viscous drag of force over speed
    speed: float  # greatest speed [m/s]
    steps: int
    release_force: float  # that of the load's first instant [N]
    release_steps: int


def count_cycle_steps(scene: Scene) -> int:
    """Time steps of a load cycle; those of 0.02 s in a scene without a load."""
    return scene.steps_per_cycle or ceil(0.02 / scene.time_step)


def plan_settling(scene: Scene, height: float) -> SettlePlan:
    """Plan of the rain of grains from below ``height`` [m]."""
    fall_steps = sqrt(2 * height / GRAVITY) / scene.time_step
    # Cycles start at multiples of steps_per_cycle, so that the load's phase is the step's.
    cycle = count_cycle_steps(scene)
    check_steps = cycle * ceil(0.01 / (cycle * scene.time_step))
    return SettlePlan(
        check_steps,
        ceil(PLAN.settle_times * fall_steps / check_steps),
        ceil(1.2 * fall_steps),
        max(check_steps // 4, 1),
    )


def plan_seating(scene: Scene) -> SeatPlan:
    """Plan of the seating of the piston, in whole cycles.

    A piston that is light for its load is pressed by less than the peak, so that its drag, force
    over speed, is one that the time step can follow.
    """
    assert scene.loading is not None
    steps = scene.steps_per_cycle
    peak = float(scene.stress_at(np.linspace(0, 1, 1001)).max()) * scene.loaded_area
    followed = PLAN.seat_drag_share * scene.loading.piston_mass * PLAN.seat_speed / scene.time_step
    press_s = 2 * scene.sample.radii.greatest / PLAN.seat_speed
    cycles = ceil(press_s / (steps * scene.time_step))
    return SeatPlan(
        min(PLAN.seat_share * peak, followed), PLAN.seat_speed, cycles * steps,
        float(scene.stress_at(0.0)) * scene.loaded_area, ceil(cycles / 2) * steps,
    )  # fmt: skip


def has_rolling(scene: Scene) -> bool:
    """Whether the scene names any resistance to rolling."""
    return bool(scene.material.grain.rolling_friction or scene.material.wall.rolling_friction)


def find_rolling_stiffness(scene: Scene) -> float:
    """Spring of rolling for engines where it is constant [N/m]; times R*^2 the torque a radian.

    The tangential one, as in Iwashita and Oda (1998), of two mean grains that carry the bed's
    weight on the square (2 r)^2 that each fills.
    """
    grain, radii = scene.material.grain, scene.sample.radii
    stress = GRAVITY * scene.grain_count * radii.volume_mean * grain.density / scene.container.area
    force = stress * (2 * radii.mean) ** 2
    overlap = contact_law.find_overlap_under_force(force, scene.stiffness.grain, radii.mean / 2)
    shear = contact_law.combine_shear_moduli(*2 * (grain.young, grain.poisson))
    return float(contact_law.find_tangential_stiffness(overlap, shear, radii.mean / 2))


def has_friction(scene: Scene) -> bool:
    """Whether the scene names any friction: without it no contact has a tangential force."""
    return scene.material.grain.friction > 0 or scene.material.wall.friction > 0
