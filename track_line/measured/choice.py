"""Which law the beds follow: each is fitted to their mean, and judged by beds that it did not see.

A law that was fitted to the others, with a start and a factor of its own, leaves a share of the
variance of each bed's readings: its misfit, 1 - r^2.  Intervals leave out each bed (jackknife).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import combinations
from math import isfinite
from typing import Any

import numpy as np
from scipy.stats import t

from track_line.arrays import Bools, Floats
from track_line.laws import SEAT_AREA, BedLoad, Law, get_law, list_laws
from track_line.measured.ensemble import Ensemble

LEVEL = 0.9
"""Probability that an interval holds what it is of [-]."""
USUAL = "power"
"""Law that is taken where no other fits better beyond its uncertainty."""
STEPS = 2000
"""Values of `Law.shape` that are tried, evenly in its logarithm: b to a thousandth of itself."""
NEGLIGIBLE, POOR = 1e-6, 0.01
"""Misfits [-]: what readings to a thousandth of the gain leave; and above that of the mean of the
other beds from which on, beyond uncertainty, a law does not describe the beds."""


@dataclass(frozen=True)
class Estimate:
    """A value with its interval; nan for what is not known."""

    value: float = np.nan
    low: float = np.nan
    high: float = np.nan


@dataclass(frozen=True)
class LawFit:
    """s = c + the law's settlement from rest, of a mean bed."""

    name: str
    parameters: dict[str, Estimate]  # that were found, and F0 where it is known [SI]
    seated: float  # c, which is no part of the law of a line [m]
    misfit: Floats  # of each bed, by the law of the others, shape (n,) [-]
    early: float  # settlement before the first reading, over all that was read later [-]
    held: int  # -1 or 1 where the shape is at the lower or upper end of where it is looked for

    @property
    def law(self) -> Law:
        """The law with what was found, and its own where nothing was."""
        known = {name: one.value for name, one in self.parameters.items()}
        return get_law(self.name)(**{k: v for k, v in known.items() if isfinite(v)})


def average(values: Floats) -> float:
    """Mean of the numbers that are known; nan where none is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else np.nan


def fit_laws(ensemble: Ensemble, here: Bools, m: Estimate) -> tuple[dict[str, LawFit], Floats]:
    """Fits by name to the beds ``here``, of all laws but those that hang on what is not known; and
    misfits (n,) [-] of the mean of the others.  ``m``: exponent of the force."""
    settled = ensemble.settled[here][:, ensemble.read]
    n, total = len(settled), settled.sum(axis=0)
    others = (total - settled) / (n - 1) if n > 1 else settled
    force, bed = ensemble.force[here][0], average(ensemble.bedding[here]) * SEAT_AREA
    curves, cycle = np.stack([total / n, *others]), ensemble.middle[ensemble.read]
    fits = (fit_law(one, force, bed, m, cycle, curves, settled) for one in list_laws())
    return {one.name: one for one in fits if one}, find_misfit(settled, others)


def choose_law(fits: Mapping[str, LawFit], reference: Floats) -> LawFit | None:
    """The law that leaves least, or `USUAL` where that does not leave more beyond uncertainty; None
    where all leave more than the mean of the other beds, ``reference`` (n,) [-], are held, or
    settle more before the first reading than was read."""
    sound = {name: one for name, one in fits.items() if one.early < 1
             if not one.held and not is_above(one.misfit - reference, POOR)}  # fmt: skip
    if not sound:
        return None
    best = min(sound.values(), key=lambda one: one.misfit.mean())
    usual = sound.get(USUAL, best)
    return best if is_above(usual.misfit - best.misfit, NEGLIGIBLE) else usual


def is_above(excess: Floats, least: float) -> bool:
    """Whether the mean of ``excess`` (n,) is above ``least`` beyond its uncertainty."""
    n = len(excess)
    half = t.ppf((1 + LEVEL) / 2, n - 1) * excess.std(ddof=1) / np.sqrt(n) if n > 1 else 0.0
    return bool(excess.mean() - half > least)


def fit_law(
    name: str, force: float, bed: float, m: Estimate, cycle: Floats, curves: Floats,
    settled: Floats,
) -> LawFit | None:  # fmt: skip
    """Fit a law to ``curves`` (1 + n, k) [m] at ``cycle`` (k,), the mean of n beds ``settled``
    (n, k) and those of all but one.  None where it has no `Law.terms`, or hangs on ``force`` [N] or
    ``bed`` [N/m] and they are nan."""
    kind: Any = get_law(name)
    bent, low, high = kind.shape or ("", 1.0, 1.0)
    found: dict[str, Estimate] = {}
    if kind.exponent and isfinite(m.value):
        key, less = kind.exponent
        found[key] = Estimate(*(max(one - less, 0.0) for one in vars(m).values()))
    if "force" in {one.name for one in fields(kind)}:
        found["force"] = Estimate(force)
        force = kind.force if np.isnan(force) else force
    given = {key: one.value for key, one in found.items() if isfinite(one.value)}
    load, rest = BedLoad(np.asarray(force), np.asarray(bed)), np.zeros(len(cycle))

    grid = np.geomspace(low, high, STEPS if bent else 1)
    terms = np.zeros((len(grid), len(kind.terms), len(cycle)))  # settlement by each alone
    for place, term in np.ndindex(terms.shape[:2]):
        way = given | {key: float(at == term) for at, key in enumerate(kind.terms)}
        way |= {bent: float(grid[place])} if bent else {}
        with np.errstate(all="ignore"):
            terms[place, term] = kind(**way).advance(load, rest, 0.0, cycle)
    if not terms.size or not np.isfinite(terms).all():
        return None
    best = solve_terms(terms, curves)[1].argmin(axis=0)  # (1 + n,)
    held = int(best[0] == len(grid) - 1) - int(best[0] == 0)  # 0 where nothing bends
    shapes, terms = grid[best], terms[best]
    pairs = zip(terms[:, None], curves[:, None], strict=True)
    amounts = np.array([solve_terms(*pair)[0][0, 0] for pair in pairs])  # (1 + n, p)
    fitted = np.einsum("jp,jpk->jk", amounts, terms)
    shown = np.where(abs(terms[0]).max(axis=1) > 0, amounts, np.nan)
    values = np.column_stack([shown, shapes])
    freedom = len(settled) - 1
    half = t.ppf((1 + LEVEL) / 2, freedom) * np.sqrt(freedom * values[1:].var(axis=0))
    half[-1] += np.nan if held else 0.0
    ways = zip((*kind.terms, bent), values[0], half, strict=True)
    found |= {key: Estimate(one, one - width, one + width) for key, one, width in ways if key}
    seated = float(curves[0].mean() - fitted[0].mean())
    early = float(fitted[0, 0] / max(fitted[0, -1] - fitted[0, 0], np.finfo(float).tiny))
    return LawFit(name, found, seated, find_misfit(settled, fitted[1:]), early, held)


def solve_terms(terms: Floats, curves: Floats) -> tuple[Floats, Floats]:
    """Amounts (g, j, p) >= 0 of ``terms`` (g, p, k) in ``curves`` (j, k), beside a constant, and
    the squares (g, j) that they leave: the least of all sets of terms."""
    terms, curves = (one - one.mean(axis=-1, keepdims=True) for one in (terms, curves))
    size = np.linalg.norm(terms, axis=-1, keepdims=True)
    size[size == 0] = 1.0
    left = whole = np.broadcast_to((curves**2).sum(axis=-1), (len(terms), len(curves)))
    amounts = np.zeros((*left.shape, terms.shape[1]))
    places = range(terms.shape[1])
    for chosen in (list(one) for r in places for one in combinations(places, r + 1)):
        x = terms[:, chosen] / size[:, chosen]
        right = x @ curves.T
        some = np.linalg.pinv(x @ x.transpose(0, 2, 1), hermitian=True) @ right
        squares = whole - (some * right).sum(axis=1)
        better = (some >= 0).all(axis=1) & (squares < left)
        left = np.where(better, squares, left)
        amounts[better] = 0.0
        amounts[..., chosen] += better[..., None] * (some / size[:, chosen]).transpose(0, 2, 1)
    return amounts, left


def find_misfit(settled: Floats, curves: Floats) -> Floats:
    """Share of the variance of each of ``settled`` (n, k) that its curve, (n, k), leaves, (n,)."""
    x, y = (one - one.mean(axis=1, keepdims=True) for one in (settled, curves))
    whole = (x**2).sum(axis=1) * (y**2).sum(axis=1)
    return np.asarray(1 - (x * y).sum(axis=1) ** 2 / np.where(whole > 0, whole, 1.0))
