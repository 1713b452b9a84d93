"""What every engine satisfies; ``tests/engines`` asks more of those that are installed."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import State, save_state
from adapters.engines.contract import Engine, get_engine, list_engines, list_real_engines
from adapters.errors import EngineMissing, SceneError
from adapters.files.run_folder import RunFolder
from adapters.files.window import load_window
from adapters.scene.file import load_scene
from adapters.scene.stages import draw_start
from tests.contracts.protocols import list_missing
from tests.engine_sample import AFTER, FIRST, JUMP, SECOND, Sample
from trackbed.scenes import find_scene_file

BALLAST_PAGE = Path(__file__).parents[2] / "docs" / "ballast.md"

SCENES = {
    "spheres, gradings": ("ballast", ()),
    "cylinders, boxes, mirror planes": ("karrech", ()),
    "resistance to rolling": ("karrech", ("material.grain.rolling_friction=0.2",)),
    "a block on its footprint, a piston on a share of the section": ("karrech-partial", ()),
    "weight of the ballast beside a block": ("ballast", ("loading.crib=0.15",)),
    "loads in stages, series of stress": ("ballast", (
        "loading.stage=[{from_cycle=9,amplitude=1e5,mean=6e4,frequency=9.0}]",)),
    "less friction while it rains": ("ballast", ("sample.rain_friction=0.1",)),
    "taps to a porosity": ("ballast", ("sample.porosity=0.4",)),
    "a bed from a saved state": ("ballast", ('sample.state="BED"',)),
    "stones of several spheres": ("karrech-coarse", ('sample.form="tetrahedron"',)),
}  # fmt: skip
"""Scene and keys, BED a saved one, of each row of the page's table; decks of the user's own are no
scene of these."""
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


@pytest.mark.parametrize("row", SCENES)
def test_the_page_says_what_each_engine_takes(row: str, tmp_path: Path) -> None:
    """An engine takes a scene when it writes the rain of it."""
    kind, keys = SCENES[row]
    place, radius, still = np.array([[0.1, 0.1, 0.02]]), np.array([0.02]), np.zeros((1, 3))
    save_state(State(np.array([1]), place, radius, radius, still, still), bed := tmp_path / "b.npz")
    keys = tuple(key.replace("BED", str(bed)) for key in keys)
    words = []
    for name in sorted(list_real_engines()):
        try:
            scene = load_scene(find_scene_file(kind), [f'engine.name="{name}"', *keys])
        except SceneError:
            words.append("no")
            continue
        (tmp_path / name).mkdir()
        get_engine(name).write_preparation(scene, *draw_start(scene), tmp_path / name)
        words.append("yes")
    assert f"| {row} | {' | '.join(words)} |" in BALLAST_PAGE.read_text(encoding="utf-8")


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
