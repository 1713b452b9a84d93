"""Whatever is damaged in a file, what reads it ends with a documented exit code and a sentence.

Five thousand files, each with one damage: bytes, lines and numbers of texts, arrays of archives.
"""

from __future__ import annotations

import resource
import shutil
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import skfem

from adapters.bed import State, save_state
from adapters.files.states import write_state_file
from adapters.scene import load_scene as settlement_scene
from qdem_fem.grains import make_grains, save_grains
from qdem_fem.grains.sets import load_grains
from qdem_fem.mesh import read_mesh
from qdem_fem.scene import load_scene as qdem_scene
from qdem_fem.scene import make_simulation
from qdem_fem.track.bed import Bed, read_bed, write_bed
from rigid_lcp.friction.files.formats import read_problem
from rigid_lcp.scene.file import build_scene
from rigid_lcp.scene.file import load_scene as rigid_scene
from tests.small_bed import small_bed
from tests.verification.test_qdem_track import RECIPE
from track_line.scene import load_scene as line_scene
from trackbed.command import main
from trackbed.errors import EXIT_CODES, TrackbedError
from trackbed.scenes import read_template

DAMAGES = {True: 50, False: 300}  # of a reader, slow (what computes or draws) or not
MOST_SECONDS, MOST_BYTES = 10.0, 1e9
WORDS = [
    "nan", "inf", "-1", "0", "1e308", "1e-300", "999999999999", "true", "'x'", "[]", "{}", "../..",
    "/dev/zero", "\u00e9", ",", "=", "[", "\x00", "0.3", "1e400", "-inf", "-0.0", "5e-324", "1e17",
    "1e-17", '""', '"\\u0000"', '"x-max"', "9" * 400, "[1, 'a', [2]]", "{ a = 1 }", "[{ a = 1 }]",
    "1979-05-27", "[0, 0, 1]", "[1e-17, 1, 1]", '{ ramp = 1, value = "p" }', '{ csv = "/" }',
    "{ times = [1, 0], values = [0, [1, 2, 3]] }", "{ box = { size = [2, 1, 0], cells = [1] } }",
]  # fmt: skip
RIGID = """dimensions = 2
[run]
duration = 0.004
step = 1e-3
frames = 2
[[ground]]
normal = [0, 1]
[[grains]]
count = 3
size = [0.02, 0.03]
density = 2700.0
region_low = [0, 0]
region_high = [0.1, 0.1]
[[body]]
name = "box"
vertices = [[-0.1, 0], [0.1, 0], [0, 0.1]]
density = 2700.0
position = [0, 0.3]
[[load]]
body = "box"
force = [0, -9.0]
"""
QDEM = """[[body]]
name = "beam"
mesh = { file = "beam.msh" }
material = { young = 1e9, poisson = 0.2, density = 2000.0 }
[simulation]
method = "dynamic"
duration = 1e-4
[[fix]]
body = "beam"
nodes = { nearest = [0, 0, 0] }
[[load]]
body = "beam"
nodes = { nearest = [1, 0, 0] }
force = { csv = "load.csv", time = "t [ms]", value = "F [kN]", direction = [0, 0, -1] }
[output]
sampling = 1e-5
[output.probes]
tip = { nearest = [1, 0, 0] }
"""


def damage_text(content: bytes, rng: np.random.Generator) -> bytes:
    """One byte, number, word or line changed, or the end cut off."""
    way, at = rng.integers(5), int(rng.integers(len(content)))
    if way == 0:
        return content[:at] + bytes([rng.integers(256)]) + content[at + 1 :]
    if way == 1:
        return content[:at]
    lines = content.split(b"\n")
    k = int(rng.integers(len(lines)))
    if way == 2:
        return b"\n".join(lines[:k] + [lines[k]] * int(rng.choice([0, 2])) + lines[k + 1 :])
    words = lines[k].replace(b",", b" , ").split(b" ")
    words[int(rng.integers(len(words)))] = str(rng.choice(WORDS)).encode()
    return b"\n".join([*lines[:k], b" ".join(words).replace(b" , ", b","), *lines[k + 1 :]])


def damage_arrays(path: Path, rng: np.random.Generator) -> None:
    """One array of an archive gone, or of other values, another shape or another kind."""
    with np.load(path) as file:
        arrays = dict(file)
    name = str(rng.choice(list(arrays)))
    one, way = arrays.pop(name), rng.integers(5)
    if way == 0:
        arrays[name] = one.astype(str)
    elif way == 1:
        arrays[name] = one.ravel()[: one.size // 2]
    elif way == 2:
        arrays[name] = one[None]
    elif way == 3 and one.size and one.dtype.kind in "iuf":
        wild = one.astype(float).ravel()
        wild[rng.integers(one.size)] = rng.choice([np.nan, np.inf, -1, 1e300, 2.0**40])
        with np.errstate(invalid="ignore"):
            arrays[name] = wild.reshape(one.shape).astype(one.dtype)
    np.savez(path, **arrays)


def write_inputs(folder: Path) -> None:
    """A sound file of every kind, and a run of each story."""
    mesh = skfem.MeshTet.init_tensor(np.linspace(0, 1, 4), [0, 0.2], [0, 0.2])
    (folder / "rigid.toml").write_text(RIGID)
    (folder / "qdem.toml").write_text(QDEM)
    (folder / "bed.toml").write_text(small_bed(2, 3, 14))
    for name in ("karrech", "pile", "line", "cantilever", "cantilever-vibration"):
        text = read_template(name).replace("cells = [48, 6, 6]", "cells = [4, 1, 1]")
        (folder / f"{name}.toml").write_text(text)
    (folder / "load.csv").write_text("t [ms];F [kN]\n0;0\n0,05;1,5\n0,1;0\n")
    solid = meshio.Mesh(mesh.p.T, [("tetra", mesh.t.T)])
    for name, kind in (("beam.msh", "gmsh22"), ("four.msh", "gmsh"), ("beam.vtu", "vtu")):
        solid.write(folder / name, file_format=kind, binary=False)
    skin = meshio.Mesh(mesh.p.T, [("triangle", mesh.facets.T[mesh.boundary_facets()])])
    for name in ("skin.stl", "skin.obj"):
        skin.write(folder / name)
    rng, places = np.random.default_rng(1), np.stack(np.meshgrid([1, 3], [1, 3], [1, 3]), -1)
    place = 4e-3 + 2e-3 * places.reshape(8, 3)
    radius, zero = np.full(8, 2e-3), np.zeros((8, 3))
    state = State(np.arange(1, 9), place, radius, 2710 * 4 / 3 * np.pi * radius**3, zero, zero)
    save_state(state, folder / "state.npz")
    write_state_file(state, folder / "state.dump")
    if find_spec("h5py"):
        write_state_file(state, folder / "state.vtkhdf")
    frame = (folder / "state.dump").read_text()
    frames = [frame.replace("TIMESTEP\n0", f"TIMESTEP\n{k}") for k in range(5)]
    (folder / "frames.dump").write_text("".join(frames))
    cycles = [1, 2, 5, 10, 20, 50, 100]
    rows = "".join(f"{n};{1.1 + 0.4 * np.log(n):.3f}\n".replace(".", ",") for n in cycles)
    (folder / "series.csv").write_text(f"Prüfung 7\ncycle;Settlement [mm]\n{rows}")
    moved, springs = np.zeros((9, 3)), {"contact_slid": np.zeros(3)}
    nodes = [np.zeros((4, 3)), np.ones((5, 3))]
    write_bed(folder / "track.npz", RECIPE, Bed("rest", nodes, moved, springs, {}))
    save_grains(folder / "grains.npz", make_grains(2, seed=1))
    np.savez(folder / "problem.npz", W=np.eye(4), q=rng.normal(size=4), mu=np.full(2, 0.5))
    (folder / "problem.dat").write_text("2\n1\n0\n2\n2\n2\t2\n1 0 0 1\n-1 .5\n.3\n")
    for verb, scene in (("run", "bed"), ("qdem", "qdem"), ("rigid", "rigid")):
        words = [verb, f"{folder}/{scene}.toml", "--run-folder", f"{folder}/{scene}-run"]
        assert main(words + ["--no-pictures"] * (verb != "run")) == 0


def run_words(*words: str) -> Callable[[Path], int]:
    """A command that has the damaged file or folder for its ``@``."""
    return lambda path: main(
        [word.replace("@/..", str(path.parent)).replace("@", str(path)) for word in words]
    )


def read_by(reader: Callable[..., Any]) -> Callable[[Path], int]:
    def read(path: Path) -> int:
        try:
            reader(path)
        except TrackbedError as error:
            return error.exit_code if "->" in str(error) else 1
        return 0

    return read


def read_settlement(path: Path) -> None:
    """A scene, and what follows from it where it is sound."""
    scene = settlement_scene(path)
    assert 0 < scene.time_step < np.inf
    assert scene.grain_count >= 1
    assert 0.05 < scene.restitution <= 1
    assert scene.loaded_area <= scene.container.area


def read_qdem(path: Path) -> None:
    make_simulation(qdem_scene(path))


READERS: dict[str, tuple[str, Callable[[Path], int]]] = {
    "rigid scene": ("rigid.toml", run_words("rigid", "@", "--dry-run")),
    "qdem scene": ("qdem.toml", run_words("qdem", "@", "--dry-run")),
    "pile": ("pile.toml", read_by(lambda path: build_scene(rigid_scene(path)))),
    "line": ("line.toml", read_by(line_scene)),
    "karrech": ("karrech.toml", read_by(read_settlement)),
    "cantilever": ("cantilever.toml", read_by(read_qdem)),
    "vibration": ("cantilever-vibration.toml", read_by(read_qdem)),
    "load": ("load.csv", run_words("qdem", "@/../qdem.toml", "--dry-run")),
    "settlement scene": ("bed.toml", run_words("run", "@", "--dry-run", "--run-folder", "@-dry")),
    "table": ("series.csv", run_words("fit", "@", "--law", "auto", "--to-cycle", "300")),
    "dump": ("state.dump", run_words("relax", "@", "--scene", "@/../bed.toml", "--out", "@.npz")),
    "dumps": ("frames.dump", run_words("fit", "@", "--to-cycle", "9")),
    "state": ("state.npz", run_words("relax", "@", "--scene", "@/../bed.toml", "--out", "@.dump")),
    "exchange": ("state.vtkhdf", run_words(
        "relax", "@", "--scene", "@/../bed.toml", "--out", "@/../out.vtkhdf")),
    "grains": ("grains.npz", read_by(load_grains)),
    "track bed": ("track.npz", read_by(lambda path: read_bed(path, RECIPE))),
    **{name: (name, read_by(read_mesh)) for name in
       ("beam.msh", "four.msh", "beam.vtu", "skin.stl", "skin.obj")},
    **{name: (name, read_by(read_problem)) for name in ("problem.npz", "problem.dat")},
    "settlement report": ("bed-run", run_words("report", "@")),
    "qdem status": ("qdem-run", run_words("status", "@")),
    "rigid report": ("rigid-run", run_words("report", "@")),
    "qdem report": ("qdem-run", run_words("report", "@")),
    "settlement status": ("bed-run", run_words("status", "@")),
    "settlement resume": ("bed-run", run_words("resume", "@")),
    "qdem resume": ("qdem-run", run_words(
        "qdem", "@/../qdem.toml", "--run-folder", "@", "--resume", "--no-pictures")),
    "rigid resume": ("rigid-run", run_words(
        "rigid", "@/../rigid.toml", "--run-folder", "@", "--resume", "--no-pictures")),
}  # fmt: skip


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    write_inputs(folder)
    return folder


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.peer("h5py")] * (n == "exchange")) for n in READERS],
)
def test_a_damaged_file_ends_with_a_sentence(inputs, tmp_path, capsys, name):
    """No exit code 1, no gigabyte more than before, no more than ten seconds of the processor."""
    source, read = READERS[name]
    rng = np.random.default_rng(list(READERS).index(name))
    others = {run for run, _ in READERS.values() if run.endswith("-run")} - {source}
    for trial in range(DAMAGES[name.endswith((" report", " resume"))]):
        folder = tmp_path / str(trial)
        shutil.copytree(inputs, folder, ignore=lambda *_: others)
        damaged = path = folder / source
        if path.is_dir():
            damaged = rng.choice(sorted(p for p in path.rglob("*") if p.is_file()))
        content = damaged.read_bytes()
        if damaged.suffix == ".npz" and trial % 2:
            damage_arrays(damaged, rng)
        else:
            damaged.write_bytes(damage_text(content or b"0", rng))
        begin, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        try:
            code = read(path)
        except SystemExit as ending:
            code = int(ending.code or 0)
        more = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
        said = capsys.readouterr().err
        what = f"{name}, trial {trial}, {damaged.name}: {code} {said}"
        assert code in EXIT_CODES, what
        assert code != 1, what
        assert not (code and source.endswith("-run")) or "trackbed: " in said, what
        assert time.process_time() - begin < MOST_SECONDS, what
        assert more < MOST_BYTES, what
        shutil.rmtree(folder)
