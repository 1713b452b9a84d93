"""The sections of a report's page, in the order in which a doubting reader asks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from math import isfinite
from pathlib import Path

from adapters.checks import FORCE_ERROR_GOAL
from adapters.report_error import AVERAGED, COORDINATION_BAR, HEIGHT_BAR, PYTHON_BAR, ErrorRow
from adapters.report_html import (
    bullets,
    folded,
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
from adapters.report_numbers import FITTED, FULL, NOTHING, PROCEDURE, Numbers
from adapters.report_record import Record
from adapters.sample import PAPER_COORDINATION, PAPER_WEIGHT

PAPER_DENSITY = 0.5615
"""Relative density of the paper's bed (Table 1)."""

Figures = Mapping[str, Path]


def body(record: Record, numbers: Numbers, figures: Figures) -> Iterator[str]:
    """All sections; those that the run has not come to are left out."""
    yield f'<h1>Settlement under cyclic load</h1><p class="scene">{escape(numbers.scene)}</p>'
    yield from _claim(numbers)
    if numbers.cycle:
        yield _settlement(numbers, figures)
        yield _error(numbers, figures)
        yield _structure(figures)
        yield _penetration(record, numbers, figures)
        yield _sample(figures)
    yield _preparation(record, numbers, figures)
    if numbers.cycle:
        yield _piston(numbers, figures)
        yield _cost(numbers, figures)
    yield _bars(numbers)
    yield section("What the model leaves out", bullets(map(escape, numbers.left_out)))
    yield _failures(numbers)
    yield _provenance(numbers)
    yield _fairness(record, numbers)
    yield section(
        "Make it again",
        paragraph("In this run folder:"),
        f"<pre>{escape(numbers.reproduce)}</pre>",
    )


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


def _claim(numbers: Numbers) -> Iterator[str]:
    """One falsifiable sentence, and where it fails."""
    row = numbers.row(PROCEDURE)
    full = numbers.row(FULL)
    if not numbers.cycle:
        state = "is settled" if numbers.preparation is not None else "is not settled yet"
        yield paragraph(f"The bed {state}; no load cycle has been computed.", "claim")
        return
    begun = (
        f"{numbers.cycle} load cycles settle the mean grain by "
        f"{micrometres(numbers.settlement)} µm"
    )
    if not numbers.finished:
        begun = f"Unfinished, at cycle {numbers.cycle} of {numbers.total_cycles}: {begun}"
    if row is None or full is None:
        claim = (
            f"{begun}, computing {numbers.cycles_computed} of them. The error is unknown: no full "
            f"run stands beside. Counted in cycles, the speed-up is at most "
            f"{plain(numbers.speed_up_of_cycles, '.2f')}."
        )
    else:
        at = ""
        if numbers.compared_at != numbers.cycle:
            at = f" At cycle {numbers.compared_at} it is {micrometres(row.settlement)} µm."
        claim = (
            f"{begun}.{at} The full run, every cycle computed, gives "
            f"{micrometres(full.settlement)} µm, so the error is {per_cent(row.settlement_error)}, "
            f"at a speed-up of {plain(row.speed_up, '.2f')} ({plain(row.cpu_s, '.1f')} s of CPU time "
            f"instead of {plain(full.cpu_s, '.1f')} s from the start of loading; "
            f"{plain(row.speed_up_with_preparation, '.2f')} with preparation)."
        )
    yield paragraph(claim, "claim")
    if numbers.fails:
        fails = bullets(escape(sentence) + "." for sentence in numbers.fails)
        yield f'<div class="fails"><p>Where it fails:</p>{fails}</div>'


def _settlement(numbers: Numbers, figures: Figures) -> str:
    """The curve: the picture of the report."""
    caption = (
        "Drop of the mean height of the grains since the preparation, at the end of each load "
        "cycle (load at its trough). Grey spans were jumped. "
    )
    if numbers.row(NOTHING) is not None:
        caption += (
            "Dotted: the same jumps with nothing moved, which is the full run with the jumped "
            "cycles cut out."
        )
    return section("Settlement", picture(figures.get("settlement"), "Settlement curve", caption))


def _error(numbers: Numbers, figures: Figures) -> str:
    """Error against speed-up: definitions, table, work against precision."""
    definition = paragraph(
        "Speed-up <i>S</i> = <i>T</i><sub>full</sub> / <i>T</i><sub>procedure</sub>; gained time "
        "<i>G</i> = (<i>S</i> − 1) × 100 %, so the paper's “180 %” reads <i>S</i> = 2.8 "
        "(it quotes gained times and defines them nowhere). <i>T</i> is CPU time of engine and "
        "Python with everything in it: engine, start-up, parse, fit, relax, other Python, failed "
        "jumps; from the start of loading, and in the last column with the preparation too."
    )
    if not numbers.error_rows:
        return section(
            "Error against speed-up",
            definition,
            paragraph(
                "No full run stands beside this one: the error is unknown, and the speed-up is "
                f"estimated from cycles, {numbers.cycle} done for {numbers.cycles_computed} "
                f"computed: at most {plain(numbers.speed_up_of_cycles, '.2f')}. "
                "<code>trackbed run … --control</code> adds the full run."
            ),
        )
    header = (
        f"at cycle {numbers.compared_at}",
        "cycles computed",
        "settlement (µm), error",
        "coordination number, error",
        "relative density, error",
        "elastic deflection (µm), error",
    )
    rows = [
        (
            row.name,
            str(row.computed),
            _with_error(row, micrometres(row.settlement), row.settlement_error),
            _with_error(row, plain(row.coordination_number, ".3f"), row.coordination_error),
            _with_error(row, plain(row.relative_density, ".4f"), row.density_error, "+.2f"),
            _with_error(row, micrometres(row.elastic_deflection), row.deflection_error),
        )
        for row in numbers.error_rows
    ]
    costs = [
        (
            row.name,
            plain(row.jump_displacement_error, ".2f"),
            plain(row.displacement_error, ".2f"),
            plain(row.coordinates_error, ".4f"),
            plain(row.cpu_s, ".1f"),
            plain(row.speed_up, ".2f"),
            per_cent(row.gained_time, "+.0f"),
            plain(row.speed_up_with_preparation, ".2f"),
        )
        for row in numbers.error_rows
    ]
    return section(
        "Error against speed-up",
        definition,
        table(
            "Errors are signed and relative to the full run at the same cycle. Coordination number "
            f"(contacts with grains) and deflection are means over the last {AVERAGED} computed "
            f"cycles. “{NOTHING}” is the full run after as many cycles as this run "
            f"computed: the null hypothesis. “{FITTED}” extrapolates the full run's curve "
            "from there by the scene's law: a settlement, but no bed. Both are the full run "
            "itself, so they are free of the scatter that parts two beds.",
            header,
            rows,
            PROCEDURE,
        ),
        table(
            "E<sub>r</sub> of eq. 22, ‖<i>u</i> − <i>û</i>‖ / "
            "‖<i>u</i>‖, three ways, and the cost. Of the residual displacement since the "
            "state before the first jump: 1 is the error of leaving all grains there. Of the "
            "coordinates, as the paper's figures have it: its denominator is the size of the "
            "sample, so it is small for any method. Neither proves a method: a bed is chaotic, and "
            "single grains of two full runs that start 1e-10 m apart end as far apart as these.",
            (
                "",
                "E<sub>r</sub>, displacement since the first jump",
                "E<sub>r</sub>, displacement since loading began",
                "E<sub>r</sub>, coordinates",
                "CPU time (s)",
                "speed-up",
                "gained time",
                "speed-up with preparation",
            ),
            costs,
            PROCEDURE,
        ),
        picture(
            figures.get("error_cost"),
            "Error of the settlement against CPU time",
            "Work against precision. Below the lines the procedure earns its cost. The lines dip "
            "where they happen to cross the full run's last value.",
        ),
        paragraph(
            "The paper's own figures at a gained time of 180 % (<i>S</i> = 2.8), fully confined: "
            "residual displacement 0.5 %, coordinates 1 %, coordination number 12 %."
        ),
    )


def _with_error(row: ErrorRow, value: str, error: float, form: str = "+.1f") -> str:
    """A value and its error; the full run has none."""
    shown = "" if row.name == FULL else per_cent(error, form)
    return f'{value} <span class="error">{shown}</span>'


def _structure(figures: Figures) -> str:
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


def _penetration(record: Record, numbers: Numbers, figures: Figures) -> str:
    """What the jumps did to the overlaps, and what each step of a jump adds to the error."""
    if not numbers.jumps:
        return section("Jumps and relaxation", paragraph("No jump was made."))
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
                    number(bed["contacts"], str(bed["contacts"])),
                    plain(bed["coordination_number"], ".3f"),
                    micrometres(bed["max_penetration"], ".3g"),
                    micrometres(bed["mean_penetration"], ".3g"),
                    number(bed["mean_height"], f"{1e3 * bed['mean_height']:.4f}"),
                    number(relaxation["evaluations"], str(relaxation["evaluations"])) if last else "",
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
    )


def _sample(figures: Figures) -> str:
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


def _preparation(record: Record, numbers: Numbers, figures: Figures) -> str:
    """Fig. 3 of the paper and its numbers."""
    bed = numbers.preparation
    if bed is None:
        return section("Preparation", paragraph("The rain of grains has not ended yet."))
    paper = karrech(record)

    def row(name: str, value: str, printed: str) -> tuple[str, ...]:
        return (name, value, printed) if paper else (name, value)

    rows = [
        row("weight of all grains (N)", plain(bed.weight, ".3f"), f"{PAPER_WEIGHT}"),
        row("apparent weight, on the floor (N)", plain(bed.apparent_weight, ".3f"), f"{PAPER_WEIGHT}"),
        row(
            "coordination number, contacts with grains",
            plain(bed.coordination_grains, ".2f"),
            f"near {PAPER_COORDINATION:g}, which is not said",
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
            "1e-6, which is not said",
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


def _piston(numbers: Numbers, figures: Figures) -> str:
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


def _cost(numbers: Numbers, figures: Figures) -> str:
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
            f"other Python; its bar is {100 * PYTHON_BAR:.0f} %. Grain-steps (grains × time steps "
            "computed) are work that no machine changes.",
            ("", *(cost.name for cost in numbers.costs)),
            rows,
            "total",
        ),
    )


def _bars(numbers: Numbers) -> str:
    """Every figure that has a bar."""
    return section(
        "Bars",
        table(
            "The worst value of this run against each bar.",
            ("", "value", "bar", ""),
            [
                (
                    escape(bar.name),
                    per_cent(bar.value, ".2f"),
                    per_cent(bar.bar, ".0f"),
                    verdict(bar.ok),
                )
                for bar in numbers.bars
            ],
        ),
    )


def _failures(numbers: Numbers) -> str:
    """Failures named and counted."""
    counted = paragraph(
        f"{len(numbers.failed_jumps)} failed jumps, {len(numbers.stops)} stops before the end, "
        f"{len(numbers.discarded)} unfinished or superseded stages moved to discarded/."
    )
    items = [f"<code>{escape(stage)}</code>: {escape(why)}" for stage, why in numbers.failed_jumps]
    items += [f"stopped {escape(time)}: {escape(why)}" for time, why in numbers.stops]
    items += [f"discarded <code>{escape(name)}</code>" for name in numbers.discarded]
    return section("Failures", counted, bullets(items) if items else "")


def _provenance(numbers: Numbers) -> str:
    """Where the result comes from."""
    source = numbers.provenance
    versions = source.get("versions", {})
    rows = [
        ("started (UTC)", escape(str(source.get("started", "")))),
        ("command", f"<code>{escape(str(source.get('command', '')))}</code>"),
        ("commit", f"<code>{escape(source.get('commit') or 'not a checkout')}</code>"),
        ("machine", escape(str(source.get("machine", "")))),
        ("engine", escape("; ".join(numbers.engines) or "not started")),
        ("versions", escape(", ".join(f"{name} {version}" for name, version in versions.items()))),
        ("seed", escape(str(numbers.parameters.get("sample.seed", "")))),
    ]
    parameters = [
        (f"<code>{escape(key)}</code>", escape(_shown(value)))
        for key, value in numbers.parameters.items()
    ]
    decks = [(f"<code>{escape(k)}</code>", f"<code>{v}</code>") for k, v in numbers.decks.items()]
    words = frozenset({1})
    return section(
        "Provenance",
        table("", (), rows, words=words),
        folded("Effective parameters", table("SI units.", ("key", "value"), parameters, words=words)),
        folded("Decks", table("SHA-256.", ("deck", "digest"), decks, words=words)) if decks else "",
    )


def _shown(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) < 80 else text[:77] + "..."


def _fairness(record: Record, numbers: Numbers) -> str:
    """What the comparison can not show."""
    items = [
        "One run beside one run. A bed of grains is chaotic: two full runs of 1,085 grains, one "
        "grain of the second moved by 1e-10 m at the start, differed by 7 % in settlement after 60 "
        "cycles; five continuations of one state at cycle 50 scattered by 1.3 % of the settlement "
        "at cycle 100. A smaller error in a single run is luck; a method is judged by the means of "
        "several.",
        "The control repeats the stages before the first jump bit for bit, so they agree by "
        "construction and are in both costs.",
        "CPU times are of one machine that other work may have shared; grain-steps are not.",
        "A failed jump is charged with elapsed time, since the CPU time of an engine that was given "
        "up is not known. Work lost to stops of the run is not charged.",
    ]
    if record.others:
        names = ", ".join(escape(track.name) for track in record.others)
        items.insert(1, f"Further runs of this scene stand in the table: {names}.")
    procedure = record.scene.procedure
    if procedure is not None and isfinite(numbers.settlement):
        items.append(
            f"The law “{escape(procedure.law)}”, <i>k</i><sub>i</sub> = {procedure.k_i}, "
            f"<i>k</i> = {procedure.k} and <i>h</i> = {', '.join(map(str, procedure.h))} were chosen before the run; other settings "
            "of the same procedure are other points of the plot."
        )
    return section("Known limits of fairness", bullets(items))
