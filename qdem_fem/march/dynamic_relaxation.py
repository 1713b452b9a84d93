"""Static answers with the explicit kernel alone: dynamic relaxation by conjugate gradients.

Dynamic relaxation marches a damped motion with fictitious masses until it rests.  Damping and
step are free; chosen again in every step from the forces, so that each direction is conjugate to
all before, they make the method of conjugate gradients (Papadrakakis 1981, CMAME 25, section 4).
Nothing is assembled: a step costs one evaluation of the forces, as a time step does.  On the
paper's cantilever (six tetrahedra a cell), steps until the tip is right to 1e-5, by the rule for
the damping:

| cells       | kinetic damping | critical damping, best choice | conjugate |
|-------------|-----------------|-------------------------------|-----------|
| 24 x 4 x 3  |            3450 |                          6600 |       380 |
| 48 x 6 x 4  |            5880 |                         11000 |       590 |
| 96 x 10 x 8 |           11480 |                         21200 |      1100 |

Where forces are not linear the step is found by secants along the direction, and directions
begin again when they no longer descend (Polak and Ribiere's rule, cut at zero).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from qdem_fem.bodies import NOTHING, Assembly, Body, Discretisation, remove_held
from qdem_fem.files import ConditionError, ElementInverted, Floats, NotConverged, is_real
from qdem_fem.march.energies import estimate_errors, find_energy
from qdem_fem.march.rigid_motions import check_held
from qdem_fem.march.state import State
from qdem_fem.march.steps import find_inverted


@dataclass(frozen=True)
class RelaxationNumbers:
    """Step lengths, checks of the residual, and the end by rounding."""

    interval: int = 32  # most steps between two true residuals, while forces are near linear [-]
    residual_drift: float = 0.05  # of predicted and true residual that asks for more of them [-]
    slope_left: float = 0.3  # share of the slope along a step at which it is long enough [-]
    trials: int = 12  # of lengths along one direction [-]
    rounding: float = 2.2e-16  # residual over ``|M u|`` at which the last bits of u are felt [-]
    stalls: int = 200  # steps that may be spent there [-]


RELAXATION = RelaxationNumbers()


@dataclass(frozen=True)
class StaticAnswer:
    """How well the equilibrium is met, and what it cost."""

    residual: float  # |f_int + f_ext| on what is free, over |f_ext| or, if larger, the reactions
    solver_bound: float
    """How far this is from the answer of the same mesh at most, in the energy norm and over it: all
    of the residual is taken to pull the softest motion that the iteration met.  A residual alone
    says little of a slender body; this says too much, usually by one to three orders of magnitude.
    NaN where no step was needed, so that no motion was met.  It says nothing of the mesh."""
    discretisation: Discretisation | None
    """How far the mesh's answer is from the body's, estimated; None where nothing is strained."""
    steps: int  # evaluations of the forces, each the cost of a time step
    cpu_s: float  # processor time [s]


def relax(simulation: State, tolerance: float, max_steps: int) -> StaticAnswer:
    """Bring ``simulation`` to rest under its loads and given displacements of the present time.

    Begins at the present displacement, works in double precision in any case, and leaves the
    bodies at rest; time stands still.  The account of energies goes on as if the loads had been
    brought up slowly.  Raises `ConditionError` for bodies that are not held against rigid
    motion, `NotConverged` after ``max_steps`` (the state reached is kept), `ElementInverted` when
    given displacements jump so far that elements next to them turn inside out.
    """
    if not (is_real(tolerance) and 0 < tolerance < 1):
        raise ConditionError(f"a tolerance of {tolerance!r}", where="relax", remedy="take 1e-8")
    if not (is_real(max_steps) and max_steps > 0):
        raise ConditionError(f"max_steps of {max_steps!r}", where="relax", remedy="take 100000")
    started = time.process_time()
    check_held(simulation)
    before = find_energy(simulation)
    problem = StaticProblem(simulation)
    found = _solve_problem(problem, simulation.bodies, tolerance, max_steps)
    problem.finish(simulation, found.displacement)
    after = find_energy(simulation)
    simulation.motion.work[0] += after.elastic - before.elastic - before.kinetic
    if not found.residual <= tolerance:
        raise NotConverged(
            f"the residual is {found.residual:.2e} after {found.steps} steps, {found.ended}; "
            f"{tolerance:.0e} was asked", where="relax",
            remedy="call relax again to go on, ask for less, or apply the load in parts",
        )  # fmt: skip
    return StaticAnswer(
        residual=found.residual, solver_bound=found.bound(2 * after.elastic),
        discretisation=estimate_errors(simulation), steps=found.steps,
        cpu_s=time.process_time() - started,
    )  # fmt: skip


@dataclass
class _Found:
    """Where an iteration is, and what it learned of the stiffness."""

    displacement: Floats
    residual: float = np.inf
    energy: float = np.inf  # ``r M^-1 r`` of the true residual [J]
    steps: int = 0
    ended: str = "the most allowed"
    lengths: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)

    def note(self, u: Floats, r: Floats, size: float, problem: StaticProblem) -> None:
        """Keep a displacement with its true residual ``r`` [N], measured by ``size`` [N]."""
        self.displacement, self.steps = u, problem.steps
        self.residual = float(np.linalg.norm(r) / size) if size > 0 else 0.0
        self.energy = float(r @ (problem.inverse_mass * r))

    def lowest_eigenvalue(self) -> float:
        """Lowest eigenvalue of ``M^-1 K`` met: of the iteration's tridiagonal matrix [-]."""
        from scipy.linalg import eigh_tridiagonal

        inverse = 1 / np.array(self.lengths)
        ratio = np.array(self.ratios)[:-1]
        diagonal = inverse.copy()
        diagonal[1:] += ratio * inverse[:-1]
        beside = np.sqrt(ratio) * inverse[:-1]
        lowest = eigh_tridiagonal(
            diagonal, beside, eigvals_only=True, select="i", select_range=(0, 0)
        )
        return float(lowest[0])

    def bound(self, twice_energy: float) -> float:
        """``|e|_K <= |r|_(M^-1)/sqrt(lowest)``, over ``|u|_K``."""
        if self.energy == 0:
            return 0.0
        if not self.lengths or twice_energy <= 0:
            return np.nan
        return float(np.sqrt(self.energy / max(self.lowest_eigenvalue(), 1e-300) / twice_energy))


def _solve_problem(
    problem: StaticProblem, bodies: Sequence[Body], tolerance: float, max_steps: int
) -> _Found:
    """Conjugate gradients, with the true residual at the end."""
    u = problem.start()
    project, forces, weight = problem.project, problem.find_forces, problem.inverse_mass
    stiff = weight > 0
    found = _Found(u)
    sure = u
    total, sound = forces(u)
    if not sound:
        moved = u.reshape(-1, 4)[problem.assembly.place, :3]
        _, element, said = find_inverted(bodies, moved) or ("", -1, "forces are not finite")
        raise ElementInverted(
            f"the given displacements jump by more than the elements beside them can bear: {said}",
            where="relax",
            remedy="bring them up in parts: prescribe a share, relax, prescribe more",
            element=element,
        )
    r = project(total)
    direction = z = weight * r
    rz, sigma, unchecked, interval, stalls, restart = float(r @ z), 1.0, 0, 1, 0, False
    while True:
        size = problem.force_scale(total, r)
        small = np.linalg.norm(r)
        if small <= RELAXATION.rounding * np.linalg.norm(u[stiff] / weight[stiff]):
            stalls += 1
        if small <= tolerance * size or problem.steps >= max_steps or stalls >= RELAXATION.stalls:
            total, _ = forces(u)
            r = project(total)
            found.note(u, r, size, problem)
            if found.residual <= tolerance or problem.steps >= max_steps:
                return found
            if stalls >= RELAXATION.stalls:
                found.ended = "where rounding keeps it"
                return found
            restart = True
            if found.ratios:
                found.ratios[-1] = 0.0
        if restart or direction @ r <= 0:
            z = weight * r
            direction, rz, restart = z, float(r @ z), False
        checked = unchecked + 1 >= interval
        step = problem.find_step(u, direction, total, r, sigma, checked)
        if step is None:
            if u is sure:
                found.note(u, r, size, problem)
                found.ended = "where every step along the forces turns an element inside out"
                return found
            u, interval, unchecked, restart = sure, 1, 0, True
            total, _ = forces(u)
            r = project(total)
            continue
        sigma, total, drift = step
        u = u + sigma * direction
        unchecked = 0 if checked else unchecked + 1
        if checked:
            sure = u
            loose = drift > RELAXATION.residual_drift
            interval = max(1, interval // 4) if loose else min(2 * interval, RELAXATION.interval)
        before, r = r, project(total)
        z = weight * r
        ratio = max(0.0, float(z @ (r - before)) / rz)
        found.lengths.append(sigma)
        found.ratios.append(ratio)
        rz = float(r @ z)
        direction = z + ratio * direction


class StaticProblem:
    """Forces, constraints and fictitious masses in the kernel's order, four numbers a node."""

    def __init__(self, simulation: State) -> None:
        own = simulation.assembly
        conditions, now = simulation.conditions, np.full(1, simulation.time)
        self.assembly = own
        if own.dtype != np.float64 or type(own) is not Assembly:  # single precision, or a GPU
            self.assembly = Assembly(
                simulation.bodies, simulation.master, simulation.strain, "float64",
                simulation.threads,
            )  # fmt: skip
        assembly, place = self.assembly, self.assembly.place
        loads, held = assembly.pack_lists(conditions, gravity=False)
        row = conditions.table(now)[0]
        self.external = np.zeros(4 * assembly.n_nodes)
        np.add.at(self.external, loads.node_at, loads.weight * row[loads.series])
        gravity = simulation.gravity_vector
        if gravity is not None:
            # the masses of the simulation itself, with what mass scaling added
            weight = np.zeros((assembly.n_nodes, 4))
            weight[place, :3] = own.mass[:, None] * gravity
            used = own.mass > 0
            self.external.reshape(-1, 4)[place[used]] += weight[place[used]]
        self.held, self.target = held, held.weight * row[held.series]
        self.state = assembly._make_state(np.ones(assembly.n_nodes))
        self.inverse_mass = find_inverse_stiffness(simulation, assembly)
        self.initial = simulation.assembly.field("displacement")
        self.steps = 0

    def start(self) -> Floats:
        """The present displacement with given components at their values."""
        u = self.project(self.assembly.pack_field(self.initial))
        u[self.held.node_at] = self.target
        return u

    def finish(self, simulation: State, u: Floats) -> None:
        """Leave the bodies of the simulation at rest at ``u``."""
        moved = u.reshape(-1, 4)[self.assembly.place, :3]
        simulation.assembly.set_field("displacement", moved)
        simulation.assembly.set_field("velocity", np.zeros_like(moved))
        simulation.pack_lists()[1].previous[:] = 0.0
        simulation.motion.behind = False

    def project(self, field: Floats) -> Floats:
        """``field`` without what is held: given components and normals of rollers."""
        return remove_held(field.copy(), self.held)

    def find_forces(self, u: Floats) -> tuple[Floats, bool]:
        """``f_int + f_ext`` [N], reactions included, and whether all elements are sound.

        The kernel's own step of one second with masses of one kilogram, from rest.
        """
        self.steps += 1
        self.state.displacement[:] = u
        self.state.velocity[:] = 0.0
        _, bad = self.assembly.run_kernel(self.state, 1, 1.0, NOTHING, np.zeros(3))
        self.state.forces[:] = 0.0
        return self.state.velocity + self.external, bad == 0 and bool(
            np.isfinite(self.state.velocity).all()
        )

    def find_step(
        self, u: Floats, direction: Floats, total: Floats, r: Floats, sigma: float, checked: bool
    ) -> tuple[float, Floats, float] | None:
        """The length along ``direction`` where the force along it vanishes, the forces there, by
        how much these are not those predicted.

        By secants; unchecked, forces there are those that a straight line through ``sigma``
        predicts.  None when elements turn inside out however short the step is.
        """
        slope = float(direction @ r)
        for _ in range(RELAXATION.trials):
            trial, sound = self.find_forces(u + sigma * direction)
            if sound:
                break
            sigma /= 4
        else:
            return None
        change = (trial - total) / sigma
        bend = -float(direction @ change)
        length = slope / bend if bend > 0 else 4 * sigma
        if not checked:
            return length, total + length * change, 0.0
        predicted = total + length * change
        for _ in range(RELAXATION.trials):
            true, sound = self.find_forces(u + length * direction)
            left = float(direction @ self.project(true))
            if sound and abs(left) <= RELAXATION.slope_left * slope:
                break
            if not sound:
                length /= 4
            else:
                length *= float(np.clip(slope / (slope - left) if left < slope else 4.0, 0.1, 4.0))
        if not sound:
            return None
        drift = float(
            np.linalg.norm(self.project(true - predicted))
            / (np.linalg.norm(self.project(true)) or 1.0)
        )
        return length, true, drift

    def force_scale(self, total: Floats, r: Floats) -> float:
        """What a residual is measured by [N]: the loads, or the reactions where they are larger."""
        reactions = np.linalg.norm(total - r)
        return float(max(np.linalg.norm(self.project(self.external)), reactions))


def find_inverse_stiffness(simulation: State, assembly: Assembly) -> Floats:
    """``1/M`` with fictitious masses M: a third of the trace of ``K_aa`` at every node [N/m].

    ``tr K_aa = sum_e V (lambda + 4 mu) |grad N_a|^2``, the mean over an element's points.
    """
    shares = []
    for body in simulation.bodies:
        every, volumes = body.find_shape_gradients(), body.gradients[1]
        modulus = np.asarray(body.material.lame_first) + 4 * np.asarray(body.material.lame_second)
        squares = (every**2).sum(axis=3).mean(axis=1)
        shares.append(((modulus * volumes)[:, None] * squares / 3).ravel())
    at = assembly.place[assembly.elements]
    trace = np.bincount(at.ravel(), np.concatenate(shares), assembly.n_nodes)
    inverse = np.divide(1.0, trace, out=np.zeros_like(trace), where=trace > 0)
    return np.repeat(inverse, 4)
