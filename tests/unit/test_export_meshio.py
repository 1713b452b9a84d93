"""Text dumps of LIGGGHTS and LAMMPS as a format of meshio."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.errors import DumpError, UsageError
from adapters.files import Frame, meshio_dump, read_frames, write_dump

pytestmark = pytest.mark.lowest

ROOT = Path(__file__).parents[2]
COLUMNS = ["id", "type", "x", "y", "z", "vx", "vy", "vz", "radius"]
COLUMNS += ["f_floor[1]", "f_floor[2]", "f_floor[3]", "c_coord", "ix"]
"""As LIGGGHTS and LAMMPS name them; ``ix`` alone is no vector."""


def frame(step: int, count: int = 3, columns: list[str] = COLUMNS) -> Frame:
    """Random values from the step; identifiers descend, types are 1."""
    values = np.random.default_rng(step).normal(size=(count, len(columns)))
    whole = {"id": np.arange(count, 0, -1), "type": np.ones(count)}
    for name in whole.keys() & set(columns):
        values[:, columns.index(name)] = whole[name]
    bounds = np.array([[0, 1], [0, 2], [-0.5, 3]])
    return Frame(step, tuple(columns), values, bounds)


def test_last_frame_with_vectors_joined(tmp_path: Path) -> None:
    """Places are points, components are one vector, grains ascend by id."""
    path = tmp_path / "states.dump"
    write_dump(path, [frame(0), frame(500)])
    mesh = meshio.read(path)
    last = frame(500).values[::-1]
    assert np.array_equal(mesh.points, last[:, 2:5])
    assert mesh.cells_dict["vertex"].tolist() == [[0], [1], [2]]
    assert list(mesh.point_data) == ["id", "type", "v", "radius", "f_floor", "c_coord", "ix"]
    assert np.array_equal(mesh.point_data["v"], last[:, 5:8])
    assert np.array_equal(mesh.point_data["f_floor"], last[:, 9:12])
    assert mesh.point_data["id"].dtype == np.int64
    assert mesh.field_data["time_step"] == [500]
    assert np.array_equal(mesh.field_data["box"], frame(500).bounds)
    steps = [int(each.field_data["time_step"][0]) for each in meshio_dump.read_dump_meshes(path)]
    assert steps == [0, 500]


@pytest.mark.parametrize("name", ["a.dump", "a.lammpstrj", "a.liggghts", "a.dump.gz", "A.10.DUMP"])
def test_known_by_its_ending(tmp_path: Path, name: str) -> None:
    """Endings, packed or not; written by meshio and read back, bit for bit."""
    write_dump(tmp_path / "first.dump", [frame(7)])
    mesh = meshio.read(tmp_path / "first.dump")
    mesh.write(tmp_path / name)
    (written,) = read_frames(tmp_path / name)
    assert sorted(written.columns) == sorted(COLUMNS)
    again = meshio.read(tmp_path / name)
    assert np.array_equal(again.points, mesh.points)
    assert list(again.point_data) == list(mesh.point_data)
    for key, values in mesh.point_data.items():
        assert np.array_equal(again.point_data[key], values), key
    assert np.array_equal(again.field_data["box"], mesh.field_data["box"])


def test_other_names_say_the_format(tmp_path: Path) -> None:
    """``dump.500`` has no ending that tells."""
    write_dump(tmp_path / "dump.500", [frame(500)])
    mesh = meshio.read(tmp_path / "dump.500", file_format=meshio_dump.FORMAT)
    assert len(mesh.points) == 3


@pytest.mark.long
def test_importing_registers(tmp_path: Path) -> None:
    """Without the import meshio does not know the format, with it it does."""
    path = tmp_path / "states.dump"
    write_dump(path, [frame(0)])
    code = f"""
        import meshio
        try:
            meshio.read({str(path)!r})
        except meshio.ReadError as error:
            print(error)
        import adapters.files.meshio_dump
        print(len(meshio.read({str(path)!r}).points))
    """
    done = subprocess.run(
        [sys.executable, "-c", dedent(code)], cwd=ROOT, capture_output=True, text=True
    )
    assert re.fullmatch(r"Could not deduce file format.*\n3\n", done.stdout), done.stderr


def test_to_paraview(tmp_path: Path) -> None:
    """A dump becomes a VTU by meshio alone."""
    write_dump(tmp_path / "states.dump", [frame(0)])
    mesh = meshio.read(tmp_path / "states.dump")
    mesh.write(tmp_path / "states.vtu")
    again = meshio.read(tmp_path / "states.vtu")
    assert np.array_equal(again.point_data["f_floor"], mesh.point_data["f_floor"])


def test_contacts_are_no_mesh(tmp_path: Path) -> None:
    """A dump without places is refused with its columns."""
    path = tmp_path / "contacts.dump"
    write_dump(path, [Frame(3, ("c_pair[1]", "c_pair[2]"), np.ones((2, 2)), kind="entries")])
    with pytest.raises(DumpError, match=r"no places x y z, only c_pair\[1\] c_pair\[2\]"):
        meshio.read(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n", "the file ends inside the header"),
        (
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS id x y z\n1 0 nan 0\n",
            "column y of grain 1 is nan",
        ),
    ],
)
def test_malformed(tmp_path: Path, text: str, said: str) -> None:
    """meshio leaves Python on a file it can not read; a dump's fault is named by line."""
    path = tmp_path / "bad.dump"
    path.write_text(text)
    with pytest.raises(DumpError, match=said):
        meshio.read(path)


def test_plane_mesh_is_refused(tmp_path: Path) -> None:
    """Points in the plane have no z."""
    mesh = meshio.Mesh(np.zeros((2, 2)), [("vertex", np.array([[0], [1]]))])
    with pytest.raises(UsageError, match=r"\(n, 3\)"):
        mesh.write(tmp_path / "plane.dump")


def test_any_mesh_becomes_a_dump(tmp_path: Path) -> None:
    """Numbers for grains without one, and names without blanks."""
    points = np.eye(3)
    stress = np.arange(3.0)
    mesh = meshio.Mesh(points, [("triangle", [[0, 1, 2]])], {"von Mises": stress})
    mesh.write(tmp_path / "m.dump")
    again = meshio.read(tmp_path / "m.dump")
    assert np.array_equal(again.points, points)
    assert again.point_data["id"].tolist() == [1, 2, 3]
    assert np.array_equal(again.point_data["von_Mises"], stress)


@given(
    st.permutations([*COLUMNS, "fx", "fy", "fz", "c_s[1]", "c_s[2]", "mux", "muz", "yaw_x", "f"])
)
def test_no_column_is_lost(tmp_path_factory: pytest.TempPathFactory, columns: list[str]) -> None:
    """In whatever order: every number is in the mesh once, components in their order."""
    path = tmp_path_factory.mktemp("d") / "d.dump"
    write_dump(path, [frame(1, 2, columns)])
    mesh = meshio.read(path)
    rows = frame(1, 2, columns).values[::-1]
    named = dict(zip(columns, rows.T, strict=True))
    assert np.array_equal(mesh.points, np.column_stack([named[axis] for axis in "xyz"]))
    found = np.concatenate([np.ravel(values) for values in mesh.point_data.values()])
    others = np.concatenate([values for name, values in named.items() if name not in "xyz"])
    assert np.array_equal(np.sort(found), np.sort(others))
