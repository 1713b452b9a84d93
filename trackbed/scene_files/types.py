"""Types of the values in a scene file, with their bounds, for the models of every story."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field

LEAST = 1e-18
"""Least positive number of a scene; its inverse is the greatest of any."""

Real = Annotated[float, Field(ge=-1e18, le=1e18, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=LEAST, le=1e18, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=1e18, allow_inf_nan=False)]
NAME_PATTERN = r"^[\w.+-]{1,60}$"
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
LengthUnit = Literal["m", "cm", "mm"]
"""Of lengths in meshes."""
Text = Annotated[str, Field(min_length=1, max_length=1000, pattern=r"^[^\x00]*$")]


class Table(BaseModel):
    """A table of a scene file: frozen, of strict types, without unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def find_model(annotation: Any) -> type[BaseModel] | None:
    """The model inside a field's type, however deep; None when there is none."""
    models = (
        kind for kind in list_kinds(annotation)
        if isinstance(kind, type) and issubclass(kind, BaseModel)
    )  # fmt: skip
    return next(models, None)


def list_kinds(annotation: Any) -> Iterator[Any]:
    """The types inside a field's type, however deep."""
    arguments = get_args(annotation)
    yield from (kind for argument in arguments for kind in list_kinds(argument))
    yield annotation
