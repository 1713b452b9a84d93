"""Hard cases of contact by all models: energies close, momentum stays, the step is what it says."""

from __future__ import annotations

import numpy as np
import pytest

from tests.qdem_slopes import tetrahedron
from validation.bench.qdem.contact import (
    CASES,
    MODELS,
    audit_energy,
    collide_cubes,
    spin_grain,
    sum_momenta,
)

CLOSES = 1e-3  # share of the greatest energy that the account may lack
BY_MODEL = pytest.mark.parametrize(
    "model",
    [
        model if model == "spheres" else pytest.param(model, marks=pytest.mark.long)
        for model in MODELS
    ],
)  # the loop of surfaces compiles for a minute
SHORT = [words for words in CASES if words != "spinning grain"]


@BY_MODEL
@pytest.mark.parametrize("words", SHORT)
@pytest.mark.long
@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # an overlap is meant
def test_energies_close(words: str, model: str) -> None:
    """Within a thousandth of the greatest there was; and the bodies did touch."""
    lacks, stored, _ = audit_energy(*CASES[words](model))
    assert lacks < CLOSES
    assert stored > 0.01


@pytest.mark.long
@BY_MODEL
def test_spinning_grain_keeps_its_angular_momentum(model: str) -> None:
    """Without friction: to rounding of some thousand steps; and friction took nothing."""
    run, duration = spin_grain(model)
    before = sum_momenta(run)
    lacks, stored, lost = audit_energy(run, duration)
    assert lacks < CLOSES
    assert stored > 1e-3
    assert lost == 0.0
    change = np.abs(sum_momenta(run) - before)[3:].max()
    assert change < 1e-11 * np.linalg.norm(before[3:])


@BY_MODEL
def test_critical_step_with_contact(model: str) -> None:
    """0.999 of it: silent and bounded; 1.001 of it: a warning.  No more is to be had of energies:

    at a share s of its critical step that of a mode wavers by up to s^2/(1 - s^2) of itself.
    """
    below, above = collide_cubes(model, 0.999), collide_cubes(model, 1.001)
    assert not below[1]
    assert below[0] < 0.1
    assert above[1]


@BY_MODEL
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.long
def test_tetrahedron_stands_on_its_vertex(model: str, friction: float) -> None:
    """Spring of a vertex ``p/2 A/3 (three faces of c = 1/3)`` against the weight: it stays."""
    worst, aside = tetrahedron(model, friction)
    assert worst < 1e-9
    assert aside < 1e-12
