"""The slab of section 3.2 with the paper's ends, which do not slip, and what eq. 14 assumes.

Judged by scikit-fem, as no closed form is known: creep by the quasi-static equation
C du/dt + K u = f, damped vibration by the decay phi C phi/2 of the same mesh's mode.

Eq. 14 is a rod of one dimension of axial viscosity mu_D.  With eq. 7 that is a solid with
lam_D = -mu_D between rollers, whose bulk viscosity lam_D + 2/3 mu_D is negative.  With the paper's
own bulk viscosity of zero lam_D is -2/3 mu_D and the axial viscosity 4/3 mu_D: that, and not the
ends, is most of the delay which the paper sees.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from qdem_fem import Material
from qdem_fem.mesh_generation import box_mesh
from qdem_fem.spectra import peak_frequencies
from validation import qdem_judge
from validation.case import Check
from validation.qdem_closed_forms import creep_equation_14, creep_uniaxial_strain
from validation.qdem_judge import FloatArray
from validation.qdem_judge_dynamics import quasi_static_kelvin_voigt
from validation.qdem_problem import Problem, below, between, near, reported
from validation.qdem_record import Outcome, Table
from validation.qdem_viscous import (
    DENSITY,
    END,
    HEIGHT,
    RISE,
    SAMPLING,
    STRESS,
    VISCOSITY_SOFT,
    YOUNG_SOFT,
    convolved,
    load_history,
)

YOUNG, VISCOSITY = 45e9, 1e4
"""Of the damped vibration [Pa], [Pa s]."""
PAPER_DECAY = 0.015
"""Decay rate over mu_D that the paper measures [1/(Pa s^2)]."""
PAPER_UNLOADED = 0.5
"""t_0 of eq. 14 [s]."""
MODES = 12
"""Lowest ones, the thickness mode among them: it is the one that a load on the top excites."""


def slab(cells: tuple[int, int, int], young: float = YOUNG_SOFT) -> Problem:
    """Section 3.2: the bottom held, the top free to move in z alone, 10 N on its nodes."""
    mesh = box_mesh((2.4, 0.25, HEIGHT), cells)
    free = np.ones(mesh.nodes.shape, bool)
    free[mesh.node_sets["z-min"]] = False
    free[mesh.node_sets["z-max"], :2] = False
    viscosity = VISCOSITY_SOFT if young == YOUNG_SOFT else VISCOSITY
    material = Material(young, 0.0, DENSITY, shear_viscosity=viscosity)
    return Problem(mesh, material, free, mesh.node_sets["z-max"], (0.0, 0.0, -10.0))


# --- creep ------------------------------------------------------------------------------------


def top_centre(problem: Problem) -> int:
    """The node whose strain the paper shows."""
    return int(np.argmin(np.linalg.norm(problem.mesh.nodes - [1.2, 0.125, HEIGHT], axis=1)))


def creep_both(problem: Problem, steps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times [s] and strain at the centre of the top by QDEM and by scikit-fem.

    The latter is backward Euler at two steps, extrapolated to none: its error is first order.
    """
    centre, load = top_centre(problem), load_history()
    _, run = problem.simulation(load)
    history = run.advance(END, {"centre": [centre]}, SAMPLING)
    answers = []
    for count in (steps, 2 * steps):
        motion = quasi_static_kelvin_voigt(
            problem.stiffness, problem.viscous, lambda t: load(t) * problem.load, problem.free,
            END / count, count, record=[centre],
        )  # fmt: skip
        answers.append(np.interp(history.time, motion.time, -motion.recorded[:, 0, 2] / HEIGHT))
    return history.time, -history["centre"][:, 2] / HEIGHT, 2 * answers[1] - answers[0]


def creep_checks(cells: tuple[int, int, int], steps: int) -> tuple[list[Check], Table]:
    """QDEM to scikit-fem, and what of the delay behind eq. 14 the ends explain."""
    problem = slab(cells)
    time, strain, expected = creep_both(problem, steps)
    off = np.abs(strain - expected).max() / expected.max()
    # a time mu_D/E after the middle of the smooth step of the load
    at = np.array([RISE / 2 + VISCOSITY_SOFT / YOUNG_SOFT])
    assumed = float(convolved(creep_equation_14, at)[0])
    solid = float(convolved(creep_uniaxial_strain, at)[0])
    ends = float(CubicSpline(time, strain)(at[0]))
    full_strain = STRESS / YOUNG_SOFT
    checks = [
        below("creep and recovery, ends that do not slip, to scikit-fem", 100 * off, 0.5, "%"),
        reported(
            "static strain at the centre of the top, share of P/EA",
            -problem.static[top_centre(problem), 2] / HEIGHT / full_strain,
        ),
        reported("at t = mu_D/E, share of P/EA: eq. 14", assumed / full_strain),
        reported("at t = mu_D/E, share of P/EA: uniaxial strain", solid / full_strain),
        reported("at t = mu_D/E, share of P/EA: QDEM, ends of the paper", ends / full_strain),
        between(
            "share of the delay behind eq. 14 that 4/3 mu_D explains",
            (assumed - solid) / (assumed - ends),
            0.5,
            1.0,
        ),
    ]
    table: Table = {
        "time [s]": time,
        "QDEM": strain / full_strain,
        "scikit-fem": expected / full_strain,
    }
    return checks, table


# --- eq. 14 -----------------------------------------------------------------------------------


def equation_14_checks(steps: int = 200) -> list[Check]:
    """What eq. 14 assumes, by scikit-fem, and the sign of its second branch as printed."""
    mesh = box_mesh((0.11, 0.11, HEIGHT), (2, 2, 4))
    free = np.zeros(mesh.nodes.shape, bool)
    free[:, 2] = mesh.nodes[:, 2] > 0
    tau = VISCOSITY_SOFT / YOUNG_SOFT
    stiffness = qdem_judge.stiffness(mesh.nodes, mesh.elements, YOUNG_SOFT, 0.0)
    force = stiffness @ (STRESS / YOUNG_SOFT * mesh.nodes * [0, 0, -1]).ravel()
    top = int(mesh.node_sets["z-max"][0])
    rows = []
    for words, ratio, bar in (
        ("lam_D = -mu_D", -1.0, True),
        ("lam_D = -2/3 mu_D, as section 3.2 sets", -2 / 3, False),
    ):
        viscous = qdem_judge.stiffness_lame(
            mesh.nodes, mesh.elements, ratio * VISCOSITY_SOFT, VISCOSITY_SOFT
        )
        answers = []
        for count in (steps, 2 * steps):
            motion = quasi_static_kelvin_voigt(
                stiffness, viscous, force.reshape(-1, 3), free, 4 * tau / count, count,
                record=[top],
            )  # fmt: skip
            answers.append(-motion.recorded[:: count // steps, 0, 2] / HEIGHT)
        strain = 2 * answers[1] - answers[0]
        time = 4 * tau / steps * np.arange(steps + 1)
        assumed = creep_equation_14(time, STRESS, YOUNG_SOFT, VISCOSITY_SOFT)
        off = 100 * float(np.abs(strain - assumed).max()) * YOUNG_SOFT / STRESS
        name = f"eq. 14 to scikit-fem between rollers, {words}"
        rows.append(below(name, off, 0.5, "%") if bar else between(name, off, 5.0, 20.0, "%"))
    return [*rows, *printed_sign_checks()]


def printed_sign_checks() -> list[Check]:
    """The strain just after unloading over that just before: 1 for any body of this kind."""
    before, after = PAPER_UNLOADED * (1 - 1e-9), PAPER_UNLOADED * (1 + 1e-9)

    def ratio(printed: bool) -> float:
        strain = [
            float(
                creep_equation_14(
                    t, STRESS, YOUNG_SOFT, VISCOSITY_SOFT, PAPER_UNLOADED, printed=printed
                )
            )
            for t in (before, after)
        ]
        return strain[1] / strain[0]

    return [
        near("strain after over before unloading, eq. 14 with +t0", ratio(False), 1.0, 1e-6),
        between("strain after over before unloading, eq. 14 as printed", ratio(True), -1.0, 0.0),
    ]


# --- damped vibration -------------------------------------------------------------------------


def decay_checks(cells: tuple[int, int, int]) -> list[Check]:
    """Decay of the slab's thickness mode, let go in the mode's own shape.

    The record is the share of that mode in the motion, phi M u: at a single node the other modes
    that the slab has near this frequency would disturb the fit.
    """
    problem = slab(cells, YOUNG)
    modes = problem.modes(MODES)
    mass = np.repeat(problem.mass, 3)
    still = problem.static.ravel()
    shares = [float(shape.ravel() @ (mass * still)) ** 2 for shape in modes.shape]
    chosen = int(np.argmax(shares))
    shape, frequency = modes.shape[chosen], float(modes.frequency[chosen])
    judge = float(shape.ravel() @ (problem.viscous @ shape.ravel())) / 2
    body, run = problem.simulation()
    body.displacement = 1e-9 * shape / np.abs(shape).max()
    values = []
    stride = max(1, round(1 / frequency / 20 / run.step))
    for _ in range(160):
        values.append(float(shape.ravel() @ (mass * body.displacement.ravel())))
        run.advance(stride * run.step)
    time = stride * run.step * np.arange(len(values), dtype=np.float64)
    found = peak_frequencies(time, np.array(values), count=1)[0]
    return [
        below("slab of the paper: decay to phi C phi/2", abs(found.decay / judge - 1), 1e-2),
        below(
            "slab of the paper: frequency to same mesh", abs(found.frequency / frequency - 1), 1e-2
        ),
        reported(
            "slab of the paper: share of this mode", max(shares) / float(still @ (mass * still))
        ),
        near("slab of the paper: decay over mu_D", found.decay / VISCOSITY, PAPER_DECAY, 0.06),
    ]


def quick_checks() -> list[Check]:
    """A slab of 960 elements."""
    checks, _ = creep_checks((10, 4, 4), 400)
    return [*checks, *equation_14_checks(), *decay_checks((20, 4, 4))]


def full() -> Outcome:
    """Slabs of 5,760 and 8,640 elements."""
    checks, table = creep_checks((40, 6, 4), 800)
    rows = [*checks, *equation_14_checks(), *decay_checks((40, 6, 6))]
    return Outcome(rows, {"creep-slab": table})
