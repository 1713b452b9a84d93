"""Where a moved bed finds room: positions without overlaps, and the piston on top of them."""

from __future__ import annotations

from typing import Any

from adapters.bed import FloatArray, State, find_top_under
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
    top = find_top_under(position, before.radius, scene.piston_edges, scene.piston_reach)
    return position, record | {"piston": "on the bed"}, min(top, before.piston_height)
