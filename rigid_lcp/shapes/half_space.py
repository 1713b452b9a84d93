"""Half-spaces: floors and walls, in the plane and in space."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes.numbers import require_finite_shape


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Everything with ``normal . x <= offset``: floors and walls, in 2D or 3D, always fixed.

    ``normal`` (dim,) points out of the solid and is normalised; ``offset`` [m] is the distance of
    its face from the origin along it.  Raises `ShapeError` for a normal of length zero.
    """

    normal: Floats
    offset: float

    reach = width = inf

    def __init__(self, normal: ArrayLike, offset: float = 0.0) -> None:
        direction = require_finite_shape(normal, "normal", "half-space")
        largest = float(np.abs(direction).max(initial=0.0))
        if direction.shape not in ((2,), (3,)) or largest == 0:
            raise ShapeError(
                f"the normal is {normal!r}", where="half-space",
                remedy="give two or three numbers that are not all zero",
            )  # fmt: skip
        distance = require_finite_shape(offset, "offset", "half-space")
        if distance.ndim:
            raise ShapeError(
                f"the offset is {offset!r}", where="half-space", remedy="give one number of metres"
            )
        direction = direction / largest  # squares of what is left neither vanish nor overflow
        object.__setattr__(self, "normal", direction / np.linalg.norm(direction))
        object.__setattr__(self, "offset", float(distance))

    @property
    def dim(self) -> int:
        """Dimension of the space it halves."""
        return len(self.normal)
