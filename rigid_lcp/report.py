"""The report of a run: one page, ``report.html``, that loads nothing, its pictures and a movie."""

from __future__ import annotations

import base64
import json
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp import pictures
from rigid_lcp.frame_bodies import frame_scene
from rigid_lcp.run_folder import RunFolder, frame_read, write_whole
from rigid_lcp.scene import Scene
from rigid_lcp.scene_run import history_of, history_write

Floats = NDArray[np.float64]

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 Charter, Georgia, serif; color: #1a1a1a; background: #fff;
  max-width: 54rem; margin: 2.5rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .5rem; border-top: 1px solid #ccc; padding-top: .6rem; }
.claim { font-size: 1.1rem; border-left: 4px solid #0b5fa5; padding: .1rem 0 .1rem 1rem; }
figure { margin: 1rem 0; break-inside: avoid; }
figure img { max-width: 100%; height: auto; display: block; margin: auto; }
figcaption { font-size: .87rem; color: #444; }
table { border-collapse: collapse; font: .86rem/1.4 Helvetica, Arial, sans-serif; }
th, td { padding: .25rem .8rem .25rem 0; text-align: left; border-bottom: 1px solid #e4e4e4; }
pre { background: #f5f5f5; padding: .7rem .9rem; white-space: pre-wrap; overflow-wrap: anywhere; }
"""
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


def report_write(
    folder: RunFolder, scene: Scene, manifest: dict[str, Any], summary: dict[str, Any],
    *, draw: bool,
) -> Path:  # fmt: skip
    """Write the report of a finished run, with pictures of its frames if ``draw``; its path."""
    history = history_of(folder)
    history_write(folder.path / "history.csv", history)
    figures = []
    if draw:
        frames_draw(folder, scene, summary["title"])
        figures = [
            (end_draw(folder, scene, summary["title"]),
             "Force chains at the end: lines from the bodies' centres to their contacts, as wide "
             "as the normal force; blue contacts stick, red ones slide."),
            (picture_write(folder, "history", pictures.picture_history(history)),
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
    rows = "".join(
        f"<tr><td>{name}</td><td>{form.format(summary[key])}</td></tr>"
        for name, key, form in ROWS
        if key in summary
    )
    absent = "".join(f"<li>{escape(text)}</li>" for text in summary["left_out"])
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    page = [
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"/>',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}"/>',
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>",
        f'<h1>{escape(title)}</h1><p class="claim">{escape(claim)}</p>',
        *(_figure(path, caption) for path, caption in figures),
        f"<h2>Figures</h2><table>{rows}</table>",
        f"<h2>Left out</h2><ul>{absent}</ul>",
        f"<h2>Again</h2><pre>{escape(json.dumps(manifest['provenance'], indent=1))}</pre>",
        "</body></html>\n",
    ]
    path = folder.path / "report.html"
    write_whole(path, "\n".join(page))
    return path


def frames_draw(folder: RunFolder, scene: Scene, title: str) -> list[Path]:
    """Draw every frame as ``picture-NUMBER.png`` with one window and one scale, and all as
    ``movie.gif``; the paths of the pictures.  Raises `UsageError` when one can not be written."""
    frames = [frame_read(path) for path in folder.frames()]
    positions = [frame["motion"].position[: len(scene.bodies)] for frame in frames]
    window = pictures.window_of(scene, positions)
    scale = pictures.force_scale([frame["contacts"].normal_force for frame in frames])
    drawn = [
        picture_write(folder, f"{number:06d}", frame_figure(frame, scene, window, scale, title))
        for number, frame in enumerate(frames)
    ]
    movie = pictures.movie_gif([path.read_bytes() for path in drawn])
    write_whole(folder.path / "movie.gif", movie)
    return drawn


def end_draw(folder: RunFolder, scene: Scene, title: str) -> Path:
    """Draw the last frame in a window and with a scale of its own; the picture's path."""
    frame = frame_read(folder.frames()[-1])
    bodies = frame_scene(frame, scene)
    window = pictures.window_of(bodies, [frame["motion"].position])
    scale = pictures.force_scale([frame["contacts"].normal_force])
    return picture_write(folder, "end", frame_figure(frame, scene, window, scale, title))


def frame_figure(
    frame: dict[str, Any], scene: Scene, window: tuple[Floats, Floats], scale: float, title: str
) -> Any:
    """Bodies and force chains of a frame, its time above them."""
    head = f"{title}   t = {frame['time']:.3f} s"
    return pictures.picture_state(
        frame_scene(frame, scene), frame["motion"], frame["contacts"], window, scale, head
    )


def picture_write(folder: RunFolder, name: str, figure: Any) -> Path:
    """Write a figure as ``picture-NAME.png``; its path.  Raises as `write_whole`."""
    path = folder.path / f"picture-{name}.png"
    write_whole(path, pictures.figure_png(figure))
    return path


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(caption)}"/>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
