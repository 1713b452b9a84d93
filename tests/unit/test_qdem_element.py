"""The key ``element`` of a body: what a run of quadratic tetrahedra says, writes and refuses."""

from __future__ import annotations

import json
import os
import signal
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import CheckpointError, ConditionError, Interrupted
from qdem_fem.files.output import write_bodies_vtu
from qdem_fem.mesh import make_box_mesh
from qdem_fem.report.deformed import average_stress
from tests.unit.test_qdem_cli import command, results, stop_at

SCENE = """\
[[body]]
name = "beam"
mesh.box = { size = [2.4, 0.25, 0.22], cells = [6, 1, 1] }
material = { young = 45e9, poisson = 0.167, density = 2350.0 }
element = "quadratic"
[simulation]
duration = 0.01
threads = 1
[[fix]]
body = "beam"
nodes = { set = "x-min" }
[[load]]
body = "beam"
nodes = { set = "x-max" }
force = [0, 0, -200]
[output]
vtu_interval = 0.004
probes.tip = { nearest = [2.4, 0.125, 0.11] }
"""
STEEL = q.Material(young=1e7, poisson=0.3, density=2000.0)
BLOCK = make_box_mesh((0.1, 0.1, 0.1), (2, 2, 2))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (path := tmp_path / "scene.toml").write_text(SCENE)
    return path


def test_a_run_says_its_element_and_what_it_gains(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Linear ones are warned of and pointed here; the answer is within 2 % of the paper's beam."""
    static = ("--set", 'simulation.method="static"', "--set", "output={}")
    with warnings.catch_warnings():
        warnings.simplefilter("error", q.SceneWarning)
        assert command(scene, "--dry-run", "--json") == 0
    quadratic = json.loads(capsys.readouterr().out)
    assert command(scene, "--dry-run", "--set", 'body.0.element="linear"') == 0
    told = capsys.readouterr()
    assert 'or take element = "quadratic"' in told.err
    assert "beam: 36 linear elements, 28 nodes" in told.out
    assert quadratic["bodies"]["beam"]["element"] == "quadratic"
    assert quadratic["bodies"]["beam"]["nodes"] == 117
    assert "would bend about 87 % too little, in steps 2." in quadratic["bodies"]["beam"]["gain"]
    assert command(scene, *static, "--set", 'output.probes.tip.set="x-max"') == 0
    told = capsys.readouterr()
    tip = float(told.out.split("tip at the end (m): ")[1].split()[2])
    assert tip == pytest.approx(-92.65e-6, rel=0.02)  # qdem.md: 27,648 elements
    assert "36 quadratic elements, 117 nodes" in told.out
    page = (scene.parent / "scene-run" / "report.html").read_text()
    assert "36 quadratic tetrahedra with 117 nodes" in page
    assert "no error of quadratic ones is estimated" in page


def test_an_interrupted_run_goes_on_to_the_same_bits(scene: Path, monkeypatch: Any) -> None:
    whole, parts = scene.with_name("whole"), scene.with_name("parts")
    assert command(scene, "--run-folder", whole, "--no-pictures") == 0
    stop_at(monkeypatch, 0.4, lambda: os.kill(os.getpid(), signal.SIGTERM))
    with pytest.raises(Interrupted):
        command(scene, "--run-folder", parts, "--no-pictures")
    assert command(scene, "--run-folder", parts, "--resume", "--no-pictures") == 0
    assert results(parts) == results(whole)


def test_what_there_is_not_is_refused(scene: Path) -> None:
    for setting, said in (
        ("body.0.rigid=true", "beam is rigid, and nothing within it deforms"),
        ('simulation.device="cuda"', "which the processor computes"),
    ):
        with pytest.raises(ConditionError, match=said):
            command(scene, "--dry-run", "--set", setting)


def test_fields_are_quadratic_cells(tmp_path: Path) -> None:
    """VTK's order of nodes: those amid edges lie there; a linear body beside has cells of four."""
    bodies = [q.QuadraticBody(BLOCK, STEEL), q.Body(BLOCK, STEEL, rigid=True)]
    write_bodies_vtu(tmp_path / "a.vtu", bodies)
    mesh = meshio.read(tmp_path / "a.vtu")
    ten = mesh.points[mesh.cells_dict["tetra10"]]
    pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    amid = np.stack([ten[:, list(pair)].mean(axis=1) for pair in pairs], axis=1)
    assert abs(ten[:, 4:] - amid).max() < 1e-15
    assert (mesh.cells_dict["tetra"] == BLOCK.elements + len(bodies[0].nodes)).all()
    assert [part.tolist() for part in mesh.cell_data["body"]] == [[0] * 48, [1] * 48]


def test_a_uniform_stress_is_drawn_uniform() -> None:
    body = q.QuadraticBody(BLOCK, STEEL)
    body.displacement = 1e-3 * body.nodes * [1, 0, 0]
    drawn = average_stress([body])
    assert drawn == pytest.approx(np.full(len(drawn), body.von_mises()[0]), rel=1e-9)


def test_states_of_one_kind_are_not_read_by_another(tmp_path: Path) -> None:
    def make(kind: Callable[..., q.Body]) -> q.Simulation:
        return q.Simulation([kind(BLOCK, STEEL)], threads=1, step=1e-5)

    run = make(q.QuadraticBody)
    run.bodies[0].velocity = np.cross([3.0, -5.0, 40.0], run.bodies[0].nodes)
    run.advance(2e-4)
    run.save(tmp_path / "state.npz")
    run.advance(2e-4)
    again = make(q.QuadraticBody)
    again.restore(tmp_path / "state.npz")
    again.advance(2e-4)
    assert np.array_equal(again.bodies[0].displacement, run.bodies[0].displacement)
    with pytest.raises(CheckpointError, match="element of body 0"):
        make(q.Body).restore(tmp_path / "state.npz")


@pytest.mark.long  # compiles both models of contact
@pytest.mark.parametrize(
    "contact",
    [
        q.SphereContact(friction=0.5, radius=0.006, normal_stiffness=1e4),
        q.SurfaceContact(friction=0.5, modulus=1e9),
    ],
    ids=["spheres", "surface"],
)
def test_bodies_that_collide_keep_momentum_and_energy(contact: Any) -> None:
    """Two free blocks and a rigid one; the energy as an audit allows, at a tenth of its loss."""
    material = q.Material(1e7, 0.3, 2000.0, shear_viscosity=2e3, bulk_viscosity=1e3)
    gap = 0.0125 if isinstance(contact, q.SphereContact) else 0.0005
    bodies = [
        q.QuadraticBody(BLOCK, material),
        q.QuadraticBody(
            (BLOCK.nodes + np.array([0.02, 0.01, 0.1 + gap]), BLOCK.elements), material
        ),
        q.Body(
            (BLOCK.nodes - np.array([0.01, 0.0, 0.1 + gap]), BLOCK.elements), material, rigid=True
        ),
    ]
    run = q.Simulation(bodies, contact=contact, threads=1)
    for body, speed in zip(bodies, (0.2, -1.0, 1.0), strict=True):
        body.velocity = np.tile([0.1 * speed, 0.0, speed], (len(body.nodes), 1))
    mass = [run.assembly.mass[run._node_slice(body)] for body in bodies[:2]]

    def find_momentum() -> Any:
        rigid = bodies[2].rigid_mass.mass * bodies[2].velocity.mean(axis=0)
        return sum(m @ body.velocity for m, body in zip(mass, bodies, strict=False)) + rigid

    momentum, before = find_momentum(), run.energy()
    run.advance(0.02)
    after = run.energy()
    assert after.friction > 0
    assert after.viscous > 0
    assert abs(find_momentum() - momentum).max() < 1e-9 * 2.0  # kg m/s, of 2 kg at 1 m/s
    total = after.kinetic + after.elastic + after.contact + after.friction + after.viscous
    assert total == pytest.approx(before.kinetic, rel=1e-3)


def test_single_precision_is_that_of_double() -> None:
    """A free body that turns and vibrates: 1e-5 of its strains, of 2e-2, over 200 steps."""
    found = []
    for precision in ("float64", "float32"):
        body = q.QuadraticBody(BLOCK, STEEL)
        run = q.Simulation([body], precision=precision, threads=1, step=5e-6)  # type: ignore[arg-type]
        body.velocity = np.cross([3.0, -5.0, 40.0], body.nodes) + 20 * body.nodes * [1, 0, 0]
        run.advance(1e-3)
        found.append(body.stress())
    assert abs(found[0] - found[1]).max() < 1e-4 * abs(found[0]).max()


def test_elements_that_lock_have_no_estimate() -> None:
    """In Python as in a report: above a Poisson's ratio of 0.49."""
    for poisson, known in ((0.49, True), (0.495, False)):
        body = q.Body(make_box_mesh((1.0, 0.2, 0.2), (5, 1, 1)), q.Material(1e7, poisson, 1000.0))
        run = q.Simulation([body], threads=1)
        run.fix(body, body.nodes[:, 0] == 0)
        run.load(body, np.isclose(body.nodes[:, 0], 1.0), [0.0, 0.0, -1.0])
        assert (run.relax().discretisation is not None) == known
        assert (run.estimate_errors() is not None) == known
