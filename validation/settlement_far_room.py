"""Room in jammed beds, and grains that change places: tables of docs/settlement-far.md."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from validation.page_text import table
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_far_jumps import STUDY
from validation.settlement_rivals import Row
from validation.settlement_rivals_reading import finished

REARRANGED = tuple(one.name for one in STUDY.methods if one.name.endswith("rearranged"))
KEPT = tuple(one.name for one in STUDY.methods if one.name not in REARRANGED)
"""Ways whose grains change places where a move has no room, and those whose grains never do."""
ROOM = (0.0, 3e-5, 6e-5, 1e-4, 2e-4, np.inf)
"""Settlements asked of a jump between which they are counted [m]."""
BEHIND = (1, 2, 3, 5, 10)
"""Cycles behind a jump at which figures are told."""


def short_of(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """How often no smallest move had room for what jumps by history asked, in a sentence."""
    mine = [row for name in KEPT for row in finished(rows, name, last)]
    moved = [pair for row in mine for pair in row.get("moved", ())]
    short = sum(got < asked for asked, got in moved)
    tries = sum(len(row["lost"]) for row in mine if row.get("moved"))
    nothing = sum(asked <= 0.0 for asked, _ in moved)
    return (
        f"Of {len(moved)} jumps by history whose grains keep their places, {nothing} of which were "
        f"asked for no settlement, {short} found no room for the whole move, after {tries} failed "
        "tries in all; what lacked was asked of the next."
    )


def table_room(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """How many smallest moves beds had room for, by what was asked."""
    mine = [row for name in KEPT for row in finished(rows, name, last)]
    moved = np.array([pair for row in mine for pair in row.get("moved", ())]).reshape(-1, 2)
    lines = []
    for low, high in pairwise(ROOM):
        asked = moved[(moved[:, 0] > low) & (moved[:, 0] <= high)]
        words = f"{1e6 * low:.0f} to {1e6 * high:.0f}" if high < np.inf else f"over {1e6 * low:.0f}"
        whole = int((asked[:, 0] == asked[:, 1]).sum())
        lines.append([words, str(len(asked)), str(whole)])
    return table(["asked of a jump, µm", "jumps", "room for all of it"], lines)


def table_changed(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """What jumps whose grains changed places settled by, and how long they looked."""
    lines = []
    for name in REARRANGED:
        mine = finished(rows, name, last)
        sides = [side for row in mine for side in row["sides"] if "hops" in side]
        if not sides:
            continue
        share = np.array([side["gain"] / side["asked"] for side in sides])
        hops = np.array([side["hops"] for side in sides])
        lines.append(
            [
                name, str(sum(len(row["sides"]) for row in mine)), str(len(sides)),
                f"{1e6 * np.mean([side['gain'] for side in sides]):.0f}",
                ", ".join(f"{100 * np.quantile(share, q):.0f}" for q in (0.1, 0.5, 0.9)),
                ", ".join(f"{np.quantile(hops, q):.0f}" for q in (0.1, 0.5, 0.9)),
                f"{np.mean([len(row['lost']) for row in mine]):.1f}",
                f"{np.mean([row['cost']['relax'] for row in mine]):.0f}",
            ]
        )  # fmt: skip
    head = ("way", "jumps", "grains changed places in", "and settled by, µm, mean",
            "over what was owed, %: quantiles .1, .5, .9", "hops: quantiles .1, .5, .9",
            "failed tries a run", "relaxation a run, CPU s")  # fmt: skip
    return table(head, lines)


def table_behind(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """Settlement a cycle and contacts behind jumps, beside the cycles before: mean ± standard
    deviation over jumps."""
    sides = [side for name in REARRANGED for row in finished(rows, name, last)
             for side in row["sides"]]  # fmt: skip
    lines = []
    for words, mine in (
        ("grains changed places", [side for side in sides if "hops" in side]),
        ("smallest move", [side for side in sides if "hops" not in side]),
    ):
        if len(mine) < 2:
            continue
        settled = np.array([side["after"]["settlement"] for side in mine])
        before = np.array([np.mean(side["before"]["coordination_number"]) for side in mine])
        contacts = np.array([side["after"]["coordination_number"] for side in mine])
        for what, values in (
            ("settlement in that cycle, µm", 1e6 * settled),
            ("contacts a grain, change, %", 100 * (contacts / before[:, None] - 1)),
        ):
            cells = [
                f"{values[:, n - 1].mean():+.1f} ± {values[:, n - 1].std(ddof=1):.1f}"
                for n in BEHIND
            ]
            lines.append([words, str(len(mine)), what, *cells])
    return table(["jump", "jumps", "in cycle", *(str(n) for n in BEHIND)], lines)


def table_parting(record: EnsembleRecord) -> str:
    """How far grains of full runs part from the mean profile, a line between each two marks."""
    lines = []
    marks = [mark for mark in STUDY.kind.marks if mark > STUDY.kind.k_i]
    for first, last in pairwise(marks):
        settled, parted = [], []
        for piece in STUDY.kind.runs():
            if piece.member is None:
                continue
            radius, position = record.states(piece.name)
            move, height = position[last] - position[first], position[first][:, 2]
            settled.append(-move[:, 2].mean())
            move[:, 2] -= np.polyval(np.polyfit(height, move[:, 2], 1), height)
            parted.append(np.sqrt(np.mean((move**2).sum(axis=1))) / radius.mean())
        doubled = np.array(parted) / np.sqrt(np.log2(last / first))
        lines.append(
            [
                f"{first:,} to {last:,}", f"{1e6 * np.mean(settled):.0f}",
                f"{np.mean(parted):.2f}", f"{doubled.mean():.2f} ± {doubled.std(ddof=1):.2f}",
            ]
        )  # fmt: skip
    head = ("cycles", "mean grain settles, µm", "grains part from the profile, radii",
            "the same while cycles double once, radii")  # fmt: skip
    return table(head, lines)
