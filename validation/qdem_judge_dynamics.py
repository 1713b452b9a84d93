"""The judge of QDEM in time: Newmark's method, central differences, slow creep.

Matrices come from `qdem_judge`; M is lumped, a mass a node.  Loads are arrays (n, 3) [N] or
functions of t [s] that return one.  ``record`` names nodes: their displacement is kept each step.
Costs are processor time, split in what is done once and what is done every step.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from scipy.sparse.linalg import cg

from qdem_fem.errors import NotConverged, Unstable, UsageError
from validation.qdem_judge import (
    FloatArray,
    IntArray,
    factorised,
    free_dof,
    multigrid,
    rigid_motions,
)

Load = FloatArray | Callable[[float], FloatArray]
STEP_TOLERANCE = 1e-10
"""Relative residual of conjugate gradients in one step of ``newmark(method="amg")``."""


@dataclass(frozen=True)
class Motion:
    """Displacement of the recorded nodes in time, and the last state."""

    time: FloatArray
    """t [s], (steps + 1,)."""
    recorded: FloatArray
    """u [m] of the nodes of ``record``, (steps + 1, nodes, 3)."""
    displacement: FloatArray
    """Last u [m], (n, 3)."""
    velocity: FloatArray
    """Last velocity [m/s], (n, 3); of `central_difference` half a step earlier."""
    setup_s: float
    """Processor time of what is done once, the factorisation above all [s]."""
    stepping_s: float
    """Processor time of the steps [s]."""


def newmark(
    stiffness: sparse.csr_matrix,
    mass: FloatArray,
    damping: sparse.csr_matrix | None,
    load: Load,
    free: ArrayLike,
    step: float,
    steps: int,
    *,
    displacement: FloatArray | None = None,
    velocity: FloatArray | None = None,
    record: ArrayLike = (),
    beta: float = 0.25,
    gamma: float = 0.5,
    method: Literal["amg", "direct"] = "direct",
    nodes: FloatArray | None = None,
) -> Motion:
    """M a + C v + K u = f by Newmark's method, average acceleration by default, as in the paper.

    ``mass`` (n,) [kg], C [N s/m] or None, ``step`` [s]; starts from ``displacement`` [m] and
    ``velocity`` [m/s], both (n, 3), zero if not given.  Unconditionally stable for
    2 beta >= gamma >= 1/2; conserves energy of an elastic body at beta = 1/4, gamma = 1/2.
    ``direct`` factorises once; ``amg`` solves each step by conjugate gradients to 1e-10, for
    meshes of 20,000 nodes and more, and needs ``nodes``.  Waves shorter than ten steps are wrong
    without any sign of it.
    """
    started = time.process_time()
    size = stiffness.shape[0]
    dof = free_dof(free, size)
    inner, m = stiffness[dof][:, dof].tocsr(), np.repeat(mass, 3)[dof]
    viscous = sparse.csr_matrix(inner.shape) if damping is None else damping[dof][:, dof].tocsr()
    force = _force(load, dof)
    u, v = _start(displacement, dof, size), _start(velocity, dof, size)
    a = (force(0.0) - viscous @ v - inner @ u) / m
    effective = (sparse.diags(m) + gamma * step * viscous + beta * step**2 * inner).tocsr()
    if method == "amg":
        if nodes is None:
            raise UsageError('method="amg" needs the nodes', remedy="pass nodes")
        solve = _steady_solver(effective, rigid_motions(nodes)[dof])
    else:
        solve = factorised(effective)
    keep = _Record(record, steps, size, dof)
    keep(0, u)
    ready = time.process_time()
    for k in range(1, steps + 1):
        ahead = u + step * v + step**2 * (0.5 - beta) * a
        v = v + step * (1 - gamma) * a
        a = solve(force(k * step) - viscous @ v - inner @ ahead)
        u, v = ahead + beta * step**2 * a, v + gamma * step * a
        keep(k, u)
    return keep.motion(step, u, v, ready - started, time.process_time() - ready)


def _steady_solver(
    matrix: sparse.csr_matrix, near_kernel: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Conjugate gradients with one multigrid hierarchy for all steps."""
    precondition = multigrid(matrix, near_kernel).aspreconditioner(cycle="V")

    def solve(right: FloatArray) -> FloatArray:
        answer, flag = cg(matrix, right, rtol=STEP_TOLERANCE, maxiter=200, M=precondition)
        if flag:
            raise NotConverged(
                "conjugate gradients stalled in a time step",
                where="newmark",
                remedy='choose method="direct" or a shorter step',
            )
        return answer

    return solve


def central_difference(
    stiffness: sparse.csr_matrix,
    mass: FloatArray,
    damping: sparse.csr_matrix | None,
    load: Load,
    free: ArrayLike,
    step: float,
    steps: int,
    *,
    displacement: FloatArray | None = None,
    velocity: FloatArray | None = None,
    record: ArrayLike = (),
) -> Motion:
    """The same by central differences, as QDEM steps: the rival with an assembled matrix.

    v_{k+1/2} = v_{k-1/2} + dt M^-1 (f - K u_k - C v_{k-1/2}), u_{k+1} = u_k + dt v_{k+1/2}, with
    v_{1/2} = v_0 + dt/2 a_0.  One product with K a step, another with C.  Raises `Unstable` when
    the motion grows without bound: ``step`` is above 2 / omega_max.  Not for large rotations.
    """
    started = time.process_time()
    size = stiffness.shape[0]
    dof = free_dof(free, size)
    inner, rate = stiffness[dof][:, dof].tocsr(), step / np.repeat(mass, 3)[dof]
    viscous = None if damping is None else damping[dof][:, dof].tocsr()
    force = _force(load, dof)
    u, v = _start(displacement, dof, size), _start(velocity, dof, size)
    keep = _Record(record, steps, size, dof)
    keep(0, u)
    ready = time.process_time()
    with np.errstate(over="ignore", invalid="ignore"):  # growth without bound is told below
        for k in range(steps):
            out_of_balance = force(k * step) - inner @ u
            if viscous is not None:
                out_of_balance -= viscous @ v
            v += (rate if k else rate / 2) * out_of_balance
            u += step * v
            keep(k + 1, u)
    if not np.isfinite(u).all():
        raise Unstable(
            f"the motion grew without bound within {steps} steps of {step:g} s",
            where="central_difference",
            remedy="take a step below 2 / omega_max",
        )
    return keep.motion(step, u, v, ready - started, time.process_time() - ready)


def quasi_static_kelvin_voigt(
    stiffness: sparse.csr_matrix,
    viscous: sparse.csr_matrix,
    load: Load,
    free: ArrayLike,
    step: float,
    steps: int,
    *,
    record: ArrayLike = (),
) -> Motion:
    """C du/dt + K u = f from rest by Euler's backward rule, the creep of section 3.2 slowed down.

    C from `qdem_judge.stiffness_lame` with (lam_D, mu_D) [Pa s]; it may be singular, as volume is
    not damped without bulk viscosity, and then the first step holds the jump at once.  (The
    trapezoidal rule rings on that jump.)  First order: take ``step`` below a hundredth of
    mu_D / E.  Not where inertia counts.
    """
    started = time.process_time()
    size = stiffness.shape[0]
    dof = free_dof(free, size)
    inner, c = stiffness[dof][:, dof].tocsr(), viscous[dof][:, dof].tocsr()
    force, solve = _force(load, dof), factorised(c + step * inner)
    u = np.zeros(len(dof))
    v = np.zeros(len(dof))
    keep = _Record(record, steps, size, dof)
    keep(0, u)
    ready = time.process_time()
    for k in range(1, steps + 1):
        before = u
        u = solve(c @ u + step * force(k * step))
        v = (u - before) / step
        keep(k, u)
    return keep.motion(step, u, v, ready - started, time.process_time() - ready)


class _Record:
    """Displacement of some nodes at each step."""

    def __init__(self, nodes: ArrayLike, steps: int, size: int, dof: IntArray) -> None:
        chosen = np.asarray(nodes, dtype=np.int64).reshape(-1)
        self._size, self._dof = size, dof
        place = np.full(size, len(dof))  # held degrees of freedom read a zero beyond the end
        place[dof] = np.arange(len(dof))
        self._place = place.reshape(-1, 3)[chosen]
        self._recorded = np.zeros((steps + 1, len(chosen), 3))

    def __call__(self, k: int, u: FloatArray) -> None:
        held = self._place == len(self._dof)
        self._recorded[k] = np.where(held, 0.0, u[np.where(held, 0, self._place)])

    def motion(
        self, step: float, u: FloatArray, v: FloatArray, setup: float, stepping: float
    ) -> Motion:
        fields = np.zeros((2, self._size))
        fields[:, self._dof] = u, v
        displacement, velocity = fields.reshape(2, -1, 3)
        times = np.linspace(0.0, step * (len(self._recorded) - 1), len(self._recorded))
        return Motion(times, self._recorded, displacement, velocity, setup, stepping)


def _force(load: Load, dof: IntArray) -> Callable[[float], FloatArray]:
    """The load on the free degrees of freedom as a function of time."""
    if callable(load):
        return lambda t: np.asarray(load(t), float).reshape(-1)[dof]
    steady = np.asarray(load, float).reshape(-1)[dof]
    return lambda t: steady


def _start(field: FloatArray | None, dof: IntArray, size: int) -> FloatArray:
    return np.zeros(len(dof)) if field is None else np.array(field, float).reshape(size)[dof]
