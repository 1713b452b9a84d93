"""A time limit: what is left, and what no longer fits in."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from time import perf_counter

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear.factorisation import (
    Factorisation,
    SingularSystem,
    Solve,
    choose_factorisation,
)
from rigid_lcp.friction.problem import FrictionProblem

SLOWEST = 1e9
"""Flops a second that any processor makes, until something was timed."""


@dataclass(frozen=True)
class Clock:
    """When a solve has to end."""

    end: float = inf  # an instant of `time.perf_counter` [s]

    @property
    def left(self) -> float:
        """Time left [s], zero or more."""
        return max(0.0, self.end - perf_counter())

    def share(self, part: float) -> Clock:
        """One that ends when this part [-] of the time left is over."""
        return Clock(perf_counter() + part * self.left)

    @property
    def late(self) -> bool:
        """Whether the time is up."""
        return self.end < inf and self.left == 0.0


NO_LIMIT = Clock()


class TimedFactorisation:
    """Factorisations for as long as there is time for a whole one."""

    def __init__(
        self, problem: FrictionProblem, clock: Clock, linear: Factorisation | None = None
    ) -> None:
        self.linear, self.clock = linear or choose_factorisation(problem), clock
        self.flops = self.linear.flops
        self.cost = self.flops / SLOWEST
        """The least that one took so far [s]."""

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`.  Raises `SingularSystem` too where the time is up, so that methods
        end with their best point."""
        begun = perf_counter()
        if begun + self.cost > self.clock.end:
            raise SingularSystem
        solve = self.linear.factor(a, b)
        self.cost = min(self.cost, perf_counter() - begun)
        return solve
