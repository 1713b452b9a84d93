"""A fit of beds as keys of a scene, as figures, and what it can not know."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite, isnan
from typing import Any

import numpy as np

from track_line.beds import SHORTEST_MEMORY
from track_line.laws import get_law
from track_line.measured.ensemble import Ensemble
from track_line.measured.fit import FASTEST, BedFit, Estimate
from trackbed.plausible import describe_implausible

FOREVER = 1e3
"""Memory of scatter that lasts, as `fit.share_kept` takes what is not known [m]: no bed settles a
thousandth of it."""
ENOUGH = 30
"""Packings from which on a correlation is known to +-0.3 at `fit.LEVEL`."""


def format_settings(fit: BedFit) -> list[str]:
    """Keys of a scene that the beds give, as ``--set`` takes them; what is not known is left out.

    In place of the scene's law, which they replace.
    """
    memory = FOREVER if isnan(fit.memory.value) else max(fit.memory.value, SHORTEST_MEMORY)
    law = {"a": fit.a, "b": fit.b.value, "m": fit.m.value, "force": fit.force}
    known = ", ".join(f"{name}={value:.4g}" for name, value in law.items() if isfinite(value))
    values = {
        "track.bed": fit.bed, "scatter.settlement": min(fit.settlement, 3.0),
        "scatter.stiffness": fit.stiffness.value, "scatter.together": fit.together.value,
        "scatter.memory": min(memory, FOREVER),
        "scatter.length": fit.length.value,
    }  # fmt: skip
    settings = [f"{key}={value:.4g}" for key, value in values.items() if isfinite(value)]
    whole = f'law={{name="power", parameters={{{known}}}}}'
    return settings if isnan(fit.b.value) else [whole, *settings]


def summarise_fit(ensemble: Ensemble, fit: BedFit) -> dict[str, Any]:
    """Figures by name, for people and for ``--json``: an `Estimate` as value, low and high; None
    for what is not known."""
    figures: dict[str, Any] = {
        "beds": len(ensemble.settled), "packings": ensemble.packings,
        "loads": len(np.unique(ensemble.load)), "first_cycle": ensemble.cycle[0],
        "last_cycle": ensemble.cycle[-1], "force_n": fit.force, "a_m": fit.a, "b": fit.b,
        "m": fit.m, "seated_m": fit.seated, "bed_n_per_m": fit.bed,
        "variation_of_stiffness": fit.stiffness, "variation_of_gain": fit.total,
        "variation_of_rate": fit.settlement, "gain_with_stiffness": fit.together,
        "window": fit.window,
        **{f"persistence_{back}": one for back, one in enumerate(fit.persistence, 1)},
        "memory_m": fit.memory, "length_m": fit.length,
    }  # fmt: skip
    plain: dict[str, Any] = {}
    for name, value in figures.items():
        if isinstance(value, Estimate):
            ends = zip(("", "_low", "_high"), vars(value).values(), strict=True)
            plain |= {name + end: one for end, one in ends}
        else:
            plain[name] = value
    return {k: v if isinstance(v, int) or isfinite(v) else None for k, v in plain.items()}


def format_figures(figures: dict[str, Any]) -> str:
    """What `summarise_fit` found, a line each, intervals in brackets behind their values."""

    def show(name: str) -> str:
        value = figures[name]
        return "-" if value is None else f"{value:.4g}"

    lines = []
    for name in figures:
        if not name.endswith(("_low", "_high")):
            ends = name + "_low" in figures and figures[name] is not None
            band = f" ({show(name + '_low')} ... {show(name + '_high')})" if ends else ""
            lines.append(f"{name.replace('_', ' '):28}{show(name)}{band}")
    return "\n".join(lines)


def list_doubts(ensemble: Ensemble, fit: BedFit) -> Iterator[str]:
    """What of the table was left out, and what these beds can not know, a sentence each."""
    yield from ensemble.notes
    deepest = float(abs(ensemble.settled).max())
    if said := describe_implausible("settlement", deepest, "the deepest bed"):
        yield said
    if isnan(fit.b.value):
        yield (
            "the beds settle as the logarithm of cycles or slower, as no power law does: the "
            "scene's own law remains"
        )
    elif fit.b.value > FASTEST:
        yield "the beds settle ever faster, so b is held at 1: they fail, or were not read in order"
    elif (ensemble.cycle[-1] / ensemble.cycle[0]) ** fit.b.value < 2:
        yield (
            f"before its first reading at cycle {ensemble.cycle[0]:.3g} a bed settles more by this "
            "law than was read in all: D1 hangs on what nobody saw"
        )
    law, tried = get_law("power")(), ensemble.force
    if isnan(fit.force):
        yield "the load is not known: give that of half a sleeper as law.parameters.force"
    else:
        yield f"half a sleeper bore {min(tried):.4g} to {max(tried):.4g} N; other loads are untried"
    if isnan(fit.m.value):
        yield f"one load shows no load dependence: m stays {law.m:g}"  # type: ignore[attr-defined]
    yield (
        f"there are {ensemble.cycle[-1]:.3g} cycles: a constant rate of {fit.unseen:.2g} m a cycle "
        "at most may be hidden in the last window, which later cycles would show"
    )
    yield (
        f"of {ensemble.packings} packings the variation of the gain is "
        f"{fit.total.low:.2g} to {fit.total.high:.2g}, of an area as large as was loaded"
    )
    latest = fit.persistence[0]
    if not latest.low > 0:
        yield (
            f"persistence is not shown: {latest.value:.2g} ({latest.low:.2g} to {latest.high:.2g}) "
            f"of {ensemble.packings} packings, where {ENOUGH} would do; D1 depends on it fivefold: "
            "run with a scatter.memory far below the settlement, and with one far above it"
        )
    if fit.rose:
        yield f"{fit.rose} beds rise in a window and are left out of its correlations"
    if isnan(fit.bed):
        yield "the stiffness is not known, nor how settlement goes with it: the scene's own remain"
    if isnan(fit.length.value):
        yield "neighbours in a line are not known: scatter.length is the scene's"
