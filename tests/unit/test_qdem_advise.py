"""``trackbed advise``: compliances against peers, reasons, and the runs that tell."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.advise import advise, assemble_stiffness, find_compliance, predict_error
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from trackbed import command

STONE = q.Material(30e9, 0.2, 2700.0)
STONES = Path(__file__).parents[1] / "qdem_stones.toml"
"""A soft pad and two stones; the second one falls."""


def beam(young: float = 30e9, turn: Any = None) -> q.Body:
    """A beam of 4 x 1 x 1 cells, turned."""
    mesh = make_box_mesh((0.08, 0.02, 0.02), (4, 1, 1))
    turn = Rotation.identity() if turn is None else turn
    return q.Body((turn.apply(mesh.nodes), mesh.elements), q.Material(young, 0.2, 2700.0))


def test_compliance_against_all_modes() -> None:
    """Inertia relief is the sum of ``phi phi^T/omega^2`` over all modes with strain."""
    body = beam()
    mass = np.repeat(q.Simulation([body]).assembly.mass, 3)
    own = q.Body(body.mesh, STONE)
    scaled = assemble_stiffness(own).toarray() / np.sqrt(mass) / np.sqrt(mass)[:, None]
    value, vector = np.linalg.eigh(scaled)
    shape = vector[:, 6:] / np.sqrt(mass)[:, None]
    flexible = ((shape / value[6:]) @ shape.T).reshape(len(own.nodes), 3, -1, 3)
    each = [np.linalg.eigvalsh(flexible[i, :, i])[-1] for i in range(len(own.nodes))]
    found = find_compliance(own)
    assert found.vertex == pytest.approx(max(each), rel=1e-6)
    assert found.frequency == pytest.approx(np.sqrt(value[6]) / 2 / np.pi, rel=1e-3)
    assert found.transit == pytest.approx(0.08 / STONE.wave_speed)


def test_compliance_knows_no_direction_and_goes_with_the_modulus() -> None:
    """Turned anyhow the same; half as stiff, twice as compliant."""
    first = find_compliance(beam())
    turned = find_compliance(beam(turn=Rotation.from_rotvec([1.0, 2, 3])))
    softer = find_compliance(beam(15e9))
    assert turned.vertex == pytest.approx(first.vertex, rel=1e-7)
    assert softer.vertex == pytest.approx(2 * first.vertex, rel=1e-7)
    assert softer.frequency == pytest.approx(first.frequency / np.sqrt(2), rel=1e-3)


def test_reasons() -> None:
    """No contact, a load too fast, a hinge, rollers: each body that stays has its reason."""

    def said(change: Any, **options: Any) -> tuple[bool, str]:
        contact = q.SphereContact(0.001, options.pop("stiffness", 1e3), 0.1)
        body = q.Body(make_box_mesh((0.03,) * 3, (1, 1, 1)), STONE)
        run = q.Simulation([body], contact=options.pop("contact", contact), threads=1)
        change(run, body)
        (one,) = advise(run)
        return one.rigid, one.why

    assert said(lambda run, body: None) == (True, "within 0.01")
    assert "touches nothing" in said(lambda run, body: None, contact=None)[1]
    assert "of the compliance" in said(lambda run, body: None, stiffness=1e9)[1]
    assert said(lambda run, body: run.fix(body, body.nodes[:, 2] == 0)) == (True, "within 0.01")
    assert "a hinge" in said(lambda run, body: run.fix(body, [0, 1]))[1]
    assert "rollers" in said(lambda run, body: run.roller(body, 0, [0, 0, 1]))[1]
    fast = q.ramp(1e-7, [1.0, 0, 0])
    assert "first mode" in said(lambda run, body: run.load(body, 0, fast))[1]
    slow = q.ramp(1e-2, [1.0, 0, 0])
    assert said(lambda run, body: run.load(body, 0, slow))[0]


@pytest.mark.long
def test_two_runs_tell_that_the_prediction_bounds() -> None:
    """Stones on a pad, deformable and as advised: what their probes differ by is below what was
    predicted, and not far below.  Rigid ones have the inertia of their mesh, as the others do."""
    advice = advise(make_simulation(load_scene(STONES))[0], 0.05)
    assert [one.rigid for one in advice] == [False, True, True]
    marks = ['body.1.rigid="lumped"', 'body.2.rigid="lumped"']
    runs = [make_simulation(load_scene(STONES, words)) for words in ([], marks)]
    step, moved = min(run.step for run, _ in runs), []
    for words in ([], marks):
        prepared = load_scene(STONES, [*words, f"simulation.step={step!r}"])
        run, bodies = make_simulation(prepared)
        duration = prepared.scene.simulation.duration
        assert duration is not None
        probes = {name: (bodies[body], nodes) for name, (body, nodes) in prepared.probes.items()}
        run.advance(run.step)
        history = run.advance(duration - run.step, probes, duration / 200)
        moved.append({name: history[name] - history[name][0] for name in probes})
    soft, hard = moved
    measured = max(np.linalg.norm(hard[n] - soft[n]) / np.linalg.norm(soft[n]) for n in soft)
    assert soft
    assert predict_error(advice) / 10 < measured < predict_error(advice)
    nobody = [replace(one, rigid=False) for one in advice]
    assert predict_error(nobody) == 0.0


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A line a body, and the same in JSON; a tolerance that is none is refused."""
    file = tmp_path / "advice.json"
    assert command.main(["advise", str(STONES), "--tolerance", "0.05", "--json", str(file)]) == 0
    shown = capsys.readouterr().out
    assert "pad: deformable: it makes 0.9" in shown
    assert "rigid: 2 of 3 bodies" in shown
    written = json.loads(file.read_text())
    assert [body["rigid"] for body in written["bodies"]] == [False, True, True]
    assert command.main(["advise", str(STONES), "--tolerance", "2"]) == 2
