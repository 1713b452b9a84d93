"""What a report says of a bed that had no room for what its jumps asked."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from adapters.report_bed import owed
from adapters.report_record import Record
from adapters.run_folder import Outcome


def record(*notes: dict[str, Any]) -> Record:
    """A run of jumps with such notes."""
    jumps = [("jump", Outcome("jump", 0, 1, [], {}, notes=each)) for each in notes]
    return cast(Record, SimpleNamespace(run=SimpleNamespace(jumps=jumps)))


def test_only_what_is_left_at_the_end_is_told() -> None:
    """A debt that a later jump paid, jumps by the law, no jump: nothing.  30 of 70 um: 40 owed."""
    short, whole = {"asked": 7e-5, "gain": 3e-5}, {"asked": 7e-5, "gain": 7e-5}
    assert owed(record()) == owed(record({})) == owed(record(short, whole)) == ""
    assert ">40.0</data> µm less" in owed(record(whole, short))
