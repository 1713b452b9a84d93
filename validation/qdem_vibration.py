"""Vibration of QDEM judged by scikit-fem: frequencies and decay of modes (section 3.1).

The cantilever starts from its static shape under the end load and is let go, which is what the
paper does at 2 s.  Frequencies are judged by the eigenvalues of (K, lumped M) of the same mesh.
The motion itself is judged in `qdem_motion`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qdem_fem.reference_forces import Strain
from qdem_fem.spectra import Mode, peak_frequencies
from validation.case import Check
from validation.qdem_closed_forms import (
    bending_frequency,
    cantilever_frequencies,
)
from validation.qdem_judge import FloatArray
from validation.qdem_problem import (
    Problem,
    below,
    cantilever,
    near,
    reported,
    tip_node,
)
from validation.qdem_record import Outcome, Table


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


def unload(problem: Problem, frequency: float, periods: float) -> Record:
    """The tip after the end load is taken off; ``frequency`` of the first mode [Hz]."""
    return let_go(
        problem,
        periods / frequency,
        problem.static,
        tip_node(problem.mesh),
        sampling=0.02 / frequency,
    )


def first_mode(record: Record) -> Mode:
    """The strongest cosine of u_z."""
    # a mesh without mirror symmetry mixes in the other bending mode, so one cosine is not enough
    return peak_frequencies(record.time, record.value[:, 2], count=4, floor=1e-5)[0]


def first_frequency(problem: Problem, periods: float = 6.0) -> tuple[Mode, float]:
    """First mode after unloading, fitted, and the judge's frequency [Hz]."""
    expected = float(problem.modes().frequency[0])
    return first_mode(unload(problem, expected, periods)), expected


@dataclass(frozen=True)
class Frequencies:
    """The lowest frequencies [Hz] by the judge and by QDEM, and the motion that holds them."""

    judge: FloatArray
    found: FloatArray
    record: Record


def five_frequencies(problem: Problem, periods: float = 15.0) -> Frequencies:
    """The five lowest frequencies from one motion.

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
    fitted = [
        mode.frequency
        for axis in (1, 2)
        for mode in peak_frequencies(record.time, record.value[:, axis], count=8, floor=1e-4)
    ]
    found = [min(fitted, key=lambda one: abs(one - f)) for f in judge]
    return Frequencies(judge, np.array(found), record)


def first_decay(problem: Problem, share: float = 0.002) -> tuple[float, float]:
    """Decay rate [1/s] of the first mode with shear viscosity, by the judge and by QDEM.

    The judge's is phi C phi / 2 (small damping); the viscosity makes it ``share`` of omega.
    """
    mode = problem.modes()
    omega = 2 * np.pi * mode.frequency[0]
    unit = problem.with_viscosity(1.0)
    shape = mode.shape[0].ravel()
    per_viscosity = float(shape @ (unit.viscous @ shape)) / 2
    viscous = problem.with_viscosity(share * omega / per_viscosity)
    record = unload(viscous, float(mode.frequency[0]), periods=6.0)
    return share * omega, first_mode(record).decay


def frequency_checks(name: str, problem: Problem, five: Frequencies) -> list[Check]:
    """First frequency within 0.1 %, and all five."""
    mode, expected = first_frequency(problem)
    rows = [
        below(f"{name}: first frequency to same mesh", abs(mode.frequency / expected - 1), 1e-3),
        reported(f"{name}: first frequency", mode.frequency, "Hz"),
        below(f"{name}: decay of an elastic motion", abs(mode.decay) / expected, 1e-4),
    ]
    for number, (judge, found) in enumerate(zip(five.judge, five.found, strict=True), 1):
        label = f"{name}: mode {number}, {judge:.2f} Hz, to same mesh"
        rows.append(below(label, abs(found / judge - 1), 1e-3))
    return rows


def decay_check(name: str, problem: Problem) -> Check:
    """Decay of the first mode by viscosity within 1 %."""
    expected, decay = first_decay(problem)
    label = f"{name}: decay with viscosity, to phi C phi/2"
    return below(label, abs(decay / expected - 1), 1e-2)


# --- the forms --------------------------------------------------------------------------------


def quick_checks() -> list[Check]:
    """2,304 elements."""
    problem, name = cantilever((24, 4, 4)), "2,304 elements"
    five = five_frequencies(problem)
    return [*frequency_checks(name, problem, five), decay_check(name, problem)]


def full() -> Outcome:
    """The same, and 46,080 elements, whose record and modes are kept."""
    large = cantilever((96, 10, 8))
    five = five_frequencies(large)
    checks = [
        *quick_checks(),
        *frequency_checks("46,080 elements", large, five),
        *theory_checks("46,080 elements", five),
        reported("first frequency by Euler-Bernoulli, eq. 13", bending_frequency(1), "Hz"),
        reported("first frequency by Timoshenko", bending_frequency(1, shear=True), "Hz"),
    ]
    release: Table = {
        "time [s]": five.record.time,
        "u_y [um]": 1e6 * five.record.value[:, 1],
        "u_z [um]": 1e6 * five.record.value[:, 2],
    }
    modes: Table = {
        "mode": list(cantilever_frequencies())[: len(five.judge)],
        "scikit-fem [Hz]": five.judge,
        "QDEM [Hz]": five.found,
        "Timoshenko, Saint-Venant [Hz]": list(cantilever_frequencies().values())[: len(five.judge)],
    }
    return Outcome(checks, {"release": release, "modes": modes})


def theory_checks(name: str, five: Frequencies) -> list[Check]:
    """How far the mesh is from beam theory, mode by mode; linear tetrahedra are too stiff."""
    return [
        reported(f"{name}: {mode}, QDEM over beam theory", found / theory)
        for (mode, theory), found in zip(cantilever_frequencies().items(), five.found, strict=False)
    ]


def paper_size() -> Outcome:
    """First frequency on the paper's number of elements; the paper has 26.98 Hz."""
    problem = cantilever((222, 22, 20), "five")
    expected = float(problem.modes().frequency[0])
    record = unload(problem, expected, periods=2.0)
    mode = first_mode(record)
    checks = [
        below(
            "488,400 elements: first frequency to same mesh",
            abs(mode.frequency / expected - 1),
            1e-3,
        ),
        near("488,400 elements: first frequency, the paper's", mode.frequency, 26.98, 0.004, "Hz"),
    ]
    table = {"time [s]": record.time, "u_z [um]": 1e6 * record.value[:, 2]}
    return Outcome(checks, {"release-paper-size": table})
