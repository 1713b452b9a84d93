"""One planar scene in one other engine, in a process of its own, as engines may abort.

    python rigid_scene_worker.py ENGINE SCENE.json RESULT.json

Started by `rigid_scene_peers`; needs the engine and, for ODE, nothing but the standard library, as
that runs under the system's Python.  A body of the plane becomes a slab of the scene's ``depth``:

mujoco   MuJoCo (Todorov).  Slabs slide in x and y and turn about the normal of the plane by joints:
         no other motion exists.  Its most exact settings: elliptic cones, ``impratio`` 100, 30
         iterations without slip, the stiffest contact it allows (time constant of two steps).
ode      Open Dynamics Engine 0.16, ``World.step`` (Baraff's Dantzig).  Slabs are kept in the plane
         by a joint.  Its Python binding has boxes, spheres and planes only.
lmgc90   LMGC90 (Dubois, Jean) as ``compas_lmgc90``: NLGS, law IQS_CLB.  Slabs are free in space;
         half-spaces are large blocks; one coefficient of friction for all; no restitution.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from importlib import import_module, metadata
from typing import Any

Data = dict[str, Any]


class NotThere(Exception):
    """The engine has no such shape, law or load; the message says which."""


def pair_friction(a: Data, b: Data) -> float:
    """The smaller of two bodies' coefficients; None leaves it to the other."""
    given = [value for value in (a["friction"], b["friction"]) if value is not None]
    return min(given, default=0.0)


def pairs(scene: Data) -> list[tuple[int, int]]:
    """Pairs of bodies of which one moves at least."""
    bodies = scene["bodies"]
    fixed = [body["fixed"] for body in bodies]
    count = len(bodies)
    return [(i, j) for i in range(count) for j in range(i) if not (fixed[i] and fixed[j])]


def rectangle(vertices: list[list[float]]) -> tuple[float, float] | None:
    """Width and height of a rectangle whose sides lie along the axes; else None."""
    xs, ys = sorted({x for x, _ in vertices}), sorted({y for _, y in vertices})
    if len(vertices) != 4 or len(xs) != 2 or len(ys) != 2:
        return None
    return xs[1] - xs[0], ys[1] - ys[0]


def text(*numbers: float) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


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


def run_mujoco(scene: Data, step: float, steps: int) -> tuple[list[list[float]], str, float]:
    """Displacements (x, y, angle) of every body, version, CPU seconds of the steps."""
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
    start = time.process_time()
    for _ in range(steps):
        mujoco.mj_step(model, state)
    cost = time.process_time() - start
    ends = [[0.0, 0.0, 0.0] for _ in scene["bodies"]]
    for column, k in enumerate(moving):
        x, y, turned = (float(v) for v in state.qpos[3 * column : 3 * column + 3])
        ends[k] = [x, y, turned - scene["bodies"][k]["angle"]]
    return ends, mujoco.__version__, cost


def ode_version() -> str:
    """Version of the system's library, which its Python binding does not tell."""
    words = ["dpkg-query", "--show", "--showformat=${source:Upstream-Version}", "libode8"]
    try:
        found = subprocess.run(words, capture_output=True, text=True)
    except OSError:
        return "of unknown version"
    return found.stdout.strip() or "of unknown version"


def run_ode(scene: Data, step: float, steps: int) -> tuple[list[list[float]], str, float]:
    """As `run_mujoco`."""
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
        bounce = min((r for r in (a["restitution"], b["restitution"]) if r is not None), default=0)
        for contact in ode.collide(first, second):
            contact.setMode(ode.ContactApprox1 | (ode.ContactBounce if bounce else 0))
            contact.setMu(pair_friction(a, b))
            contact.setBounce(bounce)
            ode.ContactJoint(world, group, contact).attach(first.getBody(), second.getBody())

    start = time.process_time()
    for _ in range(steps):
        for one, body in zip(placed, bodies, strict=True):
            if one is not None and body.get("load") is not None:
                fx, fy, torque = body["load"]
                one.addForce((fx, fy, 0.0))
                one.addTorque((0.0, 0.0, torque))
        space.collide(None, touch)
        world.step(step)
        group.empty()
    cost = time.process_time() - start
    ends = []
    for one, body in zip(placed, bodies, strict=True):
        if one is None:
            ends.append([0.0, 0.0, 0.0])
            continue
        x, y, _z = one.getPosition()
        turn = one.getRotation()
        angle = math.atan2(turn[3], turn[0]) - body["angle"]
        ends.append([x - body["position"][0], y - body["position"][1], angle])
    return ends, ode_version(), cost


def slab(outline: list[list[float]], depth: float) -> Data:
    """Vertices and outward faces of a slab over an anticlockwise outline (x, z)."""
    count = len(outline)
    vertices = [[x, y, z] for y in (-depth / 2, depth / 2) for x, z in outline]
    near, far = list(range(count)), list(range(2 * count - 1, count - 1, -1))
    sides = [[(k + 1) % count, k, count + k, count + (k + 1) % count] for k in range(count)]
    return {"vertices": vertices, "faces": [near, far, *sides]}


def run_lmgc90(scene: Data, step: float, steps: int) -> tuple[list[list[float]], str, float]:
    """As `run_mujoco`; the scene is turned so that gravity points along -z."""
    gx, gy = scene["gravity"]
    weight = math.hypot(gx, gy)
    if abs(weight - 9.81) > 1e-9:
        raise NotThere(f"its gravity is 9.81 m/s^2, here {weight:g}")
    right, up = (-gy / weight, gx / weight), (-gx / weight, -gy / weight)
    bodies, depth = scene["bodies"], scene["depth"]
    if any(body["restitution"] for body in bodies):
        raise NotThere("its law IQS_CLB has no restitution")
    if any(any(body["velocity"]) or body["spin"] for body in bodies if not body["fixed"]):
        raise NotThere("its binding starts bodies at rest")
    if any(body.get("load") for body in bodies):
        raise NotThere("loads are not passed on to its binding here")
    used = {pair_friction(bodies[i], bodies[j]) for i, j in pairs(scene)}
    if len(used) > 1:
        raise NotThere("its binding has one coefficient of friction for all contacts")
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
    for k, body in enumerate(bodies):
        if body["fixed"]:
            lmgc90.v_drvdof[k] = {freedom: numpy.zeros(6) for freedom in range(1, 7)}
    lmgc90.contact_law("IQS_CLB", used.pop(), alert=1e-2 * depth)
    lmgc90.preprocess()
    first = lmgc90.lmgc90.get_initial_state()
    begin = [list(place) for place in first.init_bodies]
    frames = [numpy.array(frame).reshape(3, 3) for frame in first.init_body_frames]
    start = time.process_time()
    for _ in range(steps):
        last = lmgc90.lmgc90.compute_one_step()
    cost = time.process_time() - start
    ends = []
    for k in range(len(bodies)):
        move = [b - a for a, b in zip(begin[k], last.bodies[k], strict=True)]
        turn = numpy.array(last.body_frames[k]).reshape(3, 3).T @ frames[k]
        ends.append([
            move[0] * right[0] + move[2] * up[0], move[0] * right[1] + move[2] * up[1],
            math.atan2(turn[2, 0], turn[0, 0]),
        ])  # fmt: skip
    return ends, metadata.version("compas_lmgc90"), cost


ENGINES = {"mujoco": run_mujoco, "ode": run_ode, "lmgc90": run_lmgc90}


def main(engine: str, source: str, target: str) -> None:
    """Run and write ``{"displacement": [[x, y, angle]...], "version", "cpu_s"}`` or ``"why"``."""
    with open(source, encoding="utf-8") as file:
        job = json.load(file)
    result: Data
    try:
        moves, version, cost = ENGINES[engine](job["scene"], job["step"], job["steps"])
        result = {"displacement": moves, "version": version, "cpu_s": cost}
    except NotThere as reason:
        result = {"why": str(reason)}
    with open(target, "w", encoding="utf-8") as file:
        json.dump(result, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
