"""Work against precision, a picture a study: error against cost in four figures of the bed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.settlement_rivals import METHODS, Method, Row
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
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

COLOURS = {
    "procedure": "#0072B2", "nothing moved": "#E69F00", "law": "#56B4E9", "tolerance": "#0072B2",
    "softer": "#D55E00", "longer step": "#009E73", "frequency": "#CC79A7", "density": "#000000",
    "fewer grains": "#999999", "h = 0": "#999999", "history": "#882255",
    "history, profile": "#CC6677",
}  # fmt: skip
"""One a family."""
TICKS = {
    "coarse": (2, 5, 10, 20, 50, 100), "confined": (100, 200, 500, 1000, 2000),
    "far": (5, 20, 50, 100, 200, 500, 1000), "partial": (200, 500, 1000, 2000),
}  # fmt: skip
"""Of CPU time [s], by the name of the study."""
LINEAR = 50
"""Error up to which its scale is linear [%]."""
INTERVAL_FROM = 3
"""Packings from which on an interval is drawn; that of two is as wide as the panel."""
PANELS = ("settlement", "coordination", "deflection")


def draw(name: str, target: Path) -> None:
    """Errors of a study's methods, numbered in its order, in per cent of the reference's mean.

    The band is what one full run a packing has.  Raises KeyError for a ``name`` of no study.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    study = STUDIES[name]
    rows, last, methods = record_read(study.record), study.last, study.methods
    figure, axes = plt.subplots(2, 2, figsize=(13, 8), layout="constrained")
    for axis, key in zip(axes.flat, PANELS, strict=False):
        band = 100 * chaos(rows, last, key)
        axis.axhspan(-band, band, color="0.88")
        axis.axhline(0, color="0.5", lw=0.8)
        for number, (way, family) in enumerate(shown(methods), 1):
            found = judged(rows, way, last, key)
            if found is not None:
                half = 100 * found.half if len(found.error) >= INTERVAL_FROM else 0.0
                point(axis, rows, f"{number}  {way}", family, last, (100 * found.mean, half))
        axis.set_ylabel(f"error of the {FIGURES[key].words} [%]")
        if max(map(abs, axis.get_ylim())) > LINEAR:
            axis.set_yscale("symlog", linthresh=LINEAR)
    axis = axes.flat[3]
    axis.axhline(100 * profile_chaos(rows, last), color="0.5", ls="--", lw=0.8)
    for number, (way, family) in enumerate(shown(methods), 1):
        errors = profile_error(rows, way, last)
        if len(errors):
            at = 100 * float(errors.mean()), 0.0
            point(axis, rows, f"{number}  {way}", family, last, at)
    axis.set_ylabel("error of the density profile, rms over layers [%]")
    for axis in axes.flat:
        axis.axvline(cost(reference(rows, last)), color="0.5", lw=0.8, ls=":")
        axis.set(xscale="log", xlabel=f"CPU s to cycle {last} (dotted: every cycle)")
        axis.set_xticks(TICKS[name], [f"{tick:,}" for tick in TICKS[name]])
        axis.minorticks_off()
    legend(figure, axes)
    figure.savefig(target, dpi=80)
    plt.close(figure)


def shown(methods: Sequence[Method] = METHODS) -> list[tuple[str, str]]:
    """Names and families of all methods, laws the last."""
    laws = [(law_name(law, cycles), "law") for law, cycles in LAWS]
    return [*((method.name, method.family) for method in methods), *laws]


def point(
    axis: Any, rows: Sequence[Row], label: str, family: str, last: int, at: tuple[float, float]
) -> None:
    """A method in a panel by its number, with which the label begins: error and half interval."""
    number, _, name = label.partition("  ")
    where, (error, half) = cost(finished(rows, name, last)), at
    axis.errorbar(where, error, half, fmt="o", ms=4, lw=0.7, color=COLOURS[family], label=label)
    axis.annotate(number, (where, error), fontsize=8, xytext=(3, 3), textcoords="offset points")


def legend(figure: Any, axes: Any) -> None:
    """All methods with their numbers, each once, to the right."""
    found: dict[str, Any] = {}
    for axis in axes.flat:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    labels = sorted(found, key=lambda label: int(label.split()[0]))
    figure.legend([found[label] for label in labels], labels, loc="outside right", fontsize=8)
