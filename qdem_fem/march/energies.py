"""Energies of a simulation now, and what its meshes make of its motion."""

from dataclasses import dataclass

import numpy as np

from qdem_fem.bodies import Body, Discretisation, estimate_discretisation
from qdem_fem.files import Floats
from qdem_fem.march.leapfrog import find_half_work, find_velocity, find_viscous_half
from qdem_fem.march.state import State


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


def find_energy(run: State) -> Energy:
    """Energies now [J]; elastic energy as `qdem_fem.Body.elastic_energy`."""
    velocity, motion = find_velocity(run), run.motion
    kinetic = 0.5 * float((run.assembly.mass * (velocity**2).sum(axis=1)).sum())
    if run.rigid is not None:
        kinetic += run.rigid.kinetic_energy(run.rigid.find_motion(run.find_acting()))
    elastic = sum(
        body.elastic_energy(body.displacement, run.strain).sum()
        for body in run.bodies
        if not body.rigid
    )
    external, viscous = float(motion.work[:2].sum()) + motion.gravity_work, float(motion.work[2])
    if motion.behind:
        external += float(find_half_work(run, run.assembly.field("velocity"), velocity).sum())
        viscous += find_viscous_half(run)
        if run.rigid is not None:
            external += float(run.rigid.find_half_work(run.find_acting()).sum())
    touching = (0.0, 0.0) if run.contacts is None else run.contacts.energy()
    return Energy(kinetic, float(elastic), external, *touching, viscous)


def estimate_errors(run: State, displacement: Floats | None = None) -> Discretisation | None:
    """What the meshes make of a displacement (n, 3) [m] of all nodes, by default that of now."""
    moved = run.assembly.field("displacement") if displacement is None else displacement
    return estimate_discretisation(split_motion(run, moved), run.strain)


def split_motion(run: State, moved: Floats) -> list[tuple[Body, Floats, bool]]:
    """Each body, its part of a displacement (n, 3) [m], and whether nothing holds it."""
    tied = run.master != np.arange(len(run.master))
    for nodes in (one.nodes for one in run.conditions.held + run.conditions.rollers):
        tied[nodes] = True
    ends = run.first_node[1:-1]
    parts = zip(run.bodies, np.split(moved, ends), np.split(tied, ends), strict=True)
    return [(body, u, not bool(own.any())) for body, u, own in parts]
