"""Vibration of QDEM judged by scikit-fem: frequencies and decay of modes (section 3.1).

The cantilever starts from its static shape under the end load and is let go, which is what the
paper does at 2 s.  Frequencies are judged by the eigenvalues of (K, lumped M) of the same mesh.
The motion itself is judged by the sum over all modes, which is exact in time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh

from qdem_fem.report.spectra import Mode, find_peak_frequencies
from validation.bench.qdem.checks import check_below, check_between, fit_order, report
from validation.bench.qdem.judge import FloatArray, IntArray, list_free
from validation.bench.qdem.problem import Problem, find_tip_node
from validation.case import Check

SAFETIES = (0.8, 0.4, 0.2)
"""Steps of QDEM over the critical one."""


@dataclass(frozen=True)
class Record:
    """Displacement of one node after unloading."""

    time: FloatArray
    """[s], (k,)."""
    value: FloatArray
    """[m], (k, 3)."""


def release(
    problem: Problem,
    duration: float,
    start: FloatArray,
    node: int,
    *,
    sampling: float | None = None,
    strain: Any = "finger",
    safety: float = 0.9,
) -> Record:
    """Free motion from the displacement ``start`` (n, 3) [m] at rest, recorded at ``node``."""
    body, run = problem.simulation(strain=strain, safety=safety)
    body.displacement = start
    history = run.advance(duration, {"node": [node]}, sampling)
    return Record(history.time, history["node"])


# --- frequencies ------------------------------------------------------------------------------


def unload(problem: Problem, frequency: float, periods: float) -> Record:
    """The tip after the end load is taken off; ``frequency`` of the first mode [Hz]."""
    return release(
        problem,
        periods / frequency,
        problem.static,
        find_tip_node(problem.mesh),
        sampling=0.02 / frequency,
    )


def find_first_mode(record: Record) -> Mode:
    """The strongest cosine of u_z."""
    # a mesh without mirror symmetry mixes in the other bending mode, so one cosine is not enough
    return find_peak_frequencies(record.time, record.value[:, 2], count=4, floor=1e-5)[0]


def find_first_frequency(problem: Problem, periods: float = 6.0) -> tuple[Mode, float]:
    """First mode after unloading, fitted, and the judge's frequency [Hz]."""
    expected = float(problem.modes().frequency[0])
    return find_first_mode(unload(problem, expected, periods)), expected


@dataclass(frozen=True)
class Frequencies:
    """The lowest frequencies [Hz] by the judge and by QDEM, and the motion that holds them."""

    judge: FloatArray
    found: FloatArray
    record: Record


def find_frequencies(problem: Problem, periods: float = 15.0) -> Frequencies:
    """The five lowest frequencies from one motion.

    The shape under a skew force on one corner of the free end is let go, and each component of the
    corner's motion fitted by damped cosines; for each mode of the judge the nearest is taken.
    """
    judge = problem.modes(5).frequency
    corner = problem.loaded[np.argmax(problem.mesh.nodes[problem.loaded] @ [0.0, 1.0, 1.0])]
    load = np.zeros_like(problem.mesh.nodes)
    load[corner] = [0.0, 200.0, -60.0]
    record = release(
        problem,
        periods / judge[0],
        problem.solve_static(load),
        int(corner),
        sampling=0.15 / judge[-1],
    )
    fitted = [
        mode.frequency
        for axis in (1, 2)
        for mode in find_peak_frequencies(record.time, record.value[:, axis], count=8, floor=1e-4)
    ]
    found = [min(fitted, key=lambda one: abs(one - f)) for f in judge]
    return Frequencies(judge, np.array(found), record)


def check_frequencies(name: str, problem: Problem, five: Frequencies) -> list[Check]:
    """First frequency within 0.1 %, and all five."""
    mode, expected = find_first_frequency(problem)
    rows = [
        check_below(
            f"{name}: first frequency to same mesh", abs(mode.frequency / expected - 1), 1e-3
        ),
        report(f"{name}: first frequency", mode.frequency, "Hz"),
        check_below(f"{name}: decay of an elastic motion", abs(mode.decay) / expected, 1e-4),
    ]
    for number, (judge, found) in enumerate(zip(five.judge, five.found, strict=True), 1):
        label = f"{name}: mode {number}, {judge:.2f} Hz, to same mesh"
        rows.append(check_below(label, abs(found / judge - 1), 1e-3))
    return rows


# --- the motion, by the sum over all modes ----------------------------------------------------


@dataclass(frozen=True)
class Exact:
    """Free motion from rest as the sum over all modes: exact in time for the same mesh."""

    omega: FloatArray
    """[rad/s], (modes,)."""
    weight: FloatArray
    """Displacement of the recorded node in each mode at the start [m], (modes, 3)."""

    def displacement(self, time: FloatArray) -> FloatArray:
        """Displacement of the node [m], (k, 3)."""
        return np.asarray(np.cos(np.outer(time, self.omega)) @ self.weight)


def find_exact_motion(problem: Problem, start: FloatArray, node: int) -> Exact:
    """All modes by LAPACK; for meshes of up to about 1,000 nodes."""
    dof = list_free(problem.free, problem.stiffness.shape[0])
    root = np.sqrt(np.repeat(problem.mass, 3)[dof])
    matrix = problem.stiffness[dof][:, dof].toarray() / np.outer(root, root)
    value, vector = eigh(matrix)
    share = vector.T @ (root * start.ravel()[dof])
    place: IntArray = np.array([int(np.flatnonzero(dof == 3 * node + c)[0]) for c in range(3)])
    shape = vector[place] / root[place, None]
    return Exact(np.sqrt(value), (shape * share).T)


def find_error(found: FloatArray, expected: FloatArray) -> float:
    """|found - expected| / |expected| over the record, Euclidean."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def check_exact_motion(problem: Problem) -> list[Check]:
    """QDEM against the exact motion over two first periods, and its order.

    The start is smooth, equal shares of the five lowest modes: the static shape
    under forces on single nodes holds modes that no step of these resolves.
    """
    node = find_tip_node(problem.mesh)
    lowest = problem.modes(5)
    peaks = np.abs(lowest.shape).max(axis=(1, 2))
    start = 1e-6 * np.tensordot(1 / peaks, lowest.shape, axes=1)
    period = 1 / lowest.frequency[0]
    duration = 2 * period
    exact = find_exact_motion(problem, start, node)
    of_qdem, steps = [], []
    for safety in SAFETIES:
        record = release(
            problem, duration, start, node, strain="small", safety=safety,
            sampling=period / 200,
        )  # fmt: skip
        of_qdem.append(find_error(record.value, exact.displacement(record.time)))
        steps.append(safety)
    return [
        *(
            report(f"motion, QDEM small strain at {safety:g} of the critical step", error)
            for safety, error in zip(SAFETIES, of_qdem, strict=True)
        ),
        check_between("motion, QDEM: order in its step", fit_order(steps, of_qdem), 1.9, 2.1),
    ]
