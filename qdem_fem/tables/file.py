"""QDEM scene files: which tables they have, and where a user finds an example."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from qdem_fem.tables.keys import Scene
from trackbed.scene_files import Guide, SceneText, read_scene

GUIDE = Guide("cantilever", "simulation.duration=0.1")
TRACK_GUIDE = Guide("track-small", "simulation.duration=0.1")
"""Of scenes with a table ``[track]``."""


def scene_read(
    path: Path | str,
    overrides: Sequence[str] = (),
    model_of: Callable[[Mapping[str, Any]], type[Scene]] = lambda data: Scene,
) -> SceneText:
    """Read a scene file and check every table by itself; nothing that needs a mesh.

    ``model_of`` gives the tables that a scene may have by its data.
    What is wrong with the keys is in ``problems`` of the answer, not raised: `refuse` does.

    Raises `UsageError` when the file or an override can not be read, `SceneError` for no TOML.
    """
    scene = read_scene(path, overrides, guide=GUIDE)
    if "track" in scene.data:
        scene.guide = TRACK_GUIDE
    scene.check(model_of(scene.data))
    return scene
