"""Scene files: TOML with lines, all problems at once, the nearest word."""

from trackbed.scene_files.reader import (
    Guide,
    Problem,
    SceneText,
    describe_error,
    find_model,
    read_scene,
    suggest_word,
)
from trackbed.scene_files.types import Name, NonNegative, Positive, Real, Table, Text

__all__ = [
    "Guide", "Name", "NonNegative", "Positive", "Problem", "Real", "SceneText", "Table", "Text",
    "describe_error", "find_model", "read_scene", "suggest_word",
]  # fmt: skip
