"""From block to block: axles roll by, beds settle, the level is taken."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from track_line.arrays import Bools, Floats
from track_line.beam import Passage, rest_wheels, roll_axle
from track_line.beds import renew_scores
from track_line.laws import BedLoad
from track_line.settling.blocks import find_block
from track_line.settling.level import measure_deviations, measure_spectrum
from track_line.settling.line import Line
from track_line.settling.unsprung import find_force
from trackbed.errors import NotConverged

DEEPEST = 1.0
"""Settlement at which a run ends with a sentence [m]: beds of ballast are not so thick."""
VOIDS = (0.1e-3, 1e-3)
"""Gaps under hanging sleepers that are counted [m]."""


@dataclass(frozen=True)
class State:
    """A line after some axles."""

    cycle: float  # axles so far
    settled: Floats  # how deep each bed lies, shape (b, n) [m]; where it began is in it
    hardened: Floats  # what the law has made a mean bed of this history settle, shape (b, n) [m]
    score: Floats  # of the settlement, standard normal, shape (b, n)
    bears: tuple[Bools, ...] = ()
    """Which sleepers bear while each kind of axle rolls by; where the next passage begins."""


@dataclass(frozen=True)
class Record:
    """What a recording car, and a look below the sleepers, find in b realisations."""

    cycle: float
    settlement: Floats  # mean of the beds, shape (b,) [m]
    deviation: Floats
    """Standard deviation of D1 under the first axle, each section, shape (b, sections) [m]."""
    voids: Floats  # share of sleepers that hang by more than each of `VOIDS`, shape (2, b) [-]
    deepest: Floats  # greatest gap, shape (b,) [m]
    spectrum: Floats
    """Root mean square of the level under the first axle in each of `level.BANDS`, (bands,) [m]."""
    hanging: Floats
    """Share of realisations in which each sleeper hangs by more than the first of `VOIDS`, (n,)."""


def start_line(line: Line) -> State:
    """Before the first axle."""
    level = line.beds.level
    return State(0.0, level.copy(), np.zeros_like(level), line.beds.score)


def march_line(
    line: Line, state: State, end: float, *, finer: float = 1.0
) -> Iterator[tuple[State, Record]]:
    """States and records before each block, and at the ``end`` [axles].

    ``finer``: by which blocks are smaller than stability asks.  Raises `NotConverged`.
    """
    while True:
        bears = state.bears or (None,) * len(line.axles)
        passages = [
            roll_axle(line.rail, line.support, state.settled, axle.wheel, one)
            for axle, one in zip(line.axles, bears, strict=True)
        ]
        state = replace(state, bears=tuple(one.bears for one in passages))
        yield state, _take_record(line, state, passages[0])
        if state.cycle >= end:
            return
        ways = zip(line.axles, passages, strict=True)
        force = np.stack([find_force(line, state.settled, *one) for one in ways])
        state = _settle_block(line, state, force, end, finer)


def _settle_block(line: Line, state: State, force: Floats, end: float, finer: float) -> State:
    """The state behind the next block; ``force`` (kinds, b, n) [N]."""
    factor = line.beds.find_factors(state.score)
    cycles = find_block(line, force, state.hardened, factor, state.cycle, end, finer)
    load = BedLoad(force, line.support.bed)
    grown = line.law.advance_mixed(load, line.shares, state.hardened, state.cycle, cycles)
    hardened = state.hardened + grown
    span = state.hardened.mean(axis=1), hardened.mean(axis=1)
    score, factor = renew_scores(line.beds, state.score, *span)
    cycle = end if cycles == end - state.cycle else state.cycle + cycles  # not by round-off
    settled = state.settled + factor * grown
    if not float(abs(settled).max()) < DEEPEST:
        raise NotConverged(
            f"by {cycle:.3g} axles a bed has settled by {abs(settled).max():.3g} m, which no line "
            "does", where="the law of settlement",
            remedy="correct its parameters, the axles or the scatter",
        )  # fmt: skip
    return State(cycle, settled, hardened, score, state.bears)


def _take_record(line: Line, state: State, passage: Passage) -> Record:
    """What is seen of a state under a passing axle, and at rest."""
    rest = rest_wheels(line.rail, line.support, state.settled, np.zeros(len(line.beds.place)))
    gap, settled = (a[:, line.inside] for a in (rest.gap, state.settled - line.beds.level))
    voids = np.array([(gap > least).mean(axis=1) for least in VOIDS])
    seen = passage.level, line.track.spacing
    return Record(
        state.cycle, settled.mean(axis=1), measure_deviations(*seen), voids, gap.max(axis=1),
        measure_spectrum(*seen), (gap > VOIDS[0]).mean(axis=0),
    )  # fmt: skip
