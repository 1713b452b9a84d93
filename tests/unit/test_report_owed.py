"""What a report says of a bed with no room for its jumps, and of a piston that hung."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, cast

import pytest

from adapters import report_bed
from adapters.report_bed import hung, owed
from adapters.report_record import Record
from adapters.run_folder import Outcome
from adapters.scene_file import scene_load
from scenes import scene_path


def record(*notes: dict[str, Any]) -> Record:
    """A run of jumps with such notes."""
    jumps = [("jump", Outcome("jump", 0, 1, [], {}, notes=each)) for each in notes]
    return cast(Record, SimpleNamespace(run=SimpleNamespace(jumps=jumps)))


def test_only_what_is_left_at_the_end_is_told() -> None:
    """A debt that a later jump paid, jumps by the law, no jump: nothing.  30 of 70 um: 40 owed."""
    short, whole = {"asked": 7e-5, "gain": 3e-5}, {"asked": 7e-5, "gain": 7e-5}
    assert owed(record()) == owed(record({})) == owed(record(short, whole)) == ""
    assert ">40.0</data> µm less" in owed(record(whole, short))


@pytest.mark.parametrize(("seating", "told"), [("any", "may miss most"), ("waits", "waited")])
def test_a_piston_that_hung_is_told(
    monkeypatch: pytest.MonkeyPatch, seating: str, told: str
) -> None:
    """Until which cycle, and what jumps did; nothing where it did not hang, or there is no load."""
    scene = scene_load(scene_path("karrech-coarse"), [f'procedure.seating="{seating}"'])
    run = SimpleNamespace(outcomes=[])
    for last, words in ((0, ""), (7, f"until cycle 7:</strong>.*{told}")):
        monkeypatch.setattr(report_bed, "hung_until", lambda *_, last=last: last)
        found = hung(cast(Record, SimpleNamespace(scene=scene, run=run)))
        assert re.search(words, found, re.DOTALL)
        assert bool(found) == bool(last)
    bare = SimpleNamespace(procedure=None)
    assert hung(cast(Record, SimpleNamespace(scene=bare, run=run))) == ""
