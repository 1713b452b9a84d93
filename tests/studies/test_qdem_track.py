"""How the study of tracks reads a run: settlement by axle."""

from __future__ import annotations

import numpy as np
import pytest

from qdem_fem.files.errors import UsageError
from qdem_fem.track.loads.train import Train
from qdem_fem.track.table import BogieTable
from validation.studies.qdem_track.bogie import find_passages, find_settlement

pytestmark = pytest.mark.studies


def test_settlement_is_told_by_axle() -> None:
    """3 m at 30 m/s to the first axle; the bogie's own distance to the second.  A point that sinks
    evenly has its greatest settlement at the end of a passage, one that swings has it before."""
    on, ends = find_passages(BogieTable(lead=3.0, speed=30.0))
    apart = Train(cars=1).axle_distance / 30.0
    assert on == pytest.approx([0.1, 0.1 + apart])
    assert ends == pytest.approx([0.1 + apart / 2, 0.2 + apart])
    time = np.linspace(0.0, 1.0, 101)
    assert find_settlement(time, time, np.array([0.25, 0.5])) == [
        {"greatest": 0.25, "end": 0.25}, {"greatest": 0.5, "end": 0.5}
    ]  # fmt: skip
    swing = np.sin(4 * np.pi * time)
    found = find_settlement(time, swing, np.array([0.25, 0.5]))
    assert found[0]["greatest"] == pytest.approx(1.0, abs=1e-2)
    assert found[0]["end"] == pytest.approx(0.0, abs=1e-9)


def test_settlement_by_axle_of_ramps_drift_and_steps() -> None:
    """Each passage has what lies in it: a step at each axle, on a steady drift."""
    time = np.linspace(0.0, 0.2, 2001)
    down = 1e-3 * time + 2e-5 * (time >= 0.06) + 3e-5 * (time >= 0.12)
    first, last = find_settlement(time, down, np.array([0.1, 0.2]))
    assert first == pytest.approx({"greatest": 1.2e-4, "end": 1.2e-4})
    assert last == pytest.approx({"greatest": 2.5e-4, "end": 2.5e-4})
    lifted = find_settlement(time, -down, np.array([0.1, 0.2]))
    assert lifted[1] == pytest.approx({"greatest": -1.2e-4, "end": -2.5e-4})
    (only,) = find_settlement(time, down, np.array([0.2]))
    assert only["end"] == pytest.approx(2.5e-4)


def test_a_record_that_ends_before_the_passage_is_refused() -> None:
    """One sample early is what a record of whole steps may end; more is not the passage."""
    time = np.linspace(0.0, 0.1, 1001)
    find_settlement(time, time, np.array([0.05, 0.1 + 1e-4]))
    for end in (0.1003, 0.5):
        with pytest.raises(UsageError, match=r"the record ends at 0\.1 s, the last passage"):
            find_settlement(time, time, np.array([0.05, end]))
