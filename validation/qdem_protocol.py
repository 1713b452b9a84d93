"""Section 3.1 of the paper as it was run: load over 1 s, held to 2 s, let go; next to Newmark.

The paper states for 488,361 elements 91.94045 um, standard deviation 0.0550 um, as the mean over
1 to 2 s by QDEM and 91.93975 um by FEM, and shows both curves (Fig. 2).  Here the same on 10,800
elements, as what is compared does not depend on the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from qdem_fem import ramp
from validation.case import Check
from validation.qdem_judge import FloatArray
from validation.qdem_judge_dynamics import newmark
from validation.qdem_problem import Problem, below, cantilever, near, reported, tip_node
from validation.qdem_record import Outcome
from validation.qdem_vibration import Record, first_mode

RAMP, RELEASE, END = 1.0, 2.0, 2.25
"""Times of section 3.1 [s]; the last is ours."""
SAMPLING = 1e-3
"""Of the histories [s]."""
NEWMARK_STEPS = 200
"""Of Newmark's method in a first period."""


@dataclass(frozen=True)
class Histories:
    """u_z of the tip by QDEM and by Newmark's method on the same mesh."""

    time: FloatArray
    """[s], (k,)."""
    qdem: FloatArray
    """[m], (k,)."""
    newmark: FloatArray
    """[m], (k,)."""

    def during(self, start: float, end: float) -> Histories:
        """The part from ``start`` to ``end`` [s]."""
        chosen = (self.time >= start - 1e-9) & (self.time <= end + 1e-9)
        return Histories(self.time[chosen], self.qdem[chosen], self.newmark[chosen])


def histories(problem: Problem, ramped: float, release: float, end: float) -> Histories:
    """Both solutions of a load that grows over ``ramped`` and goes at ``release`` [s]."""
    time = SAMPLING * np.arange(round(end / SAMPLING) + 1, dtype=np.float64)
    qdem = by_qdem(problem, ramped, release, end)
    judge = by_newmark(problem, ramped, release, end)
    return Histories(time, np.interp(time, *qdem), np.asarray(CubicSpline(*judge)(time), float))


def by_qdem(
    problem: Problem, ramped: float, release: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Times [s] and u_z of the tip [m]."""
    node = tip_node(problem.mesh)
    body, run = problem.simulation(ramp(ramped, 1.0))
    # every step or two: what is read between samples must not cost accuracy
    sampling = SAMPLING / 100
    loaded = run.advance(release, {"tip": [node]}, sampling)
    free, going_on = problem.simulation()
    free.displacement, free.velocity = body.displacement, body.velocity
    after = going_on.advance(end - run.time, {"tip": [node]}, sampling)
    return (
        np.append(loaded.time, run.time + after.time[1:]),
        np.append(loaded["tip"][:, 2], after["tip"][1:, 2]),
    )


def by_newmark(
    problem: Problem, ramped: float, release: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Times [s] and u_z of the tip [m], average acceleration, as the paper's FEM."""
    node, free = tip_node(problem.mesh), problem.free
    count = round(release * NEWMARK_STEPS * float(problem.modes().frequency[0]))
    step = release / count
    loaded = newmark(
        problem.stiffness, problem.mass, None, lambda t: min(t / ramped, 1.0) * problem.load,
        free, step, count, record=[node],
    )  # fmt: skip
    more = int(np.ceil((end - release) / step))
    after = newmark(
        problem.stiffness, problem.mass, None, 0 * problem.load, free, step, more,
        displacement=loaded.displacement, velocity=loaded.velocity, record=[node],
    )  # fmt: skip
    return (
        np.append(loaded.time, release + after.time[1:]),
        np.append(loaded.recorded[:, 0, 2], after.recorded[1:, 0, 2]),
    )


def protocol_checks(
    problem: Problem, ramped: float = RAMP, release: float = RELEASE, end: float = END
) -> tuple[list[Check], Histories]:
    """Means while the load rests, and the motion after it has gone."""
    name = f"as the paper, {len(problem.mesh.elements):,} elements"
    both = histories(problem, ramped, release, end)
    held, gone = both.during(ramped, release), both.during(release, end)
    static = float(problem.static[tip_node(problem.mesh), 2])
    frequency = float(problem.modes().frequency[0])
    apart = np.linalg.norm(gone.qdem - gone.newmark) / np.linalg.norm(gone.newmark)
    record = Record(gone.time, np.outer(gone.qdem, [0.0, 0.0, 1.0]))
    # a ramp of n periods leaves 1/(pi n) of the first mode, of which the mean of m keeps 1/(pi m)
    periods = np.array([ramped, release - ramped]) * frequency
    bar = 2 / float(np.prod(np.pi * periods))
    checks = [
        below(f"{name}: mean tip under load, QDEM to Newmark",
              abs(held.qdem.mean() / held.newmark.mean() - 1), 1e-5),
        below(f"{name}: mean tip under load, QDEM to the static solution",
              abs(held.qdem.mean() / static - 1), bar),
        reported(f"{name}: mean tip under load, QDEM", -1e6 * held.qdem.mean(), "um"),
        reported(f"{name}: mean tip under load, Newmark", -1e6 * held.newmark.mean(), "um"),
        reported(f"{name}: standard deviation under load, QDEM", 1e6 * held.qdem.std(), "um"),
        reported(f"{name}: standard deviation under load, Newmark", 1e6 * held.newmark.std(), "um"),
        below(f"{name}: history after unloading, QDEM to Newmark", float(apart), 2e-2),
        near(f"{name}: first frequency after unloading", first_mode(record).frequency,
             frequency, 1e-3, "Hz"),
    ]  # fmt: skip
    return checks, both


def full() -> Outcome:
    """The paper's times on 10,800 elements."""
    checks, both = protocol_checks(cantilever((60, 6, 6), "five"))
    table = {
        "time [s]": both.time,
        "QDEM [um]": 1e6 * both.qdem,
        "Newmark [um]": 1e6 * both.newmark,
    }
    return Outcome(checks, {"protocol": table})
