"""Scenes: their file, grains poured, the run; `Simulation` is here."""

from rigid_lcp.scene.file import SceneFile, scene_read
from rigid_lcp.scene.run import (
    history_of,
    left_out,
    plan_steps,
    scene_run,
    simulation_of,
    summary_of,
    unknowns_a_contact,
    write_history,
)
from rigid_lcp.scene.run_folder import RESULT, RunFolder, read_frame, rebuild_frame_scene
from rigid_lcp.scene.simulation import Simulation

__all__ = [
    "RESULT", "RunFolder", "SceneFile", "Simulation", "history_of", "left_out", "plan_steps",
    "read_frame", "rebuild_frame_scene", "scene_read", "scene_run", "simulation_of", "summary_of",
    "unknowns_a_contact", "write_history",
]  # fmt: skip
