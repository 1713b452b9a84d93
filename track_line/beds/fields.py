"""Random beds: lognormal, alike within a length along the line, and zones with a quality of their
own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from track_line.arrays import Floats
from track_line.beds.state import Beds, spread_around_one

STEPS_A_MEMORY = 8
"""Renewals of the scatter in the settlement that it takes to be forgotten by a factor e."""
STIFFNESS, SETTLEMENT, LEVEL, RENEWAL = range(4)
"""Streams of random numbers of a scene's seed."""


@dataclass(frozen=True)
class Scatter:
    """How beds differ.  Published numbers of lines are few: vary these."""

    stiffness: float = 0.2
    """Coefficient of variation of the stiffness [-]."""
    settlement: float = 0.2
    """Coefficient of variation of the settlement under equal load [-]."""
    length: float = 0.0
    """Over which beds are alike: their correlation is e^(-x/length) [m]; 0 where each is drawn by
    itself."""
    together: float = 0.0
    """Correlation of settlement with stiffness, of their logarithms [-]; below 0 where soft beds
    settle more under equal load."""
    memory: float | None = None
    """Mean settlement after which the scatter of settlement is forgotten by e [m]; None where it
    stays for ever."""
    unevenness: float = 0.0
    """Standard deviation of the level of the beds behind tamping [m]."""


@dataclass(frozen=True)
class Zone:
    """A part of the line, such as the end of a bridge."""

    begin: float
    """[m]"""
    end: float
    """[m]"""
    stiffness: float = 1.0
    """By which the beds' stiffness is multiplied [-]."""
    settlement: float = 1.0
    """By which their settlement is multiplied [-]."""
    void: float = 0.0
    """How much deeper they lie at first [m]."""

    def covers(self, place: Floats) -> Floats:
        """1 for each of the places (n,) [m] inside, both ends counted, else 0."""
        return ((place >= self.begin) & (place <= self.end)).astype(float)


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


def draw_scores(scatter: Scatter, seed: int, shape: tuple[int, int], spacing: float) -> Floats:
    """Standard normal scores of the settlement, (b, n), before the first axle."""
    alike = draw_normal((seed, STIFFNESS), shape, spacing, scatter.length)
    own = draw_normal((seed, SETTLEMENT), shape, spacing, scatter.length)
    return np.asarray(scatter.together * alike + np.sqrt(1 - scatter.together**2) * own)


def renew_scores(
    score: Floats, scatter: Scatter, seed: int, spacing: float, before: float, after: float
) -> Floats:
    """Scores (b, n) as the mean settlement goes from ``before`` to ``after`` [m].

    They are renewed at equal steps of settlement, whatever the blocks of axles are, so that
    smaller blocks are of the same line.
    """
    if scatter.memory is None:
        return score
    step = scatter.memory / STEPS_A_MEMORY
    kept = np.exp(-1 / STEPS_A_MEMORY)
    for number in range(int(before / step) + 1, int(after / step) + 1):
        seeds = (seed, RENEWAL, number)
        fresh = draw_normal(seeds, score.shape, spacing, scatter.length)
        score = kept * score + np.sqrt(1 - kept**2) * fresh
    return score


def draw_beds(
    place: Floats, stiffness: float, scatter: Scatter, zones: tuple[Zone, ...], lines: int,
    seed: int,
) -> Beds:  # fmt: skip
    """Beds at ``place`` (n,) [m], evenly spaced, of a mean ``stiffness`` [N/m]."""
    shape, spacing = (lines, len(place)), float(place[1] - place[0])
    alike = draw_normal((seed, STIFFNESS), shape, spacing, scatter.length)
    level = scatter.unevenness * draw_normal((seed, LEVEL), shape, spacing, scatter.length)
    bed = stiffness * spread_around_one(alike, scatter.stiffness)
    scale = np.ones(len(place))
    for zone in zones:
        inside = zone.covers(place)
        bed *= 1 + (zone.stiffness - 1) * inside
        scale *= 1 + (zone.settlement - 1) * inside
        level += zone.void * inside
    return Beds(place, bed, draw_scores(scatter, seed, shape, spacing), scale, level)
