"""A settling random bed for tests of the moves of a jump."""

from __future__ import annotations

import numpy as np

from adapters.bed.container import Container
from adapters.bed.state import FloatArray
from adapters.laws import get_law
from adapters.laws.form.contract import Law
from adapters.moves.contract import Jump, Move
from adapters.procedure.progress import Progress

LOG = get_law("log")
CYCLE = np.arange(30.0, 51.0)
QUARTER = Container("cylinder", ("x", "y"), radius=0.03)
WHOLE = Container("cylinder", radius=0.03)
QUIET = Progress(quiet=True)


def bed(seed: int = 0, count: int = 120, noise: float = 1e-6) -> tuple[FloatArray, FloatArray]:
    """Positions at 21 cycle ends [m], shape (21, n, 3), and radii [m]: a settling random bed."""
    random = np.random.default_rng(seed)
    place = random.uniform(0.002, 0.02, (count, 3))
    drop = np.multiply.outer(np.log(CYCLE / 30), -1e-5 * place[:, 2] / 0.01)
    path = noise * random.standard_normal((21, count, 3)).cumsum(axis=0)
    path[:, :, 2] += drop
    return place + path, random.uniform(2e-3, 4e-3, count)


def moved(
    way: Move,
    position: FloatArray,
    radius: FloatArray,
    h: float = 30,
    law: Law = LOG,
    container: Container = QUARTER,
) -> FloatArray:
    """Displacement of the bed in a quarter cylinder [m], shape (n, 3)."""
    return way.displacement(Jump(CYCLE, position, radius, law, h, container))
