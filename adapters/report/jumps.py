"""The section of a report on jumps: what each did, and where the bed or its piston held it up."""

from __future__ import annotations

from math import isnan

from adapters.procedure import HUNG, Record, find_hung_cycles, spans
from adapters.report.error import COORDINATION_BAR, HEIGHT_BAR
from adapters.report.numbers import Numbers
from trackbed.report import micrometres, paragraph, per_cent, section, table, verdict

HEADER = (
    "cycles jumped", "settlement by the law", "full run, same cycles", "law", "relaxation",
    "healing cycles", "coordination number changed", "height changed by relaxation",
)  # fmt: skip
"""Columns of the table of jumps."""


def describe_jumps(record: Record, numbers: Numbers) -> str:
    """What each step of a jump adds to the error, and what the bed made of it."""
    if not numbers.jumps:
        return section("Jumps and relaxation", paragraph("No jump was made."), hung(record))
    rows = [
        (
            f"{jump.first_cycle} → {jump.last_cycle}",
            micrometres(jump.estimated),
            micrometres(jump.truth),
            micrometres(jump.law_error, "+.1f"),
            micrometres(jump.relaxation_change, "+.3f"),
            micrometres(jump.healing_error, "+.1f"),
            show_judged(jump.coordination_change, "+.2f", COORDINATION_BAR),
            show_judged(jump.height_change, ".2f", HEIGHT_BAR),
        )
        for jump in numbers.jumps
    ]
    return section(
        "Jumps and relaxation",
        table(
            "What each step of a jump adds to the error of the settlement (µm, positive: too "
            "much). The full run is no twin of this one after the first jump: where the beds have "
            "parted, its increment is another bed's. Bars: coordination number, walls counted, "
            f"within {100 * COORDINATION_BAR:.0f} % of the state before; mean height within "
            f"{100 * HEIGHT_BAR:.0f} % of the jump's own settlement.",
            HEADER,
            rows,
        ),
        owed(record),
        hung(record),
    )


def show_judged(share: float, form: str, bar: float) -> str:
    """A share in per cent, and whether it meets its bar."""
    return per_cent(share, form) + " " + verdict(None if isnan(share) else abs(share) <= bar)


def hung(record: Record) -> str:
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
    return paragraph(
        f"<strong>The piston hung on few grains in cycles {spans(cycles)}:</strong> it gave way by "
        f"more than {HUNG:g} times what the mean field of Walton (1987) gives a bed of such "
        f"grains. {advice}"
    )


def owed(record: Record) -> str:
    """What jumps by history asked for and the bed did not settle by, where anything is left."""
    notes = [jump.notes for _, jump in record.run.jumps if "asked" in jump.notes]
    left = notes[-1]["asked"] - notes[-1]["gain"] if notes else 0.0
    if left == 0:
        return ""
    return paragraph(
        f"<strong>The bed has settled {micrometres(left)} µm less than its jumps were to move it:"
        "</strong> no room for more was found without overlaps. The settlement predicted is that "
        "much greater; shorter jumps, or more of them, leave the bed the cycles to make room."
    )
