"""The section of a report on jump control: every decision, why this length, what came of it."""

from html import escape

from adapters.jumps import BAND_PROBABILITY
from adapters.procedure import Record
from trackbed.report import (
    format_number,
    format_share,
    format_um,
    make_paragraph,
    make_section,
    make_table,
)

HEADER = (
    "cycle", "", "<i>k</i>", "<i>h</i>", "gain expected (µm)", "moved by (µm)", "half-width (µm)",
    "realised error", "rate off by (standard errors)", "", "why",
)  # fmt: skip
"""Columns of the table of decisions."""


def describe_control(record: Record) -> str:
    """Decisions and checks of a controlled run; empty for another."""
    procedure, track = record.scene.procedure, record.run
    band = track.estimate_band()
    if procedure is None or procedure.tolerance is None or band is None:
        return ""
    checks = track.checks
    rows = []
    for decision in track.decisions:
        lengths = [""] * 4
        if decision["jump"]:
            moved = "moved" if "moved" in decision else "gain"  # older runs have one for both
            lengths = [format_number(decision["jump"], "d")]
            lengths += [format_um(decision[name]) for name in ("gain", moved, "half_width")]
        came = [""] * 3
        check = checks.get((decision["cycle"], decision["attempt"]))
        if check and decision["action"] == "jump":
            came = [format_share(check["error"], "+.2f"), format_number(check["deviation"], "+.1f")]
            came.append("kept" if check["accepted"] else "taken back")
        finite = [(name, h) for name, h in decision["limits"] if h is not None]
        others = ", ".join(f"{name} {h:.0f}" for name, h in finite if h < 1e6)
        rows.append(
            (
                format_number(decision["cycle"], "d"),
                escape(decision["action"]),
                format_number(decision["window"], "d"),
                *lengths,
                *came,
                escape(decision["why"]) + (f" ({escape(others)})" if others else ""),
            )
        )
    definition = make_paragraph(
        f"Tolerance: {format_share(procedure.tolerance)}, on the error of the settlement gained "
        "from the start of a jump to the end of its healing cycles, over the total settlement "
        "since the preparation. The realised error compares that gain with the rates computed on "
        "both sides of the jump; above twice the tolerance it is taken back. Jumps taken back: "
        f"{sum(not check['accepted'] for check in checks.values())}."
    )
    kept = [check for check in checks.values() if check["accepted"] and "kappa" in check]
    if kept:  # older runs have no kappa
        definition += make_paragraph(
            f"Behind its {len(kept)} jumps the bed settled by "
            f"{format_um(sum(check['reseated'] for check in kept))} µm more because it was moved "
            f"(in the n-th cycle {kept[-1]['kappa']:.3f} / n of what it was moved by)."
        )
    ends = f"{format_um(band.low)} to {format_um(band.high)} µm"
    mean = f"{format_um(band.mean_low)} to {format_um(band.mean_high)} µm"
    return make_section(
        "Jump control",
        definition,
        make_paragraph(
            f"At cycle {band.cycle} the bed has settled by {format_um(band.settlement)} µm; with "
            f"the errors observed behind its jumps taken out, {format_um(band.corrected)} µm. "
            f"With probability {BAND_PROBABILITY:g} a full run from the same state ends within "
            f"{ends}, the mean of many within {mean}. Standard deviations: "
            f"{format_um(band.jumps)} µm from the noise of the computed rates, "
            f"{format_um(band.laws)} µm from the form of the law, {format_um(band.scatter)} µm "
            "from the bursts of the other run."
        ),
        make_table(
            "Every decision. <i>k</i>: cycles computed next. <i>Moved by</i>: the gain expected "
            "less what the bed is ahead of its own rates by, and what it will settle more because "
            "it was moved. The last column names the rule that set <i>h</i>, and the longest jump "
            "by each.",
            HEADER,
            rows,
            words=frozenset({10}),
        ),
    )
