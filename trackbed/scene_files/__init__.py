"""Scene files: TOML with lines, all problems at once, the nearest word; and grading curves."""

from trackbed.scene_files.grading import (
    GRADINGS,
    Grading,
    GradingKey,
    Sieves,
    draw_sizes,
    make_grading,
    refuse_outside_limits,
)
from trackbed.scene_files.reader import (
    Guide,
    Problem,
    SceneText,
    describe_error,
    read_scene,
    suggest_word,
)
from trackbed.scene_files.sieving import find_sieve_size
from trackbed.scene_files.types import (
    LengthUnit,
    Name,
    NonNegative,
    Positive,
    Real,
    Table,
    Text,
    find_model,
)

__all__ = [
    "GRADINGS", "Grading", "GradingKey", "Guide", "LengthUnit", "Name", "NonNegative", "Positive",
    "Problem", "Real", "SceneText", "Sieves", "Table", "Text", "describe_error", "draw_sizes",
    "find_model", "find_sieve_size", "make_grading", "read_scene", "refuse_outside_limits",
    "suggest_word",
]  # fmt: skip
