"""``contacts.dump`` with every engine's columns, from what LAMMPS can dump of its contacts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from adapters import contact_law
from adapters.dump import Frame, dump_frames, dump_write
from adapters.scene import Scene
from adapters.state import FloatArray, IntArray

COLUMNS = tuple(f"c_contact[{i}]" for i in range(1, 13))
"""Pair, normal and tangential force on the first grain, tangential spring, overlap."""


def contacts_write(scene: Scene, folder: Path) -> None:
    """Write ``contacts.dump`` from ``pairs.dump`` and ``states.dump``, and remove the first.

    Raises `DumpError` when one of the two is malformed.
    """
    dump_write(folder / "contacts.dump", _contact_frames(scene, folder))
    (folder / "pairs.dump").unlink()


def _contact_frames(scene: Scene, folder: Path) -> Iterator[Frame]:
    states = dump_frames(folder / "states.dump")
    for pairs, grains in zip(dump_frames(folder / "pairs.dump"), states, strict=True):
        values = contact_values(scene, pairs.values, grains)
        columns = COLUMNS if values.shape[1] == len(COLUMNS) else COLUMNS[:6]
        yield Frame(pairs.time_step, columns, values, pairs.bounds, "entries", pairs.boundary)


def contact_values(scene: Scene, pairs: FloatArray, grains: Frame) -> FloatArray:
    """Rows of `COLUMNS`, shape (m, 12); without friction pair, normal force, overlap, (m, 6).

    ``pairs``, shape (m, 9) or (m, 6): identifiers, normal force and, with friction, tangential
    force on the first grain [N], distance of the centres [m]; ``grains`` of the same instant.
    """
    held = np.searchsorted(grains.column("id"), pairs[:, :2])
    radius = grains.column("radius")[held]
    overlap = radius.sum(axis=1) - pairs[:, -1]
    if pairs.shape[1] == 6:
        return np.column_stack([pairs[:, :5], overlap])
    spring = elastic_displacement(scene, pairs[:, 5:8], overlap, grains, held)
    return np.column_stack([pairs[:, :8], spring, overlap])


def elastic_displacement(
    scene: Scene, force: FloatArray, overlap: FloatArray, grains: Frame, held: IntArray
) -> FloatArray:
    """Displacement delta_t that carries the elastic part of F_t = -k_t delta_t - c_t v_t [m].

    ``force`` F_t on the first grain [N], shape (m, 3); ``overlap`` [m]; ``held`` rows of the two
    grains, shape (m, 2).  LAMMPS keeps a force, or a displacement, and shows neither.
    """
    grain = scene.material.grain
    shear = contact_law.equivalent_shear_modulus(
        grain.young, grain.poisson, grain.young, grain.poisson
    )
    radius, mass = grains.column("radius")[held], grains.column("mass")[held]
    reduced = radius.prod(axis=1) / radius.sum(axis=1)
    stiffness = contact_law.tangential_stiffness(overlap, shear, reduced)
    alpha = contact_law.alpha_of_restitution(scene.restitution)
    reduced_mass = mass.prod(axis=1) / mass.sum(axis=1)
    damping = 2 * contact_law.DAMPING_FACTOR * alpha * np.sqrt(reduced_mass * stiffness)
    position, velocity = grains.block("x", "y", "z")[held], grains.block("vx", "vy", "vz")[held]
    spin = grains.block("omegax", "omegay", "omegaz")[held]
    normal = position[:, 0] - position[:, 1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    approach = velocity[:, 0] - velocity[:, 1]
    sliding = approach - np.einsum("ma,ma->m", approach, normal)[:, None] * normal
    sliding -= np.cross(np.einsum("mi,mia->ma", radius, spin), normal)
    return -(force + damping[:, None] * sliding) / stiffness[:, None]
