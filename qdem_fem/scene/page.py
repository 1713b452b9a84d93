"""The report of a run: one page, ``report.html``, that loads nothing, and its pictures as PNG."""

import json
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

from qdem_fem.files import read_table
from qdem_fem.report import Mode
from qdem_fem.scene.energy_account import STORED
from qdem_fem.scene.run import Done, RunFolder
from qdem_fem.scene.summary import find_moving_components
from trackbed.report import (
    make_folded,
    make_list,
    make_page,
    make_paragraph,
    make_picture,
    make_section,
    make_table,
)
from trackbed.run_files import write_whole


def write_report(
    folder: RunFolder, manifest: dict[str, Any], summary: dict[str, Any], done: Done | None,
    more: Iterable[tuple[Path, str]] = (),
) -> Path:  # fmt: skip
    """Write the report of a finished run, and its pictures unless ``done`` is None; its path.

    ``more``: files and captions of further pictures."""
    pictures = (
        [] if done is None else [*more, *_draw_pictures(folder.path, manifest, summary, done)]
    )
    title = summary["title"] or "QDEM run"
    body = [
        f"<h1>{escape(title)}</h1>",
        _format_claim(summary),
        *_format_warnings(summary),
        *(make_picture(path, caption, escape(caption)) for path, caption in pictures),
        *_format_bed(summary),
        *_format_discretisation(summary),
        *_format_probes(summary),
        *_format_modes(summary),
        _format_meshes(summary),
        _format_step(summary),
        _format_energy(summary),
        make_section("What is not in this run", make_list(map(escape, summary["left_out"]))),
        _format_cost(summary),
        _format_rerun(manifest),
    ]
    path = folder.path / "report.html"
    write_whole(path, make_page(title, body))
    return path


def _draw_pictures(
    path: Path, manifest: dict[str, Any], summary: dict[str, Any], done: Done
) -> Iterator[tuple[Path, str]]:
    """Draw what there is to draw; file and caption of each picture."""
    from qdem_fem.report import OUTLINED, draw_deformed
    from qdem_fem.report import figures as pictures

    deformed = path / "picture-deformed.png"
    bodies = list(done.bodies.values())
    asked = manifest["scene"].get("output", {}).get("magnification")
    factor = draw_deformed(deformed, bodies, asked)
    when = "at rest" if done.plan is None else f"at t = {summary['time']:.6g} s"
    lines = "; thin lines: undeformed" * (len(bodies) <= OUTLINED)
    yield deformed, f"Bodies {when}, displacement magnified {factor:g} times{lines}."
    if done.plan is None:
        return
    rows, energy = read_table(path / "probes.csv"), read_table(path / "energy.csv")
    time = rows.pop("time")
    moving = {name: (time, rows[name]) for name in find_moving_components(rows)}
    if moving:
        history = path / "picture-history.png"
        pictures.draw_history(history, moving)
        yield history, "Mean displacement of the probes; components that hardly move are left out."
    modes = summary["modes"]
    seen = {name: curve for name, curve in moving.items() if name in modes}
    if seen:
        spectrum = path / "picture-spectrum.png"
        found = [Mode(**mode) for of_probe in modes.values() for mode in of_probe]
        pictures.draw_spectrum(spectrum, seen, found)
        yield spectrum, "Amplitude spectrum of the whole record (Hann window); dotted: modes."
    balance = path / "picture-energy.png"
    pictures.draw_energy(balance, energy)
    yield balance, "Energies; external is the work of loads, gravity and prescribed motion."


def _format_claim(summary: dict[str, Any]) -> str:
    bodies = summary["bodies"].values()
    elements, nodes = (sum(body[key] for body in bodies) for key in ("elements", "nodes"))
    kinds = " and ".join(dict.fromkeys(body["element"] for body in bodies))
    mesh = f"{elements:,} {kinds} tetrahedra with {nodes:,} nodes"
    if summary["method"] == "static":
        answer = summary["static"]
        text = (
            f"Static answer by conjugate gradients, {answer['steps']:.0f} evaluations of the "
            f"forces, {mesh}; residual {answer['residual']:.2g} of the loads."
        )
    else:
        text = (
            f"{summary['time']:.6g} s of motion in {summary['steps']:,} steps of "
            f"{summary['step']:.4g} s, {mesh}."
        )
    return make_paragraph(escape(text), "claim")


def _format_warnings(summary: dict[str, Any]) -> Iterator[str]:
    if summary["warnings"]:
        yield make_section("Warnings", make_list(map(escape, summary["warnings"])))


def _format_discretisation(summary: dict[str, Any]) -> Iterator[str]:
    """The errors that come of the mesh, which no solver's residual shows."""
    if found := summary["discretisation"]:
        words = "Estimated from the jumps of the stress between elements"
        words += "." if summary["static"] else ", where most elastic energy was."
        rows = [
            ("displacement under the load: missing of the true one", "displacement"),
            ("stress in the energy norm: wrong of the true one", "stress"),
            ("frequency of such a motion: too much of the one found", "frequency"),
        ]
        shown = [(text, f"{100 * found[name]:.2g} %") for text, name in rows]
        table = _format_table(("of the mesh", "share"), shown)
        yield make_section("Errors of the mesh", table, make_paragraph(words))


def _format_probes(summary: dict[str, Any]) -> Iterator[str]:
    rows = [
        (name, axis, *(f"{1e6 * facts[what][i]:.6g}" for what in ("end", "least", "greatest")))
        for name, facts in summary["probes"].items()
        for i, axis in enumerate("xyz")
    ]
    header = ("probe", "component", "end (um)", "least (um)", "greatest (um)")
    if rows:
        yield make_section("Displacement of the probes", _format_table(header, rows))


def _format_modes(summary: dict[str, Any]) -> Iterator[str]:
    rows = [
        (name, f"{m['frequency']:.6g}", f"{m['decay']:.4g}", f"{1e6 * m['amplitude']:.4g}")
        for name, modes in summary["modes"].items()
        for m in modes
    ]
    words = "Damped cosines fitted to the record since the last change of a load, strongest first."
    header = ("record", "frequency (Hz)", "decay (1/s)", "amplitude (um)")
    if rows:
        yield make_section(
            "Modes of the free motion", make_paragraph(words), _format_table(header, rows)
        )


def _format_meshes(summary: dict[str, Any]) -> str:
    header = (
        "body", "element", "elements", "nodes", "surface faces", "turned right-handed",
        "unused nodes", "smallest altitude (mm)", "in element", "mass (kg)",
    )  # fmt: skip
    rows = [
        (
            name, b["element"], f"{b['elements']:,}", f"{b['nodes']:,}", f"{b['surface_faces']:,}",
            str(b["flipped"]), str(b["unused_nodes"]), f"{1e3 * b['smallest_altitude']:.4g}",
            str(b["thinnest_element"]), f"{b['mass']:.6g}",
        )
        for name, b in summary["bodies"].items()
    ]  # fmt: skip
    gains = [
        make_paragraph(f"{escape(name)}: {b['gain']}.")
        for name, b in summary["bodies"].items()
        if b["gain"]
    ]
    return make_section("Bodies and meshes", _format_table(header, rows), *gains)


def _format_step(summary: dict[str, Any]) -> str:
    critical = summary["critical_step"]
    text = "No elastic motion limits the step. "
    if critical["value"] is not None and critical["element"] < 0:
        text = f"Critical step {critical['value']:.4g} s, of contact between rigid bodies. "
    elif critical["value"] is not None:
        text = (
            f"Critical step {critical['value']:.4g} s (highest angular frequency "
            f"{critical['omega']:.4g} 1/s); its motion is strongest in element "
            f"{critical['element']} of {critical['body']}. "
        )
    if summary["method"] != "static":
        text += f"Used: {summary['step']:.4g} s, {100 * critical['share_used']:.1f} % of it."
    if critical["remark"]:
        text += f" Remarkably short: {critical['remark']}."
    if scaled := summary["mass_scaling"]:
        text += (
            f" Mass scaling added {scaled['added_mass']:.4g} kg, {100 * scaled['share']:.3g} % of "
            "the bodies' own mass: inertia that they do not have"
            + ("." if "gravity" in summary["left_out"] else ", and as much of their weight.")
        )
    return make_section("Time step", make_paragraph(escape(text)))


def _format_energy(summary: dict[str, Any]) -> str:
    energy = summary["energy"]
    if summary["method"] == "static":
        return make_section("Energy", make_paragraph(f"Elastic energy {energy['elastic']:.6g} J."))
    named = [name for name in energy if name in (*STORED, "external")]
    rows = [(f"{name} at the end", f"{energy[name]:.6g}") for name in named]
    imbalance = f"{energy['greatest_imbalance']:.3g} ({100 * energy['relative_imbalance']:.2g} %)"
    rows.append(("greatest external - kinetic - elastic on the way", imbalance))
    return make_section("Energy", _format_table(("energy", "J"), rows))


def _format_bed(summary: dict[str, Any]) -> Iterator[str]:
    """What the prepared bed of a track bears."""
    if words := summary.get("bed", {}).get("words"):
        yield make_section("The prepared bed", make_paragraph(f"{escape(words.capitalize())}."))


def _format_cost(summary: dict[str, Any]) -> str:
    cost = summary["cost"]
    cpu, wall = f"{cost['cpu_s']:.3g}", f"{cost['wall_s']:.3g}"
    rows = [("CPU time (s)", cpu), ("time on the clock (s)", wall)]
    if "million_elements_per_s" in cost:
        speed = f"{cost['million_elements_per_s']:.3g}"
        rows.append(("million element-steps per second on the clock", speed))
    words = "Advancing alone; without reading, pictures and compilation before the first step."
    return make_section("Cost", _format_table(("", ""), rows), make_paragraph(words))


def _format_rerun(manifest: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in manifest["versions"].items())
    made = "; ".join([versions, manifest["machine"], manifest["started"]])
    asked = f"<pre>{escape(json.dumps(manifest['scene'], indent=1))}</pre>"
    files = [
        make_paragraph(f"{escape(name)}: SHA-256 <code>{digest}</code>")
        for name, digest in manifest["files"].items()
    ]
    return make_section(
        "To compute it again",
        f"<pre>{escape(manifest['command'])}</pre>",
        make_paragraph(f"{escape(made)}."),
        make_folded("What was asked, defaults included", "".join([asked, *files])),
    )


def _format_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return make_table("", [escape(cell) for cell in header], ([*map(escape, row)] for row in rows))
