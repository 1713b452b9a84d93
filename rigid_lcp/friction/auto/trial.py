"""One attempt at a friction problem: the best point so far, and the methods that better it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.attempts import (
    POINTS,
    PROXIMAL,
    extrapolate_points,
    refine_forces,
    solve_proximal,
    solve_sticking,
)
from rigid_lcp.friction.linear import NO_LIMIT, SLOWEST, Clock, Factorisation, TimedFactorisation
from rigid_lcp.friction.methods import (
    NEWTON,
    PathStep,
    lay_out_sweeps,
    solve_gauss_seidel,
    solve_newton,
)
from rigid_lcp.friction.problem import (
    FORCE_ROUND_OFF,
    FrictionProblem,
    FrictionSolution,
    Status,
    gives_energy,
    judge_forces,
    norm,
)
from rigid_lcp.friction.sweeps import SweepBlocks


@dataclass(frozen=True)
class Limits:
    """What holds for every attempt."""

    hand_over: float = 1e-7  # residual [-] at which Newton takes over
    few_contacts: int = 300
    """Up to so many a problem is small: it costs less to factor than to sweep."""
    few_islands: int = 20
    """Up to so many [-], single contacts not counted, of a large problem are solved apart at once:
    a few grains that lie loose can keep a whole bed from converging.  More cost more than they
    gain."""
    convex_contacts: int = 10_000  # up to so many the convex path is followed
    newton: int = 20
    """Steps of Newton from `hand_over`, where it mostly needs fewer factorisations than proximal
    points."""
    update_flops: float = 160.0
    """Flops of a factorisation that cost as much as a contact's update in a sweep, over dim^2."""
    dear: float = 100.0
    """A factorisation that costs as much as so many sweeps is dear: sweeps go first, and on."""
    last_word: float = 1e-11
    """At such a tolerance and below a step of Newton ends what the others found: the residual is
    measured on the scale of all forces, and only what is exact to round-off is so for a pebble
    under a boulder."""
    rest: float = 100.0
    """Velocity times rho over the error of the forces [-], up to which it is taken for that of a
    contact at rest: corrections of a solution are of the size of its error."""
    refinements: int = 8
    """Most such steps, where factorisations cost next to nothing; one beyond `few_contacts`."""
    more_sweeps: float = 0.5  # sweeps to that end over those that found the solution [-], at most
    few_points: int = 50  # fewer factorisations than that extrapolated points are not begun with
    endless: float = 1e6  # forces over ``rho |q|`` [-] that look endless
    most_flops: float = 4e11  # an effort (some 20 s) beyond which no factorisation is begun
    most_factored: float = 2e7  # factorisations times contacts, of the same use
    misled: float = 2.0
    """Error of forces to start from over that of none [-] above which they are left aside: those
    of a step before that know but some of the contacts may be a little above 1, and lead on."""
    great_forces: float = 1e4
    """Forces over ``rho |q|`` [-], above which such a residual hides velocities."""


LIMITS = Limits()


class Trial:
    """The best point so far, who found it, and the work of all."""

    def __init__(
        self, problem: FrictionProblem, start: Floats | None, tolerance: float,
        accept: float = 0.0, clock: Clock = NO_LIMIT,
    ) -> None:  # fmt: skip
        zero = np.zeros(len(problem.offset))
        self.problem, self.tolerance, self.accept, self.clock = problem, tolerance, accept, clock
        self.sweep_cost = problem.contacts * LIMITS.update_flops * problem.dim**2 / SLOWEST
        """The least that a sweep took so far [s], where time is limited."""
        self.work = dict[str, float]()
        self.best = judge_forces(
            problem, zero, tolerance, "no forces", velocity=problem.offset.copy()
        )
        self.linear: Factorisation | None = None
        self.path_end: Floats | None = None
        self.path_point: tuple[Floats, float] | None = None
        self.convex_part: PathStep | None = None
        """Where the convex path was left, to go on along it."""
        self.sharp = self.smoothed = False
        """Whether the sharp path was followed, and the smoothed one."""
        self.stuck: FrictionSolution | None = None
        """Forces at which all contacts stick, where there is no start."""
        self.loose, self.heaviness = False, 1.0
        """Of these forces: whether much seems loose, and what heavy bodies ask for (`sticking`)."""
        self.small = problem.contacts <= LIMITS.few_contacts
        """Whether it costs less to factor than to sweep."""
        self.rough = not self.small and tolerance >= LIMITS.hand_over
        """Whether a rough answer is asked for of a large problem, which needs few factorisations or
        none."""
        self.coarse = tolerance if tolerance > LIMITS.last_word else LIMITS.hand_over
        """Residual that sweeps go down to first."""
        few = problem.contacts <= LIMITS.convex_contacts
        self.convex_useful = few and tolerance < LIMITS.hand_over
        """Whether the convex path is worth its factorisations."""
        self.start: Floats | None = None
        """The forces given to start from; None where they mislead."""
        if start is not None:
            begun = judge_forces(problem, start, tolerance, "start")
            if begun.residual * norm(start) < LIMITS.misled * problem.error_without_forces:
                self.start = start
                self.keep(begun)
        self.moving = not self.small and self.start is not None
        """Whether a large problem has a start: a step of a bed in motion."""
        self.cold = self.start is None and self.convex_useful
        """Whether there is no start, and the convex path is worth it."""

    @property
    def heavy(self) -> bool:
        """Whether light bodies bear heavy ones."""
        return self.heaviness > 1.0

    def accepts(self) -> bool:
        """Whether the best point is good enough for who asked."""
        return self.best.residual <= self.accept

    @cached_property
    def blocks(self) -> SweepBlocks:
        """This problem as its sweeps read it."""
        return lay_out_sweeps(self.problem)

    @property
    def factors(self) -> TimedFactorisation:
        """The factorisations of this problem, made when they are first needed."""
        if not isinstance(self.linear, TimedFactorisation):
            self.linear = TimedFactorisation(self.problem, self.clock, self.linear)
        return self.linear

    @cached_property
    def gives_energy(self) -> bool:
        """Whether W is proved to give energy, so that nothing promises a solution."""
        return gives_energy(self.problem, self.clock.left)

    def keep(self, found: FrictionSolution, after: str = "") -> FrictionSolution:
        """Count the work of a solution and keep it if it is the best; gives it back."""
        named = found.method == "gauss-seidel" or "islands" in found.work  # islands name their own
        for name, count in found.work.items():
            key = name if named or name == "factorisations" else f"{found.method} {name}"
            self.work[key] = self.work.get(key, 0.0) + count
        if found.residual < self.best.residual or not np.isfinite(self.best.residual):
            name = f"{after} + {found.method}" if after else found.method
            status: Status = "not converged" if found.status == "solved" else found.status
            self.best = replace(found, method=name, status=status)
            if found.residual <= self.tolerance:  # whether it solves is for the tolerance here
                if self.problem.reduces_error(found.r, found.residual):
                    self.best = replace(self.best, status="solved", message="")
                else:
                    self.best = judge_forces(
                        self.problem, found.r, self.tolerance, name, status=status,
                        message=found.message,
                    )  # fmt: skip
        return found

    def polish(
        self, found: FrictionSolution, factorisations: int = PROXIMAL.factorisations
    ) -> bool:
        """Proximal points from a point of another method; whether the tolerance is reached."""
        if self.best.solved or self.clock.late or not np.isfinite(found.residual):
            return self.best.solved
        if found.residual <= LIMITS.hand_over:
            found = self.run_newton(found.r, LIMITS.newton, found.method)
        if self.best.solved or factorisations == 0:
            return self.best.solved
        most = min(factorisations, self.affordable)
        self.attempt(solve_proximal, found.r, found.method, factorisations=most)
        return self.best.solved

    def attempt(
        self, method: Callable[..., FrictionSolution], start: Any, after: str = "", **options: Any
    ) -> FrictionSolution:
        """What ``method`` finds from ``start`` with this problem's factors: kept, and sharpened."""
        if self.clock.late:
            return self.best
        found = method(self.problem, start, self.tolerance, linear=self.factors, **options)
        self.keep(found, after)
        self.sharpen()
        return found

    def run_sweeps(
        self, start: Floats | None, until: float, sweeps: int, **options: Any
    ) -> FrictionSolution:
        """What so many sweeps of Gauss-Seidel find in the time left, to a residual of ``until``."""
        if self.clock.late:
            return self.best
        blocks, begun = self.blocks, perf_counter()
        sweeps = int(min(sweeps, self.clock.left / self.sweep_cost))
        found = solve_gauss_seidel(self.problem, start, until, sweeps, blocks=blocks, **options)
        took = perf_counter() - begun
        self.sweep_cost = min(self.sweep_cost, took / max(1.0, found.work["sweeps"]))
        return self.keep(found)

    def sweep(
        self, start: Floats | None, sweeps: int, until: float = 0.0,
        factorisations: int = PROXIMAL.factorisations,
    ) -> bool:  # fmt: skip
        """Gauss-Seidel to a residual of ``until``, and Newton; whether the tolerance is reached."""
        found = self.run_sweeps(start, max(until, self.tolerance), sweeps)
        return self.best.solved or self.polish(found, factorisations)

    def extrapolate(
        self, most: int, flops: float, start: FrictionSolution,
        patience: int = POINTS.factorisations,
    ) -> FrictionSolution:  # fmt: skip
        """Extrapolated proximal points from ``start``, with so many factorisations at most and at
        about such a cost."""
        count = int(min(most, flops / self.factors.flops, self.affordable))
        if count < LIMITS.few_points:
            return start
        return self.attempt(
            extrapolate_points, start.r, start.method, factorisations=count, patience=patience
        )

    def stick(self) -> FrictionSolution:
        """Forces at which all contacts stick."""
        if self.clock.late:
            return self.best
        exact = FORCE_ROUND_OFF if self.tolerance <= LIMITS.last_word else self.tolerance
        found = self.keep(solve_sticking(self.problem, exact, linear=self.factors))
        self.sharpen()
        return found

    @property
    def dear(self) -> bool:
        """Whether a factorisation costs as much as many sweeps."""
        sweep = LIMITS.update_flops * self.problem.dim**2 * self.problem.contacts
        return self.factors.flops > LIMITS.dear * sweep

    @property
    def effort(self) -> float:
        """What was spent so far, about, in flops."""
        factorisations = self.work.get("factorisations", 0.0)
        updates = self.work.get("contact updates", 0.0)
        each = self.linear.flops if self.linear else 0.0
        return factorisations * each + updates * LIMITS.update_flops * self.problem.dim**2

    @property
    def affordable(self) -> int:
        """Factorisations up to `Limits.most_flops` and `Limits.most_factored`; none out of time."""
        if self.clock.late:
            return 0
        flops = (LIMITS.most_flops - self.effort) / max(1.0, self.factors.flops)
        count = LIMITS.most_factored / self.problem.contacts - self.work.get("factorisations", 0.0)
        return max(0, int(min(flops, count)))

    @property
    def forces(self) -> float:
        """Size of the best forces over that of what makes the contacts approach, ``rho |q|``."""
        offered = self.problem.rho * norm(self.problem.offset)
        return norm(self.best.r) / offered if offered > 0.0 else 0.0

    def is_endless(self, force: Floats) -> bool:
        """Whether the greatest of forces r is so far above ``rho |q|`` that they look endless."""
        offered = self.problem.rho * norm(self.problem.offset)
        return not float(np.abs(force).max(initial=0.0)) <= LIMITS.endless * offered

    def forget_endless(self) -> None:
        """No forces in place of endless ones, behind whose size any velocity hides."""
        if self.forces > LIMITS.endless:
            self.best = Trial(self.problem, None, self.tolerance).best

    def run_newton(
        self, start: Floats, steps: int, after: str, patience: int = NEWTON.patience
    ) -> FrictionSolution:
        """So many steps of Newton, and one more where the answer is to be exact."""
        steps = min(steps, self.affordable)
        return self.attempt(solve_newton, start, after, iterations=steps, patience=patience)

    def sharpen(self) -> None:
        """Newton without its shift, from a solution, where the tolerance asks for an exact one."""
        if not self.best.solved or self.tolerance > LIMITS.last_word:
            return
        exact = FORCE_ROUND_OFF / max(1.0, self.forces / LIMITS.great_forces)
        if self.best.residual > exact:
            steps = LIMITS.refinements if self.problem.contacts <= LIMITS.few_contacts else 1
            found = refine_forces(
                self.problem, self.best.r, exact, linear=self.factors, steps=steps
            )
            if not self.leaves_rest(found):
                self.keep(found, self.best.method)

    def leaves_rest(self, found: FrictionSolution) -> bool:
        """Whether contacts that rest in the best point, a solution, move in ``found``.

        Without its shift Newton's method may step along a self-stress to where forces meet their
        cones' boundaries and, above the least friction that holds, into a motion that solves the
        problem as well.  Both are exact; bodies at rest stay so.
        """
        error = max(self.best.residual, FORCE_ROUND_OFF) * norm(self.best.r)
        before, after = (
            self.problem.rho * np.linalg.norm(each.u.reshape(-1, self.problem.dim), axis=1)
            <= LIMITS.rest * error
            for each in (self.best, found)
        )
        return bool((before & ~after).any())

    def sharpen_by_sweeps(self) -> None:
        """A part more sweeps, from a solution that sweeps found, where the tolerance asks for an
        exact one: they converge fast there, and need no factors."""
        if (
            not self.best.solved
            or self.tolerance > LIMITS.last_word
            or self.best.residual <= FORCE_ROUND_OFF
        ):
            return
        more = int(np.ceil(LIMITS.more_sweeps * self.work.get("sweeps", 0.0)))
        self.run_sweeps(self.best.r, FORCE_ROUND_OFF, more)

    def solution(self, status: Status | None = None, message: str = "") -> FrictionSolution:
        """The best point, with the work of all attempts."""
        best = self.best
        if not best.solved and not message and best.residual > self.tolerance:
            message = (
                f"no method reached {self.tolerance:.2g}; the best residual is {best.residual:.2g}"
                f" by {best.method}\n  -> look at W (a mass of zero? an entry of the wrong sign?),"
                " ask for less, or give forces near the solution as start"
            )
        return FrictionSolution(
            best.r, best.u, best.residual, status or best.status, best.method, self.work,
            "" if best.solved else message or best.message,
        )  # fmt: skip
