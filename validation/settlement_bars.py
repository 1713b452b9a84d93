"""The bars that jumps are to reach at paper scale, from the record of the rivals.

Every figure is that of all runs of a method, several a packing, beside the reference ensemble's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from adapters.state import FloatArray
from validation.page_text import table
from validation.settlement_ensemble import Kind
from validation.settlement_ensemble_reading import Nested, nested
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import FEWER, HEALING, Row
from validation.settlement_rivals_continuity import COLUMNS, change_of, continues, like, stays
from validation.settlement_rivals_reading import (
    FIGURES,
    cheaper_even,
    cost,
    finished,
    judged,
    profile_error,
    reference,
)
from validation.settlement_rivals_reference import curves_of_reference, sides_of_reference

EVEN = "gained time at equal cost a step"


@dataclass(frozen=True)
class Bar:
    """A figure, and what it is to be."""

    words: str
    unit: str
    bound: float
    value: Callable[[Sequence[Row], str, int], float]
    """Of rows, method and last cycle; nan where the record does not tell."""
    least: bool = False
    """Whether the bound is the least that is asked, not the most."""
    full: Callable[[Sequence[Row], str, int], float] | None = None
    """The same of full runs between the same cycles."""

    def met(self, value: float) -> bool:
        """Whether a figure is what it is to be; nan is not."""
        return bool(value >= self.bound if self.least else value <= self.bound)


def runs_by_packing(rows: Sequence[Row], key: str) -> dict[int, FloatArray]:
    """A figure of all runs of each packing."""
    found: dict[int, list[float]] = {}
    for row in rows:
        found.setdefault(row["seed"], []).append(FIGURES[key].value(row))
    return {seed: np.array(values) for seed, values in sorted(found.items())}


def settlement_of(rows: Sequence[Row], last: int) -> Nested:
    """Settlement of the reference from k_i to ``last`` [m], with its intervals."""
    return nested(runs_by_packing(reference(rows, last), "settlement"))


def settlement_total(rows: Sequence[Row], last: int) -> float:
    """Mean settlement of the reference from the rain to ``last`` [m]; nan where it is not kept."""
    begun = [row.get("begun", np.nan) for row in reference(rows, last)]
    return float(np.mean(begun)) + settlement_of(rows, last).mean


def bias(rows: Sequence[Row], method: str, last: int) -> float:
    """Size of the mean settlement's error over the total settlement [%]."""
    found = judged(rows, method, last, "settlement")
    scale = settlement_of(rows, last).mean / settlement_total(rows, last)
    return 100 * abs(found.mean) * scale if found else np.nan


def bias_beside_interval(rows: Sequence[Row], method: str, last: int) -> float:
    """The same error over half of the interval that the reference's mean has from these packings:
    1 is its end."""
    found, truth = judged(rows, method, last, "settlement"), settlement_of(rows, last)
    return abs(found.mean) * truth.mean / truth.half_given if found else np.nan


def spread(rows: Sequence[Row], method: str, last: int) -> float:
    """Standard deviation of the settlement over all runs, over the reference's [-]."""
    mine, truth = (
        np.array([FIGURES["settlement"].value(row) for row in found])
        for found in (finished(rows, method, last), reference(rows, last))
    )
    return float(mine.std(ddof=1) / truth.std(ddof=1)) if len(mine) > 1 else np.nan


def error_of(key: str) -> Callable[[Sequence[Row], str, int], float]:
    """Size of the mean error of a figure [%]."""

    def error(rows: Sequence[Row], method: str, last: int) -> float:
        found = judged(rows, method, last, key)
        return 100 * abs(found.mean) if found else np.nan

    return error


def error_of_profile(rows: Sequence[Row], method: str, last: int) -> float:
    """Error of the density profile, rms over layers, mean over runs [%]."""
    errors = profile_error(rows, method, last)
    return 100 * float(errors.mean()) if len(errors) else np.nan


def gained_time(rows: Sequence[Row], method: str, last: int) -> float:
    """T_full / T - 1 of CPU time behind k_i, all counted [%]."""
    mine = finished(rows, method, last)
    return 100 * (cost(reference(rows, last)) / cost(mine) - 1) if mine else np.nan


def gained_time_even(rows: Sequence[Row], method: str, last: int) -> float:
    """The same had a time step cost the same in both [%]: no machine and no hour counts.

    nan for fewer grains, whose steps are cheaper by what they leave out.
    """
    mine = [] if method == FEWER.name else finished(rows, method, last)
    return 100 * (cheaper_even(mine, reference(rows, last)) - 1) if mine else np.nan


def sides_compared(rows: Sequence[Row], kind: Kind, record: EnsembleRecord) -> list[Row]:
    """Rows whose jumps have beside their own sides those of full runs, over as many cycles, as
    ``others``."""
    known = cache(partial(sides_of_reference, curves_of_reference(kind, record)))

    def compared(row: Row) -> Row:
        sides = [
            one | {"others": [like(one, other) for other in known(one["first"], one["last"])]}
            for one in row["sides"]
        ]
        return row | {"sides": sides}

    return [compared(row) if "sides" in row else row for row in rows]


FEWEST = 3
"""Full runs beside a jump, fewer than which tell nothing of it: each is judged by the others."""


def jumps_of(rows: Sequence[Row], method: str, last: int) -> list[Row]:
    """Sides of all jumps of a method that full runs are known to, as ``others``."""
    jumps = [one for row in finished(rows, method, last) for one in row.get("sides", [])]
    return [one for one in jumps if len(one["others"]) >= FEWEST]


def percent(held: Sequence[bool]) -> float:
    """Share of what holds [%]; nan for none."""
    return 100 * float(np.mean(held)) if len(held) else float("nan")


def beside_full(jump: Row, column: str, skipped: int) -> tuple[float, bool]:
    """Change of a column over one of `jumps_of` behind ``skipped`` cycles less the mean of full
    runs', and whether it goes on."""
    full, change = changes(jump["others"], column, skipped), change_of(jump, column, skipped)
    return change - float(full.mean()), continues(change, full)


def settled_more(rows: Sequence[Row], method: str, last: int) -> FloatArray:
    """What beds settle behind a method's jumps less what full runs settle in the same cycles [m]:
    a row a packing, mean over its jumps; in the first cycle, and in the next nine together.

    ``rows`` of `sides_compared`; of jumps whose windows have ten cycles behind them.
    """
    found: dict[int, list[FloatArray]] = {}
    for row in finished(rows, method, last):
        for jump in jumps_of([row], method, last):
            mine, *full = (
                np.array(one["after"]["settlement"], float) for one in (jump, *jump["others"])
            )
            more = mine - np.mean(full, axis=0)
            found.setdefault(row["seed"], []).append(np.array([more[0], more[1:].sum()]))
    return np.array([np.mean(found[seed], axis=0) for seed in sorted(found)])


def changes(sides: Sequence[Row], column: str, skipped: int) -> FloatArray:
    """`change_of` of each of ``sides``."""
    return np.array([change_of(one, column, skipped) for one in sides])


def bar_continues(words: str, column: str, skipped: int = 0) -> Bar:
    """In nine jumps of ten a column goes on behind so many ``skipped`` cycles as full runs have;
    beside it each full run beside the others."""

    def share(rows: Sequence[Row], method: str, last: int) -> float:
        found = [beside_full(one, column, skipped) for one in jumps_of(rows, method, last)]
        return percent([goes_on for _, goes_on in found])

    def share_full(rows: Sequence[Row], method: str, last: int) -> float:
        known = [changes(one["others"], column, skipped) for one in jumps_of(rows, method, last)]
        return percent(
            [
                continues(change, np.delete(others, place))
                for others in known
                for place, change in enumerate(others)
            ]
        )

    return Bar(words, "%", 90.0, share, least=True, full=share_full)


def bar_stays(words: str, column: str, skipped: int) -> Bar:
    """In nine jumps of ten a column stays, behind ``skipped`` cycles, as single cycles before;
    beside it full runs."""

    def share(rows: Sequence[Row], method: str, last: int) -> float:
        return percent([stays(one, column, skipped) for one in jumps_of(rows, method, last)])

    def share_full(rows: Sequence[Row], method: str, last: int) -> float:
        full = [other for one in jumps_of(rows, method, last) for other in one["others"]]
        return percent([stays(one, column, skipped) for one in full])

    return Bar(words, "%", 90.0, share, least=True, full=share_full)


BARS = (
    Bar("bias over the total settlement", "%", 1.0, bias),
    Bar("bias over half the reference's interval", "", 1.0, bias_beside_interval),
    Bar("spread over the reference's", "", 1.3, spread),
    Bar("coordination number", "%", 3.0, error_of("coordination")),
    Bar("density profile", "%", 2.0, error_of_profile),
    Bar("elastic deflection", "%", 2.0, error_of("deflection")),
    Bar("gained time", "%", 400.0, gained_time, least=True),
    Bar(EVEN, "%", 400.0, gained_time_even, least=True),
    bar_stays("rate stays", COLUMNS[0], 0),
    bar_stays("rate behind healing stays", COLUMNS[0], HEALING),
    bar_continues("rate behind healing goes on", COLUMNS[0], HEALING),
    bar_continues("rate behind the first cycle goes on", COLUMNS[0], 1),
    *(
        bar_continues(f"{words} goes on", column)
        for column, words in zip(COLUMNS, ("rate", "coordination", "stiffness"), strict=True)
    ),
)
"""Either of the first two is enough."""
BARS_CONTINUITY = tuple(bar for bar in BARS if bar.full)
"""Of them those on what a bed does behind a jump."""
BARS_PARTIAL = (
    Bar("bias over the total settlement", "%", 4.0, bias),
    Bar("gained time", "%", 300.0, gained_time, least=True),
    Bar(EVEN, "%", 300.0, gained_time_even, least=True),
    *BARS[2:6],
    *BARS_CONTINUITY,
)
"""Under a piston that covers a part: asked of the first two; of the others what is asked of the
confined bed."""


def told(bar: Bar, value: float, full: float = float("nan")) -> str:
    """A figure as it stands in a table, bold where it is what it is to be; that of full runs."""
    if value != value:
        return "-"
    text = f"{value:.0f}" if bar.least else f"{value:.1f}"
    text = f"**{text}**" if bar.met(value) else text
    return f"{text} ({full:.0f})" if full == full else text


def table_bars(
    rows: Sequence[Row], methods: Sequence[str], last: int, bars: Sequence[Bar] = BARS
) -> str:
    """A line a method, a column a bar; in brackets full runs between the same cycles."""
    asked = ["bar", *(f"{'≥' if bar.least else '≤'} {bar.bound:g} {bar.unit}" for bar in bars)]

    def told_of(name: str, bar: Bar) -> str:
        values = [of(rows, name, last) for of in (bar.value, bar.full) if of]
        return told(bar, *values)

    lines = [
        [name, *(told_of(name, bar) for bar in bars)]
        for name in methods
        if finished(rows, name, last)
    ]
    return table(["way", *(bar.words for bar in bars)], [asked, *lines])
