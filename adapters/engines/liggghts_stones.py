"""Stones in LIGGGHTS: bodies of ``fix multisphere``, put in as templates, moved in restart files.

What reads dumps into a running LIGGGHTS is undone at its first step there, so a jump changes the
bodies, and the piston's mesh, in the restart file itself: every contact keeps its spring.
"""

from itertools import count
from math import isqrt
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, find_sample_mass
from adapters.engines.contract import EngineStart
from adapters.engines.decks import GRAIN, Parameters, bound_section
from adapters.files import restart as kept
from adapters.scene import Scene

SIZES_MOST = 10
"""Sizes of stones in a bed at most [-]: LIGGGHTS has a template of each, and radii that a scene
spreads continuously are gathered into so many, each the mean volume of a tenth of the stones."""
SEED_LEAST = 10_007
"""LIGGGHTS takes primes above 10,000 as seeds."""
MESH, MOTION = "piston_0", "motion"
"""Names of the piston's mesh and of the fix that holds the stones."""
WORDS = {
    b"fix motion grains nve/sphere": b"include motion_stones.in",
    b"fix motion all nve/sphere": b"include motion_stones.in",
    b"fix ${piston_mesh} grains ": b"fix ${piston_mesh} all ",
    b"${gravity}*c_height": b"${gravity}*c_height/${spheres}",
    b"equal c_coordination": b"equal c_coordination*${spheres}",
}
"""Words of ``in.prepare``, ``in.cycles`` and ``piston.in`` for spheres, and for stones of them."""


def format_rain(scene: Scene, radius: FloatArray, height: float) -> str:
    """``stones.in``: a template of each size, and all stones at random below ``height`` [m]."""
    density, form = scene.material.grain.density, scene.form
    low, high = bound_section(scene.container)
    block = " ".join(f"{a:.17g} {b:.17g}" for a, b in zip(low, high, strict=True))
    lines = ["# stones.in : generated", f"region room block {block} 0 {height:.17g} units box"]
    if scene.container.shape == "cylinder":
        round_ = f"cylinder z 0 0 {scene.container.radius:.17g} 0 {height:.17g} units box"
        lines = [one.replace("room", "corner") for one in lines]
        lines += [f"region round {round_}", "region room intersect 2 corner round"]
    numbers = count(SEED_LEAST + 100 * (scene.sample.seed % 1_000_000))
    seeds = (n for n in numbers if all(n % k for k in range(2, isqrt(n) + 1)))
    weights = list[str]()
    parts = np.array_split(np.sort(radius), min(SIZES_MOST, len(np.unique(radius))))
    for number, part in enumerate(parts, 1):
        size = float(np.cbrt((part**3).mean()))
        mass = float(find_sample_mass(np.array([size]), density)[0])
        xx, yy, zz = mass * size**2 * form.inertia
        spheres = size * np.column_stack([form.place, form.radius])
        lines.append(
            f"fix stone_{number} all particletemplate/multisphere {next(seeds)} atom_type {GRAIN} "
            f"density constant {density:.17g} nspheres {len(spheres)} ntry 1000 spheres "
            + " ".join(f"{x:.17g}" for x in spheres.ravel())
            + f" type {number} mass {mass:.17g} inertia_tensor {xx:.17g} 0 0 {yy:.17g} 0 {zz:.17g} "
            "use_density"
        )
        weights.append(f"stone_{number} {len(part) / len(radius):.17g}")
    lines += [
        f"fix stones all particledistribution/discrete/numberbased {next(seeds)} {len(weights)} "
        + " ".join(weights),
        f"fix rain grains insert/pack seed {next(seeds)} distributiontemplate stones insert_every "
        "once overlapcheck yes orientation random all_in yes particles_in_region "
        f"{len(radius)} region room",
    ]
    return "\n".join(lines) + "\n"


def write_start(start: EngineStart, folder: Path) -> Parameters:
    """``stones.in`` without any; ``start.restart`` with what a jump or a perturbation moved."""
    own: Parameters = {"piston_mesh": MESH}
    (folder / "stones.in").write_text("# stones.in : all stones are in the restart file\n")
    moved = start.moved
    if moved is None and not start.perturbation:
        return own
    content = bytearray((folder / "start.restart").read_bytes())
    stones = kept.find_stones(content, MOTION)
    if moved is None:
        stones[stones[:, kept.STONE_ID] == 1, kept.CENTRE.start] += start.perturbation
    else:
        place = stones[np.argsort(stones[:, kept.STONE_ID]), kept.CENTRE]
        shift = moved.position - place
        kept.move_stones(content, MOTION, moved.identifier, shift, moved.orientation)
        corners, *references = kept.find_mesh(content, MESH, "mesh/surface/stress")
        drop = start.piston_height - corners.mean()
        for height in (corners, *references):
            height += drop
    own["start_part"] = f"start_{'continue' if moved is None else 'moved_stones'}.in"
    (folder / "start.restart").write_bytes(content)
    return own
