"""Figs 11 and 12: errors and gained times of a made-up record, and the claims' rules."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from validation.paper_convergence import (
    FULL,
    JUMPED,
    MEMBER,
    STILL,
    errors_of,
    falls,
    path_of,
    paths_of,
    rank_with_gain,
)
from validation.paper_convergence_page import claims_table, page
from validation.paper_convergence_runs import JUMPS, STUDY

Row = dict[str, Any]


def made_up(way: str, error: float, cost: float, jump: tuple[int, int] | None = None) -> Row:
    """ln(1 + N) in um but for an ``error`` behind k_i, and four contacts but for the same."""
    rows = []
    for cycle in range(STUDY.last + 1):
        if jump is not None and jump[0] < cycle < jump[1]:
            continue
        gone = (cycle - STUDY.k_i) / (STUDY.last - STUDY.k_i) if cycle > STUDY.k_i else 0.0
        settled = 1e-6 * (np.log(1 + cycle) + error * gone)
        rows.append([cycle, "c", settled, 4.0 * (1 + error), 1e-5])
    return {
        "way": way, "seed": 1, "rows": rows, "computed": STUDY.last, "engine_s": cost - 1.0,
        "lost": [{"lost_s": 1.0}], "coordinates": abs(error) / 100, "displacement": abs(error),
        "engine": "LIGGGHTS", "machine": "a machine", "commit": "0123456789",
    }  # fmt: skip


def record(size: float) -> list[Row]:
    """Errors that rise with what is gained: by h/k."""
    return [
        made_up(FULL, 0.0, 100.0), made_up(MEMBER, 0.01, 100.0), made_up(STILL, -0.4, 70.0),
        *(
            made_up(name, size * h / k, 100 / (1 + h / k), (20, 20 + h))
            for name, (k, h) in zip(JUMPED, JUMPS, strict=True)
        ),
    ]  # fmt: skip


def test_errors_are_those_that_were_made() -> None:
    """0.1 um more behind k_i, of ln(151) um in all; a fourth of the cost is 300 % gained."""
    full = path_of(made_up(FULL, 0.0, 100.0))
    errors = errors_of(path_of(made_up("k 10, h 10", 0.1, 25.0, (20, 30))), full)
    total, before = np.log(1 + STUDY.last), np.log(1 + STUDY.k_i)
    assert errors.settlement == pytest.approx(0.1 / total)
    assert errors.since == pytest.approx(0.1 / (total - before))
    assert errors.coordination == pytest.approx(0.1)
    assert errors.gained == pytest.approx(3.0)


def test_claims_are_judged_by_their_rules() -> None:
    """At h = 10 the errors fall as 1/k, at k = 40 as h; a rank correlation of one."""
    paths = paths_of(record(0.1))
    errors = {name: errors_of(path, paths[FULL]) for name, path in paths.items()}
    assert rank_with_gain(errors, "settlement") == pytest.approx(1.0)
    lines = claims_table(errors).splitlines()[2:]
    assert [line.split(" | ")[-1] for line in lines[:3]] == ["yes |"] * 3
    assert "at 500 % (k 10, h 50): 50.0 %" in lines[3]
    assert lines[3].endswith("in part |")
    assert falls([3, -2, 1])
    assert not falls([1, -2, 0.5])


def test_page_is_filled() -> None:
    text = page(record(0.1))
    assert "<" not in text.replace("<br>", "")
    assert "| k 40, h 5 | 150 | 12 % |" in text
