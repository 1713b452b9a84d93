"""What a scene and its run may be given: numbers, spans of time, loads, numbers of bodies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, nan
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import SceneError, UsageError
from rigid_lcp.motion.state import Motion
from rigid_lcp.shapes import HalfSpace, require_real, require_vector

Loads = Callable[[float, Motion], ArrayLike | None]
"""Forces and torques (n, 3) in 2D, (n, 6) in 3D [N, N m] at a time [s] and state."""


@dataclass(frozen=True)
class InputBounds:
    """The greatest numbers that a scene and its run may be given."""

    density: float = 1e50  # [kg/m^3]: above it masses can not be computed with
    state: float = 1e50
    """Of places, velocities, spins and gravity [SI]: above it energies are no numbers, with lengths
    as great as shapes may have."""
    steps: float = 1e10  # of a run [-], more than any machine makes


BOUNDS = InputBounds()


def explain_step_limit(what: str, steps: float) -> str:
    """Sentence on a span of time, ``what``, of more steps than can be made."""
    return f"{what} is {steps:.3g} steps: at most {BOUNDS.steps:.0e} can be made"


def require_density(value: Any, where: str) -> float:
    """A density [kg/m^3], in 2D [kg/m^2]; `SceneError` for all else."""
    remedy = f"give a density above zero, {BOUNDS.density:g} at most, or fixed=True for a body that"
    return require_number_in(
        value, 0.0, BOUNDS.density, "the density", where, f"{remedy} does not move", above=True
    )


def require_number_in(
    value: Any, least: float, most: float, what: str, where: str, remedy: str, above: bool = False
) -> float:
    """A finite number from ``least`` to ``most``, or ``above`` the least; else `SceneError`."""
    number = float(value) if isinstance(value, Real) else nan
    if not least <= number <= most or (above and number == least):
        raise SceneError(f"{what} is {value!r}", where=where, remedy=remedy)
    return number


def require_whole_in(
    value: Any, least: int, what: str, where: str, remedy: str, most: float = inf
) -> int:
    """A whole number from ``least`` to ``most``; else `SceneError`."""
    sound = isinstance(value, Integral) and not isinstance(value, bool)
    if not sound or not least <= value <= most:
        raise SceneError(f"{what} is {value!r}", where=where, remedy=remedy)
    return int(value)


def require_seconds(value: Any, what: str, least: float = 0.0) -> float:
    """A span of time [s], zero allowed unless ``least`` is above it; `UsageError` for any other."""
    number = float(value) if isinstance(value, Real) else nan
    if not least <= number < inf:
        raise UsageError(f"{what} is {value!r}", remedy="give a positive number of seconds")
    return number


def require_line(line: Any, dim: int) -> tuple[Floats, Floats]:
    """A point (dim,) [m] and a direction (dim,) of greatest number 1 (zero stays), or `SceneError`.

    In 2D they are of a line, in 3D of a plane and its normal.
    """
    if not isinstance(line, Sequence | np.ndarray) or len(line) != 2:
        raise SceneError(
            f"the line is {line!r}", where="fragment",
            remedy="give (point, direction), in 3D (point, normal)",
        )  # fmt: skip
    point = require_vector(line[0], dim, "the point", "fragment")
    along = require_vector(line[1], dim, "the direction" if dim == 2 else "the normal", "fragment")
    return point, along / (float(np.abs(along).max()) or 1.0)


def check_half_space(
    shape: HalfSpace, position: Any, angle: Any, velocity: Any, spin: Any, where: str
) -> None:
    """Raise `SceneError` for what a half-space can not do: be put elsewhere, turn, advance."""
    speed = np.zeros(shape.dim) if velocity is None else (
        require_vector(velocity, shape.dim, "velocity", where)
    )  # fmt: skip
    advance = abs(float(speed @ shape.normal))
    if advance > 1e-12 * float(np.linalg.norm(speed)):
        raise SceneError(
            f"a half-space can not advance ({advance:.3g} m/s along its normal)", where=where,
            remedy="give a velocity along its face (a belt), or use a fixed body that moves",
        )  # fmt: skip
    if not (position is None and angle is None and spin is None):
        raise SceneError(
            "a half-space is where its normal and offset put it", where=where,
            remedy="leave position, angle and spin out",
        )  # fmt: skip


def check_loads(loads: Loads, time: float, motion: Motion) -> Floats | None:
    """Loads at a time [s] as they are given: a row for every body, fragments included, all finite.

    Raises `SceneError` where they are none.
    """
    given = loads(time, motion)
    if given is None:
        return None
    shape = motion.rates.shape
    wrong = ""
    try:
        forces = require_real(given)
    except (TypeError, ValueError) as error:
        wrong = f"are not real numbers ({error})"
    else:
        if forces.shape != shape:
            wrong = f"have shape {forces.shape}"
        elif not np.isfinite(forces).all():
            wrong = "are not finite"
    if wrong:
        raise SceneError(
            f"they {wrong}", where=f"loads at {time:.6g} s",
            remedy=f"return finite numbers {shape}: a row for every body, the fixed ones and"
            " fragments too",
        )  # fmt: skip
    return forces
