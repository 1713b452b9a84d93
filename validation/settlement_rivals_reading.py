"""What the record of the rivals says: errors, what chaos alone makes of them, paired tests."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from adapters.laws import law_named
from adapters.state import FloatArray
from validation.settlement_ensemble_reading import nested, student
from validation.settlement_rivals import FEWER, GRAINS, Row
from validation.settlement_rivals_budget import AFTER, EVERY, JUMPED
from validation.student import interval

HALF = 10
"""Cycle ends over which the settlement of the budget is averaged, the last of `AFTER`."""


def lengths(row: Row) -> float:
    """By what lengths along the load are multiplied: a bed of half the grains is half as high."""
    return GRAINS / 75 if row["method"] == FEWER.name else 1.0


@dataclass(frozen=True)
class Figure:
    """A figure of a row at the cycle of comparison."""

    words: str
    value: Callable[[Row], float]


FIGURES = {
    "settlement": Figure(
        "settlement", lambda row: row["settlement"][str(row["last"])] * lengths(row)
    ),
    "coordination": Figure(
        "coordination number", lambda row: float(row["state"]["coordination_number"])
    ),
    "deflection": Figure(
        "elastic deflection", lambda row: row["state"]["elastic_deflection"] * lengths(row)
    ),
    "stiffness": Figure(
        "piston stiffness", lambda row: row["state"]["piston_stiffness"] / lengths(row)
    ),
}


@dataclass(frozen=True)
class Judged:
    """Errors of a method over the packings that it finished."""

    seeds: tuple[int, ...]
    error: FloatArray
    """Method less reference, one a packing, over the reference's mean of all packings."""

    @property
    def mean(self) -> float:
        """Mean over the packings."""
        return float(self.error.mean())

    @property
    def half(self) -> float:
        """Half of Student's 95 % interval of the mean; nan for one packing."""
        return interval(self.error)[1] if len(self.error) > 1 else float("nan")


def rows_of(rows: Sequence[Row], part: str, method: str, last: int | None = None) -> list[Row]:
    """Rows of a method, at cycle ``last`` where that is told."""
    return [
        row
        for row in rows
        if row["part"] == part and row["method"] == method and last in (None, row["last"])
    ]


def finished(rows: Sequence[Row], method: str, last: int) -> list[Row]:
    """Rows of a method that came to ``last``, of rivals, of laws and of the study of healing."""
    found = [
        row for part in ("rivals", "law", "healing") for row in rows_of(rows, part, method, last)
    ]
    return [row for row in found if str(last) in row.get("settlement", {})]


def means_by_seed(rows: Sequence[Row], figure: Figure) -> dict[int, float]:
    """Mean over the members of each packing."""
    seeds = sorted({row["seed"] for row in rows})
    return {
        seed: float(np.mean([figure.value(row) for row in rows if row["seed"] == seed]))
        for seed in seeds
    }


def reference(rows: Sequence[Row], last: int) -> list[Row]:
    """Members of the ensemble that reached ``last``."""
    return rows_of(rows, "reference", EVERY, last)


def judged(rows: Sequence[Row], method: str, last: int, key: str) -> Judged | None:
    """Errors of a method in a figure; None where it finished on no packing."""
    mine, figure = finished(rows, method, last), FIGURES[key]
    if not mine or (key != "settlement" and "state" not in mine[0]):
        return None
    truth, found = means_by_seed(reference(rows, last), figure), means_by_seed(mine, figure)
    scale = float(np.mean(list(truth.values())))
    error = np.array([found[seed] - truth[seed] for seed in found]) / scale
    return Judged(tuple(found), error)


def chaos(rows: Sequence[Row], last: int, key: str) -> float:
    """Half of the 95 % interval of the mean error that one full run a packing would have.

    With s the scatter within packings of n_p members, over P packings and the reference's mean:
    t s sqrt(mean(1 + 1/n_p) / P).
    """
    figure, runs = FIGURES[key], reference(rows, last)
    seeds = sorted({row["seed"] for row in runs})
    values = {
        seed: np.array([figure.value(row) for row in runs if row["seed"] == seed]) for seed in seeds
    }
    found = nested(values)
    members = np.array([len(each) for each in values.values()])
    spread = found.within * np.sqrt(np.mean(1 + 1 / members) / found.packings)
    return float(student(found.members - found.packings) * spread / found.mean)


def profile_error(rows: Sequence[Row], method: str, last: int) -> FloatArray:
    """Of each packing: rms over the layers of the relative density's error over its mean."""
    truth = {seed: layers(reference(rows, last), seed) for seed in seeds_of(rows, last)}
    mine = [row for row in finished(rows, method, last) if "profile" in row]
    return np.array(
        [rms(np.array(row["profile"]) - truth[row["seed"]]) / truth[row["seed"]].mean()
         for row in mine]
    )  # fmt: skip


def profile_chaos(rows: Sequence[Row], last: int) -> float:
    """The same that one full run a packing would have against the mean of two, mean of the packings
    that have two.

    A member less another has the variance 2 s^2; less the mean of two others 3/2 s^2.
    """
    found = []
    for seed in seeds_of(rows, last):
        runs = [np.array(r["profile"]) for r in reference(rows, last) if r["seed"] == seed]
        if len(runs) == 2:
            one, other = runs
            found.append(np.sqrt(3 / 4) * rms(one - other) / (one + other).mean() * 2)
    return float(np.mean(found))


def seeds_of(rows: Sequence[Row], last: int) -> list[int]:
    """Packings of the reference."""
    return sorted({row["seed"] for row in reference(rows, last)})


def layers(rows: Sequence[Row], seed: int) -> FloatArray:
    """Mean relative density of each layer over the members of a packing."""
    return np.mean([row["profile"] for row in rows if row["seed"] == seed], axis=0)


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def mean_over_packings(rows: Sequence[Row], name: str) -> float:
    """A figure of runs, each packing counting once however many runs it has."""
    found: dict[int, list[float]] = {}
    for row in rows:
        found.setdefault(row["seed"], []).append(row[name])
    return float(np.mean([np.mean(values) for values in found.values()]))


def cost(rows: Sequence[Row]) -> float:
    """CPU time behind k_i [s], mean over packings."""
    return mean_over_packings(rows, "cpu_s")


def cheaper_even(rows: Sequence[Row], truth: Sequence[Row]) -> float:
    """Cost of the reference over that of ``rows``, had a time step cost the same in both [-].

    The machine differs between sessions, and a run beside two others is slower: so every step of
    ``truth`` is taken at what the engine spent on one in ``rows``, its starts apart (they are part
    of ``engine``).  Starts, relaxations and failed tries count on their side alone.  A law's cycles
    are some of the reference's.
    """
    cycle = truth[0]["steps_per_cycle"]
    full = mean_over_packings(truth, "computed") * cycle
    steps = [row["computed"] * row.get("steps_per_cycle", cycle) for row in rows]
    spent = sum(row["cost"]["engine"] - row["cost"].get("start_up", 0.0) for row in rows)
    a_step = spent / sum(steps)
    return full * a_step / cost(rows)


# --- the null hypothesis ---------------------------------------------------------------------


@dataclass(frozen=True)
class Beside:
    """Moving beside not moving, a value for each packing that both finished, over the reference's
    mean of all packings."""

    moved: FloatArray
    """Error of the settlement."""
    still: FloatArray

    @property
    def difference(self) -> FloatArray:
        """What moving adds to the settlement."""
        return self.moved - self.still

    @property
    def nearer(self) -> FloatArray:
        """By how much moving is nearer to the reference: difference of the errors' sizes."""
        return np.abs(self.still) - np.abs(self.moved)


def beside(rows: Sequence[Row], jumps: int, last: int) -> Beside | None:
    """The same number of jumps, moved and not; None where no packing has both."""
    names = f"{jumps} jumps", f"{jumps} jumps, nothing moved"
    found = [judged(rows, name, last, "settlement") for name in names]
    one, other = (
        {} if each is None else dict(zip(each.seeds, each.error, strict=True)) for each in found
    )
    both = sorted(one.keys() & other.keys())
    if not both:
        return None
    return Beside(np.array([one[s] for s in both]), np.array([other[s] for s in both]))


# --- the budget ------------------------------------------------------------------------------


def settled(row: Row) -> float:
    """Settlement [m] from the end of the window to the last cycles behind, means of `HALF` both."""
    return float(np.mean(row["settlement"][-HALF:]) - np.mean(row["window"][-HALF:]))


def of_place(rows: Sequence[Row], part: str) -> dict[tuple[int, int], Row]:
    """Rows of a part by packing and member, without those that have nothing behind the place."""
    found = [row for row in rows_of(rows, "budget", part) if "settlement" in row]
    return {(row["seed"], row["member"]): row for row in found}


def effect(
    rows: Sequence[Row], part: str, value: Callable[[Row], float], beside: str = EVERY
) -> FloatArray:
    """A part less the run of every cycle, or less another part, mean over the members of each
    packing."""
    every, mine = of_place(rows, beside), of_place(rows, part)
    found = []
    for place in sorted(every.keys() & mine.keys()):
        base = every[place]
        same = over_same(base, mine[place]["cycles"][1] - base["cycles"][0])
        found.append((place[0], value(mine[place]) - value(same)))
    return mean_by_packing(found)


def mean_by_packing(values: Iterable[tuple[int, float]]) -> FloatArray:
    """Mean of the values of each packing, by its seed, in the order in which packings come."""
    found: dict[int, list[float]] = {}
    for seed, value in values:
        found.setdefault(seed, []).append(value)
    return np.array([np.mean(each) for each in found.values()])


def between_packings(rows: Sequence[Row], value: Callable[[Row], float]) -> FloatArray:
    """Differences of all pairs of packings, (P (P - 1) / 2,), in the `AFTER` cycles behind the same
    place of the run of every cycle; of each packing the mean over its members."""
    places = of_place(rows, EVERY)
    means = mean_by_packing(
        (seed, value(over_same(places[seed, member], AFTER))) for seed, member in sorted(places)
    )
    first, second = np.triu_indices(len(means), 1)
    return means[first] - means[second]


def over_same(row: Row, cycles: int) -> Row:
    """A row of the budget whose settlement ends after so many cycles."""
    return row | {"settlement": row["settlement"][:cycles]}


def law_alone(rows: Sequence[Row], law: str = "log") -> FloatArray:
    """Settlement over `JUMPED` cycles by a law fitted to the window's, less what came [m].

    Both between means of `HALF` cycles, of each packing the mean over its members.
    """
    chosen = law_named(law)
    found = []
    for (seed, _), row in of_place(rows, EVERY).items():
        path, start = np.array(row["window"]), row["cycles"][0]
        cycle = np.arange(start - len(path) + 1.0, start + 1)
        parameters = chosen.fit(cycle, path)
        before, after = (
            float(np.mean(chosen.value(parameters, cycle[-HALF:] + ahead))) for ahead in (0, JUMPED)
        )
        found.append((seed, after - before - settled(over_same(row, JUMPED))))
    return mean_by_packing(found)
