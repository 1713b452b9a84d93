"""The largest stable time step, from the highest frequency of the mesh as it is held."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf, sqrt

import numpy as np

from qdem_fem.bodies import Body, find_element_step
from qdem_fem.contact.system import System
from qdem_fem.files import Floats


@dataclass(frozen=True)
class CriticalNumbers:
    """Search for the highest mode, and the remark on an element that makes the step short."""

    residual: float = 1e-3  # of the eigenvector, relative [-]; the eigenvalue errs by its square
    rounds: int = 20  # of Lanczos' method at most, where the material is viscous [-]
    round_change: float = 1e-4  # relative change of the step that ends them [-]
    short_step: float = 1 / 3
    """Share of the median element's own step below which ``2/omega`` is short [-]: even meshes are
    at 1.3, random points' at 0.6 to 0.8, one element of a thirtieth of its altitude at 0.35."""
    samples: int = 4096  # elements of a body that are looked at for the median [-]
    strain: float = 1e-9  # of the motions that are tried [-]


CRITICAL = CriticalNumbers()


@dataclass(frozen=True)
class CriticalStep:
    """Where the explicit scheme becomes unstable, and which element governs it."""

    value: float  # critical time step [s], on the safe side by the residual of the iteration
    omega: float  # highest angular frequency, without viscosity [rad/s]
    element: int
    """The element that governs it: the one with most energy in that motion; -1 where there is no
    deformable body."""
    body: str  # the body that element is in, by whose mesh it is numbered
    mode: Floats  # the governing motion, largest component 1, (n, 3)
    remark: str = ""
    """What to know of a step that one element makes much shorter than the others need."""

    @property
    def governor(self) -> str:
        """What governs it, in words."""
        return "contact" if self.element < 0 else f"element {self.element} of {self.body}"


def find_lagged_viscous_step(stiffness: float, damping: float) -> float:
    """Stable step of one mode when the viscous force uses the velocity half a step behind [s].

    ``u(n+1) - 2 u(n) + u(n-1) + dt c (u(n) - u(n-1)) + dt^2 k u(n) = 0`` is stable up to
    ``dt^2 k + 2 dt c = 4``: ``dt = (sqrt(1 + xi^2) - xi) 2/omega``; ``stiffness`` k per mass
    [1/s^2], ``damping`` c per mass [1/s].
    """
    if stiffness <= 0:
        return 2 / damping if damping > 0 else inf
    return (sqrt(damping**2 + 4 * stiffness) - damping) / stiffness


def find_highest_mode(
    accelerate: Callable[[Floats, Floats], Floats], mass: Floats, *, viscous: bool, seed: int = 0
) -> tuple[float, float, Floats]:
    """Critical step, omega^2 and shape of the governing motion by Lanczos iterations.

    ``accelerate(u, v)`` (n, 3) [m/s^2]: linear in both, zero on held components; ``mass`` (n,)
    [kg].  Lanczos (ARPACK) on ``M^-1/2 (K + 2 C/dt) M^-1/2`` finds in some tens of products what
    a power iteration finds in hundreds.  With viscosity dt is itself in the operator: the
    scheme is stable while ``4 M - 2 dt C - dt^2 K`` is not negative, so dt is found in rounds.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    n = len(mass)
    root = np.sqrt(np.where(mass > 0, mass, 1.0))[:, None]

    def multiply(x: Floats, rate: float) -> Floats:
        u = np.ascontiguousarray(x.reshape(n, 3) / root)
        return (-accelerate(u, rate * u) * root).ravel()

    start = np.random.default_rng(seed).normal(size=3 * n)
    step, rate = inf, 0.0
    if not (multiply(start, 0.0).any() or (viscous and multiply(start, 1.0).any())):
        return inf, 0.0, np.zeros((n, 3))  # all is held
    for _ in range(CRITICAL.rounds):
        operator = LinearOperator((3 * n, 3 * n), matvec=partial(multiply, rate=rate), dtype=float)
        if 3 * n <= 24:  # too small for Lanczos
            matrix = np.stack([operator.matvec(e) for e in np.eye(3 * n)])
            values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
            value, vector = values[-1], vectors[:, -1]
        else:
            values, vectors = eigsh(operator, k=1, which="LA", tol=CRITICAL.residual, v0=start)
            value, vector = values[0], vectors[:, 0]
        residual = float(np.linalg.norm(operator.matvec(vector) - value * vector))
        stiffness = float(vector @ multiply(vector, 0.0))
        damping = max(0.0, (value - stiffness) / rate) if rate > 0 else 0.0
        if rate == 0.0 and viscous:
            damping = float(vector @ (multiply(vector, 1.0) - multiply(vector, 0.0)))
        before, step = step, find_lagged_viscous_step(stiffness + residual, damping)
        start, rate = vector, 2 / step if np.isfinite(step) else 0.0
        if not viscous or abs(step - before) < CRITICAL.round_change * step:
            break
    return step, stiffness, vector.reshape(n, 3) / root


def find_critical_step(
    run: System, springs: Callable[[Floats], Floats] | None = None
) -> CriticalStep:
    """`find_highest_mode` of the kernel's own forces for small motions of a simulation as it is
    held.

    ``springs``: accelerations (n, 3) [m/s^2] that springs beside the elements make of u (n, 3) [m].
    """
    assembly, (_, held) = run.assembly, run.pack_lists()
    if not len(assembly.elements):
        still = np.zeros((assembly.n_nodes, 3))
        return CriticalStep(inf, 0.0, -1, run.bodies[0].name, still)
    size = CRITICAL.strain * max(float(np.ptp(body.nodes, axis=0).max()) for body in run.bodies)
    follows = run.master != np.arange(len(run.master))

    def accelerate(u: Floats, v: Floats) -> Floats:
        u, v = u[run.master], v[run.master]
        scale = size / max(abs(u).max(), 1e-300)
        u, v = (assembly.hold(scale * field, held) for field in (u, v))
        change = assembly.accelerations_own(u, v)
        if springs is not None:
            change = change + springs(u)
        change = assembly.hold(change, held) / scale
        change[follows] = 0.0  # no motion of their own: the operator stays symmetric
        return change

    step, stiffness, mode = find_highest_mode(accelerate, assembly.mass, viscous=run.viscous)
    mode = mode[run.master]
    body, element = find_governing_element(run, mode)
    return CriticalStep(
        value=float(step), omega=float(np.sqrt(max(stiffness, 0.0))),
        element=element, body=body.name, mode=mode / (abs(mode).max() or 1.0),
        remark=describe_short_step(run, stiffness, body, element),
    )  # fmt: skip


def describe_short_step(run: System, stiffness: float, governing: Body, element: int) -> str:
    """Which element makes the step short, where ``2/sqrt(stiffness)`` is so; else nothing.

    ``stiffness`` [1/s^2]: of the governing motion, without what viscosity takes from the step.
    """
    samples = (
        find_element_step(body, slice(None, None, 1 + len(body.elements) // CRITICAL.samples))
        for body in run.bodies
        if not body.rigid
    )
    usual = float(np.median(np.concatenate(list(samples))))
    own = 2 / sqrt(stiffness) if stiffness > 0 else inf
    if not own < CRITICAL.short_step * usual:
        return ""
    return (
        f"element {element} of {governing.name} makes the critical step {own / usual:.2g} times "
        "what the median element would allow; mesh again there if it is a sliver, see "
        "mass_scaling if it is stiff or light"
    )


def find_governing_element(run: System, mode: Floats) -> tuple[Body, int]:
    """The element with most energy in a motion (n, 3), and its body."""
    found: list[tuple[float, Body, int]] = []
    for body, start in zip(run.bodies, run.first_node, strict=False):
        if body.rigid:
            continue
        energy = body.elastic_energy(mode[start : start + len(body.nodes)], "small")
        found.append((float(energy.max()), body, int(np.argmax(energy))))
    _, body, element = max(found, key=lambda entry: entry[0])
    return body, element
