"""What scenes for ballast name: a grading of the grains, stages of the load."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from adapters.bed import GradedRadii
from adapters.errors import SceneError
from trackbed.scene_files import GRADINGS, Grading, NonNegative, Positive, Table, suggest_word

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


class Stage(Table):
    """A sine of another level or frequency that goes on where the load before it ends."""

    from_cycle: Annotated[int, Field(ge=1)]  # cycles done when it begins
    amplitude: Positive  # stress from trough to peak [Pa]
    mean: NonNegative  # mean stress [Pa]
    frequency: Positive  # cycles a second [Hz]


def make_radii(key: str | Sieves, scale: float | None) -> GradedRadii:
    """Radii of a grading whose sieves are ``scale`` times as wide."""
    return GradedRadii(make_grading(key).scale(scale or 1.0))
