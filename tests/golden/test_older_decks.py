"""What a scene does not name is not in its deck: generated input of older scenes, byte for byte."""

from __future__ import annotations

import hashlib
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import State
from adapters.engines.contract import EngineStart, get_engine
from adapters.scene.file import load_scene
from adapters.scene.stages import draw_start
from adapters.scene.tables import Scene
from tests.golden.digests import DECKS, RAIN
from tests.unit.test_decks import KINDS, STARTS, scene
from trackbed.scenes import find_scene_file

SCENES = ("karrech", "karrech-coarse", "karrech-partial")
SEEDS = (1, 101)


def digest_files(home: Path) -> str:
    """Sixteen digits of the names and texts in a folder that `tests.golden.digests` is about."""
    digest = hashlib.sha256()
    for path in sorted(home.rglob("*.*")):
        if path.suffix not in (".py", ".restart"):
            digest.update(str(path.relative_to(home)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize("name", RAIN)
def test_older_scenes_rain_as_they_did(name: str, tmp_path: Path) -> None:
    """Radii, places and decks of the rain, of every seed."""
    for kind, seed in product(SCENES, SEEDS):
        (home := tmp_path / f"{kind}-{seed}").mkdir()
        settings = [f'engine.name="{name}"', f"sample.seed={seed}"]
        one = load_scene(find_scene_file(kind), settings)
        get_engine(name).write_preparation(one, *draw_start(one), home)
    assert digest_files(tmp_path) == RAIN[name]


@pytest.mark.parametrize("name", DECKS)
def test_older_scenes_have_their_decks(name: str, tmp_path: Path) -> None:
    """Rain and all starts of a window, in all kinds of scenes of the decks' test."""
    engine = get_engine(name)
    for kind in KINDS:
        given = scene(tmp_path, kind).model_dump(exclude_none=True)
        one = Scene.model_validate(given | {"engine": given["engine"] | {"name": name}})
        grain = np.arange(one.grain_count)
        position = np.full((len(grain), 3), 5e-3) + 7e-3 * grain[:, None] * [0, 0, 1]
        radius, still = np.full(len(grain), 3e-3), np.zeros((len(grain), 3))
        home = tmp_path / kind
        (home / "rain").mkdir(parents=True)
        engine.write_preparation(one, position, radius, 0.05, home / "rain")
        (restart := home / "rain" / "end.restart").touch()
        moved = State(grain + 1, position, radius, radius, still, still)
        for start in STARTS if one.loading else ():
            begin = EngineStart(
                restart, 500, 1, 0.04, moved if start == "moved" else None, start == "first",
                1e-9 * (start == "perturbed"),
            )  # fmt: skip
            (home / start).mkdir()
            engine.write_cycles(one, begin, 3, home / start)
    assert digest_files(tmp_path) == DECKS[name]
