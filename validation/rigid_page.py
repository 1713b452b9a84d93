"""The page on the solvers of rigid contact, written from the record of `rigid_runs`.

    python -m validation.rigid_page             writes docs/rigid-solvers.md and its picture
    python -m validation.rigid_page --words     the page alone

The words are in ``rigid_page.md`` beside this file; every figure in them is looked up in that
record or in that of `rigid_examination`, and a test holds the page to them.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from validation import rigid_report as report
from validation.commit_words import commit_words
from validation.qdem_record import write_atomically
from validation.rigid_examination import OTHER_SEEDS
from validation.rigid_examination import RECORD as EXAMINATION
from validation.rigid_examination_page import (
    examination_failures,
    examination_table,
    examination_words,
    noise_words,
    seeds_words,
)
from validation.rigid_page_bars import bars_words
from validation.rigid_page_studies import (
    codes_words,
    dantzig_table,
    ladder_table,
    motion_table,
    powers,
    scale_table,
    seconds,
)
from validation.rigid_peers import SICONOS_MOST, SICONOS_SPARSE
from validation.rigid_picture import PICTURE, picture
from validation.rigid_report import HYBRID, OSQP, OURS, Row
from validation.rigid_runs import LADDER, LARGE, RECORD, rows_read

WORDS = Path(__file__).with_suffix(".md")
PAGE_PATH = Path(__file__).parents[1] / "docs" / "rigid-solvers.md"
FEW = ("stored", "test suite", "packings 2D", "packings 3D", "towers 2D", "towers 3D")
"""Families of the table problem by problem."""
UNSEEN = (
    (
        "Unseen: the stored problems changed at random",
        "q by 5 % noise, friction by factors from 0.7 to 1.3, contacts in another order.",
        "unseen",
    ),
    (
        "Unseen: packings of other seeds",
        "Discs and spheres, friction from 0.1 to 1.5; no setting was chosen by them.",
        "other packings",
    ),
)
"""Families that are summed up: title, words, how the name of the family begins."""


def page(rows: Sequence[Row]) -> str:
    """The whole page in Markdown."""
    races = report.races(rows)
    contacts = [each[0]["contacts"] for each in report.problems(races).values()]
    examined = rows_read(EXAMINATION)
    parts = {
        "count": str(len(contacts)),
        "least": f"{min(contacts):,}",
        "most": f"{max(contacts):,}",
        "asked": _asked(races),
        "summary": _summary(races),
        "bars": bars_words(rows),
        "codes": codes_words(rows),
        "tables": _problem_tables(races),
        "failures": _failures(races),
        "frictionless": _frictionless(races),
        "ladder": ladder_table(races),
        "scale": scale_table(rows),
        "motion": motion_table(rows),
        "dantzig": dantzig_table(rows),
        "examination": examination_table(examined),
        "examined": examination_words(examined),
        "unsolved": examination_failures(examined),
        "noise": noise_words(examined),
        "seeds": seeds_words(rows_read(OTHER_SEEDS)),
        "dearest": _dearest(races),
        "lemke": f"{SICONOS_MOST['2D_LEMKE']:,}",
        "dense": f"{SICONOS_MOST['2D_NSGS']:,}",
        "wide": f"{SICONOS_SPARSE:,}",
        "budgets": _budgets(races),
    }
    text = WORDS.read_text(encoding="utf-8")
    for name, words in parts.items():
        text = text.replace(f"{{{name}}}", words)
    return re.sub(r"\n{3,}", "\n\n", text)


def _asked(rows: Sequence[Row]) -> str:
    """Tolerances of small problems, and those of large ones where they are more."""
    small, large = (
        sorted(
            {row["setting"]["tolerance"] for row in rows if (row["contacts"] >= LARGE) == is_large}
            & {*LADDER},
            reverse=True,
        )
        for is_large in (False, True)
    )
    words = powers(small or large)
    if small and large and small != large:
        words += f" (those of {LARGE} contacts and more with friction: {powers(large)})"
    return words


def _summary(rows: Sequence[Row]) -> str:
    mine = report.problems(report.of(rows, OURS))
    costs = [report.cost_to(each, each[0]["bar"]) for each in mine.values()]
    reached = [cost for cost in costs if np.isfinite(cost)]
    if not reached:
        return ""
    made = commit_words([each[0] for each in mine.values()])
    return (
        f"`solve_friction` with its default settings brought {len(reached)} of {len(mine)} to it "
        f"(problems by code: {made}), "
        f"in {seconds(float(np.median(reached)))} (median), {seconds(max(reached))} at most. "
        + _beside_hybrid(rows)
    )


def _beside_hybrid(rows: Sequence[Row]) -> str:
    """On how many problems our default is the slower one."""
    ratios = report.cost_ratios(rows, HYBRID)
    if not ratios:
        return ""
    values = np.array(list(ratios.values()))
    worst = max(ratios, key=lambda name: ratios[name])
    return (
        f"Of the {len(values)} problems that {HYBRID} brings to it too, `solve_friction` is slower "
        f"on {int((values > 1).sum())}, by a factor of {values.max():.2g} at most ({worst}); the "
        f"median of the ratios of costs is {np.median(values):.2g}."
    )


def _dearest(rows: Sequence[Row]) -> str:
    """The unseen packing that costs `solve_friction` most, beside the others."""
    found = {
        name: report.of(each, OURS)
        for name, each in report.problems(rows).items()
        if each[0]["family"].startswith("other packings")
    }
    costs = {name: report.cost_to(mine, mine[0]["bar"]) for name, mine in found.items()}
    if len(costs) < 2:
        return ""
    *_, second, worst = sorted(costs, key=lambda name: costs[name])
    mine = found[worst]
    return (
        f"The dearest of {len(costs)} unseen packings ({worst}, {mine[0]['contacts']:,} contacts) "
        f"takes {seconds(costs[worst])} to its bar and {seconds(report.cost_to(mine, 1e-6))} to "
        f"1e-6; the others take {seconds(costs[second])} at most."
    )


def _problem_tables(rows: Sequence[Row]) -> str:
    parts: list[str] = []
    for family in FEW:
        found = report.problems(rows, family)
        if found:
            parts += ["", f"### {family[0].upper()}{family[1:]}", "", *_table(found)]
    for title, words, begins in UNSEEN:
        found = {name: each for family in report.families(rows) if family.startswith(begins)
                 for name, each in report.problems(rows, family).items()}  # fmt: skip
        if found:
            parts += ["", f"### {title}", "", words, "", *_unseen(found)]
    return "\n".join(parts)


def _table(found: dict[str, list[Row]]) -> list[str]:
    lines = [
        f"| problem | contacts | `solve_friction` | {HYBRID} | Clarabel | best of Siconos |",
        "|---|---|---|---|---|---|",
    ]
    for name, each in found.items():
        groups = [report.of(each, OURS), report.of(each, HYBRID), report.of(each, "Clarabel")]
        cells = [_cell(group) for group in groups]
        siconos = report.starting(each, "Siconos")
        cells.append(_cell(siconos, named=True))
        lines.append(f"| {name} | {each[0]['contacts']:,} | {' | '.join(cells)} |")
    return lines


def _cell(rows: Sequence[Row], named: bool = False) -> str:
    error = report.least_error(rows)
    if not rows:
        return ""
    if not np.isfinite(error):
        return report.outcome(rows)
    bar = rows[0]["bar"]
    cost = report.cost_to(rows, max(error, bar))
    text = f"{error:.1e} @ {seconds(cost)}"
    if named:
        best = next(r for r in rows if r["cost_s"] == cost)
        text += f" ({best['method'].removeprefix('Siconos ')[3:]})"
    return f"**{text}**" if error <= bar else text


def _unseen(found: dict[str, list[Row]]) -> list[str]:
    lines = ["| method | reached the bar | median cost | greatest cost |", "|---|---|---|---|"]
    rows = [row for each in found.values() for row in each]
    for method in report.method_names(rows):
        mine = report.problems(report.of(rows, method))
        costs = [report.cost_to(each, each[0]["bar"]) for each in mine.values()]
        reached = [cost for cost in costs if np.isfinite(cost)]
        if reached:
            lines.append(
                f"| {method} | {len(reached)} of {len(mine)} | "
                f"{seconds(float(np.median(reached)))} | {seconds(max(reached))} |"
            )
        else:
            lines.append(f"| {method} | 0 of {len(mine)} | | |")
    return lines


def _failures(rows: Sequence[Row]) -> str:
    counts = {method: report.outcomes(rows, method) for method in report.method_names(rows)}
    ends = [name for name in report.OUTCOMES if any(each[name] for each in counts.values())]
    lines = [f"| method | problems | {' | '.join(ends)} |", f"|---|---|{'---|' * len(ends)}"]
    for method, counted in counts.items():
        cells = " | ".join(str(counted[name] or "") for name in ends)
        lines.append(f"| {method} | {sum(counted.values())} | {cells} |")
    deaths = report.deaths(rows)
    if deaths:
        kinds = sorted({(r["method"], r["problem"], _quoted(r["why"])) for r in deaths})
        lines += ["", f"Runs that killed their process ({len(deaths)}):", ""]
        lines += [f"- {method} on {problem}: {why}" for method, problem, why in kinds]
    wrong = report.wrong_answers(rows)
    if wrong:
        worst = {(r["method"], r["problem"]): r["error"] for r in wrong}
        lines += [
            "",
            "Solved by their own account (asked for 1e-8 or less), residual above 1e-3:",
            "",
        ]
        lines += [f"- {m} on {p}: {error:.1e}" for (m, p), error in sorted(worst.items())]
    return "\n".join(lines)


def _quoted(why: str) -> str:
    return why.replace("|", "/").replace("<", "(").replace(">", ")")[:120]


def _frictionless(rows: Sequence[Row]) -> str:
    found = report.problems(rows, "frictionless")
    if not found:
        return ""
    lines = [
        "## Without friction",
        "",
        f"| problem | contacts | `solve_friction` | {OSQP} | {HYBRID} |",
        "|---|---|---|---|---|",
    ]
    for name, each in found.items():
        cells = [_cell(report.of(each, method)) for method in (OURS, OSQP, HYBRID)]
        lines.append(f"| {name} | {each[0]['contacts']:,} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _budgets(rows: Sequence[Row]) -> str:
    """Processor seconds that runs were given, by method."""
    given: dict[str, set[float]] = {}
    for row in rows:
        if "budget_s" in row:
            name = "Siconos" if row["method"].startswith("Siconos") else row["method"]
            given.setdefault(name, set()).add(row["budget_s"])
    names: dict[str, list[str]] = {}
    for method, budgets in given.items():
        names.setdefault(" or ".join(f"{each:g}" for each in sorted(budgets)), []).append(method)
    return "; ".join(f"{', '.join(methods)}: {time}" for time, methods in names.items())


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page and, unless told otherwise, draw its picture."""
    parser = argparse.ArgumentParser(description="Writes the page on solvers from their record.")
    parser.add_argument("--record", type=Path, default=RECORD, help="the record's .jsonl")
    parser.add_argument("--out", type=Path, default=PAGE_PATH, help="the page")
    parser.add_argument("--words", action="store_true", help="do not draw the picture")
    asked = parser.parse_args(arguments)
    rows = rows_read(asked.record)
    write_atomically(asked.out, page(rows))
    if not asked.words:
        picture(rows, PICTURE if asked.out == PAGE_PATH else asked.out.with_suffix(".png"))
    print(asked.out)


if __name__ == "__main__":
    main()
