"""Answers that are computed and hardly right: each gets a warning with its number."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.bodies import Body
from qdem_fem.files import CheckpointError, EnergyLost, MeshError
from qdem_fem.mesh import make_box_mesh, read_mesh
from qdem_fem.scene.doubts import warn_of_strain
from qdem_fem.scene.energy_account import EnergyAccount
from qdem_fem.scene.run import _Record, read_peak
from qdem_fem.tables.keys import BoxMesh, Mesh, SeriesTable
from qdem_fem.tables.types import WrongKey
from qdem_fem.tables.values import make_body_mesh, make_series


def bar() -> Body:
    return Body(make_box_mesh((1.0, 0.1, 0.1), (8, 1, 1)), q.Material(30e9, 0.2, 2400.0))


def turned(body: Body, angle: float, stretch: float) -> np.ndarray:
    """Displacement [m] of a bar that is stretched, then turned about y by ``angle`` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x = body.nodes * [1 + stretch, 1, 1]
    return x @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) - body.nodes


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(("angle", "warned"), [(0.02, True), (0.0002, False)])
def test_small_strain_that_takes_a_turn_for_strain(held: bool, angle: float, warned: bool) -> None:
    """cos(t) - 1 of a turn by t: 2e-4 beside a strain of 1e-4, and 2e-8; held or free."""
    body = bar()
    run = q.Simulation([body], strain="small", threads=1)
    if held:
        run.fix(body, body.nodes[:, 0] == 0)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warn_of_strain(run, turned(body, angle, 1e-4))
    assert [str(one.message) for one in said if "takes a turn" in str(one.message)] == [
        str(one.message) for one in said
    ]
    assert bool(said) == warned


def test_strains_below_what_single_precision_holds() -> None:
    """2e-6 times 30 GPa is 60 kPa: a free body with less shows rounding; double precision none."""
    for precision, strain, warned in (
        ("float32", 1e-6, True), ("float32", 1e-5, False), ("float64", 1e-6, False),
    ):  # fmt: skip
        body = bar()
        run = q.Simulation([body], precision=precision, threads=1)  # type: ignore[arg-type]
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            warn_of_strain(run, turned(body, 0.3, strain))
        assert bool(said) == warned
        assert all("6e+04 Pa" in str(one.message) for one in said)


@pytest.mark.parametrize(
    ("quantity", "title", "factor"),
    [
        ("force", "F [kN]", 1e3), ("force", "F_kN", 1e3), ("pressure", "F (MPa)", 1e6),
        ("value", "F in mm", 1e-3), ("force", "F [kPa]", None), ("pressure", "F [kN]", None),
        ("value", "F [N]", None), ("force", "F [lbf]", None), ("force", "F", 1.0),
    ],
)  # fmt: skip
def test_a_load_column_has_the_unit_of_its_key(
    tmp_path: Path, quantity: str, title: str, factor: float | None
) -> None:
    """Decimal commas and milliseconds as laboratories write them; a unit of another is refused."""
    (tmp_path / "load.csv").write_text(f"Time [ms];{title}\n0;0\n1;2,5\n")
    table = SeriesTable(csv="load.csv", time="Time [ms]", value=title)
    if factor is None:
        with pytest.raises(WrongKey, match="is not known here"):
            make_series(table, f"load.0.{quantity}", tmp_path, vector=False)
        return
    series = make_series(table.model_copy(), f"x.0.{quantity}", tmp_path, vector=False)
    assert series.times[1] == pytest.approx(1e-3)
    assert series.values[1] == pytest.approx(2.5 * factor)


def test_elements_inside_others_are_named() -> None:
    """Two boxes in each other share no node: their mass in common would count twice."""
    one, other = make_box_mesh((1, 1, 1), (4, 4, 4)), make_box_mesh((1, 1, 1), (5, 5, 5))
    nodes = np.concatenate([one.nodes, other.nodes + 0.33])
    elements = np.concatenate([one.elements, other.elements + len(one.nodes)])
    with pytest.warns(q.SceneWarning) as said:
        read_mesh((nodes, elements))
    assert "falls into 2 parts of 750, 384 elements" in str(said[0].message)
    assert "overlaps and counts mass twice: inside other elements are" in str(said[1].message)


def test_a_volume_in_two_groups_of_msh_2() -> None:
    """MSH 2.2 writes an element for each group: it is one, in both; in one group it is a fault."""
    elements = np.array([[0, 1, 2, 3], [1, 2, 3, 4], [0, 1, 2, 3]])
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])

    def grouped(tags: list[int]) -> meshio.Mesh:
        return meshio.Mesh(
            nodes, [("tetra", elements)], cell_data={"gmsh:physical": [np.array(tags)]},
            field_data={"all": np.array([1, 3]), "core": np.array([2, 3])},
        )  # fmt: skip

    mesh = read_mesh(grouped([1, 1, 2]))
    assert len(mesh.elements) == 2
    assert mesh.element_sets["all"].tolist() == [0, 1]
    assert mesh.element_sets["core"].tolist() == [0]
    repeated = pytest.raises(MeshError, match="the same four nodes")
    with pytest.warns(q.SceneWarning, match="the groups core are named"), repeated:
        read_mesh(grouped([1, 1, 1]))


@pytest.mark.parametrize(
    ("overlap", "cause"), [(100.0, "bodies begin in each other, with 100 J"), (0.0, "shorter step")]
)
def test_a_gap_in_the_account_is_blamed_on_its_cause(overlap: float, cause: str) -> None:
    """2 of 100 J are missing: after an overlap it is not the step that made them."""
    account = EnergyAccount()
    rows = {"kinetic": [0.0, 98.0], "elastic": [0.0, 0], "external": [0.0, 100 - overlap]}
    rows["contact"] = [overlap, 0.0]
    account.add_rows({name: np.array(values) for name, values in rows.items()})
    record = SimpleNamespace(account=account, audit=1e-3, run=SimpleNamespace(time=0, steps_done=0))
    with pytest.raises(EnergyLost, match=cause):
        _Record.check_audit(record)  # type: ignore[arg-type]


def test_a_damaged_record_of_the_greatest_strain_is_refused(tmp_path: Path) -> None:
    """Cut short, empty, of another mesh: a sentence that says what to do; a whole one is read."""
    path, moved = tmp_path / "peak.npz", np.arange(6.0).reshape(2, 3)
    np.savez(path, displacement=moved, energy=2.5)
    found, energy = read_peak(path, (2, 3))
    assert (found == moved).all()
    assert energy == 2.5
    with pytest.raises(CheckpointError, match="--force"):
        read_peak(path, (3, 3))
    for content in (path.read_bytes()[:100], b""):
        path.write_bytes(content)
        with pytest.raises(CheckpointError, match=r"peak\.npz: .*\n  -> remove it"):
            read_peak(path, (2, 3))


def test_a_mesh_in_millimetres_is_scaled(tmp_path: Path) -> None:
    """Key ``scale``: metres in one unit of the file; of a box it is refused."""
    meshio.Mesh(1e3 * bar().nodes, [("tetra", bar().elements)]).write(tmp_path / "mm.vtu")
    mesh = make_body_mesh(Mesh(file="mm.vtu", scale=1e-3), tmp_path, "mesh")
    assert mesh.nodes == pytest.approx(bar().nodes, abs=1e-15)
    with pytest.raises(WrongKey, match="unit of a file"):
        make_body_mesh(
            Mesh(box=BoxMesh(size=(1, 1, 1), cells=(1, 1, 1)), scale=1e-3), tmp_path, "m"
        )


def test_data_of_cells_that_are_not_used_are_named() -> None:
    """Of a file with a modulus for each element, or with two arrays that may number groups."""
    elements = bar().elements
    for names, said in (
        (["young"], "mesh: these data of its cells are not used: young"),
        (["region", "part"], "not used: region, part; one array alone"),
    ):
        kind = float if names == ["young"] else int
        held = {name: [np.ones(len(elements), kind)] for name in names}
        with pytest.warns(q.SceneWarning, match=said):
            read_mesh(meshio.Mesh(bar().nodes, [("tetra", elements)], cell_data=held))
