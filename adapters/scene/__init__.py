"""A settlement scene: its tables, its file, and what is checked before anything runs."""

from adapters.scene.bearing import count_layers, estimate_swing, judge_bed, warn_of_bed
from adapters.scene.file import expand_schedule, load_scene
from adapters.scene.inputs import INPUT_FILES, copy_inputs, record_scene
from adapters.scene.mechanics import DOUBTFUL
from adapters.scene.model import list_omissions
from adapters.scene.porosity import measure_porosity
from adapters.scene.procedures import fill_procedure
from adapters.scene.stages import bound_friction, draw_start, list_stages
from adapters.scene.tables import MEMBERS_MOST, Procedure, Scene
from adapters.scene.values import flatten_keys

__all__ = [
    "DOUBTFUL", "INPUT_FILES", "MEMBERS_MOST", "Procedure", "Scene", "bound_friction",
    "copy_inputs", "count_layers", "draw_start", "estimate_swing", "expand_schedule",
    "fill_procedure", "flatten_keys", "judge_bed", "list_omissions", "list_stages", "load_scene",
    "measure_porosity", "record_scene", "warn_of_bed",
]  # fmt: skip
