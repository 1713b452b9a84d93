"""One instant of a text dump: rows of named columns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import DumpError

Kind = Literal["atoms", "entries"]


@dataclass(frozen=True)
class Frame:
    """One instant of a dump: n rows of named columns, in the units of the run (here SI)."""

    time_step: int
    """The engine's step count."""
    columns: tuple[str, ...]
    """Names as the header has them, such as ``x`` or ``c_contacts[1]``; c of them."""
    values: FloatArray
    """One row a grain or contact, shape (n, c); grains ascend by ``id`` where it is a column."""
    bounds: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """Box, low and high [m], shape (3, 2); (3, 3) or (3, 4) for a tilted box, (0, 2) for none."""
    kind: Kind = "atoms"
    """"atoms" for grains (dump custom), "entries" for contacts and the like (dump local)."""
    boundary: str = "ff ff ff"
    """What the header says of the box's sides and tilt."""

    def column(self, name: str) -> FloatArray:
        """Values of one column, shape (n,); raises `DumpError` when there is none of this name."""
        return self.block(name)[:, 0]

    def block(self, *names: str) -> FloatArray:
        """Values of columns side by side, C-contiguous, shape (n, len(names)); as `column`."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise DumpError(
                f"there is no column {', '.join(missing)}; there are {' '.join(self.columns)}",
                where=f"time step {self.time_step}",
                remedy="name it in the engine's dump command",
            )
        index = [self.columns.index(name) for name in names]
        return np.ascontiguousarray(self.values[:, index])
