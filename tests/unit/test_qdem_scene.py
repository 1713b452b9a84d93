"""QDEM scene files: what they mean, and that every wrong one is answered with lines and keys."""

# ruff: noqa: E501 (a case a line)

from __future__ import annotations

import re
import tomllib
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from qdem_fem.files.errors import NotConverged, SceneError, SceneWarning
from qdem_fem.files.series import Series
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene import RunFolder, run_static, summarise_run
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from qdem_fem.tables.prepared import Prepared

pytestmark = pytest.mark.lowest

SCENES = Path(__file__).parents[2] / "trackbed" / "scenes"
CANTILEVER = (SCENES / "cantilever.toml").read_text(encoding="utf-8")
SMALL = "cells = [4, 1, 1]"
BASE = """\
[[body]]
name = "beam"
mesh = { box = { size = [2, 1, 1], cells = [4, 2, 2] } }
[body.material]
young = 1e9
poisson = 0.2
density = 1000.0
[simulation]
duration = 0.1
[[fix]]
body = "beam"
nodes = { set = "x-min" }
[[load]]
body = "beam"
nodes = { set = "x-max" }
force = [0, 0, -1]
[output.probes]
tip = { nearest = [2, 1, 1] }
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def load(folder: Path, text: str, *overrides: str) -> Prepared:
    return load_scene(write(folder, text), overrides)


def refusal(folder: Path, text: str, *overrides: str) -> str:
    with pytest.raises(SceneError) as caught:
        load(folder, text, *overrides)
    assert caught.value.exit_code == 3
    return str(caught.value)


# ---------------------------------------------------------------------------- what a scene means


def test_shipped_scenes_are_the_papers_beam() -> None:
    """Both scenes hold the beam of section 3.1: 2.4 x 0.25 x 0.22 m of concrete, tip at its end."""
    for name in ("cantilever", "cantilever-vibration"):
        prepared = load_scene(SCENES / f"{name}.toml")
        material = prepared.scene.body[0].material
        assert (material.young, material.poisson, material.density) == (45e9, 0.167, 2350)
        nodes = prepared.meshes["beam"].nodes
        assert np.ptp(nodes, axis=0) == pytest.approx([2.4, 0.25, 0.22])
        body, (tip,) = prepared.probes["tip"]
        assert body == "beam"
        assert nodes[tip] == pytest.approx([2.4, 0.125, 0.11])
        fixed, loaded = prepared.conditions
        assert (fixed.verb, loaded.verb) == ("fix", "load")
        assert (nodes[fixed.arguments[0], 0] == 0).all()
        assert (nodes[loaded.arguments[0], 0] == nodes[:, 0].max()).all()


def test_commented_keys_of_the_specification_are_valid(tmp_path: Path) -> None:
    """cantilever.toml with every comment of a key taken in is a scene of all conditions.

    But for those that shut each other out, as a spin does where [[periodic]] joins the body.
    """
    text = re.sub(r"(?m)^# (?=\w+ = |\[)", "", CANTILEVER)
    text = re.sub(r"(?m)^(file|scale|tolerance|device|spin) = .*$", "", text)
    text = re.sub(r"\[body.regions.core\].*\nyoung = 30e9", "", text)
    text = text.replace('method = "static"', 'method = "dynamic"')
    text = text.replace("cells = [48, 6, 6]", SMALL)
    assert len(tomllib.loads(text)["simulation"]) == 9
    with pytest.warns(SceneWarning, match=r"load\.0 acts on nodes of which 100 % are held"):
        prepared = load(tmp_path, text)
    verbs = [step.verb for step in prepared.conditions]
    assert sorted(verbs) == ["fix", "load", "periodic", "prescribe", "pressure", "roller"]


@pytest.mark.parametrize(
    ("nodes", "count"),
    [
        ('{ set = "x-max" }', 9),
        ("{ box = { min = [0, 0, 0], max = [0.5, 1, 0.1] } }", 6),
        ("{ plane = { point = [1, 0, 0], normal = [2, 0, 0] } }", 9),
        ("{ plane = { point = [0, 0, 0], normal = [1, 1, 0], tolerance = 0.4 } }", 9),
        ("{ nearest = [2.1, 0.6, 0.1] }", 1),
        ("{ all = true }", 45),
    ],
)
def test_nodes_are_selected(tmp_path: Path, nodes: str, count: int) -> None:
    """Each way to name nodes, counted by hand on a grid of 5 x 3 x 3 nodes 0.5 m apart."""
    prepared = load(tmp_path, BASE.replace('{ set = "x-max" }', nodes), 'fix.0.components="x"')
    assert len(prepared.conditions[1].arguments[0]) == count


@pytest.mark.parametrize(
    ("force", "times", "values"),
    [
        ("[1, 2, 3]", [0], [[1, 2, 3]]),
        ("{ ramp = 2.0, value = [0, 0, -4] }", [0, 2], [[0, 0, 0], [0, 0, -4]]),
        ("{ ramp = 2, value = 3, direction = [0, 1, -1] }", [0, 2], [[0, 0, 0], [0, 3, -3]]),
        ("{ times = [-1, 0.5], values = [[1, 0, 0], [2, 0, 0]] }", [-1, 0.5], [[1, 0, 0], [2, 0, 0]]),
        ('{ csv = "p.csv", time = "t", value = "p", direction = [0, 0, 2] }', [0, 1], [[0, 0, 6], [0, 0, 8]]),
    ],
)  # fmt: skip
def test_series_are_read(tmp_path: Path, force: str, times: Any, values: Any) -> None:
    """Constants, ramps, tables, and columns of a CSV file beside the scene."""
    (tmp_path / "p.csv").write_text("t, q, p\n0, 9, 3\n\n1, 9, 4\n")
    prepared = load(tmp_path, BASE.replace("[0, 0, -1]", force))
    series = prepared.conditions[1].arguments[1]
    assert isinstance(series, Series)
    assert (series.times.tolist(), series.values.tolist()) == (times, values)
    assert list(prepared.files) == (["p.csv"] if "csv" in force else [])


def test_regions_change_the_material_of_their_elements(tmp_path: Path) -> None:
    """Keys of a region hold in its elements and nowhere else; the mesh file counts beside it."""
    mesh = make_box_mesh((2, 1, 1), (4, 2, 2))
    sets = {"core": [np.arange(10)], "rim": [np.arange(80, 96)]}
    meshio.Mesh(mesh.nodes, {"tetra": mesh.elements}, cell_sets=sets).write(tmp_path / "beam.inp")
    text = BASE.replace(
        "{ box = { size = [2, 1, 1], cells = [4, 2, 2] } }", '{ file = "beam.inp" }'
    )
    text = text.replace("[simulation]", "[body.regions.core]\nyoung = 3e9\n[simulation]")
    prepared = load(tmp_path, text)
    _, bodies = make_simulation(prepared)
    young = np.asarray(bodies["beam"].material.young)
    assert (young[:10] == 3e9).all()
    assert (young[10:] == 1e9).all()
    assert len(prepared.files["beam.inp"]) == 64
    message = refusal(tmp_path, text.replace("regions.core", "regions.cora"))
    assert (
        "scene.toml:8: body.0.regions.cora: there is no element set 'cora'; did you mean core?"
        in message
    )


def test_left_out_names_what_the_scene_does_not(tmp_path: Path) -> None:
    """Viscosity and gravity are left out unless named; contact always is."""
    words = " ".join(load(tmp_path, BASE).scene.list_left_out())
    assert "viscosity" in words
    assert "gravity" in words
    overrides = ("body.beam.material.shear_viscosity=5.0", "simulation.gravity=[0, 0, -9.81]")
    words = " ".join(load(tmp_path, BASE, *overrides).scene.list_left_out())
    assert "viscosity" not in words
    assert "gravity" not in words
    assert "contact" in words
    assert "cause of motion" not in words
    still = BASE.replace("[0, 0, -1]", "[0, 0, 0]").replace("[[load]]", "[[roller]]")
    still = still.replace("force = ", "normal = [1, 0, 0] #")
    assert "any cause of motion" in " ".join(load(tmp_path, still).scene.list_left_out())


# ---------------------------------------------------------------------------- wrong scenes

WRONG = [
    ("density = 1000.0", "density = -1.0", "7: body.0.material.density: must be above 0"),
    ("poisson = 0.2", "poisson = 0.5", "6: body.0.material.poisson: must be below 0.5, not 0.5"),
    ("duration = 0.1", "duration = 0", "9: simulation.duration: must be above 0"),
    ("duration = 0.1", "", "8: simulation.duration: missing"),
    ("duration = 0.1", "duration = 0.1\nstep = 1.0", "10: simulation.step: must not exceed"),
    ('"x-max"', '"x-mxa"', "15: load.0.nodes.set: there is no set 'x-mxa'; did you mean x-max.*y-min"),
    ('"x-max"', '"core"', "15: load.0.nodes.set: .*known: x-max, x-min, y-max, y-min, z-max, z-min"),
    ('set = "x-max"', "box = { min = [3, 0, 0], max = [4, 1, 1] }", "15: load.0.nodes.box: names no node; the body spans 0 ... 2, 0"),
    ('set = "x-max"', "box = { min = [1, 1, 0], max = [2, 0, 1] }", "15: load.0.nodes.box: min"),
    ('set = "x-max"', "plane = { point = [0, 0, 0], normal = [0, 0, 0] }", "15: load.0.nodes.plane.normal: has no direction"),
    ('set = "x-max"', 'set = "x-max", all = true', "15: load.0.nodes: give exactly one of"),
    ('set = "x-max"', "", "15: load.0.nodes: give exactly one of"),
    ('body = "beam"\nnodes = { set = "x-max"', 'body = "bean"\nnodes = { set = "x-max"', "14: load.0.body: there is no body 'bean'; did you mean beam?"),
    ("force = [0, 0, -1]", "force = 5", "16: load.0.force: must be a list in"),
    ('name = "beam"', 'name = "a beam"', "2: body.0.name: a name has 1 to 60 letters"),
    ("force = [0, 0, -1]", "force = { ramp = 1 }", "16: load.0.force.value: missing"),
    ("force = [0, 0, -1]", "force = { ramp = 1, value = 2 }", "16: load.0.force: a force is a vector"),
    ("force = [0, 0, -1]", "force = { ramp = 1, times = [1] }", "16: load.0.force: give one of ramp, times or csv"),
    ("force = [0, 0, -1]", "force = { times = [0, 0], values = [[0, 0, 0], [0, 0, 1]] }", "16: load.0.force.times: must grow"),
    ("force = [0, 0, -1]", "force = { times = [0, nan], values = [[0, 0, 0], [0, 0, 1]] }", "16: load.0.force.times.1: must be a finite"),
    ("force = [0, 0, -1]", "force = { times = [0], values = [[0, 0, 0], [0, 0, 1]] }", "16: load.0.force.values: 1 times, 2 values"),
    ("box = { size = [2, 1, 1], cells = [4, 2, 2] }", 'file = "no.vtu"', "no.vtu.*: body.0.mesh: "),
    ("cells = [4, 2, 2]", "cells = [2000, 2000, 2000]", "3: body.0.mesh.box.cells: 8000000000 cells are too many"),
    ("cells = [4, 2, 2]", "cells = [0, 2, 2]", "3: body.0.mesh.box.cells.0: must be at least 1"),
    ("nearest = [2, 1, 1]", 'nearest = [2, 1, 1], body = "bem"', "18: output.probes.tip.body: there is no body 'bem'"),
    ("[output.probes]", "[output]\nsampling = 1\n[output.probes]", "18: output.sampling: must not exceed"),
    ("[[load]]", "[[laod]]", "13: laod: unknown key; did you mean load?"),
    ("[simulation]", "[fix]\n[simulation]", "scene.toml:1\\d: this is not TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_wrong_scenes_name_line_and_key(tmp_path: Path, old: str, new: str, words: str) -> None:
    """One fault, one sentence that names its line and key."""
    assert old in BASE
    message = refusal(tmp_path, BASE.replace(old, new, 1))
    assert re.search(words, message), message
    if "TOML" not in words:
        assert re.search(r"\d+ problem", message)


def test_all_faults_are_named_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    """A fault of every stage of checking (key, mesh, nodes, series, times) in one answer."""
    text = BASE
    for old, new in (
        ("density = 1000.0", "density = 1000.0\nporosity = 0.1"),
        ("duration = 0.1", "duration = 0.1\nstep = 1.0"),
        ('set = "x-min"', 'set = "left"'),
        ("[0, 0, -1]", '{ csv = "no.csv", value = "p", direction = [0, 0, 1] }'),
        ("[output.probes]", "[output]\nsampling = -1.0\n[output.probes]"),
    ):
        text = text.replace(old, new)
    message = refusal(tmp_path, text)
    keys = re.findall(r"(?m)^  \S+?(?::\d+)?: ([\w.-]+): ", message)
    assert keys == [
        "body.0.material.porosity", "simulation.step", "fix.0.nodes.set", "load.0.force.csv",
        "output.sampling",
    ]  # fmt: skip
    assert "5 problems" in message


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("t,p\n0,1\n2,1\n1,1\n", "p.csv:4: load.0.force.csv: times must grow: 1 s follows 2 s"),
        ("t,q\n0,1\n", "p.csv:1: load.0.force.csv: there is no column p among t, q"),
        ("t,p\n0,\udcff\n", "p.csv:2, column p: load.0.force.csv: '\u00ff' is not a number"),
    ],
)
def test_wrong_csv_series_are_refused_with_line(tmp_path: Path, rows: str, words: str) -> None:
    """A CSV series is refused with its own file and line."""
    (tmp_path / "p.csv").write_bytes(rows.encode("utf-8", "surrogateescape"))
    force = '{ csv = "p.csv", time = "t", value = "p", direction = [0, 0, 1] }'
    assert words in refusal(tmp_path, BASE.replace("[0, 0, -1]", force))


def test_mesh_files_without_tetrahedra_are_refused(tmp_path: Path) -> None:
    """A mesh of triangles, and a file that is no mesh."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    meshio.Mesh(points, {"triangle": np.array([[0, 1, 2]])}).write(tmp_path / "a.vtk")
    (tmp_path / "b.vtk").write_text("no mesh")
    for name in ("a.vtk", "b.vtk"):
        text = BASE.replace("box = { size = [2, 1, 1], cells = [4, 2, 2] }", f'file = "{name}"')
        assert re.search(f"{name}.*: body.0.mesh: ", refusal(tmp_path, text))


def test_what_the_simulation_refuses_has_its_key(tmp_path: Path) -> None:
    """Nodes that make no surface face are found by the simulation; the answer names the table."""
    pressure = '[[pressure]]\nbody = "beam"\nnodes = { nearest = [1, 0, 0] }\npressure = 5\n[output.probes]'
    prepared = load(tmp_path, BASE.replace("[output.probes]", pressure))
    with pytest.raises(SceneError, match=r"scene.toml:17: pressure.0: no surface face"):
        make_simulation(prepared)


def test_conditions_that_contradict_one_another_are_problems_of_the_scene(tmp_path: Path) -> None:
    """A roller against a prescribed motion; a static scene that can turn: refused before any run."""
    moved = (
        '[[prescribe]]\nbody = "beam"\nnodes = { set = "x-max" }\ncomponent = "x"\nvalue = 1.0\n'
    )
    roller = '[[roller]]\nbody = "beam"\nnodes = { set = "x-max" }\nnormal = [1, 0, 0]\n'
    prepared = load(tmp_path, BASE.replace("[output.probes]", moved + roller + "[output.probes]"))
    with pytest.raises(SceneError, match=r"roller: a node is moved along x out of its plane"):
        make_simulation(prepared)
    prepared = load(tmp_path, BASE, 'simulation.method="static"', 'fix.0.components="xy"')
    unused = pytest.warns(SceneWarning, match=r"a static run does not use simulation\.duration")
    with unused, pytest.raises(SceneError, match=r"fix: beam has no static answer: 1 of the 6"):
        make_simulation(prepared)


def test_same_name_twice(tmp_path: Path) -> None:
    """Two bodies of one name."""
    body = BASE[: BASE.index("[simulation]")]
    assert "body.0 has this name already" in refusal(tmp_path, body + BASE)


# ---------------------------------------------------------------------------- what has no effect


MOVED = '[[prescribe]]\nbody = "beam"\nnodes = { set = "x-min" }\ncomponent = "z"\nvalue = 1e-4\n'
STILL = BASE.replace("duration = 0.1", 'method = "static"')


def test_what_contradicts_is_refused(tmp_path: Path) -> None:
    """Mass added to a static answer only weighs; what is fixed is not moved."""
    said = refusal(tmp_path, STILL, "simulation.mass_scaling=1e-5")
    assert "scene.toml: 1 problem" in said
    assert "simulation.mass_scaling: a static answer has no time step" in said
    said = refusal(tmp_path, BASE.replace("[output.probes]", MOVED + "[output.probes]"))
    assert "prescribe.0.component: [[fix]] keeps it at zero at all its nodes" in said
    load(
        tmp_path,
        BASE.replace("[output.probes]", MOVED + "[output.probes]"),
        'fix.0.components="xy"',
    )


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (["simulation.tolerance=1e-3"], "a dynamic run does not use simulation.tolerance"),
        (["simulation.step=1e-5", "simulation.safety=0.5"], "a dynamic run of a given step does not use simulation.safety"),
        (['simulation.method="static"', "output.modes=1"], "a static run does not use simulation.duration, output.modes"),
        (['load.0.nodes.set="x-min"'], "load.0 acts on nodes of which 100 % are held in its direction"),
        (["load.0.force={times=[0.2,0.3],values=[[1,0,0],[2,0,0]]}"], "load.0 begins to change at 0.2 s, after the run has ended"),
        (["output.probes.tip.nearest=[1e3,1,1]"], "output.probes.tip.nearest is outside the body: the node at [2. 1. 1.] m is taken, 998 m away"),
        (["body.0.material.poisson=0.4901"], "linear tetrahedra lock at a Poisson's ratio above 0.49, as that of beam"),
    ],
)  # fmt: skip
def test_what_has_no_effect_is_named(tmp_path: Path, overrides: list[str], said: str) -> None:
    """A key, a load or a place that the run computes without, and a mesh that can not be judged."""
    with pytest.warns(SceneWarning, match=re.escape(said)):
        make_simulation(load(tmp_path, BASE, *overrides))
    make_simulation(load(tmp_path, BASE, "simulation.safety=0.9", "body.0.material.poisson=0.49"))
    make_simulation(load(tmp_path, BASE, "output.probes.tip.nearest=[1.75,0.75,0.75]"))  # a centre


def test_no_error_of_a_mesh_that_locks(tmp_path: Path) -> None:
    """Near to incompressible the estimate said 33 % where 97 % were missing."""
    folder = RunFolder(tmp_path)
    for ratio, names in ((0.49, 3), (0.499, 0)):
        prepared = load(tmp_path, STILL, f"body.0.material.poisson={ratio}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            done = run_static(prepared, *make_simulation(prepared), folder)
        assert len(summarise_run(prepared, done, folder)["discretisation"]) == names


def test_no_static_answer_by_its_cause(tmp_path: Path) -> None:
    """Young's modulus in GPa turns elements inside out; what is slow may hang by an edge."""
    for overrides, cause in (
        (
            ["body.0.material.young=45", "load.0.force=[0,0,-200]"],
            r"inside out.*\n.*units of material\.young",
        ),
        (["simulation.tolerance=1e-14"], r"share no face.*simulation\.tolerance"),
    ):
        prepared = load(tmp_path, STILL, *overrides)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            run, bodies = make_simulation(prepared)
        if "tolerance" in cause:
            run.relax = partial(run.relax, max_steps=5)
        with pytest.raises(NotConverged, match=cause):
            run_static(prepared, run, bodies, RunFolder(tmp_path))
