"""Advice on a scene, and two runs of it that tell whether that was right."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.advise import Advice, advise, error_together
from qdem_fem.scene_build import simulation_of
from qdem_fem.scene_checks import scene_load

SAMPLES = 200
"""Samples of a history that two runs are compared at."""


@dataclass(frozen=True)
class Checked:
    """Two runs of a scene, all deformable and as advised."""

    predicted: float
    """`error_together`"""
    measured: float
    """Difference of the histories over the deformable one, in the norm over time, greatest of
    all probes [-]; of scenes without probes, of the bodies' mean displacements."""
    cost: tuple[float, float]
    """Processor time of the deformable and of the advised run [s]."""
    steps: tuple[int, int]


def advise_scene(path: Path, overrides: Sequence[str], tolerance: float) -> list[Advice]:
    """What is said of each body of a scene; raises `SceneError`."""
    run, _ = simulation_of(scene_load(path, overrides))
    return advise(run, tolerance)


def advice_check(path: Path, overrides: Sequence[str], advice: Sequence[Advice]) -> Checked:
    """Run a scene as it is and as advised, to its duration, and compare its probes.

    Advised bodies are rigid with the inertia of their mesh (``"lumped"``), which the deformable
    ones have; what the runs differ by is then their stiffness alone.  Both take the shorter of
    their time steps, so that neither's own error of time is compared.
    """
    marks = [f'body.{i}.rigid="lumped"' for i, one in enumerate(advice) if one.rigid]
    step = min(_step(path, overrides), _step(path, [*overrides, *marks]))
    same = f"simulation.step={step!r}"
    soft, soft_cost, steps = _histories(path, [*overrides, same])
    hard, hard_cost, hard_steps = _histories(path, [*overrides, *marks, same])
    worst = max(
        float(((h - s) ** 2).sum() ** 0.5 / ((s**2).sum() ** 0.5 or 1.0))
        for s, h in zip(soft, hard, strict=True)
    )
    return Checked(error_together(advice), worst, (soft_cost, hard_cost), (steps, hard_steps))


def _step(path: Path, overrides: Sequence[str]) -> float:
    return float(simulation_of(scene_load(path, overrides))[0].step)


def _histories(
    path: Path, overrides: Sequence[str]
) -> tuple[list[NDArray[np.float64]], float, int]:
    """Displacement of every probe (samples, 3) [m], processor time [s], and steps of a run."""
    prepared = scene_load(path, overrides)
    run, bodies = simulation_of(prepared)
    probes: dict[str, Any] = {n: (bodies[b], nodes) for n, (b, nodes) in prepared.probes.items()}
    if not probes:
        probes = {name: (body, body.nodes[:, 0] > -float("inf")) for name, body in bodies.items()}
    duration = prepared.scene.simulation.duration
    assert duration is not None
    run.advance(run.step)
    started = time.process_time()
    history = run.advance(duration - run.step, probes, duration / SAMPLES)
    cost = time.process_time() - started
    return [history[name] for name in probes], cost, run.steps_done
