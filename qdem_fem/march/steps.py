"""The march in time: windows of compiled steps, the account of energies, and its alarms."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np

from qdem_fem.bodies import Body, Given
from qdem_fem.contact import run_window
from qdem_fem.element import find_volume_change
from qdem_fem.files import ElementInverted, Floats, Integers, StepWarning, Unstable
from qdem_fem.kernel.cpu import Probes
from qdem_fem.march.energies import find_energy
from qdem_fem.march.leapfrog import constrain_state, stagger_velocities
from qdem_fem.march.state import State


@dataclass(frozen=True)
class MarchNumbers:
    """Windows of compiled steps, and the alarm."""

    least_window: int = 16  # steps of a window [-],
    greatest_window: int = 4096  # and the most
    unstable_growth: float = 10.0  # of kinetic energy over all ever put in: unstable [-]


MARCH = MarchNumbers()


def march(
    run: State, steps: int, stride: int, nodes: Integers, progress: Callable[[float], None] | None
) -> Samples:
    """Compute ``steps``; returns the displacement of ``nodes`` every ``stride`` steps.

    Raises `Unstable` and `ElementInverted`; `StepWarning` when an element makes the step short, or
    it is too long.
    """
    motion, assembly, gravity = run.motion, run.assembly, run.gravity_vector
    if steps:
        motion.step = run.step
    if motion.displacement_set:
        constrain_state(run)
        motion.displacement_set = False
    if run.contacts is not None:
        run.contacts.refresh()
    if isnan(motion.put_in):
        motion.put_in = find_set_energy(run)
    check_step(run)
    stagger_velocities(run)
    loads, held = run.pack_lists()
    samples = Samples(motion.steps_done, steps, stride, len(nodes))
    if samples.first_step == motion.steps_done and len(samples.record):
        samples.record[0] = assembly.field("displacement")[nodes]
    work = assembly.window_work // max(1, len(assembly.elements))
    most = max(MARCH.least_window, min(MARCH.greatest_window, work))
    end = motion.steps_done + steps
    window = assembly.advance_window if run.contacts is None else run.contacts.advance_window
    try:
        while motion.steps_done < end:
            assembly.renew_frames()
            count = min(most, end - motion.steps_done, assembly.find_most_steps(run.step))
            times = run.step * (motion.steps_done + np.arange(count + 1, dtype=float))
            probes = samples.probes(4 * assembly.place[nodes], motion.steps_done)
            before = find_moment(run) if gravity is not None else None
            given = Given(run.conditions.table(times), loads, held, probes, gravity)
            if run.contacts is None and run.rigid is not None:
                done, bad, _ = run_window(run, None, count, run.step, given, motion.work)
            else:
                done, bad = window(count, run.step, given, motion.work)
            motion.steps_done += done
            if gravity is not None and before is not None and done:
                motion.gravity_work += float(gravity @ (find_moment(run) - before))
            check_motion(run, bad)
            if run.contacts is not None:
                run.contacts.check_step(
                    run.step, run.elements_critical_step.value, last=motion.steps_done == end
                )
            if progress is not None:
                progress(run.time)
    finally:
        if run.rigid is not None:
            run.rigid.place_others()
    return samples


class Samples:
    """Displacements at the step numbers of a march that are multiples of ``stride``.

    Of the state that the march begins with only at time zero: an earlier march has it else.
    """

    def __init__(self, start: int, steps: int, stride: int, nodes: int) -> None:
        self.stride = stride
        self.first_step = (start // stride + 1) * stride if start else 0
        count = max(0, (start + steps - self.first_step) // stride + 1)
        self.record = np.zeros((count, nodes, 3))
        """(samples, nodes, 3) [m]"""

    def probes(self, node_at: Integers, steps_done: int) -> Probes:
        """What the kernel writes from step ``steps_done`` on: the samples after it."""
        taken = max(0, (steps_done - self.first_step) // self.stride + 1)
        ahead = self.first_step + taken * self.stride - steps_done
        return Probes(node_at, self.record[taken:], self.stride, ahead)


def check_step(run: State) -> None:
    """Warn, once for the present conditions, of a step that is above the critical one or short."""
    critical = run.critical_step
    remark = "" if run.given_step is not None else critical.remark
    if run.step > critical.value:
        remark = (
            f"the step of {run.step:.4g} s is {run.step / critical.value:.4g} times the critical "
            f"one, which {critical.governor} governs: the motion will grow without bound"
        )
    if remark and run.warned != critical.value:
        run.warned = critical.value
        warnings.warn(remark, StepWarning, stacklevel=4)


def find_set_energy(run: State) -> float:
    """Energy of the state that the march begins with [J]."""
    still = not any(run.assembly.field(name).any() for name in ("displacement", "velocity"))
    if still and run.contacts is None:
        return 0.0
    energy = find_energy(run)
    return energy.kinetic + abs(energy.elastic) + energy.contact


def find_moment(run: State) -> Floats:
    """``sum m u`` [kg m], (3,), whose change times gravity is its work."""
    moment = run.assembly.moment()
    return moment if run.rigid is None else moment + run.rigid.moment()


def check_motion(run: State, bad: float) -> None:
    """Raise when the state can not be right: energy from nothing, or ``bad`` elements."""
    kinetic = run.assembly.kinetic_energy() + (
        0.0 if run.rigid is None else run.rigid.kinetic_energy()
    )
    motion = run.motion
    put_in = motion.put_in + abs(motion.work[:2]).sum() + abs(motion.gravity_work)
    ratio = run.step / run.critical_step.value
    if not kinetic <= MARCH.unstable_growth * put_in and (ratio > 1 or not np.isfinite(kinetic)):
        critical = run.critical_step
        raise Unstable(
            f"the motion grew without bound: {kinetic:.3g} J of kinetic energy from "
            f"{put_in:.3g} J put in; the step of {run.step:.4g} s is {ratio:.3f} times the "
            f"critical one of {critical.value:.4g} s, which {critical.governor} governs",
            where=f"t = {run.time:.6g} s, step {run.steps_done}",
            remedy="take a step below the critical one (safety 0.9 does), or mend the mesh",
        )
    if bad > 0:
        raise_inverted(run)


def raise_inverted(run: State) -> None:
    """Raise `ElementInverted` with the element that is most inside out.

    The kernel met it at the displacement before the last step, and may have left it sound.
    """
    now = run.assembly.field("displacement")
    before = now - run.step * run.assembly.field("velocity")
    found = find_inverted(run.bodies, before) or find_inverted(run.bodies, now)
    name, element, said = found or ("a body", -1, "an element was turned inside out")
    raise ElementInverted(
        said,
        where=f"t = {run.time:.6g} s, step {run.steps_done}",
        remedy=f"what moves {name} crushes it: lower the load or the speed, mesh finer there, or "
        "take a shorter step (the critical one is that of the undeformed mesh)",
        element=element,
    )


def find_inverted(bodies: Sequence[Body], displacement: Floats) -> tuple[str, int, str] | None:
    """The body and element whose volume is most negative, and a sentence; None if none is."""
    found: list[tuple[float, str, int, int]] = []
    ends = np.cumsum([len(body.nodes) for body in bodies])[:-1]
    for body, moved in zip(bodies, np.split(displacement, ends), strict=True):
        if body.rigid:
            continue
        jacobian = np.atleast_2d(1 + find_volume_change(body.find_gradient(moved))).min(axis=0)
        wrong = np.flatnonzero(~(jacobian > 0))
        if wrong.size:
            worst = int(wrong[np.argmin(np.nan_to_num(jacobian[wrong], nan=-np.inf))])
            found.append((float(jacobian[worst]), body.name, worst, wrong.size))
    if not found:
        return None
    volume, name, element, count = min(found)
    said = (
        f"element {element} of {name} was turned inside out (its volume is {volume:.3g} times "
        f"what it was; {count} such elements)"
    )
    return name, element, said
