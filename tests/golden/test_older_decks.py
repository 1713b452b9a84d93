"""What a scene does not name is not in its deck: generated input of older scenes, byte for byte.

The digests were made before scenes could name gradings, rolling friction, blocks and stages.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import State
from adapters.engines.contract import EngineStart, get_engine
from adapters.scene.tables import Scene
from tests.unit.test_decks import KINDS, STARTS, scene

DIGESTS = {"liggghts": "2eed4c670540c883", "lammps": "3ebdcb7838600de6", "yade": "bb207c2191750d79"}
"""SHA-256 of names and texts of all files but restarts and YADE's scripts, which read the rest."""


@pytest.mark.parametrize("name", DIGESTS)
def test_older_scenes_have_their_decks(name: str, tmp_path: Path) -> None:
    """Rain and all starts of a window, in all kinds of scenes of the decks' test."""
    digest, engine = hashlib.sha256(), get_engine(name)
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
        for path in sorted(home.rglob("*.*")):
            if path.suffix not in (".py", ".restart"):
                digest.update(str(path.relative_to(tmp_path)).encode() + path.read_bytes())
    assert digest.hexdigest()[:16] == DIGESTS[name]
