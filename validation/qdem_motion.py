"""The motion of QDEM judged by the sum over all modes, exact in time, next to Newmark's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from validation.case import Check
from validation.qdem_judge import FloatArray, IntArray, free_dof
from validation.qdem_judge_dynamics import newmark
from validation.qdem_problem import (
    Problem,
    below,
    between,
    cantilever,
    orders,
    reported,
    tip_node,
)
from validation.qdem_record import Outcome
from validation.qdem_vibration import let_go

SAFETIES = (0.8, 0.4, 0.2)
"""Steps of QDEM over the critical one."""
NEWMARK_STEPS = (400, 800, 1600)
"""Steps of Newmark's method in a first period."""


@dataclass(frozen=True)
class Exact:
    """Free motion from rest as the sum over all modes: exact in time for the same mesh."""

    omega: FloatArray
    """[rad/s], (modes,)."""
    weight: FloatArray
    """Displacement of the recorded node in each mode at the start [m], (modes, 3)."""

    def at(self, time: FloatArray) -> FloatArray:
        """Displacement of the node [m], (k, 3)."""
        return np.asarray(np.cos(np.outer(time, self.omega)) @ self.weight)


def exact_motion(problem: Problem, start: FloatArray, node: int) -> Exact:
    """All modes by LAPACK; for meshes of up to about 1,000 nodes."""
    dof = free_dof(problem.free, problem.stiffness.shape[0])
    root = np.sqrt(np.repeat(problem.mass, 3)[dof])
    matrix = problem.stiffness[dof][:, dof].toarray() / np.outer(root, root)
    value, vector = eigh(matrix)
    share = vector.T @ (root * start.ravel()[dof])
    place: IntArray = np.array([int(np.flatnonzero(dof == 3 * node + c)[0]) for c in range(3)])
    shape = vector[place] / root[place, None]
    return Exact(np.sqrt(value), (shape * share).T)


def error_norm(found: FloatArray, expected: FloatArray) -> float:
    """|found - expected| / |expected| over the record, Euclidean."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def motion_checks(problem: Problem) -> list[Check]:
    """QDEM and Newmark against the exact motion over two first periods, and their orders.

    For the orders the start is smooth, equal shares of the five lowest modes: the static shape
    under forces on single nodes holds modes that no step of these resolves.
    """
    node = tip_node(problem.mesh)
    lowest = problem.modes(5)
    peaks = np.abs(lowest.shape).max(axis=(1, 2))
    start = 1e-6 * np.tensordot(1 / peaks, lowest.shape, axes=1)
    period = 1 / lowest.frequency[0]
    duration = 2 * period
    exact = exact_motion(problem, start, node)
    of_qdem, steps = [], []
    for safety in SAFETIES:
        record = let_go(
            problem, duration, start, node, strain="small", safety=safety,
            sampling=period / 200,
        )  # fmt: skip
        of_qdem.append(error_norm(record.value, exact.at(record.time)))
        steps.append(safety)
    of_newmark = []
    for count in NEWMARK_STEPS:
        motion = newmark(
            problem.stiffness, problem.mass, None, 0 * problem.load, problem.free,
            period / count, 2 * count, displacement=start, record=[node],
        )  # fmt: skip
        of_newmark.append(error_norm(motion.recorded[:, 0], exact.at(motion.time)))
    return [
        *(
            reported(f"motion, QDEM small strain at {safety:g} of the critical step", error)
            for safety, error in zip(SAFETIES, of_qdem, strict=True)
        ),
        between("motion, QDEM: order in its step", orders(steps, of_qdem), 1.9, 2.1),
        *(
            reported(f"motion, Newmark at {count} steps a period", error)
            for count, error in zip(NEWMARK_STEPS, of_newmark, strict=True)
        ),
        between("motion, Newmark: order in its step", -orders(NEWMARK_STEPS, of_newmark), 1.9, 2.1),
        *unloading_checks(problem, duration),
    ]


def unloading_checks(problem: Problem, duration: float) -> list[Check]:
    """The paper's unloading: QDEM to the exact motion, and to Newmark, which is the worse one."""
    node, count = tip_node(problem.mesh), NEWMARK_STEPS[0]
    exact = exact_motion(problem, problem.static, node)
    period = 2 * np.pi / exact.omega[0]
    record = let_go(problem, duration, problem.static, node, sampling=period / 200)
    motion = newmark(
        problem.stiffness, problem.mass, None, 0 * problem.load, problem.free,
        period / count, 2 * count, displacement=problem.static, record=[node],
    )  # fmt: skip
    of_newmark = error_norm(motion.recorded[:, 0], exact.at(motion.time))
    within = record.time <= motion.time[-1]
    columns = [np.interp(record.time, motion.time, motion.recorded[:, 0, c]) for c in range(3)]
    apart = error_norm(record.value[within], np.stack(columns, axis=1)[within])
    return [
        below(
            "unloading, QDEM at 0.9 of the critical step, to the exact motion",
            error_norm(record.value, exact.at(record.time)), 5e-4,
        ),
        below(
            f"unloading, Newmark at {count} steps a period, to the exact motion", of_newmark, 2e-2
        ),
        below(f"unloading, QDEM to Newmark at {count} steps a period", apart, 2e-2),
    ]  # fmt: skip


def quick_checks() -> list[Check]:
    """2,304 elements."""
    return motion_checks(cantilever((24, 4, 4)))


def full() -> Outcome:
    """The same: all modes of a larger mesh are too many for LAPACK."""
    return Outcome(quick_checks())
