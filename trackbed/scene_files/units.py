"""Numbers as people write them in a scene file, such as ``"50 Hz"``, in the unit of their key.

The unit of a key is the one that its model says in brackets; the reference of all keys has it from
there too.  Values are exact: ``"3.3 mm"`` is the float that 0.0033 is.
"""

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from typing import Any, get_origin

from pydantic import BaseModel

from trackbed.scene_files.types import find_model, list_kinds

Measure = tuple[Fraction, tuple[int, ...]]
"""Size in SI units, and powers of metre, kilogram, second and radian."""

PREFIXED: dict[str, Measure] = {
    "m": (Fraction(1), (1, 0, 0, 0)), "g": (Fraction("1e-3"), (0, 1, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0)), "rad": (Fraction(1), (0, 0, 0, 1)),
    "Hz": (Fraction(1), (0, 0, -1, 0)), "N": (Fraction(1), (1, 1, -2, 0)),
    "Pa": (Fraction(1), (-1, 1, -2, 0)), "bar": (Fraction("1e5"), (-1, 1, -2, 0)),
    "J": (Fraction(1), (2, 1, -2, 0)),
}  # fmt: skip
PREFIXES = {"G": 9, "M": 6, "k": 3, "c": -2, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9}
UNITS: dict[str, Measure] = {
    **{prefix + unit: (size * Fraction(10) ** power, dimension)
       for unit, (size, dimension) in PREFIXED.items() for prefix, power in PREFIXES.items()},
    **PREFIXED,
    "t": (Fraction(1000), (0, 1, 0, 0)), "min": (Fraction(60), (0, 0, 1, 0)),
    "h": (Fraction(3600), (0, 0, 1, 0)), "deg": (Fraction(math.pi / 180), (0, 0, 0, 1)),
    "°": (Fraction(math.pi / 180), (0, 0, 0, 1)), "1": (Fraction(1), (0, 0, 0, 0)),
    "-": (Fraction(1), (0, 0, 0, 0)), "%": (Fraction("1e-2"), (0, 0, 0, 0)),
}  # fmt: skip
QUANTITY = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,2})?)\s*([^\d\s.+-].{,20}?)\s*"
)
"""A number and what may be its unit."""
MOST_CHARACTERS = 60
"""Characters of a number with its unit, at most."""
WRITTEN = str.maketrans({"²": "^2", "³": "^3", "·": " ", "*": " "})


def convert_table(
    table: dict[str, Any], model: type[BaseModel], above: str = ""
) -> Iterator[tuple[str, str]]:
    """Convert numbers with a unit in a table of a scene, and in those inside it, and whole numbers
    that are written as 1e5; yields the dotted keys of those with another unit, and a sentence."""
    for key, value in table.items():
        if key not in model.model_fields:
            continue
        annotation = model.model_fields[key].annotation
        inner, kinds = find_model(annotation), [*list_kinds(annotation)]
        entries: dict[Any, Any] = dict(enumerate(value)) if isinstance(value, list) else {"": value}
        if inner and isinstance(value, dict) and any(get_origin(kind) is dict for kind in kinds):
            entries = value
        for name, entry in entries.items():
            place = f"{above}{key}.{name}".removesuffix(".")
            if isinstance(entry, dict) and inner:
                yield from convert_table(entry, inner, f"{place}.")
            elif isinstance(entry, str) and float in kinds:
                try:
                    unit, _ = split_note(read_notes(model).get(key, ""))
                    number = convert_quantity(entry, unit)
                    entries[name] = entry if number is None else number
                except ValueError as error:
                    yield place, str(error)
            elif type(entry) is float and int in kinds and float not in kinds:
                entries[name] = int(entry) if entry.is_integer() else entry
        if isinstance(value, list):
            table[key] = [*entries.values()]
        elif entries is not value:
            table[key] = entries[""]


def read_notes(model: type) -> dict[str, str]:
    """What the source of a model, and of those that it extends, says of each key.

    A key is described where its model declares it: by the comment at the end of its line, or by the
    string below.
    """
    notes: dict[str, str] = {}
    for one in reversed([base for base in model.__mro__ if base not in BaseModel.__mro__]):
        lines = textwrap.dedent(inspect.getsource(one)).splitlines()
        [definition] = ast.parse("\n".join(lines)).body
        assert isinstance(definition, ast.ClassDef)
        for node, below in pairwise([*definition.body, ast.Pass()]):
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                said = lines[(node.end_lineno or 0) - 1].partition("  # ")[2]
                if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                    said = f"{said} {below.value.value!s}".strip()
                notes[node.target.id] = said
    return notes


def split_note(note: str) -> tuple[str, str]:
    """The unit in brackets in a key's note, empty where it has none, and the words around it."""
    unit = re.search(r"\s*\[([^\]]+)\]", note)
    return (unit[1], note.replace(unit[0], "", 1).lstrip("; ")) if unit else ("", note)


def measure_unit(unit: str) -> Measure | None:
    """Size and dimension of a unit such as ``kN/m^2`` or ``Pa s``; None for words that are none.

    What stands behind a ``/`` divides, up to the next one.
    """
    size, dimension = UNITS["1"]
    for place, part in enumerate(unit.translate(WRITTEN).split("/")):
        for word in part.split() or [""]:
            found = re.fullmatch(r"(1|[^\d^]+)\^?([1-9]?)", word)  # m^2 and m2
            if found is None or found[1] not in UNITS:
                return None
            exponent = int(found[2] or 1) * (-1 if place else 1)
            own, powers = UNITS[found[1]]
            size *= own**exponent
            dimension = tuple(a + exponent * b for a, b in zip(dimension, powers, strict=True))
    return size, dimension


def convert_quantity(text: str, unit: str) -> float | None:
    """The number of ``text`` in a key's ``unit``; None where it is no number with a unit.

    Raises ValueError, with a sentence, where its unit is none of the key's kind.
    """
    found = QUANTITY.fullmatch(text) if len(text) <= MOST_CHARACTERS else None
    given, wanted = measure_unit(found[2]) if found else None, measure_unit(unit)
    if found is None or given is None:
        return None
    if wanted is None or given[1] != wanted[1]:
        own = f"in {unit}" if wanted and unit != "-" else "without a unit"
        raise ValueError(f"must be a number {own}, not {text!r:.60}")
    return float(Fraction(found[1]) * given[0] / wanted[0])
