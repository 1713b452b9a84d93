"""The time step on a GPU: the twin of `qdem_fem.kernel.cpu.step`, from the same element functions.

A step is two launches.  `build_element_forces`: one thread an element, forces of eqs 1-10 added
to the nodes by atomics.  `build_node_motion`: one thread a node, which does all that happens to
it, loads, velocity Verlet, rollers, given displacements and probes, each written once below.  The
launches of a window follow each other in the order of the stream; nothing waits for the host.
CUDA graphs are not used: a launch still costs the host its arguments, which is what a small mesh
will feel.

Row ``r`` of element ``e`` is ``rows[r, e]``, so that the threads of a warp read side by side; a
node's four numbers are 32 aligned bytes in double precision, one sector of memory.  Atomics, and
no gathering of element forces by node: that would write and read twelve numbers an element more
than the least traffic, while additions in the second-level cache cost none.  The price: the order
of a node's sum is left to the hardware, and two runs agree to round-off only.

Importing this module imports numba.cuda, and raises `LibraryMissing` where that fails;
`qdem_fem.kernel.cuda.assembly` does so when asked for a GPU.
Without fast mathematics: it takes NaN for impossible, and NaN is what the count of bad elements
must see.  Fused multiply-add is on all the same.
"""

from functools import cache
from importlib import import_module
from typing import Any

from qdem_fem.element import MEASURES, Strain, stress
from qdem_fem.files import LibraryMissing

NO_CUDA = "pip install 'trackbed[cuda]' beside an NVIDIA GPU, or compute with device=\"cpu\""
"""What to do where CUDA or its libraries are missing."""

try:
    cuda: Any = import_module("numba.cuda")
    """Untyped: what it holds is settled when it is imported (a GPU, its simulator, neither)."""
except Exception as error:  # without CUDA's runtime numba-cuda raises errors of many kinds
    raise LibraryMissing(
        f"numba.cuda can not be imported ({' '.join(str(error).split())})",
        where='device="cuda"', remedy=NO_CUDA,
    ) from error  # fmt: skip

THREADS_A_BLOCK = 128
"""Threads of a block."""
LOAD, ROLLER, HELD, PROBE = range(4)
"""Kinds of actions on a node, in the order in which a step does them."""
KIND, COMPONENT, SERIES, SLOT = range(4)
"""Columns of ``actions``."""
BAD, LIMIT, AGAIN, DEEP = range(4)
"""Places of ``status``: elements found bad; steps to do, lowered to those done when one is; whether
a vertex has left the skin of its pairs; whether two spheres are too deep in each other."""


compute_element_gradient = cuda.jit(device=True)(stress.compute_element_gradient)
compute_element_pulls = cuda.jit(device=True)(stress.compute_element_pulls)
find_matrix_product = cuda.jit(device=True)(stress.find_matrix_product)


def choose_grid(count: int) -> tuple[int, int]:
    """Blocks and threads of a launch for so many."""
    return max(1, -(-count // THREADS_A_BLOCK)), THREADS_A_BLOCK


@cuda.jit(device=True)
def find_edges(field: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Nodal vectors of corners 1, 2, 3 less that of corner 0; ``a`` to ``d`` is where they lie."""
    x, y, z = field[a], field[a + 1], field[a + 2]
    return (
        field[b] - x, field[b + 1] - y, field[b + 2] - z,
        field[c] - x, field[c + 1] - y, field[c + 2] - z,
        field[d] - x, field[d + 1] - y, field[d + 2] - z,
    )  # fmt: skip


@cuda.jit(device=True)
def add_forces(forces: Any, at: Any, x: Any, y: Any, z: Any) -> None:
    """Add a vector to a node's force."""
    cuda.atomic.add(forces, at, x)
    cuda.atomic.add(forces, at + 1, y)
    cuda.atomic.add(forces, at + 2, z)


def build_pulls_function(strain: Strain, viscous: bool) -> Any:
    """The device function ``(h, w, g, rows, e, half) -> (pulls, J, power)`` of a strain measure.

    The same composition as `qdem_fem.kernel.cpu.step.find_elastic_stress` and
    `qdem_fem.kernel.cpu.step.compute_viscous_pulls`.
    """
    measure = MEASURES[strain]
    elastic = cuda.jit(device=True)(measure.find_stress_numbers)
    if not viscous:

        @cuda.jit(device=True)
        def find_elastic_pulls(h: Any, w: Any, g: Any, rows: Any, e: Any, half: Any) -> Any:
            p, jacobian = elastic(h, rows[9, e], rows[10, e], half)
            return compute_element_pulls(p, g), jacobian, half - half

        return find_elastic_pulls

    if hasattr(measure, "find_fused_pulls"):
        fused = cuda.jit(device=True)(measure.find_fused_pulls)

        @cuda.jit(device=True)
        def fuse_pulls(h: Any, w: Any, g: Any, rows: Any, e: Any, half: Any) -> Any:
            return fused(h, w, g, rows[9, e], rows[10, e], rows[11, e], rows[12, e], half)

        return fuse_pulls

    dashpot = cuda.jit(device=True)(measure.find_viscous_numbers)

    @cuda.jit(device=True)
    def compose_pulls(h: Any, w: Any, g: Any, rows: Any, e: Any, half: Any) -> Any:
        p, jacobian = elastic(h, rows[9, e], rows[10, e], half)
        rate = compute_element_gradient(w, g)
        q = dashpot(h, rate, rows[11, e], rows[12, e], half)
        total = (
            p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3], p[4] + q[4], p[5] + q[5],
            p[6] + q[6], p[7] + q[7], p[8] + q[8],
        )  # fmt: skip
        return compute_element_pulls(total, g), jacobian, find_matrix_product(q, rate)

    return compose_pulls


@cache
def build_element_forces(strain: Strain, viscous: bool) -> Any:
    """The kernel of the elements, compiled when first launched."""
    pulls_of = build_pulls_function(strain, viscous)

    @cuda.jit
    def add_element_forces(
        corners: Any, rows: Any, displacement: Any, velocity: Any, forces: Any, status: Any,
        taken: Any, half: Any, step: Any, k: Any,
    ) -> None:  # fmt: skip
        """Add the forces of all elements to their nodes (eqs 1-10) and count the bad ones.

        ``corners`` (4, m): 4 x node number; ``rows`` (11 or 13, m): gradients [1/m], then
        stiffnesses and viscosities times volume; fields flat, four numbers a node; ``taken``
        (m,) [J]: by viscosity, is added to; ``half``: 0.5 in the fields' precision; ``step`` [s];
        ``k``: number of the step in its window.
        """
        e = cuda.grid(1)
        if e >= corners.shape[1] or k >= status[LIMIT]:
            return
        n0, n1, n2, n3 = corners[0, e], corners[1, e], corners[2, e], corners[3, e]
        g = (
            rows[0, e], rows[1, e], rows[2, e], rows[3, e], rows[4, e], rows[5, e], rows[6, e],
            rows[7, e], rows[8, e],
        )  # fmt: skip
        u = find_edges(displacement, n0, n1, n2, n3)
        w = find_edges(velocity, n0, n1, n2, n3) if viscous else u
        f, jacobian, power = pulls_of(compute_element_gradient(u, g), w, g, rows, e, half)
        if not jacobian > half - half:  # NaN is bad too
            cuda.atomic.add(status, BAD, 1)
        if viscous:
            taken[e] += step * power
        add_forces(forces, n0, f[0] + f[3] + f[6], f[1] + f[4] + f[7], f[2] + f[5] + f[8])
        add_forces(forces, n1, -f[0], -f[1], -f[2])
        add_forces(forces, n2, -f[3], -f[4], -f[5])
        add_forces(forces, n3, -f[6], -f[7], -f[8])

    return add_element_forces


# --- what happens to one node; few nodes have actions, whose sums are in double precision -------


@cuda.jit(device=True)
def add_loads_work(
    begin: Any, end: Any, actions: Any, weights: Any, memory: Any, amplitudes: Any, k: Any,
    velocity: Any, at: Any, step: Any,
) -> None:  # fmt: skip
    """Half a step's work of the node's loads [J], added to ``memory[i, 0]``."""
    for i in range(begin, end):
        if actions[i, KIND] == LOAD:
            force = weights[i, 0] * amplitudes[k, actions[i, SERIES]]
            memory[i, 0] += 0.5 * step * force * velocity[at + actions[i, COMPONENT]]


@cuda.jit(device=True)
def apply_loads(
    begin: Any, end: Any, actions: Any, weights: Any, amplitudes: Any, k: Any, forces: Any, at: Any
) -> None:
    """Add the node's loads to its force."""
    for i in range(begin, end):
        if actions[i, KIND] == LOAD:
            force = weights[i, 0] * amplitudes[k, actions[i, SERIES]]
            forces[at + actions[i, COMPONENT]] += force


@cuda.jit(device=True)
def apply_roller(field: Any, at: Any, weights: Any, i: Any) -> None:
    """Take from a nodal vector its part along the roller's normal ``weights[i]``."""
    across = (
        field[at] * weights[i, 0] + field[at + 1] * weights[i, 1] + field[at + 2] * weights[i, 2]
    )
    field[at] -= across * weights[i, 0]
    field[at + 1] -= across * weights[i, 1]
    field[at + 2] -= across * weights[i, 2]


@cuda.jit(device=True)
def apply_constraints(
    begin: Any, end: Any, actions: Any, weights: Any, memory: Any, amplitudes: Any, k: Any,
    displacement: Any, velocity: Any, inverse_mass: Any, at: Any, step: Any,
) -> None:  # fmt: skip
    """Hold the node in its planes, then its components at their values, and add the work [J].

    ``memory[i]``: work done, and the velocity given in the last step.
    """
    for i in range(begin, end):
        if actions[i, KIND] == ROLLER:
            apply_roller(displacement, at, weights, i)
            apply_roller(velocity, at, weights, i)
        elif actions[i, KIND] == HELD:
            here = at + actions[i, COMPONENT]
            target = weights[i, 0] * amplitudes[k + 1, actions[i, SERIES]]
            before = displacement[here] - step * velocity[here]
            given = (target - before) / step
            impulse = (given - velocity[here]) / inverse_mass
            memory[i, 0] += 0.5 * impulse * (given + memory[i, 1])
            memory[i, 1] = given
            velocity[here] = given
            displacement[here] = target


@cuda.jit(device=True)
def record_probes(
    begin: Any, end: Any, actions: Any, record: Any, sample: Any, displacement: Any, at: Any
) -> None:
    """Write the node's displacement [m] down as sample ``sample`` of the window."""
    for i in range(begin, end):
        if actions[i, KIND] == PROBE:
            for c in range(3):
                record[sample, actions[i, SLOT], c] = displacement[at + c]


@cache
def build_node_motion(gravity: bool) -> Any:
    """The kernel of the nodes; what a simulation does not have is not in its code."""

    @cuda.jit
    def move_nodes(
        first: Any, actions: Any, weights: Any, memory: Any, amplitudes: Any, record: Any,
        displacement: Any, velocity: Any, forces: Any, inverse_masses: Any, accelerations: Any,
        status: Any, step: Any, k: Any, sample: Any,
    ) -> None:  # fmt: skip
        """Loads, ``v += dt (f/m + g)``, ``u += dt v`` (eq. 11), constraints and probes.

        ``first`` (n + 1,): the node's part of ``actions`` (A, 4), ``weights`` (A, 3) and
        ``memory`` (A, 2); ``amplitudes`` (steps + 1, series); ``accelerations`` (3,) [m/s^2];
        ``sample``: where in ``record`` (samples, probes, 3) this step is written, or -1.
        """
        if k >= status[LIMIT]:
            return
        node = cuda.grid(1)
        if node < inverse_masses.size:
            at = 4 * node
            begin, end = first[node], first[node + 1]
            inverse_mass = inverse_masses[node]
            if begin < end:
                add_loads_work(
                    begin, end, actions, weights, memory, amplitudes, k, velocity, at, step
                )
                apply_loads(begin, end, actions, weights, amplitudes, k, forces, at)
            for c in range(3):
                change = forces[at + c] * (step * inverse_mass)
                if gravity:
                    change += accelerations[c] * step
                forces[at + c] = 0
                faster = velocity[at + c] + change
                velocity[at + c] = faster
                displacement[at + c] += faster * step
            if begin < end:
                apply_constraints(
                    begin, end, actions, weights, memory, amplitudes, k, displacement, velocity,
                    inverse_mass, at, step,
                )  # fmt: skip
                add_loads_work(
                    begin, end, actions, weights, memory, amplitudes, k, velocity, at, step
                )
                if sample >= 0:
                    record_probes(begin, end, actions, record, sample, displacement, at)
        if node == 0 and status[BAD] > 0:
            status[LIMIT] = k + 1

    return move_nodes
