"""All bodies of a simulation in the kernel's arrays, and the state that moves in them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import DTypeLike, NDArray

from qdem_fem.bodies.conditions import Conditions, remove_held
from qdem_fem.bodies.deformable import Body
from qdem_fem.bodies.frames import BodyFrames
from qdem_fem.element import MEASURES, Strain
from qdem_fem.files import Floats, Integers
from qdem_fem.kernel.cpu import (
    GROUPS,
    LAWS,
    POINTS,
    Constraints,
    Fields,
    Loads,
    Probes,
    QuadraticLayout,
    build_layout,
    make_aligned_zeros,
)
from qdem_fem.kernel.cpu import step as kernel

THREAD_ELEMENTS = 16_384
"""Fewer elements of four nodes than this for each thread lose more at barriers than they gain."""

FIELDS = ("displacement", "velocity")
FRAME_ARRAYS = ("rotation", "shift", "velocity")
EDGE = 2.0
"""Edge of a regular tetrahedron over the cube root of its volume."""

NO_LOADS = Loads(*(np.zeros(0, np.int64),) * 3, np.zeros(0))
NO_CONSTRAINTS = Constraints(
    *(np.zeros(0, np.int64),) * 2, np.zeros(0), np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3))
)
NO_PROBES = Probes(np.zeros(0, np.int64), np.zeros((0, 0, 3)), 1, 1)

EVERY = slice(None)
"""Of all nodes."""


class Given(NamedTuple):
    """What acts on the nodes in some steps."""

    table: Floats  # (steps + 1, series) amplitudes at the times of the steps
    loads: Loads = NO_LOADS
    held: Constraints = NO_CONSTRAINTS
    probes: Probes = NO_PROBES
    gravity: Floats | None = None  # (3,) [m/s^2]; None: there is none


NOTHING = Given(np.ones((2, 1)))
"""In one step."""


class Assembly:
    """Bodies side by side; numbers of nodes and elements run through all of them.  Those that
    deform are of one kind of element.

    ``master`` (n,): the node that a node moves with, itself unless periodic; ``density_factor``
    (m,) from mass scaling [-].  Elements of rigid bodies are in none of the arrays; their nodes
    have a place in the fields, and a window of forces, which `qdem_fem.rigid.step` reads.
    """

    window_work = 100_000_000
    """Element-steps to do before coming back: about a second."""

    def __init__(
        self, bodies: Sequence[Body], master: Integers, strain: Strain, dtype: DTypeLike,
        threads: int | None, density_factor: Floats | None = None,
    ) -> None:  # fmt: skip
        self.n_nodes = len(master)
        kind: Any = np.dtype(dtype)
        self.dtype = kind
        self._first_node = np.cumsum([0] + [len(body.nodes) for body in bodies])
        none = np.zeros(0)
        soft = [i for i, body in enumerate(bodies) if not body.rigid]
        first = bodies[soft[0] if soft else 0]
        quadratic, shares = first.ELEMENT == "quadratic", np.array(first.MASS_SHARES)
        shifted = [bodies[i].element_nodes + self._first_node[i] for i in soft]
        self.elements = master[np.concatenate([*shifted, np.zeros((0, len(shares)), np.int64)])]
        volumes = np.concatenate([*(bodies[i].gradients[1] for i in soft), none])
        materials = [bodies[i].material for i in soft]
        viscous = any(material.is_viscous for material in materials)
        names = ["lame_first", "lame_second"] + ["viscous_first", "viscous_second"] * viscous
        moduli = [np.concatenate([*(getattr(m, name) for m in materials), none]) for name in names]
        gradients = np.concatenate(
            [*(bodies[i].gradients[0].reshape(-1, 9) for i in soft), none.reshape(0, 9)]
        )
        weight = volumes / POINTS if quadratic else volumes
        rows = np.column_stack([gradients, *(modulus * weight for modulus in moduli)])

        mass = np.concatenate([*(m.density for m in materials), none]) * volumes
        if density_factor is not None:
            mass = mass * density_factor
        self.mass: Floats = np.bincount(
            self.elements.ravel(), (mass[:, None] * shares).ravel(), self.n_nodes
        ).astype(float)
        """Shares of the elements' masses, summed [kg], (n,); zero for nodes that follow others,
        and of rigid bodies."""
        rigid = np.repeat([bool(body.rigid) for body in bodies], np.diff(self._first_node))
        self.packed = build_layout(
            self.elements[:, GROUPS] if quadratic else self.elements, self.n_nodes, rows,
            self.dtype, np.flatnonzero(rigid),
        )  # fmt: skip
        if quadratic:
            self.packed = replace(self.packed, layout=QuadraticLayout(*self.packed.layout))
        self.place = self.packed.node_place[master]
        """The kernel's number of a node, (n,)."""
        self.viscous = True if viscous else None
        self.law = LAWS[strain](kind.type(0.5))
        chunks = len(self.packed.layout.chunk_shift)
        most = threads or max(1, self.elements.size // (4 * THREAD_ELEMENTS))
        self.threads = max(1, min(most, numba.get_num_threads(), chunks))
        inverse = np.zeros(self.n_nodes)
        used = self.mass > 0
        inverse[self.packed.node_place[used]] = 1 / self.mass[used]
        self.state = self._make_state(inverse)
        self._scratch: Fields | None = None
        self.frames: BodyFrames | None = None
        """Of free bodies in single precision."""
        self._nodes = np.concatenate([body.nodes for body in bodies])
        self._sizes = np.array([EDGE * np.median(body.gradients[1]) ** (1 / 3) for body in bodies])
        self._turning = MEASURES[strain].OBJECTIVE
        self._joined = master != np.arange(self.n_nodes)
        self._joined[master[self._joined]] = True

    def _make_state(self, inverse_mass: Floats) -> Fields:
        numbers = 4 * self.n_nodes
        inverse = make_aligned_zeros(self.n_nodes, self.dtype)
        inverse[:] = inverse_mass
        return Fields(
            make_aligned_zeros(numbers, self.dtype),
            make_aligned_zeros(numbers, self.dtype),
            make_aligned_zeros(self.packed.window_count, self.dtype),
            inverse,
        )

    def _read(self, flat: Any, nodes: slice = EVERY) -> Floats:
        """A field of the state by the user's numbers, (n, 3), as the kernel has it."""
        return np.asarray(flat).reshape(-1, 4)[self.place[nodes], :3].astype(float)

    def _write(self, flat: Any, values: Floats, nodes: slice = EVERY) -> None:
        flat.reshape(-1, 4)[self.place[nodes], :3] = values

    def field(self, name: str, nodes: slice = EVERY) -> Floats:
        """``displacement`` [m] or ``velocity`` [m/s] of all nodes, or of some, (n, 3)."""
        own = self._read(getattr(self.state, name), nodes)
        if self.frames is None:
            return own
        to_world = {
            "displacement": self.frames.displacement_world,
            "velocity": self.frames.velocity_world,
        }
        return to_world[name](own, nodes)

    def set_field(self, name: str, values: Floats, nodes: slice = EVERY) -> None:
        """Set a field of all nodes, or of some, (n, 3); what follows others takes its master's."""
        if self.frames is None:
            self._write(getattr(self.state, name), values, nodes)
        else:
            fields = {each: self.field(each) for each in FIELDS}
            fields[name][nodes] = values
            self._set_frame_fields(**fields)

    def _set_frame_fields(self, displacement: Floats, velocity: Floats) -> None:
        """Renew the frames for these fields of all nodes, (n, 3)."""
        assert self.frames is not None
        if np.isfinite(displacement).all() and np.isfinite(velocity).all():
            self.frames.fit(displacement, velocity)
        self._write(self.state.displacement, self.frames.displacement_own(displacement))
        self._write(self.state.velocity, self.frames.velocity_own(velocity))

    def kinetic_energy(self) -> float:
        """Kinetic energy of the velocities as they are [J].

        No BLAS here, in what is called between windows: its threads go on spinning for a while
        where the kernel's threads want to compute.
        """
        if not len(self.elements):
            return 0.0
        if self.frames is not None:
            speed = (self.field("velocity") ** 2).sum(axis=1)
            return 0.5 * float((self.mass * speed).sum())
        own = np.asarray(self.state.velocity).reshape(-1, 4)
        return 0.5 * float(
            (self.mass * np.einsum("nc,nc->n", own, own, dtype=float)[self.place]).sum()
        )

    def moment(self) -> Floats:
        """``sum m u`` [kg m] of the displacement as it is, (3,)."""
        if not len(self.elements):
            return np.zeros(3)
        return np.einsum("n,nc->c", self.mass, self.field("displacement"))

    def _choose_frames(self, conditions: Conditions, gravity: bool) -> None:
        """Give frames to the bodies that are free, and take them from those that no longer are."""
        displacement, velocity = self.field("displacement"), self.field("velocity")
        tied = self._joined.copy()
        for nodes in [each.nodes for each in conditions.held + conditions.rollers]:
            tied[nodes] = True
        if np.logical_or.reduceat(tied, self._first_node[:-1]).all():
            self.frames = None
            self._write(self.state.displacement, displacement)
            self._write(self.state.velocity, velocity)
            return
        self.frames = BodyFrames(
            self._nodes, self.mass, self._first_node, self._sizes, self._turning
        )
        self.frames.choose(tied, gravity)
        self._set_frame_fields(displacement, velocity)

    def find_most_steps(self, step: float) -> int:
        """Steps to take before frames are looked at again."""
        if self.frames is None:
            return self.window_work
        return self.frames.count_near_steps(self._read(self.state.velocity), step)

    def renew_frames(self) -> None:
        """Take new frames where a body has moved far in its own."""
        if self.frames is not None and self.frames.is_far(self._read(self.state.displacement)):
            self._set_frame_fields(**{name: self.field(name) for name in FIELDS})

    def pack_state(self) -> dict[str, NDArray[Any]]:
        """The state as it is kept, to the bit: fields by the user's numbers, and frames."""
        arrays: dict[str, NDArray[Any]] = {
            name: self._read(getattr(self.state, name)).astype(self.dtype) for name in FIELDS
        }
        if self.frames is not None:
            arrays |= {f"frame_{name}": getattr(self.frames, name) for name in FRAME_ARRAYS}
        return arrays

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take the state that `pack_state` gave, under the same conditions."""
        fields = {name: arrays[name].astype(float) for name in FIELDS}
        if self.frames is not None:
            frames = {name: arrays[f"frame_{name}"].copy() for name in FRAME_ARRAYS}
            for name, values in frames.items():
                setattr(self.frames, name, values)
        for name, values in fields.items():
            self._write(getattr(self.state, name), values)

    def advance_window(
        self, steps: int, step: float, given: Given, work: Floats
    ) -> tuple[int, float]:
        """Compute steps, and add to the ``work`` (3,) [J]; returns steps done, bad elements."""
        frames, user_node = self.frames, self.packed.node_order
        if frames is None:
            return self.run_kernel(self.state, steps, step, given, work)
        journey = frames.journey(steps, step, given.gravity)
        seen = self._turn_to_frames(frames, given)
        done, bad = self.run_kernel(self.state, steps, step, seen, work)
        frames.turn_probes(given.probes, user_node, done, step, journey)
        work[0] += frames.find_frame_work(given.loads, user_node, given.table[:done], step, journey)
        frames.advance(done, step, journey)
        return done, bad

    def _turn_to_frames(self, frames: BodyFrames, given: Given) -> Given:
        """The same in the directions of the frames, and without what they fall by themselves."""
        return given._replace(
            loads=frames.turn_loads(given.loads, self.packed.node_order),
            gravity=None if frames.falls else given.gravity,
        )

    def pack_gravity(self, gravity: Floats | None) -> Any:
        """Gravity (3,) [m/s^2] as the kernel reads it, four numbers; None without."""
        if gravity is None:
            return None
        acceleration = make_aligned_zeros(4, self.dtype)
        acceleration[:3] = gravity
        return acceleration

    def run_kernel(
        self, state: Fields, steps: int, step: float, given: Given, work: Floats
    ) -> tuple[int, float]:
        """Run the kernel on a state as it is, in the frames of the bodies."""
        before = numba.get_num_threads()
        numba.set_num_threads(self.threads)
        try:
            done, bad = kernel.choose_window_kernel(self.threads)(
                self.law, self.viscous, self.packed.layout, state, given.loads, given.held,
                given.probes, given.table, self.pack_gravity(given.gravity), work,
                self.dtype.type(step), steps,
            )  # fmt: skip
        finally:
            numba.set_num_threads(before)
        return int(done), float(bad)

    def accelerations(self, displacement: Floats, velocity: Floats, given: Given) -> Floats:
        """``f(u, v)/m`` [m/s^2] of all nodes, (n, 3), loads included, held or not."""
        frames = self.frames
        if frames is None:
            return self.accelerations_own(displacement, velocity, given)
        own = self.accelerations_own(
            frames.displacement_own(displacement),
            frames.velocity_own(velocity),
            self._turn_to_frames(frames, given),
        )
        seen = frames.turn_vectors(own)
        return seen if given.gravity is None or not frames.falls else seen + given.gravity

    def accelerations_own(
        self, displacement: Floats, velocity: Floats, given: Given = NOTHING
    ) -> Floats:
        """`accelerations` within the frames, by the kernel: one step of one second of a copy."""
        scratch = self.scratch
        if self.viscous is None:  # no digit of the forces is lost to a velocity they do not need
            velocity = np.zeros_like(velocity)
        self._write(scratch.displacement, displacement)
        self._write(scratch.velocity, velocity)
        before = self._read(scratch.velocity)
        self.run_kernel(scratch, 1, 1.0, given, np.zeros(3))
        scratch.forces[:] = 0.0
        return self._read(scratch.velocity) - before

    @property
    def scratch(self) -> Fields:
        """A state beside that of the bodies, with their masses."""
        if self._scratch is None:
            self._scratch = self._make_state(np.asarray(self.state.inverse_mass, dtype=float))
        return self._scratch

    def viscous_power(self) -> float:
        """What viscosity takes now [W], of velocities as they are: ``-f_D(u, v).v``.

        In the frames of the bodies: viscous forces take nothing from the motion of a frame.
        """
        work = np.zeros(3)
        for name in FIELDS:
            getattr(self.scratch, name)[:] = getattr(self.state, name)
        self.run_kernel(self.scratch, 1, 1.0, NOTHING, work)
        self.scratch.forces[:] = 0.0
        return float(work[2])

    def hold(self, values: Floats, held: Constraints) -> Floats:
        """``values`` (n, 3) without their parts along held components and roller normals."""
        return remove_held(self.pack_field(values), held).reshape(-1, 4)[self.place, :3]

    def pack_field(self, field: Floats) -> Floats:
        """A nodal field (n, 3) in the kernel's order, four numbers a node."""
        flat = np.zeros(4 * self.n_nodes)
        flat.reshape(-1, 4)[self.place, :3] = field
        return flat

    def pack_lists(self, conditions: Conditions, gravity: bool) -> tuple[Loads, Constraints]:
        """The kernel's lists of loads and constraints; in single precision, frames to suit."""
        if self.dtype == np.float32:
            self._choose_frames(conditions, gravity)
        loads = conditions.pack_loads(self.packed, self.place)
        return loads, conditions.pack_constraints(self.place)
