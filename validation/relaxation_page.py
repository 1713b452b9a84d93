"""docs/relaxation.md and its picture, from validation/results/relaxation.jsonl.

python -m validation.relaxation_page
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.page_text import page_filled
from validation.relaxation_beds import AFTER
from validation.relaxation_picture import draw
from validation.relaxation_reading import (
    BED_TITLES,
    TITLES,
    Ways,
    by_way,
    excess,
    gained,
    gained_met,
    of_answers,
    point_carried,
    refused,
    values,
)
from validation.relaxation_runs import Row, record_read
from validation.same_packing_page import table
from validation.student import interval

PAGE = Path(__file__).parents[1] / "docs" / "relaxation.md"
TEXT = Path(__file__).with_suffix(".md")
NONE = "-"


def number(value: float, digits: int = 3) -> str:
    """Few digits, without an exponent from a hundredth to a million."""
    if value == 0 or not np.isfinite(value):
        return "0" if value == 0 else NONE
    if 1e-2 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
        return f"{value:,.{decimals}f}"
    return f"{value:.{digits - 1}e}"


def told(found: FloatArray, factor: float = 1.0, decimals: int = 1, sign: bool = False) -> str:
    """Mean with its 95 % interval over the beds."""
    if not len(found):
        return NONE
    mean, half = interval(factor * found)
    text = f"{mean:+.{decimals}f}" if sign else f"{mean:.{decimals}f}"
    return text if half != half else f"{text} ± {half:.{decimals}f}"


def median(points: Sequence[Row], key: str, factor: float = 1.0, digits: int = 3) -> str:
    """Median of a figure over jumps."""
    return number(factor * float(np.median(values(points, key))), digits)


def table_paper(ways: Ways) -> str:
    """Each way where overlaps are back to those before, and where it ended; medians over jumps."""
    rows = []
    for way, title in TITLES.items():
        beds = ways.get(way, {})
        reached = [p for bed in beds if (p := point_carried(ways, way, bed)) is not None]
        cells = [f"{len(reached)} of {len(beds)}"]
        for key, factor in (("cpu_s", 1.0), ("coordination_error", 100.0), ("kept", 100.0)):
            cells.append(median(reached, key, factor, 2) if reached else NONE)
        ends = [row["points"][-1] for row in beds.values()]
        for key, factor in (
            ("cpu_s", 1.0),
            ("overlap", 1e6),
            ("coordination_error", 100.0),
            ("height", 1e6),
            ("move_median", 1e6),
        ):
            cells.append(median(ends, key, factor, 2))
        rows.append([title, *cells])
    head = ["way", "overlaps back in", "CPU s", "contacts, %", "kept, %"]
    return table(
        [
            *head,
            "at its end: CPU s",
            "greatest overlap, µm",
            "contacts, %",
            "height, µm",
            "median move, µm",
        ],
        rows,
    )


def table_jumps(ways: Ways) -> str:
    """The jumps at paper scale."""
    rows = []
    for bed, row in ways["before"].items():
        before, estimate = row["points"][0], ways["estimate"][bed]["points"][0]
        run, cycle, h = bed.rsplit("-", 2)
        rows.append(
            [
                f"`{run}`, {cycle} + {h}",
                number(1e6 * before["settlement"], 2),
                number(1e6 * before["overlap"], 2),
                number(before["coordination"]),
                number(1e6 * estimate["overlap"], 2),
                number(estimate["coordination"]),
                number(100 * estimate["kept"], 2),
            ]
        )
    head = ["run, cycle + h", "settlement of the jump, µm", "greatest overlap before, µm"]
    head += ["contacts a grain before", "overlap estimated, µm", "contacts estimated", "kept, %"]
    return table(head, rows)


def table_engines(ways: Ways) -> str:
    """What the engines' own minimisers say, at the first jump."""
    rows = []
    for way, beds in ways.items():
        if not way.startswith("minimize "):
            continue
        row = next(iter(beds.values()))
        _, engine, style = way.split(" ")
        name = {"liggghts": "LIGGGHTS 3.8.0", "lammps": "LAMMPS 22 Jul 2025"}[engine]
        moved = number(1e6 * row["move_greatest"], 2) if "move_greatest" in row else NONE
        overlap = number(1e6 * row["overlap"], 2) if "overlap" in row else NONE
        rows.append([name, f"`{style}`", f"`{row['says'].strip()}`", moved, overlap])
    head = ["engine", "`min_style`", "says", "greatest move, µm", "greatest overlap, µm"]
    return table(head, rows)


def table_relaxed(ways: Ways) -> str:
    """Live beds: cost and geometry of what each way left."""
    rows = []
    for way, title in BED_TITLES.items():
        beds = [row for row in ways.get(way, {}).values() if "overlap" in row]
        failed = refused(ways, way)
        if not beds:
            continue
        rows.append(
            [
                title,
                number(float(np.median(values(beds, "cpu_s"))), 2),
                number(1e6 * float(np.median(values(beds, "overlap"))), 2),
                told(values(beds, "coordination_error"), 100, 1, sign=True),
                told(values(beds, "height"), 1e6, 1, sign=True),
                number(1e6 * float(np.median(values(beds, "move_median"))), 2),
                f"{len(failed)} of {len(ways[way])}",
            ]
        )
    head = ["way", "CPU s", "greatest overlap, µm", "contacts, %", "height, µm", "median move, µm"]
    return table([*head, "engine refuses"], rows)


def table_history(ways: Ways) -> str:
    """Live beds: what became of the tangential forces."""
    rows = []
    for way, title in BED_TITLES.items():
        if not len(of_answers(ways, way, "pairs_kept")):
            continue
        cells = [
            told(of_answers(ways, way, key), 100, 0)
            for key in ("pairs_kept", "tangential_start", "tangential_first", "normal_start")
        ]
        rows.append([title, *cells])
    head = ["way", "pairs still in touch, %", "tangential force at the restart, %"]
    return table([*head, "after the first cycle, %", "normal force at the restart, %"], rows)


def table_answers(ways: Ways) -> str:
    """Live beds: ten cycles behind each way, beside the full run's at the same place."""

    def line(title: str, cells: Sequence[str], count: int) -> list[str]:
        return [title, *cells, str(count)]

    met = [row["met"] for row in ways["base"].values()]
    full = [
        NONE,
        told(gained_met(ways, 0, 1), 1e6),
        told(gained_met(ways, 1, AFTER), 1e6),
        told(100 * (values_at(met, "peak_force", 0) - 1), 1, 1, sign=True),
        told(values_at(met, "coordination", 1), 1, 2),
        told(values_at(met, "coordination", AFTER), 1, 2),
        told(1e-6 * values_at(met, "stiffness", 0), 1, 3),
    ]
    rows = [line("full run, behind cycle kᵢ + h", full, len(met))]
    for way, title in BED_TITLES.items():
        found = of_answers(ways, way, "peak_force", 0)
        if not len(found):
            continue
        cells = [
            NONE if way == "resubmitted" else told(excess(ways, way), 1e6, 0, sign=True),
            told(gained(ways, way, 0, 1), 1e6),
            told(gained(ways, way, 1, AFTER), 1e6),
            told(100 * (found - 1), 1, 1, sign=True),
            told(of_answers(ways, way, "coordination", 1), 1, 2),
            told(of_answers(ways, way, "coordination", AFTER), 1, 2),
            told(1e-6 * of_answers(ways, way, "stiffness", 0), 1, 3),
        ]
        rows.append(line(title, cells, len(found)))
    head = ["way", "settlement at the end less the full run's, µm", "in the first cycle, µm"]
    head += ["in cycles 2 to 10, µm", "peak force of the first cycle, %"]
    head += ["contacts a grain after 1", "after 10", "piston stiffness, first cycle, N/µm", "beds"]
    return table(head, rows)


def values_at(found: Sequence[Row], key: str, index: int) -> FloatArray:
    """An entry of a list of several answers, shape (answers,)."""
    return np.array([row[key][index] for row in found])


def refusals(ways: Ways) -> str:
    """Ways that an engine or a check refused, with the first reason."""
    lines = []
    for way, title in BED_TITLES.items():
        failed = refused(ways, way)
        if failed:
            lines.append(f"* {title}, {len(failed)} of {len(ways[way])}: {failed[0]}")
    return "\n".join(lines) if lines else "None."


def page(rows: Sequence[Row]) -> str:
    """The page of a record."""
    paper, beds = by_way(rows, "paper"), by_way(rows, "bed")
    parts = {
        "TABLE_JUMPS": table_jumps(paper),
        "TABLE_PAPER": table_paper(paper),
        "TABLE_ENGINES": table_engines(paper),
        "TABLE_RELAXED": table_relaxed(beds),
        "TABLE_HISTORY": table_history(beds),
        "TABLE_ANSWERS": table_answers(beds),
        "REFUSALS": refusals(beds),
        "BEDS": str(len(beds["base"])),
        "COMMITS": ", ".join(dict.fromkeys(row["commit"] for row in rows)),
        "MACHINES": "; ".join(dict.fromkeys(row["machine"] for row in rows)),
    }
    return page_filled(TEXT.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    rows = record_read()
    write_atomically(PAGE, page(rows))
    draw(rows, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
