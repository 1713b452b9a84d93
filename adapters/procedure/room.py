"""Where a moved bed finds room: positions without overlaps, and the piston on top of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.bed import FloatArray, State
from adapters.errors import NotConverged
from adapters.scene import Scene


def find_room(
    scene: Scene, before: State, target: FloatArray, piston_height: float, *, may_wait: bool = False
) -> tuple[FloatArray, dict[str, Any], float]:
    """Relaxed positions (n, 3), the relaxation's record, and the piston's height, in metres.

    By the scene's relaxation, under a piston at ``piston_height``; without room there, and if the
    piston ``may_wait`` and goes down, below the piston where it was.  Raises
    `RelaxationNotConverged`.
    """
    try:
        return *relax_target(scene, before, target, piston_height), piston_height
    except NotConverged:
        if not may_wait or piston_height >= before.piston_height:
            raise
    return relax_below(scene, before, target)


def relax_target(
    scene: Scene, before: State, target: FloatArray, piston_height: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Relaxed positions of the ``target`` ones, (n, 3) in metres, and the relaxation's record.

    Raises `RelaxationNotConverged`.
    """
    from adapters.relaxation import relax  # loads the compiler

    procedure = scene.procedure
    assert procedure is not None
    if procedure.relaxation == "none":
        return target, {"method": "none"}
    relaxation = relax(
        target, before, scene.container.walls(before.piston_height, scene.piston_reach),
        scene.stiffness, method=procedure.relaxation,
        walls_after=scene.container.walls(piston_height, scene.piston_reach),
    )  # fmt: skip
    return relaxation.position, relaxation.record()


def relax_below(
    scene: Scene, before: State, target: FloatArray
) -> tuple[FloatArray, dict[str, Any], float]:
    """As `relaxed` with the piston where it was; then its height on top of the bed [m].

    Where grains have no room under a piston that went down: the bed settles below one that waits.
    """
    position, record = relax_target(scene, before, target, before.piston_height)
    top = find_top_under(position, before.radius, scene.piston_reach)
    return position, record | {"piston": "on the bed"}, min(top, before.piston_height)


def find_top_under(position: FloatArray, radius: FloatArray, reach: float) -> float:
    """Highest place [m] of grains under a piston of radius ``reach`` [m].

    ``position`` (n, 3) and ``radius`` (n,) in metres.
    """
    under = np.hypot(position[:, 0], position[:, 1]) - radius < reach
    return float((position[:, 2] + radius)[under].max())
