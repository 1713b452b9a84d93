"""One planar scene in one other engine, in a process of its own, as engines may abort.

    python rigid_scene_worker.py ENGINE SCENE.json RESULT.json

Started by `rigid_scene_peers`; needs the engine and, for ODE, nothing but the standard library, as
that runs under the system's Python.  A body of the plane becomes a slab of the scene's ``depth``:

mujoco   MuJoCo (Todorov).  Slabs slide in x and y and turn about the normal of the plane by joints:
         no other motion exists.  Its most exact settings: elliptic cones, ``impratio`` 100, 30
         iterations without slip, the stiffest contact it allows (time constant of two steps).
ode      Open Dynamics Engine 0.16, ``World.step`` (Baraff's Dantzig).  Slabs are kept in the plane
         by a joint.  Its Python binding has boxes, spheres and planes only.
lmgc90   LMGC90 (Dubois, Jean) as ``compas_lmgc90``: `rigid_scene_lmgc90`.

A scene with ``"top"`` is one free body in space: `rigid_scene_top`.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from importlib import import_module
from typing import Any

from validation.rigid_scene_lmgc90 import run_lmgc90
from validation.rigid_scene_shapes import (
    Data,
    NotThere,
    Path,
    frame_due,
    pair_friction,
    pair_restitution,
    pairs,
    rectangle,
    text,
)
from validation.rigid_scene_top import run_mujoco_top, run_ode_top


def mujoco_model(scene: Data, step: float) -> str:
    """The scene in MuJoCo's XML; the plane's y is its z."""
    depth, bodies = scene["depth"], scene["bodies"]
    loose = [body["restitution"] for body in bodies]
    if any(loose) and set(filter(None, loose)) != {1.0}:
        raise NotThere("a coefficient of restitution other than 0 and 1 is no parameter of it")
    # negative numbers: stiffness and damping per effective mass; no damping gives restitution 1
    solref = text(-1 / (4 * step) ** 2, 0.0) if any(loose) else text(2 * step, 1.0)
    mixed = len({pair_friction(bodies[i], bodies[j]) for i, j in pairs(scene)}) > 1
    friction = pair_friction(bodies[pairs(scene)[0][0]], bodies[pairs(scene)[0][1]])
    contact = f'solref="{solref}" solimp="0.99 0.9999 {text(1e-3 * depth)} 0.5 2"'
    shape_common = f'{contact} condim="3" friction="{text(friction, 0, 0)}"'
    shape_common += ' contype="0" conaffinity="0"' if mixed else ""
    assets, world = [], []
    for k, body in enumerate(bodies):
        place = body["position"] if body["kind"] != "half-space" else [0.0, 0.0]
        geometry = ""
        if body["kind"] == "half-space":
            nx, ny = body["normal"]
            at = [body["offset"] * nx, body["offset"] * ny]
            geometry = (
                f'type="plane" size="0 0 1" pos="{text(at[0], 0, at[1])}" zaxis="{text(nx, 0, ny)}"'
            )
        elif body["kind"] == "disc":
            geometry = f'type="sphere" size="{text(body["radius"])}"'
        elif (sides := rectangle(body["vertices"])) is not None:
            geometry = f'type="box" size="{text(sides[0] / 2, depth / 2, sides[1] / 2)}"'
        else:
            points = [text(x, y, z) for x, z in body["vertices"] for y in (-depth / 2, depth / 2)]
            assets.append(f'<mesh name="m{k}" inertia="exact" vertex="{" ".join(points)}"/>')
            geometry = f'type="mesh" mesh="m{k}"'
        geometry = f'<geom name="g{k}" {geometry} {shape_common}/>'
        if body["fixed"]:
            half = -body.get("angle", 0.0) / 2
            turned = text(math.cos(half), 0, math.sin(half), 0)
            world.append(
                f'<body pos="{text(place[0], 0, place[1])}" quat="{turned}">{geometry}</body>'
            )
            continue
        mass, inertia = body["mass"], body["inertia"]
        # only the middle moment matters: no joint turns about the other axes
        world.append(
            f'<body name="b{k}" pos="{text(place[0], 0, place[1])}">'
            '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
            '<joint type="hinge" axis="0 -1 0"/>'
            f'<inertial pos="0 0 0" mass="{text(mass)}" diaginertia="{text(*[inertia] * 3)}"/>'
            f"{geometry}</body>"
        )
    sets = ""
    if mixed:
        sets = "<contact>" + "".join(
            f'<pair geom1="g{i}" geom2="g{j}" condim="3" {contact} '
            f'friction="{text(*[max(pair_friction(bodies[i], bodies[j]), 1e-5)] * 2, 0, 0, 0)}"/>'
            for i, j in pairs(scene)
        ) + "</contact>"  # fmt: skip
    gx, gy = scene["gravity"]
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{text(step)}" '
        f'gravity="{text(gx, 0, gy)}" cone="elliptic" impratio="100" noslip_iterations="30" '
        'noslip_tolerance="0" solver="Newton" tolerance="0" iterations="100"/>'
        f"<asset>{''.join(assets)}</asset><worldbody>{''.join(world)}</worldbody>{sets}</mujoco>"
    )


def run_mujoco(scene: Data, step: float, steps: int, every: int = 0) -> tuple[Path, str, float]:
    """Frames (`frame_due`), version, CPU seconds of the steps."""
    if "top" in scene:
        return run_mujoco_top(scene, step, steps)
    mujoco = import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(mujoco_model(scene, step))
    state = mujoco.MjData(model)
    moving = [k for k, body in enumerate(scene["bodies"]) if not body["fixed"]]
    for column, k in enumerate(moving):
        body = scene["bodies"][k]
        state.qpos[3 * column + 2] = body["angle"]
        state.qvel[3 * column : 3 * column + 3] = [*body["velocity"], body["spin"]]
        mujoco_load = body.get("load")
        if mujoco_load is not None:
            state.qfrc_applied[3 * column : 3 * column + 3] = mujoco_load
    path: Path = []
    cost = 0.0
    for k in range(1, steps + 1):
        start = time.process_time()
        mujoco.mj_step(model, state)
        cost += time.process_time() - start
        if not frame_due(k, steps, every):
            continue
        path.append([[0.0] * 6 for _ in scene["bodies"]])
        for column, body in enumerate(moving):
            place, rate = (
                [float(v) for v in values[3 * column : 3 * column + 3]]
                for values in (state.qpos, state.qvel)
            )
            place[2] -= scene["bodies"][body]["angle"]
            path[-1][body] = place + rate
    return path, mujoco.__version__, cost


def ode_version() -> str:
    """Version of the system's library, which its Python binding does not tell."""
    words = ["dpkg-query", "--show", "--showformat=${source:Upstream-Version}", "libode8"]
    try:
        found = subprocess.run(words, capture_output=True, text=True)
    except OSError:
        return "of unknown version"
    return found.stdout.strip() or "of unknown version"


def run_ode(scene: Data, step: float, steps: int, every: int = 0) -> tuple[Path, str, float]:
    """As `run_mujoco`."""
    if "top" in scene:
        return run_ode_top(scene, step, steps, ode_version())
    ode = import_module("ode")
    world, space, group = ode.World(), ode.HashSpace(), ode.JointGroup()
    world.setCFM(1e-12)  # of 1e-12 to 1e-6 the value that keeps stacks best
    world.setGravity((*scene["gravity"], 0.0))
    depth, bodies = scene["depth"], scene["bodies"]
    placed: list[Any] = []
    geometries: list[Any] = []
    planes: list[Any] = []  # Python must hold what ODE uses
    for k, body in enumerate(bodies):
        if body["kind"] == "half-space":
            geometry = ode.GeomPlane(space, (*body["normal"], 0.0), body["offset"])
        elif body["kind"] == "disc":
            geometry = ode.GeomSphere(space, body["radius"])
        elif (sides := rectangle(body["vertices"])) is not None:
            geometry = ode.GeomBox(space, (*sides, depth))
        else:
            raise NotThere("its Python binding has no convex polygon other than a box")
        geometry.number = k
        geometries.append(geometry)
        turned = body.get("angle", 0.0)
        frame = (
            math.cos(turned), -math.sin(turned), 0.0,
            math.sin(turned), math.cos(turned), 0.0, 0.0, 0.0, 1.0,
        )  # fmt: skip
        if body["fixed"]:
            placed.append(None)
            if body["kind"] != "half-space":
                geometry.setPosition((*body["position"], 0.0))
                geometry.setRotation(frame)
            continue
        one, mass = ode.Body(world), ode.Mass()
        mass.setParameters(body["mass"], 0, 0, 0, *[body["inertia"]] * 3, 0, 0, 0)
        one.setMass(mass)
        one.setPosition((*body["position"], 0.0))
        one.setRotation(frame)
        one.setLinearVel((*body["velocity"], 0.0))
        one.setAngularVel((0.0, 0.0, body["spin"]))
        geometry.setBody(one)
        plane = ode.Plane2DJoint(world)
        plane.attach(one, ode.environment)
        planes.append(plane)
        placed.append(one)

    def touch(_: Any, first: Any, second: Any) -> None:
        a, b = bodies[first.number], bodies[second.number]
        if a["fixed"] and b["fixed"]:
            return
        bounce = pair_restitution(a, b)
        for contact in ode.collide(first, second):
            contact.setMode(ode.ContactApprox1 | (ode.ContactBounce if bounce else 0))
            contact.setMu(pair_friction(a, b))
            contact.setBounce(bounce)
            ode.ContactJoint(world, group, contact).attach(first.getBody(), second.getBody())

    path: Path = []
    cost = 0.0
    for k in range(1, steps + 1):
        start = time.process_time()
        for one, body in zip(placed, bodies, strict=True):
            if one is not None and body.get("load") is not None:
                fx, fy, torque = body["load"]
                one.addForce((fx, fy, 0.0))
                one.addTorque((0.0, 0.0, torque))
        space.collide(None, touch)
        world.step(step)
        group.empty()
        cost += time.process_time() - start
        if frame_due(k, steps, every):
            path.append([_ode_state(one, body) for one, body in zip(placed, bodies, strict=True)])
    return path, ode_version(), cost


def _ode_state(one: Any, body: Data) -> list[float]:
    if one is None:
        return [0.0] * 6
    x, y, _ = one.getPosition()
    turn = one.getRotation()
    angle = math.atan2(turn[3], turn[0]) - body["angle"]
    vx, vy, _ = one.getLinearVel()
    spin = one.getAngularVel()[2]
    return [x - body["position"][0], y - body["position"][1], angle, vx, vy, spin]


ENGINES = {"mujoco": run_mujoco, "ode": run_ode, "lmgc90": run_lmgc90}


def main(engine: str, source: str, target: str) -> None:
    """Run and write ``{"path", "version", "cpu_s"}`` or ``"why"``."""
    with open(source, encoding="utf-8") as file:
        job = json.load(file)
    result: Data
    try:
        path, version, cost = ENGINES[engine](job["scene"], job["step"], job["steps"], job["every"])
        result = {"path": path, "version": version, "cpu_s": cost}
    except NotThere as reason:
        result = {"why": str(reason)}
    with open(target, "w", encoding="utf-8") as file:
        json.dump(result, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
