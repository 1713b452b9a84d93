"""Vibration of QDEM judged by scikit-fem: frequencies, the motion itself, energy (section 3.1).

The cantilever starts from its static shape under the end load and is let go, which is what the
paper does at 2 s.  Frequencies are judged by the eigenvalues of (K, lumped M) of the same mesh;
the motion by the sum over all modes, exact in time, next to Newmark's average acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from qdem_fem.reference_forces import Strain
from qdem_fem.spectra import Mode, peak_frequencies
from validation.case import Check
from validation.qdem_closed_forms import bending_frequency
from validation.qdem_judge import FloatArray, IntArray, free_dof
from validation.qdem_judge_dynamics import newmark
from validation.qdem_problem import (
    Problem,
    below,
    between,
    cantilever,
    near,
    orders,
    reported,
    tip_node,
)

SAFETIES = (0.8, 0.4, 0.2)
"""Steps of QDEM over the critical one."""
NEWMARK_STEPS = (400, 800, 1600)
"""Steps of Newmark's method in a first period."""


@dataclass(frozen=True)
class Record:
    """Displacement of one node after unloading."""

    time: FloatArray
    """[s], (k,)."""
    value: FloatArray
    """[m], (k, 3)."""


def let_go(
    problem: Problem,
    duration: float,
    start: FloatArray,
    node: int,
    *,
    sampling: float | None = None,
    strain: Strain = "finger",
    safety: float = 0.9,
) -> Record:
    """Free motion from the displacement ``start`` (n, 3) [m] at rest, recorded at ``node``."""
    body, run = problem.simulation(strain=strain, safety=safety)
    body.displacement = start
    history = run.advance(duration, {"node": [node]}, sampling)
    return Record(history.time, history["node"])


# --- frequencies ------------------------------------------------------------------------------


def first_frequency(problem: Problem, periods: float = 6.0) -> tuple[Mode, float]:
    """First frequency after unloading, fitted, and that of the judge [Hz]."""
    expected = float(problem.modes().frequency[0])
    node = tip_node(problem.mesh)
    record = let_go(problem, periods / expected, problem.static, node, sampling=0.02 / expected)
    # a mesh without mirror symmetry mixes in the other bending mode, so one cosine is not enough
    modes = peak_frequencies(record.time, record.value[:, 2], count=4, floor=1e-5)
    return modes[0], expected


def five_frequencies(problem: Problem, periods: float = 15.0) -> list[tuple[float, float]]:
    """The five lowest frequencies [Hz], by the judge and by QDEM.

    The shape under a skew force on one corner of the free end is let go, and each component of the
    corner's motion fitted by damped cosines; for each mode of the judge the nearest is taken.
    """
    judge = problem.modes(5).frequency
    corner = problem.loaded[np.argmax(problem.mesh.nodes[problem.loaded] @ [0.0, 1.0, 1.0])]
    load = np.zeros_like(problem.mesh.nodes)
    load[corner] = [0.0, 200.0, -60.0]
    record = let_go(
        problem,
        periods / judge[0],
        problem.static_under(load),
        int(corner),
        sampling=0.15 / judge[-1],
    )
    found = [
        mode.frequency
        for axis in (1, 2)
        for mode in peak_frequencies(record.time, record.value[:, axis], count=8, floor=1e-4)
    ]
    return [(float(f), min(found, key=lambda one: abs(one - f))) for f in judge]


def damped_frequency(problem: Problem, share: float = 0.002) -> tuple[float, float]:
    """Decay rate [1/s] of the first mode with shear viscosity, by the judge and by QDEM.

    The judge's is phi C phi / 2 (small damping); the viscosity makes it ``share`` of omega.
    """
    mode = problem.modes()
    omega = 2 * np.pi * mode.frequency[0]
    unit = problem.with_viscosity(1.0)
    shape = mode.shape[0].ravel()
    per_viscosity = float(shape @ (unit.viscous @ shape)) / 2
    viscous = problem.with_viscosity(share * omega / per_viscosity)
    record = let_go(
        viscous,
        6 / mode.frequency[0],
        problem.static,
        tip_node(problem.mesh),
        sampling=0.02 / mode.frequency[0],
    )
    modes = peak_frequencies(record.time, record.value[:, 2], count=3, floor=1e-5)
    return share * omega, modes[0].decay


def frequency_checks(name: str, problem: Problem) -> list[Check]:
    """First frequency within 0.1 %, five within 0.1 %, decay within 1 %."""
    mode, expected = first_frequency(problem)
    decay_expected, decay = damped_frequency(problem)
    rows = [
        below(f"{name}: first frequency to same mesh", abs(mode.frequency / expected - 1), 1e-3),
        reported(f"{name}: first frequency", mode.frequency, "Hz"),
        below(f"{name}: decay of an elastic motion", abs(mode.decay) / expected, 1e-4),
        below(
            f"{name}: decay with viscosity, to phi C phi/2", abs(decay / decay_expected - 1), 1e-2
        ),
    ]
    for number, (judge, found) in enumerate(five_frequencies(problem), 1):
        rows.append(
            below(
                f"{name}: mode {number}, {judge:.2f} Hz, to same mesh", abs(found / judge - 1), 1e-3
            )
        )
    return rows


# --- the motion itself ------------------------------------------------------------------------


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
    problem = cantilever((24, 4, 4))
    return [*frequency_checks("2,304 elements", problem), *motion_checks(problem)]


def full_checks() -> list[Check]:
    """The same, and the frequencies on 46,080 elements."""
    large = cantilever((96, 10, 8))
    return [
        *quick_checks(),
        *frequency_checks("46,080 elements", large),
        reported("first frequency by Euler and Bernoulli", bending_frequency(1), "Hz"),
        reported("first frequency by Timoshenko", bending_frequency(1, shear=True), "Hz"),
    ]


def paper_size_checks() -> list[Check]:
    """First frequency on the paper's number of elements; the paper has 26.98 Hz."""
    mode, expected = first_frequency(cantilever((222, 22, 20), "five"), periods=3.0)
    return [
        below(
            "488,400 elements: first frequency to same mesh",
            abs(mode.frequency / expected - 1),
            1e-3,
        ),
        near("488,400 elements: first frequency, the paper's", mode.frequency, 26.98, 0.004, "Hz"),
    ]
