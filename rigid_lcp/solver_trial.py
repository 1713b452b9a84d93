"""One attempt at a friction problem: the best point so far, and the methods that better it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, factorisation
from rigid_lcp.friction_problem import (
    FrictionProblem,
    FrictionSolution,
    Status,
    friction_solution,
)
from rigid_lcp.gauss_seidel import Sweeper, gauss_seidel, sweeper_of
from rigid_lcp.interior_point import Path, interior_point
from rigid_lcp.newton import newton
from rigid_lcp.proximal_newton import FACTORISATIONS, proximal_newton
from rigid_lcp.sticking import seem_to_stick, sticking

Floats = NDArray[np.float64]

HAND_OVER = 1e-7
"""Residual at which Newton takes over."""
FEW_STEPS = 20
"""Steps of Newton from `HAND_OVER`, where it mostly needs fewer factorisations than proximal
points."""
CONVEX_PATH = Path(convex=True, compliance=1e-4)
CONVEX_SWEEPS, CONVEX_STEPS, CONVEX_CONTACTS = 30, 7, 10_000
CONVEX_END, CONVEX_USEFUL = 1e-4, 1e-3
"""Without a start, and up to so many contacts: sweeps, steps along the convex path to a residual
of `CONVEX_END`, and Newton from there if it came below `CONVEX_USEFUL` (where little slides)."""
UPDATE_FLOPS = 160.0
"""Flops of a factorisation that cost as much as a contact's update in a sweep, over dim^2."""
DEAR = 100.0
"""A factorisation that costs as much as so many sweeps is dear: sweeps go first, and on."""
LAST_WORD, ROUND_OFF = 1e-11, 1e-15
"""At such a tolerance and below a step of Newton ends what the others found: the residual is
measured on the scale of all forces, and only what is exact to round-off is so for a pebble under a
boulder."""


class Trial:
    """The best point so far, who found it, and the work of all."""

    def __init__(self, problem: FrictionProblem, start: Floats | None, tolerance: float) -> None:
        zero = np.zeros(len(problem.offset))
        self.problem, self.tolerance, self.work = problem, tolerance, dict[str, float]()
        self.best = friction_solution(problem, zero, tolerance, "no forces")
        self.linear: Factorisation | None = None
        self.sweeper: Sweeper | None = None
        if start is not None:
            self.keep(friction_solution(problem, start, tolerance, "start"))

    def keep(self, found: FrictionSolution, after: str = "") -> FrictionSolution:
        """Count the work of a solution and keep it if it is the best; gives it back."""
        named = found.method == "gauss-seidel" or "islands" in found.work  # islands name their own
        for name, count in found.work.items():
            key = name if named or name == "factorisations" else f"{found.method} {name}"
            self.work[key] = self.work.get(key, 0.0) + count
        if found.residual < self.best.residual or not np.isfinite(self.best.residual):
            name = f"{after} + {found.method}" if after else found.method
            status = "not converged" if found.status == "solved" else found.status
            self.best = friction_solution(
                self.problem, found.r, self.tolerance, name, status=status, message=found.message
            )
        return found

    def polish(
        self, found: FrictionSolution, after: str = "", factorisations: int = FACTORISATIONS
    ) -> bool:
        """Proximal points from a point of another method; whether the tolerance is reached."""
        if self.best.solved or not np.isfinite(found.residual):
            return self.best.solved
        if found.residual <= HAND_OVER:
            found = self.newton(found.r, FEW_STEPS, after or found.method)
        if self.best.solved or factorisations == 0:
            return self.best.solved
        self.linear = self.linear or factorisation(self.problem)
        self.keep(
            proximal_newton(
                self.problem, found.r, self.tolerance, linear=self.linear,
                factorisations=factorisations,
            ),
            after or found.method,
        )  # fmt: skip
        self.sharpen()
        return self.best.solved

    def sweep(
        self, start: Floats | None, sweeps: int, after: str = "", until: float = 0.0,
        factorisations: int = FACTORISATIONS,
    ) -> bool:  # fmt: skip
        """Gauss-Seidel to a residual of ``until``, and Newton; whether the tolerance is reached."""
        until = max(until, self.tolerance)
        self.sweeper = self.sweeper or sweeper_of(self.problem)
        found = self.keep(
            gauss_seidel(self.problem, start, until, sweeps, sweeper=self.sweeper), after
        )
        name = f"{after} + gauss-seidel" if after else "gauss-seidel"
        return self.best.solved or self.polish(found, name, factorisations)

    def convex_start(self) -> bool:
        """A few sweeps; then what sticks, or a part of the convex path (where a factorisation is
        not dear) and Newton: solves most static piles."""
        self.sweeper = self.sweeper or sweeper_of(self.problem)
        self.keep(
            gauss_seidel(self.problem, None, self.tolerance, CONVEX_SWEEPS, sweeper=self.sweeper)
        )
        if self.best.solved:
            self.sharpen()
            return True
        if self.stick():
            return True
        found, steps, name = self.best, FEW_STEPS, self.best.method
        if self.dear and found.residual > HAND_OVER:
            return False
        if found.residual > HAND_OVER:
            found = self.keep(
                interior_point(
                    self.problem, None, CONVEX_END, CONVEX_PATH, linear=self.linear,
                    iterations=CONVEX_STEPS,
                )
            )  # fmt: skip
            steps, name = CONVEX_STEPS + 1, found.method
        if found.residual < CONVEX_USEFUL:
            self.newton(found.r, steps, name)
        return self.best.solved

    def stick(self) -> bool:
        """Where the best point looks like it: all contacts stick; whether that is the answer."""
        if seem_to_stick(self.problem, self.best.r):
            exact = ROUND_OFF if self.tolerance <= LAST_WORD else self.tolerance
            self.linear = self.linear or factorisation(self.problem)
            self.keep(sticking(self.problem, exact, linear=self.linear))
            self.sharpen()
        return self.best.solved

    @property
    def dear(self) -> bool:
        """Whether a factorisation costs as much as many sweeps."""
        self.linear = self.linear or factorisation(self.problem)
        update = UPDATE_FLOPS * self.problem.dim**2
        return self.linear.flops > DEAR * update * self.problem.contacts

    def newton(self, start: Floats, steps: int, after: str) -> FrictionSolution:
        """So many steps of Newton, and one more where the answer is to be exact."""
        self.linear = self.linear or factorisation(self.problem)
        found = self.keep(
            newton(self.problem, start, self.tolerance, linear=self.linear, iterations=steps),
            after,
        )
        self.sharpen()
        return found

    def sharpen(self) -> None:
        """One step of Newton from a solution where the tolerance asks for an exact one."""
        if self.best.solved and self.best.residual > ROUND_OFF and self.tolerance <= LAST_WORD:
            self.keep(
                newton(self.problem, self.best.r, ROUND_OFF, linear=self.linear, iterations=1),
                self.best.method,
            )

    def solution(self, status: Status | None = None, message: str = "") -> FrictionSolution:
        """The best point, with the work of all attempts."""
        best = self.best
        if not best.solved and not message:
            message = (
                f"no method reached {self.tolerance:.2g}; the best residual is {best.residual:.2g}"
                f" by {best.method}\n  -> look at W (a mass of zero? an entry of the wrong sign?),"
                " ask for less, or give forces near the solution as start"
            )
        return FrictionSolution(
            best.r, best.u, best.residual, status or best.status, best.method, self.work,
            "" if best.solved else message,
        )  # fmt: skip
