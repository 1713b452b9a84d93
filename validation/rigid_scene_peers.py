"""The same planar scenes in MuJoCo, ODE and LMGC90, each in a process of its own.

A scene of `rigid_lcp` is written as plain data (`scene_data`), from which every engine builds its
own; `validation.rigid_scene_worker` says how, and that bodies become slabs.  Nothing of an engine
is imported here: one that is not installed, has no such shape, takes too long or dies gives a row
that says so.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.scene import Body, Scene
from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon

Floats = NDArray[np.float64]
Data = dict[str, Any]

SYSTEM_PYTHON = "/usr/bin/python3"
PEERS = ("mujoco", "ode", "lmgc90")
TITLES = {"mujoco": "MuJoCo", "ode": "ODE", "lmgc90": "LMGC90"}
WORKER = Path(__file__).with_name("rigid_scene_worker.py")
INSTALL = {
    "mujoco": "pip install mujoco",
    "ode": "apt-get install python3-pyode",
    "lmgc90": "pip install compas_lmgc90",
}


@dataclass(frozen=True)
class PeerScene:
    """What an engine made of a scene."""

    engine: str
    """Name and version."""
    path: Floats
    """(frames, n, 6): how far each body came in x, y [m] and turned [rad], and its rates; of a top
    (1, 1, 4), its quaternion; no frames if it did not run."""
    cpu_s: float
    """CPU time of the steps [s], without building the scene; NaN if it did not run."""
    why: str
    """Why it did not run; empty if it did."""

    @property
    def displacement(self) -> Floats:
        """(n, 3): how far each body came in x, y [m] and turned [rad]; empty if it did not run."""
        return np.zeros((0, 3)) if self.why else self.path[-1, :, :3]

    @property
    def greatest(self) -> float:
        """Greatest change of any coordinate of any body [m, rad]; inf if the motion blew up."""
        if not len(self.displacement):
            return nan
        finite = np.isfinite(self.displacement).all()
        return float(np.abs(self.displacement).max()) if finite else np.inf


def scene_data(
    scene: Scene, loads: Sequence[Sequence[float]] | None = None, *, impacts: bool = False
) -> Data:
    """A planar scene as plain data: numbers, words and lists.

    ``loads`` (n, 3): constant force and torque on each body [N, N m].  ``depth`` [m] of the slabs
    is the smallest size of a moving body.  ``impacts``: bodies are not at rest, which LMGC90 has to
    know, as it looks for contacts no further than it is told.
    """
    bodies = [_body_data(body) for body in scene.bodies]
    for data, load in zip(bodies, loads or [], strict=False):
        if any(load):
            data["load"] = [float(value) for value in load]
    depth = min(body.shape.reach for body in scene.bodies if body.movable)
    made = {"gravity": scene.gravity.tolist(), "depth": depth, "bodies": bodies}
    return made | {"alert": 0.5} if impacts else made


def _body_data(body: Body) -> Data:
    data: Data = {
        "fixed": not body.movable, "friction": body.friction, "restitution": body.restitution,
        "position": body.position.tolist(), "angle": float(body.angle[0]),
        "velocity": body.velocity.tolist(), "spin": float(body.spin[0]),
    }  # fmt: skip
    if body.movable:
        data |= {"mass": body.mass, "inertia": body.inertia}
    if isinstance(body.shape, Polygon):
        return data | {"kind": "polygon", "vertices": body.shape.vertices.tolist()}
    if isinstance(body.shape, Disc):
        return data | {"kind": "disc", "radius": body.shape.radius}
    if isinstance(body.shape, HalfSpace):
        normal = body.shape.normal.tolist()
        return data | {"kind": "half-space", "normal": normal, "offset": body.shape.offset}
    raise TypeError(f"{type(body.shape).__name__} is no shape of the plane")


def unless_it_falls(made: PeerScene, scene: Scene, seconds: float) -> PeerScene:
    """A run that ended after ``seconds`` [s]; as one that failed where body 0 met no contact.

    It should have: LMGC90's binding finds faces on faces, and lets what stands on a corner fall.
    """
    if made.why:
        return made
    fall = scene.bodies[0].velocity + seconds * scene.gravity
    if np.abs(made.path[-1, 0, 3:5] - fall).max() > 1e-6 * np.abs(fall).max():
        return made
    return _not_run(made.engine.split()[0], "no contact is found for a body on its corner")


def path_energy(scene: Scene, path: Floats) -> Floats:
    """Kinetic and potential energy (frames,) [J] of the moving bodies on a path (frames, n, 6)."""
    energy = np.zeros(len(path))
    for k, body in enumerate(scene.bodies):
        if body.movable:
            speed, spin = path[:, k, 3:5], path[:, k, 5]
            energy += 0.5 * body.mass * (speed**2).sum(axis=1) + 0.5 * body.inertia * spin**2
            energy -= body.mass * (body.position + path[:, k, :2]) @ scene.gravity
    return energy


@cache
def peer_missing(engine: str) -> str:
    """How to install an engine; empty where it is installed.  Imports nothing of it here."""
    if engine == "ode":
        try:
            found = subprocess.run([SYSTEM_PYTHON, "-c", "import ode"], capture_output=True)
        except OSError:
            return INSTALL[engine]
        return "" if found.returncode == 0 else INSTALL[engine]
    module = {"mujoco": "mujoco", "lmgc90": "compas_lmgc90"}[engine]
    return "" if find_spec(module) else INSTALL[engine]


def peer_run(
    engine: str, scene: Data, step: float, steps: int, *, every: int = 0, limit: float = 60.0
) -> PeerScene:
    """``steps`` steps of ``step`` [s] in an engine, at most ``limit`` seconds by the clock.

    The path has a frame each ``every`` steps, and the last one.
    """
    title = TITLES[engine]
    if remedy := peer_missing(engine):
        return _not_run(title, f"not installed: {remedy}")
    python = SYSTEM_PYTHON if engine == "ode" else sys.executable
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "scene.json", Path(folder) / "result.json"
        job = {"scene": scene, "step": step, "steps": steps, "every": every}
        source.write_text(json.dumps(job))
        words = [python, str(WORKER), engine, str(source), str(target)]
        one = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        ours = [str(WORKER.parents[1]), os.environ.get("PYTHONPATH", "")]
        one["PYTHONPATH"] = os.pathsep.join(filter(None, ours))
        try:
            ended = subprocess.run(
                words, capture_output=True, text=True, errors="replace", timeout=limit,
                stdin=subprocess.DEVNULL, env=os.environ | one, cwd=folder,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return _not_run(title, f"not done after {limit:g} s")
        if ended.returncode != 0 or not target.is_file():
            said = (ended.stderr.strip() or ended.stdout.strip()).splitlines()
            last = said[-1][:200] if said else "said nothing"
            return _not_run(title, f"died with code {ended.returncode}: {last}")
        result = json.loads(target.read_text())
    if "why" in result:
        return _not_run(title, result["why"])
    path = np.array(result["path"], dtype=float)
    return PeerScene(f"{title} {result['version']}", path, result["cpu_s"], "")


def _not_run(title: str, why: str) -> PeerScene:
    return PeerScene(title, np.zeros((0, 0, 6)), nan, why)
