"""Make ``docs/moves.md`` and its picture: ``python -m validation.move_study_page``.

The page is ``move_study_page.md`` beside this file, with tables and numbers of the record put in.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from adapters.moves import moves_known
from adapters.run_folder import write_atomically
from validation.move_study import Row, record_read
from validation.move_study_engine import FULL, PAPER, SMALL, TWIN, Judged
from validation.move_study_members import rows_of_members
from validation.move_study_offline import OTHER_MEMBER
from validation.move_study_paper import first_rate, later_rate, words_of
from validation.move_study_picture import draw
from validation.move_study_reading import (
    CONTINUES,
    SCALES,
    SPREADS,
    beds,
    change,
    cycles,
    goes_on,
    median_of,
    offline_rows,
    over_beds,
    rows_of_kind,
    way_to_end,
    ways_of,
    wins,
)
from validation.page_text import page_filled, table
from validation.settlement_ensemble_record import EnsembleRecord

TEMPLATE = Path(__file__).with_name("move_study_page.md")
PAGE = Path(__file__).parents[1] / "docs" / "moves.md"
ERRORS = ("field", "field_relaxed", "median", "median_relaxed")
"""Errors of the offline table, before and after the relaxation."""
TOLD = (1, 2, 3, 5, 10)
"""Cycles behind the jump that are told one by one."""


def way_name(way: str) -> str:
    """A way as code, anything else as it is."""
    return f"`{way}`" if way in moves_known() else way


def offline_table(rows: Sequence[Row]) -> str:
    """A line for each scale and way."""
    head = [
        "bed", "way", "field", "relaxed", "grain", "relaxed", "lengths 50, 90, 99 %",
        "contacts a grain: estimate", "relaxed", "truth",
        "greatest overlap, µm: estimate", "relaxed", "pushed, µm", "CPU, ms",
    ]  # fmt: skip
    lines = []
    for scale in SCALES:
        for way in ways_of(rows):
            mine = offline_rows(rows, scale, way)
            if not mine:
                continue
            quantiles = np.median([row["quantiles"] for row in mine], axis=0)
            pushed = (1e6 * median_of(mine, f"pushed_{which}") for which in ("median", "most"))
            lines.append(
                [
                    f"{scale} ({len(mine)})", way_name(way),
                    *(f"{median_of(mine, key):.2f}" for key in ERRORS),
                    ", ".join(f"{value:.2f}" for value in quantiles),
                    *(f"{median_of(mine, f'coordination_{when}'):.2f}"
                      for when in ("estimated", "relaxed", "true")),
                    f"{1e6 * median_of(mine, 'overlap_max_estimated'):.0f}",
                    f"{1e6 * median_of(mine, 'overlap_max_relaxed'):.2f}",
                    ", ".join(f"{value:.0f}" for value in pushed),
                    ", ".join(f"{1e3 * median_of(mine, key):.0f}" for key in ("move_s", "relax_s")),
                ]
            )  # fmt: skip
    return table(head, lines)


def jumps_table(rows: Sequence[Row]) -> str:
    """Error of the law's mean and of three fields by length of window and jump."""
    shown = ("per-grain", "smoothed", "shrunk")
    head = [
        "bed", "k", "h", "windows", "settlement in the jump, µm", "error of it: mean", "rms",
        *(f"`{way}`, relaxed" for way in shown),
    ]  # fmt: skip
    lines = []
    for scale in SCALES:
        for k, h in sorted({(row["jump"][1], row["jump"][2]) for row in rows}):
            of_way = {
                way: [r for r in offline_rows(rows, scale, way) if r["jump"][1:] == [k, h]]
                for way in shown
            }
            law = of_way["shrunk"]
            if not law:
                continue
            errors = np.array([row["mean_error"] for row in law])
            lines.append(
                [
                    scale, str(k), str(h), str(len(law)),
                    f"{np.mean([row['settlement_um'] for row in law]):.0f}",
                    f"{100 * errors.mean():+.0f} %",
                    f"{100 * np.sqrt((errors**2).mean()):.0f} %",
                    *(f"{median_of(of_way[way], 'field_relaxed'):.2f}" for way in shown),
                ]
            )  # fmt: skip
    return table(head, lines)


def mean_missed(rows: Sequence[Row], scale: str) -> str:
    """Root mean square error of the mean settlement of a jump, any way that keeps the law's."""
    errors = [row["mean_error"] for row in offline_rows(rows, scale, "shrunk")]
    return f"{100 * float(np.sqrt(np.mean(np.square(errors)))):.0f} %"


def told(pair: tuple[float, float], digits: int = 0, unit: str = "") -> str:
    """A mean with its standard error, where there is one."""
    sign = "+" if unit else ""
    mean = f"{pair[0]:{sign}.{digits}f}"
    return (mean if np.isnan(pair[1]) else f"{mean} ± {pair[1]:.{digits}f}") + unit


def engine_table(rows: Sequence[Row]) -> str:
    """A line for each way: the cycles after the jump, beside those before."""
    head = [
        "way", "settled, µm", "µm a cycle: 1", "later", "coordination number",
        "elastic deflection", "piston stiffness", "overlap", "contacts a grain: estimate",
        "relaxed", "CPU s",
    ]  # fmt: skip
    measures = ("coordination_number", "elastic_deflection", "piston_stiffness", "maximum_overlap")
    lines = []
    for way in ways_of(rows):
        mine = beds(rows, way)
        contacts = ["", ""]
        if "relaxation" in mine[0]:
            contacts = [
                f"{np.mean([r['relaxation'][when]['coordination_with_walls'] for r in mine]):.2f}"
                for when in ("estimated", "relaxed")
            ]
        lines.append(
            [
                way_name(way),
                told(over_beds(mine, lambda row: 1e6 * way_to_end(row))),
                told(over_beds(mine, lambda row: 1e6 * first_rate(row))),
                told(over_beds(mine, lambda row: 1e6 * later_rate(row)), 1),
                *(told(over_beds(mine, partial(percent_change, name)), 0, " %")
                  for name in measures),
                *contacts,
                f"{np.median([row['cpu_s'] for row in mine]):.1f}",
            ]
        )  # fmt: skip
    return table(head, lines)


def percent_change(measure: str, row: Row) -> float:
    """Mean after the jump beside that before [%]."""
    return 100 * change(row, measure)


def healing_table(rows: Sequence[Row]) -> str:
    """Settlement of single cycles behind the jump [µm]."""
    shown = [cycle for cycle in TOLD if cycle <= len(rows[0]["after"]["settlement"])]
    lines = []
    for way in ways_of(rows):
        path = 1e6 * np.mean([cycles(row, "after", "rate") for row in beds(rows, way)], axis=0)
        lines.append([way_name(way), *(f"{path[cycle - 1]:.1f}" for cycle in shown)])
    return table(["cycle", *map(str, shown)], lines)


FIRST_CYCLES = 3
"""Cycles behind the jump that are told one by one where the piston's force is told."""


def first_cycles_table(rows: Sequence[Row]) -> str:
    """Force error of the piston by cycle, and what else cycle 1 has beside the cycles before."""
    lines = []
    for way in ways_of(rows):
        mine = beds(rows, way)
        before = np.mean([cycles(row, "before", "force_error").mean() for row in mine])
        after = np.mean([cycles(row, "after", "force_error") for row in mine], axis=0)
        errors = [before, *after[:FIRST_CYCLES], after[FIRST_CYCLES:].mean()]
        lines.append(
            [
                way_name(way),
                *(f"{100 * error:.2f}" for error in errors),
                *(told(over_beds(mine, partial(first_change, measure)), 0, " %")
                  for measure in ("maximum_overlap", "coordination_number", "elastic_deflection")),
            ]
        )  # fmt: skip
    head = [
        "way", "force error before, %", *(str(cycle + 1) for cycle in range(FIRST_CYCLES)), "later",
        "cycle 1: greatest overlap", "coordination number", "elastic deflection",
    ]  # fmt: skip
    return table(head, lines)


def first_change(measure: str, row: Row) -> float:
    """First cycle after the jump beside the mean of those before [%]."""
    return 100 * float(cycles(row, "after", measure)[0] / cycles(row, "before", measure).mean() - 1)


def rate_before(rows: Sequence[Row]) -> str:
    """Settlement a cycle before the jump [µm]."""
    first = beds(rows, rows[0]["move"])
    return told(over_beds(first, lambda row: 1e6 * float(cycles(row, "before", "rate").mean())), 1)


def continues_table(rows: Sequence[Row]) -> str:
    """Shares of beds, a line a way."""
    names = ["settlement rate", *(name.replace("_", " ") for name in CONTINUES[1:]), "all four"]
    lines = []
    for way in ways_of(rows):
        held = np.array([[goes_on(row, name) for name in CONTINUES] for row in beds(rows, way)])
        shares = [*held.mean(axis=0), held.all(axis=1).mean()]
        lines.append([way_name(way), *(f"{100 * share:.0f} %" for share in shares)])
    return table(["way", *names], lines)


def held_share(rows: Sequence[Row], way: str) -> str:
    """In how many beds all four go on as before."""
    mine = beds(rows, way)
    held = sum(all(goes_on(row, name) for name in CONTINUES) for row in mine)
    return f"{held} of {len(mine)}"


def origin(rows: Sequence[Row]) -> str:
    """Machines, engine and commits of the record."""
    machines = sorted({row["machine"] for row in rows})
    engines = sorted({row["engine"] for row in rows if "engine" in row})
    commits = sorted({row["commit"][:7] for row in rows})
    return f"{'; '.join(machines)}; {'; '.join(engines)}; commits {', '.join(commits)}."


def jump_told(judged: Judged) -> str:
    """Window, jump, and cycles behind it."""
    return (
        f"a window of {judged.k} cycles behind the first {judged.k_i}, one jump of {judged.h}, "
        f"{judged.after} cycles"
    )


def page(offline: Sequence[Row], engine: Sequence[Row]) -> str:
    """The page, with every mark ``{{NAME}}`` of the template replaced."""

    def counted(scale: str, key: str) -> str:
        return "{} of {}".format(*wins(offline, scale, "shrunk", "smoothed", key))

    small, paper = (rows_of_kind(engine, judged.kind.name) for judged in (SMALL, PAPER))
    (seed,) = PAPER.seeds
    with_members = [*paper, *rows_of_members(PAPER, seed, EnsembleRecord())]
    parts = {
        "WINDOWS": str(len({(row["run"], *row["jump"]) for row in offline})),
        "OFFLINE": offline_table(offline),
        "JUMPS": jumps_table(offline),
        "OTHER": OTHER_MEMBER.capitalize(),
        "MEAN_PAPER": mean_missed(offline, "paper scale"),
        "MEAN_SMALL": mean_missed(offline, "small bed"),
        "WINS_PAPER": counted("paper scale", "field_relaxed"),
        "WINS_SMALL": counted("small bed", "field_relaxed"),
        "GRAIN_PAPER": counted("paper scale", "median_relaxed"),
        "GRAIN_SMALL": counted("small bed", "median_relaxed"),
        "BEDS": str(len(beds(small, FULL))),
        "SMALL_JUMP": jump_told(SMALL),
        "PAPER_JUMP": jump_told(PAPER),
        "SPREADS": f"{SPREADS:.0f}",
        "SMALL_BEFORE": rate_before(small),
        "PAPER_BEFORE": rate_before(paper),
        "ENGINE_SMALL": engine_table(small),
        "ENGINE_PAPER": engine_table(with_members),
        "FIRST_SMALL": first_cycles_table(small),
        "FIRST_PAPER": first_cycles_table(with_members),
        "HEALING_SMALL": healing_table(small),
        "HEALING_PAPER": healing_table(with_members),
        "CONTINUES": continues_table(small),
        "FULL_HELD": held_share(small, FULL),
        "TWIN_HELD": held_share(small, TWIN),
        "SMALL_RISE": f"{1e3 * float(np.mean([row['rise'] for row in small])):.0f}",
        "PAPER_RISE": f"{1e3 * float(np.mean([row['rise'] for row in paper])):.1f}",
        "STILL_FIRST": f"{1e6 * over_beds(beds(small, 'still'), first_rate)[0]:.1f}",
        **words_of(offline, with_members),
        "ORIGIN": origin([*offline, *engine]),
    }
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    offline, engine = record_read("offline"), record_read("engine")
    write_atomically(PAGE, page(offline, engine))
    draw(offline, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
