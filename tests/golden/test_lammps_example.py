"""``lammps_inputs/example`` is what the code writes for a bed of forty grains, byte for byte.

Run this file as a script to write the example again.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed.radii import sample_radii
from adapters.bed.sample import draw_sample_start
from adapters.engines import lammps_decks
from adapters.engines.contract import EngineStart
from adapters.engines.lammps import LammpsEngine
from adapters.scene.file import load_scene
from trackbed.scenes import scene_path

EXAMPLE = Path(str(files("lammps_inputs"))) / "example"
BED = (
    'engine.name="lammps"',
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=1e9",
    "loading.piston_mass=0.001",
)
"""What differs from the scene karrech-coarse: the engine; fewer, softer grains; the piston."""
CYCLES = 3
PISTON_HEIGHT = 0.048
"""Above the highest grain of the settled bed [m]."""


def example_write(folder: Path) -> None:
    """The generated files of the rain and of the first window, in one folder."""
    scene, engine = load_scene(scene_path("karrech-coarse"), BED), LammpsEngine()
    radius = sample_radii(scene.sample.grain_radius.law, scene.grain_count, scene.sample.seed)
    position, height = draw_sample_start(
        radius, scene.container, scene.sample.relative_density_start, scene.sample.seed
    )
    with TemporaryDirectory() as name:
        rain, window = Path(name) / "rain", Path(name) / "window"
        rain.mkdir()
        window.mkdir()
        engine.write_preparation(scene, position, radius, height, rain)
        (rain / "end.restart").touch()
        start = EngineStart(rain / "end.restart", 0, 0, PISTON_HEIGHT, first=True)
        engine.write_cycles(scene, start, CYCLES, window)
        for one, file in (
            (rain, "grains.data"),
            (rain, "scene.in"),
            (window, "piston_wall.in"),
        ):
            (folder / file).write_bytes((one / file).read_bytes())
        lines = dict.fromkeys(
            line
            for one in (rain, window)
            for line in (one / "parameters.in").read_text().splitlines()
        )
    (folder / "parameters.in").write_text("\n".join(lines) + "\n")
    # The rain has no piston yet, so its columns serve both.
    names = lammps_decks.wall_names(scene.container, piston=False)
    (folder / "dump_states.in").write_text(lammps_decks.format_dump_states(names))


def test_example_is_what_the_code_writes(tmp_path: Path) -> None:
    """Generated again, each file of the example is the one that ships."""
    example_write(tmp_path)
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    shipped = {path.name: path.read_bytes() for path in EXAMPLE.iterdir()}
    assert written.keys() == shipped.keys()
    for name in written:
        if name == "grains.data":
            # Positions pass through functions whose last digit is the platform's.
            new, old = (
                np.loadtxt(text.decode().partition("Atoms")[2].split("\n"))
                for text in (written[name], shipped[name])
            )
            np.testing.assert_allclose(new, old, rtol=1e-14)
        else:
            assert written[name] == shipped[name], name


if __name__ == "__main__":
    example_write(EXAMPLE)
