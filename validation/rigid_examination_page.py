"""The examination's part of the page on solvers: a table by family, and what was not solved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.commit_words import commit_words
from validation.rigid_examination import BAR_S
from validation.rigid_examination_families import BEYOND, FAMILIES, SAME, family_named
from validation.rigid_examination_worker import SHARE_LEFT
from validation.rigid_page_studies import seconds

Row = dict[str, Any]
FINEST_S = 1e-3
"""Costs below it count as this in ratios."""
PLAIN_S = 0.01
"""Costs below it are mostly calls of Python, and checks of the input, which ours holds alone."""


def examination_table(rows: Sequence[Row]) -> str:
    """Family by family, and all of what bars hold for and of what is beyond; empty without rows."""
    if not rows:
        return ""
    lines = [
        "| family | problems | solved | over 1 s | median | greatest |"
        " slower than Clarabel + Newton |",
        "|---|---|---|---|---|---|---|",
    ]
    for belongs in (SAME, BEYOND):
        mine = [row for row in rows if row["belongs"] == belongs]
        for family in FAMILIES:
            some = [row for row in mine if row["family"] == family.name]
            if some:
                lines.append(_line(family.name, some))
        if mine:
            lines.append(_line(f"**{belongs}, all**", mine))
    return "\n".join(lines)


def _line(name: str, rows: Sequence[Row]) -> str:
    solved = [row["cpu_s"] for row in rows if row["ok"]]
    costs = [seconds(float(np.median(solved))), seconds(max(solved))] if solved else ["", ""]
    slow = sum(cost > BAR_S for cost in solved)
    pairs = rivals(rows)
    slower = sum(ours > theirs for ours, theirs in pairs)
    cells = [name, len(rows), len(solved), slow or "", *costs, f"{slower} of {len(pairs)}"]
    return f"| {' | '.join(map(str, cells))} |"


def rivals(rows: Sequence[Row]) -> list[tuple[float, float]]:
    """Our cost and that of Clarabel + Newton [s] on the problems that both solve."""
    return [
        (max(row["cpu_s"], FINEST_S), max(row["rival_s"], FINEST_S))
        for row in rows
        if row["ok"] and row.get("rival_ok")
    ]


def examination_words(rows: Sequence[Row]) -> str:
    """How many, what the rival made of them, and whether an answer called solved was none."""
    if not rows:
        return "There is no record of it."
    seeds = ", ".join(str(seed) for seed in sorted({row["seed"] for row in rows}))
    wrong = sum(bool(row["claims"]) and not row["ok"] for row in rows)
    solved = sum(row["ok"] for row in rows)
    loads, machines = [row["load"] for row in rows], sorted({row["machine"] for row in rows})
    words = (
        f"{len(rows)} problems of seed {seeds}, {solved} solved (by code: {commit_words(rows)});"
        f" answers called solved that are not: {wrong}. Made on {', '.join(machines)} at load"
        f" averages of {min(loads):.1f} to {max(loads):.1f}: above the number of cores, costs are"
        " greater than alone."
    )
    sure = [row for row in rows if family_named(row["family"]).soluble]
    if sure:
        names = ", ".join(dict.fromkeys(row["family"] for row in sure))
        words += (
            f" Of families whose every problem has a solution ({names})"
            f" {sum(row['ok'] for row in sure)} of {len(sure)} are solved."
        )
    return words + _beside_rival([row for row in rows if "rival_ok" in row])


def noise_words(rows: Sequence[Row]) -> str:
    """Problems whose W holds noise: solved, and what is proved of the others."""
    mine = [row for row in rows if row["family"] == "W with noise"]
    left = [row for row in mine if not row["ok"]]
    if not mine:
        return ""
    none = sum(row["status"] == "no solution" for row in left)
    gives = sum(row.get("gives_energy", False) for row in left)
    return (
        f"Of the {len(mine)} of the record {len(mine) - len(left)} are solved; of the others "
        f"{gives} have the proof that W gives energy and {none} that there is no solution."
    )


def _beside_rival(given: Sequence[Row]) -> str:
    both = rivals(given)
    if not both:
        return ""
    ratios = [ours / theirs for ours, theirs in both]
    plain = sum(ours > max(theirs, PLAIN_S) for ours, theirs in both)
    words = (
        f" Clarabel + Newton, always from zero forces, was given {len(given)} and solved"
        f" {sum(row['rival_ok'] for row in given)}; on the {len(both)} that both solve the median"
        f" of our cost over its is {float(np.median(ratios)):.2g}, the greatest {max(ratios):.2g};"
        f" we are slower and take more than {seconds(PLAIN_S)} on {plain}."
    )
    alone = [f"{row['family']} {row['index']}" for row in given if row["rival_ok"] > row["ok"]]
    return words + (f" It solves what we do not: {', '.join(alone)}." if alone else "")


def examination_failures(rows: Sequence[Row]) -> str:
    """What was not solved, and what took more than a second: a line each where a solution is known
    to exist, else a line a family."""
    lines: list[str] = []
    for title, bad in (
        ("Not solved:", lambda row: not row["ok"]),
        ("Solved, in more than a second:", lambda row: row["ok"] and row["cpu_s"] > BAR_S),
    ):
        told: list[str] = []
        for family in FAMILIES:
            some = [row for row in rows if row["family"] == family.name and bad(row)]
            some.sort(key=lambda row: row["index"])
            told += map(_told, some) if family.soluble else _summed(some)
        if told:
            lines += ["", title, "", *told]
    return "\n".join(lines).strip()


def seeds_words(rows: Sequence[Row]) -> str:
    """Of each seed of another record how many problems were solved by the code of each commit that
    was given them, how many of these late, which were not, and what the rival made of them."""
    told = []
    for seed, code in dict.fromkeys((row["seed"], row["commit"]) for row in rows):
        mine = [row for row in rows if (row["seed"], row["commit"]) == (seed, code)]
        solved = [row["cpu_s"] for row in mine if row["ok"]]
        slow = sum(cost > BAR_S for cost in solved)
        lost = [f"{row['family']} {row['index']}" for row in mine if not row["ok"]]
        words = (
            f"- Seed {seed} by `{code[:10]}`: {len(solved)} of {len(mine)}, {slow} in more than "
            f"{BAR_S:g} s" + f" (not {', '.join(lost)})" * bool(lost)
        )
        told.append(words + "." + _beside_rival([row for row in mine if "rival_ok" in row]))
    return "\n".join(told)


def _told(row: Row) -> str:
    words = f"- {row['family']} {row['index']} ({row['recipe']}; {row['contacts']:,} contacts): "
    if row["residual"] is None:
        return words + row["status"]
    often = ", median of five" if "repeats_s" in row else ""
    return words + f"{row['residual']:.1e} in {seconds(row['cpu_s'])}{often}"


def _summed(rows: Sequence[Row]) -> list[str]:
    """One line for all, or none: how many, their range, and where forces grow without bound."""
    if not rows:
        return []
    ended = [row for row in rows if row["residual"] is not None]
    words = f"- {rows[0]['family']} {', '.join(str(row['index']) for row in rows)}"
    if ended:
        errors = _range([f"{row['residual']:.1e}" for row in sorted(ended, key=_residual)])
        costs = _range([seconds(row["cpu_s"]) for row in sorted(ended, key=_cost)])
        endless = sum(row["left"] > SHARE_LEFT for row in ended)
        words += f": residual {errors} in {costs}"
        if endless:  # forces that grow without bound make any residual small
            words += f"; on {endless} forces leave more than a tenth of the error of none"
    given = sum(row.get("gives_energy", False) for row in rows)
    words += f"; on {given} W is proved to give energy, so none need exist" * (given > 0)
    proved = sum(row["status"] == "no solution" for row in rows)
    words += f"; {proved} proved to have none" * (proved > 0)
    other = len(rows) - len(ended)
    return [words + f"; {other} ended after 60 s or otherwise" * (other > 0)]


def _residual(row: Row) -> float:
    return float(row["residual"])


def _cost(row: Row) -> float:
    return float(row["cpu_s"])


def _range(words: Sequence[str]) -> str:
    """The first and the last, or the only one."""
    return words[0] if words[0] == words[-1] else f"{words[0]} to {words[-1]}"
