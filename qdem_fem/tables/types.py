"""Types of the values in a scene file: their bounds, and which of several types a value is."""

from typing import Annotated

from pydantic import BaseModel, Discriminator, Field, Tag

from trackbed.scene_files import Positive, Problem, Real, Text

Poisson = Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=1e-3, le=1, allow_inf_nan=False)]
Vector = Annotated[tuple[Real, Real, Real], Field(strict=False)]
Size = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]
CellCount = Annotated[int, Field(ge=1, le=2000)]
Cells = Annotated[tuple[CellCount, CellCount, CellCount], Field(strict=False)]


class WrongKey(Exception):
    """What a key says can not be used; ``problem`` says why."""

    def __init__(self, key: str, what: str, where: str = "") -> None:
        super().__init__(what)
        self.problem = Problem(key, what, where)


def make_discriminator(*tags: str) -> Discriminator:
    """Which type of a union a value is checked as: that of its kind, or the first of ``tags``.

    Keys in messages leave these tags out.
    """

    def choose(value: object) -> str:
        kind = "#name" if isinstance(value, str) else "#number"
        if isinstance(value, dict | BaseModel):
            kind = "#table"
        elif isinstance(value, list | tuple):
            kind = "#vector"
        return kind if kind in tags else tags[0]

    return Discriminator(choose)


NumberVector = Annotated[
    Annotated[Real, Tag("#number")] | Annotated[Vector, Tag("#vector")],
    make_discriminator("#number", "#vector"),
]
NumberVectorName = Annotated[
    Annotated[Real, Tag("#number")]
    | Annotated[Vector, Tag("#vector")]
    | Annotated[Text, Tag("#name")],
    make_discriminator("#number", "#vector", "#name"),
]
