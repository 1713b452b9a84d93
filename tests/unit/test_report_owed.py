"""What a report says of a bed with no room for its jumps, and of a piston that hung."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from adapters.files.run_folder import Outcome
from adapters.procedure.record import Record
from adapters.report import jumps as report_jumps
from adapters.report.jumps import describe_hung_cycles, describe_shortfall
from adapters.scene.file import load_scene
from trackbed.scenes import find_scene_file


def record(*notes: dict[str, Any]) -> Record:
    """A run of jumps with such notes."""
    jumps = [("jump", Outcome("jump", 0, 1, [], {}, notes=each)) for each in notes]
    return cast(Record, SimpleNamespace(run=SimpleNamespace(jumps=jumps)))


def test_only_what_is_left_at_the_end_is_told() -> None:
    """A debt that a later jump paid, jumps by the law, no jump: nothing.  30 of 70 um: 40 owed."""
    short, whole = {"asked": 7e-5, "gain": 3e-5}, {"asked": 7e-5, "gain": 7e-5}
    assert (
        describe_shortfall(record())
        == describe_shortfall(record({}))
        == describe_shortfall(record(short, whole))
        == ""
    )
    assert ">40.0</data> µm less" in describe_shortfall(record(whole, short))


@pytest.mark.parametrize(
    ("cycles", "jumps", "said"),
    [
        ([], [15], ""),
        ([1, 2, 9], [15, 40], "cycles 1 to 2, 9 to 9:</strong>.* 1 of the 2 jumps were made then"),
        ([1, 2, 9], [19, 40], "cycles 1 to 2, 9 to 9:</strong>.* No jump was made then"),
        ([30], [15, 25], "cycles 30 to 30:</strong>.* No jump was made then"),
    ],
)
def test_a_piston_that_hung_is_told(
    monkeypatch: pytest.MonkeyPatch, cycles: list[int], jumps: list[int], said: str
) -> None:
    """In which cycles, and how many jumps were made then or in the k_i = 10 cycles behind; nothing
    where it did not hang, or there is no load."""
    scene = load_scene(find_scene_file("karrech-coarse"), ["procedure.k_i=10"])
    made = [("jump", Outcome("jump", first, first + 5, [], {})) for first in jumps]
    run = SimpleNamespace(outcomes=[], jumps=made)
    monkeypatch.setattr(report_jumps, "find_hung_cycles", lambda *_: np.array(cycles, int))
    found = describe_hung_cycles(cast(Record, SimpleNamespace(scene=scene, run=run)))
    assert re.search(said, found, re.DOTALL)
    assert bool(found) == bool(cycles)
    bare = SimpleNamespace(procedure=scene.procedure, loading=None)
    assert describe_hung_cycles(cast(Record, SimpleNamespace(scene=bare, run=run))) == ""
