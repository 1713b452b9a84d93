"""Output files: what other programs read in them, and that none is ever half-written."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem.files.errors import DiskFull, UsageError
from qdem_fem.files.output import Table, read_table, write_bodies_vtu
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import find_surface_faces
from qdem_fem.report.deformed import draw_deformed, round_magnification
from qdem_fem.report.figures import choose_unit, draw_energy, draw_history, draw_spectrum
from trackbed.run_files.whole import write_pvd

FINITE = st.floats(allow_nan=False, allow_infinity=False)


def body(shift: float = 0.0) -> Any:
    """What output asks of a `qdem_fem.Body`."""
    mesh = make_box_mesh((2.0, 1.0, 1.0), (4, 2, 2), origin=(shift, 0, 0))
    x = mesh.nodes
    stress = mesh.nodes[mesh.elements].mean(axis=1)[:, 0] * 1e5
    return SimpleNamespace(
        nodes=x, elements=mesh.elements, element_nodes=mesh.elements,
        surface=find_surface_faces(mesh.elements),
        displacement=1e-4 * x[:, [1, 2, 0]], velocity=x**2, von_mises=lambda: stress,
        mover=None,
    )  # fmt: skip


def test_vtu_is_read_back_by_meshio(tmp_path: Path) -> None:
    """Two bodies in one file: coordinates, elements and every field, bit by bit."""
    bodies = [body(), body(5.0)]
    write_bodies_vtu(tmp_path / "a.vtu", bodies)
    mesh = meshio.read(tmp_path / "a.vtu")
    count = len(bodies[0].nodes)
    assert (mesh.points == np.concatenate([one.nodes for one in bodies])).all()
    elements = mesh.cells_dict["tetra"]
    assert (elements == np.concatenate([bodies[0].elements, bodies[1].elements + count])).all()
    for name in ("displacement", "velocity"):
        expected = np.concatenate([getattr(one, name) for one in bodies])
        assert (mesh.point_data[name] == expected).all()
    expected = np.concatenate([one.von_mises() for one in bodies])
    assert (mesh.cell_data["von_mises"][0] == expected).all()
    assert mesh.cell_data["body"][0].tolist() == [0] * 96 + [1] * 96


def test_pvd_names_times_and_files(tmp_path: Path) -> None:
    """The series is XML that gives each file its time to the last bit."""
    write_pvd(tmp_path / "f.pvd", [(0.0, "a.vtu"), (np.float64(0.1 + 0.2), "b&.vtu")])
    found = ElementTree.parse(tmp_path / "f.pvd").getroot().iter("DataSet")
    assert [(float(one.attrib["timestep"]), one.attrib["file"]) for one in found] == [
        (0.0, "a.vtu"),
        (0.1 + 0.2, "b&.vtu"),
    ]


@settings(max_examples=30)
@given(values=st.lists(FINITE, min_size=1, max_size=20))
def test_table_keeps_bits(tmp_path_factory: pytest.TempPathFactory, values: list[float]) -> None:
    """Numbers are read back as they were written."""
    table = Table(tmp_path_factory.mktemp("t") / "t.csv", ["time", "a"])
    table.begin()
    rows = np.column_stack([np.arange(len(values)), values])
    table.append(rows[:1])
    table.append(rows[1:])
    found = read_table(table.path)
    assert (np.column_stack([found["time"], found["a"]]) == rows).all()


@pytest.mark.parametrize("torn", ["", "4", "4.0,9", "4.0,9.0", "x\n"])
def test_cut_leaves_sound_rows_up_to_a_time(tmp_path: Path, torn: str) -> None:
    """Rows behind a time go, and so does a last row that a killed writer left torn."""
    table = Table(tmp_path / "t.csv", ["time", "a"])
    table.begin()
    table.append(np.array([[0.0, 5.0], [1.0, 6.0], [2.0, 7.0], [3.0, 8.0]]))
    whole = table.path.read_bytes()
    with table.path.open("a") as stream:
        stream.write(torn)
    table.cut(1.5, {2})
    assert table.path.read_text() == "time,a\n0.0,5.0\n1.0,6.0\n"
    table.append(np.array([[2.0, 7.0], [3.0, 8.0]]))
    table.cut(3.0, {4})
    assert table.path.read_bytes() == whole


def test_cut_refuses_another_table(tmp_path: Path) -> None:
    """A table with other columns, or none at all, is no table to go on with."""
    (tmp_path / "t.csv").write_text("time,b\n0,1\n")
    for name in ("t.csv", "none.csv"):
        with pytest.raises(UsageError, match=name):
            Table(tmp_path / name, ["time", "a"]).cut(1.0, {1})
    (tmp_path / "t.csv").write_text("time,a\n0.0,1.0\n1.0,")
    with pytest.raises(UsageError, match="2 rows up to 1 s were written, 1 are there"):
        Table(tmp_path / "t.csv", ["time", "a"]).cut(1.0, {2})
    assert (tmp_path / "t.csv").read_text() == "time,a\n0.0,1.0\n1.0,"
    (tmp_path / "t.csv").write_text("time,a\n0.0,1.0\n")
    seal = Table(tmp_path / "t.csv", ["time", "a"]).seal()
    with (tmp_path / "t.csv").open("a") as stream:
        stream.write("1.0,1.0\n")
    Table(tmp_path / "t.csv", ["time", "a"]).cut(0.5, {1}, seal)
    (tmp_path / "t.csv").write_text("time,a\n0.0,2.0\n")
    with pytest.raises(UsageError, match="was changed since it was written"):
        Table(tmp_path / "t.csv", ["time", "a"]).cut(0.5, {1}, seal)
    (tmp_path / "t.csv").write_text("time,a\n0,x\n")
    with pytest.raises(UsageError, match="no table"):
        read_table(tmp_path / "t.csv")


def test_no_space_is_a_sentence_with_the_file(tmp_path: Path) -> None:
    """What the system refuses to write is named with the file and a remedy, not by a number."""
    with pytest.raises(UsageError, match=r"full.csv: can not be written \(.+\)\n  -> make room"):
        Table(tmp_path / "none" / "full.csv", ["time"]).begin()
    full = Table(Path("/dev/full"), ["time"])
    with pytest.raises(DiskFull, match=r"/dev/full: can not be written \(No space left"):
        full.append(np.zeros((1, 1)))


# ---------------------------------------------------------------------------- pictures


@pytest.mark.parametrize("scale", [0.0, 1e-12, 1e-6, 1e-2, 10.0])
def test_magnification_is_round_and_never_below_one(scale: float) -> None:
    """1, 2, 5 times a power of ten; 1 for bodies that do not move or move far."""
    one = body()
    one.displacement = scale * one.nodes / 2
    factor = round_magnification([one])
    assert f"{factor:.0e}"[0] in "125"
    assert factor == pytest.approx(float(f"{factor:.0e}"))
    assert factor >= 1
    if 0 < scale < 1e-2:
        assert 0.4 * 0.06 <= factor * scale / np.sqrt(6) <= 0.06


@pytest.mark.parametrize(
    ("value", "expected"),
    [(92e-6, (1e-6, "µm")), (45e3, (1e3, "km")), (0.0, (1.0, "m")), (1e-15, (1e-9, "nm"))],
)
def test_units_are_shown_in_a_fitting_multiple(value: float, expected: tuple[float, str]) -> None:
    """The multiple that leaves one to three digits before the point."""
    assert choose_unit(value, "m") == expected


@pytest.mark.long
def test_pictures_are_written_and_repeat(tmp_path: Path) -> None:
    """Every picture is a PNG of the same bytes each time, with nothing else left behind."""
    time = np.linspace(0, 1, 400)
    curve = {"tip_z": (time, 1e-4 * np.sin(60 * time)), "flat": (time, np.zeros(400))}
    energy = {name: time**2 for name in ("time", "kinetic", "elastic", "external")}
    drawn: list[dict[str, bytes]] = []
    for _ in range(2):
        draw_deformed(tmp_path / "a.png", [body(), body(5.0)])
        draw_history(tmp_path / "b.png", curve)
        draw_spectrum(tmp_path / "c.png", curve)
        draw_energy(tmp_path / "d.png", energy)
        now = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
        assert sorted(now) == ["a.png", "b.png", "c.png", "d.png"]
        assert all(content.startswith(b"\x89PNG") for content in now.values())
        drawn.append(now)
    assert drawn[0] == drawn[1]


def test_a_tall_body_is_not_drawn_beside_an_empty_half(tmp_path: Path) -> None:
    """Seen 0.17 wide and 1.05 high: with its colour bar half as wide as the picture of a beam."""
    tall = body()
    tall.nodes = tall.nodes * [0.05, 0.1, 1.0]
    widths = []
    for name, one in (("tall", tall), ("beam", body())):
        draw_deformed(tmp_path / f"{name}.png", [one], magnification=1.0)
        widths.append(int.from_bytes((tmp_path / f"{name}.png").read_bytes()[16:20], "big"))
    assert widths[0] < 0.5 * widths[1]


def test_motionless_body_is_drawn(tmp_path: Path) -> None:
    """No displacement and no stress: a picture all the same, of magnification 1."""
    one = body()
    one.displacement = np.zeros_like(one.nodes)
    one.von_mises = lambda: np.zeros(len(one.elements))
    assert draw_deformed(tmp_path / "a.png", [one]) == 1.0
