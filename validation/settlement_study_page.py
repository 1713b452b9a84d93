"""docs/settlement-study.md, every bar of the study: ``python -m validation.settlement_study_page``.

The page is ``settlement_study_page.md`` beside this file with tables put in.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from adapters.run_folder import write_atomically
from validation.case import Check, checks_told
from validation.page_text import page_filled, table
from validation.settlement_study import WORSE, Section, study_checks
from validation.settlement_study_beds import chosen_told
from validation.settlement_study_pareto import HEAD_PARETO, pareto_of

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "settlement-study.md"


def table_checks(checks: Sequence[Check]) -> str:
    """A line a check; why a bar is missed behind its verdict."""
    lines = [
        [
            check.name, f"{check.value:.4g} {check.unit}".rstrip(), check.asked,
            check.verdict if check.holds else f"**{check.verdict}**: {check.why}".rstrip(": "),
        ]
        for check in checks
    ]  # fmt: skip
    return table(["bar", "value", "asked", ""], lines)


def section_told(section: Section, checks: Sequence[Check]) -> str:
    """A section with its pages and its table."""
    names = dict.fromkeys(Path(check.page).name for check in checks if check.page)
    pages = ", ".join(f"[{name}]({name})" for name in names)
    return f"## {section.title}\n{pages}\n\n{table_checks(checks)}\n"


def page(judged: Sequence[tuple[Section, Sequence[Check]]]) -> str:
    """The page of a study."""
    every = [check for _, checks in judged for check in checks]
    names = dict.fromkeys(name for section, _ in judged for name in section.studies)
    lines = [[name, *one] for name in names for one in pareto_of(name)]
    parts = {
        "TOLD": checks_told(every),
        "CHOSEN": chosen_told(),
        "WORSE": f"{100 * WORSE:.0f}",
        "SECTIONS": "\n".join(section_told(*one) for one in judged),
        "PARETO": table(HEAD_PARETO, lines),
    }
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write the page."""
    write_atomically(PAGE, page(study_checks()))


if __name__ == "__main__":
    main()
