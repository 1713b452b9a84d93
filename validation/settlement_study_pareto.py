"""Ways of a study that no other beats, in bias and gained time at equal cost a step."""

from __future__ import annotations

from collections.abc import Sequence

from validation.settlement_bars import bias, gained_time_even, spread
from validation.settlement_partial_page import way
from validation.settlement_rivals import Row
from validation.settlement_rivals_picture import shown
from validation.settlement_rivals_reading import finished, reference
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

HEAD_PARETO = ("bed", "way", "gained time at equal cost a step, %", "bias, %", "runs", "spread")
Figures = tuple[str, float, float]
"""A way, its gained time at equal cost a step, and its bias over the total settlement [%]."""


def pareto(rows: Sequence[Row], methods: Sequence[str], last: int) -> list[Figures]:
    """Ways that came to ``last`` on every packing and that no other beats, by gained time.

    One beats another that is no better in either figure and worse in one.
    """
    packings = {row["seed"] for row in reference(rows, last)}
    found = [
        (name, gained_time_even(rows, name, last), bias(rows, name, last))
        for name in methods
        if {row["seed"] for row in finished(rows, name, last)} == packings
    ]
    comparable = [one for one in found if one[1] == one[1]]
    return sorted(
        (one for one in comparable if not beaten(one, comparable)), key=lambda one: one[1]
    )


def beaten(one: Figures, others: Sequence[Figures]) -> bool:
    """Whether another gains as much time at as small a bias, and more or at a smaller one."""
    _, gained, off = one
    return any(
        more >= gained and less <= off and (more, less) != (gained, off) for _, more, less in others
    )


def pareto_of(name: str) -> list[tuple[str, str, str, str, str]]:
    """Those of a study in words, with how many runs and their spread over the reference's; laws,
    which leave no bed, among them."""
    study = STUDIES[name]
    ways, rows = [each for each, _ in shown(study.methods)], record_read(study.record)
    return [
        (
            way(each), f"{gained:,.0f}", f"{off:.1f}", str(len(finished(rows, each, study.last))),
            f"{spread(rows, each, study.last):.1f}",
        )
        for each, gained, off in pareto(rows, ways, study.last)
    ]  # fmt: skip
