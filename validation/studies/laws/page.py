"""The page docs/laws.md and its figure, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from adapters.laws import get_law
from validation.figure import draw_figure, label_point
from validation.studies.laws.bars import check_bars
from validation.studies.laws.run import MEMBERS
from validation.studies.laws.series import FIRST_CUT
from validation.study import format_table, summarise_bars

Row = dict[str, Any]
SOURCES = {
    "linear": "Karrech et al. 2007, eq. 16",
    "log": "the same with its constant; Hettler; ORE",
    "log-linear": "Shenton, as the paper uses it",
    "power": "Monismith 1975; Selig and Waters",
    "hyperbolic": "Kondner 1963",
    "stretched-exponential": "Philippe and Bideau 2002",
    "inverse-log": "Knight et al. 1995",
    "karrech2007": "Karrech et al. 2007, eqs 17-21; the whole law added",
    "nothing": "the last reading: nothing more settles",
}
NAMES = {
    "ballast": "real ballast",
    "frequency": "the same with `--frequency`, learned from the other 11",
    "families": "families",
    "engine": "engine beds from cycle 1, N_c = 10 to 100",
}


def format_share(value: float, digits: int = 1) -> str:
    """0.0561 to 5.6 %; what exceeds a factor of ten says so."""
    return f"{100 * value:.{digits}f} %" if value < 10 else "over 1,000 %"


def tabulate_auto(found: dict[str, Row]) -> str:
    """Auto on every source beside its bars."""
    lines = [["*bar*", "", "*8 %*", "*20 %*", "", "*85 %*", "", ""]]
    for source, name in NAMES.items():
        auto = found[source]["auto"]
        lines.append([
            name, f"{auto['cases']} of {auto['cases'] + auto['refused']}",
            *(format_share(auto[key]) for key in ("error", "error_90", "rms")),
            format_share(auto["coverage"], 0), format_share(auto["half_width"], 0),
            f"{1e3 * auto['cost_s']:.0f} ms",
        ])  # fmt: skip
    head = [
        "source", "goes ahead", "median error", "90th percentile", "rms", "band holds the truth",
        "its median half-width", "CPU time",
    ]  # fmt: skip
    return format_table(head, lines)


def format_error(row: Row) -> str:
    """Median / 90th percentile / root mean square."""
    return " / ".join(format_share(row[key], 0) for key in ("error", "error_90", "rms"))


def tabulate_laws(found: dict[str, Row]) -> str:
    """Every law and rival."""
    sources = [found[source] for source in ("ballast", "families")]
    auto = [
        f"**{format_error(row['auto'])} ({format_error(row['auto']['all'])})**" for row in sources
    ]
    lines = [["**auto**", "five of these, three windows", "this page", *auto]]
    for name, source in SOURCES.items():
        errors = [format_error(row["methods"][name]) for row in sources]
        form = "u_k" if name == "nothing" else get_law(name).formula
        lines.append([name, f"`{form}`", source, *errors])
    return format_table(["law", "u(N)", "source", "real ballast", "families"], lines)


def tabulate_cuts(found: dict[str, Row]) -> str:
    """Errors of auto by the last known cycle, without and with the frequency."""
    lines = [
        [f"{max(one['from'], FIRST_CUT):,.0f}", str(one["cases"]), *map(format_error, (one, other))]
        for one, other in zip(
            *(found[source]["auto"]["by_cut"] for source in ("ballast", "frequency")), strict=True
        )
    ]
    head = ["last known cycle, from", "cases", "readings alone", "with `--frequency`"]
    return format_table(head, lines)


def describe_whole(whole: Row) -> str:
    """How many whole tests are refused, of those stopped at strains of 0.3 and of the others."""
    (stopped, *hits), (others, *alarms) = whole["stopped"], whole["others"]
    return (
        f"{stopped} of the {stopped + others} whole tests were stopped at strains of 0.3. To a "
        f"million cycles auto refuses {hits[0]} of these and {alarms[0]} of the others; "
        f"with `--fail-at 0.3`, {hits[1]} and {alarms[1]}."
    )


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    found = {row["part"]: row for row in rows}
    ballast, engine = found["ballast"]["auto"], found["engine"]["auto"]
    origin = rows[0]["origin"]
    return {
        "auto": tabulate_auto(found),
        "laws": tabulate_laws(found),
        "met": summarise_bars(check_bars(rows)),
        "error": format_share(ballast["error"]),
        "refused": f"{ballast['refused']} of {ballast['cases'] + ballast['refused']}",
        "members": str(MEMBERS),
        "by_cut": tabulate_cuts(found),
        "prior": ", ".join(f"{one:.3g}" for one in found["frequency"]["prior"].values()),
        "engine": f"{format_share(engine['error'], 0)} median error, and the band holds "
        f"{format_share(engine['coverage'], 0)} of {engine['cases']}",
        "whole": describe_whole(found["whole"]),
        "origin": f"Commit `{origin['commit'][:10]}`, {origin['machine']}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Median (dot) to 90th percentile (end of the line) against cost, ballast and families."""
    found = {row["part"]: row for row in rows}

    def draw_panels(figure: Any) -> None:
        for axes, source in zip(figure.subplots(1, 2), ("ballast", "families"), strict=True):
            for name, row in {"auto": found[source]["auto"], **found[source]["methods"]}.items():
                if name == "karrech2007":  # off by orders of magnitude
                    continue
                colour = "#c8553d" if name == "auto" else "#1b6ca8"
                cost, error = 1e3 * row["cost_s"], 100 * row["error"]
                axes.plot([cost] * 2, [error, 100 * row["error_90"]], color=colour, lw=0.8)
                axes.plot(cost, error, "*" if name == "auto" else "o", color=colour, ms=6)
                label_point(axes, name, (cost, error))
            axes.set(xscale="log", yscale="log", xlabel="CPU time of a prediction, ms")
            axes.set_ylabel("error at 10 N_c, %: median to 90th percentile")
            axes.axhline(8, color="0.6", lw=0.7, ls=":")
            axes.set_title(NAMES[source], fontsize=9)

    draw_figure((11, 4.5), draw_panels, picture)
