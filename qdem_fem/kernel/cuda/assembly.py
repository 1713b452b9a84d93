"""The bodies of a simulation on a GPU: state and element data stay there from window to window.

`CudaAssembly` answers the calls of `qdem_fem.bodies.assembly.Assembly`; ``Simulation(...,
device="cuda")`` takes it in its place.  A window goes to the GPU as launches without a wait in
between (with contact there are few); what comes back at its end is how many steps were done, the
count of bad elements, the samples of the probes and the work of the few nodes with loads and
constraints.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import EVERY, Assembly, Body, Given
from qdem_fem.element import Strain
from qdem_fem.files import Floats, Integers, LibraryMissing
from qdem_fem.kernel.cpu import (
    ROWS_ELASTIC,
    ROWS_VISCOUS,
    Constraints,
    Fields,
    Loads,
    Probes,
    count_lane,
)
from qdem_fem.kernel.cuda import step as cuda_step
from qdem_fem.kernel.cuda.step import NO_CUDA, cuda
from qdem_fem.kernel.cuda.sums import sum_motion


def require_gpu() -> None:
    """Raise `LibraryMissing` unless numba.cuda is installed and finds a GPU and its compiler."""
    where = 'device="cuda"'
    if cuda.is_available():
        return
    if cuda.cuda_error() is None:
        raise LibraryMissing("CUDA's compiler, NVVM, was not found", where=where, remedy=NO_CUDA)
    raise LibraryMissing(
        "no GPU was found, or its driver does not answer",
        where=where,
        remedy='compute with device="cpu", or where an NVIDIA GPU and its driver are at hand',
    )


LOOK = 16
"""Steps of contact between two looks of the host at whether the window has ended.  A list is good
for some 40 steps where bodies move (`qdem_fem.contact.search.choose_skin`), a window may be of
thousands: those launched behind its end compute nothing, but each launch takes its time."""


class NodeActions(NamedTuple):
    """Loads, rollers, given displacements and probes, sorted by node; columns: `cuda_step`."""

    first: NDArray[np.int32]  # the first action of every node, and the end, (n + 1,)
    actions: NDArray[np.int32]
    """Kind, component, series and place in the list it came from, (A + 1, 4).

    The last row is no node's: an array on a GPU had better not be empty."""
    weights: Floats  # weight, or the normal of a roller, (A + 1, 3)
    memory: Floats  # work [J] in this window and velocity given in the last step [m/s], (A + 1, 2)

    def find_kind(self, kind: int) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
        """Places of all actions of a kind, and their places in the list they came from."""
        found = np.flatnonzero(self.actions[:, 0] == kind)
        return found, self.actions[found, 3]


def sort_node_actions(n_nodes: int, loads: Loads, held: Constraints, probes: Probes) -> NodeActions:
    """Sort the kernel's lists by node, so that one thread does all that happens to a node."""
    kinds = (
        (cuda_step.LOAD, loads.node_at, loads.series, loads.weight),
        (cuda_step.ROLLER, held.roller_at, None, held.roller_normal),
        (cuda_step.HELD, held.node_at, held.series, held.weight),
        (cuda_step.PROBE, probes.node_at, None, None),
    )
    count = sum(len(at) for _, at, _, _ in kinds)
    node = np.zeros(count, dtype=np.int64)
    actions = np.full((count + 1, 4), -1, dtype=np.int32)
    weights, memory = np.zeros((count + 1, 3)), np.zeros((count + 1, 2))
    start = 0
    for kind, at, series, weight in kinds:
        part = slice(start, start + len(at))
        node[part] = at // 4
        actions[part, cuda_step.KIND] = kind
        actions[part, cuda_step.COMPONENT] = at % 4
        actions[part, cuda_step.SLOT] = np.arange(len(at))
        if series is not None:
            actions[part, cuda_step.SERIES] = series
        if kind == cuda_step.ROLLER:
            weights[part] = weight
        elif weight is not None:
            weights[part, 0] = weight
        if kind == cuda_step.HELD:
            memory[part, 1] = held.previous
        start = part.stop
    order = np.argsort(node, kind="stable")  # of one node the kinds keep their order
    first = np.searchsorted(node[order], np.arange(n_nodes + 1)).astype(np.int32)
    order = np.append(order, count)
    return NodeActions(first, actions[order], weights[order], memory[order])


def number_samples(steps: int, probes: Probes) -> Integers:
    """Where in the record the samples of the window's steps are written, (steps,), or -1."""
    since = np.arange(1, steps + 1) - probes.first
    numbers = np.where((since >= 0) & (since % probes.stride == 0), since // probes.stride, -1)
    return np.where(numbers < len(probes.record), numbers, -1)


class CudaAssembly(Assembly):
    """`Assembly` on the GPU that numba.cuda takes first; `require_gpu` says whether there is one.

    ``threads`` is of no account.  Sums of forces are in no fixed order: a run repeats to
    round-off, not to the bit.  Not for a few thousand elements: a step then costs two launches,
    whatever its size.
    """

    window_work = 2_000_000_000

    def __init__(
        self, bodies: Sequence[Body], master: Integers, strain: Strain, *more: Any
    ) -> None:
        require_gpu()
        super().__init__(bodies, master, strain, *more)
        layout = self.packed.layout
        lanes = count_lane(self.dtype)
        width = ROWS_VISCOUS if self.viscous else ROWS_ELASTIC
        by_row = layout.rows.reshape(-1, width, lanes).transpose(1, 0, 2).reshape(width, -1)
        by_corner = layout.corners.reshape(-1, 4, lanes).transpose(1, 0, 2).reshape(4, -1)
        self._rows, self._corners = cuda.to_device(by_row), cuda.to_device(by_corner)
        self._element_blocks = -(-by_row.shape[1] // cuda_step.THREADS_A_BLOCK)
        self._node_blocks = -(-self.n_nodes // cuda_step.THREADS_A_BLOCK)
        self._forces_kernel = cuda_step.build_element_forces(strain, bool(self.viscous))

        by_node = np.bincount(self.place, weights=self.mass, minlength=self.n_nodes)
        self._mass = cuda.to_device(by_node)

    def kinetic_energy(self) -> float:
        """`Assembly.kinetic`; fields stay on the GPU, where no body has a frame."""
        return super().kinetic_energy() if self.frames is not None else 0.5 * float(self._sums()[0])

    def moment(self) -> Floats:
        """`Assembly.moment`; fields stay on the GPU, where no body has a frame."""
        return super().moment() if self.frames is not None else self._sums()[1:]

    def _sums(self) -> Floats:
        return sum_motion(self.state.displacement, self.state.velocity, self._mass)

    def _make_state(self, inverse_mass: Floats) -> Fields:
        def make_zeros() -> Any:
            return cuda.to_device(np.zeros(4 * self.n_nodes, self.dtype))

        masses = cuda.to_device(inverse_mass.astype(self.dtype))
        return Fields(make_zeros(), make_zeros(), make_zeros(), masses)

    def _read(self, flat: Any, nodes: slice = EVERY) -> Floats:
        return flat.copy_to_host().reshape(-1, 4)[self.place[nodes], :3].astype(float)

    def _write(self, flat: Any, values: Floats, nodes: slice = EVERY) -> None:
        rows = flat.copy_to_host().reshape(-1, 4)
        rows[self.place[nodes], :3] = values
        flat.copy_to_device(rows.ravel())

    def run_kernel(
        self, state: Fields, steps: int, step: float, given: Given, work: Floats,
        contact: Any = None,
    ) -> tuple[int, float]:  # fmt: skip
        """Launch the steps and wait once, at the end; arguments as of `Assembly.run_kernel`.

        ``contact``: a `qdem_fem.contact.cuda.arrays.DeviceContact`, whose steps follow those of the
        bodies; its ``said`` is set.  Its list may end the window early: then the host waits
        every `LOOK` steps.
        """
        probes, gravity = given.probes, given.gravity
        acted = sort_node_actions(self.n_nodes, given.loads, given.held, probes)
        samples = number_samples(steps, probes)
        taken = int(samples.max(initial=-1)) + 1
        memory = cuda.to_device(acted.memory)
        record = cuda.to_device(np.zeros((max(taken, 1), max(len(probes.node_at), 1), 3)))
        accelerations = np.zeros(3) if gravity is None else gravity
        status = cuda.to_device(np.array([0, steps, 0, 0], dtype=np.int32))
        taken_by_viscosity = cuda.to_device(
            np.zeros(self._rows.shape[1] if self.viscous else 1)  # an empty array had better not be
        )
        half, dt = self.dtype.type(0.5), self.dtype.type(step)
        fields = state.displacement, state.velocity, state.forces
        of_elements = self._corners, self._rows, *fields, status, taken_by_viscosity
        of_nodes = (
            cuda.to_device(acted.first), cuda.to_device(acted.actions),
            cuda.to_device(acted.weights), memory,
            cuda.to_device(np.ascontiguousarray(given.table)), record, *fields, state.inverse_mass,
            cuda.to_device(accelerations.astype(self.dtype)), status, dt,
        )  # fmt: skip
        motion = cuda_step.build_node_motion(gravity is not None)
        launch_forces = self._forces_kernel[self._element_blocks, cuda_step.THREADS_A_BLOCK]
        launch_motion = motion[self._node_blocks, cuda_step.THREADS_A_BLOCK]
        for k, sample in enumerate(samples.tolist()):
            if contact is not None and k % LOOK == 0 and status[cuda_step.LIMIT] <= k:
                break
            if contact is not None:
                contact.launch_push(state.forces, status, k)
            launch_forces(*of_elements, half, dt, k)
            launch_motion(*of_nodes, k, sample)
            if contact is not None:
                contact.launch_step(state.displacement, state.velocity, status, step, k)

        bad, done = (ended := status.copy_to_host().tolist())[:2]
        if contact is not None:
            contact.end(ended)
        remembered = memory.copy_to_host()
        for total, kind in ((0, cuda_step.LOAD), (1, cuda_step.HELD)):
            work[total] += remembered[acted.find_kind(kind)[0], 0].sum()
        work[2] += taken_by_viscosity.copy_to_host().sum()
        place, slot = acted.find_kind(cuda_step.HELD)
        given.held.previous[slot] = remembered[place, 1]
        if taken:
            kept = int(samples[:done].max(initial=-1)) + 1
            probes.record[:kept] = record.copy_to_host()[:kept, : len(probes.node_at)]
        return done, float(bad)
