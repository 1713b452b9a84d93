"""A scene set in motion: time, states, forces, energies; the physics is in the two integrators.

`rigid_lcp.time_stepping` (velocity level) for most scenes, `rigid_lcp.runge_kutta` (acceleration
level, section 9) for few bodies and high order.
"""

from __future__ import annotations

from math import ceil
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.contacts import ContactForces
from rigid_lcp.errors import NotConverged, Overlapping, UsageError
from rigid_lcp.fragmentation import broken_scene
from rigid_lcp.runge_kutta import Pace, runge_kutta_advance
from rigid_lcp.scene import Loads, Scene, world_of
from rigid_lcp.time_stepping import contact_forces, moreau_step

Floats = NDArray[np.float64]
Method = Literal["time-stepping", "acceleration"]

OVERLAP_AT_START = 1e-6
"""Overlap that a start may have, as a share of the smallest body's size."""
GIVE_UP = 1e-3
"""Residual [-] above which a step is no step: the run stops."""


class Simulation:
    """A run of a scene.

    ``method``: ``time-stepping`` (any scene) or ``acceleration`` (Runge-Kutta, section 9; raises
    `NoSolution` where no finite forces exist).  ``step`` [s]: length of the steps, for
    ``acceleration`` the longest one; default 1e-3 s.  ``tolerance``: scale-free residual of the
    contact forces.  ``loads(time, motion)``: further forces and torques (n, 3) or (n, 6) [N, N m].
    Raises `SceneError`, or `Overlapping` where bodies overlap at the start.
    """

    def __init__(
        self, scene: Scene, method: Method = "time-stepping", *, step: float = 1e-3,
        tolerance: float = 1e-12, loads: Loads | None = None,
    ) -> None:  # fmt: skip
        if method not in ("time-stepping", "acceleration"):
            raise UsageError(
                f"method is {method!r}", remedy="give 'time-stepping' or 'acceleration'"
            )
        if not 0 < step < np.inf:
            raise UsageError(f"step is {step}", remedy="give a positive number of seconds")
        self.world, self.motion = world_of(scene)
        self.method, self.step, self.tolerance, self.loads = method, step, tolerance, loads
        self.pace = Pace(step, step)
        """Step control of ``acceleration``, and its counts."""
        self.time = 0.0
        """Time since the start [s]."""
        self.steps = 0
        self.worst_residual = 0.0
        """Greatest residual of any step so far [-]."""
        self.contacts: ContactForces = contact_forces(
            self.world.contacts(self.motion, 0.0)[np.zeros(0, np.int64)],
            np.zeros((0, scene.dim)), None, 1.0,
        )  # fmt: skip
        """Contacts of the last step and the forces in it."""
        self._refuse_overlap()

    def advance(self, seconds: float) -> None:
        """Go on for ``seconds`` [s], in equal steps not longer than ``step``.

        Raises `NotConverged` where a step's forces are not found; the state before it is kept.
        """
        if self.method == "acceleration":
            self._integrate(seconds)
            return
        count = max(ceil(seconds / self.step - 1e-9), 0)
        for _ in range(count):
            self._time_step(seconds / count)

    def fragment(self, body: int, line: tuple[ArrayLike, ArrayLike]) -> int:
        """Break a polygon (polyhedron) that moves in two; returns the number of the second part.

        ``line``: a point and a direction (2D), a point and the plane's normal (3D), in the world.
        The first part keeps the number of the whole, the second comes after all bodies; both go
        on as parts of the rigid body did (section 10), so that loads are now wanted for one body
        more.  Raises `ShapeError` for a disc, a fixed body, or a sliver.
        """
        scene = broken_scene(self.world.scene, self.motion, body, *line)
        self.world, self.motion = world_of(scene)
        whole = (self.contacts.body_a == body) | (self.contacts.body_b == body)
        self.contacts = self.contacts[~whole]
        return len(scene.bodies) - 1

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

    def _time_step(self, h: float) -> None:
        loads = None if self.loads is None else self.loads(self.time + h / 2, self.motion)
        made = moreau_step(self.world, self.motion, loads, h, self.contacts, self.tolerance)
        self._judge(made.residual, made.message)
        self.motion, self.contacts = made.motion, made.contacts
        self.time += h
        self.steps += 1

    def _integrate(self, seconds: float) -> None:
        self.motion, self.contacts = runge_kutta_advance(
            self.world, self.motion, self.time, seconds, self.pace, self.loads, self.tolerance
        )
        self.time += seconds
        self.steps = self.pace.accepted
        self.worst_residual = self.pace.worst_residual

    def _judge(self, residual: float, message: str) -> None:
        self.worst_residual = max(self.worst_residual, residual)
        if not residual <= GIVE_UP:
            raise NotConverged(
                f"the contact forces have a residual of {residual:.2g}",
                where=f"step {self.steps}, {self.time:.6g} s",
                remedy=message or "take a shorter step",
            )

    def _refuse_overlap(self) -> None:
        found = self.world.contacts(self.motion, 0.0)
        if len(found) and found.gap.min() < -OVERLAP_AT_START * self.world.length:
            worst = int(np.argmin(found.gap))
            raise Overlapping(
                f"they overlap by {-found.gap[worst]:.3g} m",
                where=f"bodies {found.body_a[worst]} and {found.body_b[worst]} at the start",
                remedy="move them apart",
            )
