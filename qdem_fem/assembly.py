"""All bodies of a simulation in the kernel's arrays, and the state that moves in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from numpy.typing import DTypeLike, NDArray

from qdem_fem import kernel
from qdem_fem.body import Body
from qdem_fem.conditions import Conditions
from qdem_fem.layout import aligned_zeros, layout_build
from qdem_fem.reference_forces import Strain

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

THREAD_ELEMENTS = 16_384
"""Fewer elements than this for each thread lose more at barriers than they gain."""

NO_LOADS = kernel.Loads(*(np.zeros(0, np.int64),) * 3, np.zeros(0))
NO_PROBES = kernel.Probes(np.zeros(0, np.int64), np.zeros((0, 0, 3)), 1, 1)


class Assembly:
    """Bodies side by side; numbers of nodes and elements run through all of them.

    ``master`` (n,): the node that a node moves with, itself unless periodic; ``density_factor``
    (m,) from mass scaling [-].
    """

    window_work = 20_000_000
    """Element-steps to do before coming back: a fraction of a second."""

    def __init__(
        self,
        bodies: Sequence[Body],
        master: Integers,
        strain: Strain,
        dtype: DTypeLike,
        threads: int | None,
        density_factor: Floats | None = None,
    ) -> None:
        self.n_nodes = len(master)
        kind: Any = np.dtype(dtype)
        self.dtype = kind
        starts = np.cumsum([0] + [len(body.nodes) for body in bodies])
        shifted = [body.elements + start for body, start in zip(bodies, starts, strict=False)]
        self.elements = master[np.concatenate(shifted)]
        volumes = np.concatenate([body.gradients[1] for body in bodies])
        materials = [body.material for body in bodies]
        viscous = any(material.is_viscous for material in materials)
        names = ["lame_first", "lame_second"] + ["viscous_first", "viscous_second"] * viscous
        moduli = [np.concatenate([getattr(m, name) for m in materials]) for name in names]
        gradients = np.concatenate([body.gradients[0].reshape(-1, 9) for body in bodies])
        rows = np.column_stack([gradients, *(modulus * volumes for modulus in moduli)])

        mass = np.concatenate([m.density for m in materials]) * volumes / 4
        if density_factor is not None:
            mass = mass * density_factor
        self.mass: Floats = np.bincount(
            self.elements.ravel(), np.repeat(mass, 4), self.n_nodes
        ).astype(float)
        """Quarter masses of the elements, summed [kg], (n,); zero for nodes that follow others."""
        self.packed = layout_build(self.elements, self.n_nodes, rows, self.dtype)
        self.place = self.packed.node_place[master]
        """The kernel's number of a node, (n,)."""
        self.viscous = True if viscous else None
        self.law = kernel.LAWS[strain](kind.type(0.5))
        chunks = len(self.packed.layout.chunk_shift)
        most = threads or max(1, len(self.elements) // THREAD_ELEMENTS)
        self.threads = min(most, numba.get_num_threads(), chunks)
        inverse = np.zeros(self.n_nodes)
        used = self.mass > 0
        inverse[self.packed.node_place[used]] = 1 / self.mass[used]
        self.state = self._state(inverse)
        self._scratch: kernel.State | None = None

    def _state(self, inverse_mass: Floats) -> kernel.State:
        numbers = 4 * self.n_nodes
        inverse = aligned_zeros(self.n_nodes, self.dtype)
        inverse[:] = inverse_mass
        return kernel.State(
            aligned_zeros(numbers, self.dtype),
            aligned_zeros(numbers, self.dtype),
            aligned_zeros(self.packed.window_count, self.dtype),
            inverse,
        )

    def field(self, name: str) -> Floats:
        """``displacement`` [m] or ``velocity`` [m/s] of all nodes, (n, 3)."""
        flat = getattr(self.state, name)
        return flat.reshape(-1, 4)[self.place, :3].astype(float)

    def field_set(self, name: str, values: Floats) -> None:
        """Set a field of all nodes, (n, 3); nodes that follow others take their master's."""
        getattr(self.state, name).reshape(-1, 4)[self.place, :3] = values

    def window(
        self,
        steps: int,
        step: float,
        loads: kernel.Loads,
        held: kernel.Constraints,
        probes: kernel.Probes,
        table: Floats,
        gravity: Floats | None,
        work: Floats,
        state: kernel.State | None = None,
    ) -> tuple[int, float]:
        """Run the kernel; ``gravity`` (steps, 3) [m/s^2].  Returns steps done, bad elements."""
        accelerations = None
        if gravity is not None:
            accelerations = aligned_zeros(4 * len(gravity), self.dtype)
            accelerations.reshape(-1, 4)[:, :3] = gravity
        before = numba.get_num_threads()
        numba.set_num_threads(self.threads)
        try:
            done, bad = kernel.window_kernel(self.threads)(
                self.law, self.viscous, self.packed.layout, state or self.state, loads, held,
                probes, table, accelerations, work, self.dtype.type(step), steps,
            )  # fmt: skip
        finally:
            numba.set_num_threads(before)
        return int(done), float(bad)

    def accelerations(
        self,
        displacement: Floats,
        velocity: Floats,
        loads: kernel.Loads,
        held: kernel.Constraints,
        table: Floats,
        gravity: Floats | None,
    ) -> Floats:
        """``f(u, v)/m`` [m/s^2] of all nodes, (n, 3), loads included, zero where held.

        Made by the kernel itself: one step of one second from a copy of the state.
        """
        if self._scratch is None:
            self._scratch = self._state(np.asarray(self.state.inverse_mass, dtype=float))
        scratch = self._scratch
        if self.viscous is None:  # no digit of the forces is lost to a velocity they do not need
            velocity = np.zeros_like(velocity)
        for flat, values in ((scratch.displacement, displacement), (scratch.velocity, velocity)):
            flat.reshape(-1, 4)[self.place, :3] = values
        if held.roller_at.size:
            held = held._replace(roller_at=held.roller_at[:0], roller_normal=held.roller_normal[:0])
        free = held._replace(
            node_at=held.node_at[:0], series=held.series[:0], weight=held.weight[:0],
            previous=held.previous[:0],
        )  # fmt: skip
        before = scratch.velocity.astype(float)
        self.window(1, 1.0, loads, free, NO_PROBES, table, gravity, np.zeros(2), state=scratch)
        change = (scratch.velocity - before).reshape(-1, 4)[self.place, :3].astype(float)
        scratch.forces[:] = 0.0
        return change

    def hold(self, values: Floats, held: kernel.Constraints) -> Floats:
        """``values`` (n, 3) without their parts along held components and roller normals."""
        flat = np.zeros(4 * self.n_nodes)
        flat.reshape(-1, 4)[self.place, :3] = values
        at = held.roller_at[:, None] + np.arange(3)
        across = np.einsum("rc,rc->r", flat[at], held.roller_normal)
        # a node of several rollers is there several times; its normals are orthogonal
        np.subtract.at(flat, at, across[:, None] * held.roller_normal)
        flat[held.node_at] = 0.0
        return flat.reshape(-1, 4)[self.place, :3]

    def lists(self, conditions: Conditions) -> tuple[kernel.Loads, kernel.Constraints]:
        """The kernel's lists of loads and constraints."""
        return (
            conditions.loads_packed(self.packed, self.place),
            conditions.constraints_packed(self.place),
        )
