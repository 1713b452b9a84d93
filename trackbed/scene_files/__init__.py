"""Scene files: TOML with lines, all problems at once, the nearest word; and grading curves."""

from trackbed.scene_files.grading import GRADINGS, Grading, draw_sizes, refuse_outside_limits
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
    "GRADINGS", "Grading", "Guide", "Name", "NonNegative", "Positive", "Problem", "Real",
    "SceneText", "Table", "Text", "describe_error", "draw_sizes", "find_model", "read_scene",
    "refuse_outside_limits", "suggest_word",
]  # fmt: skip
