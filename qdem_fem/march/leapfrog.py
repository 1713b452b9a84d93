"""Velocities level with the displacements, and half a step behind them, as the kernel takes them.

Velocity Verlet in its leapfrog form: ``v(k+1/2) = v(k-1/2) + dt f(u(k), v(k-1/2))/m``.  What the
user sets and sees is ``v(k)``; `stagger_velocities` and `level_velocities` go from one to the
other.
"""

import numpy as np

from qdem_fem.bodies import Given
from qdem_fem.files import Floats
from qdem_fem.march.state import State


def find_velocity(run: State) -> Floats:
    """Velocity at the time of the displacement [m/s], (n, 3)."""
    velocity = run.assembly.field("velocity")
    if run.motion.behind:
        displacement = run.assembly.field("displacement")
        change = 0.5 * run.step * _find_accelerations(run, displacement, velocity)
        _, held = run.pack_lists()
        table = run.conditions.table(run.time + run.step * np.arange(2.0))
        ahead = held.weight * (table[1] - table[0])[held.series] / run.step
        flat = run.assembly.pack_field(velocity + change)
        flat[held.node_at] = 0.5 * (run.assembly.pack_field(velocity)[held.node_at] + ahead)
        velocity = flat.reshape(-1, 4)[run.assembly.place, :3]
    if run.rigid is not None:
        velocity[run.rigid.nodes] = run.rigid.velocity_field(run.find_acting())
    return velocity


def stagger_velocities(run: State) -> None:
    """Take the velocities half a step back, if they are not there yet."""
    if not run.motion.behind:
        displacement = run.assembly.field("displacement")
        velocity = run.assembly.field("velocity")
        change = _find_accelerations(run, displacement, velocity)
        behind = velocity - 0.5 * run.step * change
        run.motion.work[:2] -= find_half_work(run, behind, velocity)
        if run.rigid is not None:
            run.rigid.kick_half(-1, run.find_acting(), run.motion.work)
        _, held = run.pack_lists()
        held.previous[:] = run.assembly.pack_field(behind)[held.node_at]
        run.assembly.set_field("velocity", behind)
        run.motion.work[2] -= find_viscous_half(run)
        run.motion.behind = True


def level_velocities(run: State) -> None:
    """Bring the velocities to the time of the displacements, if they are behind."""
    if run.motion.behind:
        behind, level = run.assembly.field("velocity"), find_velocity(run)
        run.motion.work[:2] += find_half_work(run, behind, level)
        run.motion.work[2] += find_viscous_half(run)
        if run.rigid is not None:
            run.rigid.kick_half(1, run.find_acting(), run.motion.work)
        run.assembly.set_field("velocity", level)
        run.motion.behind = False


def constrain_state(run: State) -> None:
    """Put a displacement that the user set where the conditions allow: else they would in a step.

    Velocities are left to the first step, which counts the work of giving them.
    """
    _, held = run.pack_lists()
    table = run.conditions.table(np.array([run.time]))[0]
    set_by_user = run.assembly.field("displacement")
    flat = run.assembly.pack_field(run.assembly.hold(set_by_user, held))
    flat[held.node_at] = held.weight * table[held.series]
    admitted = flat.reshape(-1, 4)[run.assembly.place, :3]
    if not np.array_equal(admitted, set_by_user):
        run.assembly.set_field("displacement", admitted)


def find_half_work(run: State, behind: Floats, level: Floats) -> Floats:
    """Work in the half step up to now [J], (2,): of loads, of prescribed motion; not on rigid ones.

    ``behind`` and ``level``: velocities (n, 3) [m/s] half a step ago and now.
    """
    loads, held = run.pack_lists()
    table = run.conditions.table(np.array([run.time]))[0]
    mean = run.assembly.pack_field(0.5 * (behind + level))
    force = loads.weight * table[loads.series]
    work = np.array([0.5 * run.step * float(force @ mean[loads.node_at]), 0.0])
    if held.weight.any():  # the impulse that moved the nodes as prescribed
        free = find_free_accelerations(run, run.assembly.field("displacement"), behind)
        missing = run.assembly.pack_field(level - behind - 0.5 * run.step * free)
        inverse = np.asarray(run.assembly.state.inverse_mass, dtype=float)
        mass = 1 / inverse[held.node_at // 4]
        work[1] = mass @ (missing * mean)[held.node_at]
    return work


def find_viscous_half(run: State) -> float:
    """What viscosity takes up to now beyond what the steps have counted [J]; velocities are behind.

    A step counts ``dt f_D(u(k), v(k-1/2)) v(k-1/2)``, and the force does ``dt f_D (v(k-1/2) +
    v(k+1/2))/2``.  As ``f_D`` is linear in v, their sums differ by a quarter of the first and the
    last of them, in second order; the half step up to now is due besides.
    """
    return 0.75 * run.step * run.assembly.viscous_power() if run.viscous else 0.0


def find_free_accelerations(run: State, displacement: Floats, velocity: Floats) -> Floats:
    """What the forces would make of all nodes now if none were held [m/s^2], (n, 3)."""
    loads, _ = run.pack_lists()
    now = np.full(2, run.time)
    given = Given(run.conditions.table(now), loads, gravity=run.gravity_vector)
    free = run.assembly.accelerations(displacement, velocity, given)
    return free if run.contacts is None else free + run.contacts.accelerations()


def _find_accelerations(run: State, displacement: Floats, velocity: Floats) -> Floats:
    """Accelerations now [m/s^2], (n, 3), zero where held."""
    change = find_free_accelerations(run, displacement, velocity)
    return run.assembly.hold(change, run.pack_lists()[1])
