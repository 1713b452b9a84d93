"""The page on the small track, written from its records.

    trackbed validate track --json validation/results/track.json    the record of 20 grains
    python -m validation.track_small SCENE                          what 300 grains cost
    python -m validation.track_stand SCENE [SCENE ...]              whether prepared beds stand
    python -m validation.track_bogie SCENE RUN                      what a bogie does to them
    python -m validation.track_rolling                              what rough rails add to its load
    python -m validation.track_packings RUN RUN RUN                 it on several packings
    python -m validation.track_page                                 writes docs/qdem-track.md

The words are in ``track_page.md`` beside this file; every figure in them is looked up, as
``[[how the check's name begins | format]]``.  A test holds the page to the records.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.qdem_contact_page import FIGURE, figure_of, table_of
from validation.track_packings import PACKINGS, packings_text
from validation.track_rolling import ROLLING, rolling_text

ROOT = Path(__file__).parents[1]
WORDS = Path(__file__).with_suffix(".md")
RECORD = ROOT / "validation" / "results" / "track.json"
SMALL = ROOT / "validation" / "results" / "track-small.json"
BOGIE = ROOT / "validation" / "results" / "track-bogie.json"
STAND = ROOT / "validation" / "results" / "track-stand.json"
PAGE = ROOT / "docs" / "qdem-track.md"


def record_read(path: Path = RECORD) -> dict[str, Any]:
    """A committed record."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def stand_text(record: dict[str, Any]) -> str:
    """How beds stand without their load."""
    lines = [
        f"`{record['command']}`, {record['machine']}, {record['started'][:10]}: "
        f"{1e3 * record['time']:g} ms without the load.",
        "",
        "| friction: prepared with, let go with | pairs that touch | friction in use, median | "
        "pairs at Coulomb's limit | sinking of the sleeper | sliders' work over springs' energy |",
        "|---|---|---|---|---|---|",
    ]
    for bed in record["beds"].values():
        used = bed["mobilised"]
        lines.append(
            f"| {bed['prepared_friction']:g}, {bed['friction']:g} | {used['pairs']:.0f} | "
            f"{used['median']:.2f} | {used['at_limit']:.2f} | {1e9 * bed['sinking']:.0f} nm | "
            f"{bed['slid'] / bed['elastic']:.2g} |"
        )
    return "\n".join([*lines, ""])


def small_text(record: dict[str, Any]) -> str:
    """What the track of 300 grains costs."""
    steps = record["duration"] / record["step"]
    wall, spent = record["wall_a_step"], record["cpu_a_step"]
    lines = [
        f"`{record['command']}`, {record['machine']}, {record['started'][:10]}: "
        f"{record['elements']:,} elements, {record['nodes']:,} nodes.  A step of "
        f"{1e6 * record['step']:.3g} µs with contacts near; {1e6 * record['step_three']:.3g} µs "
        f"with three contacts of a vertex, {1e6 * record['step_elements']:.3g} µs without contact.",
        "",
        "| what | measured |",
        "|---|---|",
        f"| a step on one thread, the account within: wall, processor time | "
        f"{1e6 * wall['1']:.0f} µs, {1e6 * spent['1']:.0f} µs |",
        f"| a step on two threads: wall time | {1e6 * wall['2']:.0f} µs |",
        f"| the same bits on one thread and on two | {'yes' if record['same_bits'] else 'no'} |",
        f"| million elements a second, one thread | {record['elements'] / spent['1'] / 1e6:.3g} |",
        *(
            f"| {name}: processor time | {1e6 * one:.0f} µs |"
            for name, one in record["parts"].items()
        ),
        f"| one bogie, {record['duration']:g} s, by that | "
        f"{steps * spent['1'] / 60:.0f} min of one core, {steps * wall['2'] / 60:.0f} of two |",
        *(
            f"| preparation, stage {stage}: processor time, steps | {rest['cpu_s']:.0f} s, "
            f"{rest['steps']:,} |"
            for stage, rest in record["rests"].items()
        ),
    ]
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
                what = f"settlement of {name}, {axle} axle, {told} [µm]"
                lines.append(row(what, *(f"{1e6 * cell:.3g}" for cell in cells)))
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


OF_300: dict[str, tuple[Path, Callable[[dict[str, Any]], str]]] = {
    "stand": (STAND, stand_text),
    "small": (SMALL, small_text),
    "bogie": (BOGIE, bogie_text),
    "rolling": (ROLLING, rolling_text),
    "packings": (PACKINGS, packings_text),
}
"""Records of 300 grains and what tells them, by their place in the words."""


def records() -> dict[str, dict[str, Any]]:
    """The record of 20 grains, and those of 300 as far as they were made."""
    paths = {"track": RECORD} | {name: path for name, (path, _) in OF_300.items()}
    return {name: record_read(path) for name, path in paths.items() if path.exists()}


def page_text(found: dict[str, dict[str, Any]]) -> str:
    """The page for the records."""
    record = found["track"]
    checks = record["checks"]
    text = WORDS.read_text(encoding="utf-8")
    text = FIGURE.sub(lambda found: figure_of(checks, *found.groups()), text)
    origin = record["provenance"]
    made = f"`{origin['command']}` on {origin['machine']}, {origin['started'][:10]}."
    text = text.replace("[[table]]", table_of(checks)).replace("[[made]]", made)
    for name, (_, told) in OF_300.items():
        text = text.replace(f"[[{name}]]", told(found[name]) if name in found else "Not measured.")
    return text


if __name__ == "__main__":
    PAGE.write_text(page_text(records()), encoding="utf-8")
