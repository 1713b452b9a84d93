"""Sections of a report on the bed: contacts, jumps, grains, preparation, load and cost."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

from adapters.bed import PAPER_COORDINATION, PAPER_WEIGHT
from adapters.procedure import FORCE_ERROR_GOAL, HUNG, Record, find_hung_cycles, spans
from adapters.report.error import COORDINATION_BAR, HEIGHT_BAR, PYTHON_BAR
from adapters.report.numbers import Numbers
from trackbed.report import (
    TIMES,
    micrometres,
    number,
    paragraph,
    per_cent,
    picture,
    plain,
    section,
    table,
    verdict,
)

PAPER_DENSITY = 0.5615
"""Relative density of the paper's bed (Table 1)."""

Figures = Mapping[str, Path]


def karrech(record: Record) -> bool:
    """Whether the bed is that of the paper's Table 1."""
    sample = record.scene.sample
    return (
        sample.container == "cylinder"
        and sample.radius == 0.075
        and sample.grain_radius.mean == 3.2e-3
        and record.scene.material.grain.density == 2710
        and len(sample.symmetry) == 2
    )


def structure(figures: Figures) -> str:
    """Coordination number and relative density in cycles."""
    return section(
        "Coordination number and relative density",
        picture(
            figures.get("coordination"),
            "Coordination number and relative density against load cycles",
            "At the end of each cycle, load at its trough, when the bed is loosest in contact. "
            "Relative density is taken below a fixed height, nine tenths of the prepared bed's.",
        ),
    )


def penetration(record: Record, numbers: Numbers, figures: Figures) -> str:
    """What the jumps did to the overlaps, and what each step of a jump adds to the error."""
    if not numbers.jumps:
        return section("Jumps and relaxation", paragraph("No jump was made."), hung(record))
    measures = []
    for name, jump in record.run.jumps:
        relaxation = jump.notes["relaxation"]
        if "relaxed" not in relaxation:
            continue
        for when in ("before", "estimated", "relaxed"):
            bed = relaxation[when]
            last = when == "relaxed"
            measures.append(
                (
                    escape(name.partition("_")[2]) if when == "before" else "",
                    when,
                    plain(bed["contacts"], "d"),
                    plain(bed["coordination_number"], ".3f"),
                    micrometres(bed["max_penetration"], ".3g"),
                    micrometres(bed["mean_penetration"], ".3g"),
                    number(bed["mean_height"], f"{1e3 * bed['mean_height']:.4f}"),
                    plain(relaxation["evaluations"], "d") if last else "",
                    plain(relaxation["cpu_s"], ".2f") if last else "",
                )
            )
    effects = [
        (
            f"{jump.first_cycle} → {jump.last_cycle}",
            micrometres(jump.estimated),
            micrometres(jump.truth),
            micrometres(jump.law_error, "+.1f"),
            micrometres(jump.relaxation_change, "+.3f"),
            micrometres(jump.healing_error, "+.1f"),
            per_cent(jump.coordination_change, "+.2f") + " " + verdict(jump.coordination_ok),
            per_cent(jump.height_change, ".2f") + " " + verdict(jump.height_ok),
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
            (
                "cycles jumped",
                "settlement by the law",
                "full run, same cycles",
                "law",
                "relaxation",
                "healing cycles",
                "coordination number changed",
                "height changed by relaxation",
            ),
            effects,
        ),
        picture(
            figures.get("penetration"),
            "Histograms of penetration before jumps, as estimated and relaxed",
            "Penetrations of grains with grains and walls, the load at its trough.",
        ),
        table(
            "Measures of relaxation, from the record of each jump (cycle and attempt). Contacts "
            "with walls count here; penetrations in µm, mean height in mm.",
            (
                "jump",
                "state",
                "contacts",
                "coordination number",
                "greatest penetration",
                "mean penetration",
                "mean height",
                "evaluations",
                "CPU time (s)",
            ),
            measures,
            words=frozenset({1}),
        )
        if measures
        else paragraph("The scene asks for no relaxation."),
        owed(record),
        describe_changed_places(record),
        hung(record),
    )


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
    """What jumps by history asked for and the bed did not settle by, where anything is left, and
    what it settled too much."""
    notes = [jump.notes for _, jump in record.run.jumps if "asked" in jump.notes]
    left = notes[-1]["asked"] - notes[-1]["gain"] if notes else 0.0
    if left == 0:
        return ""
    if left < 0:
        return paragraph(
            f"<strong>The last jump settled the bed by {micrometres(-left)} µm more than asked:"
            "</strong> grains changed places. The settlement predicted is that much smaller."
        )
    jammed = record.scene.procedure is not None and record.scene.procedure.jammed == "less"
    places = (
        ', and with <code>procedure.jammed = "rearranged"</code> grains change places'
        if jammed
        else ""
    )
    return paragraph(
        f"<strong>The bed has settled {micrometres(left)} µm less than its jumps were to move it:"
        "</strong> no room for more was found without overlaps. The settlement predicted is that "
        "much greater; shorter jumps, or more of them, leave the bed the cycles to make room"
        f"{places}."
    )


def describe_changed_places(record: Record) -> str:
    """In how many jumps grains changed places, and what that leaves of the bed before."""
    jumps = record.run.jumps
    notes = [jump.notes for _, jump in jumps if "hops" in jump.notes.get("relaxation", {})]
    if not notes:
        return ""
    settled = micrometres(sum(note["gain"] for note in notes))
    return paragraph(
        f"<strong>In {len(notes)} of {len(jumps)} jumps grains changed places</strong>, as a move "
        f"had no room among them, and settled by {settled} µm in all. Their contacts are those of "
        "a bed without friction, more than before, until the first cycles behind the jump have "
        "loaded them, so what these jumps change of contacts and height is not judged; and where "
        "single grains lie says nothing."
    )


def sample(figures: Figures) -> str:
    """The grains themselves."""
    return section(
        "The sample",
        picture(
            figures.get("sample"),
            "The grains before and after loading, coloured by residual displacement",
            "Seen from inside the container. Before loading, each grain has the colour of the move "
            "it is going to make in this run; the scale ends at the 98th percentile, since a few "
            "loose grains move furthest.",
        ),
    )


def preparation(record: Record, numbers: Numbers, figures: Figures) -> str:
    """Fig. 3 of the paper and its numbers."""
    bed = numbers.preparation
    if bed is None:
        return section("Preparation", paragraph("The rain of grains has not ended yet."))
    paper = karrech(record)

    def row(name: str, value: str, printed: str) -> tuple[str, ...]:
        return (name, value, printed) if paper else (name, value)

    rows = [
        row("weight of all grains (N)", plain(bed.weight, ".3f"), f"{PAPER_WEIGHT}"),
        row(
            "apparent weight, on the floor (N)",
            plain(bed.apparent_weight, ".3f"),
            f"{PAPER_WEIGHT}",
        ),
        row(
            "coordination number, contacts with grains",
            plain(bed.coordination_grains, ".2f"),
            f"near {PAPER_COORDINATION:g}; which of the three it does not say",
        ),
        row("the same, contacts with walls too", plain(bed.coordination_with_walls, ".2f"), ""),
        row(
            "the same, without grains of fewer than two contacts",
            plain(bed.coordination_without_rattlers, ".2f"),
            "",
        ),
        row("share of such grains", per_cent(bed.rattler_share, ".1f"), ""),
        row(
            "relative density below nine tenths of the height",
            plain(bed.relative_density, ".4f"),
            f"{PAPER_DENSITY} (0.53 with the free surface)",
        ),
        row("height of the bed (mm)", number(bed.height, f"{1e3 * bed.height:.1f}"), "60"),
        row(
            "kinetic over potential energy, translation",
            plain(bed.energy_ratio, ".2g"),
            "1e-6; which energy it does not say",
        ),
        row("the same, rotation too", plain(bed.energy_ratio_with_rotation, ".2g"), ""),
        row("simulated time (s)", plain(bed.duration, ".3f"), ""),
        row("CPU time (s)", plain(bed.cpu_s, ".1f"), ""),
    ]
    weight = (
        paragraph(
            f"The paper's {PAPER_WEIGHT} N do not follow from its Table 1: this quarter of the "
            f"cylinder weighs {plain(bed.weight, '.2f')} N, the whole "
            f"{number(4 * bed.weight, f'{4 * bed.weight:.1f}')} N."
        )
        if paper
        else ""
    )
    return section(
        "Preparation",
        paragraph(
            "Grains start at random places, rain under gravity, and have settled when kinetic over "
            "potential energy is below 1e-6 (section 2.3 of the paper). The kinetic energy is the "
            "translational one: a loose grain that spins about the normal of its only contact has "
            "no torque to stop it, so with rotation the criterion might never be met."
        ),
        picture(
            figures.get("preparation"),
            "Apparent weight, coordination number, relative density and energies against time",
            "As Fig. 3 of the paper. Relative density below a fixed height, nine tenths of the "
            "settled bed's.",
        ),
        table(
            "The settled bed.",
            ("", "this bed", "the paper") if paper else ("", "this bed"),
            rows,
            words=frozenset({2}),
        ),
        weight,
    )


def piston(numbers: Numbers, figures: Figures) -> str:
    """Whether the load was what the scene asks for."""
    return section(
        "The load on the piston",
        picture(
            figures.get("piston"),
            "Force error in each cycle, and target and contact force in the last one",
            "The piston is inertial and driven by the target force; the bed pushes back.",
        ),
        table(
            "Root mean square of contact minus target force over the peak, without the first three "
            f"cycles of each window; bar {100 * FORCE_ERROR_GOAL:.0f} % for the worst cycle.",
            ("window", "cycles", "all cycles", "worst cycle", "bar"),
            [
                (
                    escape(window.window),
                    f"{window.first_cycle} → {window.last_cycle}",
                    per_cent(window.mean_error, ".2f"),
                    per_cent(window.worst_error, ".2f"),
                    verdict(window.ok),
                )
                for window in numbers.piston
            ],
        ),
    )


def cost(numbers: Numbers, figures: Figures) -> str:
    """Where the time went, and the work that no machine changes."""
    purposes = (
        ("engine: time steps", "engine", ".1f"),
        ("engine: start-up", "start_up", ".1f"),
        ("parse", "parse", ".2f"),
        ("fit", "fit", ".2f"),
        ("relax", "relax", ".2f"),
        ("other Python", "other_python", ".2f"),
        ("failed jumps, by the clock", "failed_jumps", ".1f"),
        ("total", "total", ".1f"),
        ("preparation, not in the total", "preparation", ".1f"),
    )
    rows = [
        (label, *(plain(getattr(cost, field_), form) for cost in numbers.costs))
        for label, field_, form in purposes
    ]
    rows += [
        ("Python's share", *(per_cent(cost.python_share, ".1f") for cost in numbers.costs)),
        ("load cycles computed", *(str(cost.cycles_computed) for cost in numbers.costs)),
        ("grain-steps", *(plain(cost.grain_steps, ".3g") for cost in numbers.costs)),
    ]
    return section(
        "Cost",
        picture(figures.get("cost"), "CPU time by purpose", "From the start of loading."),
        table(
            "CPU time in s from the start of loading. Python's share counts parse, fit, relax and "
            f"other Python; its bar is {100 * PYTHON_BAR:.0f} %. Grain-steps (grains {TIMES} time "
            "steps computed) are work that no machine changes.",
            ("", *(cost.name for cost in numbers.costs)),
            rows,
            "total",
        ),
    )
