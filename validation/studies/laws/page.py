"""The page docs/laws.md and its figure, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.laws.fit.refusal import UNCERTAIN
from adapters.laws.fit.regime import WHY_NOT
from validation.studies.laws.bars import check_bars
from validation.studies.laws.run import MEMBERS
from validation.study import format_table, summarise_bars

Row = dict[str, Any]
FORMS = {
    "linear": ("c + b N", "Karrech et al. 2007, eq. 16"),
    "log": ("c + a ln N", "the same with its constant; Hettler; ORE"),
    "log-linear": ("c + a ln N + b N", "Shenton, as the paper uses it"),
    "power": ("c + a N^b", "Monismith 1975; Selig and Waters"),
    "hyperbolic": ("c + a N / (tau + N)", "Kondner 1963"),
    "stretched-exponential": ("c + a (1 - exp(-(N/tau)^b))", "Philippe and Bideau 2002"),
    "inverse-log": ("c + a (1 - 1/(1 + B ln(1 + N/tau)))", "Knight et al. 1995"),
    "karrech2007": ("a ln N + b N, whole law added", "Karrech et al. 2007, eqs 17-21"),
    "polyfit": ("c + a ln N, not anchored", "rival: numpy.polyfit"),
    "curve_fit": ("a N^b, not anchored", "rival: scipy.optimize.curve_fit"),
}
"""Equation and source of every method."""
RIVALS = ("polyfit", "curve_fit")
STOPPED = 0.29
"""Strain above which a test was stopped."""
NAMES = {
    "ballast": "real ballast",
    "other cuts": "the same tests, N_c between these",
    "families": "families",
    "engine": "engine beds from cycle 1, N_c = 10 to 100",
}


def format_share(value: float, digits: int = 1) -> str:
    """0.0561 to 5.6 %; what exceeds a factor of ten says so."""
    return f"{100 * value:.{digits}f} %" if value < 10 else "over 1,000 %"


def tabulate_auto(found: dict[str, Row]) -> str:
    """Auto on every source beside its bars."""
    lines = [["*bar*", "", "*8 %*", "*20 %*", "*85 %*", "", ""]]
    for source, name in NAMES.items():
        auto = found[source]["auto"]
        lines.append([
            name, f"{auto['cases']} of {auto['cases'] + auto['refused']}",
            format_share(auto["error"]), format_share(auto["error_90"]),
            format_share(auto["coverage"], 0), format_share(auto["half_width"], 0),
            f"{1e3 * auto['cost_s']:.0f} ms",
        ])  # fmt: skip
    head = [
        "source", "goes ahead", "median error", "90th percentile", "band holds the truth",
        "its median half-width", "CPU time",
    ]  # fmt: skip
    return format_table(head, lines)


def format_errors(row: Row) -> str:
    """Median / 90th percentile, of all cases in brackets."""
    both = [
        " / ".join(format_share(part[key], 0) for key in ("error", "error_90"))
        for part in (row, row["all"])
    ]
    return f"{both[0]} ({both[1]})"


def tabulate_laws(found: dict[str, Row]) -> str:
    """Every law and rival."""
    sources = [found[source] for source in ("ballast", "families")]
    auto = [f"**{format_errors(row['auto'])}**" for row in sources]
    lines = [["**auto**", "five of these, three windows", "this page", *auto]]
    for name, (form, source) in FORMS.items():
        errors = [format_errors(row["methods"][name]) for row in sources]
        lines.append([name, f"`{form}`", source, *errors])
    return format_table(["law", "u(N)", "source", "real ballast", "families"], lines)


def shorten_name(name: str) -> str:
    """p_30kPa_q_230kPa_f_5Hz to 30kPa / 230kPa, 5Hz."""
    return name.removeprefix("p_").replace("_q_", " / ").replace("_f_", ", ")


def describe_whole(found: dict[str, Row]) -> str:
    """How many whole tests are refused, of those stopped at strains of 0.3 and of the others."""
    tests = found["whole"]["tests"]
    refused = (*WHY_NOT, UNCERTAIN)
    stopped = [row["last"] > STOPPED for row in tests]
    counts = {
        key: [row[key] in refused for row in tests] for key in ("said", "said_fail_at")
    }  # fmt: skip
    hits = {key: sum(np.logical_and(stopped, said)) for key, said in counts.items()}
    others = {key: sum(said) - hits[key] for key, said in counts.items()}
    return (
        f"{sum(stopped)} of the {len(tests)} whole tests were stopped at strains of 0.3. To a "
        f"million cycles auto refuses {hits['said']} of these and {others['said']} of the others; "
        f"with `--fail-at 0.3`, {hits['said_fail_at']} and {others['said_fail_at']}."
    )


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    found = {row["part"]: row for row in rows}
    ballast, engine = found["ballast"]["auto"], found["engine"]["auto"]
    low, high = ballast["error_90_without_one"]
    worst = ", ".join(
        f"{shorten_name(row['name'])} at {row['cut']:,.0f} cycles ({100 * row['error']:+.0f} %)"
        for row in ballast["worst"][:3]
    )
    origin = rows[0]["origin"]
    return {
        "auto": tabulate_auto(found),
        "laws": tabulate_laws(found),
        "met": summarise_bars(check_bars(rows)),
        "error": format_share(ballast["error"]),
        "refused": f"{ballast['refused']} of {ballast['cases'] + ballast['refused']}",
        "worst": worst,
        "members": str(MEMBERS),
        "without": f"{format_share(low)} and {format_share(high)}",
        "hindsight": " / ".join(
            format_share(ballast["hindsight"][k]) for k in ("error", "error_90")
        ),
        "engine": f"{format_share(engine['error'], 0)} median error, and the band holds "
        f"{format_share(engine['coverage'], 0)} of {engine['cases']}",
        "other_all": format_share(found["other cuts"]["auto"]["all"]["error_90"]),
        "whole": describe_whole(found),
        "origin": f"Commit `{origin['commit'][:10]}`, {origin['machine']}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Median (dot) to 90th percentile (end of the line) against cost, ballast and families."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    found = {row["part"]: row for row in rows}
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    for axis, source in zip(axes, ("ballast", "families"), strict=True):
        for name, row in {"auto": found[source]["auto"], **found[source]["methods"]}.items():
            if name == "karrech2007":  # off by orders of magnitude
                continue
            colour = "#c8553d" if name == "auto" else "0.45" if name in RIVALS else "#1b6ca8"
            cost, error = 1e3 * row["cost_s"], 100 * row["error"]
            axis.plot([cost] * 2, [error, 100 * row["error_90"]], color=colour, lw=0.8)
            axis.plot(cost, error, "*" if name == "auto" else "o", color=colour, ms=6)
            axis.annotate(name, (cost, error), fontsize=7, xytext=(4, -3),
                          textcoords="offset points")  # fmt: skip
        axis.set(xscale="log", yscale="log", xlabel="CPU time of a prediction, ms")
        axis.set_ylabel("error at 10 N_c, %: median to 90th percentile")
        axis.axhline(8, color="0.6", lw=0.7, ls=":")
        axis.set_title(NAMES[source], fontsize=9)
    figure.savefig(picture, dpi=80)
    pyplot.close(figure)
