"""One planar scene in LMGC90 (Dubois, Jean) as ``compas_lmgc90``, for `rigid_scene_worker`.

NLGS, contact law IQS_CLB, for restitution 1 RST_CLB.  Contacts are looked for within ``alert`` of
the scene, in depths of the slabs; a hundredth where it says nothing, too little for impacts.
Slabs are free in space; half-spaces are large blocks; one coefficient of friction and one of
restitution for all contacts.  The binding starts bodies at rest: where all that move start with one
velocity, the fixed ones are driven with its opposite instead, which is the same motion seen from a
frame that goes along.
"""

from __future__ import annotations

import math
import time
from importlib import import_module, metadata

from validation.rigid_scene_shapes import (
    Data,
    NotThere,
    Path,
    frame_due,
    pair_friction,
    pair_restitution,
    pairs,
    slab,
)


def run_lmgc90(scene: Data, step: float, steps: int, every: int = 0) -> tuple[Path, str, float]:
    """As `run_mujoco`; the scene is turned so that gravity points along -z.

    The binding tells no velocities: they follow from its rule ``q+ = q + h (v + v+) / 2``.
    """
    gx, gy = scene["gravity"]
    weight = math.hypot(gx, gy)
    if abs(weight - 9.81) > 1e-9:
        raise NotThere(f"its gravity is 9.81 m/s^2, here {weight:g}")
    right, up = (-gy / weight, gx / weight), (-gx / weight, -gy / weight)
    bodies, depth = scene["bodies"], scene["depth"]
    starts = {tuple(body["velocity"]) for body in bodies if not body["fixed"]}
    if len(starts) > 1 or any(body["spin"] for body in bodies):
        raise NotThere("its binding starts bodies at rest")
    if any(any(body["velocity"]) for body in bodies if body["fixed"]):
        raise NotThere("its fixed bodies are moved already by the frame that goes along")
    begun = starts.pop()
    if any(body.get("load") for body in bodies):
        raise NotThere("loads are not passed on to its binding here")
    used = {pair_friction(bodies[i], bodies[j]) for i, j in pairs(scene)}
    if len(used) > 1:
        raise NotThere("its binding has one coefficient of friction for all contacts")
    bounces = {pair_restitution(bodies[i], bodies[j]) for i, j in pairs(scene)}
    if len(bounces) > 1:
        raise NotThere("its binding has one coefficient of restitution for all contacts")
    if bounces - {0.0, 1.0}:
        raise NotThere("its law RST_CLB pushes in the step after an impact too, unless e is 1")
    low = [min(body["position"][k] for body in bodies if not body["fixed"]) for k in (0, 1)]
    high = [max(body["position"][k] for body in bodies if not body["fixed"]) for k in (0, 1)]
    size = max(high[0] - low[0], high[1] - low[1], 4 * depth)
    blocks, density = [], []
    for body in bodies:
        if body["kind"] == "disc":
            raise NotThere("its binding has polyhedra only, no discs")
        if body["kind"] == "half-space":
            nx, ny = body["normal"]
            tx, ty = -ny, nx
            middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
            over = middle[0] * nx + middle[1] * ny - body["offset"]
            foot = [middle[0] - over * nx, middle[1] - over * ny]
            outline = [
                [foot[0] + s * size * tx - d * size * nx, foot[1] + s * size * ty - d * size * ny]
                for s, d in ((-1, 0), (-1, 1), (1, 1), (1, 0))
            ]
        else:
            c, s = math.cos(body["angle"]), math.sin(body["angle"])
            outline = [
                [body["position"][0] + c * x - s * y, body["position"][1] + s * x + c * y]
                for x, y in body["vertices"]
            ]
        turned = [[x * right[0] + y * right[1], x * up[0] + y * up[1]] for x, y in outline]
        wide = 3 * depth if body["fixed"] else depth
        blocks.append(slab(turned, wide))
        area = sum(
            a[0] * b[1] - b[0] * a[1]
            for a, b in zip(outline, outline[1:] + outline[:1], strict=True)
        ) / 2  # fmt: skip
        density.append(2700.0 if body["fixed"] else body["mass"] / area / depth)
    lmgc90 = import_module("compas_lmgc90.solver").Solver(dt=step)
    lmgc90.geometry_from_v_f(blocks, density)
    numpy = import_module("numpy")
    drive = [-(begun[0] * axis[0] + begun[1] * axis[1]) for axis in (right, up)]
    for k, body in enumerate(bodies):
        if body["fixed"]:
            lmgc90.v_drvdof[k] = {freedom: numpy.zeros(6) for freedom in range(1, 7)}
            for freedom, speed in zip((1, 3), drive, strict=True):
                lmgc90.v_drvdof[k][freedom][[0, 4]] = speed, 1.0
    bounce, friction = bounces.pop(), used.pop()
    law = ("RST_CLB", [bounce, 0.0, friction]) if bounce else ("IQS_CLB", friction)
    lmgc90.contact_law(*law, alert=scene.get("alert", 1e-2) * depth)
    lmgc90.preprocess()
    first = lmgc90.lmgc90.get_initial_state()
    begin = [list(place) for place in first.init_bodies]
    frames = [numpy.array(frame).reshape(3, 3) for frame in first.init_body_frames]
    path: Path = []
    cost, place, rate = 0.0, numpy.zeros((len(bodies), 3)), numpy.zeros((len(bodies), 3))
    along = numpy.array([*begun, 0.0])
    for number in range(1, steps + 1):
        start = time.process_time()
        last = lmgc90.lmgc90.compute_one_step()
        cost += time.process_time() - start
        now = numpy.zeros_like(place)
        for k in range(len(bodies)):
            move = [b - a for a, b in zip(begin[k], last.bodies[k], strict=True)]
            turn = numpy.array(last.body_frames[k]).reshape(3, 3).T @ frames[k]
            now[k] = (
                move[0] * right[0] + move[2] * up[0], move[0] * right[1] + move[2] * up[1],
                math.atan2(turn[2, 0], turn[0, 0]),
            )  # fmt: skip
        place, rate = now, 2.0 * (now - place) / step - rate
        if frame_due(number, steps, every):
            seen = [place + along * step * number, rate + along]
            path.append(numpy.hstack(seen).tolist())
    return path, metadata.version("compas_lmgc90"), cost
