"""Where moved grains find room, and the piston on top of them."""

from typing import Any

from adapters.bed import FloatArray, State, find_top_under
from adapters.bed.stones import spread_spheres
from adapters.errors import NotConverged
from adapters.scene import Scene


def find_room(
    scene: Scene, before: State, target: FloatArray, piston_height: float, *, may_wait: bool = False
) -> tuple[State, dict[str, Any], float]:
    """The relaxed bed, the relaxation's record, and the piston's height, in metres.

    By the scene's relaxation, under a piston at ``piston_height``; without room there, and if the
    piston ``may_wait`` and goes down, below the piston where it was, which then lies on top of
    the bed.  Raises `RelaxationNotConverged`.
    """
    try:
        return *relax_target(scene, before, target, piston_height), piston_height
    except NotConverged:
        if not may_wait or piston_height >= before.piston_height:
            raise
    moved, record = relax_target(scene, before, target, before.piston_height)
    spheres, edges = spread_spheres(scene.form, moved), scene.piston_edges
    top = find_top_under(*spheres, edges, scene.piston_reach)
    return moved, record | {"piston": "on the bed"}, min(top, before.piston_height)


def relax_target(
    scene: Scene, before: State, target: FloatArray, piston_height: float
) -> tuple[State, dict[str, Any]]:
    """The bed relaxed from the ``target`` positions, (n, 3) in metres, and the relaxation's record.

    Raises `RelaxationNotConverged`.
    """
    from adapters.relaxation import relax, relax_stones  # loads the compiler

    procedure, estimated = scene.procedure, before.move_to(target)
    assert procedure is not None
    if procedure.relaxation == "none":
        return estimated, {"method": "none"}
    walls, after = scene.walls(before.piston_height), scene.walls(piston_height)
    if scene.stones:
        return relax_stones(scene.form, estimated, before, walls, after)
    relaxation = relax(
        target, before, walls, scene.stiffness, method=procedure.relaxation, walls_after=after
    )
    return before.move_to(relaxation.position), relaxation.record()
