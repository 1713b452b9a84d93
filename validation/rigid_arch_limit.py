"""The thinnest semicircular arch of rigid stones that stands: limit analysis as a linear programme.

Static theorem (Heyman, Int. J. Solids Struct. 2 (1966) 249): the arch stands iff forces at the
corners of its joints exist that push only, stay in Coulomb's cone and balance the weights.  With
friction too high for sliding, as here, this is exact.  For ever more stones the limit is
t/R = 0.1075 (Milankovitch); with few stones hinges open at joints only, and the limit differs.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from validation.rigid_scenes import arch

Floats = NDArray[np.float64]

BALANCED = 1e-9
"""Out-of-balance force that counts as none, over the weight of a stone."""


def arch_unbalance(stones: int, thickness: float, mu: float = 2.0) -> float:
    """Smallest sum of forces and moments that must be added for balance; in weights of a stone.

    ``thickness`` over the mean radius.  Zero: the arch stands.
    """
    from scipy.optimize import linprog

    bodies = arch(stones, thickness, mu=mu).world.scene.bodies[:stones]
    weight = bodies[0].mass
    centre = np.array([body.position for body in bodies])
    joint = pi * np.arange(stones + 1) / stones
    radial = np.column_stack([np.cos(joint), np.sin(joint)])
    radial[0], radial[-1] = (1, 0), (-1, 0)
    onward = np.column_stack([-radial[:, 1], radial[:, 0]])  # pushes stone k on, k - 1 back
    columns = []
    for k in range(stones + 1):
        for radius in (1 - thickness / 2, 1 + thickness / 2):
            for force in (onward[k] + mu * radial[k], onward[k] - mu * radial[k]):
                column = np.zeros((stones, 3))
                for stone, sign in ((k, 1.0), (k - 1, -1.0)):
                    if 0 <= stone < stones:
                        arm = radius * radial[k] - centre[stone]
                        turn = arm[0] * force[1] - arm[1] * force[0]
                        column[stone] = sign * np.array([force[0], force[1], turn])
                columns.append(column.ravel())
    balance = np.column_stack(columns)
    load = np.zeros((stones, 3))
    load[:, 1] = [body.mass / weight for body in bodies]
    size = load.size
    added = np.hstack([np.eye(size), -np.eye(size)])
    cost = np.concatenate([np.zeros(balance.shape[1]), np.ones(2 * size)])
    found = linprog(
        cost, A_eq=np.hstack([balance, added]), b_eq=load.ravel(), bounds=(0, None),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )  # fmt: skip
    return float(found.fun)


def arch_limit(stones: int, mu: float = 2.0, *, tolerance: float = 1e-7) -> float:
    """Least thickness over mean radius at which an arch of so many stones stands, by bisection."""
    low, high = 0.02, 0.3
    while high - low > tolerance:
        middle = (low + high) / 2
        if arch_unbalance(stones, middle, mu) <= BALANCED:
            high = middle
        else:
            low = middle
    return high
