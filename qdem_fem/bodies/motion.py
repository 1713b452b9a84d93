"""How far a march has come, and its account of energies."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass
class Motion:
    """The state of a march beside its fields: what a checkpoint keeps with them."""

    steps_done: int = 0
    step: float | None = None
    """Time step that the march began with [s]; None before."""
    behind: bool = False
    """True while velocities are half a step behind; False: they are at the time itself."""
    work: Floats = field(default_factory=lambda: np.zeros(3))
    """Work of the loads and of prescribed motion, and what viscosity took, since the start [J]."""
    gravity_work: float = 0.0
    """Work of gravity since the start [J]."""
    absorbed: float = 0.0
    """Energy that absorbing faces took since the start [J]."""
    displacement_set: bool = False
    """Whether the user set a displacement since the last step."""
    put_in: float = nan
    """Energy of the state that the user set [J]; NaN: not known yet."""

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * (self.step or 0.0)
