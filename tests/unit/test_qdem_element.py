"""The key ``element`` of a body: what a run of quadratic tetrahedra says, writes and refuses."""

from __future__ import annotations

import json
import os
import signal
import warnings
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.bodies import is_locking
from qdem_fem.files.errors import CheckpointError, Interrupted
from qdem_fem.files.output import write_bodies_vtu
from qdem_fem.mesh import make_box_mesh
from qdem_fem.report.deformed import average_stress
from tests.unit.test_qdem_cli import command, results, stop_at
from trackbed.scenes import find_scene_file

BEAM = (
    find_scene_file("cantilever"), "--set", "body.0.mesh.box={size=[2.4,0.25,0.22],cells=[6,1,1]}",
    "--set", 'body.0.element="quadratic"',
)  # fmt: skip
RUBBER = q.Material(1e7, 0.3, 2000.0, shear_viscosity=2e3, bulk_viscosity=1e3)
BLOCK = make_box_mesh((0.1, 0.1, 0.1), (2, 2, 2))


def test_a_run_says_its_element_and_what_it_gains(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Linear ones are warned of and pointed here; the answer is within 2 % of the paper's beam."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", q.SceneWarning)
        assert command(*BEAM, "--dry-run", "--json") == 0
    body = json.loads(capsys.readouterr().out)["bodies"]["beam"]
    assert (body["element"], body["nodes"]) == ("quadratic", 117)
    assert "would bend about 87 % too little, in steps 2.3 times as long" in body["gain"]
    assert command(*BEAM, "--dry-run", "--set", 'body.0.element="linear"') == 0
    said = capsys.readouterr()
    assert 'or take element = "quadratic"' in said.err
    assert "beam: 36 elements (linear), 28 nodes" in said.out
    assert command(*BEAM, "--run-folder", tmp_path / "run") == 0
    tip = float(capsys.readouterr().out.split("tip at the end (m): ")[1].split()[2])
    assert tip == pytest.approx(-92.65e-6, rel=0.02)  # qdem.md: 27,648 elements
    page = (tmp_path / "run" / "report.html").read_text()
    assert "36 quadratic tetrahedra with 117 nodes" in page
    assert "no error of quadratic ones is estimated" in page


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path: Path, monkeypatch: Any) -> None:
    moves = ('simulation={method="dynamic",duration=0.01,threads=1}', "output.vtu_interval=0.004")
    run = (*BEAM, *(word for key in moves for word in ("--set", key)), "--no-pictures")
    whole, parts = (("--run-folder", tmp_path / name) for name in ("whole", "parts"))
    assert command(*run, *whole) == 0
    stop_at(monkeypatch, 0.4, lambda: os.kill(os.getpid(), signal.SIGTERM))
    with pytest.raises(Interrupted):
        command(*run, *parts)
    assert command(*run, *parts, "--resume") == 0
    assert results(tmp_path / "parts") == results(tmp_path / "whole")


def test_fields_are_quadratic_cells(tmp_path: Path) -> None:
    """VTK's order of nodes: those amid edges lie there; a linear body beside has cells of four.
    A uniform stress is drawn uniform."""
    bodies = [q.QuadraticBody(BLOCK, RUBBER), q.Body(BLOCK, RUBBER, rigid=True)]
    write_bodies_vtu(tmp_path / "a.vtu", bodies)
    mesh = meshio.read(tmp_path / "a.vtu")
    ten = mesh.points[mesh.cells_dict["tetra10"]]
    pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    amid = np.stack([ten[:, list(pair)].mean(axis=1) for pair in pairs], axis=1)
    assert abs(ten[:, 4:] - amid).max() < 1e-15
    assert (mesh.cells_dict["tetra"] == BLOCK.elements + len(bodies[0].nodes)).all()
    assert [part.tolist() for part in mesh.cell_data["body"]] == [[0] * 48, [1] * 48]
    bodies[0].displacement = 1e-3 * bodies[0].nodes * [1, 0, 0]
    drawn = average_stress(bodies[:1])
    assert drawn == pytest.approx(np.full(len(drawn), bodies[0].von_mises()[0]), rel=1e-9)


def test_states_go_on_to_the_bit_and_are_of_one_element(tmp_path: Path) -> None:
    """In single precision within 1e-4 of the stresses of double; there a restart, too."""
    stress = []

    def make(kind: type[q.Body], precision: Any) -> q.Simulation:
        return q.Simulation([kind(BLOCK, RUBBER)], threads=1, step=5e-6, precision=precision)

    for precision in ("float64", "float32"):
        run, again = (make(q.QuadraticBody, precision) for _ in range(2))
        x = run.bodies[0].nodes
        run.bodies[0].velocity = np.cross([3.0, -5.0, 40.0], x) + 20 * x * [1, 0, 0]
        run.advance(5e-4)
        run.save(tmp_path / "state.npz")
        again.restore(tmp_path / "state.npz")
        for one in (run, again):
            one.advance(5e-4)
        assert np.array_equal(again.bodies[0].displacement, run.bodies[0].displacement)
        stress.append(run.bodies[0].stress())
        with pytest.raises(CheckpointError, match="element of body 0"):
            make(q.Body, precision).restore(tmp_path / "state.npz")
    assert 0 < abs(stress[0] - stress[1]).max() < 1e-4 * abs(stress[0]).max()


@pytest.mark.long  # compiles both models of contact
@pytest.mark.parametrize(
    ("contact", "gap"),
    [(q.SphereContact(friction=0.5, radius=0.006, normal_stiffness=1e4), 0.0125),
     (q.SurfaceContact(friction=0.5, modulus=1e9), 0.0005)],
)  # fmt: skip
def test_bodies_that_collide_keep_momentum_and_energy(contact: Any, gap: float) -> None:
    """Two free blocks and a rigid one, 2 kg at 1 m/s; the energy as an audit allows."""
    bodies = [
        kind((BLOCK.nodes + np.array(place), BLOCK.elements), RUBBER, rigid=rigid)
        for kind, place, rigid in (
            (q.QuadraticBody, [0, 0, 0], False), (q.QuadraticBody, [0.02, 0.01, 0.1 + gap], False),
            (q.Body, [-0.01, 0, -0.1 - gap], True),
        )
    ]  # fmt: skip
    run = q.Simulation(bodies, contact=contact, threads=1)
    for body, speed in zip(bodies, (0.2, -1.0, 1.0), strict=True):
        body.velocity = np.tile([0.1 * speed, 0.0, speed], (len(body.nodes), 1))
    mass = run.assembly.mass.copy()
    mass[-len(BLOCK.nodes) :] = bodies[2].rigid_mass.mass / len(BLOCK.nodes)
    momentum, before = mass @ run.velocities(bodies), run.energy()
    run.advance(0.02)
    after = run.energy()
    assert after.friction > 0
    assert after.viscous > 0
    assert abs(mass @ run.velocities(bodies) - momentum).max() < 1e-9 * 2.0
    total = after.kinetic + after.elastic + after.contact + after.friction + after.viscous
    assert total == pytest.approx(before.kinetic, rel=1e-3)


def test_elements_that_lock_have_no_estimate() -> None:
    """In Python as in a report: above a Poisson's ratio of 0.49.  Quadratic ones do not lock."""
    assert not is_locking(q.QuadraticBody(BLOCK, q.Material(1e7, 0.495, 1000.0)))
    for poisson, known in ((0.49, True), (0.495, False)):
        body = q.Body(make_box_mesh((1.0, 0.2, 0.2), (5, 1, 1)), q.Material(1e7, poisson, 1000.0))
        run = q.Simulation([body], threads=1)
        run.fix(body, body.nodes[:, 0] == 0)
        run.load(body, np.isclose(body.nodes[:, 0], 1.0), [0.0, 0.0, -1.0])
        assert (run.relax().discretisation is not None) == known
        assert (run.estimate_errors() is not None) == known
