"""A scene set in motion: time, states, forces, energies; the physics is in the two integrators.

`rigid_lcp.motion.time_stepping` (velocity level) for most scenes, `rigid_lcp.motion.runge_kutta`
(acceleration level, section 9) for few bodies and high order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import ceil, inf, nan
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp import motion
from rigid_lcp.arrays import Floats
from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import (
    NotConverged,
    Overlapping,
    ProblemError,
    SceneError,
    ShapeError,
    UsageError,
)
from rigid_lcp.unique import find_unique_forces
from rigid_lcp.wear import (
    Breakage,
    Broken,
    Wear,
    break_scene,
    find_breaks,
    refuse_dust,
    split_body,
    split_wear,
    start_wear,
    step_wear,
    swap_worn,
)


@dataclass(frozen=True)
class SimulationNumbers:
    """What a start and a step of a run have to keep."""

    overlap_at_start: float = 1e-6  # at most, over the smallest body's size [-]
    time_round_off: float = 1e-9  # of a sum of times, in steps [-]
    shortest_step: float = 1e-100  # [s]: shorter ones have squares that are no numbers
    accept: float = 1e-5
    """Residual [-] at which a step of many contacts is left where its tolerance would take the
    dearest methods;"""
    most_residual: float = 1e-3  # above it [-] it is no step, and the run stops


SIMULATION = SimulationNumbers()


class Simulation:
    """A run of a scene.

    ``method``: ``time-stepping`` (any scene) or ``acceleration`` (Runge-Kutta, section 9; raises
    `NoSolution` where no finite forces exist).  ``step`` [s]: length of the steps, for
    ``acceleration`` the longest one; default 1e-3 s.  ``tolerance``: scale-free residual of the
    contact forces.  ``loads(time, motion)``: further forces and torques (n, 3) or (n, 6) [N, N m].
    ``wear``, ``breakage``: grains lose their corners, break (time stepping only); none by default.
    Raises `SceneError`, or `Overlapping` where bodies overlap at the start.
    """

    def __init__(
        self, scene: motion.Scene, method: Method = "time-stepping", *, step: float = 1e-3,
        tolerance: float = 1e-12, loads: motion.Loads | None = None, wear: Wear | None = None,
        breakage: Breakage | None = None,
    ) -> None:  # fmt: skip
        check_run(scene, method, loads, wear, breakage)
        step = motion.require_seconds(step, "step", least=SIMULATION.shortest_step)
        remedy = "give a positive number, say 1e-9"
        tolerance = motion.require_number_in(
            tolerance, 0.0, inf, "tolerance", "Simulation", remedy, above=True
        )
        self.wear, self.breakage = wear, breakage
        self.worn = None if wear is None else start_wear(scene)
        """What corners have lost; None without wear."""
        self.broken: list[Broken] = []
        """Grains that broke; by `fragment` at a tension of NaN."""
        self.world, self.motion = motion.make_world(scene)
        self.method, self.step, self.tolerance = method, step, tolerance
        self.loads = None if loads is None else partial(motion.check_loads, loads)
        self.pace = motion.Pace(step, step)
        """Step control of ``acceleration``, and its counts."""
        self.time = 0.0
        """Time since the start [s]."""
        self.steps = 0
        self.worst_residual = 0.0
        """Greatest residual of any step so far [-]."""
        self.steps_above = 0
        """Steps whose residual was above ``tolerance``."""
        self.steps_scaled = 0
        """Steps (at acceleration level collisions) with restitution scaled down, as friction would
        have made energy by it, or no impulses let the bodies bounce."""
        self.steps_cut_off = 0
        """Steps (at acceleration level collisions) whose collisions ran out of rounds: the rest was
        closed without restitution, which costs energy also at restitution 1."""
        self.contacts: ContactForces = motion.make_contact_forces(
            self.world.contacts(self.motion, 0.0)[np.zeros(0, np.int64)],
            np.zeros((0, scene.dim)), None, 1.0,
        )  # fmt: skip
        """Contacts of the last step and the forces in it."""
        if not motion.is_finite(self.world, self.motion):
            raise motion.explain_overflow(self.world, self.motion, None, 0.0, 0.0)
        self._refuse_overlap()

    def advance(self, seconds: float) -> None:
        """Go on for ``seconds`` [s], in equal steps not longer than ``step``, made in parts where
        bodies would pass each other within one (`rigid_lcp.motion.passing_bodies`).

        Less than a billionth of a step is none: sums of times differ by so much.

        Raises `NotConverged` where a step's forces are not found; the state before it is kept.
        `UsageError` for a negative time, or one of more steps than can be made; `SceneError` for
        loads that are none, for a state or an energy that would not be finite, or for grains that
        break without end.
        """
        seconds = motion.require_seconds(seconds, "the time to go on")
        if seconds / self.step > motion.BOUNDS.steps:
            raise UsageError(
                motion.explain_step_limit("the time to go on", seconds / self.step),
                remedy="go on for less, or give a longer step",
            )
        if seconds <= SIMULATION.time_round_off * self.step:
            return
        with np.errstate(over="ignore"):  # a step that ends beyond numbers is reported as that
            if self.method == "acceleration":
                self._integrate(seconds)
                return
            count = max(ceil(seconds / self.step - SIMULATION.time_round_off), 1)
            for _ in range(count):
                parts = motion.count_parts(self.world, self.motion, seconds / count)
                for _ in range(parts):
                    self._take_step(seconds / count / parts)

    def problem(self, h: float | None = None) -> motion.StepProblem:
        """The friction problem of the step that comes next, of length ``h`` [s], by default
        ``step``: A, b, W, q, friction, and ``save``.

        After a step that was not found this is the one that was not, as the state before it is
        kept.  Raises `UsageError` for a length that is none.
        """
        h = self.step if h is None else motion.require_seconds(h, "the step")
        return motion.make_step_problem(self.world, self.motion, self._find_loads(h), h)

    def fragment(self, body: int, line: tuple[ArrayLike, ArrayLike]) -> int:
        """Break a polygon (polyhedron) that moves in two; returns the number of the second part.

        ``line``: a point and a direction (2D), a point and the plane's normal (3D), in the world.
        The first part keeps the number of the whole, the second comes after all bodies; both go
        on as parts of the rigid body did (section 10), so that loads are now wanted for one body
        more.  Raises `ShapeError` for a disc, a fixed body, or a sliver, `SceneError` for a body
        or a line that is none.
        """
        last = len(self.motion.position) - 1
        remedy = f"give a whole number, 0 to {last}, as Scene.add returned it"
        body = motion.require_whole_in(body, 0, "the body", "fragment", remedy, last)
        line = motion.require_line(line, self.motion.dim)
        scene = split_body(self.world.scene, self.motion, body, *line)
        return self._go_on_broken(scene, body, nan, nan)

    def _go_on_broken(self, scene: motion.Scene, body: int, tension: float, strength: float) -> int:
        self.world, self.motion = motion.make_world(scene)
        if self.worn is not None:
            self.worn = split_wear(self.worn, scene, body)
        whole = (self.contacts.body_a == body) | (self.contacts.body_b == body)
        self.contacts = self.contacts[~whole]
        part = len(scene.bodies) - 1
        self.broken.append(Broken(self.time, body, part, tension, strength))
        return part

    def unique_forces(self) -> ContactForces:
        """Forces that elastic contacts would choose now (section 8).

        For grains at rest or in slow motion.  Raises `NotConverged` where they are not found.
        """
        loads = None if self.loads is None else self.loads(self.time, self.motion)
        return find_unique_forces(self.world, self.motion, loads)

    @property
    def positions(self) -> Floats:
        """Centres of mass [m], (n, dim), fixed bodies included."""
        return self.motion.position

    @property
    def angles(self) -> Floats:
        """Angles [rad], (n,); in 3D unit quaternions (n, 4)."""
        return self.motion.angle

    @property
    def velocities(self) -> Floats:
        """Velocities of the centres of mass [m/s], (n, dim)."""
        return self.motion.velocity

    @property
    def spins(self) -> Floats:
        """Spins [rad/s], (n,) or (n, 3)."""
        return self.motion.spin

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]; loads are not in it."""
        return self.world.energy(self.motion)

    @property
    def overlap(self) -> float:
        """Greatest overlap of any two bodies now [m]; zero if none."""
        gap = self.world.contacts(self.motion, 0.0).gap
        return float(max(0.0, -gap.min(initial=0.0)))

    def _find_loads(self, h: float) -> Floats | None:
        """Those at the midpoint of a step."""
        if self.loads is None:
            return None
        return self.loads(self.time + h / 2, self.world.move_freely(self.motion, h / 2))

    def _take_step(self, h: float) -> None:
        loads = self._find_loads(h)
        try:
            made = motion.step_moreau(
                self.world, self.motion, loads, h, self.contacts, self.tolerance, SIMULATION.accept
            )
        except ProblemError as error:
            raise motion.explain_overflow(
                self.world, self.motion, loads, h, self.time, error
            ) from error
        if not motion.is_finite(self.world, made.motion):
            raise motion.explain_overflow(self.world, self.motion, loads, h, self.time)
        self._judge(made.residual, made.message)
        self.steps_scaled += made.scaled
        self.steps_cut_off += made.cut_off
        before, self.motion, self.contacts = self.motion, made.motion, made.contacts
        self.time += h
        self.steps += 1
        self._wear_and_break(before, h)

    def _wear_and_break(self, before: motion.Motion, h: float) -> None:
        """What the forces of the last step do to the bodies (section 8, end, and section 10)."""
        if self.worn is not None and self.wear is not None:
            step_wear(self.worn, self.wear, self.contacts, before, self.motion, h)
            if self.steps % self.wear.every == 0:
                try:
                    cut = swap_worn(self.world.scene, self.motion, self.worn)
                except ShapeError as error:
                    raise error.relocate(f"{error.where} at {self.time:.6g} s") from error
                if cut is not None:
                    scene, self.worn = cut
                    self.world, self.motion = motion.make_world(scene)
        if self.breakage is not None and self.steps % self.breakage.every == 0:
            forces = self.unique_forces() if self.breakage.unique else self.contacts
            found = find_breaks(self.world.scene, self.motion, forces, self.breakage)
            for body, line in found:
                scene_now = break_scene(self.world.scene, self.motion, body, line)
                if scene_now is not None:
                    self._go_on_broken(scene_now, body, line.tension, line.strength)
            if found:
                grains = int(self.world.movable.sum())
                refuse_dust(self.breakage, grains, len(self.broken), self.time)

    def _integrate(self, seconds: float) -> None:
        self.motion, self.contacts = motion.advance_runge_kutta(
            self.world, self.motion, self.time, seconds, self.pace, self.loads, self.tolerance
        )
        self.time += seconds
        self.steps = self.pace.accepted
        self.worst_residual = self.pace.worst_residual
        self.steps_above = self.pace.steps_above
        self.steps_scaled = self.pace.scaled
        self.steps_cut_off = self.pace.cut_off

    def _judge(self, residual: float, message: str) -> None:
        self.worst_residual = max(self.worst_residual, residual)
        self.steps_above += not residual <= self.tolerance
        if not residual <= SIMULATION.most_residual:
            raise NotConverged(
                f"the contact forces have a residual of {residual:.2g}",
                where=f"step {self.steps}, {self.time:.6g} s",
                remedy=message or "take a shorter step",
            )

    def _refuse_overlap(self) -> None:
        found = self.world.contacts(self.motion, 0.0)
        if len(found) and found.gap.min() < -SIMULATION.overlap_at_start * self.world.length:
            worst = int(np.argmin(found.gap))
            pair = int(found.body_a[worst]), int(found.body_b[worst])
            names = (self.world.scene.name_body(k) for k in pair)
            raise Overlapping(
                f"they overlap by {-found.gap[worst]:.3g} m",
                where=f"{' and '.join(names)} at the start",
                remedy="move them apart",
            )


Method = Literal["time-stepping", "acceleration"]


def check_run(scene: Any, method: Any, loads: Any, wear: Any, breakage: Any) -> None:
    """Raise `SceneError` or `UsageError` for what `rigid_lcp.scene.simulation.Simulation` can not
    take.

    Its steps and residuals are looked at by `rigid_lcp.motion.checks`.
    """
    if method not in get_args(Method):
        raise UsageError(f"method is {method!r}", remedy="give 'time-stepping' or 'acceleration'")
    if not isinstance(scene, motion.Scene):
        raise SceneError(f"the scene is {scene!r}", remedy="give a rigid_lcp.Scene")
    for given, kind, what in ((wear, Wear, "wear"), (breakage, Breakage, "breakage")):
        if given is not None and not isinstance(given, kind):
            raise SceneError(
                f"{what} is {given!r}", where="Simulation",
                remedy=f"give a rigid_lcp.{kind.__name__}, or None",
            )  # fmt: skip
    if loads is not None and not callable(loads):
        raise UsageError("loads are no function", remedy="give loads(time, motion)")
    if method == "acceleration" and (wear is not None or breakage is not None):
        raise UsageError(
            "bodies do not wear or break at acceleration level", where="method",
            remedy="give method='time-stepping', or leave wear and breakage out",
        )  # fmt: skip
