"""The rigid bodies of a simulation: what a user sets and sees, and their place in a march."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import (
    Assembly,
    Body,
    RigidMass,
    fit_rigid_displacement,
    fit_rigid_velocity,
    make_stiffness_six,
    make_turn_matrix,
)
from qdem_fem.files import ConditionError, Floats, Integers
from qdem_fem.kernel.cpu import Constraints, Loads
from qdem_fem.rigid.holds import find_hold, split_conditions
from qdem_fem.rigid.step import FREE, Rigid

STATE = ("shift", "velocity", "turn", "spin")


@dataclass(frozen=True)
class RigidNow:
    """Motion of the rigid bodies at the time of the displacements."""

    velocity: Floats  # of the centres [m/s], (b, 3)
    spin: Floats  # angular momentum about the centres [kg m^2/s], (b, 3)


@dataclass(frozen=True)
class Acting:
    """What acts on the rigid bodies of a simulation now, and where its march is."""

    behind: bool  # whether velocities are half a step behind the displacements
    step: float  # [s]
    table: Floats  # (2, series) what loads and given displacements are times, now and a step later
    gravity: Floats | None  # (3,) [m/s^2]
    place: Integers  # (c,) the kernel's numbers of vertices that contact acts on
    force: Floats  # (c, 3) of contact on them [N]


class RigidBodies:
    """Bodies with six freedoms each among those of a simulation, and how they move.

    Made with the simulation's assembly, whose fields have the displacement of all their nodes.
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
        counts = [len(body.nodes) for body in self.bodies]
        self.first = np.concatenate([[0], np.cumsum(counts)])
        """First of the nodes of each body, and the end, (b + 1,)."""
        self.body = np.repeat(np.arange(len(counts)), counts)
        """The rigid body that each is of, (v,)."""
        start = first_node[self.number] - self.first[:-1]
        self.nodes = np.arange(len(self.body)) + start[self.body]
        """All nodes, in the numbers of all bodies, (v,)."""
        centre = np.array([own.centre for own in self.own])
        self.arm = np.concatenate([body.nodes for body in self.bodies]) - centre[self.body]
        self.place = assembly.place[self.nodes]
        """Their numbers in the kernel, (v,)."""
        self.of_place = np.full(assembly.n_nodes, -1)
        self.of_place[self.place] = np.arange(len(self.nodes))
        count = len(counts)
        still = np.zeros((count, 3))
        none = np.zeros(0, np.int64)
        self._every = Rigid(
            *self._vertices(np.arange(len(self.nodes))),
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

    def _vertices(self, chosen: Integers) -> tuple[Any, Any, Any, Any]:
        """First four entries of `Rigid` for some of the nodes, in their order."""
        place = self.place[chosen]
        return (
            np.searchsorted(self.body[chosen], np.arange(len(self.bodies) + 1)),
            4 * place,
            4 * place + self.assembly.packed.node_window[place],
            np.ascontiguousarray(self.arm[chosen]),
        )

    def set_field(self, body: Body, name: str, values: Floats) -> None:
        """Take a displacement or velocity (n, 3) of all nodes of a body.

        Raises `ConditionError` for one that strains it.
        """
        b = [body is member for member in self.bodies].index(True)
        (self._set_shift if name == "displacement" else self._set_velocity)(b, values)

    def _set_shift(self, b: int, values: Floats) -> None:
        body, state = self.bodies[b], self._every
        omega = np.linalg.solve(self._inertia_of(b), state.spin[b])
        state.shift[b], state.turn[b] = fit_rigid_displacement(
            body.nodes, self.own[b].centre, values, body.name
        )
        state.spin[b] = self._inertia_of(b) @ omega

    def _set_velocity(self, b: int, values: Floats) -> None:
        arm = self.arm[self.first[b] : self.first[b + 1]]
        arm = arm + arm @ make_turn_matrix(self._every.turn[b]).T
        velocity, omega = fit_rigid_velocity(arm, values, self.bodies[b].name)
        self._every.velocity[b] = velocity
        self._every.spin[b] = self._inertia_of(b) @ omega

    def stop(self, chosen: NDArray[np.bool_]) -> None:
        """Set velocities and turns of some of the bodies (b,) to zero."""
        self._every.velocity[chosen] = 0.0
        self._every.spin[chosen] = 0.0

    def _inertia_of(self, b: int) -> Floats:
        turn = np.eye(3) + make_turn_matrix(self._every.turn[b])
        return np.asarray(turn @ self._tensor[b] @ turn.T)

    def inertia(self) -> Floats:
        """Inertia of the bodies about their centres as they are turned now [kg m^2], (b, 3, 3)."""
        turn = np.eye(3) + make_turn_matrix(self._every.turn)
        return np.asarray(turn @ self._tensor @ turn.transpose(0, 2, 1))

    def arm_now(self) -> Floats:
        """From the centres to all nodes as they are turned now [m], (v, 3)."""
        return self._turn_arms(self.body, self.arm)

    def _turn_arms(self, body: Integers, arm: Floats) -> Floats:
        return arm + np.einsum("vij,vj->vi", make_turn_matrix(self._every.turn)[body], arm)

    def omega(self, spin: Floats) -> Floats:
        """Angular velocities [1/s] of angular momenta (b, 3) about the centres."""
        free, inertia = self._free_turns(), self.inertia()
        held = ~(free[:, :, None] & free[:, None, :])
        inertia[held] = np.broadcast_to(np.eye(3), inertia.shape)[held]
        return np.asarray(np.linalg.solve(inertia, (spin * free)[:, :, None])[:, :, 0])

    def _free_turns(self) -> NDArray[np.bool_]:
        """Which turns about the laboratory's axes each body may make, (b, 3)."""
        turning = self._every.turning[:, None]
        return np.asarray((turning == FREE) | (turning == np.arange(3)))

    def kinetic_energy(self, motion: RigidNow | None = None) -> float:
        """Kinetic energy of a motion, by default of the velocities as they are [J]."""
        return float(self.find_kinetic_each(motion).sum())

    def find_kinetic_each(self, motion: RigidNow | None = None) -> Floats:
        """The same of each body [J], (b,)."""
        motion = motion or RigidNow(self._every.velocity, self._every.spin)
        turning = (motion.spin * self.omega(motion.spin)).sum(axis=1)
        return np.asarray(0.5 * (self.mass * (motion.velocity**2).sum(axis=1) + turning))

    def moment(self) -> Floats:
        """``sum M d`` [kg m], (3,)."""
        return np.asarray(self.mass @ self._every.shift)

    def pack_state(self) -> dict[str, NDArray[Any]]:
        """The state, to the bit."""
        return {f"rigid_{name}": getattr(self._every, name) for name in STATE}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take what `pack_state` gave."""
        for name in STATE:
            getattr(self._every, name)[:] = arrays[f"rigid_{name}"]

    # --- what acts on them ---------------------------------------------------------------------

    def find_motion(self, acting: Acting) -> RigidNow:
        """The motion at the time of the displacements."""
        return self._find_motions(acting)[1]

    def _find_motions(self, acting: Acting) -> tuple[RigidNow, RigidNow]:
        """The motion half a step ago, and now."""
        state, half = self._every, 0.5 * acting.step
        force, torque = self.forces(acting)
        change = np.where(state.given < 0, half * force / self.mass[:, None], 0.0)
        kept = RigidNow(state.velocity.copy(), state.spin.copy())
        if not acting.behind:
            return RigidNow(kept.velocity - change, kept.spin - half * torque), kept
        moved = state.given_weight * (acting.table[1] - acting.table[0])[state.given] / acting.step
        velocity = np.where(state.given < 0, kept.velocity + change, 0.5 * (kept.velocity + moved))
        return kept, RigidNow(velocity, kept.spin + half * torque)

    def forces(self, acting: Acting) -> tuple[Floats, Floats]:
        """Force [N] and torque about the centre [N m] on each body now, (b, 3) each."""
        pulls, row = np.zeros((len(self.nodes), 3)), self.of_place[acting.place]
        pulls[row[row >= 0]] = acting.force[row >= 0]
        force, torque = self._resultant(self.body, self.arm_now(), pulls)
        if acting.gravity is not None:
            force = force + self.mass[:, None] * acting.gravity
        loads, levers = self.find_loads(acting)
        return force + loads, torque + levers

    def find_loads(self, acting: Acting) -> tuple[Floats, Floats]:
        """Force [N] and torque [N m] of the loads on each body now, (b, 3) each."""
        state = self._every
        size = state.load_weight * acting.table[0][state.load_series]
        body = np.repeat(np.arange(len(self.bodies)), np.diff(state.load_first))
        pulls = size[:, None] * np.eye(3)[state.load_component]
        arm = self._turn_arms(body, state.load_arm)
        return self._resultant(body, arm, pulls)

    def _resultant(self, body: Integers, arm: Floats, pulls: Floats) -> tuple[Floats, Floats]:
        force, torque = np.zeros((2, len(self.bodies), 3))
        np.add.at(force, body, pulls)
        np.add.at(torque, body, np.cross(arm, pulls))
        return force, torque

    def velocity_field(self, acting: Acting) -> Floats:
        """Velocity of all nodes at the time of the displacements [m/s], (v, 3)."""
        now = self.find_motion(acting)
        across = np.cross(self.omega(now.spin)[self.body], self.arm_now())
        return np.asarray(now.velocity[self.body] + across)

    # --- in a march ----------------------------------------------------------------------------

    def split_lists(
        self, loads: Loads, held: Constraints, work: Floats
    ) -> tuple[Loads, Constraints]:
        """Take from the lists what is on rigid bodies; returns the rest.

        ``work`` (3,) [J]: the account of a march, to which stopping a turn adds.
        """
        loads, held, mine, holds = split_conditions(loads, held, self.of_place >= 0)
        row, component = self.of_place[mine.node_at // 4], mine.node_at % 4
        order = np.argsort(self.body[row], kind="stable")
        row = row[order]
        self._every = self._every._replace(
            load_first=np.searchsorted(self.body[row], np.arange(len(self.bodies) + 1)),
            load_component=component[order],
            load_series=mine.series[order],
            load_weight=mine.weight[order],
            load_arm=np.ascontiguousarray(self.arm[row]),
        )
        row, component = self.of_place[holds.node_at // 4], holds.node_at % 4
        for b, body in enumerate(self.bodies):
            on = self.body[row] == b
            arm, series, weight = self.arm[row[on]], holds.series[on], holds.weight[on]
            hold = find_hold(self.own[b], arm, component[on], series, weight, body.name)
            self._every.given[b], self._every.given_weight[b], turning = hold
            self._set_turning(b, turning, work)
        self._seen = None
        return loads, held

    def _set_turning(self, b: int, turning: int, work: Floats) -> None:
        """Hold or free the turns of a body; what stops them does work, as it does on shifts."""
        if turning == self._every.turning[b] == FREE:
            return
        before = self.kinetic_energy()
        omega = self.omega(self._every.spin)[b]
        self._every.turning[b] = turning
        held = ~self._free_turns()[b]
        if self._every.turn[b, 1:][held].any():
            raise ConditionError(
                "what is to hold it has turned already, and can not be brought back",
                where=self.bodies[b].name, remedy="hold a rigid body before it turns",
            )  # fmt: skip
        omega[held] = 0.0
        self._every.spin[b] = self._inertia_of(b) @ omega
        work[1] += self.kinetic_energy() - before

    def kick_half(self, sign: int, acting: Acting, work: Floats) -> None:
        """Take the motion half a step on (``sign`` 1) or back (-1), and note its ``work`` [J]."""
        behind, now = self._find_motions(acting)
        to = now if sign > 0 else behind
        work[:2] += sign * self.find_half_work(acting)
        self._every.velocity[:], self._every.spin[:] = to.velocity, to.spin

    def find_half_work(self, acting: Acting) -> Floats:
        """Work in the half step up to now [J], (2,): of loads, of prescribed motion."""
        behind, now = self._find_motions(acting)
        state, half = self._every, 0.5 * acting.step
        mean = 0.5 * (behind.velocity + now.velocity)
        turn = 0.5 * (self.omega(behind.spin) + self.omega(now.spin))
        loads, levers = self.find_loads(acting)
        force = self.forces(acting)[0]
        missing = self.mass[:, None] * (now.velocity - behind.velocity) - half * force
        held = state.given >= 0
        of_loads = half * (loads * mean + levers * turn).sum()
        return np.array([of_loads, (missing * mean)[held].sum()])

    def make_kernel(self, probed: Integers, touching: Integers) -> Rigid:
        """What a step of a march reads: vertices that may touch, and nodes that are probed.

        ``probed``, ``touching``: 4 x kernel number of nodes of any bodies.  Other nodes follow when
        the march comes back, by `follow`.
        """
        if self._seen is None or not np.array_equal(self._seen, probed):
            needed = np.zeros(len(self.nodes), dtype=bool)
            for nodes in (touching, probed):
                row = self.of_place[nodes // 4]
                needed[row[row >= 0]] = True
            vertices = self._vertices(np.flatnonzero(needed))
            self._following = np.flatnonzero(~needed)
            self.kernel = Rigid(*vertices, *self._every[len(vertices) :])
            self._seen = probed.copy()
        return self.kernel

    def place_others(self) -> None:
        """Put the nodes that no step moves where their bodies are."""
        at = 4 * self.place[self._following][:, None] + np.arange(3)
        body, arm = self.body[self._following], self.arm[self._following]
        moved = self._every.shift[body] + (self._turn_arms(body, arm) - arm)
        self.assembly.state.displacement[at] = moved

    # --- for the step and the files ------------------------------------------------------------

    def frequency_bound(self, nodes: Integers, stiffness: Floats) -> Floats:
        """Highest omega^2 [1/s^2] of the body of each node under springs at these nodes, (c,).

        ``nodes`` (c,) in the numbers of all bodies, ``stiffness`` (c,) [N/m] of all springs of a
        node; zero for nodes of deformable bodies.
        """
        row = self.of_place[self.assembly.place[nodes]]
        mine = row >= 0
        body = self.body[row[mine]]
        spring = make_stiffness_six(body, self.arm[row[mine]], stiffness[mine], len(self.bodies))
        free = np.concatenate([self._every.given < 0, self._free_turns()], axis=1)
        spring *= free[:, :, None] & free[:, None, :]
        highest = np.linalg.eigvalsh(self._root @ spring @ self._root.transpose(0, 2, 1))[:, -1]
        bound = np.zeros(len(nodes))
        bound[mine] = highest[body]
        return bound
