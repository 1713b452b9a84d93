"""Series that laws are judged on: real ballast, families of the literature, full runs of an engine.

A case is what is known up to about a cycle N_c and the value at ``REACH`` times the last known
cycle.  Real ballast is read from the folder that TRACKBED_DATA names: 12 cyclic triaxial tests on
ballast (Sun, Indraratna and Nimbalkar 2016, digitised in erolsson/railway_ballast), of which
`adapters.laws.fit.prior` was learned; the families have a seed that no choice was made on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from adapters.bed.state import FloatArray

REACH = 10.0
"""Predicted over last known cycle."""
CUTS = (300.0, 1e3, 3e3, 1e4)
"""N_c of the families."""
FIRST_CUT, BEGINS, EACH = 40.0, (0.0, 20.0, 100.0), (1, 3)
"""Real ballast is cut at every reading from the first one on, and known from each of the second
ones on, by all readings or each third."""
LAST = 5e5
"""Cycles of a made series, as of the real ones."""
READING = 0.002
"""Standard deviation of a reading, and..."""
DIGIT = 1 / 300
"""...a digit, both of the range: a curve of 300 pixels, as published ones are."""
SEED = 2026
RUNS = ("paper_scale_a", "paper_scale_b", "coarse_bursty")
"""Full runs: two of 1,085 grains, one of 150."""

Curve = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class LawCase:
    """A series cut short and its truth."""

    name: str
    cut: float
    cycle: FloatArray
    settlement: FloatArray
    to_cycle: float
    truth: float


def read_ballast(folder: Path) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Name, cycles and axial strain of each triaxial test; repeated cycles once."""
    for path in sorted((folder / "ballast_triaxial").glob("*.txt")):
        table = np.loadtxt(path, delimiter=",")
        cycle, first = np.unique(table[:, 0], return_index=True)
        yield path.stem.removeprefix("axial_strain_"), cycle, table[first, 1]


def cut_cases(
    name: str, cycle: FloatArray, settlement: FloatArray, cuts: tuple[float, ...]
) -> Iterator[LawCase]:
    """Cases of one series: five readings or more, the last after N_c / 2; truth by ln N."""
    for cut in cuts:
        known = cycle <= cut * (1 + 1e-9)
        if known.sum() < 5 or cycle[known][-1] < cut / 2:
            continue
        to_cycle = REACH * float(cycle[known][-1])
        if to_cycle <= cycle[-1] * (1 + 1e-9):
            truth = float(np.interp(np.log(to_cycle), np.log(cycle), settlement))
            yield LawCase(name, cut, cycle[known], settlement[known], to_cycle, truth)


def list_ballast_cases(folder: Path) -> list[LawCase]:
    """Cuts of all kinds of the triaxial tests, of four readings or more; truth by ln N."""
    found = []
    for name, cycle, strain in read_ballast(folder):
        for end, begin, each in product(range(len(cycle)), BEGINS, EACH):
            rows = np.arange(end, -1, -each)[::-1]
            rows = rows[cycle[rows] >= begin]
            cut, to_cycle = float(cycle[end]), REACH * float(cycle[end])
            if cut >= FIRST_CUT and len(rows) >= 4 and to_cycle <= cycle[-1] * (1 + 1e-9):
                truth = float(np.interp(np.log(to_cycle), np.log(cycle), strain))
                known = (cycle[rows], strain[rows], to_cycle, truth)
                found.append(LawCase(name, cut, *known))
    return found


def list_run_cases(folder: Path) -> list[LawCase]:
    """Mean settlement of full runs at every cycle: 1,085 grains (two), 150 grains in bursts."""
    found = []
    for name in RUNS:
        with np.load(folder / "full_runs" / f"{name}.npz") as data:
            settlement = -1e-6 * data["displacement_um"][1:, :, 2].mean(axis=1, dtype=float)
        cycle = np.arange(1.0, len(settlement) + 1)
        found += list(cut_cases(name, cycle, settlement, (10.0, 20.0, 30.0, 50.0, 100.0)))
    return found


def draw_slow_families(random: np.random.Generator) -> dict[str, Curve]:
    """One member of each family whose rate falls for good, its parameters drawn at random.

    Of the bank's own laws and of others: sums of two and three logarithms, of two stretched
    exponentials, Thom and Oakley's squared logarithm, Varandas' sum of n^-b, creep with bursts,
    and a logarithm with one event after which the bed is another.
    """

    def draw(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    even = random.uniform
    onset = [draw(1, 10), draw(30, 3000), draw(10, 1e4)]
    weight = [even(0.3, 3), even(0.3, 3)]
    scale = [draw(3, 100), draw(300, 3e4), draw(10, 1e4), draw(30, 3000)]
    shape = [even(0.3, 1), even(0.3, 1), even(0.2, 0.9), even(0.08, 0.3), even(0.1, 2)]
    burst_cycle = np.exp(random.uniform(0, np.log(LAST), random.poisson(40)))
    burst_size = 0.12 * random.pareto(2.0, len(burst_cycle))
    middle, width, height = draw(80, 1500), even(0.25, 0.7), even(2, 10)
    power_sum = even(0.78, 0.9)
    start, late = even(0.2, 1), even(0.02, 0.4)
    return {
        "two logarithms": lambda n: np.log1p(n / onset[0]) + weight[0] * np.log1p(n / onset[1]),
        "three logarithms": lambda n: (
            np.log1p(n / onset[0])
            + weight[0] * np.log1p(n / onset[1])
            + weight[1] * np.log1p(n / onset[2])
        ),
        "stretched exponential": lambda n: start - 3 * np.expm1(-((n / scale[2]) ** shape[2])),
        "two stretched exponentials": lambda n: (
            -np.expm1(-((n / scale[0]) ** shape[0]))
            - weight[0] * np.expm1(-((n / scale[1]) ** shape[1]))
        ),
        "squared logarithm": lambda n: start + np.maximum(np.log10(n) + late, 0) ** 2 / 10,
        "power": lambda n: start + n ** shape[3],
        "sum of n^-b": lambda n: (n ** (1 - power_sum) - 1) / (1 - power_sum) + 1,
        "bursts": lambda n: (
            0.6 * np.log1p(n / onset[0])
            + np.array([burst_size[burst_cycle <= one].sum() for one in n])
        ),
        "event": lambda n: (
            start * np.log1p(n) + height / (1 + (middle / n) ** (1 / width)) + late * np.log1p(n)
        ),
        "inverse log": lambda n: 1 - 1 / (1 + shape[4] * np.log1p(n / onset[0])),
        "hyperbolic": lambda n: start + n / (scale[3] + n),
        "logarithm and slow rate": lambda n: np.log1p(n / onset[0]) + 3e-7 * late * n,
    }


def draw_fast_families(random: np.random.Generator) -> dict[str, Curve]:
    """Families that must be refused: a constant rate, reached or being reached, and growth."""
    rate, exponent = random.uniform(0.5, 2), random.uniform(1.2, 2)
    return {
        "constant rate": lambda n: 0.1 + rate * n,
        "logarithm under a constant rate": lambda n: np.log1p(n) + 0.1 * rate * n,
        "exponential over a constant rate": lambda n: 10 - 10 * np.exp(-n / 10) + rate * n,
        "growing power": lambda n: n**exponent,
        "growing exponential": lambda n: np.expm1(rate * n / 150),
    }


def read_off(curve: Curve, last: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Cycles and readings: about seven a decade, with `READING` and `DIGIT` errors."""
    gap = rng.uniform(0.15, 0.5, 100).cumsum()
    cycle = np.exp(np.append(0.0, gap))
    cycle = cycle[cycle <= last]
    exact = np.asarray(curve(cycle), float)
    size = float(np.ptp(exact))
    read = exact + READING * size * rng.standard_normal(len(cycle))
    return cycle, np.round(read / (DIGIT * size)) * DIGIT * size


def list_family_cases(members: int) -> list[LawCase]:
    """Cases of ``members`` of each slow family; the truth is the curve's own value."""
    found = []
    for member in range(members):
        random = np.random.default_rng([SEED, member])
        for name, curve in draw_slow_families(random).items():
            cycle, read = read_off(curve, LAST, random)
            for case in cut_cases(name, cycle, read, CUTS):
                truth = float(np.asarray(curve(np.array([case.to_cycle])))[0])
                known = (case.cycle, case.settlement, case.to_cycle, truth)
                found.append(LawCase(name, case.cut, *known))
    return found


def list_fast_cases(members: int) -> list[LawCase]:
    """Series of ``members`` of each fast family, 300 cycles long; there is no truth to predict."""
    found = []
    for member in range(members):
        random = np.random.default_rng([SEED, 1, member])
        for name, curve in draw_fast_families(random).items():
            cycle, read = read_off(curve, 300.0, random)
            found.append(LawCase(name, 300.0, cycle, read, 10 * float(cycle[-1]), np.nan))
    return found
