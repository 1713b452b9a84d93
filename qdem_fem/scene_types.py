"""Types of the values in a scene file: their bounds, and which of several types a value is."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

LEAST = 1e-18
"""Least positive number of a scene."""

Real = Annotated[float, Field(ge=-1e18, le=1e18, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=LEAST, le=1e18, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=1e18, allow_inf_nan=False)]
Poisson = Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=1e-3, le=1, allow_inf_nan=False)]
Vector = Annotated[tuple[Real, Real, Real], Field(strict=False)]
Size = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]
CellCount = Annotated[int, Field(ge=1, le=2000)]
Cells = Annotated[tuple[CellCount, CellCount, CellCount], Field(strict=False)]
NAME_PATTERN = r"^[\w.+-]{1,60}$"
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Text = Annotated[str, Field(min_length=1, max_length=1000, pattern=r"^[^\x00]*$")]
Interval = Annotated[float, Field(ge=0, le=1e18, allow_inf_nan=False)]


def _kind(value: object) -> str:
    """Which type of a union a value is checked as; keys in messages leave these tags out."""
    if isinstance(value, dict | BaseModel):
        return "#table"
    if isinstance(value, list | tuple):
        return "#vector"
    return "#name" if isinstance(value, str) else "#number"


def _number_or_vector(value: object) -> str:
    return "#vector" if _kind(value) == "#vector" else "#number"


def _number_vector_or_name(value: object) -> str:
    kind = _kind(value)
    return "#number" if kind == "#table" else kind


def number_or_table(value: object) -> str:
    """Tag of a number or a table."""
    return "#table" if _kind(value) == "#table" else "#number"


def vector_or_table(value: object) -> str:
    """Tag of a vector or a table."""
    return "#table" if _kind(value) == "#table" else "#vector"


NumberVector = Annotated[
    Annotated[Real, Tag("#number")] | Annotated[Vector, Tag("#vector")],
    Discriminator(_number_or_vector),
]
NumberVectorName = Annotated[
    Annotated[Real, Tag("#number")]
    | Annotated[Vector, Tag("#vector")]
    | Annotated[Text, Tag("#name")],
    Discriminator(_number_vector_or_name),
]


class Table(BaseModel):
    """A table of the scene file: frozen, of strict types, without unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
