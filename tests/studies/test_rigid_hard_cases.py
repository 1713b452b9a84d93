"""Hard cases: how a row is judged, and that each family begins."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest

from rigid_lcp.errors import NotConverged
from validation.bench.rigid import scenes
from validation.studies.rigid_hard_cases import run

pytestmark = pytest.mark.studies


def test_rows_are_judged_by_their_bars() -> None:
    """At most, at least, no number, and an error that is reported."""
    met = run.judge("c", "a", "m", "<= 1e-9", "ours", lambda: (1e-10, 3))
    assert met["ok"]
    assert met["steps"] == 3
    assert not run.judge("c", "a", "m", ">= 1", "ours", lambda: (0.5, 1))["ok"]
    assert not run.judge("c", "a", "m", "<= 1", "ours", lambda: (nan, 1))["ok"]

    def fails() -> tuple[float, int]:
        raise NotConverged("it failed", where="here", remedy="none")

    failed = run.judge("c", "a", "m", "<= 1", "ours", fails)
    assert failed["value"] is None
    assert "it failed" in failed["why"]


def test_a_trial_is_judged_by_its_displacement() -> None:
    """A stack rests; off its way is measured along and across."""
    trial = run.Trial("stack", run.RESTS, lambda: scenes.stack(3), 0.01, "<= 1e-9")
    assert run.try_ours(trial, "time-stepping")["ok"]
    moved = np.array([[0.3, 0.4, 0.0]])
    assert run.compare_move(0.3)(moved) == pytest.approx(0.4)
    assert run.compare_move(0.4, axis=1)(moved) == pytest.approx(0.3)


def test_threshold_of_cards() -> None:
    """By bisection, against tan(phi) / 2."""
    off, steps = run.bisect_cards(0.3)
    assert off <= 1e-8
    assert steps > 30
