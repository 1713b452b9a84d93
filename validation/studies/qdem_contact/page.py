"""The page and its figure: error against cost, of stress between cubes and of Hertz's force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.qdem.checks import describe_checks, describe_origin, find_check
from validation.bench.qdem.contact import CASES, MODELS
from validation.case import Check
from validation.figure import draw_figure
from validation.studies.qdem_contact.bars import check_bars
from validation.studies.qdem_contact.faces import FACES, name_faces
from validation.studies.qdem_contact.hertz import CELLS
from validation.studies.qdem_contact.hertz import MODELS as HERTZ_MODELS
from validation.study import Row, format_table

COLOURS = {
    "spheres": "#b0413e", "surface": "#2a6f97", "points": "#2a6f97", "rival": "#555555"
}  # fmt: skip
POINTS = {
    "**Pressed**: force carried less load, worst of all": "faces, *force carried",
    "share of contact in a step, spheres": "packing of 216 grains, spheres: share",
    "share of contact in a step, points of faces": "packing of 216 grains, surface: share",
    "**Hard cases**: change of angular momentum of a spinning grain":
        "hard case, spinning grain, *: change",
    "warned at 1.001 of the critical step": "hard case, critical step *: warned at 1.001",
}  # fmt: skip


def look_up(checks: Sequence[Check], name: str) -> float:
    """The value of the figure that is named so."""
    return find_check(checks, name).value


def tabulate_hertz(checks: Sequence[Check]) -> list[list[str]]:
    """Rows: model, error of force and radius mesh by mesh, cost on the finest."""
    lines = []
    for model in ("rival", *HERTZ_MODELS):
        ends = "solved" if model == "rival" else "until it rests"
        names = [f"Hertz, {model}, {cells} cells: " for cells in CELLS]
        force, radius = (
            [f"{100 * look_up(checks, f'{name}{what} error'):.0f} %" for name in names]
            for what in ("force", "radius")
        )
        label = "scikit-fem, active set" if model == "rival" else model
        cost = look_up(checks, names[-1] + ends)
        lines.append([label, ", ".join(force), ", ".join(radius), f"{cost:.2g} s"])
    return lines


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    checks = check_bars(rows)
    faces = []
    for model, below, above, detail in FACES:
        name = name_faces(model, below, above, detail)
        error = look_up(checks, f"{name}: stress, greatest")
        step = look_up(checks, f"{name}: step")
        faces.append([name.removeprefix("faces, "), f"{100 * error:.2g} %", f"{1e6 * step:.3g} µs"])
    hard = [
        [words, *(f"{look_up(checks, f'hard case, {words}, {m}: energies'):.1e}" for m in MODELS)]
        for words in CASES
    ]
    return {
        "points": describe_checks(checks, POINTS),
        "faces": format_table(["meshes, model", "greatest error of stress", "a step"], faces),
        "hertz": format_table(
            ["model", "error of the force, three meshes", "of the radius", "cost of the finest"],
            tabulate_hertz(checks),
        ),
        "hard": format_table(["case", *MODELS], hard),
        "made": describe_origin(rows),
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """All models, meshes that match and such that do not, and a rival."""
    checks = check_bars(rows)

    def draw_panels(figure: Any) -> None:
        cubes, hertz = figure.subplots(1, 2)
        for model, below, above, detail in FACES:
            name, same = name_faces(model, below, above, detail), below == above
            cubes.loglog(
                look_up(checks, f"{name}: step"), look_up(checks, f"{name}: stress, greatest"),
                "o" if same else "s", color=COLOURS[model], mfc=COLOURS[model] if same else "none",
                label=f"{model}, meshes {'match' if same else 'differ'}",
            )  # fmt: skip
        cubes.axhline(0.01, color="#888888", lw=0.8, ls=":")
        cubes.set(xlabel="CPU time of a step (s)", ylabel="greatest error of the stress")
        for model in (*HERTZ_MODELS, "rival"):
            ends = "solved" if model == "rival" else "until it rests"
            names = [f"Hertz, {model}, {cells} cells: " for cells in CELLS]
            cost = [look_up(checks, name + ends) for name in names]
            error = [look_up(checks, name + "force error") for name in names]
            style = "--^" if model == "spheres, matching" else "-o"
            hertz.loglog(cost, error, style, color=COLOURS[model.split(",")[0]], label=model)
        hertz.set(xlabel="CPU time until at rest, or solved (s)", ylabel="error of the force")
        for axes in (cubes, hertz):
            handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
            axes.legend(handles.values(), handles.keys(), fontsize=7)

    draw_figure((11, 4.4), draw_panels, picture)
