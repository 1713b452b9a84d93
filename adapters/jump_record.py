"""What a controlled run decided and observed, from the events in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from adapters.jump_band import Band, band_of
from adapters.report_record import Track

Event = dict[str, Any]

DECISION, CHECK = "decision", "jump checked"
"""Events of a controlled run: what was decided and why; a jump beside what was computed behind."""


def decisions_of(events: Sequence[Event]) -> list[Event]:
    """Decisions in the order of the run, each once; fields of `jump_control.Decision`."""
    found = {(e["cycle"], e["attempt"], e["action"]): e for e in events if e["event"] == DECISION}
    return list(found.values())


def checks_of(events: Sequence[Event]) -> dict[tuple[int, int], Event]:
    """Checks by the cycle a jump started from and its attempt; fields of `jump_check.Check`."""
    return {(e["cycle"], e["attempt"]): e for e in events if e["event"] == CHECK}


def band_of_run(track: Track) -> Band | None:
    """Settlement where the run stands, with its band; None for a run without a tolerance."""
    if not decisions_of(track.events) or not len(track.history.cycle):
        return None
    held = [check for check in checks_of(track.events).values() if check["accepted"]]
    return band_of(int(track.history.cycle[-1]), float(track.history.settlement[-1]), held)
