"""Scenes: their file, grains poured, the run; `Simulation` is here."""

from rigid_lcp.scene.file import SceneFile, list_doubts, load_scene
from rigid_lcp.scene.run import (
    RunFolder,
    count_unknowns,
    describe_scans,
    list_left_out,
    make_simulation,
    read_frame,
    read_history,
    rebuild_frame_scene,
    run_scene,
    summarise_run,
)
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.scene.types import plan_steps

__all__ = [
    "RunFolder", "SceneFile", "Simulation", "count_unknowns", "describe_scans", "list_doubts",
    "list_left_out", "load_scene", "make_simulation", "plan_steps", "read_frame", "read_history",
    "rebuild_frame_scene", "run_scene", "summarise_run",
]  # fmt: skip
