"""Make docs/settlement-rivals.md and its picture: ``python -m validation.settlement_rivals_page``.

The page is ``settlement_rivals_page.md`` beside this file with tables and numbers put in.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.page_text import page_filled, table
from validation.settlement_bars import (
    settlement_of,
    settlement_total,
    sides_compared,
    table_bars,
)
from validation.settlement_ensemble import COARSE, CONFINED
from validation.settlement_ensemble_page import short
from validation.settlement_ensemble_reading import nested, student
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import HEALED, K_I, METHODS, Row
from validation.settlement_rivals_budget import JUMPS, PARTS, PLACE, TWIN
from validation.settlement_rivals_budget_tables import (
    pm,
    refused,
    scatter,
    table_budget,
    table_jumps,
)
from validation.settlement_rivals_healing import by_healing, table_healing, table_transient
from validation.settlement_rivals_picture import draw, shown
from validation.settlement_rivals_reading import (
    FIGURES,
    beside,
    chaos,
    cost,
    finished,
    judged,
    of_place,
    profile_chaos,
    profile_error,
    reference,
    rows_of,
)
from validation.settlement_rivals_reference import LAWS, law_name
from validation.settlement_rivals_runs import MEMBERS, SEEDS, record_read
from validation.settlement_rivals_studies import STUDIES
from validation.student import interval

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "settlement-rivals.md"
PAPER_PICTURE = PAGE.with_name("settlement-rivals-paper.png")
STEPS = COARSE.scene(1).steps_per_cycle
RUN = ("rivals", "healing", "budget")
"""Parts of the record whose cost is not the ensemble's."""
SCHEDULES = tuple(m.jumps for m in METHODS if m.family == "procedure")


def table_methods(rows: Sequence[Row], last: int) -> str:
    """A line for each method: cost and errors, bold where the packings agree that it is off."""
    truth = reference(rows, last)
    whole, full = cost(truth), last - K_I
    head = [
        "way to the last cycle", "packings", "cycles computed", "steps, %", "CPU s", "cheaper by",
        "settlement", "coordination number", "density profile", "elastic deflection",
        "piston stiffness",
    ]  # fmt: skip
    lines = [
        ["every cycle (the reference)", f"{len(SEEDS)} x 2", str(full), "100", f"{whole:.0f}", "1",
         *(f"± {100 * chaos(rows, last, key):.0f} %" for key in ("settlement", "coordination")),
         f"{100 * profile_chaos(rows, last):.1f} %",
         *(f"± {100 * chaos(rows, last, key):.0f} %" for key in ("deflection", "stiffness"))]
    ]  # fmt: skip
    for name, _ in shown():
        mine = finished(rows, name, last)
        if not mine:
            continue
        computed = float(np.mean([row["computed"] for row in mine]))
        steps = 100 * computed * mine[0].get("steps_per_cycle", STEPS) / (full * STEPS)
        cells = {}
        for key in FIGURES:
            found = judged(rows, name, last, key)
            cells[key] = "-" if found is None else pm(found.error, 100, 0, " %", bold=True)
        profile = profile_error(rows, name, last)
        lines.append(
            [name, str(len({row["seed"] for row in mine})), f"{computed:.0f}", f"{steps:.0f}",
             f"{cost(mine):.0f}", f"{whole / cost(mine):.1f}",
             cells["settlement"], cells["coordination"],
             f"{100 * float(profile.mean()):.1f} %" if len(profile) else "-",
             cells["deflection"], cells["stiffness"]]
        )  # fmt: skip
    return table(head, lines)


def table_refused(rows: Sequence[Row], last: int) -> str:
    """Which methods did not come to the end, and what was said."""
    lines = []
    for method in METHODS:
        mine = [row for row in rows_of(rows, "rivals", method.name, last) if row["refused"]]
        for why in dict.fromkeys(said(row["refused"]) for row in mine):
            count = sum(said(row["refused"]) == why for row in mine)
            reached = max(row["computed"] for row in mine if said(row["refused"]) == why)
            of = len(rows_of(rows, "rivals", method.name, last))
            lines.append([method.name, f"{count} of {of}", str(K_I + reached), why])
    return table(["way", "packings", "kept up to cycle", "what was said"], lines)


def missing(rows: Sequence[Row], last: int) -> str:
    """In words, which runs the record lacks: methods by packings, parts of the budget by places."""
    plans = [(method.name, "rivals", last, len(SEEDS)) for method in METHODS]
    plans += [(method.name, "healing", last, len(SEEDS)) for method in HEALED]
    plans += [(part.name, "budget", PLACE, len(SEEDS) * len(MEMBERS)) for part in (*PARTS, *JUMPS)]
    lacking = [
        f"{name} ({made} of {planned})"
        for name, part, end, planned in plans
        if (made := len(rows_of(rows, part, name, end))) < planned
    ]
    return "; ".join(lacking) or "none"


def said(refused: str) -> str:
    """The reason without its figures, which differ from packing to packing."""
    why = refused.rpartition("sentinel line: ")[2].removeprefix("ERROR: ")
    for end in ("; Hertz", ": original", ". Please"):
        why = why.partition(end)[0]
    what, is_, bound = why.partition(" is 0.")
    return f"{what} is {bound.partition(', ')[2]}" if is_ else why


def table_null(rows: Sequence[Row], last: int) -> str:
    """Moving beside not moving, the same jumps, packing by packing."""
    lines = []
    for jumps in SCHEDULES:
        found = beside(rows, jumps, last)
        if found is not None:
            sizes = (f"{100 * float(np.abs(e).mean()):.0f} %" for e in (found.moved, found.still))
            lines.append(
                [str(jumps), str(len(found.moved)), pm(found.moved, 100, 0, " %", True),
                 pm(found.still, 100, 0, " %", True), pm(found.difference, 100, 0, " %", True),
                 *sizes, pm(found.nearer, 100, 0, " %", True),
                 f"{int((found.nearer > 0).sum())} of {len(found.nearer)}"]
            )  # fmt: skip
    head = [
        "jumps", "packings", "error, moved", "error, nothing moved", "difference",
        "mean size, moved", "nothing moved", "moved is nearer by", "nearer in",
    ]  # fmt: skip
    return table(head, lines)


def verdict(rows: Sequence[Row], last: int) -> str:
    """In words, whether moving beats not moving by more than packings and chaos scatter."""
    lines = []
    for jumps in SCHEDULES:
        found = beside(rows, jumps, last)
        if found is None or len(found.moved) < 2:
            continue
        (moved, m), (still, s), (near, n) = map(interval, (found.moved, found.still, found.nearer))
        bias = {True: "is off by more than packings scatter", False: "can not be told from none"}
        told = [
            f"{jumps} jumps: the mean error with nothing moved {bias[abs(still) > s]}",
            f"that of moving {bias[abs(moved) > m]}",
        ]
        better = "better" if near > 0 else "worse"
        if abs(near) > n:
            told.append(f"**packing by packing moving is {better}**")
        else:
            told.append("**packing by packing moving is not better by more than it scatters**")
            if near > 0:
                told.append(f"about {packings_needed(found.nearer):,} packings could tell")
        lines.append("- " + "; ".join(told) + ".")
    return "\n".join(lines)


def packings_needed(gained: FloatArray) -> int:
    """Fewest packings n whose 95 % interval would leave out zero, should the mean and the standard
    deviation s stay as they are: t(n - 1) s / sqrt(n) <= |mean|, Student's t."""
    mean, deviation = abs(float(gained.mean())), float(gained.std(ddof=1))
    count = 2
    while student(count - 1) * deviation / count**0.5 > mean:
        count += 1
    return count


def jumps_lost(rows: Sequence[Row], last: int, family: str = "procedure") -> str:
    """In words, how many jumps of a family of methods were given up and why."""
    names = [method.name for method in METHODS if method.family == family and method.jumps]
    found = [row for name in names for row in rows_of(rows, "rivals", name, last)]
    lost, runs = [why for row in found for why in row["lost"]], len(found)
    lifts = sum("lifts the bed" in why for why in lost)
    relaxed = sum(why.startswith("relaxation") for why in lost)
    return (
        f"in {runs} runs {len(lost)} attempts failed, {lifts} for a law that lifts the bed, "
        f"{relaxed} for a relaxation that did not converge, {len(lost) - lifts - relaxed} else"
    )


def paper_scale(last: int, rows: Sequence[Row]) -> dict[str, str]:
    """What the record at paper scale has so far: bars, runs of each method, the reference.

    ``rows``: its lines, with the sides of full runs beside those of jumps.
    """
    study = STUDIES["confined"]
    names = [method.name for method in study.methods]
    made = [
        f"{method.name} ({len(rows_of(rows, 'rivals', method.name, last))} of "
        f"{study.runs_of(method) * study.kind.packings})"
        for method in study.methods
    ]
    methods = [*names, *(law_name(law, cycles) for law, cycles in LAWS)]
    truth = settlement_of(rows, last)
    return {
        "PAPER_BARS": table_bars(rows, methods, last),
        "PAPER_WAY": table_on_the_way(rows, "2 jumps, by history, profile", last),
        "PAPER_RUNS": "; ".join(made),
        "PAPER_MEAN": f"{1e6 * truth.mean:.0f}",
        "PAPER_TOTAL": f"{1e6 * settlement_total(rows, last):.0f}",
        "PAPER_GIVEN": f"{1e6 * truth.half_given:.1f}",
        "PAPER_MEMBERS": f"{truth.members} members of {truth.packings} packings",
    }


def table_on_the_way(rows: Sequence[Row], name: str, last: int) -> str:
    """Settlement of each run of a method less its packing's reference, where both tell it [um]."""
    mine, truth = rows_of(rows, "rivals", name, last), reference(rows, last)
    found = {}
    for row in mine:
        same = [one["settlement"] for one in truth if one["seed"] == row["seed"]]
        found[f"{row['seed']}-{row['member']}"] = {
            int(cycle): 1e6 * (value - float(np.mean([one[cycle] for one in same])))
            for cycle, value in row["settlement"].items()
            if same
        }
    cycles = sorted(set.intersection(*(set(errors) for errors in found.values())))
    lines = [[run, *(f"{errors[c]:+.1f}" for c in cycles)] for run, errors in found.items()]
    return table(["packing and member", *(f"cycle {c}" for c in cycles)], lines)


def page(rows: Sequence[Row], last: int = STUDIES["coarse"].last) -> str:
    """The page of a record."""
    truth = reference(rows, last)
    compared = sides_compared(rows, COARSE, EnsembleRecord())
    paper = sides_compared(record_read(STUDIES["confined"].record), CONFINED, EnsembleRecord())
    figure = FIGURES["settlement"]
    values = {
        seed: np.array([figure.value(row) for row in truth if row["seed"] == seed])
        for seed in SEEDS
    }
    found = nested(values)
    engines = ", ".join(dict.fromkeys(row["engine"] for row in rows if row.get("engine")))
    commits = ", ".join(dict.fromkeys(short(row["commit"]) for row in rows))
    parts = {
        "LAST": str(last),
        "MEAN": f"{1e6 * found.mean:.0f}",
        "BETWEEN": f"{1e6 * found.between:.0f}",
        "WITHIN": f"{1e6 * found.within:.0f}",
        "GIVEN": f"{1e6 * found.half_given:.0f}",
        "CHAOS": f"{100 * chaos(rows, last, 'settlement'):.0f}",
        "METHODS": table_methods(rows, last),
        **paper_scale(last, paper),
        "BARS": table_bars(compared, [method.name for method in METHODS], last),
        "MISSING": missing(rows, last),
        "REFUSED": table_refused(rows, last),
        "NULL": table_null(rows, last),
        "PLACES": str(len(of_place(rows, TWIN))),
        "LOST": jumps_lost(rows, last),
        "LOST_HISTORY": jumps_lost(rows, last, "history"),
        "VERDICT": verdict(rows, last),
        "BUDGET": table_budget(rows),
        "JUMPS": table_jumps(rows),
        "GIVEN_UP": refused(rows),
        "HEALING": table_healing(rows, last),
        "TRANSIENT": table_transient(
            [
                ("coarse", compared, [*(one.name for one in by_healing()), "10 jumps, by history"]),
                ("paper's", paper, ["5 growing jumps, by history, profile"]),
            ],
            last,
        ),
        "MINUTES": f"{sum(row.get('cpu_s', 0.0) for row in rows if row['part'] in RUN) / 60:.0f}",
        **scatter(rows),
        "ORIGIN": f"{rows[0]['machine']}; {engines}; commits {commits}.",
    }
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    rows = record_read()
    write_atomically(PAGE, page(rows))
    draw("coarse", PAGE.with_suffix(".png"))
    draw("confined", PAPER_PICTURE)


if __name__ == "__main__":
    main()
