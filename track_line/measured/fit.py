"""What an ensemble of beds says of the law, the scatter and its persistence, with intervals.

A gain is the settlement of a bed between two cycles.  Scatter and correlations are of logarithms
of gain and stiffness, less the mean of the beds under the same load.  Intervals are those of normal
logarithms; a packing that was loaded several times counts once in them.
"""

from dataclasses import dataclass
from itertools import compress, pairwise
from math import isfinite

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, norm, t

from track_line.arrays import Floats
from track_line.beam import Track
from track_line.beds import SHORTEST_MEMORY
from track_line.laws import SEAT_AREA
from track_line.measured.choice import LEVEL, Estimate, LawFit, average, choose_law, fit_laws
from track_line.measured.ensemble import A_DECADE, Ensemble
from trackbed.errors import UsageError

NAMED = 5  # beds that a sentence names at most
ONE = 1 - 1e-12
"""Greatest correlation that has an interval [-]."""
SMALL = 1e-6
"""Settlement over memory from which on scatter lasts for ever, to round-off [-]."""


@dataclass(frozen=True)
class BedFit:
    """The law of a mean bed, and how beds scatter about it."""

    force: float  # on half a sleeper: the pressure under most beds times `SEAT_AREA` [N]
    laws: dict[str, LawFit]  # all that the readings can carry, by name
    law: LawFit | None  # the one that was asked for, or describes the beds best
    reference: Floats  # misfit of each bed of these by the mean of the others, shape (n,) [-]
    m: Estimate  # exponent of the force [-]
    bed: float  # mean stiffness under half a sleeper [N/m]
    stiffness: Estimate  # its coefficient of variation [-]
    total: Estimate  # coefficient of variation of the gain over all cycles [-]
    together: Estimate  # correlation of gain with stiffness [-]
    window: float  # last cycle of a window over its first: a decade, or half of less than two [-]
    persistence: tuple[Estimate, ...]
    """Correlation of the gains in two windows that follow one another, the latest first [-]."""
    rose: list[str]  # names of beds that rose in a window, and are in no correlation of it
    memory: Estimate
    """Mean settlement after which scatter is forgotten by e [m], by the latest persistence."""
    settlement: float  # coefficient of variation of ds/dN [-], of which ``total`` is what lasts
    length: Estimate
    """Along the line, over which beds are alike, where sleepers are `Track.spacing` apart [m]."""
    unseen: float  # constant rate that would make the whole of the last window's gain [m a cycle]


def fit_beds(ensemble: Ensemble, law: str | None = None) -> BedFit:
    """Law, scatter and persistence of an ensemble; ``law``: the one to take, where it is not the
    best of all.  Raises `UsageError` for beds that rise, and a law that they can not carry."""
    cycle, settled, load = ensemble.cycle, ensemble.settled, ensemble.load
    gain, n = settled[:, -1] - settled[:, 0], ensemble.packings
    if rising := list(compress(ensemble.names, gain <= 0)):
        raise UsageError(
            f"{len(rising)} of {len(gain)} beds rise from cycle {cycle[0]:.3g} to {cycle[-1]:.3g}: "
            f"{', '.join(rising[:NAMED])}",
            remedy="settlement is positive downwards; leave out beds whose readings are wrong",
        )
    here = load == max(load, key=lambda one: (np.count_nonzero(load == one), one))
    ends = find_ends(ensemble)
    gains = -np.diff(settled[:, ends], axis=1).T
    late, early = (means := gains[:, here].mean(axis=1))[:2]
    if means.min() < 0:
        rise = int(means.argmin())
        raise UsageError(
            f"the mean bed rises from cycle {cycle[ends[rise + 1]]:.3g} to {cycle[ends[rise]]:.3g}",
            remedy="give the readings between one tamping and the next alone",
        )
    m = fit_load(ensemble, gain)
    laws, reference = fit_laws(ensemble, here, m)
    if law is not None and law not in laws:
        raise UsageError(
            f"the law {law} hangs on load or stiffness, which these beds do not say",
            remedy=f"take one of {', '.join(laws)}",
        )
    stiff, uneven = (centre(np.log(of), load) for of in (ensemble.bedding, gain))

    logs = [centre(np.log(np.where(one > 0, one, np.nan)), load) for one in gains]
    persistence = tuple(find_correlation(*pair, n) for pair in pairwise(logs))
    memory = Estimate(*(find_memory(r, late, early) for r in vars(persistence[0]).values()))
    total = estimate_variation(uneven, load, n)
    neighbours = find_likeness(uneven) if ensemble.in_order else Estimate()
    return BedFit(
        force=float(ensemble.force[here][0]), laws=laws,
        law=laws[law] if law else choose_law(laws, reference), reference=reference, m=m,
        bed=average(ensemble.bedding[here]) * SEAT_AREA,
        stiffness=estimate_variation(stiff, load, n), total=total,
        together=find_correlation(stiff, uneven, n), window=float(cycle[ends[0]] / cycle[ends[1]]),
        persistence=persistence, rose=list(compress(ensemble.names, gains.min(axis=0) <= 0)),
        memory=memory, settlement=total.value / share_kept(gain[here].mean(), memory.value),
        length=Estimate(*map(find_length, vars(neighbours).values())),
        unseen=float(late / (cycle[ends[0]] - cycle[ends[1]])),
    )  # fmt: skip


def find_ends(ensemble: Ensemble) -> NDArray[np.int64]:
    """Places of cycles that end windows, the last first: decades, or halves of less than two, each
    moved to the nearest cycle that was read, lest a straight line lend two windows one slope.

    Raises `UsageError` where no two windows follow one another.
    """
    last = len(ensemble.cycle) - 1
    wanted = np.arange(last, -1, -min(A_DECADE, last // 2))
    known = np.flatnonzero(ensemble.read)
    ends = np.unique([known[abs(known - one).argmin()] for one in wanted if known.size])[::-1]
    if len(ends) < 3:
        raise UsageError(
            f"no readings of all beds divide cycles {ensemble.cycle[0]:.3g} to "
            f"{ensemble.cycle[-1]:.3g}", remedy="read all beds at the same cycles, three times at "
            "least, evenly spaced in their logarithm",
        )  # fmt: skip
    return np.asarray(ends)


def centre(logs: Floats, group: NDArray[np.int64]) -> Floats:
    """Logarithms (n,) less the mean of those known of their ``group`` (n,)."""
    centred = np.where(np.isfinite(logs), logs, np.nan)
    for one in np.unique(group):
        mine = (group == one) & np.isfinite(centred)
        centred[mine] -= centred[mine].mean() if mine.any() else 0.0
    return centred


def fit_load(ensemble: Ensemble, gain: Floats) -> Estimate:
    """m: slope of ln gain over ln load, within packings where they have several loads."""
    known = np.isfinite(ensemble.force)
    x, y, packing = np.log(ensemble.force[known]), np.log(gain[known]), ensemble.packing[known]
    if not known.any() or not np.ptp(x):
        return Estimate()
    within = len(np.unique(packing)) < len(x)
    group = packing if within else np.zeros(len(x), int)
    x, y = centre(x, group), centre(y, group)
    freedom = len(x) - len(np.unique(group)) - 1
    m = float(x @ y / (x @ x))
    if freedom < 1:
        return Estimate(m)
    error = np.sqrt(((y - m * x) ** 2).sum() / freedom / (x @ x))
    half = float(t.ppf((1 + LEVEL) / 2, freedom) * error)
    return Estimate(m, m - half, m + half)


def estimate_variation(logs: Floats, load: NDArray[np.int64], packings: int) -> Estimate:
    """Coefficient of variation of lognormal numbers, from what is known of their centred
    logarithms (n,)."""
    known = np.isfinite(logs)
    freedom = min(packings, int(np.count_nonzero(known))) - 1
    spare = np.count_nonzero(known) - len(np.unique(load[known]))
    if freedom < 1 or spare < 1:
        return Estimate()
    variance = float((logs[known] ** 2).sum()) / spare
    bounds = freedom / chi2.ppf([(1 + LEVEL) / 2, (1 - LEVEL) / 2], freedom)
    return Estimate(*(float(np.sqrt(np.expm1(variance * one))) for one in (1.0, *bounds)))


def find_correlation(x: Floats, y: Floats, packings: int) -> Estimate:
    """Correlation of two quantities (n,) where both are known; its interval after Fisher."""
    both = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(both) < 3 or not (np.ptp(x[both]) and np.ptp(y[both])):
        return Estimate()
    r = float(np.corrcoef(x[both], y[both])[0, 1])
    counted = min(packings, int(np.count_nonzero(both))) - 3
    if counted < 1:
        return Estimate(r, -1.0, 1.0)
    half = norm.ppf((1 + LEVEL) / 2) / np.sqrt(counted)
    score = np.arctanh(np.clip(r, -ONE, ONE))
    return Estimate(r, float(np.tanh(score - half)), float(np.tanh(score + half)))


def find_likeness(x: Floats) -> Estimate:
    """Correlation of each with the next (n,); of beds that are alike fewer count (Bartlett)."""
    r = find_correlation(x[1:], x[:-1], len(x)).value
    return find_correlation(x[1:], x[:-1], int(len(x) * (1 - r**2))) if isfinite(r) else Estimate()


def find_memory(persistence: float, late: float, early: float) -> float:
    """L [m] of scatter with correlation e^(-|ds|/L), whose means over two adjacent windows of mean
    settlements ``late`` and ``early`` [m] have this correlation; 0 where it is none."""

    def miss(logarithm: float) -> float:
        one, other = late / np.exp(logarithm), early / np.exp(logarithm)
        common = np.expm1(-one) * np.expm1(-other)
        own = 4 * (one + np.expm1(-one)) * (other + np.expm1(-other))
        return float(common / np.sqrt(own) - persistence)

    if not persistence > 0:
        return 0.0 if persistence <= 0 else np.nan
    longest = np.log(1e3 * (late + early))  # of the windows: correlation 0.9993
    shortest = np.log(1e-3 * min(late, early))
    if miss(longest) < 0:
        return np.inf
    return 0.0 if miss(shortest) > 0 else float(np.exp(brentq(miss, shortest, longest)))


def share_kept(settlement: float, memory: float) -> float:
    """Standard deviation of a mean over a ``settlement`` [m] of scatter with this ``memory`` [m],
    for ever where it is not known, over that of the scatter [-]."""
    x = settlement / max(memory, SHORTEST_MEMORY)  # in this order nan stays
    return float(np.sqrt(2 * (x + np.expm1(-x))) / x) if x > SMALL else 1.0


def find_length(correlation: float) -> float:
    """l [m] of e^(-x/l) from the correlation of neighbours; 0 where it is none."""
    if not correlation > 0:
        return 0.0 if correlation <= 0 else np.nan
    return float(-Track().spacing / np.log(correlation)) if correlation < 1 else np.inf
