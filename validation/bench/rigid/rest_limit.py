"""Whether a scene can rest at all: forces that push, grip no more than friction, and balance it.

A linear programme over the contacts of the scene (static theorem of limit analysis; for Coulomb's
friction such forces with no motion are a solution, and without them nothing rests).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rigid_lcp.motion.equations import make_body_space
from rigid_lcp.scene.simulation import Simulation
from validation.bench.rigid.scenes import build_arch

BALANCED = 1e-9
"""Out-of-balance force that counts as none, over the weight of the lightest body."""


def find_unbalance(run: Simulation, mu: float) -> float:
    """Smallest sum of forces and moments that must be added for balance under gravity.

    In weights of the lightest body, moments over its size; ``mu`` at all contacts, 2D.  Zero: the
    scene can rest.
    """
    from scipy.optimize import linprog

    world, motion = run.world, run.motion
    contacts = world.contacts(motion, 1e-9 * world.length)
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    mass = world.mass[world.movable]
    weight = float(mass.min() * np.linalg.norm(world.scene.gravity))
    unit = np.tile([1.0, 1.0, 1.0 / world.length], len(mass))
    pull = bodies.jacobian.T.toarray() * unit[:, None]
    edges = [pull[:, ::2] + sign * mu * pull[:, 1::2] for sign in (1, -1)]
    load = np.zeros((len(mass), 3))
    load[:, :2] = mass[:, None] * world.scene.gravity / weight
    eye = np.eye(load.size)
    found = linprog(
        np.concatenate([np.zeros(2 * len(contacts)), np.ones(2 * load.size)]),
        A_eq=np.hstack([*edges, eye, -eye]), b_eq=-load.ravel(), bounds=(0, None),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )  # fmt: skip
    return float(found.fun)


def bisect_rest(rests: Callable[[float], bool], low: float, high: float, off: float) -> float:
    """Least number at which a scene rests, to ``off``, by bisection: at ``high`` it does."""
    while high - low > off:
        middle = (low + high) / 2
        low, high = (low, middle) if rests(middle) else (middle, high)
    return high


def balance_arch(stones: int, thickness: float, mu: float = 2.0) -> float:
    """Out-of-balance force of an arch, in weights of a stone; ``thickness`` over mean radius."""
    return find_unbalance(build_arch(stones, thickness), mu)


def find_arch_limit(stones: int, mu: float = 2.0, *, tolerance: float = 1e-7) -> float:
    """Least thickness over mean radius at which an arch of so many stones stands: 0.1075 for ever
    more stones (Milankovitch), another where few stones leave few joints for hinges."""
    return bisect_rest(
        lambda thickness: balance_arch(stones, thickness, mu) <= BALANCED, 0.02, 0.3, tolerance
    )
