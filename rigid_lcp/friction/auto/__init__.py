"""The default solver: a plan of attempts, and the trial that runs it."""

from rigid_lcp.friction.auto.islands import find_islands
from rigid_lcp.friction.auto.solve import solve_auto, solve_friction, solve_problem

__all__ = ["find_islands", "solve_auto", "solve_friction", "solve_problem"]
