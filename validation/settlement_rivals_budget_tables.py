"""The error budget of a jump in tables and words, for docs/settlement-rivals.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from adapters.state import FloatArray
from validation.page_text import table
from validation.settlement_ensemble_reading import student
from validation.settlement_rivals import Row
from validation.settlement_rivals_budget import AFTER, EVERY, JUMPED, JUMPS, PARTS, SAME, TWIN
from validation.settlement_rivals_reading import (
    between_packings,
    effect,
    law_alone,
    mean_by_packing,
    of_place,
    over_same,
    rms,
    rows_of,
    settled,
)
from validation.student import interval

Value = Callable[[Row], float]
BUDGET: tuple[tuple[str, Value, float, int], ...] = (
    (
        "settlement of the first cycle, µm",
        lambda row: row["settlement"][0] - row["window"][-1],
        1e6,
        1,
    ),
    ("settlement after 20 cycles, µm", settled, 1e6, 1),
    ("coordination number", lambda row: row["state"]["coordination_number"], 1, 3),
    ("force error, first cycle, %", lambda row: row["first"]["force_error"], 100, 2),
    ("force error, %", lambda row: row["state"]["force_error"], 100, 2),
    ("elastic deflection, µm", lambda row: row["state"]["elastic_deflection"], 1e6, 1),
)
"""Columns of the budget: words, value of a row, factor, decimals."""
BEHIND: tuple[tuple[str, Value, float, int], ...] = (
    ("settlement beside the jump, µm", settled, 1e6, 1),
    ("coordination number, first cycle", lambda row: row["first"]["coordination_number"], 1, 2),
    ("coordination number", lambda row: row["state"]["coordination_number"], 1, 2),
    ("force error, first cycle, %", lambda row: row["first"]["force_error"], 100, 1),
    ("elastic deflection, µm", lambda row: row["state"]["elastic_deflection"], 1e6, 0),
)
"""Columns of the jumps, all of them beside `SAME`."""


def pm(values: FloatArray, factor: float, digits: int, unit: str = "", bold: bool = False) -> str:
    """Mean and half of Student's interval over packings; bold where it leaves out zero."""
    if not len(values):
        return "-"
    mean, half = interval(values * factor)
    if half != half:
        return f"{mean:+.{digits}f}{unit}"
    text = f"{mean:+.{digits}f} ± {half:.{digits}f}{unit}"
    return f"**{text}**" if bold and abs(mean) > half else text


def table_budget(rows: Sequence[Row]) -> str:
    """A line for each part of a jump: its effect beside the run of every cycle.

    Another packing has no mean effect: its line is what a part would have that changes as much.
    """
    other = [
        f"± {interval_of_pairs(between_packings(rows, value)) * factor:.{digits}f}"
        for _, value, factor, digits in BUDGET
    ]
    lines = [["another packing (`sample.seed`)", *other]]
    for part in PARTS[1:]:
        if rows_of(rows, "budget", part.name):
            cells = [
                "-" if part.jump and "first" in words else pm(found, factor, digits, bold=True)
                for words, value, factor, digits in BUDGET
                for found in [effect(rows, part.name, value)]
            ]
            lines.append([part.name, *cells])
    alone = pm(law_alone(rows), 1e6, 1, bold=True)
    lines.append(["the law alone (log), no bed", "-", alone, *["-"] * (len(BUDGET) - 2)])
    return table(["what is done", *(words for words, *_ in BUDGET)], lines)


def interval_of_pairs(differences: FloatArray) -> float:
    """Half of Student's 95 % interval that the mean of P such differences has, as wide as in the
    table's other lines; ``differences``, (P (P - 1) / 2,), of all pairs of P packings."""
    packings = round((1 + (1 + 8 * len(differences)) ** 0.5) / 2)
    return student(packings - 1) * rms(differences) / packings**0.5


def table_jumps(rows: Sequence[Row]) -> str:
    """A line for each jump that differs from `SAME` in one thing, and one for no jump."""
    head = [
        "what differs", "places", "moved by the jump, µm", "first cycle behind, µm",
        "settlement beside every cycle, µm", *(words for words, *_ in BEHIND),
    ]  # fmt: skip
    every = of_place(rows, EVERY).values()
    paths = [(row["seed"], [row["window"][-1], *row["settlement"]]) for row in every]
    gains = [
        mean_by_packing((seed, path[end] - path[start]) for seed, path in paths)
        for start, end in ((0, JUMPED), (JUMPED, JUMPED + 1))
    ]
    lines = [
        ["no jump: every cycle", str(len(every)), *(pm(gain, 1e6, 1) for gain in gains),
         *["-"] * (1 + len(BEHIND))]
    ]  # fmt: skip
    for part in JUMPS:
        found = of_place(rows, part.name).values()
        moved = mean_by_packing((row["seed"], row["moved"] - row["window"][-1]) for row in found)
        first = mean_by_packing((row["seed"], row["settlement"][0] - row["moved"]) for row in found)
        cells = [
            pm(effect(rows, part.name, value, SAME), factor, digits, bold=True)
            for _, value, factor, digits in BEHIND
        ]
        lines.append(
            [part.name, str(len(found)), pm(moved, 1e6, 1), pm(first, 1e6, 1, bold=True),
             pm(effect(rows, part.name, settled), 1e6, 1, bold=True),
             *(["-"] * len(BEHIND) if part.name == SAME else cells)]
        )  # fmt: skip
    return table(head, lines)


def refused(rows: Sequence[Row]) -> str:
    """In words, which of the budget's jumps the procedure gave up, and why."""
    told = []
    for part in JUMPS:
        mine = rows_of(rows, "budget", part.name)
        lost = [row["refused"] for row in mine if "refused" in row]
        if lost:
            told.append(f"*{part.name}* {len(lost)} of {len(mine)} (such as: {lost[0]})")
    return "; ".join(told) or "none"


def scatter(rows: Sequence[Row]) -> dict[str, str]:
    """What a place settles in 20 cycles without a jump, and how far twins, packings and the same
    jump made twice part [µm]: rms."""
    every, twin = of_place(rows, EVERY), of_place(rows, TWIN)
    gains = [settled(over_same(row, AFTER)) for row in every.values()]
    apart = [settled(row) - settled(over_same(every[place], AFTER)) for place, row in twin.items()]
    other = [
        one - two
        for (place, one) in zip(every, gains, strict=True)
        for (other, two) in zip(every, gains, strict=True)
        if place[0] < other[0]
    ]
    first, again = (of_place(rows, name) for name in (PARTS[-1].name, SAME))
    same = [settled(first[place]) - settled(again[place]) for place in first.keys() & again.keys()]
    found = {"GAIN": float(np.mean(gains))}
    found |= {"APART": rms(np.array(apart)), "OTHER": rms(np.array(other))}
    found |= {"AGAIN": rms(np.array(same))}
    return {name: f"{1e6 * value:.0f}" for name, value in found.items()}
