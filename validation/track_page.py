"""The page on the small track, written from its records.

    trackbed validate track --json validation/results/track.json    the record of 20 grains
    python -m validation.track_small SCENE                          what 300 grains cost
    python -m validation.track_page                                 writes docs/qdem-track.md

The words are in ``track_page.md`` beside this file; every figure in them is looked up, as
``[[how the check's name begins | format]]``.  A test holds the page to the records.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from validation.qdem_contact_page import FIGURE, figure_of, table_of

ROOT = Path(__file__).parents[1]
WORDS = Path(__file__).with_suffix(".md")
RECORD = ROOT / "validation" / "results" / "track.json"
SMALL = ROOT / "validation" / "results" / "track-small.json"
PAGE = ROOT / "docs" / "qdem-track.md"


def record_read(path: Path = RECORD) -> dict[str, Any]:
    """A committed record."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def small_text(record: dict[str, Any]) -> str:
    """What the track of 300 grains costs."""
    lines = [
        "## 300 grains",
        f"`{record['command']}`, one thread, {record['machine']}, {record['started'][:10]}: "
        f"{record['elements']:,} elements, {record['nodes']:,} nodes, a step of "
        f"{1e6 * record['step']:.3g} µs.  {record['state']}",
        "",
        "| what | measured |",
        "|---|---|",
        f"| processor time of a step | {1e6 * record['seconds_a_step']:.0f} µs |",
        f"| million elements a second | {record['mels']:.3g} |",
        f"| processor seconds a simulated second | {record['cpu_a_second']:.0f} |",
        f"| one bogie, {record['duration']:g} s, by that, with the account of energies | "
        f"{record['bogie_cpu'] / 60:.0f} min of one core |",
    ]
    for stage, rest in record["rests"].items():
        lines.append(
            f"| preparation, stage {stage}: processor time, steps | {rest['cpu_s']:.0f} s, "
            f"{rest['steps']:,} |"
        )
    return "\n".join([*lines, ""])


def page_text(record: dict[str, Any], small: dict[str, Any] | None) -> str:
    """The page for the records."""
    checks = record["checks"]
    text = WORDS.read_text(encoding="utf-8")
    text = FIGURE.sub(lambda found: figure_of(checks, *found.groups()), text)
    origin = record["provenance"]
    made = f"`{origin['command']}` on {origin['machine']}, {origin['started'][:10]}."
    text = text.replace("[[table]]", table_of(checks)).replace("[[made]]", made)
    return text.replace("[[small]]", "" if small is None else small_text(small))


if __name__ == "__main__":
    small = record_read(SMALL) if SMALL.exists() else None
    PAGE.write_text(page_text(record_read(), small), encoding="utf-8")
