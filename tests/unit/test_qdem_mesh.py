"""Reading of meshes: every source gives the same mesh, every damage is a `MeshError`."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem.files.errors import LibraryMissing, MeshError, SceneWarning
from qdem_fem.mesh.checks import FLAT
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.tetrahedra import TetMesh, find_gradients, read_mesh

pytestmark = pytest.mark.lowest

BOX = make_box_mesh((0.4, 0.3, 0.2), (2, 2, 2))
NODES, ELEMENTS = BOX.nodes, BOX.elements
UNIT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])  # corners of a right-handed element


def damaged(row: int, column: int, value: Any) -> tuple[np.ndarray, np.ndarray]:
    elements = ELEMENTS.copy()
    elements[row, column] = value
    return NODES, elements


def at(row: int, value: float) -> tuple[np.ndarray, np.ndarray]:
    nodes = NODES.copy()
    nodes[row, 1] = value
    return nodes, ELEMENTS


def refused(source: Any) -> str:
    """The text of the one `MeshError` a source must give, which names a remedy."""
    with pytest.raises(MeshError) as caught:
        read_mesh(source)
    assert caught.value.where
    assert caught.value.remedy
    return str(caught.value)


def attempt(source: Any) -> tuple[TetMesh | None, str]:
    """The mesh, or the text of the `MeshError`; every other error goes through."""
    try:
        return read_mesh(source), ""
    except MeshError as error:
        return None, str(error)


def test_sources_give_the_same_mesh(tmp_path: Path) -> None:
    cells = [("tetra", ELEMENTS[:7]), ("triangle", ELEMENTS[:3, :3]), ("tetra", ELEMENTS[7:])]
    both = meshio.Mesh(NODES, cells)
    sources = [
        (NODES, ELEMENTS),
        [NODES.tolist(), ELEMENTS.tolist()],
        (NODES, ELEMENTS.astype(np.float32)),
        (NODES, ELEMENTS.astype(np.uint16)),
        (np.asfortranarray(NODES), np.asfortranarray(ELEMENTS)),
        skfem.MeshTet(NODES.T.copy(), ELEMENTS.T.copy()),
        both,
        BOX,
    ]
    for suffix in (".msh", ".vtu", ".inp", ".mesh", ".vtk"):
        path = tmp_path / f"box{suffix}"
        meshio.Mesh(NODES, {"tetra": ELEMENTS}).write(path)
        sources += [path, str(path)]
    for source in sources:
        mesh = read_mesh(source)
        np.testing.assert_allclose(mesh.nodes, NODES, rtol=1e-14, atol=1e-15)
        np.testing.assert_array_equal(mesh.elements, ELEMENTS)
        assert mesh.nodes.dtype == np.float64
        assert mesh.elements.dtype == np.int64
        assert len(mesh.flipped) == len(mesh.unused) == 0


def test_arrays_are_copied_and_never_changed() -> None:
    nodes, elements = UNIT.copy(), np.array([[0, 1, 3, 2]])
    mesh = read_mesh((nodes, elements))
    np.testing.assert_array_equal(elements, [[0, 1, 3, 2]])
    nodes[0] = 7
    np.testing.assert_array_equal(mesh.nodes, UNIT)


def test_left_handed_elements_are_mended_and_named() -> None:
    elements = ELEMENTS.copy()
    wrong = [0, 5, 11]
    elements[wrong] = elements[wrong][:, [1, 0, 2, 3]]
    mesh = read_mesh((NODES, elements))
    np.testing.assert_array_equal(mesh.flipped, wrong)
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    assert volumes.min() > 0
    np.testing.assert_array_equal(np.sort(mesh.elements, axis=1), np.sort(ELEMENTS, axis=1))
    np.testing.assert_array_equal(read_mesh(mesh).flipped, wrong)


def test_unused_nodes_are_listed_and_coincident_ones_allowed() -> None:
    """A crack: two elements over the same triangle, with nodes of their own."""
    nodes = np.concatenate([UNIT, UNIT[:3], [[0, 0, -1], [9, 9, 9]]])
    said = "2 parts of 1, 1 elements .* at the place of another node: nodes 0, 1, 2"
    with pytest.warns(SceneWarning, match=said):
        mesh = read_mesh((nodes, [[0, 1, 2, 3], [4, 6, 5, 7]]))
    np.testing.assert_array_equal(mesh.unused, [8])
    assert len(mesh.flipped) == 0


def test_sets_of_skfem() -> None:
    source = (
        skfem.MeshTet.init_tensor(*[np.linspace(0, 1, 3)] * 3)
        .with_boundaries({"left": lambda x: x[0] == 0})
        .with_subdomains({"low": lambda x: x[2] < 0.5})
    )
    mesh = read_mesh(source)
    np.testing.assert_array_equal(mesh.node_sets["left"], np.flatnonzero(mesh.nodes[:, 0] == 0))
    middle = mesh.nodes[mesh.elements].mean(axis=1)
    np.testing.assert_array_equal(mesh.element_sets["low"], np.flatnonzero(middle[:, 2] < 0.5))


def test_sets_of_meshio_over_joined_blocks() -> None:
    triangles = np.array([[0, 1, 3], [1, 4, 3]])
    source = meshio.Mesh(
        NODES,
        [("tetra", ELEMENTS[:5]), ("triangle", triangles), ("tetra", ELEMENTS[5:])],
        point_sets={"probe": np.array([7, 3])},
        cell_sets={
            "part": [np.array([4]), np.array([], int), np.array([0, 2])],
            "face": [None, np.array([1]), None],
        },
        cell_data={"gmsh:physical": [np.full(5, 1), np.full(2, 1), np.repeat([0, 9], (3, 40))]},
        field_data={"core": np.array([1, 3]), "skin": np.array([1, 2])},
    )
    mesh = read_mesh(source)
    assert {k: v.tolist() for k, v in mesh.node_sets.items()} == {
        "probe": [3, 7],
        "face": [1, 3, 4],
        "skin": [0, 1, 3, 4],
    }
    assert {k: v.tolist() for k, v in mesh.element_sets.items()} == {
        "part": [4, 5, 7],
        "core": [0, 1, 2, 3, 4],
        "9": list(range(8, 48)),
    }


@pytest.mark.peer("gmsh")
def test_physical_groups_of_a_gmsh_file(tmp_path: Path) -> None:
    import gmsh

    path = tmp_path / "box.msh"
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="ballast stone")
        gmsh.model.addPhysicalGroup(2, [1], name="bottom")
        gmsh.model.mesh.generate(3)
        for version in (2.2, 4.1):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.write(str(path))
            mesh = read_mesh(path)
            assert len(mesh.element_sets["ballast stone"]) == len(mesh.elements)
            bottom = np.flatnonzero(mesh.nodes[:, 0] == 0)  # gmsh's face 1 is x = 0
            np.testing.assert_array_equal(mesh.node_sets["bottom"], bottom)
    finally:
        gmsh.finalize()


FLAT_NODES = np.concatenate([UNIT[:3], [[0.25, 0.25, 0]]])
DAMAGES: dict[str, tuple[Any, str]] = {
    "shape of nodes": ((NODES[:, :2], ELEMENTS), "shape (27, 2)"),
    "nodes turned": ((NODES.T, ELEMENTS), "nodes.T"),
    "elements turned": ((NODES, ELEMENTS.T), "elements.T"),
    "ten nodes": ((NODES, np.zeros((3, 10), int)), "elements[:, :4]"),
    "ragged": ((NODES, [[0, 1, 2, 3], [0, 1]]), "no array"),
    "text": ((NODES.astype(str), ELEMENTS), "real numbers"),
    "complex": ((NODES + 1j, ELEMENTS), "real numbers"),
    "bool": ((NODES, ELEMENTS > 3), "whole numbers"),
    "half numbers": ((NODES, ELEMENTS + 0.5), "element 0 names [0.5,"),
    "nan number": ((NODES, np.where(ELEMENTS == 5, np.nan, ELEMENTS)), "whole numbers"),
    "huge number": ((NODES, ELEMENTS.astype(np.uint64) + np.uint64(2**63)), "whole numbers"),
    "from one": ((NODES, ELEMENTS + 1), "subtract 1"),
    "out of range": (damaged(3, 2, 27), "element 3 names nodes"),
    "negative": (damaged(4, 0, -1), "there are 27 nodes: element 4;"),
    "twice": (damaged(5, 0, ELEMENTS[5, 3]), "named twice by one element: element 5"),
    "not finite": (at(6, np.nan), "node 6 is at"),
    "infinite": (at(7, -np.inf), "node 7 is at"),
    "too large": ((NODES.astype(np.longdouble) * np.longdouble(10) ** 400, ELEMENTS), "not finite"),
    "flat": ((FLAT_NODES, [[0, 1, 2, 3]]), "no volume: element 0; element 0 of nodes [0, 1, 2, 3]"),
    "one point": ((np.zeros((4, 3)), [[0, 1, 2, 3]]), "no volume"),
    "too small to have mass": ((UNIT * 1e-105, [[0, 1, 2, 3]]), "span 1e-105 m"),
    "volume overflows": ((UNIT * 1e105, [[0, 1, 2, 3]]), "span 1e+105 m"),
    "edge overflows": (((2 * UNIT - 1) * 1.7e308, [[0, 1, 2, 3]]), "span inf m"),
    "lost in rounding": ((UNIT * 1e-9 + 1e7, [[0, 1, 2, 3]]), "no volume"),
    "repeated": ((NODES, np.vstack([ELEMENTS, ELEMENTS[9, ::-1]])), "element 48 repeats element 9"),
    "no elements": ((NODES, []), "no tetrahedra"),
    "no nodes": ((np.zeros((0, 3)), ELEMENTS), "no nodes"),
    "three items": ((NODES, ELEMENTS, 1), "3 items"),
    "no mesh": (np.zeros(3), "ndarray is no mesh"),
    "set": (TetMesh(NODES, ELEMENTS, node_sets={"top": np.array([27])}), "set 'top' names node 27"),
    "set of reals": (
        TetMesh(NODES, ELEMENTS, element_sets={"a": np.ones(2)}),
        "set 'a' is no whole numbers",
    ),
    "skfem curved": (skfem.MeshTet2(), "MeshTet.from_mesh"),
    "skfem hexahedra": (skfem.MeshHex(), "MeshHex1 has no tetrahedra"),
    "skfem triangles": (skfem.MeshTri(), "MeshTri1 has no tetrahedra"),
    "skfem facets": (replace(skfem.MeshTet(), _boundaries={"a": np.array([99])}), "boundaries of"),
    "meshio curved": (meshio.Mesh(np.eye(10, 3), {"tetra10": [range(10)]}), "tetra10"),
    "meshio surface": (
        meshio.Mesh(UNIT, {"triangle": [[0, 1, 2]], "line": [[0, 1]]}),
        "no tetrahedra, only 1 of type triangle, 1 of type line",
    ),
    "meshio other solids": (
        meshio.Mesh(NODES, {"tetra": ELEMENTS, "hexahedron": [range(8)], "wedge": [range(6)]}),
        "no tetrahedra (hexahedron, wedge)",
    ),
    "meshio empty": (meshio.Mesh(UNIT, []), "no cells"),
    "meshio set": (
        meshio.Mesh(UNIT, {"tetra": [[0, 1, 2, 3]]}, cell_sets={"a": [np.array([4])]}),
        "set 'a' names cells",
    ),
    "meshio flat points": (meshio.Mesh(UNIT[:, :2], {"tetra": [[0, 1, 2, 3]]}), "shape (4, 2)"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_named(name: str) -> None:
    source, text = DAMAGES[name]
    message = refused(source)
    assert text in message
    assert "problems with this mesh" not in message


def test_all_problems_are_named_at_once() -> None:
    nodes, elements = at(0, np.nan)
    elements = np.vstack([elements, elements[20], [1, 1, 2, 3], [0, 1, 2, 99]])
    nodes[13] = nodes[14]  # collapses elements that keep four different nodes
    text = refused((nodes, elements))
    for part in ("not finite", "element 48 repeats", "twice by one element: element 49"):
        assert part in text
    assert "5 problems" in text
    assert "element 50 names nodes [0, 1, 2, 99]" in text
    assert "no volume" in text


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")
@given(
    changes=st.lists(
        st.tuples(
            st.integers(0, 47),
            st.integers(0, 3),
            st.integers(-3, 30) | st.integers(-(2**63), 2**63 - 1),
        ),
        max_size=6,
    ),
    moved=st.lists(
        st.tuples(st.integers(0, 26), st.integers(0, 2), st.floats(width=64)), max_size=3
    ),
    order=st.permutations(range(4)),
)
@settings(max_examples=300)
def test_whatever_is_damaged_is_read_rightly_or_refused(
    changes: list[tuple[int, int, int]], moved: list[tuple[int, int, float]], order: list[int]
) -> None:
    nodes, elements = NODES.copy(), ELEMENTS[:, order].copy()
    for row, column, value in changes:
        elements[row, column] = value
    for row, column, place in moved:
        nodes[row, column] = place
    broken = (
        ((elements < 0) | (elements > 26)).any()
        or not np.isfinite(nodes).all()
        or any(len(set(row)) < 4 for row in elements.tolist())
        or len({frozenset(row) for row in elements.tolist()}) < len(elements)
    )
    mesh, refusal = attempt((nodes, elements))
    if mesh is None:
        assert broken or "no volume" in refusal
        return
    assert not broken
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    assert volumes.min() > 0
    np.testing.assert_array_equal(np.sort(mesh.elements, axis=1), np.sort(elements, axis=1))


@given(exponent=st.integers(-300, 300))
def test_no_mesh_is_flat_for_its_unit_of_length(exponent: int) -> None:
    """2^300 m is 1e90 m: the cubes of both ends still have normal floats."""
    assert len(read_mesh((np.ldexp(NODES, exponent), ELEMENTS)).elements) == 48


@pytest.mark.parametrize(("factor", "sound"), [(4.0, True), (0.25, False)])
def test_flat_begins_at_the_stated_ratio(factor: float, sound: bool) -> None:
    """The longest edge of the unit element is sqrt(2); with height h its volume is h / 6."""
    nodes = UNIT * [1, 1, factor * FLAT * 6 * np.sqrt(8)]
    if sound:
        with pytest.warns(SceneWarning, match="at the place of another node: node 0"):
            assert len(read_mesh((nodes, [[0, 1, 2, 3]])).flipped) == 0
    else:
        refused((nodes, [[0, 1, 2, 3]]))


def test_files_that_can_not_be_read(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    contents = {
        "empty.msh": b"",
        "noise.msh": bytes(range(256)) * 9,
        "noise.vtu": b"<VTKFile><nothing/>",
        "noise.inp": b"*NODE\n1, a, b, c\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3",
        "noise.mesh": b"MeshVersionFormatted 2\nDimension 3\nVertices\nmany\n",
        "noise.unknown": b"?",
        "noise": b"?",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    for path in [tmp_path / "absent.msh", tmp_path, *(tmp_path / name for name in contents)]:
        assert str(path) in refused(path)
        with pytest.raises(MeshError, match=f"^beam, mesh file '{re.escape(str(path))}'"):
            read_mesh(path, where="beam")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".inp", ".mesh"])
def test_files_cut_short_are_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"box{suffix}"
    meshio.Mesh(NODES, {"tetra": ELEMENTS}).write(path)
    whole = path.read_bytes()
    for share in (0.05, 0.2, 0.5, 0.8, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        mesh, refusal = attempt(path)
        if mesh is None:
            assert str(path) in refusal
        else:  # this format does not say how much is to come
            assert suffix == ".inp"
            assert len(mesh.elements) < len(ELEMENTS)


def test_no_mesh_library_is_loaded_for_arrays() -> None:
    program = (
        "import sys, qdem_fem.mesh.tetrahedra, qdem_fem.mesh.generation as g;"
        "qdem_fem.mesh.tetrahedra.read_mesh(g.make_box_mesh((1, 1, 1), (1, 1, 1)));"
        "sys.exit(any(m in sys.modules for m in ('skfem', 'meshio', 'gmsh', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_library_meshio_lacks_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "box.med"
    path.write_bytes(b"?")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(LibraryMissing, match="pip install h5py"):
        read_mesh(path)


def test_generation_refuses_what_makes_no_mesh() -> None:
    for make in (
        lambda: make_box_mesh((1, 0, 1), (1, 1, 1)),
        lambda: make_box_mesh((1, 1, 1), (1, 0, 1)),
        lambda: make_box_mesh((1, 1, 1), (1, 1, 1), "six"),  # type: ignore[arg-type]
    ):
        with pytest.raises(MeshError):
            make()
