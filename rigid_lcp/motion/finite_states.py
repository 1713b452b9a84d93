"""States and energies that are numbers still, and which body is to blame where they are not.

Loads, gravity and velocities may each be sound and yet end in forces, or in an energy, that no
floating-point number holds.  A step that ends so is not made; the sentence names the body that
goes fastest, or is pushed most, and by what.
"""

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.errors import ProblemError, SceneError
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import World

FINITE_ENERGY = 1e300
"""An energy [J] that is bounded by this need not be computed to be known as finite."""


def is_finite(world: World, motion: Motion) -> bool:
    """Whether places, angles, velocities, spins and the energy of a state are finite numbers."""
    place, velocity, spin = motion.position, motion.velocity, motion.spin
    gravity = world.scene.gravity
    with np.errstate(all="ignore"):
        squares = np.vdot(place, place) + np.vdot(velocity, velocity) + np.vdot(spin, spin)
        squares += len(place) * np.vdot(gravity, gravity)  # as 2 |g| |x| <= g^2 + x^2
        if world.heaviest * squares < FINITE_ENERGY:
            return bool(np.isfinite(motion.angle).all())
        numbers = (place, motion.angle, velocity, spin, world.energy(motion))
        return all(bool(np.isfinite(each).all()) for each in numbers)


def explain_overflow(
    world: World, motion: Motion, loads: ArrayLike | None, h: float, time: float,
    error: ProblemError | None = None,
) -> SceneError:  # fmt: skip
    """The error of a step of ``h`` [s] from ``motion`` at ``time`` [s] that ends beyond numbers.

    ``loads`` (n, 3) or (n, 6) [N, N m] in it, or None; ``error``: why its contact forces can not be
    computed, if it is they.
    """
    leads = "a state or an energy that is not finite"
    if error is not None:
        leads = f"contact forces that can not be computed ({error.where}: {error.what})"
    with np.errstate(all="ignore"):
        body, cause = _blame(world, motion, loads, h)
        if error is not None and error.where.endswith("inverse_mass"):
            mass, inertia = world.mass, world.least_inertia
            body = int(np.argmin(np.where(world.movable, np.minimum(mass, inertia), np.inf)))
            cause = f"its mass is {mass[body]:.3g} kg, its inertia {inertia[body]:.3g} kg m^2"
    return SceneError(
        f"{cause}: this leads to {leads}", where=f"{world.scene.name_body(body)} at {time:.6g} s",
        remedy="look at loads, gravity, masses and velocities; take a shorter step, or other units",
    )  # fmt: skip


def _blame(world: World, motion: Motion, loads: ArrayLike | None, h: float) -> tuple[int, str]:
    """The body that goes fastest, or is pushed most within ``h`` [s], and what makes it do so."""
    dim, mass, inertia = motion.dim, world.mass, world.least_inertia
    pull = np.zeros(motion.rates.shape) if loads is None else np.asarray(loads, dtype=float)
    weight = np.where(world.movable, np.abs(world.scene.gravity).max(), 0.0)
    speed = np.abs(motion.velocity).max(axis=1)
    spin = np.abs(motion.rates[:, dim:]).max(axis=1)
    force, torque = np.abs(pull[:, :dim]).max(axis=1), np.abs(pull[:, dim:]).max(axis=1)
    turning = h * torque / (inertia if dim == 2 else np.where(world.movable, inertia, np.inf))
    causes = [  # what it is called, its amount, and the speed that it means [m/s]
        ("its velocity is {:.3g} m/s", speed, speed),
        ("its spin is {:.3g} rad/s", spin, spin * world.reach),
        ("gravity is {:.3g} m/s^2", weight, h * weight),
        ("its load is {:.3g} N on {mass:.3g} kg", force, h * force / mass),
        ("its load is {:.3g} N m on {inertia:.3g} kg m^2", torque, turning * world.reach),
    ]
    means = np.nan_to_num(np.array([each[2] for each in causes]), nan=0.0, posinf=np.inf)
    which, body = np.unravel_index(int(np.argmax(means)), means.shape)
    text, amount, _ = causes[which]
    return int(body), text.format(amount[body], mass=mass[body], inertia=inertia[body])
