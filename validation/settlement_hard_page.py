"""docs/settlement-hard-cases.md, from validation/results/settlement-hard-cases.jsonl.

python -m validation.settlement_hard_page
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adapters.run_folder import write_atomically
from validation.page_text import page_filled
from validation.same_packing_page import table
from validation.settlement_hard_runs import Row, record_read
from validation.settlement_hard_scenes import case_named

PAGE = Path(__file__).parents[1] / "docs" / "settlement-hard-cases.md"
TEXT = Path(__file__).with_suffix(".md")


def number(value: float) -> str:
    """Four digits."""
    return f"{value:.4g}"


def outcome(row: Row) -> str:
    """What happened, in words."""
    if row["code"]:
        return f"refused, exit code {row['code']}"
    settlement, cycle = row["figures"]["settlement"], row["figures"]["cycle"]
    return f"{1e6 * settlement[-1]:.1f} µm after {cycle[-1]} cycles"


def failing(row: Row) -> list[str]:
    """Names of the checks of a case that do not hold."""
    return [check["name"] for check in row["checks"] if not check["ok"]]


def verdict(row: Row) -> str:
    """Whether every check of a case holds."""
    names = failing(row)
    return "right" if not names else "**not right: " + "; ".join(names) + "**"


def table_cases(rows: Sequence[Row]) -> str:
    """Every case: what makes it hard, what happened, whether that is right."""
    lines = []
    for row in rows:
        case = case_named(row["name"])
        lines.append(
            [f"`{row['name']}`", case.title, outcome(row), verdict(row), f"{row['cpu_s']:.0f}"]
        )
    return table(["case", "what is hard", "what happened", "that is", "CPU s"], lines)


def table_checks(rows: Sequence[Row]) -> str:
    """Every check behind the exit code's."""
    lines = [
        [
            f"`{row['name']}`",
            check["name"],
            f"{number(check['value'])} {check['unit']}".strip(),
            f"{check['bar']} {check['unit']}".strip(),
            "holds" if check["ok"] else "**fails**",
        ]
        for row in rows
        for check in row["checks"][1:]
        if not row["code"]
    ]
    return table(["case", "check", "value", "bar", ""], lines)


def refusals(rows: Sequence[Row]) -> str:
    """What each refusal says."""
    return "\n".join(
        f"* `{row['name']}`, exit code {row['code']}: {row['says']}" for row in rows if row["code"]
    )


def table_packings(rows: Sequence[Row]) -> str:
    """Beds after the rain: friction orders densities and contacts."""
    lines = [
        [
            f"`{row['name']}`",
            f"{row['figures']['density']:.4f}",
            f"{row['figures']['contacts']:.2f}",
        ]
        for row in rows
        if not row["code"]
    ]
    return table(["case", "relative density after the rain", "contacts over grains"], lines)


def not_right(rows: Sequence[Row]) -> str:
    """Cases whose jump loses contacts, beside how these come and go in the cycles computed."""
    lines = []
    for row in rows:
        for check in row["checks"]:
            if not check["ok"]:
                cycles = np.diff([0, *row["figures"]["cycle"]])
                computed = np.array(row["figures"]["coordination"])[cycles == 1]
                low, high = computed.min(), computed.max()
                lines.append(
                    f"* `{row['name']}`: {check['name']} {number(check['value'])}, where"
                    f" {check['bar']} is asked. At the ends of its cycles the coordination number"
                    f" is {low:.2f} to {high:.2f}."
                )
    return "\n".join(lines)


def page(rows: Sequence[Row]) -> str:
    """The page of a record."""
    parts = {
        "TABLE_CASES": table_cases(rows),
        "REFUSALS": refusals(rows),
        "TABLE_CHECKS": table_checks(rows),
        "TABLE_PACKINGS": table_packings(rows),
        "NOT_RIGHT": not_right(rows),
        "COMMITS": ", ".join(dict.fromkeys(row["commit"] for row in rows)),
        "MACHINES": "; ".join(dict.fromkeys(row["machine"] for row in rows)),
    }
    return page_filled(TEXT.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write the page."""
    write_atomically(PAGE, page(record_read()))


if __name__ == "__main__":
    main()
