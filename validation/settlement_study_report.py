"""The settlement study's verdict as one HTML file: every bar, and work against precision."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

from adapters.report_html import bullets, page, paragraph, picture, plain, section, table
from adapters.run_folder import write_atomically
from validation.case import Check, checks_told
from validation.settlement_rivals_picture import draw
from validation.settlement_rivals_studies import STUDIES
from validation.settlement_study import SECTIONS, Section
from validation.settlement_study_beds import chosen_told
from validation.settlement_study_pareto import HEAD_PARETO, pareto_of

HEAD = ("bar", "value", "asked", "", "page", "why it is missed")
WORDS = frozenset({0, 3, 4, 5})
"""Columns of text."""
PAGES = {
    "paper-figures": "the paper's figures from our runs",
    "paper-convergence": "its convergence in k and h",
    "moves": "what to move",
    "jump-history": "the settlement of a jump from all cycles",
}
"""Pages of the study without a bar."""


def report_write(path: Path, checks: Sequence[Check], provenance: dict[str, Any]) -> None:
    """Write ``path``, all pictures inside of it.

    ``checks``: those of the study in the order of its sections, and others, which come last.
    """
    write_atomically(path, page("The settlement study", body(checks, provenance)))


def body(checks: Sequence[Check], provenance: dict[str, Any]) -> Iterator[str]:
    """What stands on the page."""
    yield "<h1>The settlement study</h1>"
    yield paragraph(escape(checks_told(checks)), "claim")
    yield paragraph(
        f"Ways that are judged, chosen with the record in sight: {escape(chosen_told())}. "
        "Values are read from the records of the repository by the functions that make its pages."
    )
    left = list(checks)
    for part in SECTIONS:
        mine = [check for check in left if check.section == part.title]
        left = [check for check in left if check.section != part.title]
        yield section(part.title, *section_body(part, mine))
    if left:
        yield section("Run now, on an engine", checks_table(left))
    yield section(
        "Without a bar",
        bullets(f"{escape(what)}: docs/{name}.md" for name, what in PAGES.items()),
    )
    command, commit = (escape(str(provenance.get(key, ""))) for key in ("command", "commit"))
    yield paragraph(f"<code>{command}</code>, commit {commit}", "scene")


def section_body(part: Section, checks: Sequence[Check]) -> Iterator[str]:
    """Bars of a section; beside them work against precision, where its record is here."""
    if checks:
        yield checks_table(checks)
    for name in part.studies:
        if STUDIES[name].record.exists():
            yield work_precision(name)


def checks_table(checks: Sequence[Check]) -> str:
    """A line a check."""
    rows = [
        [
            escape(check.name), f"{plain(check.value, '.4g')} {escape(check.unit)}".rstrip(),
            escape(check.asked), f'<span class="{"yes" if check.holds else "no"}">'
            f"{check.verdict}</span>", escape(check.page), escape(check.why),
        ]
        for check in checks
    ]  # fmt: skip
    return table("", HEAD, rows, words=WORDS)


def work_precision(name: str) -> str:
    """Errors of a study's ways against their whole cost, and which of them no other beats."""
    study = STUDIES[name]
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"{name}.png"
        draw(name, target)
        drawn = picture(
            target,
            f"error against CPU time, {name}",
            f"{escape(study.kind.title)}, to cycle {study.last:,}: errors against all CPU time "
            "behind k<sub>i</sub>. Grey, dashed: what chaos alone makes. Bars: 95 % over packings.",
        )
    best = table(
        "Ways that no other beats in bias over the total settlement and gained time; laws leave no "
        "bed",
        HEAD_PARETO[1:],
        ([escape(cell) for cell in line] for line in pareto_of(name)),
    )
    return drawn + best
