"""docs/jump-control.md is what its records say."""

from __future__ import annotations

import numpy as np
from scipy.stats import f

from validation import jump_runs, jump_study
from validation.jump_page import PAGE, page


def test_page_is_made_from_the_records() -> None:
    """Made again, the page is the one that ships."""
    made = page(jump_study.record_read(), jump_runs.record_read())
    assert made == PAGE.read_text(encoding="utf-8")
    assert "{{" not in made


def test_five_seeds_can_not_tell_the_ways_on_the_coarse_bed() -> None:
    """Of any two ways the variances about the full runs differ by less than what F(4, 4) has in
    one case of twenty."""
    rows = jump_runs.record_read()
    ends = {(row["way"], row["seed"]): row["rows"][-1][2] for row in rows}
    seeds = range(1, jump_runs.STUDY.seeds + 1)
    ways = [way.name for way in jump_runs.STUDY.ways if way.name != "full"]
    variance = [np.var([ends[way, s] / ends["full", s] for s in seeds], ddof=1) for way in ways]
    assert len(variance) == 3
    assert max(variance) / min(variance) < f.ppf(0.975, len(seeds) - 1, len(seeds) - 1)
