"""What every engine satisfies; ``tests/engines`` asks more of those that are installed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from adapters.engines.contract import Engine, get_engine, list_engines, list_real_engines
from adapters.errors import EngineMissing
from adapters.files.run_folder import RunFolder
from adapters.files.window import load_window
from tests.contracts.protocols import list_missing
from tests.engine_sample import AFTER, FIRST, JUMP, SECOND, Sample

every_engine = pytest.mark.parametrize("name", list_engines())


@every_engine
def test_nothing_is_missing(name: str) -> None:
    """It has every method of `Engine` with its arguments, and the name of its file."""
    engine = get_engine(name)
    missing = list_missing(engine, Engine)
    assert not missing, f"the engine {name} lacks {', '.join(missing)}"
    assert engine.name == name


@every_engine
def test_version_or_a_remedy(name: str) -> None:
    """An engine tells its version, or how to install it."""
    try:
        banner = get_engine(name).version()
    except EngineMissing as missing:
        banner = f"0 {missing.remedy}"
    assert any(letter.isdigit() for letter in banner)
    assert len(banner) > 2


def test_places_in_auto_differ() -> None:
    """No two engines have one place among those that ``auto`` tries."""
    places = [get_engine(name).auto_order for name in list_real_engines()]
    assert len(set(places)) == len(places)


@pytest.mark.long
def test_tiny_run(sample: Sample) -> None:
    """Forty grains, eleven cycles, one jump: every stage ends, and its files are read."""
    stages = [outcome.stage for outcome in RunFolder(sample.run).outcomes()]
    assert "jump" in stages
    for stage in (FIRST, SECOND, AFTER):
        window = load_window(sample.run / stage / "states.npz")
        assert np.isfinite(window.position).all()
        assert (window.radius > 0).all()
    assert (sample.run / JUMP).is_dir()
    with (sample.run / "settlement.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert int(rows[-1]["cycle"]) == 11
    assert all(np.isfinite(float(row["mean_grain_settlement"])) for row in rows)
