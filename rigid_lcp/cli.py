"""The verb ``trackbed rigid SCENE``: what it computes with is loaded when it runs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackbed.run_files import Progress, add_run_arguments, place_run, time_step
from trackbed.run_verbs import print_fields

if TYPE_CHECKING:
    from rigid_lcp.scene import SceneFile, Simulation


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``rigid`` to its parser."""
    assert verb == "rigid"
    add_run_arguments(
        parser, "a scene of rigid bodies (TOML)", "run.duration=0.1", "the last frame"
    )
    parser.set_defaults(command=run_rigid)


def run_rigid(arguments: argparse.Namespace) -> int:
    """Run a scene, or tell what would run."""
    from rigid_lcp.scene import list_doubts, load_scene

    path = place_run(arguments)
    file = load_scene(arguments.scene, arguments.overrides)
    for doubt in list_doubts(file.tables, file.scans):
        print(f"warning: {doubt}", file=sys.stderr)
    answer = _preview_run(file) if arguments.dry_run else _run(file, path, arguments)
    print_fields(answer, arguments.json)
    return 0


def _preview_run(file: SceneFile) -> dict[str, Any]:
    """What a run would be: bodies, steps, about what they cost, what is left out."""
    from rigid_lcp import scene

    _, run = scene.make_simulation(file)
    tables = file.tables.run
    steps, step = scene.plan_steps(tables)
    seconds = time_step(run.advance, step, steps)
    return {
        "title": file.tables.title,
        "method": tables.method,
        "bodies": int(run.world.movable.sum()),
        "steps": steps,
        "step": step,
        "unknowns_a_contact": scene.count_unknowns(file),
        "frames": tables.frames,
        "estimated_s": seconds * steps,
        **scene.describe_scans(file),
        "left_out": scene.list_left_out(file),
    }


def _run(file: SceneFile, path: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """The whole run with its report; its summary."""
    from rigid_lcp.report import write_report
    from rigid_lcp.scene import RunFolder, make_simulation, run_scene, summarise_run
    from trackbed.run_files import make_manifest, open_run, write_result

    folder, manifest = RunFolder(path), make_manifest(file.tables.model_dump(mode="json"))
    if file.digests:  # older runs without files still go on
        manifest["files"] = file.digests
    given = {"resume": arguments.resume, "force": arguments.force}
    if finished := folder.look_ahead(manifest, **given):
        return finished | {"folder": str(path)}
    scene, run = make_simulation(file)  # what it refuses must not leave a folder behind
    progress = Progress(0.0)

    def show(now: float, end: float, run: Simulation) -> None:
        progress.report(now, end, f"{now:.4g} of {end:.4g} s, {len(run.contacts)} contacts")

    kept = "every finished frame is saved"
    with open_run(folder, manifest, file.text, arguments, kept) as goes_on:
        run_scene(file, run, folder, resume=goes_on, progress=show)
        summary = summarise_run(file, scene, run, folder)
        write_report(folder, scene, manifest, summary, draw=not arguments.no_pictures)
        write_result(path, summary)
    return summary | {"folder": str(path)}
