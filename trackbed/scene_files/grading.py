"""Grading curves: which share of the mass passes which sieve, by a standard's name or a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from trackbed.errors import SceneError
from trackbed.scene_files.reader import suggest_word

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grading:
    """Mass share that passes each sieve; between two sieves even in the logarithm of size.

    Raises `SceneError` for sieves that do not grow, or shares that do not grow from 0 to 1.
    """

    sieves: Floats  # sides of the square holes [m], (k,), growing
    passing: Floats  # share of the mass that passes [-], (k,), from 0 to 1
    limits: tuple[Floats, Floats] | None = None
    """Least and greatest share that a standard lets pass each sieve [-], (k,) each."""

    def __post_init__(self) -> None:
        for name in ("sieves", "passing"):
            object.__setattr__(self, name, np.array(getattr(self, name), float))
        d, p = self.sieves, self.passing
        sound = d.ndim == 1 and d.shape == p.shape and len(d) >= 2
        sound = sound and bool(np.isfinite(d).all() and d[0] > 0 and (np.diff(d) > 0).all())
        if not (sound and p[0] == 0 and p[-1] == 1 and (np.diff(p) >= 0).all()):
            raise SceneError(
                f"sieves {d.tolist()} with passing {p.tolist()} are no grading curve",
                where="grading",
                remedy="give growing sieves in metres and as many shares, growing from 0 to 1",
            )

    def scale(self, factor: float) -> Grading:
        """The same curve of grains ``factor`` [-] times as large."""
        return replace(self, sieves=factor * self.sieves)

    @property
    def bounds(self) -> tuple[float, float]:
        """Sizes of the smallest and of the greatest grain [m]."""
        first, last = np.count_nonzero(self.passing == 0) - 1, np.argmax(self.passing == 1)
        return float(self.sieves[first]), float(self.sieves[last])

    def mean_power(self, power: int) -> float:
        """Mean of D^power [m^power] over the grains, each counted once.

        Even in ln D by mass is D^-4 dD by number, as the mass of a grain goes with D^3.
        """
        low, high = self.sieves[:-1], self.sieves[1:]
        mass = np.diff(self.passing) / np.log(high / low)

        def integrate(p: int) -> float:
            ends = [np.log(d) if p == 3 else d ** (p - 3.0) / (p - 3) for d in (low, high)]
            return float(mass @ (ends[1] - ends[0]))

        return integrate(power) / integrate(0)


def make_named_grading(sieves_mm: list[float], least: list[float], most: list[float]) -> Grading:
    """Midway between the limits [%] of sieves [mm], without grains that may be there but need not:
    the curve begins at the coarsest sieve that may retain all."""
    low, high = np.array(least) / 100, np.array(most) / 100
    passing = np.where(low > 0, (low + high) / 2, 0.0)
    return Grading(np.array(sieves_mm) / 1e3, passing, (low, high))


GRADINGS = {
    "EN 13450 31.5/50": make_named_grading(
        [22.4, 31.5, 40, 50, 63], [0, 1, 30, 70, 100], [3, 25, 65, 99, 100]
    ),
    "AREMA 4": make_named_grading(
        [9.525, 19.05, 25.4, 38.1, 50.8], [0, 0, 20, 90, 100], [5, 15, 55, 100, 100]
    ),
}
"""EN 13450:2013, Table 1, category A (71.5 % from 31.5 to 50 mm), and AREMA Manual for Railway
Engineering, chapter 1, part 2, gradation No. 4 (1 1/2 to 3/4 inch).  Not compared with printed
copies of the standards."""


def draw_sizes(grading: Grading, count: int, generator: np.random.Generator) -> Floats:
    """Sieve sizes [m], (count,), of grains of like shape whose masses follow the curve.

    One size is drawn from each of ``count`` slices of equal number (`Grading.mean_power`), then
    they are shuffled: the curve is met as well as that many grains can.
    """
    low, high = grading.sieves[:-1], grading.sieves[1:]
    mass = np.diff(grading.passing) / np.log(high / low)
    number = np.concatenate([[0.0], np.cumsum(mass * (low**-3.0 - high**-3.0) / 3)])
    share = (np.arange(count) + generator.random(count)) / count * number[-1]
    at = np.clip(np.searchsorted(number, share, side="right") - 1, 0, len(low) - 1)
    rest = share - number[at]
    # mass, not number, is what an empty interval lacks: it is never drawn from
    inverse = low[at] ** -3.0 - 3 * rest / np.where(mass[at] > 0, mass[at], 1.0)
    sizes = np.clip(inverse ** (-1 / 3), low[at], high[at])
    return np.asarray(generator.permutation(sizes))


def measure_passing(sizes: Floats, sieves: Floats) -> Floats:
    """Mass share [-], (k,), of grains of sizes [m], (n,), that passes ``sieves`` [m], (k,)."""
    mass = sizes**3
    return np.array([mass[sizes <= sieve].sum() for sieve in sieves]) / mass.sum()


def refuse_outside_limits(grading: Grading, sizes: Floats) -> None:
    """Raise `SceneError` where sizes [m], (n,), leave a standard's limits: there are too few."""
    if grading.limits is None:
        return
    passing = measure_passing(sizes, grading.sieves)
    outside = (passing < grading.limits[0] - 1e-12) | (passing > grading.limits[1] + 1e-12)
    if outside.any():
        at = int(np.argmax(outside))
        least, most = (100 * limit[at] for limit in grading.limits)
        raise SceneError(
            f"of {len(sizes)} grains drawn {100 * passing[at]:.3g} % by mass pass "
            f"{1e3 * grading.sieves[at]:g} mm; the standard's limits are {least:g} to {most:g} %",
            where="sample.grading",
            remedy="give more grains, another seed, or a table of sieves of your own",
        )


Sieves = tuple[tuple[float, float], ...]
"""Side of each sieve's hole [mm], and mass that passes it [%]."""


def make_grading(key: str | Sieves) -> Grading:
    """The curve of a standard's name or of a table; raises ValueError for neither, SceneError."""
    if isinstance(key, str):
        if key not in GRADINGS:
            raise ValueError(f"unknown grading {key!r}{suggest_word(key, GRADINGS)}")
        return GRADINGS[key]
    sieves, percent = np.array(key, float).reshape(-1, 2).T
    if sieves.max(initial=0.0) < 0.1:
        raise ValueError(f"sieves are given in mm, and the coarsest would be {sieves.max():g} mm")
    return Grading(sieves / 1e3, percent / 100)


def read_grading(key: Any) -> str | Sieves:
    """The key, tables as tuples; raises ValueError with a sentence where it is no grading."""
    try:
        if not isinstance(key, str):
            key = tuple((float(sieve), float(percent)) for sieve, percent in key)
        make_grading(key)
    except (TypeError, SceneError) as error:
        raise ValueError(
            "must be a standard's name or [[sieve in mm, passing in %], ...] with sieves that grow"
            f" and percentages that grow from 0 to 100, not {key!r:.60}"
        ) from error
    return key


GradingKey = Annotated[str | Sieves, BeforeValidator(read_grading)]
