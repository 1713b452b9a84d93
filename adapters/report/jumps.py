"""The section of a report on jumps: what each did, and where the bed or its piston held it up."""

from math import isnan

from adapters.procedure import SEATING, Record, find_hung_cycles, format_spans
from adapters.report.error import COORDINATION_BAR, HEIGHT_BAR
from adapters.report.numbers import Numbers
from trackbed import report

HEADER = (
    "cycles jumped", "loaded body", "full run's, same cycles", "mean grain by the law",
    "full run's, same cycles", "law", "relaxation",
    "healing cycles", "coordination number changed", "height changed by relaxation",
)  # fmt: skip
"""Columns of the table of jumps."""


def describe_jumps(record: Record, numbers: Numbers) -> str:
    """What each step of a jump adds to the error, and what the bed made of it."""
    rows = [
        (
            f"{jump.first_cycle} → {jump.last_cycle}",
            report.format_um(jump.loaded_body),
            report.format_um(jump.loaded_body_truth),
            report.format_um(jump.estimated),
            report.format_um(jump.truth),
            report.format_um(jump.law_error, "+.1f"),
            report.format_um(jump.relaxation_change, "+.3f"),
            report.format_um(jump.healing_error, "+.1f"),
            show_with_verdict(jump.coordination_change, "+.2f", COORDINATION_BAR),
            show_with_verdict(jump.height_change, ".2f", HEIGHT_BAR),
        )
        for jump in numbers.jumps
    ]
    figures = report.make_paragraph("No jump was made.")
    if rows:
        figures = report.make_table(
            "By what a jump lowers the loaded body and the mean grain, and what each of its "
            "steps adds to the error of the mean grain (µm, positive: too much). The full run is "
            "no twin of this one after the first jump: where the beds have parted, its increment "
            "is another bed's. Bars: coordination number, walls counted, "
            f"within {100 * COORDINATION_BAR:.0f} % of the state before; mean height within "
            f"{100 * HEIGHT_BAR:.0f} % of the jump's own settlement, "
            "taken for a hundredth of the gain since the first jump at least.",
            HEADER,
            rows,
        )
    return report.make_section(
        "Jumps and relaxation", figures, describe_shortfall(record), describe_hung_cycles(record)
    )


def show_with_verdict(share: float, form: str, bar: float) -> str:
    """A share in per cent, and whether it meets its bar."""
    return (
        report.format_share(share, form)
        + " "
        + report.format_verdict(None if isnan(share) else abs(share) <= bar)
    )


def describe_hung_cycles(record: Record) -> str:
    """In which cycles the piston hung on few grains, and whether jumps were made then."""
    procedure = record.scene.procedure
    if procedure is None or record.scene.loading is None:
        return ""
    cycles = find_hung_cycles(record.scene, record.run.outcomes)
    if not len(cycles):
        return ""
    early = sum(
        bool(((cycles <= jump.first_cycle) & (cycles > jump.first_cycle - procedure.k_i)).any())
        for _, jump in record.run.jumps
    )
    behind = f"then or within k<sub>i</sub> = {procedure.k_i} cycles behind"
    advice = (
        f"{early} of the {len(record.run.jumps)} jumps were made {behind}: when the grains let go "
        "no cycle before shows, so they may miss most of what the bed settles. "
        '<code>procedure.seating = "waits"</code> computes on instead.'
        if early
        else f"No jump was made {behind}."
    )
    return report.make_paragraph(
        f"<strong>The piston hung on few grains in cycles {format_spans(cycles)}:</strong> it gave "
        f"way by more than {SEATING.hung:g} times what the mean field of Walton (1987) gives a bed "
        f"of such grains. {advice}"
    )


def describe_shortfall(record: Record) -> str:
    """What jumps by history asked for and the bed did not settle by, where anything is left."""
    notes = [jump.notes for _, jump in record.run.jumps if "asked" in jump.notes]
    left = notes[-1]["asked"] - notes[-1]["gain"] if notes else 0.0
    if left == 0:
        return ""
    return report.make_paragraph(
        f"<strong>The bed has settled {report.format_um(left)} µm less than its jumps were to "
        "move it:</strong> no room for more was found without overlaps. The settlement predicted "
        "is that much greater; shorter jumps, or more of them, leave the bed the cycles to make "
        "room."
    )
