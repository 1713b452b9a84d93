"""Ways of a study that no other beats, in bias and gained time."""

from __future__ import annotations

from collections.abc import Sequence

from validation.settlement_bars import bias, gained_time
from validation.settlement_partial_page import way
from validation.settlement_rivals import Row
from validation.settlement_rivals_picture import shown
from validation.settlement_rivals_reading import finished
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

Figures = tuple[str, float, float]
"""A way, its gained time and its bias over the total settlement [%]."""


def pareto(rows: Sequence[Row], methods: Sequence[str], last: int) -> list[Figures]:
    """Ways that came to ``last`` and that no other beats, by gained time.

    One beats another that is no better in either figure and worse in one.
    """
    found = [
        (name, gained_time(rows, name, last), bias(rows, name, last))
        for name in methods
        if finished(rows, name, last)
    ]
    return sorted((one for one in found if not beaten(one, found)), key=lambda one: one[1])


def beaten(one: Figures, others: Sequence[Figures]) -> bool:
    """Whether another gains as much time at as small a bias, and more or at a smaller one."""
    _, gained, off = one
    return any(
        more >= gained and less <= off and (more, less) != (gained, off) for _, more, less in others
    )


def pareto_of(name: str) -> list[tuple[str, str, str]]:
    """Those of a study in words; laws, which leave no bed, among them."""
    study = STUDIES[name]
    ways = [each for each, _ in shown(study.methods)]
    return [
        (way(each), f"{gained:,.0f}", f"{off:.1f}")
        for each, gained, off in pareto(record_read(study.record), ways, study.last)
    ]
