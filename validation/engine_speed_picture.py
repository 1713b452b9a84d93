"""The picture of ``docs/engine-speed.md``: error against cost, and against the step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.engine_speed_accuracy import ERRORS, steps_of_scene
from validation.engine_speed_bed import bed_scene
from validation.engine_speed_page import NAMES, of_kind, speeds
from validation.engine_speed_runs import Row

STYLES = {
    "liggghts": {"color": "#1b6ca8", "marker": "o", "ms": 8, "mfc": "none", "lw": 3},
    "lammps": {"color": "#c8553d", "marker": "s", "ms": 5, "lw": 1.6},
    "yade": {"color": "#4b8f4f", "marker": "^", "ms": 3, "lw": 0.8},
}
"""Where curves lie on one another, each is still to be seen."""


def draw(rows: Sequence[Row], target: Path) -> None:
    """Error against cost above, error against the step below, one column a kind of error."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    found = speeds(rows)
    counts = sorted({key[1] for key in found})
    few, many = steps_of_scene(bed_scene("lammps", (1, 1)))
    chosen = of_kind(rows, "accuracy")
    figure, axes = pyplot.subplots(2, len(ERRORS), figsize=(13, 6.4), sharey="col")
    for column, (kind, tests) in enumerate(ERRORS.items()):
        above, below = axes[:, column]
        for engine in NAMES:
            here = [row for row in chosen if row["method"] == engine]
            steps = [row["setting"]["steps_in_contact"] for row in here]
            error = [row["error"][kind] for row in here]
            style: dict[str, Any] = STYLES[engine] | {"label": NAMES[engine]}
            below.loglog(steps, error, **style)
            for number, count in enumerate(counts):
                cost = [1e6 * s / found[engine, count][0] for s in steps]
                thin = {"lw": 0.8, "ls": "--", "ms": 2, "label": None} if number else {"lw": 1.5}
                above.loglog(cost, error, **style | thin)
        below.axvspan(few, many, color="0.9", zorder=0)
        above.set_title(f"{kind}\n({tests})", fontsize=9)
        above.set_xlabel("CPU µs a grain and contact", fontsize=8)
        below.set_xlabel("steps in a contact", fontsize=8)
        for axis in (above, below):
            axis.grid(alpha=0.3, which="both", lw=0.4)
            axis.tick_params(labelsize=8)
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error", fontsize=8)
    axes[0, -1].set_ylim(1e-3, 1e-1)  # two decades, as it hardly changes
    axes[0, 0].legend(fontsize=8)
    figure.suptitle(
        f"Above: error against cost ({counts[0]:,} grains; thin, dashed: {counts[-1]:,}).  "
        "Below: against the step; grey: rayleigh_share = 0.2",
        fontsize=9,
    )
    figure.tight_layout()
    figure.savefig(target, dpi=130)
    pyplot.close(figure)
