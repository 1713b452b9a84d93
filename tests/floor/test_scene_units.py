"""Numbers with a unit in scenes: exact values, refusals, and the unit of every key there is."""

from __future__ import annotations

import tomllib
from decimal import Decimal
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from trackbed.scene_files import find_model
from trackbed.scene_files.types import list_kinds
from trackbed.scene_files.units import (
    convert_quantity,
    convert_table,
    measure_unit,
    read_notes,
    split_note,
)

SCENES = sorted(Path("trackbed/scenes").glob("*.toml"))
MODELS = [
    "adapters.scene.Scene", "adapters.decks.scene.DeckScene", "qdem_fem.tables.Scene",
    "qdem_fem.track.enter.TrackScene", "rigid_lcp.scene.types.SceneTables",
    "track_line.scene.file.SceneTables",
]  # fmt: skip


def load_model(path: str) -> type[BaseModel]:
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def find_scene_model(data: dict[str, Any]) -> type[BaseModel]:
    """The model whose keys are those of a scene."""
    return next(m for m in map(load_model, MODELS) if data.keys() <= m.model_fields.keys())


def list_models(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A model and all that its tables have inside."""
    inner = {find_model(field.annotation) for field in model.model_fields.values()} - {None}
    return {model}.union(*(list_models(one) for one in inner))


def write_units(table: dict[str, Any], model: type[BaseModel]) -> int:
    """Put each number of a table as a text with a thousandth of its unit; how many there were."""
    count, notes = 0, read_notes(model)
    for key, value in table.items():
        if key not in model.model_fields:
            continue
        annotation = model.model_fields[key].annotation
        inner, kinds = find_model(annotation), [*list_kinds(annotation)]
        unit, _ = split_note(notes.get(key, ""))
        known = unit in ("m", "N", "Pa", "Hz", "s", "m/s", "kg/m^3", "N/m")
        small = {"kg/m^3": "g/m^3"}.get(unit, f"m{unit}")
        for place in range(len(value)) if isinstance(value, list) else [None]:
            entry = value if place is None else value[place]
            if isinstance(entry, dict) and inner:
                count += write_units(entry, inner)
            elif type(entry) is float and float in kinds and known:
                text = f"{Decimal(repr(entry)) * 1000} {small}"
                count += 1
                if place is None:
                    table[key] = text
                else:
                    value[place] = text
    return count


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_a_scene_with_units_is_the_scene_in_si_units(path: Path) -> None:
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    written = tomllib.loads(path.read_text(encoding="utf-8"))
    model = find_scene_model(data)
    assert write_units(written, model)
    assert written != data
    assert [*convert_table(written, model)] == []
    assert written == data  # to the bit: values are exact


@pytest.mark.parametrize("path", MODELS)
def test_every_number_of_a_scene_has_a_unit_that_is_understood(path: str) -> None:
    for model in list_models(load_model(path)):
        notes = read_notes(model)
        for key, field in model.model_fields.items():
            if float in list_kinds(field.annotation):
                unit, _ = split_note(notes.get(key, ""))
                understood = unit in ("as its table", "SI") or measure_unit(unit)
                assert understood, f"{model.__name__}.{key}"


@given(st.decimals(-1000, 1000, allow_nan=False, places=5))
def test_a_number_with_a_prefix_is_the_float_that_its_digits_are(number: Decimal) -> None:
    assert convert_quantity(f"{number} mm", "m") == float(number / 1000)
    assert convert_quantity(f"{number} kPa", "Pa") == float(number * 1000)
    assert convert_quantity(f"{number}%", "-") == float(number / 100)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("300 km/h", "m/s", 300 / 3.6), ("20 kN/mm", "N/m", 2e7), ("2.6 t/m³", "kg/m^3", 2600.0),
     ("180 deg", "rad", 3.141592653589793), ("1.5e-3 Pa·s", "Pa s", 1.5e-3),
     ("9.81 m/s^2", "m/s^2", 9.81), ("2.6 t/m3", "kg/m^3", 2600.0), ("5 m2", "m^2", 5.0),
     ("180°", "rad", 3.141592653589793), ("9" * 99 + " m", "m", None),
     (f"5 mm{' ' * 80}kN", "m", None), ("4 min", "s", 240.0), ("20 mm", "mm", 20.0),
     ("2 cm", "mm", 20.0), ("5 growing", "-", None), ("fast", "-", None), ("50 Hx", "Hz", None),
     ("50 m^99", "m", None), ("5 /m", "1/s", None), ("1", "m", None)],
)  # fmt: skip
def test_units_as_people_write_them(text: str, unit: str, value: float | None) -> None:
    assert convert_quantity(text, unit) == (None if value is None else pytest.approx(value, 1e-15))


@pytest.mark.parametrize(
    ("text", "unit"),
    [("50 Hz", "rad/s"), ("50 rad/s", "Hz"), ("5 mm", "-"), ("5 kg", "N"), ("5 s", "as its table"),
     ("5 mm", "m^2"), ("5 %", "m")],
)  # fmt: skip
def test_a_unit_of_another_kind_is_refused(text: str, unit: str) -> None:
    with pytest.raises(ValueError, match=f"must be a number .*not '{text}'"):
        convert_quantity(text, unit)


def test_a_count_may_be_written_as_1e5_and_no_part_of_one() -> None:
    model = load_model("adapters.scene.Scene")
    table = {"procedure": {"total_cycles": 1e5, "k_i": 50.5}, "sample": {"radius": 1.0}}
    assert [*convert_table(table, model)] == []
    assert repr(table["procedure"]) == "{'total_cycles': 100000, 'k_i': 50.5}"
    assert repr(table["sample"]) == "{'radius': 1.0}"
