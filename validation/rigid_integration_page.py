"""docs/rigid-integration.md from validation/results/rigid-integration.jsonl, and that record.

    python -m validation.rigid_integration_page --run [--quick] [--only TABLE ...]    measure too
    python -m validation.rigid_integration_page                                       the page only

Tables are those of `validation.rigid_integration.TABLES`; lines of others are kept.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import groupby
from math import nan
from pathlib import Path
from typing import Any

from adapters.run_folder import write_atomically
from validation.page_text import page_filled
from validation.rigid_integration import TABLES, Data, record_make, record_read
from validation.rigid_integration_order import PROBLEMS, OrderRow, order_fitted
from validation.rigid_integration_picture import picture_draw
from validation.rigid_integration_zeno import cut_off

PAGE = Path(__file__).parents[1] / "docs" / "rigid-integration.md"
TEXT = Path(__file__).with_suffix(".md")
NONE = "-"


def number(value: float | None) -> str:
    """Two digits; a dash for none."""
    return NONE if value is None else f"{value:.2g}"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def of_table(lines: Sequence[Data], name: str) -> list[Data]:
    """The lines of one table that hold a measured value."""
    return [line for line in lines if line["table"] == name]


def order_of(rows: Sequence[Data]) -> float:
    """`order_fitted` of a method's lines."""
    return order_fitted([
        OrderRow(r["problem"], r["method"], r["step"], r["error"], nan, 0)
        for r in rows if r["error"] is not None
    ])  # fmt: skip


def table_order(lines: Sequence[Data]) -> str:
    """A row a method of a problem: errors by step, their order, the cost at the shortest."""
    rows = []
    answers = {problem.name: problem.answer for problem in PROBLEMS}
    ran = [line for line in of_table(lines, "order") if line["error"] is not None]
    for (problem, method), group in groupby(ran, lambda line: (line["problem"], line["method"])):
        mine = list(group)
        order = order_of(mine)
        rows.append([
            f"{problem} ({answers[problem]})" if method == "acceleration" else "", method,
            ", ".join(f"{number(1e3 * line['step'])}: {number(line['error'])}" for line in mine),
            NONE if order != order else f"{order:.1f}", number(mine[-1]["cpu_s"]),
        ])  # fmt: skip
    head = ["motion (answer)", "method", "step, ms: error", "order", "CPU s of the last"]
    return table(head, rows)


def table_equal_error(lines: Sequence[Data]) -> str:
    """The cheapest run of each method that is within some errors, by problem: CPU ms."""
    bars = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
    rows = []
    ran = [line for line in of_table(lines, "order") if line["error"] is not None]
    for (problem, method), group in groupby(ran, lambda line: (line["problem"], line["method"])):
        mine = list(group)
        costs = [
            min((1e3 * line["cpu_s"] for line in mine if line["error"] <= bar), default=None)
            for bar in bars
        ]
        first = problem if method == "acceleration" else ""
        rows.append([first, method, *(number(cost) for cost in costs)])
    return table(["motion", "method", *(f"{bar:.0e}" for bar in bars)], rows)


def table_trace(lines: Sequence[Data]) -> str:
    """Steps tried, kept, collisions, cost of both ways to meet a collision."""
    rows = []
    for line in of_table(lines, "trace"):
        kept = [length for _, length, was_kept in line["steps"] if was_kept]
        rows.append([
            line["way"], str(len(line["steps"])), str(len(kept)), str(line["collisions"]),
            number(min(kept)), number(line["overlap"]), number(line["cpu_s"]),
        ])  # fmt: skip
    head = ["way", "steps tried", "kept", "collisions", "shortest, s", "overlap", "CPU s"]
    return table(head, rows)


def table_drift(lines: Sequence[Data]) -> str:
    """Gaps of a contact that never opens."""
    rows = []
    for line in of_table(lines, "drift"):
        rows.append([
            line["scene"], line["method"], number(1e3 * line["step"]), f"{line['rounds']:.3g}",
            str(line["steps"]), "on" if line["control"] else "off", number(line["gap"][0]),
            number(line["gap"][-1]), number(line["speed"]), number(line["cpu_s"]),
        ])  # fmt: skip
    head = ["scene", "method", "step, ms", "rounds", "steps", "control", "gap, first tenth",
            "gap, whole run", "speed off", "CPU s"]  # fmt: skip
    return table(head, rows)


def table_rows(lines: Sequence[Data], name: str) -> str:
    """Rows with a bar; the case is told once, a miss is bold, who did not run is left out."""
    rows, before = [], None
    for line in of_table(lines, name):
        if line["peer"] and not line["steps"]:
            continue
        key = (line["case"], line["answer"], line["measure"], line["bar"])
        reported = "inf" in line["bar"]
        bar = "reported" if reported else line["bar"]
        first = ["", "", ""] if key == before else [key[0], key[1], f"{key[2]} {bar}"]
        value = number(line["value"])
        value = value if line["ok"] or reported else f"**{value}**"
        cells = [*first, line["method"], value, line["why"], number(line["cpu_s"])]
        rows.append([cell.replace("|", "\\|") for cell in cells])
        before = key
    return table(["case", "answer", "bar", "engine", "measured", "note", "CPU s"], rows)


def table_zeno(lines: Sequence[Data]) -> str:
    """Time to rest of a bouncing disc."""
    rows = []
    for line in of_table(lines, "zeno"):
        if line["rest"] is None and line["peer"] and not line["steps"]:
            continue
        rows.append([
            f"{line['restitution']:g}", line["method"], number(1e3 * line["step"]),
            NONE if line["rest"] is None else f"{line['rest']:.5f}", number(line["error"]),
            str(line["collisions"]) if line["method"] == "acceleration" else NONE,
            str(line["steps"]), number(line["cpu_s"]),
        ])  # fmt: skip
    head = ["e", "method", "step, ms", "at rest after, s", "error", "bounces met", "steps", "CPU s"]
    return table(head, rows)


def absent(lines: Sequence[Data]) -> str:
    """Who did not run on what, and why; each reason once."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for line in lines:
        if line.get("peer") and not line["steps"]:
            case = line.get("case") or line.get("problem") or f"bounces, e = {line['restitution']}"
            cases = reasons.setdefault((line["method"], line["why"]), [])
            if case not in cases:
                cases.append(case)
    return "\n".join(
        f"* {method}: {why} ({'; '.join(cases)})" for (method, why), cases in reasons.items()
    )


def misses(lines: Sequence[Data]) -> str:
    """Rows of ours that miss their bar, or a sentence that none does."""
    missed = [
        f"* {line['case']}, {line['method']}: {line['measure']} {number(line['value'])} against "
        f"{line['bar']}; {line['why']}"
        for line in of_table(lines, "law") + of_table(lines, "impact")
        if not (line["peer"] or line["ok"] or "inf" in line["bar"])
    ]
    return "\n".join(missed) or "None of the rows with a bar."


def page(lines: Sequence[Data]) -> str:
    """The page as Markdown: the text, with its tables filled in."""
    commits = ", ".join(sorted({line["commit"][:9] for line in lines}))
    laws = of_table(lines, "law")
    kane = next(line for line in laws if "unwatched" in line["case"])
    filled = {
        "COMMITS": commits, "MACHINE": lines[0]["machine"], "TABLE_ORDER": table_order(lines),
        "TABLE_COST": table_equal_error(lines), "TABLE_TRACE": table_trace(lines),
        "TABLE_DRIFT": table_drift(lines), "TABLE_LAW": table_rows(lines, "law"),
        "TABLE_IMPACT": table_rows(lines, "impact"), "TABLE_ZENO": table_zeno(lines),
        "CUT_HALF": f"{cut_off(0.1, 0.5):.1e}", "CUT_NINE": f"{cut_off(0.1, 0.9):.1e}",
        "KANE": number(kane["value"]), "ABSENT": absent(lines), "MISSES": misses(lines),
    }  # fmt: skip
    return page_filled(TEXT.read_text(encoding="utf-8"), filled)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line; measure if asked to; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--run", action="store_true", help="measure first, and write the record")
    parser.add_argument("--quick", action="store_true", help="fewer and shorter runs")
    parser.add_argument("--only", nargs="+", choices=tuple(TABLES), default=[], metavar="TABLE")
    arguments = parser.parse_args(words)
    if arguments.run:
        record_make(arguments.quick, arguments.only)
    lines: list[dict[str, Any]] = record_read()
    write_atomically(PAGE, page(lines))
    picture_draw(lines, PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
