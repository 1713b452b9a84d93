"""Where a moved bed finds room: positions without overlaps, and the piston on top of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.bed import FloatArray, State
from adapters.errors import NotConverged, NotCredible
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
        target, before, scene.walls(before.piston_height), scene.stiffness,
        method=procedure.relaxation, walls_after=scene.walls(piston_height),
    )  # fmt: skip
    return relaxation.position, relaxation.record()


def relax_below(
    scene: Scene, before: State, target: FloatArray
) -> tuple[FloatArray, dict[str, Any], float]:
    """As `relaxed` with the piston where it was; then its height on top of the bed [m].

    Where grains have no room under a piston that went down: the bed settles below one that waits.
    """
    position, record = relax_target(scene, before, target, before.piston_height)
    top = find_top_under(scene, position, before.radius)
    return position, record | {"piston": "on the bed"}, min(top, before.piston_height)


def find_top_under(scene: Scene, position: FloatArray, radius: FloatArray) -> float:
    """Highest place [m] of grains under the piston; ``position`` (n, 3), ``radius`` (n,) in metres.

    Raises `NotCredible` where none is: a block smaller than the gaps between grains.
    """
    x, y = position[:, 0], position[:, 1]
    left, right, front, back = scene.piston_edges
    beyond = np.hypot(x - np.clip(x, left, right), y - np.clip(y, front, back))
    under = (beyond < radius) & (np.hypot(x, y) - radius < scene.piston_reach)
    if not under.any():
        raise NotCredible(
            "no grain is under the piston", where="loading.footprint",
            remedy="a wider footprint, or more grains",
        )  # fmt: skip
    return float((position[:, 2] + radius)[under].max())
