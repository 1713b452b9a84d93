"""Energies of a simulation now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qdem_fem.element import displacement_gradient, elastic_energy
from qdem_fem.march.leapfrog import find_half_work, find_velocity, find_viscous_half
from qdem_fem.march.state import State

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Energy:
    """Energies at a time [J]."""

    kinetic: float
    elastic: float
    external: float
    """Work of loads, gravity and prescribed motion since the start.

    What it takes to hold a node that a user's state had moved away is not counted."""
    contact: float = 0.0
    """In the springs of contacts."""
    friction: float = 0.0
    """Work that sliders of contacts took since the start."""
    viscous: float = 0.0
    """What viscosity took since the start."""
    absorbed: float = 0.0
    """What dashpots of absorbing faces took since the start."""
    foundation: float = 0.0
    """In the springs of absorbing faces."""


def find_energy(run: State) -> Energy:
    """Energies now [J]; elastic energy as `qdem_fem.element.elastic_energy`."""
    velocity, motion = find_velocity(run), run.motion
    kinetic = 0.5 * float((run.assembly.mass * (velocity**2).sum(axis=1)).sum())
    if run.rigid is not None:
        kinetic += run.rigid.kinetic(run.rigid.now(run.acting()))
    elastic = sum(
        elastic_energy(
            displacement_gradient(body.gradients[0], body.elements, body.displacement),
            body.gradients[1], body.material.lame_first, body.material.lame_second, run.strain,
        ).sum()
        for body in run.bodies
        if not body.rigid
    )  # fmt: skip
    external, viscous = float(motion.work[:2].sum()) + motion.gravity_work, float(motion.work[2])
    if motion.behind:
        external += float(find_half_work(run, run.assembly.field("velocity"), velocity).sum())
        viscous += find_viscous_half(run)
        if run.rigid is not None:
            external += float(run.rigid.find_half_work(run.acting()).sum())
    touching = (0.0, 0.0) if run.contacts is None else run.contacts.energy()
    ground = find_ground_energies(run, velocity)
    return Energy(kinetic, float(elastic), external, *touching, viscous, *ground)


def find_ground_energies(run: State, velocity: Floats) -> tuple[float, float]:
    """Taken by absorbing faces, and in their springs [J]; ``velocity`` (n, 3) [m/s]: of now."""
    if run.absorbers is None:
        return 0.0, 0.0
    absorbed = run.motion.absorbed
    if run.motion.behind:
        absorbed += run.absorbers.find_half_taken(
            run.assembly.field("velocity"), velocity, run.step
        )
    return absorbed, run.absorbers.spring_energy(run.assembly.field("displacement"))
