"""What the rivals of the procedure change in a saved bed, LIGGGHTS goes on with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.procedure import CONTROL
from adapters.stages import compute, prepare
from adapters.window import Window, window_load
from validation.settlement_ensemble import COARSE, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay
from validation.settlement_rivals import K_I, METHODS, masses_scaled, run_in
from validation.settlement_rivals_budget import WithoutSprings

pytestmark = pytest.mark.engine
STEP = "engine.rayleigh_share=0.8"
"""Four times the reference's step: these cycles are cheap."""


def gone_on(folder: Path, settings: tuple[str, ...], heavier: float = 1.0) -> Window:
    """Two cycles of the first packing from its checkpoint."""
    scene = replace(COARSE, settings=(*COARSE.settings, *settings)).scene(1)
    lines = {} if heavier == 1 else masses_scaled(scene, heavier)
    run = run_in(folder, scene, CONTROL, lines)
    packing_lay(run, Piece(COARSE, 1), EnsembleRecord())
    bed = compute(run, compute(run, prepare(run), K_I), 2)
    return window_load(folder / bed.window / "states.npz")


@pytest.mark.long
def test_a_full_run_goes_on_from_its_last_state(tmp_path: Path) -> None:
    """Laid with the cycles of its packing and its own, each once; the next cycle begins where the
    record's last positions are."""
    record, piece = EnsembleRecord(), Piece(COARSE, 1, 0)
    longer = f"procedure.total_cycles={piece.last + 10}"
    scene = replace(COARSE, settings=(*COARSE.settings, longer)).scene(1)
    run = run_in(tmp_path, scene, CONTROL)
    packing_lay(run, piece, record)
    laid = run.folder.outcome("window_000000")
    assert laid is not None
    assert [row["cycle"] for row in laid.rows] == list(range(1, piece.last + 1))
    bed = compute(run, compute(run, prepare(run), piece.last), 1)
    window = window_load(tmp_path / bed.window / "states.npz")
    _, kept = record.states(piece.name)
    assert window.cycle[0] == piece.last
    assert window.position[0] == pytest.approx(kept[piece.last], abs=1e-12)


def test_load_keeps_its_phase_under_another_step(tmp_path: Path) -> None:
    """The saved step count is no whole number of the new cycles; the load still begins at zero."""
    window = gone_on(tmp_path, (STEP,))
    (cycle,) = np.unique(np.diff(window.time_step))
    assert window.time_step[0] % cycle == 0
    target = window.piston.target_force
    ends = np.isin(window.piston.time_step, window.time_step)
    assert np.abs(target[ends]).max() < 1e-9 * target.max()


def test_scaled_masses_are_those_of_the_scene(tmp_path: Path) -> None:
    """Ten times the mass, in steps sqrt(10) times as long, from the same places."""
    method = next(method for method in METHODS if method.name == "density x 10")
    window = gone_on(tmp_path, method.settings, method.heavier)
    record = EnsembleRecord()
    radius, _ = record.states("coarse-1")
    mass = 10 * 2710.0 * 4 / 3 * np.pi * radius**3
    assert window.mass == pytest.approx(mass, rel=1e-12)


def test_springs_are_lost_and_nothing_else(tmp_path: Path) -> None:
    """Grains start where they were, as fast, with the same normal forces and no tangential ones."""
    before = gone_on(tmp_path / "before", (STEP,)).state(-1)
    scene = replace(COARSE, settings=(*COARSE.settings, STEP)).scene(1)
    run = run_in(tmp_path / "before", scene, CONTROL)
    run.engine = WithoutSprings(before)
    bed = compute(run, compute(run, prepare(run), K_I), 2)
    done = compute(run, bed, 1)
    after = window_load(tmp_path / "before" / done.window / "states.npz").state(0)
    for name in ("position", "velocity", "spin"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-12, abs=1e-18)
    assert np.array_equal(after.contacts.pair, before.contacts.pair)
    springs = [np.linalg.norm(s.contacts.tangential_spring, axis=1) for s in (before, after)]
    assert springs[1].max() < 1e-3 * springs[0].max()
