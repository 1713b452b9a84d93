"""What the paper says of Figs 6 to 8, as bars: some are known not to be met here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.case import Check
from validation.studies.paper.run import LAWS, NOTHING

PAGE = "docs/paper.md"
FIRST, LAST = 10, 200
"""k_i of the paper's and of this run's ends."""
PAPER = {"linear": 0.14, "log": 0.14}
"""The paper's largest E_r at k_i = 10."""


def find_max(jumps: Sequence[dict[str, Any]], way: str, k_i: int, denominator: int = 0) -> float:
    """Largest E_r of a way over all k and h."""
    return max(one["errors"][way][denominator] for one in jumps if one["k_i"] == k_i)


def count_rises(jumps: Sequence[dict[str, Any]], way: str, along: str) -> tuple[int, int]:
    """In how many steps to the next longer k or h E_r rises, of how many."""
    other = "h" if along == "k" else "k"
    rises = []
    for place in sorted({(one["k_i"], one[other]) for one in jumps}):
        line = [one for one in jumps if (one["k_i"], one[other]) == place]
        errors = [one["errors"][way][0] for one in sorted(line, key=lambda one: one[along])]
        rises += np.diff(errors).tolist()
    return sum(rise > 0 for rise in rises), len(rises)


def count_nearer(jumps: Sequence[dict[str, Any]], way: str, other: str) -> int:
    """In how many jumps a way is nearer than another."""
    return sum(one["errors"][way][2] < one["errors"][other][2] for one in jumps)


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """The paper's sentences about one jump and about its cell."""
    found = {row["part"]: row for row in rows}
    jumps, overlap = found["jumps"]["jumps"], found["cell"]["overlap"]
    checks = []
    for law in LAWS:
        first, last = (find_max(jumps, law, k_i) for k_i in (FIRST, LAST))
        checks.append(
            Check(f"{law}: largest E_r of coordinates at k_i = {FIRST}", first,
                  f"<= {PAPER[law]:g}", first <= PAPER[law], page=PAGE)
        )  # fmt: skip
        why = "short windows have bursts; moving nothing has less" if last > first else ""
        checks.append(
            Check(f"{law}: at k_i = {LAST} over that at {FIRST}", last / first, "<= 1",
                  last <= first, page=PAGE, why=why)
        )  # fmt: skip
    rises, steps = count_rises(jumps, "log", "h")
    checks.append(Check("log: share of steps of h in which E_r rises", rises / steps, ">= 0.9",
                        rises >= 0.9 * steps, page=PAGE))  # fmt: skip
    rises, steps = count_rises(jumps, "log", "k")
    why = "windows with a burst inside err more; fewer than two steps in three fall"
    checks.append(Check("log: share of steps of k in which E_r falls", 1 - rises / steps, ">= 0.9",
                        1 - rises / steps >= 0.9, page=PAGE, why=why))  # fmt: skip
    share = count_nearer(jumps, "log", NOTHING) / len(jumps)
    why = "a law of each grain knows little of single grains"
    checks.append(Check("log: share of jumps nearer than nothing moved", share, ">= 0.9",
                        share >= 0.9, page=PAGE, why=why))  # fmt: skip
    left = overlap["karrech2007"] / overlap["estimate"]
    checks.append(Check("cell: overlap left by eq. 29", left, "<= 0.01", left <= 0.01, page=PAGE))
    return checks
