"""docs/paper-convergence.md and its picture, from validation/results/paper-convergence.jsonl.

python -m validation.paper_convergence_page
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as File
from typing import Any

import numpy as np

from adapters.run_folder import write_atomically
from validation.jump_runs import record_read
from validation.page_text import page_filled, table
from validation.paper_convergence import (
    FULL,
    JUMPED,
    MEMBER,
    STILL,
    VARIED_H,
    VARIED_K,
    Errors,
    Path,
    Row,
    errors_of,
    falls,
    name_of,
    paths_of,
    rank_with_gain,
)
from validation.paper_convergence_runs import STUDY
from validation.paper_figures_picture import PAPER

PAGE = File(__file__).parents[1] / "docs" / "paper-convergence.md"
TEXT = File(__file__).with_suffix(".md")
COLOURS = ("#E69F00", "#0072B2", "#c8553d", "#009E73")
FIGURES = {
    "coordination": "coordination number", "coordinates": "coordinates (eq. 22)",
    "settlement": "settlement",
}  # fmt: skip
"""Of Figs 12b to 12d."""
PAPER_GAINED = 1.8
"""Gained time at which the paper's text prints errors of Figs 12b to 12d."""
PAPER_ERRORS = {"coordination": 0.12, "coordinates": 0.01, "settlement": 0.005}
"""These errors, relative."""


def page(rows: Sequence[Row]) -> str:
    """The page of a record."""
    paths = paths_of(rows)
    errors = {name: errors_of(path, paths[FULL]) for name, path in paths.items()}
    return page_filled(TEXT.read_text(encoding="utf-8"), {
        "LAST": str(STUDY.last), "K_I": str(STUDY.k_i),
        "WAYS": ways_table(paths, errors), "CLAIMS": claims_table(errors),
        "MADE": "; ".join(dict.fromkeys(f"{row['engine']}, {row['machine']}" for row in rows)),
        "COMMITS": ", ".join(dict.fromkeys(row["commit"][:7] for row in rows)),
        "MEMBER": f"{100 * abs(errors[MEMBER].settlement):.1f} %",
        "MEMBER_E": f"{100 * errors[MEMBER].coordinates:.2f} %",
        "HOURS": f"{sum(path.cost for path in paths.values()) / 3600:.1f}",
    })  # fmt: skip


def ways_table(paths: Mapping[str, Path], errors: Mapping[str, Errors]) -> str:
    """A line a way."""
    lines = [
        [name, str(paths[name].computed), f"{100 * one.gained:.0f} %",
         *(f"{100 * value:+.1f} %" for value in (one.settlement, one.since, one.coordination)),
         *(f"{100 * value:.2g} %" for value in (one.coordinates, one.displacement))]
        for name, one in errors.items()
    ]  # fmt: skip
    head = ["way", "cycles computed", "gained time", "settlement", "behind kᵢ",
            "coordination number", "E_r, coordinates", "E_r, displacements"]  # fmt: skip
    return table(head, lines)


def claims_table(errors: dict[str, Errors]) -> str:
    """What the paper says of the figures, and what came, by a stated rule."""

    def sizes(jumps: Sequence[tuple[int, int]]) -> list[float]:
        return [abs(errors[name_of(k, h)].settlement) for k, h in jumps]

    def told(jumps: Sequence[tuple[int, int]]) -> str:
        return ", ".join(
            f"{100 * size:.1f} % ({name_of(k, h)})"
            for size, (k, h) in zip(sizes(jumps), jumps, strict=True)
        )  # fmt: skip

    ranks = {words: rank_with_gain(errors, name) for name, words in FIGURES.items()}
    ranked = ", ".join(f"{rank:+.2f} ({words})" for words, rank in ranks.items())
    best = max(JUMPED, key=lambda name: errors[name].gained)
    one = errors[best]
    lines = [
        ["11a", "the error falls as k grows, at h = 10", told(VARIED_K),
         "yes" if falls(sizes(VARIED_K)) else "no"],
        ["11b", "it falls as h falls, at k = 40", told(VARIED_H[::-1]),
         "yes" if falls(sizes(VARIED_H[::-1])) else "no"],
        ["12", "errors rise with the gained time", f"rank correlations {ranked}",
         "yes" if min(ranks.values()) > 0.5 else "in part" if max(ranks.values()) > 0.5 else "no"],
        ["12", "at 180 %: coordination 12 %, coordinates 1 %, settlement at most 0.5 %",
         f"at {100 * one.gained:.0f} % ({best}): {100 * abs(one.coordination):.1f} %, "
         f"{100 * one.coordinates:.2g} %, {100 * abs(one.settlement):.1f} %",
         "yes" if all(abs(getattr(one, name)) <= error for name, error in PAPER_ERRORS.items())
         else "in part"],
    ]  # fmt: skip
    return table(["figure", "the paper says", "here", "holds"], lines)


def draw(rows: Sequence[Row], target: File) -> None:
    """Six panels: Figs 11a, 11b and 12a to 12d."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    paths = paths_of(rows)
    figure, axes = pyplot.subplots(2, 3, figsize=(14, 8), layout="constrained")
    settled = (("Fig. 11a: h = 10", VARIED_K), ("Fig. 11b: k = 40", VARIED_H))
    for axis, (title, jumps) in zip(axes[0], settled, strict=False):
        draw_paths(axis, paths, [name_of(k, h) for k, h in jumps], "settlement")
        axis.set(title=title, xlabel="cycle", ylabel="settlement [µm]")
    draw_paths(axes[0, 2], paths, [name_of(k, h) for k, h in VARIED_H], "coordination")
    axes[0, 2].set(title="Fig. 12a: k = 40", xlabel="cycle", ylabel="coordination number")
    for axis, (name, words), letter in zip(axes[1], FIGURES.items(), "bcd", strict=True):
        draw_errors(axis, {n: errors_of(path, paths[FULL]) for n, path in paths.items()}, name)
        axis.set(title=f"Fig. 12{letter}: {words}", xlabel="gained time [%]", ylabel="error [%]")
    figure.savefig(target, dpi=110, metadata={"Software": None})
    pyplot.close(figure)


def draw_paths(axis: Any, paths: Mapping[str, Path], names: Sequence[str], column: str) -> None:
    """The full run, another member, and ways that jump, whose lines are broken over jumps."""
    scale = 1e6 if column == "settlement" else 1.0
    for name, colour in [(FULL, "0.2"), (MEMBER, "0.7"), *zip(names, COLOURS, strict=False)]:
        path = paths[name]
        values = np.where(np.diff(path.cycle, prepend=path.cycle[0] - 1) > 1, np.nan, 1.0)
        axis.plot(path.cycle, scale * getattr(path, column) * values, color=colour, label=name)
    axis.legend(fontsize=8)


def draw_errors(axis: Any, errors: Mapping[str, Errors], figure: str) -> None:
    """Sizes of errors against the gained time; what another member parts by is a line."""
    chaos = 100 * abs(getattr(errors[MEMBER], figure))
    axis.axhline(chaos, color="0.7", label="another member")
    for names, marker, colour in ((JUMPED, "o", "#0072B2"), ((STILL,), "x", "#c8553d")):
        gained = [100 * errors[name].gained for name in names]
        sizes = [100 * abs(getattr(errors[name], figure)) for name in names]
        axis.plot(gained, sizes, marker, color=colour, label="jumps" if marker == "o" else STILL)
    axis.plot(100 * PAPER_GAINED, 100 * PAPER_ERRORS[figure], **PAPER)
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=8)


if __name__ == "__main__":
    record = record_read(STUDY.record)
    write_atomically(PAGE, page(record))
    draw(record, PAGE.with_suffix(".png"))
