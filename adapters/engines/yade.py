"""YADE (Debian's 2023.02a) as an engine: static scripts, one JSON file, fresh processes."""

import json
import re
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed import GRAVITY, WHOLE, Container, FloatArray, Radii, contact_law
from adapters.engines import decks, plan
from adapters.engines.contract import EngineStart
from adapters.engines.crib import find_crib_forces, load_settled
from adapters.engines.liggghts_decks import MIRROR_YOUNG
from adapters.engines.taps import TappingEngine
from adapters.scene import Scene

SCRIPTS = {"in.prepare": "prepare.py", "in.cycles": "cycles.py"}
"""Script of each deck."""
PARAMETERS = "params.json"
BEGUN = re.compile("Running script")
LOOP_TIME = re.compile(r"^LOOP (\S+) s()", re.MULTILINE)
BANNER = re.compile(r"Yade version: ((\d{4})\S*)")


class YadeEngine(TappingEngine):
    """Writes the parameters of a window, runs ``yade``, and knows its manners.

    YADE exits 0 with NaN and with escaped grains; the script's last line ``COMPLETE step N`` is
    the sentinel looked for here, `adapters.procedure.checks` does the rest.  ``-x`` has it exit 1
    after an exception, ``-n`` open no window, ``-j1`` repeat itself bit for bit.
    """

    name = "yade"
    auto_order = 2
    grain_steps_per_s = 0.58e6  # tens of thousands of grains on one core: docs/engines.md
    title, question, banner = "Yade", "--version", BANNER
    oldest = (2023,)  # from then on walls are known to be flat when asked (``hertzian``)
    remedy = "sudo apt-get install yade"
    begun, loop_time = BEGUN, LOOP_TIME
    launch = "launch it without MPI: YADE runs in one process"
    piston_wall = "piston"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder."""
        words = [SCRIPTS[deck], PARAMETERS] if deck in SCRIPTS else [deck]
        return [*scene.engine.launcher, "yade", "-n", "-x", "-j1", *words]

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engines.contract.Engine`."""
        content = gather_shared_parameters(scene, height)
        content["settle"] = asdict(plan.plan_settling(scene, height))
        content["settle"]["equilibrium_ratio"] = plan.PLAN.equilibrium_ratio
        content["grains"] = {"position": position.tolist(), "radius": radius.tolist()}
        return self._write(folder, "prepare.py", content)

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engines.contract.Engine`."""
        assert scene.loading is not None
        shutil.copyfile(start.restart, folder / "start.restart")
        steps = scene.steps_per_cycle
        content = gather_shared_parameters(scene, start.piston_height)
        content["piston"] = {
            "mass": scene.loading.piston_mass,
            "height": start.piston_height,
            **cover_piston(
                scene.container, scene.piston_reach, scene.sample.radii, scene.piston_edges
            ),
        }
        content["window"] = {
            "start": start.kind, "cycles": cycles, "steps_per_cycle": steps,
            "track_steps": steps // scene.samples_per_cycle, "load": _describe_load(scene),
        }  # fmt: skip
        if start.first:
            content["window"]["seat"] = asdict(plan.plan_seating(scene))
            if scene.sample.rain_friction is not None:
                content["window"]["renew_friction"] = True
        if scene.loading.crib:
            force = find_crib_forces(scene, load_settled(start.restart))
            content["window"]["crib"] = force.tolist()
        if start.moved is not None:
            content["window"]["moved"] = start.moved.position.tolist()
        if start.kind == "perturbed":
            content["window"]["perturbation"] = start.perturbation
        return self._write(folder, "cycles.py", content)

    @staticmethod
    def _write(folder: Path, script: str, content: dict[str, Any]) -> dict[str, str]:
        """The parameters and the static scripts; returns the digests of the scripts."""
        (folder / PARAMETERS).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
        return decks.copy_deck(folder, (script, "bed.py", "record.py"), "yade_scripts")


def _describe_load(scene: Scene) -> dict[str, Any]:
    """The load as forces [N] on the piston: a mean and a sine, or a period of samples."""
    assert scene.loading is not None
    samples = scene.loading.samples
    if samples is not None:
        force = samples.stress * scene.loaded_area
        time = samples.time - samples.time[0]
        load = {"waveform": "series", "mean_force": 0.0}
        return load | {"time": time.tolist(), "force": force.tolist()}
    staged = {} if scene.loading.stage is None else {"begins_now": True}
    return staged | {
        "waveform": "sine",
        "mean_force": scene.loading.mean * scene.loaded_area,  # type: ignore[operator]
        "amplitude": scene.loading.amplitude * scene.loaded_area,  # type: ignore[operator]
        "frequency": scene.loading.frequency,
    }


FAR = 1e6
"""Where an edge that is none lies [m]: the parameters' file takes no infinity."""
NO_WEIGHT = 1.0
"""Density of walls [kg/m^3]: nothing depends on it, and YADE wants one."""


@dataclass(frozen=True)
class YadeNumbers:
    """Neighbours, and the rim of a piston."""

    verlet_share: float = 0.1  # move of a grain before new neighbours are looked for [mean radii]
    disc_corners: int = 96  # of the polygon that stands for a disc-shaped piston
    rim_width: float = 0.2
    """How far inside a piston's rim grains still meet the rim [mean radii]: further than one moves
    in a load cycle, or than a contact is wide."""


YADE = YadeNumbers()


def find_damping_ratio(scene: Scene) -> float:
    """YADE's ``betan`` = ``betas``, the a of c = 2 a sqrt(m* S) with S the tangent stiffness.

    YADE never lets a contact pull, so one damping cannot serve both of a scene's keys:

    * ``viscous_alpha`` names the viscous force: a = sqrt(5/6) alpha, that of the other engines
      (see `adapters.bed.contact_law`).  Grains then rebound faster, e = 0.335 instead of 0.2145 for
      alpha = 0.44, since the end of the collision, where eq. 7 pulls, is missing;
    * ``restitution`` names the rebound: a is that which makes it, without a pull.
    """
    grain = scene.material.grain
    if grain.viscous_alpha is not None:
        return contact_law.DAMPING_FACTOR * grain.viscous_alpha
    return contact_law.find_rebound_damping(scene.restitution)


def gather_shared_parameters(scene: Scene, height: float) -> dict[str, Any]:
    """What both scripts need: materials, contact law, walls, box up to ``height`` [m]."""
    material = scene.material
    container = scene.container
    materials = {
        "grain": (material.grain.young, material.grain.poisson, material.grain.density),
        "wall": (material.wall.young, material.wall.poisson, NO_WEIGHT),
    }
    if container.symmetry:
        materials["mirror"] = (MIRROR_YOUNG, material.grain.poisson, NO_WEIGHT)
    names = ("young", "poisson", "density")
    radius = np.array([scene.sample.radii.greatest])
    rolling = {
        "grain": material.grain.rolling_friction or 0.0, "mirror": 0.0,
        "wall": material.wall.rolling_friction or 0.0, "radius": scene.sample.radii.mean,
        "spring": plan.find_rolling_stiffness(scene),
    }  # fmt: skip
    return ({"rolling": rolling} if plan.has_rolling(scene) else {}) | {
        "grain_count": scene.grain_count,
        "time_step": scene.time_step,
        "gravity": GRAVITY,
        "verlet_distance": YADE.verlet_share * scene.sample.radii.mean,
        "frictional": plan.has_friction(scene),
        "materials": {m: dict(zip(names, values, strict=True)) for m, values in materials.items()},
        "pairs": _list_pairs(scene),
        "box": np.column_stack(decks.bound_box(container, radius, height)).tolist(),
        "walls": list_walls(container, height),
    }


def _list_pairs(scene: Scene) -> list[dict[str, float | str]]:
    """Damping and friction of each pair of materials that can meet.

    A pair without friction has no tangential damping either: YADE takes a spring of length zero
    for one that sticks, and would brake what should slide freely.
    """
    damping = find_damping_ratio(scene)
    friction = {"grain": scene.material.grain.friction, "wall": scene.material.wall.friction}
    if scene.container.symmetry:
        friction["mirror"] = 0.0
    return [
        {
            "first": "grain",
            "second": other,
            "damping_normal": damping,
            "damping_tangential": damping if mu > 0 else 0.0,
            "friction": mu,
        }
        for other, mu in friction.items()
    ]


def list_walls(container: Container, height: float) -> list[dict[str, Any]]:
    """Planes along the axes, and a triangle for each side of a cylinder, up to ``height`` [m]."""
    sides = iter(container.side_angles())
    result: list[dict[str, Any]] = []
    for name, mirror, axis, place, sense in container.walls().planes():
        wall: dict[str, Any] = {"name": name, "material": "mirror" if mirror else "wall"}
        if name.startswith("cylinder"):
            wall["vertices"] = cover_side(container, next(sides), height).tolist()
        else:
            position = [place if a == axis else 0.0 for a in range(3)]
            wall |= {"axis": axis, "position": position, "sense": sense}
        result.append(wall)
    return result


def cover_side(container: Container, angle: float, height: float) -> FloatArray:
    """Corners [m], shape (3, 3), of a triangle that covers one side of the polygon.

    One triangle, not two: where two of a plane meet, a grain would touch both and be pushed
    twice.  What of it lies beyond the side lies outside the container, and nothing touches it.
    ``angle`` [rad] of the outward normal, ``height`` [m] up to which the side is covered.
    """
    width = 2 * container.radius * np.tan(np.pi / container.sides)
    corners = np.array([[-width, -width], [width, -width], [0.0, 2 * height + 2 * width]])
    outward = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-outward[1], outward[0]])
    plane = container.radius * outward + corners[:, :1] * along
    return np.column_stack([plane, corners[:, 1]])


def cover_piston(
    container: Container, reach: float, grain: Radii,
    edges: tuple[float, float, float, float] = WHOLE,
) -> dict[str, Any]:  # fmt: skip
    """The piston's face: ``triangles``, horizontal corners [m], shape (t, 3, 2), normal down.

    A whole piston (``reach`` infinite) is one triangle over the section and somewhat more.  A
    partial one, a disc of radius ``reach`` [m], is a plane for grains whose centres are within
    ``plane_reach`` [m] of the axis, and triangles for those further out; a block between ``edges``
    [m] is a plane within ``plane_edges`` [m].  ``grain``: radii.
    """
    margin = decks.PISTON_MARGIN * grain.greatest
    if edges != WHOLE:
        corners = np.array(decks.cover_rectangle(container, edges, margin))
        rim = YADE.rim_width * grain.mean * np.array([1, -1, 1, -1])
        inside = np.clip(np.array(edges) + rim, -FAR, FAR)
        triangles = cover_rim(corners[::-1], corners.mean(axis=0))
        return {"triangles": triangles.tolist(), "plane_edges": inside.tolist()}
    if np.isinf(reach):
        low, high = decks.bound_section(container)
        corner = np.array(low) - margin
        across = 2 * (np.array(high) + margin - corner)
        face = [corner, corner + np.array([0.0, across[1]]), corner + np.array([across[0], 0.0])]
        return {"triangles": np.array([face]).tolist()}
    angle = -np.linspace(0.0, 2 * np.pi, YADE.disc_corners + 1)[:-1]
    circle = reach * np.column_stack([np.cos(angle), np.sin(angle)])
    floor = [-margin if axis in container.symmetry else -np.inf for axis in "xy"]
    return {
        "triangles": cover_rim(decks.clip_convex(circle, floor)).tolist(),
        "plane_reach": max(reach - YADE.rim_width * grain.mean, 0.0),
    }


def cover_rim(corners: FloatArray, apex: FloatArray | float = 0.0) -> FloatArray:
    """Triangles (n, 3, 2) from the ``apex`` to the sides of a convex polygon (n, 2) around it.

    YADE pushes a grain on a seam of two triangles from both.  These seams go straight to the
    corners, so that near the rim, where alone grains meet them, there is as little as can be.
    """
    after = np.roll(corners, -1, axis=0)
    return np.stack([np.zeros_like(corners) + apex, corners, after], axis=1)


ENGINE = YadeEngine()
