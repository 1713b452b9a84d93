"""The picture of docs/settlement-rivals.md: error against cost in four figures of the bed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.settlement_rivals import METHODS, Row
from validation.settlement_rivals_reading import (
    FIGURES,
    chaos,
    cost,
    finished,
    judged,
    profile_chaos,
    profile_error,
    reference,
)
from validation.settlement_rivals_reference import LAWS, law_name

COLOURS = {
    "procedure": "#0072B2", "nothing moved": "#E69F00", "law": "#56B4E9", "tolerance": "#0072B2",
    "softer": "#D55E00", "longer step": "#009E73", "frequency": "#CC79A7", "density": "#000000",
    "fewer grains": "#999999", "h = 0": "#999999", "history": "#882255",
    "history, profile": "#CC6677",
}  # fmt: skip
"""One a family."""
TICKS = (2, 5, 10, 20, 50, 100)
"""Of CPU time [s]."""
LINEAR = 50
"""Error up to which its scale is linear [%]."""
INTERVAL_FROM = 3
"""Packings from which on an interval is drawn; that of two is as wide as the panel."""
PANELS = ("settlement", "coordination", "deflection")


def draw(rows: Sequence[Row], last: int, target: Path) -> None:
    """Errors in per cent of the reference's mean; the band is what one full run a packing has."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(13, 8), layout="constrained")
    for axis, key in zip(axes.flat, PANELS, strict=False):
        band = 100 * chaos(rows, last, key)
        axis.axhspan(-band, band, color="0.88")
        axis.axhline(0, color="0.5", lw=0.8)
        for name, family in shown():
            found = judged(rows, name, last, key)
            if found is not None:
                half = 100 * found.half if len(found.error) >= INTERVAL_FROM else 0.0
                point(axis, rows, name, family, last, 100 * found.mean, half)
        axis.set_ylabel(f"error of the {FIGURES[key].words} [%]")
        if max(map(abs, axis.get_ylim())) > LINEAR:
            axis.set_yscale("symlog", linthresh=LINEAR)
    axis = axes.flat[3]
    axis.axhline(100 * profile_chaos(rows, last), color="0.5", ls="--", lw=0.8)
    for name, family in shown():
        errors = profile_error(rows, name, last)
        if len(errors):
            point(axis, rows, name, family, last, 100 * float(errors.mean()), 0.0)
    axis.set_ylabel("error of the density profile, rms over layers [%]")
    for axis in axes.flat:
        axis.axvline(cost(reference(rows, last)), color="0.5", lw=0.8, ls=":")
        axis.set(xscale="log", xlabel=f"CPU s to cycle {last} (dotted: every cycle)")
        axis.set_xticks(TICKS, map(str, TICKS))
        axis.minorticks_off()
    legend(figure, axes)
    figure.savefig(target, dpi=80)
    plt.close(figure)


def shown() -> list[tuple[str, str]]:
    """Names and families of all methods."""
    laws = [(law_name(law, cycles), "law") for law, cycles in LAWS]
    return [*((method.name, method.family) for method in METHODS), *laws]


def point(
    axis: Any, rows: Sequence[Row], name: str, family: str, last: int, error: float, half: float
) -> None:
    """A method in a panel by its number, its interval over packings as a bar."""
    at, number = cost(finished(rows, name, last)), [name for name, _ in shown()].index(name) + 1
    label = f"{number}  {name}"
    axis.errorbar(at, error, half, fmt="o", ms=4, lw=0.7, color=COLOURS[family], label=label)
    axis.annotate(str(number), (at, error), fontsize=8, xytext=(3, 3), textcoords="offset points")


def legend(figure: Any, axes: Any) -> None:
    """All methods with their numbers, each once, to the right."""
    found: dict[str, Any] = {}
    for axis in axes.flat:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    labels = sorted(found, key=lambda label: int(label.split()[0]))
    figure.legend([found[label] for label in labels], labels, loc="outside right", fontsize=8)
