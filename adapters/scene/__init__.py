"""A settlement scene: its tables, its file, and what is checked before anything runs."""

from adapters.scene.file import load_scene
from adapters.scene.model import list_omissions
from adapters.scene.tables import MEMBERS_MOST, Procedure, Scene, flatten_keys

__all__ = [
    "MEMBERS_MOST", "Procedure", "Scene", "flatten_keys", "list_omissions", "load_scene",
]  # fmt: skip
