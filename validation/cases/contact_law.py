"""What LIGGGHTS makes of eqs 5 to 7: collisions, a driven contact, mirror planes, a bed.

docs/contact-law.md explains the figures.  Contacts are those of Table 1 (radius 3.2 mm), driven
under the project's own decks; the beds are those of `validation.contact_law_in_bed`.
"""

from __future__ import annotations

import os
import tempfile
from math import inf, sqrt
from pathlib import Path

import numpy as np

from adapters import contact_law as law
from adapters.scene import Scene
from adapters.state import FloatArray
from validation.case import Check
from validation.contact_law_in_bed import settlements, spring_energy
from validation.few_grains import (
    RADIUS,
    driven_contact,
    grain_mass,
    head_on,
    limit_force,
    mirror_slide,
    mirror_tangential,
    shear_modulus,
    table_1,
)
from validation.tangential_rules import (
    LOOPS,
    force_incremental,
    force_mindlin_deresiewicz,
    force_rescaled,
    force_secant,
    path,
    work,
)

SPEED = 0.1
"""Speed at which two grains meet [m/s]."""

BEDS = {True: (1, 2, 4), False: (2, 4, 11)}
"""Quick or not: beds, runs of each for either damping, load cycles of a run."""

LOOPS_DONE = 30
"""Loops of a driven contact after which each is as the one before, under every rule."""


def run(quick: bool) -> list[Check]:
    """All checks; the beds are kept in the folder TRACKBED_VALIDATION, where that is set."""
    checks = [*collision_checks(), *tangent_checks(), *loop_checks(), *mirror_checks()]
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(os.environ.get("TRACKBED_VALIDATION", temporary)) / "contact-law"
        return [*checks, *bed_checks(home, *BEDS[quick])]


def measured(name: str, value: float, unit: str = "") -> Check:
    """A figure for the record, without a bar of its own."""
    return Check(name, value, "finite", True, unit)


def close(name: str, value: float, expected: float, share: float, unit: str = "") -> Check:
    """A figure within a ``share`` of what is expected."""
    bar = f"{expected:.5g} within {share:g}"
    return Check(name, value, bar, abs(value / expected - 1) <= share, unit)


def collision_checks() -> list[Check]:
    """Rebound of two grains: the paper's alpha, a literal eq. 7, no tension, the own time step."""
    scene = table_1()
    alpha = scene.material.grain.viscous_alpha
    assert alpha is not None
    ratio = law.DAMPING_FACTOR * alpha
    mass = law.effective_mass(grain_mass(scene), grain_mass(scene))
    contact = (SPEED, scene.stiffness.grain, RADIUS / 2, mass)
    hit, _ = head_on(scene, SPEED)
    expected = law.collision(*contact, ratio)
    literal = table_1(f"material.grain.restitution={law.restitution_literal(alpha)!r}")
    limited, _ = head_on(scene, SPEED, materials=limit_force)
    without_tension = law.collision(*contact, ratio, may_pull=False).restitution
    coarse, _ = head_on(scene, SPEED, steps=steps_of_contact(scene))
    return [
        close("restitution, alpha 0.44", hit.restitution, expected.restitution, 0.01),
        close("greatest overlap, alpha 0.44", hit.overlap_max, expected.overlap_max, 0.01, "m"),
        close("contact time, alpha 0.44", hit.contact_time, expected.contact_time, 0.01, "s"),
        close(
            "restitution, literal eq. 7 of alpha 0.44 (e = 0.1776 handed over)",
            head_on(literal, SPEED)[0].restitution,
            law.collision(*contact, alpha).restitution,
            0.01,
        ),
        close(
            "restitution, alpha 0.44, limitForce on (not used)",
            limited.restitution,
            without_tension,
            0.01,
        ),
        measured(
            "restitution, alpha 0.44, at the time step of karrech.toml, over that above",
            coarse.restitution / hit.restitution,
        ),
    ]


def steps_of_contact(scene: Scene) -> float:
    """Time steps of the scene in an undamped contact."""
    mass = law.effective_mass(grain_mass(scene), grain_mass(scene))
    undamped = law.hertz_collision(SPEED, scene.stiffness.grain, RADIUS / 2, mass)
    return undamped.contact_time / scene.time_step


def tangent_checks() -> list[Check]:
    """A contact under 1 N sheared until it slides: viscous force while it sticks, and after."""
    scene = table_1()
    alpha, friction = scene.material.grain.viscous_alpha, scene.material.grain.friction
    assert alpha is not None
    overlap = float(law.overlap_under_force(1.0, scene.stiffness.grain, RADIUS / 2))
    stiffness = float(law.tangential_stiffness(overlap, shear_modulus(scene), RADIUS / 2))
    mass = law.effective_mass(grain_mass(scene), grain_mass(scene))
    damping = 2 * law.DAMPING_FACTOR * alpha * sqrt(mass * stiffness)
    slip, speed = friction / stiffness, 0.01
    track, _, moved = driven_contact(
        scene, np.array([overlap] * 2), np.array([0.0, 4 * slip]), speed=speed
    )
    force = np.abs(track.force[:, 0, 1])
    sticks = (moved > 0.1 * slip) & (moved < 0.8 * slip)
    slides = moved > 1.5 * slip
    viscous = (force[sticks] - stiffness * moved[sticks]) / speed
    dumped = np.array([np.linalg.norm(c.tangential_force[0]) for c in track.contacts])
    return [
        close("tangential damping while a contact sticks", viscous.mean(), damping, 0.01, "N s/m"),
        close(
            "tangential over normal force of a sliding contact",
            force[slides].mean(),
            friction,
            0.01,
        ),
        measured("the same, had it the viscous term of eq. 7", friction + damping * speed),
        measured("the same as compute pair/gran/local prints it, greatest", dumped[slides].max()),
    ]


def loop_checks() -> list[Check]:
    """Closed paths of a contact below sliding: energy that each rule loses, if negative creates.

    Between 0.25 N and 1 N, sheared to half of mu 0.25 N; in units of (k_t1 - k_t0) delta_t^2/2.
    LIGGGHTS' first loop, which is as any other; of the other rules the last of `LOOPS_DONE`.
    """
    scene = table_1("material.grain.restitution=1.0")
    modulus, shear, radius = scene.stiffness.grain, shear_modulus(scene), RADIUS / 2
    friction = scene.material.grain.friction
    low, high = law.overlap_under_force(np.array([0.25, 1.0]), modulus, radius)
    k0, k1 = law.tangential_stiffness(np.array([low, high]), shear, radius)
    displacement = 0.5 * friction * 0.25 / k0
    unit = (k1 - k0) * displacement**2 / 2
    checks = []
    for name, loop in LOOPS.items():
        corners = [low, 0.0] + loop * [high - low, displacement]
        track, _, _ = driven_contact(scene, *corners.T)
        moves = np.diff(track.position[:, 0], axis=0)
        mean_force = (track.force[1:, 0] + track.force[:-1, 0]) / 2
        engine = -float(np.sum(mean_force * moves)) / unit
        one = path(corners, 100)
        overlap, slip = np.concatenate([one[:1], *[one[1:]] * LOOPS_DONE]).T
        stiffness = law.tangential_stiffness(overlap, shear, radius)
        last = slice(-len(one), None)

        def lost(force: FloatArray, slip: FloatArray = slip, last: slice = last) -> float:
            return work(force[last], slip[last]) / unit

        expected = lost(force_secant(stiffness, slip))
        bar = f"{expected:.2f} within 0.01"
        checks.append(Check(f"{name}: LIGGGHTS", engine, bar, abs(engine - expected) <= 0.01))
        real = [
            force_mindlin_deresiewicz(overlap, slip, modulus, shear, radius, mu)
            for mu in (inf, friction)
        ]
        checks += [
            measured(f"{name}: paper's rule", lost(force_rescaled(stiffness, slip))),
            measured(f"{name}: increments, no rule", lost(force_incremental(stiffness, slip))),
            measured(f"{name}: Mindlin-Deresiewicz, no micro-slip", lost(real[0])),
            measured(f"{name}: Mindlin-Deresiewicz, friction 0.5", lost(real[1])),
        ]
    return checks


def mirror_checks() -> list[Check]:
    """A grain on a mirror plane against two that mirror each other, and sliding along it."""
    scene = table_1()
    pair, _ = head_on(scene, SPEED)
    mirrored, _ = head_on(scene, SPEED, mirror=True)
    kept, braked = (
        mirror_slide(scene, SPEED, 3, materials).velocity[-1, 0, 2] / SPEED
        for materials in (str, mirror_tangential)
    )
    return [
        close("mirror: restitution", mirrored.restitution, pair.restitution, 1e-3),
        close("mirror: contact time", mirrored.contact_time, pair.contact_time, 1e-3, "s"),
        Check(
            "mirror: share of its speed a sliding grain keeps, 3 runs", kept, "1 exactly", kept == 1
        ),
        measured(
            "mirror with a tangential law at friction 0 (not used): speed kept, 3 runs", braked
        ),
    ]


def bed_checks(home: Path, beds: int, members: int, cycles: int) -> list[Check]:
    """Settlement under either damping, and the springs' energy in a cycle of the first bed."""
    runs = []
    for seed in range(1, beds + 1):
        folder = home / f"bed_{seed}"
        folder.mkdir(parents=True, exist_ok=True)
        runs.append(settlements(folder, seed, members, cycles))
    settled = np.array(runs)  # bed, damping, member
    mean = settled.mean(axis=(0, 2))
    scatter = settled.std(axis=2, ddof=1)
    error = float(np.sqrt((scatter**2 / members).sum())) / beds
    energy = spring_energy(home / "bed_1", 1, cycles, every=20)
    span = f"settlement of cycles 2 to {cycles}, {beds} bed(s), {members} twins"
    return [
        measured(f"{span}: e = 0.2145", mean[0], "m"),
        measured(f"{span}: scatter of twins, root mean square", np.sqrt((scatter**2).mean()), "m"),
        measured(f"{span}: e = 0.1776 less e = 0.2145", mean[1] - mean[0], "m"),
        measured(f"{span}: standard error of that", error, "m"),
        measured("energy created by k_t growing, over the piston's work", energy.created_share),
        measured("energy lost by k_t falling, over the piston's work", energy.lost_share),
    ]
