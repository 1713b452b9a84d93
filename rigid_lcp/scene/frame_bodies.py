"""Bodies that a run has changed, as arrays of a frame: worn corners and parts of broken grains.

A frame of a run whose bodies are those of the scene file holds none of this.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion import Scene, make_world
from rigid_lcp.shapes import Polygon
from rigid_lcp.wear import Broken, SolidWear, WearState, WornPolygon, WornPolyhedron

if TYPE_CHECKING:
    from rigid_lcp.motion import Body
    from rigid_lcp.scene.simulation import Simulation

Floats = NDArray[np.float64]
BROKEN = ("time", "body", "part", "tension", "strength")


def pack_bodies(run: Simulation) -> dict[str, Any]:
    """Arrays of the bodies of a run that wears or breaks; none of one that does neither."""
    if run.wear is None and not run.broken:
        return {}
    bodies = run.world.scene.bodies
    corners = [_corners(body, run.world.scene.dim) for body in bodies]
    arrays: dict[str, Any] = {
        "body_corners": np.concatenate(corners),
        "body_count": np.array([len(each) for each in corners]),
        "body_mass": np.array([body.mass for body in bodies]),
        "body_inertia": np.array([body.inertia for body in bodies if body.movable]),
        "body_whole": np.array(_wholes(run)),
        "broken": np.array([[getattr(event, name) for name in BROKEN] for event in run.broken])
        .reshape(-1, len(BROKEN)),
    }  # fmt: skip
    if run.worn is not None:
        arrays |= _pack_wear(run.worn)
    return arrays


def _pack_wear(worn: WearState | SolidWear) -> dict[str, Any]:
    arrays = {
        "wear_pending": worn.pending,
        "wear_sums": np.array([worn.volume, worn.work, worn.mass, worn.energy]),
    }
    grains: list[Any] = [grain for grain in worn.grains if grain is not None]
    if isinstance(worn, SolidWear):
        arrays["wear_counts"] = np.array([-1 if g is None else len(g.lost) for g in worn.grains])
        names: tuple[str, ...] = ("normal", "lost")
    else:
        arrays["wear_counts"] = np.array([
            (0, 0) if g is None else (len(g.sharp), len(g.vertices)) for g in worn.grains
        ])  # fmt: skip
        names = ("sharp", "lost", "vertices", "owner", "total")
    return arrays | {
        f"wear_{name}": np.concatenate([getattr(grain, name) for grain in grains])
        for name in (names if grains else ())
    }


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
        restored = _restore_wear_2d if run.world.scene.dim == 2 else _restore_wear_3d
        run.worn = restored(frame, run.world.scene)
        volume, work, mass, energy = (float(value) for value in frame["wear_sums"])
        run.worn.volume, run.worn.work = volume, work
        run.worn.mass, run.worn.energy = mass, energy


def _restore_wear_2d(frame: dict[str, Any], _: Scene) -> WearState:
    counts = frame["wear_counts"]
    ends = np.cumsum(counts, axis=0)
    grains: list[WornPolygon | None] = []
    for (sharp, now), (sharp_end, end) in zip(counts, ends, strict=True):
        a, b = slice(sharp_end - sharp, sharp_end), slice(end - now, end)
        grains.append(None if now == 0 else WornPolygon(
            frame["wear_sharp"][a], frame["wear_lost"][a], frame["wear_vertices"][b],
            frame["wear_owner"][b], frame["wear_total"][b],
        ))  # fmt: skip
    first = np.concatenate([[0], ends[:, 1]]).astype(np.int64)
    return WearState(grains, first, frame["wear_pending"])


def _restore_wear_3d(frame: dict[str, Any], scene: Scene) -> SolidWear:
    counts = frame["wear_counts"]
    ends = np.cumsum(np.maximum(counts, 0))
    grains: list[WornPolyhedron | None] = []
    for body, count, end in zip(scene.bodies, counts, ends, strict=True):
        mine = slice(end - count, end)
        grains.append(None if count < 0 else WornPolyhedron(
            body.shape, frame["wear_normal"][mine], frame["wear_lost"][mine],
            frame["wear_pending"][mine],
        ))  # fmt: skip
    return SolidWear(grains)


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
                body = replace(body, shape=_shape(corners, scene.dim))
        made.bodies.append(body)
    return made


def _corners(body: Body, dim: int) -> Floats:
    if not body.movable or not hasattr(body.shape, "vertices"):
        return np.zeros((0, dim))
    return np.asarray(body.shape.vertices)


def _wholes(run: Simulation) -> list[int]:
    """Number of the body of the file's scene that each body is a part of."""
    added = len(run.world.scene.bodies) - len(run.broken)
    whole = list(range(added))
    for event in run.broken:
        whole.append(whole[event.body])
    return whole


def _shape(corners: Floats, dim: int) -> Any:
    if dim == 3:
        from rigid_lcp.shapes import Polyhedron

        return Polyhedron.of_corners(corners)
    made = Polygon(corners)
    object.__setattr__(made, "vertices", corners)  # to the last digit, without a new centroid
    return made
