"""The page on the small track, written from its records.

    trackbed validate track --json validation/results/track.json    the record of 20 grains
    python -m validation.track_small SCENE                          what 300 grains cost
    python -m validation.track_bogie SCENE RUN                      what a bogie does to them
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
BOGIE = ROOT / "validation" / "results" / "track-bogie.json"
PAGE = ROOT / "docs" / "qdem-track.md"


def record_read(path: Path = RECORD) -> dict[str, Any]:
    """A committed record."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def records() -> tuple[dict[str, Any], dict[str, Any] | None, dict[str, Any] | None]:
    """The record of 20 grains, and those of 300 where they were made."""
    small, bogie = (record_read(path) if path.exists() else None for path in (SMALL, BOGIE))
    return record_read(), small, bogie


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


def bogie_text(record: dict[str, Any]) -> str:
    """What one bogie does to 300 grains, a column a run."""
    runs = list(record["runs"].values())
    first = runs[0]

    def row(what: str, *cells: str) -> str:
        return f"| {what} | {' | '.join(cells)} |"

    def peaks(found: list[float]) -> str:
        return ", ".join(f"{one:.0f}" for one in sorted(found))

    lines = [
        f"`{record['command']}`, {record['machine']}, {record['started'][:10]}.  The greatest load "
        f"on the slice is {first['load_greatest'] / 1e3:.2g} kN; the axles are on the sleeper at "
        + " and ".join(f"{when:.3f} s" for when in first["axles"]) + ".",
        "",
        row("quantity", *(f"friction {run['friction']:g}" for run in runs)),
        row("---", *("---" for _ in runs)),
    ]  # fmt: skip
    for name in first["points"]:
        for number, axle in enumerate(("first", "second")):
            for key, told in (("greatest", "greatest"), ("end", "behind it")):
                cells = [run["points"][name]["passages"][number][key] for run in runs]
                what = f"settlement of {name}, {axle} axle, {told} [mm]"
                lines.append(row(what, *(f"{1e3 * cell:.3g}" for cell in cells)))
        cells = [run["points"][name]["lateral_over_vertical"] for run in runs]
        what = f"lateral over vertical motion of {name}, greatest"
        lines.append(row(what, *(f"{cell:.2g}" for cell in cells)))
    for kind, told in (("spectra", "acceleration"), ("mobility", "mobility")):
        for name in first[kind]:
            what = f"peaks of the {told} of {name} [Hz]"
            lines.append(row(what, *(peaks(run[kind][name]) for run in runs)))
    lines += [
        row("missing in the account of energies",
            *(f"{run['energy']['relative_imbalance']:.1e}" for run in runs)),
        *(
            row(f"{key} over the work of load and weight",
                *(f"{run['energy'][key] / run['energy']['external']:.3f}" for run in runs))
            for key in ("friction", "viscous")
        ),
        row("step", *(f"{1e6 * run['step']:.3g} µs" for run in runs)),
        row("number of steps", *(f"{run['steps']:,}" for run in runs)),
        row("threads", *(f"{run['threads']}" for run in runs)),
        *(
            row(f"{told} time", *(f"{run['cost'][key]:.0f} s" for run in runs))
            for told, key in (("processor", "cpu_s"), ("wall", "wall_s"))
        ),
    ]  # fmt: skip
    return "\n".join([*lines, ""])


def page_text(
    record: dict[str, Any], small: dict[str, Any] | None, bogie: dict[str, Any] | None
) -> str:
    """The page for the records."""
    checks = record["checks"]
    text = WORDS.read_text(encoding="utf-8")
    text = FIGURE.sub(lambda found: figure_of(checks, *found.groups()), text)
    origin = record["provenance"]
    made = f"`{origin['command']}` on {origin['machine']}, {origin['started'][:10]}."
    text = text.replace("[[table]]", table_of(checks)).replace("[[made]]", made)
    text = text.replace("[[small]]", "" if small is None else small_text(small))
    return text.replace("[[bogie]]", "It was not run." if bogie is None else bogie_text(bogie))


if __name__ == "__main__":
    PAGE.write_text(page_text(*records()), encoding="utf-8")
