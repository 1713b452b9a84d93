"""The report of a run: one page, ``report.html``, that loads nothing, its pictures and a movie."""

from pathlib import Path
from typing import Any

from rigid_lcp.motion import Scene
from rigid_lcp.report import pictures
from rigid_lcp.scene import RunFolder, read_frame, read_history, rebuild_frame_scene
from trackbed.report import encode_figure, write_run_page
from trackbed.run_files import write_csv, write_whole

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
    history = read_history(folder)
    rows = zip(*(column.tolist() for column in history.values()), strict=True)
    write_csv(folder.path / "history.csv", history, rows)
    figures = []
    if draw:
        title = summary["title"]
        draw_movie(folder, scene, title)
        last = read_frame(folder.frames()[-1])
        (end,) = draw_frames(folder, rebuild_frame_scene(last, scene), title, {"end": last})
        figures = [
            (end,
             "Force chains at the end: lines from the bodies' centres to their contacts, as wide "
             "as the normal force; blue contacts stick, red ones slide."),
            (write_picture(folder, "history", pictures.draw_history(history)),
             "Energy (kinetic and potential), contacts that carry, and the greatest overlap, at "
             "the frames."),
        ]  # fmt: skip
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
    said = [(name, form.format(summary[key])) for name, key, form in ROWS if key in summary]
    said += [("scan", each) for each in summary.get("scans", ())]
    return write_run_page(
        folder.path, summary["title"] or "Rigid grains", claim, figures, said, summary["left_out"],
        manifest["provenance"],
    )  # fmt: skip


def draw_movie(folder: RunFolder, scene: Scene, title: str) -> list[Path]:
    """Draw every frame as ``picture-NUMBER.png``, and all as ``movie.gif``; the pictures' paths."""
    frames = {f"{n:06d}": read_frame(path) for n, path in enumerate(folder.frames())}
    drawn = draw_frames(folder, scene, title, frames)
    write_whole(folder.path / "movie.gif", pictures.encode_movie(drawn))
    return drawn


def draw_frames(
    folder: RunFolder, scene: Scene, title: str, frames: dict[str, dict[str, Any]]
) -> list[Path]:
    """Draw frames as ``picture-NAME.png`` with one window, in which the bodies of ``scene`` are,
    and one scale; their paths.  Raises `UsageError` when one can not be written."""
    places = [frame["motion"].position[: len(scene.bodies)] for frame in frames.values()]
    window = pictures.find_window(scene, places)
    scale = pictures.choose_scale([frame["contacts"].normal_force for frame in frames.values()])
    drawn = []
    for name, frame in frames.items():
        bodies, head = rebuild_frame_scene(frame, scene), f"{title}   t = {frame['time']:.3f} s"
        image = pictures.draw_state(bodies, frame["motion"], frame["contacts"], window, scale, head)
        drawn.append(write_picture(folder, name, image))
    return drawn


def write_picture(folder: RunFolder, name: str, figure: Any) -> Path:
    """Write a figure as ``picture-NAME.png``; its path.  Raises as `write_whole`."""
    path = folder.path / f"picture-{name}.png"
    write_whole(path, encode_figure(figure, path.suffix))
    return path
