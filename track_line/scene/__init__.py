"""Scenes of lines: their file, the run, what came out."""

from track_line.scene.file import SceneFile, list_doubts, load_scene
from track_line.scene.page import draw_members, write_report
from track_line.scene.run import PLAN, RunFolder, preview_run, run_scene, summarise_run

__all__ = [
    "PLAN", "RunFolder", "SceneFile", "draw_members", "list_doubts", "load_scene", "preview_run",
    "run_scene", "summarise_run", "write_report",
]  # fmt: skip
