"""README's table of error against cost at paper scale: ``python -m validation.settlement_readme``.

Prints the lines that `tests/golden/test_settlement_rivals_page.py` looks for in README.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.page_text import table
from validation.settlement_bars import gained_time, gained_time_even
from validation.settlement_rivals import Row
from validation.settlement_rivals_reading import chaos, finished, judged, reference
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

STUDY = STUDIES["confined"]
NAMES = (
    "5 growing jumps, by history, profile",
    "5 growing jumps, by history, profile, step x 2",
    "5 growing jumps, nothing moved",
    "tolerance 0.02",
    "step x 2",
    "density x 10",
    "100 Hz",
    "E/10",
    "E/100",
    "law log, 100 cycles",
)
"""Ways shown, the reference last."""
SHORT = ("settlement", "coordination", "deflection")


def table_readme(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """A line a way: cost and errors of the mean, for the settlement with half of Student's 95 %
    interval over packings, for every cycle that of one run a packing, by chaos alone; ``rows`` of
    the record at paper scale."""
    truth = reference(rows, last)
    lines = []
    for name in NAMES:
        mine = finished(rows, name, last)
        errors = {key: judged(rows, name, last, key) for key in SHORT}
        settled = errors["settlement"]
        if settled is None:
            continue
        half_settled = "" if settled.half != settled.half else f" ± {100 * settled.half:.0f}"
        lines.append(
            [
                name, str(len(mine)), f"{np.mean([row['computed'] for row in mine]):.0f}",
                f"{1 + gained_time(rows, name, last) / 100:.1f}",
                f"{1 + gained_time_even(rows, name, last) / 100:.1f}",
                f"{100 * settled.mean:+.0f}{half_settled} %",
                *(f"{100 * one.mean:+.0f} %" if (one := errors[key]) else "" for key in SHORT[1:]),
            ]
        )  # fmt: skip
    whole = f"0 ± {100 * chaos(rows, last, 'settlement'):.0f} %"
    lines.append(["every cycle", str(len(truth)), f"{truth[0]['computed']}", "1", "1", whole,
                  "0", "0"])  # fmt: skip
    head = [
        f"way to cycle {last}", "runs", "cycles computed", "cheaper by", "at equal cost a step",
        "settlement", "coordination number", "elastic deflection",
    ]  # fmt: skip
    return table(head, lines)


def main() -> None:
    """Print the table."""
    print(table_readme(record_read(STUDY.record)))


if __name__ == "__main__":
    main()
