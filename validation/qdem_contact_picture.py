"""The picture of the page on contact: error against cost, of stress between cubes and of Hertz.

python -m validation.qdem_contact_picture        writes docs/qdem-contact.png
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from validation.qdem_contact_hertz import CELLS
from validation.qdem_contact_hertz import MODELS as HERTZ_MODELS
from validation.qdem_contact_page import PAGE, record_read
from validation.qdem_contact_trials import FACES, faces_name

PICTURE = PAGE.with_suffix(".png")
COLOURS = {
    "spheres": "#b0413e", "surface": "#2a6f97", "points": "#2a6f97", "overlaps": "#3a7d44",
    "rival": "#555555",
}  # fmt: skip


def points_of(values: dict[str, float]) -> list[tuple[str, bool, float, float]]:
    """Model, whether meshes match, CPU of a step [s], greatest error of the stress."""
    return [
        (model, below == above, values[f"{name}: step"], values[f"{name}: stress, greatest error"])
        for model, below, above, detail in FACES
        for name in [faces_name(model, below, above, detail)]
    ]


def hertz_of(values: dict[str, float], model: str) -> tuple[list[float], list[float]]:
    """CPU until it rests, or is solved [s], and error of the force, mesh by mesh."""
    ends = "solved" if model == "rival" else "until it rests"
    names = [f"Hertz, {model}, {cells} cells" for cells in CELLS]
    return [values[f"{n}: {ends}"] for n in names], [values[f"{n}: force error"] for n in names]


def draw(checks: list[dict[str, Any]], path: Path) -> None:
    """All models, meshes that match and such that do not, and a rival."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    values = {check["name"]: check["value"] for check in checks}
    figure, (panel, hertz) = pyplot.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
    for model in ("spheres", "surface", "overlaps"):
        for same, marker in ((True, "o"), (False, "s")):
            chosen = [p for p in points_of(values) if p[:2] == (model, same)]
            cost, error = [p[2] for p in chosen], [p[3] for p in chosen]
            label = f"{model.replace('surface', 'points')}, meshes {'match' if same else 'differ'}"
            panel.loglog(cost, error, marker, color=COLOURS[model], label=label,
                         mfc=COLOURS[model] if same else "none")  # fmt: skip
    panel.axhline(0.01, color="#888888", lw=0.8, ls=":")
    panel.set(xlabel="CPU time of a step, elements included (s)",
              ylabel="greatest error of the stress", title="two cubes")  # fmt: skip
    for model in (*HERTZ_MODELS, "rival"):
        own = COLOURS[model.split(",")[0]]
        label = "scikit-fem, active set" if model == "rival" else model
        style = "--^" if model == "spheres, matching" else "-o"
        hertz.loglog(*hertz_of(values, model), style, color=own, label=label)
    hertz.set(xlabel="CPU time until at rest, or solved (s)", ylabel="error of the force",
              title="Hertz, three meshes")  # fmt: skip
    for each in (panel, hertz):
        each.legend(fontsize=7)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


if __name__ == "__main__":
    draw(record_read()["checks"], PICTURE)
