"""What scenes for ballast name: a grading of the grains, a saved bed, stages of the load."""

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from adapters.bed import (
    OVERLAP_BOUND,
    Container,
    FloatArray,
    GradedRadii,
    RadiusDistribution,
    State,
    find_pairs,
)
from adapters.errors import SceneError
from adapters.files import read_state_file
from trackbed.scene_files import NonNegative, Positive, Sieves, Table, make_grading


class Stage(Table):
    """A sine of another level or frequency that goes on where the load before it ends."""

    from_cycle: Annotated[int, Field(ge=1)]  # cycles done when it begins
    amplitude: Positive  # stress from trough to peak [Pa]
    mean: NonNegative  # mean stress [Pa]
    frequency: Positive  # cycles a second [Hz]


def make_radii(key: str | Sieves, scale: float | None) -> GradedRadii:
    """Radii of a grading whose sieves are ``scale`` times as wide."""
    return GradedRadii(make_grading(key).scale(scale or 1.0))


@dataclass(frozen=True)
class StoredRadii(RadiusDistribution):
    """Radii of the grains of a saved bed, from which none is drawn."""

    radius: FloatArray = field(kw_only=True)  # of each grain [m], shape (n,)

    @property
    def smallest(self) -> float:
        """The least radius [m]."""
        return float(self.radius.min())

    @property
    def greatest(self) -> float:
        """The greatest radius [m]."""
        return float(self.radius.max())

    @property
    def volume_mean(self) -> float:
        """Mean volume of a grain [m^3]."""
        return float(4 / 3 * np.pi * np.mean(self.radius**3))


def find_stored_radii(path: str) -> StoredRadii:
    """Those of the bed of `read_stored_bed`; raises as that does."""
    radius = read_stored_bed(path).radius
    return StoredRadii("saved", float(radius.mean()), radius=radius)


def read_stored_bed(path: str) -> State:
    """The bed of `adapters.files.read_state_file`, which is read again only when it has changed.

    Masses are left to the scene's density.  Raises `UsageError`, `DumpError`, `OSError`.
    """
    return _read_version(path, Path(path).stat().st_mtime_ns)


@lru_cache(maxsize=2)
def _read_version(path: str, changed_ns: int) -> State:
    return read_state_file(Path(path), density=1.0)


def place_stored_bed(bed: State, container: Container) -> tuple[FloatArray, FloatArray, float]:
    """Centres (n, 3) and radii (n,) of a saved bed, and twice the height of its top [m].

    Raises `SceneError` where grains overlap, or reach through a wall or the floor of the
    ``container``, by more than `OVERLAP_BOUND` of the smaller radius.
    """
    rows = find_pairs(bed.position, bed.radius, container.walls())
    partner = np.where(rows.second < 0, rows.first, rows.second)
    share = rows.overlap / np.minimum(bed.radius[rows.first], bed.radius[partner])
    if (deep := share > OVERLAP_BOUND).any():
        row = int(np.argmax(share))
        first, second = rows.first[row], rows.second[row]
        other = f"grain {bed.identifier[second]}" if second >= 0 else "the scene's walls or floor"
        raise SceneError(
            f"{deep.sum()} contacts of {len(bed.radius)} grains are deeper than {OVERLAP_BOUND:g} "
            f"of the smaller radius, the worst, of grain {bed.identifier[first]} with {other}, by "
            f"{share[row]:.3g}", where="sample.state",
            remedy="give the container of the saved bed: in metres, its floor at z = 0",
        )  # fmt: skip
    return bed.position, bed.radius, 2 * float((bed.position[:, 2] + bed.radius).max())
