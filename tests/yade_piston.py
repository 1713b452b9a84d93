"""Single grains under a partial piston in YADE: what its face does to a grain here or there."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed.state import FloatArray
from adapters.engines.yade import PARAMETERS, YadeEngine, cover_piston
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file
from validation.bench.few_grains_yade import START

SCRIPT = (
    START
    + """\
few = parameters["few"]
piston = bed.Piston(parameters)
rows = []
for places in few:
    for number, place in enumerate(places):
        O.bodies[number].state.pos = Vector3(*place)
    changed = piston.grains_share()
    bed.set_engines(parameters)
    bed.renew_forces()
    rows += [[*O.forces.f(number, True), changed] for number in range(count)]
np.savetxt("force.txt", rows, fmt="%.17g")
print("COMPLETE step 0", flush=True)
open("end.restart", "w").write("none")
"""
)


def scene_partial(*settings: str) -> Scene:
    """The shipped scene with a piston over a part of the bed, on YADE."""
    return load_scene(find_scene_file("karrech-partial"), ['engine.name="yade"', *settings])


def piston_forces(
    scene: Scene, places: Sequence[FloatArray], height: float
) -> tuple[FloatArray, FloatArray]:
    """Forces on grains that the piston's face at a ``height`` [m] touches.

    ``places`` [m]: an array (n, 3) for each look, all grains of the mean radius.  Gives forces [N],
    shape (looks, n, 3), and whether any grain went over to another face before a look, (looks,).
    """
    engine, count = YadeEngine(), len(places[0])
    radius = np.full(count, scene.sample.radii.mean)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        digests = engine.write_preparation(scene, places[0], radius, 2 * height, folder)
        content = json.loads((folder / PARAMETERS).read_text())
        content["grain_count"] = count
        content["piston"] = {"mass": 1.0, "height": height}
        content["piston"] |= cover_piston(scene.container, scene.piston_reach, scene.sample.radii)
        content["few"] = [each.tolist() for each in places]
        (folder / PARAMETERS).write_text(json.dumps(content))
        (folder / "few.py").write_text(SCRIPT)
        engine.run(scene, "few.py", folder, lambda: None, digests)
        table = np.loadtxt(folder / "force.txt").reshape(len(places), count, 4)
    return table[..., :3], table[:, 0, 3]
