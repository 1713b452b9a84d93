"""The state of a simulation's rigid bodies: shifts, turns, momenta; what a user sets and sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import (
    Assembly,
    Body,
    RigidMass,
    rigid_displacement_fit,
    rigid_velocity_fit,
    turn_matrix,
)
from qdem_fem.rigid.step import FREE, Rigid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

STATE = ("shift", "velocity", "turn", "spin")


@dataclass(frozen=True)
class RigidNow:
    """Motion of the rigid bodies at the time of the displacements."""

    velocity: Floats
    """Of the centres [m/s], (b, 3)."""
    spin: Floats
    """Angular momentum about the centres [kg m^2/s], (b, 3)."""


class RigidState:
    """Bodies with six freedoms each among those of a simulation, and how they move.

    Base of `qdem_fem.rigid.forces.RigidBodies`.
    """

    def __init__(self, bodies: Sequence[Body], first_node: Integers, assembly: Assembly) -> None:
        self.assembly = assembly
        self.number = np.array([i for i, body in enumerate(bodies) if body.rigid])
        """Place of each among the bodies, (b,)."""
        self.bodies: list[Body] = [bodies[i] for i in self.number]
        self.own: list[RigidMass] = [body.rigid_mass for body in self.bodies]
        self.mass = np.array([own.mass for own in self.own])
        self._tensor = np.array([own.tensor for own in self.own])
        inertia = np.zeros((len(self.own), 6, 6))
        inertia[:, :3, :3] = self.mass[:, None, None] * np.eye(3)
        inertia[:, 3:, 3:] = self._tensor
        self._root = np.linalg.inv(np.linalg.cholesky(inertia))
        """Of the inertia, such that ``root K root^T`` has the squared frequencies, (b, 6, 6)."""
        starts = first_node[self.number]
        self.nodes = np.concatenate(
            [start + np.arange(len(b.nodes)) for b, start in zip(self.bodies, starts, strict=True)]
        )
        """All nodes, in the numbers of all bodies, (v,)."""
        counts = [len(body.nodes) for body in self.bodies]
        self.first = np.concatenate([[0], np.cumsum(counts)])
        """First of the nodes of each body, and the end, (b + 1,)."""
        self.body = np.repeat(np.arange(len(counts)), counts)
        """The rigid body that each is of, (v,)."""
        centre = np.array([own.centre for own in self.own])
        self.arm = np.concatenate([body.nodes for body in self.bodies]) - centre[self.body]
        self.place = assembly.place[self.nodes]
        """Their numbers in the kernel, (v,)."""
        self.of_place = np.full(assembly.n_nodes, -1)
        self.of_place[self.place] = np.arange(len(self.nodes))
        count = len(counts)
        still = np.zeros((count, 3))
        none = np.zeros(0, np.int64)
        first, node_at, force_at, arm = self._vertices(np.arange(len(self.nodes)))
        self._every = Rigid(
            node_first=first, node_at=node_at, force_at=force_at, arm=arm,
            inverse_mass=1 / self.mass,
            axes=np.array([own.axes for own in self.own]),
            inverse_inertia=1 / np.array([own.inertia for own in self.own]),
            shift=still.copy(), velocity=still.copy(),
            turn=np.tile(np.eye(4)[0], (count, 1)), spin=still.copy(),
            given=np.full((count, 3), -1), given_weight=still.copy(),
            turning=np.full(count, FREE),
            load_first=np.zeros(count + 1, np.int64), load_component=none, load_series=none,
            load_weight=np.zeros(0), load_arm=np.zeros((0, 3)),
        )  # fmt: skip
        self.kernel = self._every
        self._seen: Integers | None = None
        self._following = np.zeros(0, np.int64)
        for b, body in enumerate(self.bodies):
            if body._displacement.any():
                self._set_shift(b, body._displacement)
            if body._velocity.any():
                self._set_velocity(b, body._velocity)

    def _vertices(self, chosen: Integers) -> tuple[Any, ...]:
        """First four entries of `Rigid` for some of the nodes, in their order."""
        place = self.place[chosen]
        return (
            np.searchsorted(self.body[chosen], np.arange(len(self.bodies) + 1)),
            4 * place,
            4 * place + self.assembly.packed.node_window[place],
            np.ascontiguousarray(self.arm[chosen]),
        )

    def number_of(self, node: int) -> int:
        """The rigid body that a node is of, in the numbers of all bodies; -1: none."""
        row = int(self.of_place[self.assembly.place[node]])
        return int(self.body[row]) if row >= 0 else -1

    def set_field(self, body: Body, name: str, values: Floats) -> None:
        """Take a displacement or velocity (n, 3) of all nodes of a body.

        Raises `ConditionError` for one that strains it.
        """
        b = [body is member for member in self.bodies].index(True)
        (self._set_shift if name == "displacement" else self._set_velocity)(b, values)

    def _set_shift(self, b: int, values: Floats) -> None:
        body, state = self.bodies[b], self._every
        omega = np.linalg.solve(self._inertia_of(b), state.spin[b])
        state.shift[b], state.turn[b] = rigid_displacement_fit(
            body.nodes, self.own[b].centre, values, body.name
        )
        state.spin[b] = self._inertia_of(b) @ omega

    def _set_velocity(self, b: int, values: Floats) -> None:
        arm = self.arm[self.first[b] : self.first[b + 1]]
        arm = arm + arm @ turn_matrix(self._every.turn[b]).T
        velocity, omega = rigid_velocity_fit(arm, values, self.bodies[b].name)
        self._every.velocity[b] = velocity
        self._every.spin[b] = self._inertia_of(b) @ omega

    def stop(self, chosen: NDArray[np.bool_]) -> None:
        """Set velocities and turns of some of the bodies (b,) to zero."""
        self._every.velocity[chosen] = 0.0
        self._every.spin[chosen] = 0.0

    def _inertia_of(self, b: int) -> Floats:
        turn = np.eye(3) + turn_matrix(self._every.turn[b])
        return np.asarray(turn @ self._tensor[b] @ turn.T)

    def inertia(self) -> Floats:
        """Inertia of the bodies about their centres as they are turned now [kg m^2], (b, 3, 3)."""
        turn = np.eye(3) + turn_matrix(self._every.turn)
        return np.asarray(turn @ self._tensor @ turn.transpose(0, 2, 1))

    def arm_now(self) -> Floats:
        """From the centres to all nodes as they are turned now [m], (v, 3)."""
        return self._turned(self.body, self.arm)

    def _turned(self, body: Integers, arm: Floats) -> Floats:
        return arm + np.einsum("vij,vj->vi", turn_matrix(self._every.turn)[body], arm)

    def omega(self, spin: Floats) -> Floats:
        """Angular velocities [1/s] of angular momenta (b, 3) about the centres."""
        free, inertia = self._turns_free(), self.inertia()
        held = ~(free[:, :, None] & free[:, None, :])
        inertia[held] = np.broadcast_to(np.eye(3), inertia.shape)[held]
        return np.asarray(np.linalg.solve(inertia, (spin * free)[:, :, None])[:, :, 0])

    def _turns_free(self) -> NDArray[np.bool_]:
        """Which turns about the laboratory's axes each body may make, (b, 3)."""
        turning = self._every.turning[:, None]
        return np.asarray((turning == FREE) | (turning == np.arange(3)))

    def kinetic(self, motion: RigidNow | None = None) -> float:
        """Kinetic energy of a motion, by default of the velocities as they are [J]."""
        return float(self.find_kinetic_each(motion).sum())

    def find_kinetic_each(self, motion: RigidNow | None = None) -> Floats:
        """The same of each body [J], (b,)."""
        motion = motion or RigidNow(self._every.velocity, self._every.spin)
        turning = (motion.spin * self.omega(motion.spin)).sum(axis=1)
        return np.asarray(0.5 * (self.mass * (motion.velocity**2).sum(axis=1) + turning))

    def moment(self) -> tuple[Floats, Floats]:
        """``sum M d`` [kg m] and ``sum M V`` [kg m/s], (3,) each."""
        state = self._every
        return self.mass @ state.shift, self.mass @ state.velocity

    def stored(self) -> dict[str, NDArray[Any]]:
        """The state, to the bit."""
        return {f"rigid_{name}": getattr(self._every, name) for name in STATE}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take what `stored` gave."""
        for name in STATE:
            getattr(self._every, name)[:] = arrays[f"rigid_{name}"]
