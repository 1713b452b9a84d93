"""Advice on a scene, and two runs of it that tell whether that was right."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.scene.advise import Advice, advise, error_together
from qdem_fem.scene.build import simulation_of
from qdem_fem.scene.checks import load_scene
from qdem_fem.tables import Prepared
from qdem_fem.track import SLEEPER

SAMPLES_COMPARED = 200
"""Samples of a history that two runs are compared at."""


@dataclass(frozen=True)
class Checked:
    """Two runs of a scene, all deformable and as advised."""

    predicted: float
    """`error_together` of the bodies that are rigid in the second run."""
    probes: dict[str, float]
    """Difference of the two histories of each probe over the deformable one, displacements since
    the start, in the norm over time [-]; of scenes without probes, of the bodies' means."""
    cost: tuple[float, float]
    """Processor time of the deformable and of the advised run [s]."""
    steps: tuple[int, int]

    @property
    def measured(self) -> float:
        """Greatest difference of all probes [-]."""
        return max(self.probes.values())


def advise_scene(path: Path, overrides: Sequence[str], tolerance: float) -> list[Advice]:
    """What is said of each body of a scene; raises `SceneError`."""
    run, _ = simulation_of(load_scene(path, overrides))
    return advise(run, tolerance)


def check_advice(path: Path, overrides: Sequence[str], advice: Sequence[Advice]) -> Checked:
    """Run a scene as it is and as advised, to its duration, and compare its probes.

    Advised bodies are rigid with the inertia of their mesh (``"lumped"``), which the deformable
    ones have; what the runs differ by is then their stiffness alone.  Both take the shorter of
    their time steps, so that neither's own error of time is compared.  Of a track all grains are
    rigid in the second run, whatever was advised: that is what a scene can say of them.
    """
    marks, checked = mark_checked(load_scene(path, overrides), advice)
    step = min(_step(path, overrides), _step(path, [*overrides, *marks]))
    same = f"simulation.step={step!r}"
    soft, soft_cost, steps = _histories(path, [*overrides, same])
    hard, hard_cost, hard_steps = _histories(path, [*overrides, *marks, same])
    parted = {
        name: float(((hard[name] - one) ** 2).sum() ** 0.5 / ((one**2).sum() ** 0.5 or 1.0))
        for name, one in soft.items()
    }
    return Checked(error_together(checked), parted, (soft_cost, hard_cost), (steps, hard_steps))


def mark_checked(prepared: Prepared, advice: Sequence[Advice]) -> tuple[list[str], list[Advice]]:
    """Keys that make bodies of a scene rigid for a check, and the advice with just those rigid."""
    if "track" not in prepared.text.data:
        marks = [f'body.{i}.rigid="lumped"' for i, one in enumerate(advice) if one.rigid]
        return marks, list(advice)
    grains = [replace(one, rigid=one.body != SLEEPER) for one in advice]
    return ['track.rigid="lumped"'], grains


def _step(path: Path, overrides: Sequence[str]) -> float:
    return float(simulation_of(load_scene(path, overrides))[0].step)


def _histories(
    path: Path, overrides: Sequence[str]
) -> tuple[dict[str, NDArray[np.float64]], float, int]:
    """Displacement of every probe since the first step (samples, 3) [m], processor time [s], and
    steps of a run."""
    prepared = load_scene(path, overrides)
    run, bodies = simulation_of(prepared)
    probes: dict[str, Any] = {n: (bodies[b], nodes) for n, (b, nodes) in prepared.probes.items()}
    if not probes:
        probes = {name: (body, body.nodes[:, 0] > -float("inf")) for name, body in bodies.items()}
    duration = prepared.scene.simulation.duration
    assert duration is not None
    run.advance(run.step)
    started = time.process_time()
    history = run.advance(duration - run.step, probes, duration / SAMPLES_COMPARED)
    cost = time.process_time() - started
    moved = {name: history[name] - history[name][0] for name in probes}
    return moved, cost, run.steps_done
