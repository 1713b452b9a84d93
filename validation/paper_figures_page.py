"""docs/paper-figures.md and its pictures, from validation/results/paper-figures.jsonl.

python -m validation.paper_figures_page
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adapters.run_folder import write_atomically
from validation.page_text import page_filled, table
from validation.paper_figures import (
    FIRST,
    FIRST_LONG,
    JUMPS,
    LATE_RUNS,
    LAWS,
    LONG_RUN,
    NOTHING,
    OTHER,
    PAPER_LARGEST,
    PAPER_LAST,
    PAPER_LONG,
    RUN,
    WINDOWS,
    Row,
    rows_read,
)
from validation.paper_figures_picture import draw
from validation.paper_figures_picture_jumps import draw as draw_jumps
from validation.paper_figures_verdicts import (
    verdict_exponents,
    verdict_fall,
    verdict_near,
    verdict_of,
    verdict_share,
)

PAGE = Path(__file__).parents[1] / "docs" / "paper-figures.md"
TEXT = Path(__file__).with_suffix(".md")
DENOMINATORS = {
    "coordinates": "coordinates",
    "loading": "displacement since cycle 0",
    "of_jump": "displacement of the jump",
}
PAPERS = ("coordinates", "loading")
"""Denominators that eq. 22 can be read as."""
PICTURE_JUMPS = PAGE.with_name("paper-figures-jumps.png")
BED = (RUN, *LATE_RUNS)
"""Full runs of the paper's bed: to k_i of 200, and at 500."""
LONG_WINDOW = PAPER_LONG[0]
EXPONENT_FROM = 10
"""k from which on exponents are fitted."""
WAYS = {
    "before": "before the jump",
    "estimate": "estimate",
    "karrech2007": "eq. 29 as in the paper, frontier held",
    "smallest-move": "smallest move (ours)",
}
METHODS = (NOTHING, *LAWS, OTHER)


def figure_rows(rows: Sequence[Row], figure: str) -> list[Row]:
    """The rows of a figure."""
    return [row for row in rows if row["figure"] == figure]


def jump_rows(rows: Sequence[Row], runs: Sequence[str] = BED) -> list[Row]:
    """Jumps of Figs 6 and 7 on full runs of a bed."""
    return [row for row in figure_rows(rows, "6, 7") if row["run"] in runs]


def exponent(values: Sequence[float]) -> float:
    """Slope of ln value over ln k, the last value that of k = len."""
    k = np.arange(1, len(values) + 1)[EXPONENT_FROM - 1 :]
    return float(np.polyfit(np.log(k), np.log(values[EXPONENT_FROM - 1 :]), 1)[0])


def errors_of(
    rows: Sequence[Row],
    denominator: str,
    method: str,
    k_i: int | None = None,
    k_least: int = 0,
    runs: Sequence[str] = BED,
) -> list[float]:
    """E_r of a method over the jumps with ``k_i`` and windows of ``k_least`` cycles or more."""
    return [
        row[denominator][method]
        for row in jump_rows(rows, runs)
        if k_i in (None, row["jump"][0])
        and row["jump"][1] >= k_least
        and method in row[denominator]
    ]


def share_rising(rows: Sequence[Row], denominator: str, method: str, axis: int) -> tuple[int, int]:
    """How often E_r rises from one k (axis 1) or h (axis 2) to the next, and of how many."""
    at = {(row["run"], *row["jump"]): row[denominator][method] for row in jump_rows(rows)}
    grid = (FIRST_LONG, WINDOWS, JUMPS)[axis]
    up = []
    for (run, *jump), error in at.items():
        place = grid.index(jump[axis])
        if place + 1 < len(grid):
            further = (run, *jump[:axis], grid[place + 1], *jump[axis + 1 :])
            if further in at:
                up.append(at[further] > error)
    return sum(up), len(up)


def wins(rows: Sequence[Row], better: str, than: str, runs: Sequence[str] = BED) -> int:
    """Jumps where one method is nearer than another."""
    return sum(row["of_jump"][better] < row["of_jump"][than] for row in jump_rows(rows, runs))


def per_cent(value: float) -> str:
    """A share in per cent, two digits."""
    return f"{100 * value:.2g} %" if value < 0.995 else f"{100 * value:.0f} %"


def errors_table(
    rows: Sequence[Row], runs: Sequence[str] = BED, keys: int = len(DENOMINATORS)
) -> str:
    """Largest E_r by denominator (so many of them), method and k_i."""
    lines = []
    for key, words in list(DENOMINATORS.items())[:keys]:
        for method in METHODS:
            cells = []
            for k_i in FIRST_LONG:
                every = errors_of(rows, key, method, k_i, runs=runs)
                long = errors_of(rows, key, method, k_i, LONG_WINDOW, runs)
                cells.append(f"{per_cent(max(every))} ({per_cent(max(long))})" if long else "-")
            if set(cells) != {"-"}:
                lines.append([words, method, *cells])
    return table(["denominator", "method", *(f"kᵢ = {k_i}" for k_i in FIRST_LONG)], lines)


def largest_printed(law: str) -> str:
    """The paper's largest E_r at its first k_i and its last."""
    first, last = map(per_cent, PAPER_LARGEST[law])
    return f"at most {first} (kᵢ = {FIRST[0]}) to {last} (kᵢ = {PAPER_LAST})"


def long_fall(rows: Sequence[Row]) -> str:
    """Largest E_r of coordinates at the first and the last k_i of the long run, by method."""
    told = []
    for method in (*PAPER_LARGEST, NOTHING):
        ends = [
            max(errors_of(rows, "coordinates", method, k_i, runs=(LONG_RUN,)))
            for k_i in (FIRST_LONG[0], FIRST_LONG[-1])
        ]
        told.append(f"{per_cent(ends[0])} to {per_cent(ends[1])} ({method})")
    return ", ".join(told)


def accuracy_table(rows: Sequence[Row]) -> str:
    """Fig. 5: norms at some k, and exponents."""
    shown = (10, 20, 50, 100)
    lines = []
    for row in figure_rows(rows, "5"):
        for key, words in (("g_u", "g_u"), ("f_xi", "f_ξ")):
            values = [f"{1e6 * row[key][k - 1]:.0f}" for k in shown if k <= len(row[key])]
            lines.append([str(row["k_i"]), f"{words}, µm", *values, f"{exponent(row[key]):+.2f}"])
    return table(["kᵢ", "", *(f"k = {k}" for k in shown), "exponent"], lines)


def relaxed_table(rows: Sequence[Row]) -> str:
    """Figs 8 and 9: overlaps and contacts."""
    lines = [
        [
            row["figure"], WAYS[row["way"]], f"{1e6 * row['overlap']:.3g}",
            f"{1e6 * row['overlap_mean']:.2g}", f"{row['coordination']:.2f}",
            per_cent(row["kept"]), f"{1e6 * row['move_median']:.0f}",
        ]
        for way in WAYS
        for row in rows
        if row["figure"] in ("8", "9") and row["way"] == way
    ]  # fmt: skip
    head = ["figure", "state", "greatest overlap, µm", "mean, µm", "contacts", "kept", "pushed, µm"]
    return table(head, sorted(lines, key=lambda line: line[0]))


def preparation_table(row: Row) -> str:
    """Fig. 3: the end of the rain beside the paper's."""
    figures = row["figures"]
    contacts = figures["coordination"]
    lines = [
        ["weight of the grains, N", f"{figures['weight']:.2f}", "13.6 (full cylinder)"],
        ["apparent weight, N", f"{figures['apparent_weight']:.2f}", "close to it"],
        [
            "coordination number: grains; with walls; without rattlers",
            f"{contacts['grains']:.2f}; {contacts['with_walls']:.2f}; "
            f"{contacts['without_rattlers']:.2f}",
            "approaches 5",
        ],
        ["relative density", f"{figures['relative_density']:.3f}", "0.53, more accurately 0.5615"],
        [
            "kinetic over potential energy: translation; rotation",
            f"{row['translational'][-1]:.1e}; {row['rotational'][-1]:.1e}",
            "at most 1e-6",
        ],
        ["time simulated, s", f"{row['time'][-1]:.2f}", ""],
    ]
    return table(["", "here", "the paper"], lines)


def claims(rows: Sequence[Row]) -> str:
    """Lines of the table of claims, each with its verdict by a stated rule."""
    five = figure_rows(rows, "5")
    (rain,) = figure_rows(rows, "3")
    relaxed = {(row["figure"], row["way"]): row for row in rows if "way" in row}
    nine = relaxed["9", "karrech2007"]

    def largest(key: str, method: str, k_i: int, k_least: int = 0) -> float:
        return max(errors_of(rows, key, method, k_i, k_least))

    def falls(key: str) -> str:
        return "; ".join(f"{exponent(row[key]):+.2f} (kᵢ = {row['k_i']})" for row in five)

    def to_bound(key: str, law: str) -> bool:
        ends = [largest(key, law, k_i) for k_i in (FIRST[0], PAPER_LAST)]
        first, last = PAPER_LARGEST[law]
        return ends[0] <= first and ends[1] <= min(last, ends[0])

    def told(key: str, law: str) -> str:
        ends = (largest(key, law, FIRST[0]), largest(key, law, PAPER_LAST))
        nothing = (largest(key, NOTHING, FIRST[0]), largest(key, NOTHING, PAPER_LAST))
        return (
            f"{per_cent(ends[0])} -> {per_cent(ends[1])} of {DENOMINATORS[key]} (kᵢ = {FIRST[0]}, "
            f"{PAPER_LAST}); nothing moved {per_cent(nothing[0])} -> {per_cent(nothing[1])}"
        )

    long = {
        key: max(
            max(errors_of(rows, key, law, None, LONG_WINDOW)) for law in ("linear", "log")
        )
        for key in DENOMINATORS
    }  # fmt: skip
    k_up, k_of = share_rising(rows, "loading", "log", 1)
    h_up, h_of = share_rising(rows, "loading", "log", 2)
    still_up, _ = share_rising(rows, "loading", NOTHING, 2)
    log_wins, count = wins(rows, "log", "linear"), len(jump_rows(rows))
    contacts = rain["figures"]["coordination"]["without_rattlers"]
    lines = [
        ("3", "the sample comes to rest: weight, contacts, density and energies are stable, "
              "coordination number near 5", f"at rest; {contacts:.2f} without rattlers",
         verdict_near(contacts, 5)),
        ("5", "g_u becomes stable when k increases", f"falls with exponent {falls('g_u')}",
         verdict_exponents([exponent(row["g_u"]) for row in five], -0.5)),
        ("5", "f_ξ decreases", f"rises with exponent {falls('f_xi')}",
         verdict_exponents([exponent(row["f_xi"]) for row in five], 0)),
        *(
            (number, f"{law}: {largest_printed(law)}",
             f"{told('coordinates', law)}; {told('loading', law)}",
             verdict_of({key: to_bound(key, law) for key in PAPERS}))
            for number, law in (("6", "linear"), ("7", "log"))
        ),
        ("6, 7", "below 2 % for k of 20 and more", f"{per_cent(long['coordinates'])} of "
         f"coordinates, {per_cent(long['loading'])} of displacements since cycle 0",
         verdict_of({key: long[key] < PAPER_LONG[1] for key in PAPERS})),
        ("6, 7", "the more cycles in the window the better",
         f"log: worse in {k_up} of {k_of} steps of k",
         verdict_share(k_of - k_up, k_of)),
        ("6, 7", "E_r rises with h", f"log: in {h_up} of {h_of} steps of h; so does that of moving "
         f"nothing, in {still_up}", verdict_share(h_up, h_of)),
        ("6, 7", "log is nearer than linear", f"in {log_wins} of {count} jumps",
         verdict_share(log_wins, count)),
        ("8", "the cell is brought to equilibrium", "greatest overlap "
         f"{1e3 * relaxed['8', 'estimate']['overlap']:.1f} mm -> "
         f"{1e6 * relaxed['8', 'karrech2007']['overlap']:.2g} µm",
         verdict_fall(relaxed['8', 'estimate']['overlap'],
                      relaxed['8', 'karrech2007']['overlap'], 100)),
        ("9", "greatest overlap 1.8e-3 m -> 6e-5 m",
         f"{relaxed['9', 'estimate']['overlap']:.1e} -> {nine['overlap']:.1e} m; contacts "
         f"{100 * nine['coordination_error']:+.0f} %; smallest move "
         f"{relaxed['9', 'smallest-move']['overlap']:.1e} m and "
         f"{100 * relaxed['9', 'smallest-move']['coordination_error']:+.1f} %",
         verdict_fall(relaxed['9', 'estimate']['overlap'], nine['overlap'], 30)),
    ]  # fmt: skip
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page(rows: Sequence[Row]) -> str:
    """The page, with every mark ``{{NAME}}`` of the template replaced."""
    (rain,) = figure_rows(rows, "3")
    origin = sorted({f"commit {row['commit'][:7]}, {row['machine']}" for row in rows})
    late = [run.split("-")[1] for run in LATE_RUNS if jump_rows(rows, [run])]
    parts = {
        "CLAIMS": claims(rows),
        "LOG_LAST": per_cent(max(errors_of(rows, "coordinates", "log", PAPER_LAST))),
        "LOG_MOST": per_cent(max(errors_of(rows, "coordinates", "log", FIRST[-1]))),
        "LOG_FIRST": per_cent(max(errors_of(rows, "coordinates", "log", FIRST[0]))),
        "STILL_LAST": per_cent(max(errors_of(rows, "coordinates", NOTHING, PAPER_LAST))),
        "LATE_PACKINGS": ", ".join(late),
        "LATE_JUMPS": str(len(jump_rows(rows, LATE_RUNS))),
        "LATE_LONG": late_ratios(rows),
        "LATE_SHORT": f"{max(row['of_jump']['log'] for row in jump_rows(rows, LATE_RUNS)):.0f}",
        "LATE_LOG": str(wins(rows, "log", NOTHING, LATE_RUNS)),
        "LATE_LINEAR": str(wins(rows, "linear", NOTHING, LATE_RUNS)),
        "LOG_PAPER": per_cent(PAPER_LARGEST["log"][1]),
        "LOG_WINS": str(wins(rows, "log", NOTHING)),
        "LINEAR_WINS": str(wins(rows, "linear", NOTHING)),
        "JUMPS": str(len(jump_rows(rows))),
        "PREPARATION": preparation_table(rain),
        "ACCURACY": accuracy_table(rows),
        "ERRORS": errors_table(rows),
        "ERRORS_LONG": errors_table(rows, (LONG_RUN,), 2),
        "LONG_FALL": long_fall(rows),
        "PAPER_LAST": str(PAPER_LAST),
        "FIRST_FIRST": str(FIRST[0]),
        "OUR_LAST": str(FIRST[-1]),
        "RELAXED": relaxed_table(rows),
        "NOTHING": NOTHING,
        "OTHER": OTHER,
        "FIRST": ", ".join(map(str, FIRST)),
        "WINDOWS": ", ".join(map(str, WINDOWS)),
        "LENGTHS": ", ".join(map(str, JUMPS)),
        "ORIGIN": "; ".join(origin) + ".",
    }
    return page_filled(TEXT.read_text(encoding="utf-8"), parts)


def late_ratios(rows: Sequence[Row], window: int = 20) -> str:
    """Errors by the log law over those of moving nothing, from windows so long and longer: the
    least and the greatest of each packing."""
    told = []
    for run in LATE_RUNS:
        mine = [row["of_jump"]["log"] for row in jump_rows(rows, [run]) if row["jump"][1] >= window]
        told += [f"{min(mine):.2g} to {max(mine):.2g}"] if mine else []
    return ", ".join(told[:-1]) + " and " + told[-1]


def main() -> None:
    """Write page and pictures."""
    rows = rows_read()
    write_atomically(PAGE, page(rows))
    draw(rows, PAGE.with_suffix(".png"))
    draw_jumps(rows, PICTURE_JUMPS)


if __name__ == "__main__":
    main()
