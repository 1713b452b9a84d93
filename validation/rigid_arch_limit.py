"""The thinnest semicircular arch of rigid stones that stands: limit analysis as a linear programme.

Static theorem (Heyman, Int. J. Solids Struct. 2 (1966) 249): the arch stands iff forces at the
corners of its joints exist that push only, stay in Coulomb's cone and balance the weights.  With
friction too high for sliding, as here, this is exact.  For ever more stones the limit is
t/R = 0.1075 (Milankovitch); with few stones hinges open at joints only, and the limit differs.
"""

from __future__ import annotations

from validation.rigid_hard_equilibrium import BALANCED, least_that_rests, unbalance
from validation.rigid_scenes import arch


def arch_unbalance(stones: int, thickness: float, mu: float = 2.0) -> float:
    """Out-of-balance force of an arch, in weights of a stone; ``thickness`` over mean radius."""
    return unbalance(arch(stones, thickness), mu)


def arch_limit(stones: int, mu: float = 2.0, *, tolerance: float = 1e-7) -> float:
    """Least thickness over mean radius at which an arch of so many stones stands."""
    return least_that_rests(
        lambda thickness: arch_unbalance(stones, thickness, mu) <= BALANCED, 0.02, 0.3, tolerance
    )
