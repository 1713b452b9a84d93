"""One attempt at a friction problem: the best point so far, and the methods that better it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, SingularSystem, factorisation
from rigid_lcp.cones import length
from rigid_lcp.friction_problem import (
    FrictionProblem,
    FrictionSolution,
    Status,
    friction_solution,
)
from rigid_lcp.gauss_seidel import Sweeper, gauss_seidel, sweeper_of
from rigid_lcp.interior_point import Path, PathStep, interior_point
from rigid_lcp.newton import newton
from rigid_lcp.proximal_newton import FACTORISATIONS, proximal_newton
from rigid_lcp.refinement import refined
from rigid_lcp.sticking import seem_loose, seem_to_stick, sticking

Floats = NDArray[np.float64]

HAND_OVER = 1e-7
"""Residual at which Newton takes over."""
FEW_CONTACTS = 300
"""Up to so many a problem is small: it costs less to factor than to sweep."""
FEW_STEPS = 20
"""Steps of Newton from `HAND_OVER`, where it mostly needs fewer factorisations than proximal
points."""
CONVEX_PATH = Path(convex=True, compliance=1e-4)
CONVEX_SWEEPS, CONVEX_STEPS, CONVEX_CONTACTS = 30, 7, 10_000
CONVEX_END, CONVEX_USEFUL, CONVEX_NEWTON = 1e-4, 1e-3, 5
"""Without a start, and up to so many contacts: sweeps where much is loose; steps along the convex
path to a residual of `CONVEX_END`, and so many of Newton if it came below `CONVEX_USEFUL` (where
little slides)."""
FAST, FAST_SWEEPS = 3e-4, 200
"""A residual that few sweeps leave where so many more may end it."""
BENT_STEPS, BENT_ROUNDING, BENT_USEFUL = 25, 0.3, 1e-6
"""Where that is not enough: steps with the term |u_T|, from where the convex path was left, to
`HAND_OVER`, and Newton from `BENT_USEFUL`.  Coming from there the path folds back seldom."""
UPDATE_FLOPS = 160.0
"""Flops of a factorisation that cost as much as a contact's update in a sweep, over dim^2."""
DEAR = 100.0
"""A factorisation that costs as much as so many sweeps is dear: sweeps go first, and on."""
LAST_WORD, ROUND_OFF = 1e-11, 1e-15
"""At such a tolerance and below a step of Newton ends what the others found: the residual is
measured on the scale of all forces, and only what is exact to round-off is so for a pebble under a
boulder."""
REFINEMENTS, REFINED_CONTACTS = 8, 300
"""Most such steps, where factorisations cost next to nothing; one where there are more contacts."""
GREAT_FORCES = 1e4
"""Forces over what lets go, ``rho |q|``, above which such a residual hides velocities."""

YIELDING_SWEEPS, YIELDING_FEW = 4000, 1000
NEAR_ENOUGH, SMOOTH_SHIFT, SMOOTH_FACTORISATIONS = 1.4, 1e-2, 4
"""A bed that yields: sweeps to so many times the tolerance, from where proximal points with a
great shift, which hardly ever fail, take off what is stiff of the error: a third and more.  After
fewer sweeps than `YIELDING_FEW` some more cost less than that."""


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
            self.best = replace(found, method=name, status=status)
            if found.residual <= self.tolerance:  # whether it solves is for the tolerance here
                self.best = friction_solution(
                    self.problem, found.r, self.tolerance, name, status=status,
                    message=found.message,
                )  # fmt: skip
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

    def yielding(self, start: Floats | None) -> bool:
        """Sweeps that drift, as the error falls like one over their number, and a proximal point
        at their end; whether the tolerance is reached.  In one run: begun again from their best
        point sweeps may go round in circles."""
        near = NEAR_ENOUGH * self.tolerance
        if self.sweep(start, YIELDING_SWEEPS, until=near, factorisations=0):
            return True
        done = int(self.work["sweeps"])
        if done < YIELDING_FEW and self.sweep(
            self.best.r, FAST_SWEEPS + done // 2, factorisations=0
        ):  # fmt: skip
            return True
        if not self.dear:
            self.keep(
                proximal_newton(
                    self.problem, self.best.r, self.tolerance, linear=self.linear,
                    factorisations=SMOOTH_FACTORISATIONS, first_shift=SMOOTH_SHIFT,
                ),
                self.best.method,
            )  # fmt: skip
        return self.best.solved

    def convex_start(self) -> bool:
        """A few sweeps, for what they solve at once; what sticks; a part of the convex path and
        Newton, which solve most static piles.  Small problems are swept only where much is loose,
        and dear ones not factored unless they seem to stick."""
        small = self.problem.contacts <= FEW_CONTACTS
        if not small and self.few_sweeps():
            return True
        if self.dear:
            return self.stick_if_likely()
        stuck = self.stick()
        if self.best.solved or (small and seem_loose(self.problem, stuck.r) and self.few_sweeps()):
            return True
        if self.best.residual <= HAND_OVER:
            self.newton(self.best.r, FEW_STEPS, self.best.method)
            return self.best.solved
        return self.convex_path()

    def few_sweeps(self) -> bool:
        """`CONVEX_SWEEPS`, and more where they converge fast (loose grains, crystals)."""
        self.sweeper = self.sweeper or sweeper_of(self.problem)
        for sweeps in (CONVEX_SWEEPS, FAST_SWEEPS):
            found = gauss_seidel(
                self.problem, self.best.r, self.tolerance, sweeps, sweeper=self.sweeper
            )
            self.keep(found)
            if self.best.solved or found.residual > FAST:
                break
        if self.problem.contacts <= FEW_CONTACTS:
            self.sharpen()
        return self.best.solved

    def convex_path(self) -> bool:
        """A part of the convex path and Newton; then from there on Coulomb's, and Newton."""
        try:
            path = PathStep(self.problem, CONVEX_PATH, self.linear or factorisation(self.problem))
        except SingularSystem:
            return False
        found = self.follow(path, CONVEX_END, CONVEX_STEPS)
        if found.residual < CONVEX_USEFUL:
            self.newton(found.r, CONVEX_NEWTON, found.method)
        if not self.best.solved:
            path.path = replace(CONVEX_PATH, convex=False, rounding=BENT_ROUNDING)
            found = self.follow(path, HAND_OVER, BENT_STEPS)
            if found.residual <= BENT_USEFUL:
                self.newton(found.r, CONVEX_STEPS + 1, found.method)
        return self.best.solved

    def follow(self, path: PathStep, until: float, steps: int) -> FrictionSolution:
        """So many steps on a path at most."""
        return self.keep(
            interior_point(self.problem, None, until, path.path, iterations=steps, begun=path)
        )

    def stick_if_likely(self) -> bool:
        """Where the best point looks like it: all contacts stick; whether that is the answer."""
        if seem_to_stick(self.problem, self.best.r):
            self.stick()
        return self.best.solved

    def stick(self) -> FrictionSolution:
        """Forces at which all contacts stick."""
        exact = ROUND_OFF if self.tolerance <= LAST_WORD else self.tolerance
        self.linear = self.linear or factorisation(self.problem)
        found = self.keep(sticking(self.problem, exact, linear=self.linear))
        self.sharpen()
        return found

    @property
    def dear(self) -> bool:
        """Whether a factorisation costs as much as many sweeps."""
        self.linear = self.linear or factorisation(self.problem)
        update = UPDATE_FLOPS * self.problem.dim**2
        return self.linear.flops > DEAR * update * self.problem.contacts

    @property
    def effort(self) -> float:
        """What was spent so far, about, in flops."""
        factorisations = self.work.get("factorisations", 0.0)
        updates = self.work.get("contact updates", 0.0)
        each = self.linear.flops if self.linear else 0.0
        return factorisations * each + updates * UPDATE_FLOPS * self.problem.dim**2

    @property
    def forces(self) -> float:
        """Size of the best forces over that of what makes the contacts approach, ``rho |q|``."""
        offered = self.problem.rho * length(self.problem.offset)
        return length(self.best.r) / offered if offered > 0.0 else 0.0

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
        """Newton without its shift, from a solution, where the tolerance asks for an exact one."""
        if not self.best.solved or self.tolerance > LAST_WORD:
            return
        exact = ROUND_OFF / max(1.0, self.forces / GREAT_FORCES)
        if self.best.residual > exact:
            steps = REFINEMENTS if self.problem.contacts <= REFINED_CONTACTS else 1
            self.keep(
                refined(self.problem, self.best.r, exact, linear=self.linear, steps=steps),
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
