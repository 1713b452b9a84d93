"""A fit of beds as keys of a scene, as figures, and what it can not know."""

from collections.abc import Iterator
from math import isfinite, isnan
from typing import Any

import numpy as np

from track_line.beds import SHORTEST_MEMORY
from track_line.laws import BedLoad, Law, list_laws
from track_line.measured.choice import NEGLIGIBLE, POOR, USUAL, Estimate, is_above
from track_line.measured.ensemble import Ensemble
from track_line.measured.fit import NAMED, SMALL, BedFit
from trackbed.plausible import describe_implausible

FOREVER = 1e3
"""Memory of scatter that lasts, as `fit.share_kept` takes what is not known [m]: no bed settles a
thousandth of it."""
ENOUGH = 30
"""Packings from which on a correlation is known to +-0.3 at `choice.LEVEL`."""
FAR, LASTING = 1e20, 0.01
"""Cycles over the last one behind which a rate is for ever, and its share of the last rate from
which on it is worth a sentence [-]: N^b has that from b = 0.9 on."""


def format_settings(fit: BedFit) -> list[str]:
    """Keys of a scene that the beds give, as ``--set`` takes them; what is not known is left out.

    In place of the scene's law, which they replace.
    """
    memory = FOREVER if isnan(fit.memory.value) else max(fit.memory.value, SHORTEST_MEMORY)
    values = {
        "track.bed": fit.bed, "scatter.settlement": min(fit.settlement, 3.0),
        "scatter.stiffness": fit.stiffness.value, "scatter.together": fit.together.value,
        "scatter.memory": min(memory, FOREVER),
        "scatter.length": fit.length.value,
    }  # fmt: skip
    settings = [f"{key}={value:.4g}" for key, value in values.items() if isfinite(value)]
    if fit.law is None:
        return settings
    known = ((name, one.value) for name, one in fit.law.parameters.items())
    law = ", ".join(f"{name}={value:.4g}" for name, value in known if isfinite(value))
    return [f'law={{name="{fit.law.name}", parameters={{{law}}}}}', *settings]


def summarise_fit(ensemble: Ensemble, fit: BedFit) -> dict[str, Any]:
    """Figures by name, for people and for ``--json``: an `Estimate` as value, low and high; None
    for what is not known."""
    figures: dict[str, Any] = {
        "beds": len(ensemble.settled), "packings": ensemble.packings,
        "loads": len(np.unique(ensemble.load)), "first_cycle": ensemble.cycle[0],
        "last_cycle": ensemble.cycle[-1], "law": fit.law.name if fit.law else None,
        "misfit_of_others": fit.reference.mean(),
    }  # fmt: skip
    for name in list_laws():
        figures[f"misfit_{name}"] = fit.laws[name].misfit.mean() if name in fit.laws else np.nan
    figures |= {k: v for k, v in (fit.law.parameters if fit.law else {}).items() if k != "force"}
    figures |= {
        "force_n": fit.force, "m": fit.m, "seated_m": fit.law.seated if fit.law else np.nan,
        "bed_n_per_m": fit.bed,
        "variation_of_stiffness": fit.stiffness, "variation_of_gain": fit.total,
        "variation_of_rate": fit.settlement, "gain_with_stiffness": fit.together,
        "window": fit.window,
    }  # fmt: skip
    for back, one in enumerate(fit.persistence):
        figures[f"persistence_{back + 1}"] = one
    figures |= {"memory_m": fit.memory, "length_m": fit.length}
    plain: dict[str, Any] = {}
    for name, value in figures.items():
        if isinstance(value, Estimate):
            ends = zip(("", "_low", "_high"), vars(value).values(), strict=True)
            plain |= {name + end: one for end, one in ends}
        else:
            plain[name] = value
    return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in plain.items()}


def format_figures(figures: dict[str, Any]) -> str:
    """What `summarise_fit` found, a line each, intervals in brackets behind their values."""

    def show(name: str) -> str:
        value = figures[name]
        return "-" if value is None else value if isinstance(value, str) else f"{value:.4g}"

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
    yield from describe_law(ensemble, fit)
    if isnan(fit.force):
        yield "the load is not known: give that of half a sleeper as law.parameters.force"
    else:
        tried = ensemble.force
        yield f"half a sleeper bore {min(tried):.4g} to {max(tried):.4g} N; other loads are untried"
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
        yield (
            f"some beds rise in between, as if tamped, and are in no correlation of that window: "
            f"{', '.join(fit.rose[:NAMED])} ({len(fit.rose)} of {len(ensemble.names)})"
        )
    if isnan(fit.bed):
        yield "the stiffness is not known, nor how settlement goes with it: the scene's own remain"
    if isnan(fit.length.value):
        yield "neighbours in a line are not known: scatter.length is the scene's"


def describe_law(ensemble: Ensemble, fit: BedFit) -> Iterator[str]:
    """Which law it is, which others would do, and what it can not know."""
    if held := fit.laws[USUAL].held:
        how = "at a constant rate or faster" if held > 0 else "as the logarithm or slower"
        yield f"the beds settle {how}, where a power law is none"
    if unknown := sorted(set(list_laws()) - set(fit.laws)):
        yield f"{', '.join(unknown)} hang on load or stiffness, which are not known here"
    near = fit.law or min(fit.laws.values(), key=lambda one: one.misfit.mean())
    if near.held or is_above(near.misfit - fit.reference, POOR):
        yield (
            f"{near.name} does not describe the beds: it leaves {near.misfit.mean():.2g} of their "
            f"variance, other beds {fit.reference.mean():.2g}"
        )
    if fit.law is None:
        yield "no law describes the beds: the scene's own remains"
        return
    if near.early > 1:
        yield (
            f"before its first reading at cycle {ensemble.cycle[0]:.3g} a bed settles more by this "
            "law than was read in all: D1 hangs on what nobody saw"
        )
    alike = [name for name, one in fit.laws.items() if one is not near and not one.held
             and one.early < 1 and not is_above(one.misfit - near.misfit, NEGLIGIBLE)]  # fmt: skip
    if alike:
        yield f"as far as these beds know, {', '.join(alike)} would do as well: try --law"
    yield from describe_future(ensemble, fit, near.law)


def describe_future(ensemble: Ensemble, fit: BedFit, law: Law) -> Iterator[str]:
    """What a law says of cycles before the first reading and after the last, and of other loads."""
    first, last, tried = ensemble.cycle[0], ensemble.cycle[-1], ensemble.force

    def settle(force: float, begin: float, cycles: float) -> float:
        load, rest = BedLoad(np.asarray(force), np.asarray(fit.bed)), np.asarray(0.0)
        with np.errstate(all="ignore"):
            before = law.advance(load, rest, 0.0, begin)
            return float(law.advance(load, before, begin, cycles))

    force = getattr(law, "force", fit.force)
    rate, lasting = (settle(force, n, last) / last for n in (last, FAR * last))
    if lasting > LASTING * rate:
        yield (
            f"by this law {lasting:.2g} m a cycle last for ever, {lasting / rate:.0%} of the last "
            "rate: they decide D1 later"
        )
    if isnan(fit.m.value):
        yield "one load shows no load dependence: the law keeps its exponent of the force"
        return
    more, less = (settle(one, first, last - first) for one in (np.nanmax(tried), np.nanmin(tried)))
    with np.errstate(divide="ignore"):
        m = np.log(more / less) / np.log(np.nanmax(tried) / np.nanmin(tried))
    if m < fit.m.low - SMALL or m > fit.m.high + SMALL:
        yield f"settlement goes as the load to the {m:.2g} by this law, to the m above in beds"
