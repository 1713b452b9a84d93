"""The report of a run: ``report.html``, ``report.json`` and ``figures/`` in its folder.

The page is one file that loads nothing.  It begins with one claim and where it fails, gives the
error beside the cost it saved (`adapters.report.error` defines both), then jumps and failures.
"""

from collections.abc import Iterator
from html import escape
from math import nan
from pathlib import Path

from adapters import procedure
from adapters.files import explain_full_disk
from adapters.report.control import describe_control
from adapters.report.error import Comparison
from adapters.report.figure import draw_settlement
from adapters.report.jumps import describe_jumps
from adapters.report.numbers import Numbers, gather_numbers
from adapters.report.verdict import FITTED, FULL, NOTHING, PROCEDURE, PURPOSES
from trackbed.report import (
    MINUS,
    TIMES,
    format_number,
    format_share,
    format_um,
    make_folded,
    make_list,
    make_page,
    make_paragraph,
    make_picture,
    make_section,
    make_table,
    mark_number,
    save_figure,
)
from trackbed.run_files import refuse_writing, write_whole


def write_report(run_folder: Path, record: procedure.Record | None = None) -> Path:
    """Write the report of a run, finished or not; returns the path of ``report.html``.

    ``record``: what was read of the run already.  Raises `UsageError` when ``run_folder`` is no run
    folder.  Only reads what finished stages left, so it may be called while the run goes on.
    """
    record = record or procedure.read_run_record(run_folder)
    numbers = gather_numbers(record)
    with explain_full_disk(run_folder):
        figure = write_figure(record, numbers.settled) if numbers.cycle else None
        write_whole(run_folder / "report.json", numbers.to_json())
        html = make_page(f"Settlement of {numbers.scene}", list_sections(record, numbers, figure))
        write_whole(run_folder / "report.html", html)
    return run_folder / "report.html"


def write_brief_report(record: procedure.Record) -> Path:
    """Write the report of a bed that trackbed did not make: its settlement, and failed jumps."""
    settled = procedure.judge_members(record)
    with explain_full_disk(record.path):
        figure = write_figure(record, settled) if settled else None
        body = [
            "<h1>Settlement under cyclic load</h1>",
            *(make_paragraph(escape(one)) for one in procedure.describe_result(record)),
            make_picture(figure, "Settlement curve", "Grey spans were jumped."),
            make_section("Failed jumps", make_list(escape(j.why) for j in record.run.failed_jumps)),
            make_section("Damaged", make_list(map(escape, record.damaged))),
        ]
        write_whole(record.path / "report.html", make_page("Settlement of a deck", body))
    return record.path / "report.html"


def write_figure(record: procedure.Record, found: procedure.Settled | None) -> Path:
    """Draw the settlement; the picture's path."""
    folder = record.path / "figures"
    with refuse_writing(folder):
        folder.mkdir(exist_ok=True)
    full = None if record.control is None else record.control.history
    spans = record.run.spans
    title = ""
    if found is not None and found.pairs:
        title = f"error {100 * found.error.value:+.1f} % at a speed-up of {found.speed_up:.2f}"
    return save_figure(
        lambda: draw_settlement(record.run.history, full, spans, title, record.members),
        folder / "settlement.png",
    )


def list_sections(record: procedure.Record, numbers: Numbers, figure: Path | None) -> Iterator[str]:
    """All sections; those that the run has not reached are left out."""
    yield f'<h1>Settlement under cyclic load</h1><p class="scene">{escape(numbers.scene)}</p>'
    yield from _describe_claim(record, numbers)
    if numbers.cycle:
        yield _describe_settlement(numbers, figure)
        if record.asked > 1:
            yield _describe_members(record, numbers.cycle)
        if numbers.error_rows:
            yield _describe_error(numbers)
        yield _describe_cost(numbers)
        yield describe_control(record)
        yield describe_jumps(record, numbers)
    yield _describe_failures(numbers)
    yield make_section("What the model leaves out", make_list(map(escape, numbers.left_out)))
    yield _describe_provenance(numbers)
    yield make_section(
        "Make it again",
        make_paragraph("In this run folder:"),
        f"<pre>{escape(numbers.reproduce)}</pre>",
    )


def _describe_claim(record: procedure.Record, numbers: Numbers) -> Iterator[str]:
    """One falsifiable sentence, and where it fails."""
    row = numbers.row(PROCEDURE)
    full = numbers.row(FULL)
    if not numbers.cycle:
        state = "is settled" if numbers.preparation else "is not settled yet"
        yield make_paragraph(f"The bed {state}; no load cycle has been computed.", "claim")
        return
    grains, claim = map(escape, procedure.describe_result(record))
    if not numbers.finished:
        claim = f"Unfinished, at cycle {numbers.cycle} of {numbers.total_cycles}: {claim}"
    yield make_paragraph(f"{claim}.", "claim")
    if row is None or full is None:
        why = "there is no full run beside it (<code>trackbed run … --control</code> adds it)"
        if record.manifest.get("control"):
            why = "the full run beside it is not past the first jump yet"
        known = (
            f"The error is unknown: {why}. The speed-up is at most "
            f"{format_number(numbers.speed_up_most, '.2f')}, cycles done over cycles computed."
        )
    else:
        known = (
            "Errors are of the gain since the first jump. CPU time is counted from the start of "
            f"loading; with the preparation the speed-up is "
            f"{format_number(row.speed_up_with_preparation, '.2f')}."
        )
    yield make_paragraph(f"{grains}. {known}")
    if numbers.fails:
        fails = make_list(escape(sentence) + "." for sentence in numbers.fails)
        yield f'<div class="fails"><p>Where it fails:</p>{fails}</div>'


def _describe_settlement(numbers: Numbers, figure: Path | None) -> str:
    """The curve: the picture of the report."""
    caption = (
        "Permanent settlement of the loaded body since the preparation, at the end of each load "
        "cycle (load at its trough). Grey spans were jumped. "
    )
    if numbers.row(NOTHING) is not None:
        caption += (
            "Dotted: the same jumps with nothing moved, which is the full run with the jumped "
            "cycles cut out."
        )
    return make_section("Settlement", make_picture(figure, "Settlement curve", caption))


def _describe_members(record: procedure.Record, cycle: int) -> str:
    """Members, and the full runs beside them, at the cycle of the first."""
    definition = make_paragraph(
        "Member <i>m</i> goes on from the state after the first cycles with one grain moved by "
        f"<i>m</i> {TIMES} 10<sup>{MINUS}10</sup> m: what members differ by is chaos, in standard "
        "deviations. Bands are Student's 90 % intervals of the mean; errors, of each member less "
        "the full run from the same state, are over the mean gain of the full runs. The rest of "
        "this page is about member 0; each has a report of its own."
    )
    header = ("member", "loaded body (µm)", "its full run", "mean grain (µm)", "its full run")
    rows = [
        [str(number)] + [
            format_um(track.history.gain(0, cycle, of) if track else nan)
            for of in ("loaded_body", "settlement") for track in (one.run, one.control)
        ]
        for number, one in enumerate((record, *record.members))
    ]  # fmt: skip
    caption = f"Settlement at cycle {cycle}, as far as it was reached."
    return make_section("Members", definition, make_table(caption, header, rows))


def _describe_error(numbers: Numbers) -> str:
    """Error against speed-up: definitions, table, and what it cannot show."""
    definition = make_paragraph(
        "Speed-up <i>S</i> = <i>T</i><sub>full</sub> / <i>T</i><sub>procedure</sub>: CPU time of "
        "engine and Python with everything in it, from the start of loading. The paper's gained "
        f"time of 180 % is <i>S</i> {MINUS} 1 = 1.8."
    )
    header = (
        f"at cycle {numbers.compared_at}", "cycles computed",
        *(f"{title}, error" for title, _, _ in COMPARED.values()),
        "E<sub>r</sub> of displacements", "E<sub>r</sub> of coordinates", "CPU time (s)",
        "speed-up",
    )  # fmt: skip
    rows = [
        (
            row.name,
            str(row.computed),
            *(show_with_error(row, name) for name in COMPARED),
            format_number(row.jump_displacement_error, ".2f"),
            format_number(row.coordinates_error, ".4f"),
            format_number(row.cpu_s, ".1f"),
            format_number(row.speed_up, ".2f"),
        )
        for row in numbers.error_rows
    ]
    return make_section(
        "Error against speed-up",
        definition,
        make_table(
            "Errors are signed and relative to the full run at the same cycle; of a settlement, "
            "to its gain since the state before the first jump. Coordination number "
            f"(contacts with grains) and deflection are means over the last {procedure.AVERAGED} "
            f"computed cycles. “{NOTHING}” is the full run after as many cycles as this run "
            f"computed: the null hypothesis. “{FITTED}” extrapolates the full run's curve "
            "from there by the scene's law: a settlement, but no bed. E<sub>r</sub> of eq. 22 of "
            "the displacements since the state before the first jump: 1 is the error of leaving "
            "all grains there; of the coordinates, as in the paper: small for any method.",
            header,
            rows,
            PROCEDURE,
        ),
        make_folded("What this comparison cannot show", make_list(LIMITS)),
    )


LIMITS = (
    "One run beside one run. A bed of grains is chaotic: two full runs of 1,085 grains, one grain "
    "of the second moved by 1e-10 m at the start, differed by 7 % in settlement after 60 cycles. A "
    "smaller error in a single run is luck; a method is judged by the means of several, and single "
    "grains prove none.",
    "The control repeats the stages before the first jump bit for bit, so they agree by "
    "construction and are in both costs.",
    "CPU times are of one machine that other work may have shared; grain-steps are not.",
    "A failed jump is charged with elapsed time, since the CPU time of an engine that was given up "
    "is not known. Work lost to stops of the run is not charged.",
)


COMPARED = {
    "loaded_body": ("loaded body (µm)", 1e6, ".1f"),
    "stiffness": ("stiffness (kN/mm)", 1e-6, ".3g"),
    "settlement": ("mean grain (µm)", 1e6, ".1f"),
    "coordination_number": ("coordination number", 1.0, ".3f"),
    "elastic_deflection": ("elastic deflection (µm)", 1e6, ".1f"),
}  # fmt: skip
"""Quantities of a `Comparison`: title, its unit in SI ones, format; each has an error."""


def show_with_error(row: Comparison, name: str) -> str:
    """A quantity of `COMPARED` and its error; the full run has none."""
    (_, scale, form), value = COMPARED[name], getattr(row, name)
    error = "" if row.name == FULL else format_share(getattr(row, f"{name}_error"))
    return f'{mark_number(value, f"{scale * value:{form}}")} <span class="error">{error}</span>'


def _describe_cost(numbers: Numbers) -> str:
    """Where the time went, and the work that no machine changes."""
    rows = [
        (label, *(format_number(cost[purpose], form) for cost in numbers.costs))
        for purpose, (label, form) in PURPOSES.items()
    ]
    return make_section(
        "Cost",
        make_table(
            f"CPU time in s from the start of loading. Grain-steps (grains {TIMES} time steps "
            "computed) are work that no machine changes.",
            ("", *(cost["name"] for cost in numbers.costs)),
            rows,
            "total",
        ),
    )


def _describe_failures(numbers: Numbers) -> str:
    """Failures named and counted."""
    counted = make_paragraph(
        f"Failed attempts at a jump: {len(numbers.failed_jumps)}; stops before the end: "
        f"{len(numbers.stops)}; unfinished or superseded stages moved to discarded/: "
        f"{len(numbers.discarded)}."
    )
    items = [f"<code>{escape(stage)}</code>: {escape(why)}" for stage, why in numbers.failed_jumps]
    items += [f"stopped {escape(time)}: {escape(why)}" for time, why in numbers.stops]
    items += [
        f"<code>{escape(name)}</code> is not as the run left it: trackbed resume makes it again"
        for name in numbers.damaged
    ]
    items += [f"discarded <code>{escape(name)}</code>" for name in numbers.discarded]
    return make_section("Failures", counted, make_list(items) if items else "")


def _describe_provenance(numbers: Numbers) -> str:
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
    bed = [
        (name.replace("_", " ").replace(".", ": "), format_number(value, ".4g"))
        for name, value in numbers.preparation.items()
    ]
    parameters = [
        (f"<code>{escape(key)}</code>", escape(_format_value(value)))
        for key, value in numbers.parameters.items()
    ]
    decks = [(f"<code>{escape(k)}</code>", f"<code>{v}</code>") for k, v in numbers.decks.items()]
    words = frozenset({1})
    parts = [make_table("", (), rows, words=words)]
    for title, caption, found in (
        ("The settled bed before loading", "SI units.", bed),
        ("Effective parameters", "SI units.", parameters),
        ("Decks", "SHA-256.", decks),
    ):
        if found:
            parts.append(make_folded(title, make_table(caption, (), found, words=words)))
    return make_section("Provenance", *parts)


def _format_value(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) < 80 else text[:77] + "..."
