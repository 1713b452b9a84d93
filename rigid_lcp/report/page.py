"""The report of a run: one page, ``report.html``, that loads nothing, its pictures and a movie."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion import Scene
from rigid_lcp.report import pictures
from rigid_lcp.scene import RunFolder, history_of, read_frame, rebuild_frame_scene, write_history
from trackbed.report import bullets, encode_figure, page, paragraph, picture, section, table
from trackbed.run_files import write_whole

Floats = NDArray[np.float64]

ROWS = (
    ("bodies that move", "bodies", "{:,}"),
    ("time", "time", "{:.6g} s"),
    ("steps", "steps", "{:,}"),
    ("mean length of a step", "step", "{:.4g} s"),
    ("unknowns a contact", "unknowns_a_contact", "{:d}"),
    ("contacts that carry at the end", "contacts", "{:,}"),
    ("of these sliding", "sliding", "{:,}"),
    ("largest normal force at the end", "largest_normal_force", "{:.4g} N"),
    ("largest speed at the end", "speed_largest", "{:.3g} m/s"),
    ("largest overlap in any frame", "overlap_largest", "{:.3g} m"),
    ("tolerance of the residual", "tolerance", "{:.2g}"),
    ("worst residual of any step", "residual_worst", "{:.2g}"),
    ("steps left above the tolerance", "steps_above", "{:,}"),
    ("impacts with restitution scaled down", "steps_scaled", "{:,}"),
    ("collisions that ran out of rounds, ended without restitution", "steps_cut_off", "{:,}"),
    ("processor time", "cpu_s", "{:.3g} s"),
    ("processor time a step", "cpu_a_step", "{:.3g} s"),
)


def write_report(
    folder: RunFolder, scene: Scene, manifest: dict[str, Any], summary: dict[str, Any],
    *, draw: bool,
) -> Path:  # fmt: skip
    """Write the report of a finished run, with pictures of its frames if ``draw``; its path."""
    history = history_of(folder)
    write_history(folder.path / "history.csv", history)
    figures = []
    if draw:
        draw_frames(folder, scene, summary["title"])
        figures = [
            (draw_end(folder, scene, summary["title"]),
             "Force chains at the end: lines from the bodies' centres to their contacts, as wide "
             "as the normal force; blue contacts stick, red ones slide."),
            (write_picture(folder, "history", pictures.picture_history(history)),
             "Energy (kinetic and potential), contacts that carry, and the greatest overlap, at "
             "the frames."),
        ]  # fmt: skip
    title = summary["title"] or "Rigid grains"
    above = f" ({summary['steps_above']:,} steps above the tolerance)"
    claim = (
        f"{summary['bodies']:,} rigid bodies, {summary['time']:.4g} s in {summary['steps']:,} "
        f"steps by {summary['method']}; contact forces to a residual of "
        f"{summary['residual_worst']:.2g}{above if summary['steps_above'] else ''}, overlaps up to "
        f"{summary['overlap_largest']:.2g} m, "
        f"{summary['cpu_s']:.3g} s of processor time."
    )
    if summary.get("steps_cut_off"):
        claim += (
            f" In {summary['steps_cut_off']:,} steps collisions ran out of rounds, and their rest "
            "ended without restitution, which costs energy."
        )
    rows = [(name, form.format(summary[key])) for name, key, form in ROWS if key in summary]
    parts = [
        f"<h1>{escape(title)}</h1>",
        paragraph(escape(claim), "claim"),
        *(picture(path, caption, escape(caption)) for path, caption in figures),
        section("Figures", table("", (), rows)),
        section("Left out", bullets(escape(text) for text in summary["left_out"])),
        section("Again", f"<pre>{escape(json.dumps(manifest['provenance'], indent=1))}</pre>"),
    ]
    path = folder.path / "report.html"
    write_whole(path, page(title, parts))
    return path


def draw_frames(folder: RunFolder, scene: Scene, title: str) -> list[Path]:
    """Draw every frame as ``picture-NUMBER.png`` with one window and one scale, and all as
    ``movie.gif``; the paths of the pictures.  Raises `UsageError` when one can not be written."""
    frames = [read_frame(path) for path in folder.frames()]
    positions = [frame["motion"].position[: len(scene.bodies)] for frame in frames]
    window = pictures.window_of(scene, positions)
    scale = pictures.force_scale([frame["contacts"].normal_force for frame in frames])
    drawn = [
        write_picture(
            folder, f"{number:06d}", draw_frame_figure(frame, scene, window, scale, title)
        )
        for number, frame in enumerate(frames)
    ]
    movie = pictures.encode_movie([path.read_bytes() for path in drawn])
    write_whole(folder.path / "movie.gif", movie)
    return drawn


def draw_end(folder: RunFolder, scene: Scene, title: str) -> Path:
    """Draw the last frame in a window and with a scale of its own; the picture's path."""
    frame = read_frame(folder.frames()[-1])
    bodies = rebuild_frame_scene(frame, scene)
    window = pictures.window_of(bodies, [frame["motion"].position])
    scale = pictures.force_scale([frame["contacts"].normal_force])
    return write_picture(folder, "end", draw_frame_figure(frame, scene, window, scale, title))


def draw_frame_figure(
    frame: dict[str, Any], scene: Scene, window: tuple[Floats, Floats], scale: float, title: str
) -> Any:
    """Bodies and force chains of a frame, its time above them."""
    head = f"{title}   t = {frame['time']:.3f} s"
    return pictures.draw_state(
        rebuild_frame_scene(frame, scene), frame["motion"], frame["contacts"], window, scale, head
    )


def write_picture(folder: RunFolder, name: str, figure: Any) -> Path:
    """Write a figure as ``picture-NAME.png``; its path.  Raises as `write_whole`."""
    path = folder.path / f"picture-{name}.png"
    write_whole(path, encode_figure(figure, path.suffix))
    return path
