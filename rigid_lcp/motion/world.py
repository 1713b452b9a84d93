"""A scene: bodies with shape, mass and surface, gravity; and what the equations need of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from math import isfinite
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact import Contacts, detect_2d, detect_3d, pack_shapes_2d, pack_shapes_3d
from rigid_lcp.errors import SceneError
from rigid_lcp.friction.problem import MOST_FRICTION
from rigid_lcp.motion.checks import BOUNDS, check_half_space, require_density, require_number_in
from rigid_lcp.motion.gyroscopic import (
    find_gyroscopic_torque,
    find_principal_axes,
    find_spin_acceleration,
    rotate_freely,
    turn_inertia,
)
from rigid_lcp.motion.state import Motion, displace_motion
from rigid_lcp.shapes import HalfSpace, require_vector
from trackbed.scene_files import suggest_word


@dataclass(frozen=True)
class Body:
    """One body of a scene, as it starts."""

    shape: Any
    mass: float
    """Mass [kg], inf for a fixed body."""
    inertia: Any
    """Moment of inertia [kg m^2]: a number in 2D, a tensor (3, 3) in the body's frame in 3D."""
    position: Floats
    angle: Any
    velocity: Floats
    spin: Any
    friction: float | None
    restitution: float | None
    name: str
    surface: str = ""
    """What it is made of, by which `Scene.set_pair` names it."""

    @property
    def movable(self) -> bool:
        """It follows from forces where the body goes."""
        return isfinite(self.mass)


class Scene:
    """Bodies and gravity.  ``gravity`` (dim,) [m/s^2]; the default pulls along the last axis."""

    def __init__(self, dim: int = 2, gravity: ArrayLike | None = None) -> None:
        if not isinstance(dim, int | np.integer) or dim not in (2, 3):
            raise SceneError(f"dim is {dim!r}", where="scene", remedy="give 2 or 3")
        self.dim = int(dim)
        default = np.zeros(dim)
        default[-1] = -9.81
        given = default if gravity is None else gravity
        self.gravity = require_vector(given, dim, "gravity", "scene", BOUNDS.state)
        self.bodies: list[Body] = []
        self.pairs: dict[tuple[str, str], dict[str, float]] = {}
        """What `set_pair` was given, by the two surfaces in the order of the alphabet."""

    def replace_bodies(self, bodies: Iterable[Body]) -> Scene:
        """A scene of other bodies, with the gravity and the pairs of surfaces of this one."""
        made = Scene(self.dim, self.gravity)
        made.bodies, made.pairs = list(bodies), dict(self.pairs)
        return made

    def name_body(self, body: int) -> str:
        """Name of a body for messages; its number where it has none."""
        return self.bodies[body].name or f"body {body}"

    def add(
        self, shape: Any, *, density: float | None = None, position: ArrayLike | None = None,
        angle: Any = None, velocity: ArrayLike | None = None, spin: Any = None,
        friction: float | None = None, restitution: float | None = None, fixed: bool = False,
        name: str = "", surface: str = "",
    ) -> int:  # fmt: skip
        """Add a body; returns its number.

        ``density`` [kg/m^3], in 2D [kg/m^2]: of a body that moves; ``fixed`` ones need none, keep
        the ``velocity`` they are given, and half-spaces always are.  ``position`` of the centre of
        mass [m]; without it, the body stays where its vertices were given.  ``angle`` [rad], in 3D
        a quaternion (w, x, y, z).  ``velocity`` [m/s], ``spin`` [rad/s].  ``friction`` and
        ``restitution`` of a contact are the smaller of its two bodies'; a body without a value
        leaves it to the other; without any both are zero.  ``surface``: a word for which
        `set_pair` says otherwise.  Raises `SceneError`.
        """
        where = name or f"body {len(self.bodies)}"
        if isinstance(shape, type) or getattr(shape, "dim", None) != self.dim:
            raise SceneError(
                f"{type(shape).__name__} is no shape of {self.dim} dimensions", where=where,
                remedy=f"use a shape with dim {self.dim}",
            )  # fmt: skip
        if not isinstance(fixed, bool | np.bool_):
            raise SceneError(f"fixed is {fixed!r}", where=where, remedy="give True or False")
        if isinstance(shape, HalfSpace):
            check_half_space(shape, position, angle, velocity, spin, where)
            fixed = True
        mass, inertia = np.inf, np.inf
        if not fixed:
            mass, inertia = shape.mass_properties(require_density(density, where))
        given = require_surface(friction, restitution, where)

        def check_state(values: ArrayLike | None, usual: Floats | list[float], what: str) -> Floats:
            given = usual if values is None else values
            return require_vector(given, len(usual), what, where, BOUNDS.state)

        origin = getattr(shape, "centroid", np.zeros(self.dim))
        turn, upright = (3, [1.0, 0.0, 0.0, 0.0]) if self.dim == 3 else (1, [0.0])
        angle = check_state(angle, upright, "angle")
        length = float(np.linalg.norm(angle)) if self.dim == 3 else 1.0
        if length == 0:
            raise SceneError("the quaternion is zero", where=where, remedy="give (1, 0, 0, 0)")
        self.bodies.append(Body(
            shape, mass, inertia, check_state(position, origin, "position"), angle / length,
            check_state(velocity, np.zeros(self.dim), "velocity"),
            check_state(spin, np.zeros(turn), "spin"), given.get("friction"),
            given.get("restitution"), name, surface,
        ))  # fmt: skip
        return len(self.bodies) - 1

    def set_pair(
        self, one: str, other: str, *, friction: float | None = None,
        restitution: float | None = None,
    ) -> None:  # fmt: skip
        """Friction and restitution [-] of contacts between bodies of two surfaces (or of one), in
        place of what their bodies would give; None leaves it at that.

        Raises `SceneError`; a run does for surfaces that no body has.
        """
        given = require_surface(friction, restitution, f"{one} and {other}")
        if not given:
            raise SceneError(
                "the pair has no value", where=f"{one} and {other}",
                remedy="give friction, restitution or both",
            )  # fmt: skip
        pair = min(one, other), max(one, other)
        self.pairs[pair] = self.pairs.get(pair, {}) | given


def require_surface(
    friction: float | None, restitution: float | None, where: str
) -> dict[str, float]:
    """Those of the two that are not None.  Raises `SceneError` for what is no coefficient."""
    given = ("friction", friction, MOST_FRICTION), ("restitution", restitution, 1.0)
    return {
        name: require_number_in(value, 0.0, most, name, where, f"give 0 to {most:g}")
        for name, value, most in given
        if value is not None
    }


@dataclass(frozen=True)
class World:
    """The unchanging part of a simulation: what does not depend on the state."""

    scene: Scene
    columns: Ints  # number of each body among the movable ones, -1 for a fixed one, (n,)
    mass: Floats  # masses [kg], (n,), inf for a fixed body
    inertia: Floats
    """Moments of inertia [kg m^2], (n,) in 2D, tensors in the bodies' frames (n, 3, 3) in 3D."""
    reach: Floats
    """Greatest distance of a body's points from its centre of mass [m], (n,); 0 if infinite."""
    length: float  # size of the smallest movable body [m]: the unit of all tolerances
    detect: Callable[[Floats, Floats, Any, Floats], Contacts]
    """Contacts of places and angles within a margin [m], one number or (n,), and of how bodies
    will move on (n, 3) or (n, 6) [m, rad]."""

    @cached_property
    def movable(self) -> Bools:
        """Bodies whose motion follows from forces, (n,)."""
        return self.columns >= 0

    @property
    def size(self) -> int:
        """Freedoms of a body: 3 in 2D, 6 in 3D."""
        return 3 if self.scene.dim == 2 else 6

    @cached_property
    def thickness(self) -> Floats:
        """Least width of each body [m], (n,); inf for a half-space."""
        return np.array([body.shape.width for body in self.scene.bodies])

    @cached_property
    def least_inertia(self) -> Floats:
        """A moment of inertia of each body, in 3D the least on its tensor's diagonal, (n,)."""
        if self.scene.dim == 2:
            return self.inertia
        return np.asarray(np.diagonal(self.inertia, axis1=1, axis2=2).min(axis=1))

    @cached_property
    def heaviest(self) -> float:
        """Greatest mass [kg] or, in numbers, moment of inertia [kg m^2] of the movable bodies."""
        inertia = self.inertia[self.movable]
        if self.scene.dim == 3:
            inertia = np.trace(inertia, axis1=1, axis2=2)
        return float(max(self.mass[self.movable].max(), inertia.max()))

    def speeds(self, rates: Floats) -> Floats:
        """Bound of the speed of any point of each body [m/s], (n,); ``rates`` (n, size)."""
        dim = self.scene.dim
        turning = np.linalg.norm(rates[:, dim:], axis=1) * self.reach
        return np.asarray(np.linalg.norm(rates[:, :dim], axis=1) + turning)

    def inverse_mass(self, motion: Motion) -> sp.csr_array:
        """M^-1 of the movable bodies (eq. 12), in the world frame."""
        moving = self.movable
        if self.scene.dim == 2:
            mass = self.mass[moving]
            diagonal = np.column_stack([mass, mass, self.inertia[moving]])
            return sp.diags_array(1.0 / diagonal.ravel(), format="csr")
        blocks = np.zeros((moving.sum(), 6, 6))
        blocks[:, range(3), range(3)] = 1.0 / self.mass[moving][:, None]
        blocks[:, 3:, 3:] = np.linalg.inv(turn_inertia(self.inertia, motion.angle)[moving])
        made = copy(self._mass_pattern)
        made.data = blocks.ravel()
        return made

    @cached_property
    def _mass_pattern(self) -> sp.csr_array:
        """M^-1 in space, of blocks of ones (6, 6)."""
        count = int(self.movable.sum())
        return sp.csr_array(sp.block_diag([np.ones((6, 6))] * count, format="csr"))

    @cached_property
    def principal(self) -> tuple[Floats, Floats]:
        """Principal moments and axes of inertia of all bodies; 3D only."""
        return find_principal_axes(self.inertia)

    def move_freely(self, motion: Motion, seconds: float) -> Motion:
        """The state after ``seconds`` [s] without any force; in 3D spins change as bodies turn."""
        if self.scene.dim == 2:
            return displace_motion(motion, seconds * motion.rates)
        angle, spin = rotate_freely(self.principal, motion.angle, motion.spin, seconds)
        return Motion(motion.position + seconds * motion.velocity, angle, motion.velocity, spin)

    def free_accelerations(self, motion: Motion) -> Floats:
        """Generalised accelerations (n, size) while no force acts: in 3D spins change all the
        same [rad/s^2]."""
        result = np.zeros((len(self.mass), self.size))
        if self.scene.dim == 3:
            result[:, 3:] = find_spin_acceleration(self.inertia, motion.angle, motion.spin)
        return result

    def accelerations(
        self, motion: Motion, loads: ArrayLike | None, gyroscopic: bool = True
    ) -> Floats:
        """Generalised accelerations of gravity and loads, (n, size), in 3D with those of the
        gyroscopic torque, unless `move_freely` accounts for it (``gyroscopic`` False)."""
        dim = self.scene.dim
        result = np.zeros((len(self.mass), self.size))
        moving = self.movable
        result[moving, :dim] = self.scene.gravity
        if loads is not None:
            force = np.asarray(loads, dtype=float)
            result[moving, :dim] += force[moving, :dim] / self.mass[moving][:, None]
        if dim == 2:
            if loads is not None:
                result[moving, 2] += force[moving, 2] / self.inertia[moving]
            return result
        if loads is None and not gyroscopic:
            return result
        inertia, spin = turn_inertia(self.inertia, motion.angle)[moving], motion.spin[moving]
        torque = np.zeros_like(spin)
        if gyroscopic:
            torque += find_gyroscopic_torque(inertia, spin)
        if loads is not None:
            torque += force[moving, 3:]
        result[moving, 3:] = np.linalg.solve(inertia, torque[..., None])[..., 0]
        return result

    def contacts(self, motion: Motion, margin: Any, ahead: float = 0.0) -> Contacts:
        """Contacts of a state with friction and restitution of their surfaces.

        ``ahead`` [s]: how long bodies are expected to move on at their rates, which chooses among
        faces that part a pair (`rigid_lcp.contact.parting_faces`).
        """
        found = self.detect(motion.position, motion.angle, margin, ahead * motion.rates)
        surface = {}
        for name, value in self.surfaces.items():  # the smaller, or what one of them has
            both = np.fmin(value[found.body_a], value[found.body_b])
            surface[name] = np.where(np.isnan(both), 0.0, both)
            if name in self.pairs:
                kind, value = self.pairs[name]
                own = value[kind[found.body_a], kind[found.body_b]]
                surface[name] = np.where(np.isnan(own), surface[name], own)
        return Contacts(**vars(found) | surface)

    @cached_property
    def surfaces(self) -> dict[str, Floats]:
        """Friction and restitution of every body, NaN where unknown, (n,)."""
        return {
            name: np.array([getattr(body, name) for body in self.scene.bodies], dtype=float)
            for name in ("friction", "restitution")
        }

    @cached_property
    def pairs(self) -> dict[str, tuple[Ints, Floats]]:
        """Number of each body's surface (n,), and friction or restitution of every pair of surfaces
        (k, k), NaN where their bodies decide; only what `Scene.set_pair` was given."""
        words, kind = np.unique([body.surface for body in self.scene.bodies], return_inverse=True)
        known, found = words.tolist(), dict[str, tuple[Ints, Floats]]()
        for pair, given in self.scene.pairs.items():
            for word in (word for word in pair if word not in known):
                raise SceneError(
                    f"no body has the surface {word!r}{suggest_word(word, known)}",
                    where="set_pair", remedy=f"give it to a body: add(..., surface={word!r})",
                )  # fmt: skip
            one, other = map(known.index, pair)
            for name, value in given.items():
                table = found.setdefault(name, (kind, np.full((len(known),) * 2, np.nan)))[1]
                table[one, other] = table[other, one] = value
        return found

    def energy(self, motion: Motion) -> float:
        """Kinetic and potential energy of the movable bodies [J]."""
        moving = self.movable
        mass, velocity = self.mass[moving], motion.velocity[moving]
        linear = 0.5 * float((mass * (velocity**2).sum(axis=1)).sum())
        height = float((mass * (motion.position[moving] @ self.scene.gravity)).sum())
        if self.scene.dim == 2:
            angular = 0.5 * float((self.inertia[moving] * motion.spin[moving] ** 2).sum())
        else:
            inertia, spin = turn_inertia(self.inertia, motion.angle)[moving], motion.spin[moving]
            angular = 0.5 * float(np.einsum("ni,nij,nj->", spin, inertia, spin))
        return linear + angular - height


def make_world(scene: Scene) -> tuple[World, Motion]:
    """Arrays of a scene and its state at the start.  Raises `SceneError` for an empty scene.

    What is done to ``scene`` later changes neither.
    """
    scene = scene.replace_bodies(scene.bodies)
    bodies = scene.bodies
    movable = np.array([body.movable for body in bodies], dtype=bool)
    if not movable.any():
        raise SceneError("no body can move", where="scene", remedy="add a body with a density")
    columns = np.where(movable, np.cumsum(movable) - 1, -1)
    shapes = [body.shape for body in bodies]
    reach = np.array([shape.reach if isfinite(shape.reach) else 0.0 for shape in shapes])
    mass = np.array([body.mass for body in bodies])
    if scene.dim == 2:
        detect = partial(detect_2d, pack_shapes_2d(shapes, movable, scene.name_body))
        inertia = np.array([body.inertia for body in bodies])
    else:
        detect = partial(detect_3d, pack_shapes_3d(shapes, movable, scene.name_body))
        inertia = np.array([body.inertia if body.movable else np.eye(3) for body in bodies])
    angle = np.array([body.angle for body in bodies])
    spin = np.array([body.spin for body in bodies])
    start = Motion(
        np.array([body.position for body in bodies]), angle[:, 0] if scene.dim == 2 else angle,
        np.array([body.velocity for body in bodies]), spin[:, 0] if scene.dim == 2 else spin,
    )  # fmt: skip
    length = float(reach[movable].min())
    return World(scene, columns, mass, inertia, reach, length, detect), start
