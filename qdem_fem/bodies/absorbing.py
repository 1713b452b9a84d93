"""Faces that absorb waves: dashpots of the ground that was cut away, and its springs.

Lysmer and Kuhlemeyer (J. Eng. Mech. Div. ASCE 95 (1969) 859) put on a face of unit normal n

    t = -rho c_p v_n n - rho c_s v_t,      c_p = sqrt((lambda + 2 mu)/rho),  c_s = sqrt(mu/rho),

which is what a half-space of the same material behind it would do to a plane wave along n: none
comes back.  At other angles some does.  Lumped, a node takes a third
of each face: a 3 x 3 matrix C.

A half-space has no stiffness against a uniform load: with dashpots alone, a body under a lasting
force F creeps at ``F/(rho c_p A)``.  With a ``depth`` H the ground that was cut away is a layer on
rigid ground instead; for slow loads that is a spring of ``(lambda + 2 mu)/H`` along n and
``mu/H`` across, per area, beside the dashpot.  It sends back ``1/sqrt(1 + (2 omega H/c)^2)`` of a
wave's amplitude: what is faster than ``c/2H`` is absorbed, what is slower feels the layer.

In time, the dashpots act on the mean velocity of a step, ``(M + dt/2 C) v+ = (M - dt/2 C) v- +
dt f``, which is solved node by node.  Then, with ``E = 1/2 v M v + 1/2 u(k) K u(k+1)``, a step
changes E by ``-dt vm C vm`` exactly: the dashpots leave the critical step as it is, and what they
took closes the account of energies.  The springs are forces as others and shorten it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies.absorbing_step import Absorber
from qdem_fem.bodies.assembly import Assembly
from qdem_fem.bodies.conditions import Absorbing
from qdem_fem.bodies.deformable import Body
from qdem_fem.kernel.cpu import Constraints
from qdem_fem.mesh import face_area_vectors

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

NOTHING = 1e-12
"""Share of a node's greatest coefficient below which a direction has none."""


def face_elements(elements: Integers, faces: Integers) -> Integers:
    """The element behind each face (k, 3) of a surface, (k,)."""
    wanted = {tuple(sorted(face)): k for k, face in enumerate(faces.tolist())}
    found = np.full(len(faces), -1)
    near = np.flatnonzero(np.isin(elements, faces).sum(axis=1) >= 3)
    for element, nodes in zip(near.tolist(), np.sort(elements[near], axis=1).tolist(), strict=True):
        for left in range(4):
            k = wanted.get(tuple(nodes[:left] + nodes[left + 1 :]))
            if k is not None:
                found[k] = element
    return found


def face_tensors(body: Body, faces: Integers, depth: float | None) -> tuple[Floats, Floats]:
    """C [N s/m] and K [N/m] of the ground behind outward ``faces`` (k, 3), by node, (n, 3, 3)."""
    area = face_area_vectors(body.nodes, faces)
    size = np.linalg.norm(area, axis=1)
    along = np.einsum("k,ki,kj->kij", 1 / size, area, area)
    across = size[:, None, None] * np.eye(3) - along
    element, material = face_elements(body.elements, faces), body.material
    shear = np.asarray(material.lame_second)[element]
    pressure = np.asarray(material.lame_first)[element] + 2 * shear
    density = np.asarray(material.density)[element]

    def lumped(normal: Floats, tangential: Floats) -> Floats:
        each = normal[:, None, None] * along + tangential[:, None, None] * across
        total = np.zeros((len(body.nodes), 3, 3))
        for corner in faces.T:
            np.add.at(total, corner, each / 3)
        return total

    damping = lumped(np.sqrt(density * pressure), np.sqrt(density * shear))
    if depth is None:
        return damping, np.zeros_like(damping)
    return damping, lumped(pressure / depth, shear / depth)


def directions(tensor: Floats, free: Floats) -> tuple[Integers, Floats, Floats]:
    """Row, unit direction (d, 3) and coefficient (d,) of ``tensor`` (k, 3, 3) where it is free.

    ``free`` (k, 3, 3): projections onto what is not held.
    """
    values, vectors = np.linalg.eigh(free @ tensor @ free)
    row, which = np.nonzero(values > NOTHING * values.max(axis=1, initial=0.0)[:, None])
    return row, np.ascontiguousarray(vectors[row, :, which]), values[row, which]


class Absorbers:
    """Dashpots and springs at the nodes of absorbing faces."""

    def __init__(
        self, assembly: Assembly, held: Constraints, absorbing: Sequence[Absorbing]
    ) -> None:
        self.assembly = assembly
        total = np.zeros((2, assembly.n_nodes, 3, 3))
        for condition in absorbing:
            place = assembly.place[condition.nodes]
            np.add.at(total[0], place, condition.damping)
            np.add.at(total[1], place, condition.stiffness)
        place = np.flatnonzero(total[0].any(axis=(1, 2)))
        free = np.tile(np.eye(3), (assembly.n_nodes, 1, 1))
        free[held.node_at // 4, held.node_at % 4, held.node_at % 4] = 0.0
        for at, normal in zip(held.roller_at // 4, held.roller_normal, strict=True):
            free[at] -= np.outer(normal, normal)
        row, direction, damping = directions(total[0][place], free[place])
        other, spring, stiffness = directions(total[1][place], free[place])
        window = assembly.packed.node_window
        self.kernel = Absorber(
            4 * place[row], direction, damping, np.zeros(len(row)),
            4 * place[other], 4 * place[other] + window[place[other]], spring, stiffness,
            np.zeros(1),
        )  # fmt: skip

    def _along(self, field: Floats, at: Integers, direction: Floats) -> Floats:
        """Components along the directions of a field (n, 3)."""
        flat = np.zeros((self.assembly.n_nodes, 3))
        flat[self.assembly.place] = field
        return np.asarray(np.einsum("dc,dc->d", flat[at // 4], direction))

    def _field(self, values: Floats, at: Integers, direction: Floats) -> Floats:
        """Values along the directions as a field (n, 3)."""
        flat = np.zeros((self.assembly.n_nodes, 3))
        np.add.at(flat, at // 4, values[:, None] * direction)
        return np.asarray(flat[self.assembly.place])

    def _rate(self, at: Integers, coefficient: Floats) -> Floats:
        inverse = np.asarray(self.assembly.state.inverse_mass, dtype=float)
        return coefficient * inverse[at // 4]

    def spring_accelerations(self, displacement: Floats) -> Floats:
        """What the springs make of the nodes [m/s^2], (n, 3)."""
        a = self.kernel
        pull = self._along(displacement, a.spring_at, a.spring_direction)
        rate = self._rate(a.spring_at, a.stiffness)
        return -self._field(rate * pull, a.spring_at, a.spring_direction)

    def spring_energy(self, displacement: Floats) -> float:
        """Energy in the springs [J]."""
        a = self.kernel
        stretch = self._along(displacement, a.spring_at, a.spring_direction)
        return 0.5 * float((a.stiffness * stretch**2).sum())

    def slowed(self, velocity: Floats, step: float) -> Floats:
        """Velocity now, of what half a ``step`` [s] without dashpots would make it (n, 3) [m/s]."""
        a = self.kernel
        half = 0.5 * step * self._rate(a.at, a.damping)
        lost = half / (1 + half) * self._along(velocity, a.at, a.direction)
        return velocity - self._field(lost, a.at, a.direction)

    def decelerations(self, velocity: Floats) -> Floats:
        """What the dashpots take from the nodes at a velocity now (n, 3) [m/s^2]."""
        a = self.kernel
        speed = self._along(velocity, a.at, a.direction)
        return self._field(self._rate(a.at, a.damping) * speed, a.at, a.direction)

    def find_half_taken(self, behind: Floats, level: Floats, step: float) -> float:
        """Energy that the dashpots take in the half of a ``step`` [s] up to now [J]."""
        a = self.kernel
        before, now = (self._along(v, a.at, a.direction) for v in (behind, level))
        return 0.25 * step * float((a.damping * now * (before + now)).sum())
