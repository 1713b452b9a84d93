"""Checkpoints: the same bits after a restore, and no damage or mix-up goes unseen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import qdem_fem as q
from qdem_fem.files.errors import CheckpointError, DiskFull
from qdem_fem.mesh.generation import make_box_mesh
from tests.qdem_restored import go_on

CELLS = (5, 2, 2)
STEEL = {"young": 2e11, "poisson": 0.3, "density": 7800.0}


def made(
    cells: tuple[int, int, int] = CELLS,
    force: Any = (0.0, 30.0, -200.0),
    material: dict[str, float] | None = None,
    condition: Callable[[q.Simulation, q.Body], Any] | None = None,
    **options: Any,
) -> q.Simulation:
    """A clamped bar under an end load, and what a test adds."""
    mesh = make_box_mesh((0.5, 0.1, 0.1), cells)
    body = q.Body(mesh, q.Material(**STEEL | (material or {})), name="bar")
    run = q.Simulation([body], threads=1, **options)
    run.fix(body, body.nodes[:, 0] == 0)
    run.load(body, body.nodes[:, 0] == 0.5, force)
    if condition is not None:
        condition(run, body)
    return run


def state_of(run: q.Simulation) -> list[Any]:
    """Everything a step reads and every sum it adds to, in the kernel's own bits."""
    state = run.assembly.state
    return [
        repr(run.motion), run.time,
        *(a.tobytes() for a in (state.displacement, state.velocity, run.motion.work)),
        run.pack_lists()[1].previous.tobytes(), run.energy(), run.critical_step.value,
    ]  # fmt: skip


def shaken(run: q.Simulation, body: q.Body) -> None:
    """A prescribed motion, an oblique roller and a pressure in time."""
    end = body.nodes[:, 0] == 0.5
    run.prescribe(body, np.flatnonzero(end)[:2], "y", lambda t: 1e-5 * np.sin(2e4 * t))
    run.roller(body, np.flatnonzero(end)[-1], (0.0, 1.0, 1.0))
    run.pressure(body, body.nodes[:, 2] == 0.1, q.make_ramp(2e-4, 1e5))


CASES: dict[str, dict[str, Any]] = {
    "paper": {},
    "single": {"precision": "float32"},
    "viscous": {"material": {"shear_viscosity": 2e4}},
    "gravity": {"gravity": (0, 0, -9.81)},
    "driven": {"condition": shaken, "strain": "svk"},
    "all": {
        "condition": shaken, "precision": "float32", "strain": "svk",
        "material": {"bulk_viscosity": 1e4}, "gravity": (0, 0, -9.81), "mass_scaling": 1.5e-6,
    },
    "step": {"step": 1e-6},
}  # fmt: skip


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[pytest.mark.long] * (case == "all")) for case in CASES]
)  # no other test compiles that loop
@pytest.mark.parametrize("pause", [None, 0.0, 1.37e-4])
def test_restored_run_is_uninterrupted_one(case: str, pause: float | None, tmp_path: Path) -> None:
    """advance, save, restore elsewhere, advance: every bit of state and sums as without."""
    whole, first = made(**CASES[case]), made(**CASES[case])
    for run in (whole, first):
        run.bodies[0].velocity = run.bodies[0].nodes * [0.0, 0.1, 0.2]
        if pause is not None:
            run.advance(pause)
    first.save(tmp_path / "state.npz")
    second = made(**CASES[case])
    second.restore(tmp_path / "state.npz")
    assert state_of(second) == state_of(first)
    histories = [
        run.advance(1e-4, probes={"end": 40}, sampling=1e-5)["end"].tobytes()
        for run in (whole, first, second)
    ]
    assert histories[0] == histories[1] == histories[2]
    assert state_of(whole) == state_of(first) == state_of(second)


def test_critical_step_is_the_saved_one(tmp_path: Path) -> None:
    """A condition removed after the start leaves the step as it was; so does the restore."""

    def stiffened(run: q.Simulation, body: q.Body) -> None:
        run.held = run.fix(body, body.nodes[:, 2] == 0.1)  # type: ignore[attr-defined]

    run, other = made(condition=stiffened), made(condition=stiffened)
    run.advance(2e-5)
    for each in (run, other):
        each.remove(each.held)  # type: ignore[attr-defined]
    run.save(tmp_path / "state.npz")
    other.restore(tmp_path / "state.npz")
    assert other.step == run.step
    assert made().step != run.step


def test_state_of_periodic_bodies_in_the_middle(tmp_path: Path) -> None:
    """Nodes that follow others come back with their masters."""

    def ring() -> q.Simulation:
        body = q.Body(make_box_mesh((0.5, 0.1, 0.1), CELLS), q.Material(**STEEL))
        run = q.Simulation([body], threads=1)
        run.periodic(body, body.nodes[:, 0] == 0, body.nodes[:, 0] == 0.5)
        run.fix(body, body.nodes[:, 2] == 0)
        run.load(body, 50, (0, 0, 100.0))
        return run

    first, second = go_on(ring, tmp_path / "state.npz", 1e-4, 1e-4)
    assert abs(first.bodies[0].displacement).max() > 0
    assert state_of(first) == state_of(second)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"cells": (6, 2, 2)}, "mesh of body 0"),
        ({"material": {"poisson": 0.29}}, "material of body 0"),
        ({"material": {"shear_viscosity": 1.0}}, "material of body 0"),
        ({"strain": "svk"}, "'finger' in the file, 'svk' here"),
        ({"precision": "float32"}, "'float64' in the file, 'float32' here"),
        ({"force": (0.0, 30.0, -201.0)}, "loads"),
        ({"force": q.make_ramp(1.0, (0.0, 30.0, -200.0))}, "loads"),
        ({"force": lambda t: (0.0, 30.0, -200.0)}, "loads"),
        ({"gravity": (0, 0, -9.81)}, "gravity"),
        ({"step": 1e-6}, "step"),
        ({"safety": 0.8}, "step"),
        ({"mass_scaling": 1e-5}, "mass_scaling"),
        ({"condition": lambda run, body: run.fix(body, 3, "y")}, "given displacements"),
        ({"condition": lambda run, body: run.roller(body, 3, (0, 1, 1))}, "rollers"),
        (
            {"condition": lambda r, b: r.periodic(b, b.nodes[:, 2] == 0, b.nodes[:, 2] == 0.1)},
            "periodic pairs",
        ),
    ],
)  # fmt: skip
def test_foreign_state_is_refused(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    """The error names what differs, and the simulation stays as it was."""
    made().save(tmp_path / "state.npz")
    other = made(**change)
    other.advance(1e-5)
    before = state_of(other)
    with pytest.raises(CheckpointError, match=said):
        other.restore(tmp_path / "state.npz")
    assert state_of(other) == before


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of a bar in motion."""
    path = tmp_path_factory.mktemp("saved") / "state.npz"
    run = made()
    run.advance(3e-5)
    run.save(path)
    return path


@pytest.fixture(scope="module")
def victim() -> q.Simulation:
    """A simulation that damaged files are offered to."""
    return made()


@given(place=st.floats(0, 1, exclude_max=True), change=st.integers(1, 255), cut=st.booleans())
@settings(max_examples=200)
def test_no_damage_goes_unseen(
    saved: Path, victim: q.Simulation, tmp_path: Path, place: float, change: int, cut: bool
) -> None:
    """Any byte changed, or the file cut anywhere: `CheckpointError`, and nothing has moved."""
    content = bytearray(saved.read_bytes())
    at = int(place * len(content))
    if cut:
        del content[at:]
    else:
        content[at] ^= change
    damaged = tmp_path / "damaged.npz"
    damaged.write_bytes(content)
    with pytest.raises(CheckpointError, match="no whole checkpoint"):
        victim.restore(damaged)
    assert victim.steps_done == 0
    assert not victim.assembly.state.displacement.any()


def test_file_is_an_npz_that_numpy_reads(saved: Path) -> None:
    """The seal is a legal comment of the archive."""
    with np.load(saved, allow_pickle=False) as archive:
        assert archive["displacement"].shape == (54, 3)
        assert archive["displacement"].dtype == np.float64


def test_missing_file_foreign_npz_and_later_format(
    victim: q.Simulation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files that are no checkpoint of ours are refused as such."""
    with pytest.raises(CheckpointError, match="can not be read"):
        victim.restore(tmp_path / "nothing.npz")
    np.savez(tmp_path / "foreign.npz", displacement=np.zeros(3))
    with pytest.raises(CheckpointError, match="no whole checkpoint"):
        victim.restore(tmp_path / "foreign.npz")
    monkeypatch.setattr("qdem_fem.march.checkpoint.CHECKPOINT_FORMAT", 99)
    victim.save(tmp_path / "later.npz")
    monkeypatch.undo()
    with pytest.raises(CheckpointError, match="format 99"):
        victim.restore(tmp_path / "later.npz")


def test_failed_write_keeps_the_old_file(saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that fills up leaves the last checkpoint, and no other file."""
    before = saved.read_bytes()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(DiskFull, match="No space") as said:
        made().save(saved)
    assert said.value.exit_code == 5
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]
