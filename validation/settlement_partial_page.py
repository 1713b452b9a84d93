"""Fig. 13, docs/settlement-partial.md: ``python -m validation.settlement_partial_page``.

The bed under a piston that covers a part of it: Fig. 13 of Karrech et al. (2007) beside full runs
of three packings, from the ensemble and from the record of the study ``partial``
(`validation.settlement_rivals_runs`).  Seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.jump_seating import HUNG
from adapters.run_folder import write_atomically
from validation.page_text import page_filled, table
from validation.settlement_bars import (
    BARS_PARTIAL,
    gained_time,
    gained_time_even,
    runs_by_packing,
    settlement_of,
    settlement_total,
    sides_compared,
)
from validation.settlement_bars import table_bars as bars_table
from validation.settlement_ensemble import CONFINED, PARTIAL, Kind
from validation.settlement_ensemble_page import short
from validation.settlement_ensemble_picture import COLOURS
from validation.settlement_ensemble_reading import (
    at_cycle,
    column_mean,
    column_since,
    curves,
)
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_partial_bearing import table_bearing, table_seating
from validation.settlement_partial_waits import table_waits
from validation.settlement_rivals import Row
from validation.settlement_rivals_reading import (
    FIGURES,
    finished,
    mean_over_packings,
    means_by_seed,
    reference,
)
from validation.settlement_rivals_reference import LAWS, law_name
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES
from validation.student import interval

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "settlement-partial.md"
STUDY = STUDIES["partial"]
PAPER_GAINED, PAPER_ERROR = 120.0, 8.0
"""Gained time and error of the settlement that the paper tells of Fig. 13d [%]."""
NAMES = (*(method.name for method in STUDY.methods), *(law_name(*law) for law in LAWS))
SHORT, BEST = (STUDIES["partial"].methods[place].name for place in (-2, -1))
"""Ways that wait for four cycles: by the default move, and by a mean profile."""
HANGING = 2
"""Seed of the packing whose piston hangs by its rim."""
SAME_RANGE = 0.05
"""Coordination numbers that differ by no larger part are in the same range."""


def way(name: str) -> str:
    """A method's name with one jump in the singular."""
    return name.replace("1 jumps", "1 jump")


def errors(rows: Sequence[Row], name: str, last: int = STUDY.last) -> dict[int, float]:
    """Settlement behind k_i less the packing's full run, over the mean total settlement [%]."""
    figure, total = FIGURES["settlement"], settlement_total(rows, last)
    truth = means_by_seed(reference(rows, last), figure)
    mine = means_by_seed(finished(rows, name, last), figure)
    return {seed: 100 * (value - truth[seed]) / total for seed, value in mine.items()}


def coordination_errors(rows: Sequence[Row], name: str, last: int = STUDY.last) -> list[float]:
    """Coordination number over the packing's full run's, less one [%]; none of a law."""
    figure = FIGURES["coordination"]
    mine = [row for row in finished(rows, name, last) if "coordination_number" in _state(row)]
    truth = means_by_seed(reference(rows, last), figure)
    return [100 * (value / truth[seed] - 1) for seed, value in means_by_seed(mine, figure).items()]


def _state(row: Row) -> dict[str, Any]:
    return row.get("state") or {}


def slope(kind: Kind, record: EnsembleRecord, first: int, last: int) -> float:
    """Settlement a unit of ln N between two cycles, mean over all runs that came there [m]."""
    gains = [
        (curve["settlement"][last - 1] - curve["settlement"][first - 1]) / np.log(last / first)
        for piece, curve in curves(kind, record).items()
        if piece.member is not None and curve["cycle"][-1] >= last
    ]
    return float(np.mean(gains))


def coordination(kind: Kind, record: EnsembleRecord, cycle: int) -> float:
    """Mean coordination number of the ensemble over the ten cycles up to one."""
    found = at_cycle(kind, curves(kind, record), column_mean("coordination_number"), cycle)
    assert found is not None
    return found.mean


def table_claims(rows: Sequence[Row], record: EnsembleRecord) -> str:
    """What the paper says of Fig. 13, and what came, by a stated rule."""
    last, k_i = STUDY.last, CONFINED.k_i
    partly, confined = (coordination(kind, record, last) for kind in (PARTIAL, CONFINED))
    steep = [1e6 * slope(kind, record, k_i, last) for kind in (PARTIAL, CONFINED)]
    near = min(
        (name for name in NAMES if "jump" in name and finished(rows, name, last)),
        key=lambda name: abs(gained_time(rows, name, last) - PAPER_GAINED),
    )
    found = list(errors(rows, near).values())
    gained, off = gained_time(rows, near, last), float(np.mean(found))
    contacts = float(np.mean(coordination_errors(rows, near)))
    lines = [
        ["13a", "the coordination number stays in the range of the confined bed",
         f"{partly:.2f} beside {confined:.2f} at cycle {last}",
         "yes" if abs(partly / confined - 1) <= SAME_RANGE else "no"],
        ["13b", "the slope of the settlement is higher than the confined bed's",
         f"{steep[0]:.0f} beside {steep[1]:.0f} µm a unit of ln N, cycles {k_i} to {last}",
         "yes" if steep[0] > steep[1] else "no"],
        ["13d", f"the settlement errs by {PAPER_ERROR:g} % at a gained time of {PAPER_GAINED:g} %",
         f"by {abs(off):.1f} % in the mean of {len(found)} packings, "
         f"{min(map(abs, found)):.0f} to {max(map(abs, found)):.0f} % in each, at {gained:.0f} % "
         f"({way(near)}); coordination number by {abs(contacts):.1f} %",
         "yes" if abs(off) <= PAPER_ERROR else "no"],
    ]  # fmt: skip
    return table(["figure", "the paper says", "here", "holds"], lines)


def table_packings(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """Settlement behind k_i of each packing [um], and what errors come to over the total."""
    figure = FIGURES["settlement"]
    truth = means_by_seed(reference(rows, last), figure)
    head = ["way", "cycles computed", "gained time", *(f"packing {seed}, µm" for seed in truth),
            "error over the total settlement"]  # fmt: skip
    whole = str(last - STUDY.kind.k_i)
    lines = [["every cycle", whole, "0 %", *(f"{1e6 * one:.1f}" for one in truth.values()), "-"]]
    for name in NAMES:
        mine = finished(rows, name, last)
        if not mine:
            continue
        values = means_by_seed(mine, figure)
        mean, half = interval(list(errors(rows, name).values()))
        lines.append([
            way(name), f"{mean_over_packings(mine, 'computed'):.0f}",
            f"{gained_time(rows, name, last):.0f} %",
            *(f"{1e6 * values[seed]:.1f}" if seed in values else "-" for seed in truth),
            f"{mean:+.1f} ± {half:.0f} %" if half == half else f"{mean:+.1f} %",
        ])  # fmt: skip
    return table(head, lines)


def off(rows: Sequence[Row], name: str, seed: int, last: int = STUDY.last) -> float:
    """Settlement of a packing less that of its full runs [m]."""
    return errors(rows, name, last)[seed] / 100 * settlement_total(rows, last)


def of_member(rows: Sequence[Row], name: str, member: int) -> list[Row]:
    """Rows without those of a method's other members."""
    return [row for row in rows if row["method"] != name or row["member"] == member]


def behind_jump(row: Row) -> float:
    """What the ten cycles behind the one jump of a run settle [m]."""
    (side,) = row["sides"]
    return float(sum(side["after"]["settlement"]))


def shortly_told(rows: Sequence[Row], last: int = STUDY.last) -> dict[str, str]:
    """What the page tells of runs that wait for four cycles, by the default move and by `BEST`:
    gained times and errors over the total [%], and packing `HANGING` [um]."""
    mean = {
        name: float(np.mean(list(errors(of_rows, way, last).values())))
        for name, of_rows, way in (
            ("SHORT_ERROR", rows, SHORT),
            ("BEST_ERROR", rows, BEST),
            ("FIRST_ERROR", of_member(rows, BEST, 0), BEST),
            ("SECOND_ERROR", of_member(rows, BEST, 1), BEST),
        )
    }
    hung = [row for row in finished(rows, BEST, last) if row["seed"] == HANGING]
    return {
        **{name: f"{abs(value):.1f}" for name, value in mean.items()},
        "BEST_HALF": f"{interval(list(errors(rows, BEST, last).values()))[1]:.0f}",
        "BEST_GAINED": f"{gained_time(rows, BEST, last):.0f}",
        "BEST_EVEN": f"{gained_time_even(rows, BEST, last):.0f}",
        "SHORT_OFF": f"{1e6 * off(rows, SHORT, HANGING):.0f}",
        "BEST_OFF": " and ".join(
            f"{1e6 * off(of_member(rows, BEST, member), BEST, HANGING):.0f}" for member in (0, 1)
        ),
        "BEST_MOVED": " and ".join(f"{1e6 * row['moved'][0][1]:.0f}" for row in hung),
        "BEST_BEHIND": " and ".join(f"{1e6 * behind_jump(row):.0f}" for row in hung),
    }


def members_apart(rows: Sequence[Row], last: int = STUDY.last) -> list[float]:
    """By how much the full runs of each packing that has two part in settlement [m]."""
    found = runs_by_packing(reference(rows, last), "settlement")
    return [float(np.ptp(runs)) for runs in found.values() if len(runs) > 1]


def page(rows: Sequence[Row], record: EnsembleRecord) -> str:
    """The page of a record."""
    last = STUDY.last
    begun = at_cycle(PARTIAL, curves(PARTIAL, record), column_since("settlement", 1.0), last)
    assert begun is not None
    compared = sides_compared(rows, PARTIAL, record)
    text = bars_table(compared, NAMES, last, BARS_PARTIAL)
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), {
        "CLAIMS": table_claims(rows, record), "PACKINGS": table_packings(rows),
        "BARS": way(text), "BEARING": table_bearing(record),
        "SEATING": table_seating(record), "WAITS": table_waits(record),
        **shortly_told(rows), "HUNG": f"{HUNG:g}", "LAST": str(last), "K_I": str(STUDY.kind.k_i),
        "HALF": f"{1e6 * settlement_of(rows, last).half_given:.0f}",
        "APART": ", ".join(f"{1e6 * one:.0f}" for one in members_apart(rows)),
        "TOTAL": f"{1e6 * settlement_total(rows, last):.0f}", "MEAN": f"{1e6 * begun.mean:.0f}",
        "ENGINES": ", ".join(dict.fromkeys(row["engine"] for row in rows if row.get("engine"))),
        "MACHINES": "; ".join(dict.fromkeys(row["machine"] for row in rows)),
        "COMMITS": ", ".join(dict.fromkeys(short(row["commit"]) for row in rows)),
        "HOURS": f"{sum(row['cpu_s'] for row in rows if row['part'] == 'rivals') / 3600:.1f}",
    })  # fmt: skip


def draw(rows: Sequence[Row], record: EnsembleRecord, target: Path) -> None:
    """Fig. 13: coordination number and settlement against cycles, errors against gained time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(9.5, 6.4), layout="constrained")
    panels = (("coordination_number", 1.0, "coordination number"),
              ("settlement", 1e6, "settlement since the rain [µm]"))  # fmt: skip
    for axis, (column, factor, words), letter in zip(axes[0], panels, "ab", strict=True):
        for piece, curve in curves(PARTIAL, record).items():
            if piece.member is not None:
                label = f"packing {piece.seed}" if piece.member == 0 else None
                axis.plot(curve["cycle"], factor * curve[column], color=COLOURS[piece.seed - 1],
                          lw=1 / (1 + piece.member), label=label)  # fmt: skip
        for curve in curves(CONFINED, record).values():
            upto = curve["cycle"] <= STUDY.last
            axis.plot(curve["cycle"][upto], factor * curve[column][upto], color="0.8", lw=0.7,
                      zorder=0)  # fmt: skip
        axis.set(title=f"Fig. 13{letter} (grey: confined)", xlabel="load cycle", ylabel=words)
        axis.legend(frameon=False, fontsize=8)
    for axis, found, words, letter in (
        (axes[1, 0], coordination_errors, "coordination number", "c"),
        (axes[1, 1], lambda *of: list(errors(*of).values()), "settlement, over the total", "d"),
    ):
        for name in NAMES:
            values = found(rows, name)
            if values:
                gained = gained_time(rows, name, STUDY.last)
                (line,) = axis.plot([gained], [abs(np.mean(values))], "o", label=way(name))
                axis.plot([gained] * len(values), np.abs(values), ".", color=line.get_color())
        axis.set(
            title=f"Fig. 13{letter}", xlabel="gained time [%]", ylabel=f"error of the {words} [%]"
        )
        axis.set_ylim(bottom=0)
    axes[1, 1].plot([PAPER_GAINED], [PAPER_ERROR], "k*", ms=11, label="the paper (one run)")
    axes[1, 1].legend(frameon=False, fontsize=7)
    figure.savefig(target, dpi=90, metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    """Write page and picture."""
    rows, record = record_read(STUDY.record), EnsembleRecord()
    write_atomically(PAGE, page(rows, record))
    draw(rows, record, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
