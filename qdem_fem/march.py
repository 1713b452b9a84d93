"""The march in time: windows of compiled steps, the account of energies, and its alarms."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import isnan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from qdem_fem import kernel
from qdem_fem.errors import ElementInverted, StepWarning, Unstable
from qdem_fem.leapfrog import velocities_behind
from qdem_fem.reference_forces import displacement_gradient, volume_change

if TYPE_CHECKING:
    from qdem_fem.simulation import Simulation

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

WINDOW_STEPS = 4096
GRAVITY_STEPS = 16
"""Steps over which the work of a gravity that changes is taken from its mean."""
GROWTH = 10.0
"""Kinetic energy over all energy ever put in, above which a motion is called unstable."""


def march(
    run: Simulation,
    steps: int,
    stride: int,
    nodes: Integers,
    progress: Callable[[float], None] | None,
) -> Floats:
    """Compute ``steps``; returns the displacement [m] of ``nodes`` every ``stride``, (k, nodes, 3).

    Samples are at step numbers that are multiples of ``stride``.  Raises `Unstable` and
    `ElementInverted`; warns once of an element that makes the step short (`StepWarning`).
    """
    if isnan(run.put_in):
        run.put_in = energy_set(run)
    if run.steps_done == 0 and run.critical_step.remark and not run.step_is_given:
        warnings.warn(run.critical_step.remark, StepWarning, stacklevel=3)
    velocities_behind(run)
    assembly, (loads, held) = run.assembly, run.packed_lists()
    start, end = run.steps_done, run.steps_done + steps
    first = 0 if start == 0 else stride - start % stride
    record = np.zeros((max(0, (steps - first) // stride + 1), len(nodes), 3))
    if first == 0 and len(record):
        record[0] = assembly.field("displacement")[nodes]
    most = max(16, min(WINDOW_STEPS, assembly.window_work // len(assembly.elements)))
    if run.gravity is not None and run.gravity.varying is not None:
        most = GRAVITY_STEPS
    while run.steps_done < end:
        assembly.frames_renew()
        count = min(most, end - run.steps_done, assembly.steps_most(run.step))
        times = run.step * (run.steps_done + np.arange(count + 1, dtype=float))
        behind = run.steps_done - start - first  # steps since the first sample
        taken = behind // stride + 1 if behind >= 0 else 0
        ahead = taken * stride - behind
        probes = kernel.Probes(4 * assembly.place[nodes], record[taken:], stride, ahead)
        gravity = run.gravity_at(times)
        before = assembly.field("displacement") if gravity is not None else None
        done, bad = assembly.window(
            count, run.step, loads, held, probes, run.conditions.table(times), gravity, run.work
        )
        run.steps_done += done
        if gravity is not None and before is not None:
            moved = assembly.field("displacement") - before
            run.gravity_work += float(assembly.mass @ (moved @ gravity.mean(axis=0)))
        motion_check(run, bad)
        if progress is not None:
            progress(run.time)
    return record


def energy_set(run: Simulation) -> float:
    """Energy of the state that the march begins with [J]."""
    if not any(run.assembly.field(name).any() for name in ("displacement", "velocity")):
        return 0.0
    energy = run.energy()
    return energy.kinetic + abs(energy.elastic)


def motion_check(run: Simulation, bad: float) -> None:
    """Raise when the state can not be right: energy from nothing, or ``bad`` elements."""
    velocity = run.assembly.field("velocity")
    kinetic = 0.5 * float(run.assembly.mass @ (velocity**2).sum(axis=1))
    put_in = run.put_in + abs(run.work).sum() + abs(run.gravity_work)
    ratio = run.step / run.critical_step.value
    if not kinetic <= GROWTH * put_in and (ratio > 1 or not np.isfinite(kinetic)):
        critical = run.critical_step
        raise Unstable(
            f"the motion grew without bound: {kinetic:.3g} J of kinetic energy from "
            f"{put_in:.3g} J put in; the step of {run.step:.4g} s is {ratio:.3f} times the "
            f"critical one of {critical.value:.4g} s, which element {critical.element} of "
            f"{critical.body} governs",
            where=f"t = {run.time:.6g} s, step {run.steps_done}",
            remedy="take a step below the critical one (safety 0.9 does), or mend the mesh",
        )
    if bad > 0:
        inverted_raise(run)


def inverted_raise(run: Simulation) -> None:
    """Raise `ElementInverted` with the first element that is inside out."""
    where = f"t = {run.time:.6g} s, step {run.steps_done}"
    for body in run.bodies:
        gradient = displacement_gradient(body.gradients[0], body.elements, body.displacement)
        jacobian = 1 + volume_change(gradient)
        wrong = np.flatnonzero(~(jacobian > 0))
        if wrong.size:
            raise ElementInverted(
                f"element {wrong[0]} of {body.name} was turned inside out (its volume is "
                f"{jacobian[wrong[0]]:.3g} times what it was; {wrong.size} such elements)",
                where=where,
                remedy="the load crushes it: lower the load, mesh finer there, or take a "
                "shorter step",
                element=int(wrong[0]),
            )
    raise ElementInverted(
        "an element was turned inside out within one step and back",
        where=where,
        remedy="take a shorter step",
    )
