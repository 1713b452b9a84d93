"""`trackbed export`: each file is opened by the Python reader of the tool it is for."""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

from adapters.bed.state import Contacts, State
from adapters.errors import EngineFailed
from adapters.files import read_series
from adapters.files.states import read_state_file
from adapters.files.window import PistonTrack, Window
from adapters.procedure.progress import Progress
from adapters.procedure.record import read_run_record
from adapters.procedure.run import run_scene
from adapters.report.export.formats import FORMATS, export_run
from adapters.report.export.instants import ExportedRun, read_exported_run
from adapters.scene.file import load_scene
from tests import engine_sample
from trackbed import command
from trackbed.scenes import read_template

CYCLES = [0, 1, 2, 3, 4, 5, 7, 8, 9, 10, 11]
"""Instants of the fixture's run, which jumps from 5 to 7."""
TO = [pytest.param(to, marks=[pytest.mark.peer("h5py")] * (to == "vtkhdf")) for to in FORMATS]
TINY = ('engine.name="fake"', *engine_sample.TINY)


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(read_template("karrech-coarse"))
    return path


@pytest.fixture(scope="module")
def run(scene_file: Path) -> Path:
    """A finished run of forty grains on the engine without mechanics."""
    folder = scene_file.parent / "run"
    run_scene(scene_file, folder, overrides=TINY, progress=Progress(quiet=True))
    return folder


def table(run: Path) -> dict[int, dict[str, float]]:
    """Rows of ``settlement.csv`` by cycle."""
    lines = (run / "settlement.csv").read_text().splitlines()
    names = lines[0].split(",")
    rows = [dict(zip(names, line.split(","), strict=True)) for line in lines[1:]]
    wanted = ("mean_grain_settlement", "coordination_number", "piston_height")
    return {int(row["cycle"]): {name: float(row[name]) for name in wanted} for row in rows}


class Bed:
    """Two pairs of grains over one cycle in place of a run: what a `Track` is asked for."""

    DISTANCE = 1.9e-3
    FORCE = 0.25  # how hard a pair pushes [N]

    def __init__(self, friction: float, contacts: bool = True) -> None:
        x = self.DISTANCE * np.array([[0, 0, 1], [1, 0, 1], [0, 3, 1], [0, 3, 2]], float)
        push = np.array([[-self.FORCE, 0, 0], [0, 0, -self.FORCE]])
        drag = np.array([[0, 0.1, 0], [0.03, 0.04, 0]]) * (friction > 0)
        number, radius = np.array([3, 5, 6, 9]), np.full(4, 1e-3)
        pair, count = np.array([[3, 5], [6, 9]]), 2 if contacts else 0
        self.contacts = Contacts(
            pair[:count], np.full(count, 1e-4), push[:count], drag[:count], drag[:count]
        )
        still = np.zeros((4, 3))
        start = State(number, x, radius, 1e-5 + still[:, 0], still, still, self.contacts)
        moved = np.array([x, x - [0, 0, 1e-5]])
        self.window_made = Window(
            0, np.array([0, 50]), number, radius, start.mass, moved, moved, moved, {},
            (self.contacts, self.contacts), PistonTrack(np.array([25, 50]), *np.ones((5, 2))), 2.0,
        )  # fmt: skip
        self.start = lambda: start
        self.windows = [("window_000000", SimpleNamespace(first_cycle=0, last_cycle=1))]

    def window(self, name: str) -> Window:
        return self.window_made


def bed(scene_file: Path, friction: float, contacts: bool = True) -> ExportedRun:
    scene = load_scene(scene_file, (*TINY, f"material.grain.friction={friction}"))
    return ExportedRun(scene, Bed(friction, contacts))  # type: ignore[arg-type]


# --- VTU ------------------------------------------------------------------------------------


@pytest.mark.peer("pyvista")
def test_paraview_series(run: Path, tmp_path: Path) -> None:
    """VTK's reader: an instant a cycle, only the fields asked for, means those of the table."""
    import pyvista

    export_run(read_exported_run(run), "vtu", tmp_path)
    series = pyvista.get_reader(str(tmp_path / "grains.pvd"))
    assert series.time_values == CYCLES
    start = None
    for cycle in CYCLES:
        series.set_active_time_value(cycle)
        grains = series.read()[0]
        assert grains.array_names == ["id", "radius", "displacement", "velocity", "coordination"]
        assert grains.n_points == grains.n_cells == 40
        start = grains.points if start is None else start
        np.testing.assert_allclose(grains["displacement"], grains.points - start, atol=1e-16)
        if cycle:
            row = table(run)[cycle]
            assert grains["coordination"].mean() == row["coordination_number"]
            settled = -grains["displacement"][:, 2].mean()
            assert settled == pytest.approx(row["mean_grain_settlement"], rel=1e-9)


def test_meshio_reads_the_same(run: Path, tmp_path: Path) -> None:
    """meshio's reader gives back every digit."""
    every = {instant.cycle: instant for instant in read_exported_run(run).instants()}
    export_run(read_exported_run(run), "vtu", tmp_path)
    for cycle in CYCLES:
        mesh = meshio.read(tmp_path / "vtu" / f"grains_{cycle:06d}.vtu")
        assert np.array_equal(mesh.points, every[cycle].state.position)
        assert np.array_equal(mesh.point_data["radius"], every[cycle].state.radius)
        assert np.array_equal(mesh.point_data["displacement"], every[cycle].displacement)


@pytest.mark.parametrize("friction", [0.5, 0.0])
@pytest.mark.peer("pyvista")
def test_contacts_are_lines(scene_file: Path, tmp_path: Path, friction: float) -> None:
    """Lines join the centres; pushing is positive; without friction there is no such field."""
    import pyvista

    export_run(bed(scene_file, friction), "vtu", tmp_path)
    lines = pyvista.read(tmp_path / "vtu" / "contacts_000001.vtu")
    assert lines.n_cells == 2
    sizes = lines.compute_cell_sizes()["Length"]
    assert sizes == pytest.approx([Bed.DISTANCE, Bed.DISTANCE], rel=1e-12)
    assert lines["normal_force"] == pytest.approx([Bed.FORCE, Bed.FORCE], rel=1e-12)
    names = ["normal_force", "tangential_force"] if friction else ["normal_force"]
    assert list(lines.cell_data.keys()) == names
    assert meshio.read(tmp_path / "vtu" / "contacts_000001.vtu").cells_dict["line"].tolist() == [
        [0, 1], [2, 3],
    ]  # fmt: skip


@pytest.mark.peer("pyvista")
def test_bed_without_contacts(scene_file: Path, tmp_path: Path) -> None:
    """A gas of grains has a file of contacts without lines, which VTK reads."""
    import pyvista

    export_run(bed(scene_file, 0.5, contacts=False), "vtu", tmp_path)
    assert pyvista.read(tmp_path / "vtu" / "contacts_000001.vtu").n_cells == 0
    for to in ("ovito", "csv"):
        export_run(bed(scene_file, 0.5, contacts=False), to, tmp_path)
    assert (tmp_path / "contacts.csv").read_text().splitlines() == [
        "cycle,id1,id2,normal_force,tangential_force_x,tangential_force_y,tangential_force_z"
    ]


# --- OVITO and CSV --------------------------------------------------------------------------


@pytest.mark.peer("ovito")
def test_ovito(run: Path, tmp_path: Path) -> None:
    """OVITO's reader knows every column, and takes the cycle for the time step."""
    from ovito.io import import_file

    export_run(read_exported_run(run), "ovito", tmp_path)
    pipeline = import_file(str(tmp_path / "grains.dump"))
    assert pipeline.source.num_frames == len(CYCLES)
    for frame, cycle in enumerate(CYCLES):
        data = pipeline.compute(frame)
        assert data.attributes["Timestep"] == cycle
        names = set(data.particles.keys()) - {"Velocity Magnitude", "Displacement Magnitude"}
        assert names == {
            "Particle Identifier", "Position", "Radius", "Displacement", "Velocity", "Coordination",
        }  # fmt: skip
    assert np.mean(data.particles["Coordination"]) == table(run)[11]["coordination_number"]


@pytest.mark.peer("ovito")
def test_ovito_bonds(scene_file: Path, tmp_path: Path) -> None:
    """Contacts are bonds between the right grains, with the magnitudes of their forces."""
    from ovito.io import import_file
    from ovito.modifiers import LoadTrajectoryModifier

    export_run(bed(scene_file, 0.5), "ovito", tmp_path)
    pipeline = import_file(str(tmp_path / "grains.dump"))
    contacts = LoadTrajectoryModifier()
    columns = ["Particle Identifiers.1", "Particle Identifiers.2", "normal", "tangential"]
    contacts.source.load(str(tmp_path / "contacts.dump"), columns=columns)
    pipeline.modifiers.append(contacts)
    assert " vx vy vz" in (tmp_path / "grains.dump").read_text().splitlines()[8]
    data = pipeline.compute(1)
    assert np.array_equal(data.particles["Velocity"], data.particles.positions)  # as made
    bonds = data.particles.bonds
    assert bonds.topology[...].tolist() == [[0, 1], [2, 3]]
    assert bonds["normal"][...] == pytest.approx([Bed.FORCE, Bed.FORCE])
    assert bonds["tangential"][...] == pytest.approx([0.1, 0.05])


def test_csv_reads_back(run: Path, tmp_path: Path) -> None:
    """Every number comes back bit for bit; the piston's samples are all there."""
    exported = read_exported_run(run)
    export_run(exported, "csv", tmp_path)
    grains = np.genfromtxt(tmp_path / "grains.csv", delimiter=",", names=True)
    instants = list(exported.instants())
    assert np.array_equal(np.unique(grains["cycle"]), CYCLES)
    for name, axis in (("x", 0), ("z", 2)):
        expected = np.concatenate([instant.state.position[:, axis] for instant in instants])
        assert np.array_equal(grains[name], expected)
    moved = np.concatenate([instant.displacement[:, 2] for instant in instants])
    assert np.array_equal(grains["displacement_z"], moved)
    piston = np.genfromtxt(tmp_path / "piston.csv", delimiter=",", names=True)
    assert piston.dtype.names == ("cycle", "target_force", "contact_force", "height")
    ends = np.isin(piston["cycle"], CYCLES)
    computed = [cycle for cycle in CYCLES[1:] if cycle != 7]
    assert np.array_equal(piston["cycle"][ends], computed)
    heights = [table(run)[cycle]["piston_height"] for cycle in computed]
    assert np.array_equal(piston["height"][ends], heights)


# --- VTKHDF ---------------------------------------------------------------------------------


@pytest.mark.peer("h5py")
@pytest.mark.peer("pyvista")
def test_vtk_and_we_read_states(run: Path, tmp_path: Path) -> None:
    """VTK shows the bodies; the series of files has the settlement of the run, jump and all."""
    import pyvista

    exported = read_exported_run(run)
    files = export_run(exported, "vtkhdf", tmp_path)
    for path, instant in zip(files, exported.instants(), strict=True):
        mesh, state = pyvista.read(path)["grains"], instant.state
        assert mesh.n_cells == mesh.n_points == 40
        assert np.array_equal(mesh.points, state.position)
        assert np.array_equal(mesh["radius"], state.radius)
        assert read_state_file(path, 1.0).time_step == instant.cycle
    series, rows = read_series(files, steps_per_cycle=1), table(run)
    assert series.cycle.tolist() == CYCLES
    settled = [rows[cycle]["mean_grain_settlement"] for cycle in CYCLES[1:]]
    assert series.settlement[1:] == pytest.approx(settled, rel=1e-9)


@pytest.mark.peer("h5py")
def test_contacts_in_vtkhdf(scene_file: Path, tmp_path: Path) -> None:
    """As YADE has them: negative where grains push apart, normal and shear force on the second."""
    import h5py

    exported = bed(scene_file, 0.5)
    with h5py.File(export_run(exported, "vtkhdf", tmp_path)[1]) as file:
        contacts = file["ONDEM/Interactions/hertz_mindlin"]
        assert (contacts.attrs["count"], contacts["id2"][:].tolist()) == (2, [5, 9])
        assert contacts["normal_force"][:] == pytest.approx([-Bed.FORCE] * 2)
        assert contacts["normal"][:] == pytest.approx(np.array([[1, 0, 0], [0, 0, 1]]), abs=1e-15)
        assert np.array_equal(contacts["shear_force"], [[0, -0.1, 0], [-0.03, -0.04, 0]])
        assert file["ONDEM/Materials/0/shear_friction"][()] == 0.5
        assert file["ONDEM/Scene"].attrs["time"] == exported.scene.loading.period


@pytest.mark.peer("h5py")
def test_time_of_stages_in_vtkhdf(scene_file: Path, tmp_path: Path) -> None:
    """Of nine cycles four last as long as those of the first load, five as those of the second."""
    import h5py

    second = "loading.stage=[{from_cycle=4, amplitude=9e3, mean=4.5e3, frequency=9.0}]"
    scene, late = load_scene(scene_file, [second]), replace(Bed(0.5).start(), cycle=9)
    track = SimpleNamespace(start=lambda: late, windows=[])
    (path,) = export_run(ExportedRun(scene, track), "vtkhdf", tmp_path)  # type: ignore[arg-type]
    with h5py.File(path) as file:
        said = file["ONDEM/Scene"].attrs
        assert said["time"] == pytest.approx(4 * scene.loading.period + 5 / 9, rel=1e-12)
        assert said["timestep"] == pytest.approx(1 / (9 * scene.steps_per_cycle), rel=1e-12)


def test_without_h5py(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 4, and how to get it."""
    monkeypatch.setitem(sys.modules, "h5py", None)
    assert command.main(["export", str(run), "--to", "vtkhdf"]) == 4
    assert "-> pip install h5py" in capsys.readouterr().err


# --- the verb -------------------------------------------------------------------------------


@pytest.mark.parametrize("to", TO)
def test_verb(run: Path, tmp_path: Path, to: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Files and their size as JSON; again into the same folder gives the same bytes."""
    words = ["export", str(run), "--to", to, "--into", str(tmp_path / "out"), "--json"]
    assert command.main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    files = [Path(path) for path in answer["files"]]
    assert set(files) == {path for path in (tmp_path / "out").rglob("*") if path.is_file()}
    assert answer["bytes"] == sum(path.stat().st_size for path in files)
    before = [path.read_bytes() for path in files]
    assert command.main(words) == 0
    assert [path.read_bytes() for path in files] == before


def test_every(run: Path, tmp_path: Path) -> None:
    """Multiples of N, the first and the last; 7 is the end of a jump."""
    words = ["export", str(run), "--to", "vtu", "--into", str(tmp_path), "--every", "3"]
    assert command.main(words) == 0
    found = sorted(path.name[-7:-4] for path in (tmp_path / "vtu").glob("grains_*"))
    assert found == ["000", "003", "009", "011"]


def test_default_folder_is_no_run(scene_file: Path, tmp_path: Path) -> None:
    """What is exported beside a run is not taken for one of its variants."""
    run = tmp_path / "run"
    overrides = (*TINY, "procedure.total_cycles=4")
    run_scene(scene_file, run, overrides=overrides, progress=Progress(quiet=True), control=True)
    assert command.main(["export", str(run), "--to", "csv"]) == 0
    assert command.main(["export", str(run), "--to", "csv", "--variant", "control"]) == 0
    one, other = run / "export" / "grains.csv", run / "control" / "export" / "grains.csv"
    assert one.read_bytes() == other.read_bytes()  # nothing was jumped in four cycles
    record = read_run_record(run)
    assert record.control is not None
    assert record.run.history.cycle.tolist() == record.control.history.cycle.tolist()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "vtu", "--every", "0"], "every 0 cycles"),
        (["--to", "vtu", "--variant", "contrl"], "no run contrl"),
    ],
)
def test_refusals(run: Path, words: list[str], said: str, capsys) -> None:
    """Wrong use is exit code 2 and a sentence."""
    assert command.main(["export", str(run), *words]) == 2
    assert said in capsys.readouterr().err


def test_nothing_to_export(tmp_path: Path, run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No run folder, and a run that is not prepared yet."""
    assert command.main(["export", str(tmp_path), "--to", "vtu"]) == 2
    for name in ("manifest.json", "scene.toml"):
        (tmp_path / name).write_bytes((run / name).read_bytes())
    assert command.main(["export", str(tmp_path), "--to", "vtu"]) == 2
    assert "not prepared yet" in capsys.readouterr().err


def test_unloaded_scene_has_no_piston(scene_file: Path, run: Path, tmp_path: Path) -> None:
    """A run that is only prepared: one instant, no displacement, no piston."""
    prepared = replace(read_exported_run(run), track=SimpleNamespace(
        windows=[], start=read_exported_run(run).track.start
    ))  # fmt: skip
    for to in ("vtu", "ovito", "csv"):
        export_run(prepared, to, tmp_path)
    names = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert not {name for name in names if "piston" in name}
    assert "displacement" not in (tmp_path / "grains.csv").read_text()
    assert "displacement" not in (tmp_path / "vtu" / "grains_000000.vtu").read_text()


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """No file may become larger than ``size`` bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("to", TO)
def test_full_disk(run: Path, tmp_path: Path, to: str) -> None:
    """Exit code 5's error, no part of a file, and what was there before stays."""
    first = export_run(read_exported_run(run), to, tmp_path, every=100)
    before = {path: path.read_bytes() for path in first}
    with disk_of(512), pytest.raises(EngineFailed, match="disk is full"):
        export_run(read_exported_run(run), to, tmp_path)
    assert not list(tmp_path.rglob("*partial*"))
    assert {path: path.read_bytes() for path in first} == before
