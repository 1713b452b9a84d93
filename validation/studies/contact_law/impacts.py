"""The impacts of a setting placed side by side, run on an engine, and what is left of each."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from adapters.bed import contact_law
from adapters.bed.state import FloatArray
from adapters.scene.tables import Scene
from validation.bench.few_grains import load_table_1
from validation.studies.contact_law.engine_runs import Motion, Start, choose_restitution, choose_run
from validation.studies.contact_law.settings import RIGID, STEPS, Setting

GAP_STEPS = 2.25
"""Steps before the first contact begins; impacts side by side begin at other parts of a step."""

RUN_CONTACTS = 2.5
"""Length of a run in contact times of the slowest impact."""


@dataclass(frozen=True)
class Pair:
    """What Hertz' theory needs to know of a setting."""

    modulus: float
    """E* [Pa]."""
    shear: float
    """G* [Pa]."""
    radius: float
    """R* [m]."""
    mass: float
    """m* [kg]."""


def find_pair(setting: Setting) -> Pair:
    """E*, G*, R* and m*; a plane has neither compliance nor curvature, and infinite mass."""
    grain = (setting.material.young, setting.material.poisson)
    mass = 4 / 3 * pi * setting.radius**3 * setting.material.density
    if setting.partner_radius is None:
        wall = (RIGID * grain[0], grain[1])
        radius, effective = setting.radius, mass
    else:
        wall = grain
        radius = 1 / (1 / setting.radius + 1 / setting.partner_radius)
        ratio = (setting.partner_radius / setting.radius) ** 3 * setting.partner_mass_factor
        effective = 1 / (1 / mass + 1 / (ratio * mass))
    return Pair(
        contact_law.combine_moduli(*grain, *wall),
        contact_law.combine_shear_moduli(*grain, *wall),
        radius,
        effective,
    )


def make_scene(setting: Setting, restitution: float) -> Scene:
    """A scene of the project with the setting's material, wide enough for all impacts."""
    m, r = setting.material, setting.radius
    room = 5 * _find_pitch(setting) * (len(setting.impacts) + 2)
    return load_table_1(
        f"material.grain.young={m.young!r}",
        f"material.grain.poisson={m.poisson!r}",
        f"material.grain.density={m.density!r}",
        f"material.grain.restitution={restitution!r}",
        f"material.grain.friction={setting.friction!r}",
        f"material.wall.young={RIGID * m.young!r}",
        f"material.wall.poisson={m.poisson!r}",
        f"material.wall.friction={setting.friction!r}",
        f"sample.radius={room!r}",
        "sample.count=50",
        f"sample.grain_radius.mean={r!r}",
        f"sample.grain_radius.standard_deviation={0.01 * r!r}",
    )


def _find_pitch(setting: Setting) -> float:
    return 4 * max(setting.radius, setting.partner_radius or 0.0)


def choose_time_step(setting: Setting, steps: int = STEPS) -> tuple[float, int]:
    """Time step [s], ``steps`` in the shortest contact, and steps until all contacts have ended."""
    pair = find_pair(setting)
    speeds = [impact.normal for impact in setting.impacts]
    times = [
        contact_law.solve_hertz_collision(v, pair.modulus, pair.radius, pair.mass).contact_time
        for v in (max(speeds), min(speeds))
    ]
    return times[0] / steps, round(RUN_CONTACTS * times[1] / times[0] * steps)


def place_grains(setting: Setting, time_step: float) -> Start:
    """Grains above their planes or partners; the normal is z, the tangent x, the spin about y.

    Spin of an `Impact` is negative about y, so that it slides as a positive velocity does.
    """
    rows: list[tuple[float, float, float, float, float, float, float]] = []
    pitch = _find_pitch(setting)
    for number, impact in enumerate(setting.impacts, 1):
        steps = GAP_STEPS + (number - 1) / len(setting.impacts)
        gap = steps * impact.normal * time_step
        y, spin = number * pitch, -impact.spin
        share = 0.5 if setting.partner_spins else 1.0
        height = setting.radius + gap
        if setting.partner_radius is not None:
            r = setting.partner_radius
            height += 2 * pitch + r
            spin_2 = spin if setting.partner_spins else 0.0
            back = 1.0 - share
            lower = (r, y, 2 * pitch, -back * impact.tangential, back * impact.normal, spin_2)
            rows.append((*lower, setting.partner_mass_factor))
        upper = (setting.radius, y, height, share * impact.tangential, -share * impact.normal)
        rows.append((*upper, spin, 1.0))
    radius, y, z, along, normal, spins, factor = np.array(rows).T
    zero = np.zeros(len(rows))
    return Start(
        radius,
        np.column_stack([zero + pitch, y, z]),
        np.column_stack([along, zero, normal]),
        np.column_stack([zero, spins, zero]),
        factor,
    )


def run_impacts(
    setting: Setting, engine: str, law: str = "scene", *, steps: int = STEPS, every: int = 0
) -> Motion:
    """Run all impacts of a setting on an engine, under a law of `engine_runs.LAWS`.

    ``steps`` in the shortest contact; ``every`` steps between instants, 0 for the two ends only.
    """
    time_step, count = choose_time_step(setting, steps)
    start = place_grains(setting, time_step)
    scene = make_scene(setting, choose_restitution(engine, law, setting.restitution))
    return choose_run(engine, law)(scene, start, time_step, count, every or count)


@dataclass(frozen=True)
class Rebound:
    """What is left of the ``n`` impacts of a setting; arrays of shape (n,)."""

    restitution: FloatArray
    """Normal speed of separation over that of approach."""
    slip_before: FloatArray
    """Tangential velocity of the contact point over V_n."""
    slip_after: FloatArray
    """The same afterwards, over the same V_n."""
    friction_impulse: FloatArray
    """Tangential impulse over m* V_n."""
    spin_gained: FloatArray
    """R/V_n times the spin that the (upper) grain gained, as a share of m*/m."""
    momentum_error: float
    """Momentum that two grains lost or gained over the greatest of one; 0 for planes."""


def measure_rebound(setting: Setting, motion: Motion) -> Rebound:
    """Restitution, slip, friction impulse, spin of each impact, from the first and last frame."""
    pair, start = find_pair(setting), motion.velocity[0]
    mass = 4 / 3 * pi * setting.radius**3 * setting.material.density
    normal = np.array([impact.normal for impact in setting.impacts])
    velocity, spin = motion.velocity[[0, -1]], motion.spin[[0, -1], :, 1]
    if setting.partner_radius is None:
        relative, surface, drift = velocity, -setting.radius * spin, 0.0
        upper_velocity, upper_spin = velocity, spin
    else:
        ratio = (setting.partner_radius / setting.radius) ** 3 * setting.partner_mass_factor
        lower, upper_velocity, upper_spin = velocity[:, ::2], velocity[:, 1::2], spin[:, 1::2]
        relative = upper_velocity - lower
        surface = -setting.radius * upper_spin - setting.partner_radius * spin[:, ::2]
        change = (upper_velocity + ratio * lower)[1] - (upper_velocity + ratio * lower)[0]
        drift = float(np.abs(change).max() / np.abs(start).max())
    slip = (relative[:, :, 0] + surface) / normal
    impulse = (upper_velocity[0] - upper_velocity[1])[:, 0] * mass / (pair.mass * normal)
    gained = (upper_spin[1] - upper_spin[0]) * setting.radius * mass / (pair.mass * normal)
    return Rebound(relative[1, :, 2] / normal, slip[0], slip[1], impulse, gained, drift)
