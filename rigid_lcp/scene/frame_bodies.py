"""Bodies that a run has changed, as arrays of a frame: worn corners and parts of broken grains.

A frame of a run whose bodies are those of the scene file holds none of this.
"""

from __future__ import annotations

from dataclasses import astuple, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid_lcp.motion import Scene, make_world
from rigid_lcp.wear import Broken, WearState, WornShape

if TYPE_CHECKING:
    from rigid_lcp.scene.simulation import Simulation

WORN = ("normal", "lost", "pending")


def pack_bodies(run: Simulation) -> dict[str, Any]:
    """Arrays of the bodies of a run that wears or breaks; none of one that does neither."""
    if run.wear is None and not run.broken:
        return {}
    scene = run.world.scene
    none = np.zeros((0, scene.dim))
    corners = [
        getattr(body.shape, "vertices", none) if body.movable else none for body in scene.bodies
    ]
    # the number of the body of the file's scene that each body is a part of
    whole = list(range(len(scene.bodies) - len(run.broken)))
    for event in run.broken:
        whole.append(whole[event.body])
    arrays: dict[str, Any] = {
        "body_corners": np.concatenate(corners),
        "body_count": np.array([len(each) for each in corners]),
        "body_mass": np.array([body.mass for body in scene.bodies]),
        "body_inertia": np.array([body.inertia for body in scene.bodies if body.movable]),
        "body_whole": np.array(whole),
        "broken": np.array([astuple(event) for event in run.broken])
        .reshape(-1, len(fields(Broken))),
    }  # fmt: skip
    worn = run.worn
    if worn is not None:
        grains = [grain for grain in worn.grains if grain is not None]
        arrays |= {
            "wear_sums": np.array([worn.volume, worn.work, worn.mass, worn.energy]),
            "wear_counts": np.array([-1 if g is None else len(g.lost) for g in worn.grains]),
        }
        for name in WORN if grains else ():
            arrays[f"wear_{name}"] = np.concatenate([getattr(grain, name) for grain in grains])
    return arrays


def restore_bodies(run: Simulation, frame: dict[str, Any]) -> None:
    """Give a run at its start the bodies of a frame; nothing where the frame holds none."""
    if "body_corners" not in frame:
        return
    run.world, _ = make_world(rebuild_frame_scene(frame, run.world.scene))
    run.broken = [
        Broken(float(t), int(body), int(part), float(tension), float(strength))
        for t, body, part, tension, strength in frame["broken"]
    ]
    if "wear_counts" in frame:
        grains: list[WornShape | None] = []
        ends = np.cumsum(np.maximum(frame["wear_counts"], 0))
        for body, count, end in zip(
            run.world.scene.bodies, frame["wear_counts"], ends, strict=True
        ):
            mine = (frame[f"wear_{name}"][end - count : end] for name in WORN)
            grains.append(None if count < 0 else WornShape(body.shape, *mine))
        run.worn = WearState(grains, *map(float, frame["wear_sums"]))


def rebuild_frame_scene(frame: dict[str, Any], scene: Scene) -> Scene:
    """The bodies of a frame, where ``scene`` is the one of the file; itself if none has changed."""
    if "body_corners" not in frame:
        return scene
    ends = np.cumsum(frame["body_count"])
    made = Scene(scene.dim, scene.gravity)
    moving = 0
    for number, whole in enumerate(frame["body_whole"]):
        body = scene.bodies[whole]
        corners = frame["body_corners"][ends[number] - frame["body_count"][number] : ends[number]]
        if body.movable:
            inertia, moving = frame["body_inertia"][moving], moving + 1
            inertia = float(inertia) if scene.dim == 2 else inertia
            mass = float(frame["body_mass"][number])
            body = replace(body, mass=mass, inertia=inertia)
            if len(corners) and not np.array_equal(corners, body.shape.vertices):
                body = replace(body, shape=type(body.shape).of_corners(corners))
        made.bodies.append(body)
    return made
