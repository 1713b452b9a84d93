"""Make ``docs/laws.md`` and its picture: ``python -m validation.law_page``.

The page is ``law_page.md`` beside this file, with tables and numbers of the record put in.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from adapters.fit_refusal import UNCERTAIN, WIDEST
from adapters.fit_regime import WHY_NOT
from validation.law_bound import BOUNDS, LARGE, WAYS
from validation.law_study import BOUNDED, LAWS, REGIME_CUTS, RIVALS, Row, record_read
from validation.page_text import page_filled, table

TEMPLATE = Path(__file__).with_name("law_page.md")
PAGE = Path(__file__).parents[1] / "docs" / "laws.md"
PICTURE = PAGE.with_suffix(".png")
FORMS = {
    "linear": ("c + b N", "Karrech et al. 2007, eq. 16"),
    "log": ("c + a ln N", "the same with its constant; Hettler; ORE"),
    "log-linear": ("c + a ln N + b N", "Shenton, as the paper uses it"),
    "power": ("c + a N^b", "Monismith 1975; Selig and Waters"),
    "shenton": ("c + a N^0.2 + b N", "Shenton 1985"),
    "hyperbolic": ("c + a N / (tau + N)", "Kondner 1963"),
    "stretched-exponential": ("c + a (1 - exp(-(N/tau)^b))", "Philippe and Bideau 2002"),
    "inverse-log": ("c + a (1 - 1/(1 + B ln(1 + N/tau)))", "Knight et al. 1995"),
    "sato": ("c + g (1 - exp(-N/tau)) + b N", "Sato 1995"),
    "hca": ("c + a ln(1 + N/tau) + b N", "Niemunis et al. 2005"),
    "karrech2007": ("a ln N + b N, whole law added", "Karrech et al. 2007, eqs 17-21"),
    "polyfit": ("c + a ln N, not anchored", "rival: numpy.polyfit"),
    "curve_fit": ("a N^b, not anchored", "rival: scipy.optimize.curve_fit"),
}
"""Equation and source of every method."""
PARAMETERS = {
    "linear": "c, b", "log": "c, a", "log-linear": "c, a, b", "power": "c, a, b",
    "shenton": "c, a, b", "hyperbolic": "c, a, tau", "stretched-exponential": "c, a, tau, b",
    "inverse-log": "c, a, tau, B", "sato": "c, g, b, tau", "hca": "c, a, b, tau",
    "karrech2007": "a, b", "polyfit": "c, a", "curve_fit": "a, b",
}  # fmt: skip
WAYS_TOLD = {
    WAYS[0]: "median of the votes (auto)",
    WAYS[1]: "without the power law, which never slows down to a logarithm",
    WAYS[2]: "last decade, last two, all rows: weights 3 : 2 : 1",
    WAYS[3]: "no decade ahead brings more than the last one",
}
NAMES = {
    "ballast": "real ballast",
    "other cuts": "the same tests, N_c between these",
    "families": "families",
    "doublings": "engine beds, windows of 20 to 90 cycles, to 2 N_c",
    "engine": "engine beds from cycle 1, N_c = 10 to 100",
}


def per_cent(value: float, digits: int = 1) -> str:
    """0.0561 to 5.6 %; what exceeds a factor of ten says so."""
    return f"{100 * value:.{digits}f} %" if value < 10 else "over 1,000 %"


def row_of(rows: Sequence[Row], source: str, method: str = "auto") -> Row:
    """The one row of a method on a source."""
    (found,) = (row for row in rows if (row["source"], row["method"]) == (source, method))
    return found


def auto_table(rows: Sequence[Row]) -> str:
    """Auto on every source beside its bars."""
    lines = []
    for source, name in NAMES.items():
        row = row_of(rows, source)
        lines.append(
            [
                name,
                f"{row['cases']} of {row['cases'] + row['refused']}",
                per_cent(row["error"]),
                per_cent(row["error_90"]),
                per_cent(row["coverage"], 0),
                per_cent(row["half_width"], 0),
                f"{1e3 * row['cost_s']:.0f} ms",
            ]
        )
    bars = ["*bar*", "", "*8 %*", "*20 %*", "*85 %*", "", ""]
    head = [
        "source", "let go ahead", "median error", "90th percentile", "band holds the truth",
        "its median half-width", "CPU time",
    ]  # fmt: skip
    return table(head, [bars, *lines])


def error_cell(row: Row) -> str:
    """Median / 90th percentile, of all cases in brackets."""
    both = [
        " / ".join(per_cent(part[key], 0) for key in ("error", "error_90"))
        for part in (row, row["all"])
    ]
    return f"{both[0]} ({both[1]})"


def laws_table(rows: Sequence[Row]) -> str:
    """Every law and rival."""
    auto = [row_of(rows, source) for source in ("ballast", "families")]
    lines = [
        [
            "**auto**", "five of these, three windows", "this page", "regime, votes",
            *(f"**{error_cell(row)}**" for row in auto), f"{1e3 * auto[0]['cost_s']:.1f}",
        ]
    ]  # fmt: skip
    for name in (*LAWS, *RIVALS):
        found = [row_of(rows, source, name) for source in ("ballast", "families")]
        lines.append(
            [
                name,
                f"`{FORMS[name][0]}`",
                FORMS[name][1],
                PARAMETERS[name],
                *map(error_cell, found),
                f"{1e3 * found[0]['cost_s']:.1f}",
            ]
        )
    head = ["law", "u(N)", "source", "parameters", "real ballast", "families", "cost, ms"]
    return table(head, lines)


def bars_told(rows: Sequence[Row]) -> str:
    """Which bars are met, in a sentence."""
    failing = []
    for source in ("ballast", "families"):
        row = row_of(rows, source)
        for name, good in (
            ("median", row["error"] <= 0.08),
            ("90th percentile", row["error_90"] <= 0.2),
            ("band", row["coverage"] >= 0.85),
        ):
            if not good:
                failing.append(f"{name} on {NAMES[source]}")
    fast = row_of(rows, "fast")
    told = "All six bars are met." if not failing else f"Not met: {', '.join(failing)}."
    refused = f"{fast['refused']} are refused"
    return f"{told} Of {fast['cases']} series with a constant or growing rate {refused}."


def worst_told(rows: Sequence[Row]) -> str:
    """The three largest errors on real ballast."""
    worst = row_of(rows, "ballast")["worst"][:3]
    said = [
        f"{row['name'].removeprefix('p_').replace('_', ' ')} at {row['cut']:,.0f} cycles "
        f"({100 * row['error']:+.0f} %)"
        for row in worst
    ]
    return f"- Largest errors on real ballast: {', '.join(said)}."


def bound_table(rows: Sequence[Row]) -> str:
    """Auto under every bound on the band: what goes ahead, its errors, its cover."""
    lines = []
    for bound in BOUNDS:
        cells = []
        for source in BOUNDED:
            row = row_of(rows, f"{source}, bound", f"{WAYS[0]}, {bound:g}")
            errors = " / ".join(per_cent(row[key]) for key in ("error", "error_90"))
            cells.append(f"{row['cases']} of {row['of']}: {errors}, {per_cent(row['coverage'], 0)}")
        name = f"{bound:g}" if isfinite(bound) else "none"
        lines.append([f"**{name}**" if bound == WIDEST else name, *cells])
    return table(["half-width at most", *(NAMES[source] for source in BOUNDED)], lines)


def large_told(rows: Sequence[Row]) -> str:
    """Where the large errors on the other cuts are, and how wide their bands."""
    large = row_of(rows, "other cuts")["large"]
    fast = [row for row in large if 500 <= row["cut"] <= 1000]
    wide = [row for row in large if row["width"] > WIDEST]
    return (
        f"of {len(large)} errors above {per_cent(LARGE, 0)} {len(fast)} are cuts at 500 to 1,000 "
        f"cycles, in the fast stage that is told of below, and in {len(wide)} the band reaches "
        "further on each side than all that settled"
    )


def ways_table(rows: Sequence[Row]) -> str:
    """Every way to combine the candidates at the bound of auto."""
    lines = []
    for way in WAYS:
        found = [row_of(rows, f"{one}, bound", f"{way}, {WIDEST:g}") for one in BOUNDED]
        errors = [" / ".join(per_cent(row[key]) for key in ("error", "error_90")) for row in found]
        lines.append([WAYS_TOLD[way], *errors])
    return table(["way", *(NAMES[source] for source in BOUNDED)], lines)


def whole_table(rows: Sequence[Row]) -> str:
    """The whole tests: prediction and band at a million cycles, and what is said of them."""
    lines = [
        [
            test_name(row["method"]),
            f"{row['last_cycle']:,.0f}",
            f"{row['last']:.3f}",
            f"{row['exponent'][0]:.2f} ± {row['exponent'][1]:.2f}",
            f"{row['prediction']:.3f}",
            f"{row['band'][0]:.3f} to {row['band'][1]:.3f}",
            regime_cell(row["said"]),
            regime_cell(row["said_fail_at"]),
        ]
        for row in rows
        if row["source"] == "whole"
    ]
    head = [
        "p / q, f", "its cycles", "its strain", "beta", "laws' median", "band", "said",
        "with `--fail-at 0.3`",
    ]  # fmt: skip
    return table(head, lines)


def left_out_told(rows: Sequence[Row]) -> str:
    """What tests have that a setting was chosen for on the other tests."""
    row = row_of(rows, "left out")
    errors = " and ".join(
        f"{per_cent(row[key])} {name}"
        for key, name in (("error", "median error"), ("error_90", "90th percentile"))
    )
    return (
        f"{errors} in the {row['cases']} of {row['of']} cases that go ahead, and "
        f"{per_cent(row['coverage'], 0)} inside the band of auto"
    )


def chosen_told(rows: Sequence[Row]) -> str:
    """The bounds that were chosen on the others."""
    chosen = row_of(rows, "left out")["chosen"].values()
    return " or ".join(sorted({one.rsplit(", ", 1)[1] for one in chosen}))


def regime_cell(regime: str | None) -> str:
    """A regime, in bold where a prediction is refused."""
    if regime is None:
        return ""
    return f"**{regime}**" if regime in WHY_NOT or regime == UNCERTAIN else regime


def test_name(name: str) -> str:
    """p_30kPa_q_230kPa_f_5Hz to 30kPa / 230kPa, 5Hz."""
    return name.removeprefix("p_").replace("_q_", " / ").replace("_f_", ", ")


def regimes_table(rows: Sequence[Row]) -> str:
    """What each test was told to do when it was known so far; what is refused in bold."""
    regimes = row_of(rows, "ballast regimes")["regimes"]
    head = ["p / q, f", *(f"{cut:,.0f}" if isfinite(cut) else "its end" for cut in REGIME_CUTS)]
    lines = [[test_name(name), *map(regime_cell, regimes[name])] for name in regimes]
    return table(head, lines)


def page(rows: Sequence[Row]) -> str:
    """The page, with every mark ``{{name}}`` of the template replaced."""
    ballast, engine = row_of(rows, "ballast"), row_of(rows, "engine")
    doubling = row_of(rows, "doublings")
    inside, of = row_of(rows, "families")["coverage_by_name"]["bursts"]
    low, high = ballast["error_90_without_one"]
    hindsight = ballast["hindsight"]
    seconds = [
        row_of(rows, "grains", name)["cost_s"] for name in ("hyperbolic", "stretched-exponential")
    ]
    parts = {
        "auto": auto_table(rows),
        "laws": laws_table(rows),
        "bars": bars_told(rows),
        "worst": worst_told(rows),
        "members": str(ballast["members"]),
        "without": f"{per_cent(low)} and {per_cent(high)}",
        "grains": f"hyperbolic {seconds[0]:.2f} s, stretched exponential {seconds[1]:.2f} s",
        "hindsight": f"{per_cent(hindsight['error'])} / {per_cent(hindsight['error_90'])}",
        "engine": (
            f"{per_cent(engine['error'], 0)} median error, and the band holds "
            f"{per_cent(engine['coverage'], 0)} of {engine['cases']}."
        ),
        "doubling": (
            f"{per_cent(doubling['error'])} median error, {per_cent(doubling['coverage'], 0)} of "
            f"{doubling['cases']} inside the band"
        ),
        "regimes": regimes_table(rows),
        "other_all": per_cent(row_of(rows, "other cuts, bound", f"{WAYS[0]}, inf")["error_90"]),
        "large": large_told(rows),
        "bound": bound_table(rows),
        "ways": ways_table(rows),
        "chosen": chosen_told(rows),
        "left_out": left_out_told(rows),
        "whole": whole_table(rows),
        "bursts": f"{inside} of {of}",
    }
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture from the record."""
    from validation.law_picture import draw

    rows = record_read()
    PAGE.write_text(page(rows), encoding="utf-8")
    draw(rows, PICTURE)


if __name__ == "__main__":
    main()
