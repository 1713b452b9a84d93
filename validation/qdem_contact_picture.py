"""The picture of the page on contact: error of the stress against the cost of a step.

python -m validation.qdem_contact_picture        writes docs/qdem-contact.png
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from validation.qdem_contact_page import PAGE, record_read
from validation.qdem_contact_trials import FACES, faces_name

PICTURE = PAGE.with_suffix(".png")


def points_of(checks: list[dict[str, Any]]) -> list[tuple[str, bool, float, float]]:
    """Model, whether meshes match, CPU of a step [s], greatest error of the stress."""
    values = {check["name"]: check["value"] for check in checks}
    return [
        (model, below == above, values[f"{name}: step"], values[f"{name}: stress, greatest error"])
        for model, below, above, detail in FACES
        for name in [faces_name(model, below, above, detail)]
    ]


def draw(checks: list[dict[str, Any]], path: Path) -> None:
    """Both models, meshes that match and such that do not."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panel = pyplot.subplots(figsize=(6.4, 3.6), layout="constrained")
    for model, colour in (("spheres", "#b0413e"), ("surface", "#2a6f97")):
        for same, marker in ((True, "o"), (False, "s")):
            chosen = [p for p in points_of(checks) if p[:2] == (model, same)]
            cost, error = [p[2] for p in chosen], [p[3] for p in chosen]
            label = f"{model}, meshes {'match' if same else 'differ'}"
            panel.loglog(cost, error, marker, color=colour, mfc=colour if same else "none",
                         label=label)  # fmt: skip
    panel.axhline(0.01, color="#888888", lw=0.8, ls=":")
    panel.set(xlabel="CPU time of a step, elements included (s)",
              ylabel="greatest error of the stress")  # fmt: skip
    panel.legend(fontsize=8)
    figure.savefig(path, dpi=130)
    pyplot.close(figure)


if __name__ == "__main__":
    draw(record_read()["checks"], PICTURE)
