"""Types of the values in a scene file: their bounds, and which of several types a value is."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Discriminator, Field, Tag

from trackbed.scene_files import Positive, Real, Text

Poisson = Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=1e-3, le=1, allow_inf_nan=False)]
Vector = Annotated[tuple[Real, Real, Real], Field(strict=False)]
Size = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]
CellCount = Annotated[int, Field(ge=1, le=2000)]
Cells = Annotated[tuple[CellCount, CellCount, CellCount], Field(strict=False)]


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
