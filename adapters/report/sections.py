"""The sections of a report's page, in the order in which a doubting reader asks."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from math import isfinite

from adapters.procedure import AVERAGED, Record
from adapters.report.bed import Figures, cost, penetration, piston, preparation, sample, structure
from adapters.report.control import control
from adapters.report.error import Comparison
from adapters.report.numbers import Numbers, name_variant
from adapters.report.verdict import FITTED, FULL, NOTHING, PROCEDURE
from adapters.scene import Procedure
from trackbed.report import (
    MINUS,
    TIMES,
    bullets,
    folded,
    micrometres,
    paragraph,
    per_cent,
    picture,
    plain,
    section,
    table,
    verdict,
)


def body(record: Record, numbers: Numbers, figures: Figures) -> Iterator[str]:
    """All sections; those that the run has not reached are left out."""
    yield f'<h1>Settlement under cyclic load</h1><p class="scene">{escape(numbers.scene)}</p>'
    yield from _claim(record, numbers)
    if numbers.cycle:
        yield _settlement(numbers, figures)
        yield _error(record, numbers, figures)
        yield structure(figures)
        yield control(record)
        yield penetration(record, numbers, figures)
        yield sample(figures)
    yield preparation(record, numbers, figures)
    if numbers.cycle:
        yield piston(numbers, figures)
        yield cost(numbers, figures)
    yield _bars(numbers)
    yield section("What the model leaves out", bullets(map(escape, numbers.left_out)))
    yield _failures(numbers)
    yield _provenance(numbers)
    yield _fairness(record, numbers)
    yield section(
        "Make it again", paragraph("In this run folder:"), f"<pre>{escape(numbers.reproduce)}</pre>"
    )


def _claim(record: Record, numbers: Numbers) -> Iterator[str]:
    """One falsifiable sentence, and where it fails."""
    row = numbers.row(PROCEDURE)
    full = numbers.row(FULL)
    if not numbers.cycle:
        state = "is settled" if numbers.preparation is not None else "is not settled yet"
        yield paragraph(f"The bed {state}; no load cycle has been computed.", "claim")
        return
    begun = (
        f"{numbers.cycle} load cycles settle the mean grain by {micrometres(numbers.settlement)} µm"
    )
    if not numbers.finished:
        begun = f"Unfinished, at cycle {numbers.cycle} of {numbers.total_cycles}: {begun}"
    if row is None or full is None:
        claim = (
            f"{begun}, computing {numbers.cycles_computed} of them. The error is unknown: "
            f"{explain_unknown(record)}. Counted in cycles, the speed-up is at most "
            f"{plain(numbers.speed_up_of_cycles, '.2f')}."
        )
    else:
        at = ""
        if numbers.compared_at != numbers.cycle:
            at = f" At cycle {numbers.compared_at} it is {micrometres(row.settlement)} µm."
        claim = (
            f"{begun}.{at} The full run, every cycle computed, gives "
            f"{micrometres(full.settlement)} µm, so the error is {per_cent(row.settlement_error)}, "
            f"at a speed-up of {plain(row.speed_up, '.2f')} "
            f"({plain(row.cpu_s, '.1f')} s of CPU time instead of {plain(full.cpu_s, '.1f')} s "
            "from the start of loading; "
            f"{plain(row.speed_up_with_preparation, '.2f')} with preparation)."
        )
    if numbers.floor is not None:
        claim += (
            f" Runs of the same scene that should agree (h = 0, and full runs perturbed by "
            f"1e-10 m) differ by up to {per_cent(numbers.floor, '.1f')}."
        )
    yield paragraph(claim, "claim")
    if numbers.fails:
        fails = bullets(escape(sentence) + "." for sentence in numbers.fails)
        yield f'<div class="fails"><p>Where it fails:</p>{fails}</div>'


def explain_unknown(record: Record) -> str:
    """Why the error is unknown."""
    if record.manifest.get("control"):
        return "the full run beside it is not past the first jump yet"
    return "there is no full run beside it (<code>trackbed run … --control</code> adds it)"


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


def _error(record: Record, numbers: Numbers, figures: Figures) -> str:
    """Error against speed-up: definitions, table, work against precision."""
    definition = paragraph(
        "Speed-up <i>S</i> = <i>T</i><sub>full</sub> / <i>T</i><sub>procedure</sub>; gained time "
        f"<i>G</i> = (<i>S</i> {MINUS} 1) {TIMES} 100 %, so the paper's “180 %” is <i>S</i> = 2.8 "
        "(it quotes gained times and defines them nowhere). <i>T</i> is CPU time of engine and "
        "Python with everything in it: engine, start-up, parse, fit, relax, other Python, failed "
        "jumps; from the start of loading, and in the last column with the preparation too."
    )
    if not numbers.error_rows:
        return section(
            "Error against speed-up",
            definition,
            paragraph(
                f"The error is unknown: {explain_unknown(record)}. The speed-up is estimated from "
                f"cycles, {numbers.cycle} done for {numbers.cycles_computed} "
                f"computed: at most {plain(numbers.speed_up_of_cycles, '.2f')}."
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
            show_with_error(row, micrometres(row.settlement), row.settlement_error),
            show_with_error(
                row, plain(row.coordination_number, ".3f"), row.coordination_number_error
            ),
            show_with_error(
                row, plain(row.relative_density, ".4f"), row.relative_density_error, "+.2f"
            ),
            show_with_error(row, micrometres(row.elastic_deflection), row.elastic_deflection_error),
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
            f"E<sub>r</sub> of eq. 22, ‖<i>u</i> {MINUS} <i>û</i>‖ / "
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


def show_with_error(row: Comparison, value: str, error: float, form: str = "+.1f") -> str:
    """A value and its error; the full run has none."""
    shown = "" if row.name == FULL else per_cent(error, form)
    return f'{value} <span class="error">{shown}</span>'


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
        f"Failed attempts at a jump: {len(numbers.failed_jumps)}; stops before the end: "
        f"{len(numbers.stops)}; unfinished or superseded stages moved to discarded/: "
        f"{len(numbers.discarded)}."
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
        folded(
            "Effective parameters", table("SI units.", ("key", "value"), parameters, words=words)
        ),
        folded("Decks", table("SHA-256.", ("deck", "digest"), decks, words=words)) if decks else "",
    )


def _shown(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) < 80 else text[:77] + "..."


def _setting(procedure: Procedure) -> str:
    """What rules the jumps, in words."""
    if procedure.h is None:
        return f"a tolerance of {per_cent(procedure.tolerance or 0.0)} a jump"
    return f"<i>k</i> = {procedure.k} and <i>h</i> = {', '.join(map(str, procedure.h))}"


def _fairness(record: Record, numbers: Numbers) -> str:
    """What the comparison cannot show."""
    items = [
        "One run beside one run. A bed of grains is chaotic: two full runs of 1,085 grains, one "
        "grain of the second moved by 1e-10 m at the start, differed by 7 % in settlement after 60 "
        "cycles; five continuations of one state at cycle 50 scattered by 1.3 % of the settlement "
        "at cycle 100. A smaller error in a single run is luck; a method is judged by the means of "
        "several.",
        "The control repeats the stages before the first jump bit for bit, so they agree by "
        "construction and are in both costs.",
        "CPU times are of one machine that other work may have shared; grain-steps are not.",
        "A failed jump is charged with elapsed time, since the CPU time of an engine that was "
        "given up is not known. Work lost to stops of the run is not charged.",
    ]
    if record.others:
        names = ", ".join(escape(name_variant(track.name)) for track in record.others)
        items.insert(1, f"Further runs of this scene are in the table: {names}.")
    procedure = record.scene.procedure
    if procedure is not None and isfinite(numbers.settlement):
        items.append(
            f"The law “{escape(procedure.law)}”, grains moved “{escape(procedure.move)}”, "
            f"<i>k</i><sub>i</sub> = {procedure.k_i}, {_setting(procedure)} are one "
            "setting; other settings of the procedure are other points of the plot."
        )
    return section("Known limits of fairness", bullets(items))
