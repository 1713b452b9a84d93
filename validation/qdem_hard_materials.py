"""Nearly incompressible bodies, and jumps of a thousand in stiffness and density.

Linear tetrahedra lock: an element has one volume and four corners, and a mesh has about five
times as many elements as nodes, so that near nu = 0.5 there are more volumes to keep than
motions to keep them with.  QDEM is linear tetrahedra, so it locks as they do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from qdem_fem import Body, Material
from qdem_fem.mesh_generation import Pattern
from validation.case import Check
from validation.qdem_closed_forms import CONCRETE_BEAM
from validation.qdem_hard_shapes import (
    CONCRETE,
    FORCE,
    critical_checks,
    motion_check,
    static_checks,
)
from validation.qdem_hard_steps import long_run_checks
from validation.qdem_judge import BoolArray, FloatArray, cantilever_p2
from validation.qdem_problem import Problem, below, between, cantilever, reported
from validation.qdem_static import StaticAnswer, relaxed

Cells = tuple[int, int, int]
Property = Literal["young", "density"]
Where = Literal["tip half", "core", "random"]

RATIOS = (0.3, 0.49, 0.4999)
JUMP = 1000.0


def cantilever_of(cells: Cells, pattern: Pattern, poisson: float) -> Problem:
    """The paper's beam with another Poisson's ratio."""
    problem = cantilever(cells, pattern)
    return replace(problem, material=replace(problem.material, poisson=poisson))


def pressure_noise(answer: StaticAnswer) -> float:
    """Root mean square of mean stress over von Mises stress, times three [-]; 1 in a bent beam.

    Bending is uniaxial: mean stress is a third of von Mises stress, whatever nu is.  What is
    above 1 are pressures that alternate from element to element.
    """
    problem = answer.problem
    body = Body(problem.mesh, problem.material)
    body.displacement = answer.displacement
    stress = body.stress()
    volume = body.gradients[1]
    mean = np.trace(stress, axis1=1, axis2=2) / 3
    return float(3 * np.sqrt((volume @ mean**2) / (volume @ body.von_mises() ** 2)))


def locking_checks(meshes: tuple[Cells, ...], finest_p2: Cells) -> list[Check]:
    """Tip over that of quadratic tetrahedra, and over scikit-fem's on the same mesh.

    The tip at 0.4999 over that at 0.3, of the same mesh and relative to the quadratic one, is
    what the volumes lock; the bars only say that it is as bad as that.
    """
    rows = []
    tips: dict[tuple[Cells, Pattern, float], float] = {}
    for poisson in RATIOS:
        beam = replace(CONCRETE_BEAM, poisson=poisson)
        reference = -cantilever_p2(finest_p2, -200.0, beam, "direct")
        rows.append(reported(f"nu {poisson:g}: tip by quadratic tetrahedra, {finest_p2[0]} cells",
                             1e6 * reference, "um"))  # fmt: skip
        for cells in meshes:
            patterns: tuple[Pattern, ...] = ("kuhn", "five")
            for pattern in patterns:
                answer = relaxed(cantilever_of(cells, pattern, poisson), 1e-7)
                share = answer.tip / reference
                tips[cells, pattern, poisson] = share
                name = f"nu {poisson:g}, {pattern}, {cells[0]} x {cells[1]} x {cells[2]}"
                rows += [
                    below(f"{name}: tip to same mesh", answer.difference, 1e-5),
                    reported(f"{name}: tip over that of quadratic tetrahedra", share),
                    reported(f"{name}: alternating pressures, 1 is none", pressure_noise(answer)),
                    reported(f"{name}: evaluations of the forces", answer.steps),
                ]
    for (cells, pattern, poisson), share in tips.items():
        if poisson == RATIOS[-1]:
            left = share / tips[cells, pattern, RATIOS[0]]
            bars = (0.0, 0.05) if pattern == "kuhn" else (0.5, 1.0)
            rows.append(between(
                f"locking at nu {poisson:g}, {pattern}, {cells[0]} cells: share of the tip left",
                left, *bars))  # fmt: skip
    return rows + [step_check(poisson) for poisson in RATIOS[1:]]


def step_check(poisson: float, cells: Cells = (12, 2, 2)) -> Check:
    """The step goes with the dilatational wave: sqrt((1 + nu)(1 - 2 nu)/(1 - nu)).

    Not exactly: the highest mode is not all dilatation.
    """

    def step(nu: float) -> float:
        return cantilever_of(cells, "kuhn", nu).simulation()[1].critical_step.value

    def wave(nu: float) -> float:
        return float(Material(45e9, nu, 2350.0).wave_speed)

    ratio = step(poisson) / step(RATIOS[0]) * wave(poisson) / wave(RATIOS[0])
    name = f"nu {poisson:g}: step times wave speed, over that at nu 0.3"
    return between(name, ratio, 0.9, 1.15)


# --- jumps ------------------------------------------------------------------------------------


def jump_problem(name: Property, where: Where, cells: Cells) -> tuple[Problem, BoolArray]:
    """The beam with a thousandth of a property outside of some elements, and which those are."""
    problem = cantilever(cells)
    mesh = problem.mesh
    middle = mesh.nodes[mesh.elements].mean(axis=1)
    size = mesh.nodes.max(axis=0)
    apart = np.abs(middle / size - 0.5)
    high = {
        "tip half": middle[:, 0] > size[0] / 2,
        "core": (apart[:, 1] < 0.25) & (apart[:, 2] < 0.25),
        "random": np.random.default_rng(0).random(len(middle)) > 0.5,
    }[where]
    values: dict[str, float | FloatArray] = {"young": CONCRETE.young, "density": CONCRETE.density}
    values[name] = np.where(high, values[name], np.asarray(values[name]) / JUMP)
    material = Material(values["young"], CONCRETE.poisson, values["density"])
    return replace(problem, material=material, force=(0.0, 0.0, FORCE[2] / 100)), high


def jump_checks(name: Property, where: Where, cells: Cells, steps: int) -> list[Check]:
    """Same static answer and motion, the right step and element, and no growth close to it."""
    problem, high = jump_problem(name, where, cells)
    title = f"jump of 1000 in {name}, {where}"
    _, run = problem.simulation()
    critical = run.critical_step
    # the stiff elements are the fast ones, and of equal stiffness the light ones
    named = high[critical.element] == (name == "young")
    rows = [
        *(static_checks(title, problem) if name == "young" else []),
        *critical_checks(title, problem, critical),
        below(f"{title}: the element named is in the slow part, 0 is no", float(not named), 0.5),
        motion_check(title, problem),
    ]
    return [*rows, *long_run_checks(title, problem, 0.99, steps)]
