"""``liggghts_inputs/example`` and ``lammps_inputs/example`` are what the code writes for a bed of
forty grains, byte for byte.

Run this file as a script to write the examples again.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from adapters.bed.radii import draw_radii
from adapters.bed.sample import draw_sample_start
from adapters.engines.contract import EngineStart, get_engine
from adapters.scene.file import load_scene
from trackbed.scenes import find_scene_file

ENGINES = {"liggghts": "piston.stl", "lammps": "piston_wall.in"}
"""Engine, and the file of its piston."""
BED = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=1e9",
    "loading.piston_mass=0.001",
)
"""What differs from the scene karrech-coarse: fewer, softer grains, a lighter piston."""
CYCLES = 3
PISTON_HEIGHT = 0.048  # above the highest grain of the settled bed, 47.5 mm [m]


def example(name: str) -> Path:
    """Where the example of an engine is."""
    return Path(str(files(f"{name}_inputs"))) / "example"


def example_write(name: str, folder: Path) -> None:
    """The generated files of the rain and of the first window, in one folder."""
    scene = load_scene(find_scene_file("karrech-coarse"), (f'engine.name="{name}"', *BED))
    engine = get_engine(name)
    radius = draw_radii(scene.sample.radii, scene.grain_count, scene.sample.seed)
    position, height = draw_sample_start(
        radius, scene.container, scene.sample.relative_density_start, scene.sample.seed
    )
    with TemporaryDirectory() as home:
        rain, window = Path(home) / "rain", Path(home) / "window"
        rain.mkdir()
        window.mkdir()
        engine.write_preparation(scene, position, radius, height, rain)
        (rain / "end.restart").touch()
        start = EngineStart(rain / "end.restart", 0, 0, PISTON_HEIGHT, first=True)
        engine.write_cycles(scene, start, CYCLES, window)
        # The rain has no piston yet, so its columns serve both.
        for file in ("grains.data", "scene.in", "dump_states.in"):
            (folder / file).write_bytes((rain / file).read_bytes())
        (folder / ENGINES[name]).write_bytes((window / ENGINES[name]).read_bytes())
        texts = [(one / "parameters.in").read_text() for one in (rain, window)]
    lines = dict.fromkeys(line for text in texts for line in text.splitlines())
    (folder / "parameters.in").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("name", ENGINES)
def test_example_is_what_the_code_writes(name: str, tmp_path: Path) -> None:
    """Generated again, each file of the example is the one that ships; the table of parameters
    serves both decks, as no variable has two values."""
    example_write(name, tmp_path)
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    shipped = {path.name: path.read_bytes() for path in example(name).iterdir()}
    # Positions pass through functions whose last digit is the platform's.
    new, old = (
        np.loadtxt(texts.pop("grains.data").decode().partition("Atoms")[2].split("\n"))
        for texts in (written, shipped)
    )
    np.testing.assert_allclose(new, old, rtol=1e-14)
    assert written == shipped
    variables = [line.split()[1] for line in shipped["parameters.in"].decode().splitlines()[1:]]
    assert len(variables) == len(set(variables))


if __name__ == "__main__":
    for engine in ENGINES:
        example_write(engine, example(engine))
