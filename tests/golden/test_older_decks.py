"""What a scene does not name is not in its deck: generated input of older scenes, byte for byte.

The digests were made before scenes could name gradings, rolling friction, blocks and stages.  Run
this file as a script to print them.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from adapters.bed.state import State
from adapters.engines.contract import EngineStart, get_engine
from adapters.scene.tables import Scene
from tests.unit.test_decks import KINDS, STARTS, scene

DIGESTS = {
    "liggghts": "2eed4c670540c883",
    "lammps": "3ebdcb7838600de6",
    "yade": "bb207c2191750d79",
}
"""SHA-256 of names and texts of all generated files, and of LIGGGHTS' and LAMMPS' static parts."""
SCRIPTS = (".py", ".restart")
"""Endings that are not looked at: YADE's static scripts read the parameters, whatever these are."""


def find_digest(engine: str, home: Path) -> str:
    """Of the rain and of all starts of a window, in all kinds of scenes."""
    digest = hashlib.sha256()
    for kind in KINDS:
        given = scene(home, kind).model_dump(exclude_none=True)
        one = Scene.model_validate(given | {"engine": given["engine"] | {"name": engine}})
        count = one.grain_count
        position = np.full((count, 3), 5e-3) + 7e-3 * np.arange(count)[:, None] * [0, 0, 1]
        radius, still = np.full(count, 3e-3), np.zeros((count, 3))
        folder = home / kind / "rain"
        folder.mkdir(parents=True)
        get_engine(engine).write_preparation(one, position, radius, 0.05, folder)
        (folder / "end.restart").touch()
        for start in STARTS if one.loading else ():
            identifier = np.arange(1, count + 1)
            moved = State(identifier, position, radius, radius, still, still)
            begin = EngineStart(
                folder / "end.restart", 500, 1, 0.04, moved if start == "moved" else None,
                start == "first", 1e-9 * (start == "perturbed"),
            )  # fmt: skip
            (home / kind / start).mkdir()
            get_engine(engine).write_cycles(one, begin, 3, home / kind / start)
        for path in sorted((home / kind).rglob("*.*")):
            if path.suffix not in SCRIPTS:
                digest.update(str(path.relative_to(home)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize("engine", DIGESTS)
def test_older_scenes_have_their_decks(engine: str, tmp_path: Path) -> None:
    """Nothing that scenes may name since then is in the deck of one that does not name it."""
    assert find_digest(engine, tmp_path) == DIGESTS[engine]


if __name__ == "__main__":
    for name in ("liggghts", "lammps", "yade"):
        with TemporaryDirectory() as temporary:
            print(f'    "{name}": "{find_digest(name, Path(temporary))}",')
