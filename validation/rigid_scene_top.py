"""A free body in space in MuJoCo and ODE, for `rigid_scene_worker`: it turns, nothing touches it.

The scene holds ``top``: its principal moments ``inertia`` [kg m^2], the first ``spin`` [rad/s]
about these axes, and for MuJoCo the name of its ``integrator``.  The one frame returned holds the
quaternion (w, x, y, z) at the end.
"""

from __future__ import annotations

import time
from importlib import import_module

from validation.rigid_scene_shapes import Data, Path, text


def run_mujoco_top(scene: Data, step: float, steps: int) -> tuple[Path, str, float]:
    """As `rigid_scene_worker.run_mujoco`."""
    mujoco = import_module("mujoco")
    top = scene["top"]
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{text(step)}" gravity="0 0 0" '
        f'integrator="{top["integrator"]}"/>'
        '<worldbody><body><freejoint/><inertial pos="0 0 0" mass="1" '
        f'diaginertia="{text(*top["inertia"])}"/></body></worldbody></mujoco>'
    )
    state = mujoco.MjData(model)
    state.qvel[3:] = top["spin"]
    start = time.process_time()
    for _ in range(steps):
        mujoco.mj_step(model, state)
    cost = time.process_time() - start
    return [[[float(v) for v in state.qpos[3:]]]], mujoco.__version__, cost


def run_ode_top(scene: Data, step: float, steps: int, version: str) -> tuple[Path, str, float]:
    """As `rigid_scene_worker.run_ode`; ``version`` is handed through."""
    ode = import_module("ode")
    world = ode.World()
    world.setGravity((0.0, 0.0, 0.0))
    one, mass = ode.Body(world), ode.Mass()
    mass.setParameters(1.0, 0, 0, 0, *scene["top"]["inertia"], 0, 0, 0)
    one.setMass(mass)
    one.setAngularVel(tuple(scene["top"]["spin"]))
    start = time.process_time()
    for _ in range(steps):
        world.step(step)
    cost = time.process_time() - start
    return [[list(one.getQuaternion())]], version, cost
