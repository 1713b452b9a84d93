"""docs/jump-control.md is what its records say."""

from __future__ import annotations

import numpy as np

from validation import jump_runs, jump_study
from validation.jump_page import PAGE, page


def test_page_is_made_from_the_records() -> None:
    """Made again, the page is the one that ships."""
    made = page(jump_study.record_read(), jump_runs.record_read())
    assert made == PAGE.read_text(encoding="utf-8")
    assert "{{" not in made


def test_what_the_page_says_of_the_coarse_bed_is_so() -> None:
    """Five seeds of each way on LIGGGHTS: how they scatter about the full runs."""
    rows = jump_runs.record_read()
    ends = {(row["way"], row["seed"]): row["rows"][-1][2] for row in rows}
    seeds = range(1, jump_runs.STUDY.seeds + 1)
    scatter = {
        way.name: np.std([ends[way.name, s] / ends["full", s] for s in seeds], ddof=1)
        for way in jump_runs.STUDY.ways
    }
    assert scatter["tolerance 0.1"] < scatter["fixed h 20"] < scatter["tolerance 0.05"]
