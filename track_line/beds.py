"""Beds along a line: lognormal, alike within a length, and zones with a quality of their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.signal import lfilter

from track_line.arrays import Bools, Floats
from trackbed.scene_files import NonNegative, Real, Table

Variation = Annotated[Real, Field(ge=0, le=3)]
STEPS_A_MEMORY = 8
"""Renewals of the scatter in the settlement that it takes to be forgotten by a factor e."""
STIFFNESS, SETTLEMENT, LEVEL, RENEWAL = range(4)
"""Streams of random numbers of a scene's seed."""
SHORTEST_MEMORY = 1e-4
"""Shortest memory that a scene may ask for [m]: each renewal draws all beds."""

EDGE = 1e-6
"""From the end of a zone a sleeper still stands at it [m]: places are multiples of the spacing."""


class Scatter(Table):
    """How beds differ.  Published numbers of lines are few: vary these."""

    stiffness: Variation = 0.2  # coefficient of variation of the stiffness [-]
    settlement: Variation = 0.2  # coefficient of variation of the settlement under equal load [-]
    length: NonNegative = 0.0
    """Over which beds are alike: their correlation is e^(-x/length) [m]; 0 where each is drawn by
    itself."""
    together: Annotated[Real, Field(ge=-1, le=1)] = 0.0
    """Correlation of settlement with stiffness, of their logarithms [-]; below 0 where soft beds
    settle more under equal load."""
    memory: Annotated[Real, Field(ge=SHORTEST_MEMORY)] | None = None
    """Mean settlement after which the scatter of settlement is forgotten by e [m]; None where it
    stays for ever."""
    unevenness: NonNegative = 0.0  # standard deviation of the level of the beds behind tamping [m]


class Zone(Table):
    """A part of the line, such as the end of a bridge."""

    begin: Real  # along the line [m]
    end: Real  # [m]; a zone that reaches an end of the line goes on through its margin
    stiffness: Annotated[Real, Field(ge=1e-3, le=1e3)] = 1.0
    """By which the beds' stiffness is multiplied [-]."""
    settlement: NonNegative = 1.0  # by which their settlement is multiplied [-]
    void: Annotated[Real, Field(ge=0, le=0.1)] = 0.0  # how much deeper they lie at first [m]

    def find_inside(self, place: Floats) -> Bools:
        """Which of the beds at ``place`` (n,) [m] it has, those at its ends counted."""
        return np.asarray((place >= self.begin - EDGE) & (place <= self.end + EDGE))


@dataclass(frozen=True)
class Beds:
    """b lines of n beds, each of half a sleeper."""

    place: Floats  # along the line, shape (n,) [m]
    stiffness: Floats  # k_b, shape (b, n) [N/m]
    score: Floats  # standard normal, shape (b, n): how much more than the mean each bed settles
    scale: Floats  # of zones, shape (n,): by which every settlement is multiplied [-]
    level: Floats  # how deep each lies below the level of tamping, shape (b, n) [m]
    scatter: Scatter
    seed: int

    def find_factors(self, score: Floats) -> Floats:
        """Settlement over that of the mean bed, (b, n) [-]: lognormal, of mean 1 but in zones."""
        return spread_around_one(score, self.scatter.settlement) * self.scale


def spread_around_one(score: Floats, variation: float) -> Floats:
    """Lognormal numbers of mean 1 and coefficient of ``variation`` of standard normal ones [-]."""
    width = np.sqrt(np.log1p(variation**2))
    return np.asarray(np.exp(width * score - width**2 / 2))


def draw_normal(seed: tuple[int, ...], shape: tuple[int, int], spacing: float,
                length: float) -> Floats:  # fmt: skip
    """Standard normal numbers (b, n) with correlation e^(-x/length) along each line of seats
    ``spacing`` [m] apart; the first lines are the same for any b."""
    white = np.random.default_rng(seed).normal(size=shape)
    if length == 0:
        return white
    alike = np.exp(-spacing / length)
    white[:, 1:] *= np.sqrt(1 - alike**2)
    return np.asarray(lfilter([1.0], [1.0, -alike], white, axis=1))


def renew_scores(
    beds: Beds, score: Floats, before: Floats, after: Floats
) -> tuple[Floats, Floats]:  # fmt: skip
    """Scores behind a mean settlement of each line from ``before`` to ``after``, (b,) each [m], and
    the mean of `Beds.find_factors` on the way, (b, n) each.

    Scores are renewed at equal steps of settlement, whatever blocks and other lines are.
    """
    if beds.scatter.memory is None:
        return score, beds.find_factors(score)
    step, kept = beds.scatter.memory / STEPS_A_MEMORY, np.exp(-1 / STEPS_A_MEMORY)
    here, after = (np.broadcast_to(one, len(score))[:, None] for one in (before, after))
    total, grown, spacing = np.zeros_like(score), after - here, beds.place[1] - beds.place[0]
    for number in range(int(here.min() / step) + 1, int(after.max() / step) + 1):
        due = (here < number * step) & (number * step <= after)
        total += np.where(due, number * step - here, 0.0) * beds.find_factors(score)
        here = np.where(due, number * step, here)
        fresh = draw_normal((beds.seed, RENEWAL, number), score.shape, spacing, beds.scatter.length)
        score = np.where(due, kept * score + np.sqrt(1 - kept**2) * fresh, score)
    total += (after - here) * beds.find_factors(score)
    return score, np.where(grown > 0, total / np.where(grown > 0, grown, 1.0), 1.0)


def draw_beds(
    place: Floats, stiffness: float, scatter: Scatter, zones: Sequence[Zone], lines: int, seed: int
) -> Beds:
    """Beds at ``place`` (n,) [m], evenly spaced, of a mean ``stiffness`` [N/m]."""
    shape, spacing = (lines, len(place)), float(place[1] - place[0])
    alike = draw_normal((seed, STIFFNESS), shape, spacing, scatter.length)
    level = scatter.unevenness * draw_normal((seed, LEVEL), shape, spacing, scatter.length)
    own = draw_normal((seed, SETTLEMENT), shape, spacing, scatter.length)
    score = scatter.together * alike + np.sqrt(1 - scatter.together**2) * own
    bed = stiffness * spread_around_one(alike, scatter.stiffness)
    scale = np.ones(len(place))
    for zone in zones:
        inside = zone.find_inside(place).astype(float)
        bed *= 1 + (zone.stiffness - 1) * inside
        scale *= 1 + (zone.settlement - 1) * inside
        level += zone.void * inside
    return Beds(place, bed, score, scale, level, scatter, seed)
