"""One contact in YADE, under the contact law, walls and settings that every scene gets."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from adapters.engines.yade import PARAMETERS, YadeEngine
from adapters.files.dump_reader import read_frames
from adapters.files.window import read_contacts
from adapters.scene.tables import Scene
from validation.bench.few_grains import RADIUS, Track

START = """\
import os
import sys

import numpy as np
from yade import Omega, Vector3

sys.path.insert(0, os.getcwd())
import bed
import record

O = Omega()
parameters = bed.read_parameters()
bed.add_materials(parameters)
bed.add_grains(parameters)
bed.add_walls(parameters)
count = parameters["grain_count"]
"""
"""How a script begins: grains and walls of the parameters are there."""

SCRIPT = (
    START
    + """\
few = parameters["few"]
states = [O.bodies[number].state for number in range(count)]
for number, (state, velocity) in enumerate(zip(states, few["velocity"]), 1):
    state.vel = Vector3(*velocity)
    if not few["free"] or number in few["held"]:
        state.blockedDOFs = "xyzXYZ"
states[0].angVel = Vector3(0, few["spin"], 0)
if few["push"]:
    O.forces.setPermF(0, Vector3(*few["push"]))
bed.set_engines(parameters)
dumps = record.Dumps(parameters)
force = open("force.txt", "w")


def frame():
    bed.renew_forces()
    dumps.frame()
    np.savetxt(force, [O.forces.f(number, True) for number in range(count)], fmt="%.17g")


frame()
for velocity, steps in few["legs"]:
    if velocity:
        states[0].vel = Vector3(*velocity)
    for _ in range(steps):
        O.step()
        if O.iter % few["every"] == 0:
            frame()
record.save_scene()
force.close()
print(f"COMPLETE step {O.iter}", flush=True)
"""
)


def run_grains(
    scene: Scene,
    position: FloatArray,
    velocity: FloatArray,
    motion: Sequence[str],
    *,
    time_step: float,
    every: int = 1,
    materials: Callable[[str], str] = str,
    radius: FloatArray | None = None,
) -> Track:
    """Run YADE, without gravity; as `validation.bench.few_grains.run_grains`.

    ``motion`` are the same lines of a LIGGGHTS deck: ``fix ... nve/sphere`` frees the grains, but
    those of ``group held id ...``; ``addforce`` pushes the first one, ``omegay`` spins it, ``move
    linear`` drives it, ``gravity`` pulls all; ``run`` steps.  ``materials`` may change the
    parameters' text.  Velocities are those of the half step before an instant.  Raises as
    `YadeEngine.run`.
    """
    engine = YadeEngine()
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        height = float(position[:, 2].max())
        radius = np.full(len(position), RADIUS) if radius is None else radius
        digests = engine.write_preparation(scene, position, radius, height, folder)
        content = json.loads((folder / PARAMETERS).read_text())
        few = parse_motion(motion)
        content |= {"gravity": few.pop("gravity"), "time_step": time_step,
                    "grain_count": len(radius)}  # fmt: skip
        content["few"] = {"velocity": velocity.tolist(), "every": every, **few}
        (folder / PARAMETERS).write_text(materials(json.dumps(content)))
        (folder / "few.py").write_text(SCRIPT)
        engine.run(scene, "few.py", folder, lambda: None, digests)
        frames = list(read_frames(folder / "states.dump"))
        contacts = tuple(read_contacts(frame) for frame in read_frames(folder / "contacts.dump"))
        force = np.loadtxt(folder / "force.txt").reshape(-1, len(radius), 3)
    position, velocity, spin = (
        np.array([frame.block(*(letter + axis for axis in "xyz")) for frame in frames])
        for letter in ("", "v", "omega")
    )
    time = time_step * np.array([frame.time_step for frame in frames])
    return Track(time, position, velocity, spin, force, contacts)


def parse_motion(lines: Sequence[str]) -> dict[str, Any]:
    """Lines of a LIGGGHTS deck as what the script understands."""
    free, gravity, spin, held, push, leg, legs = False, 0.0, 0.0, [], [], [], []
    for line in lines:
        words = line.split()
        if "nve/sphere" in words:
            free = True
        elif words[:3] == ["group", "held", "id"]:
            held = [int(word) for word in words[3:]]
        elif "omegay" in words:
            spin = float(words[-1])
        elif "gravity" in words:
            gravity = float(words[4])
        elif "addforce" in words:
            push = [float(word) for word in words[-3:]]
        elif "linear" in words:
            leg = [float(word) for word in words[5:8]]
        elif words[0] == "run":
            legs.append([leg, int(words[1])])
    found = {"free": free, "gravity": gravity, "spin": spin}
    return found | {"held": held, "push": push, "legs": legs}
