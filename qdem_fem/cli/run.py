"""The verb ``trackbed qdem SCENE``: what it computes with is loaded when it runs."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Iterable
from functools import partial
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackbed.errors import UsageError
from trackbed.run_files import Progress, add_run_arguments, place_run, time_step

if TYPE_CHECKING:
    from qdem_fem.tables import Prepared


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``qdem`` to its parser."""
    assert verb == "qdem"
    add_run_arguments(
        parser, "a QDEM scene file (TOML)", "simulation.duration=0.1",
        "the last checkpoint, to the same bits",
    )  # fmt: skip
    parser.set_defaults(command=run_qdem)


def run_qdem(arguments: argparse.Namespace) -> int:
    """Run a scene, or tell what would run."""
    from qdem_fem.files import SceneWarning
    from qdem_fem.scene import load_scene

    path = place_run(arguments)
    said: list[str] = []
    with warnings.catch_warnings():
        warnings.filterwarnings("always", category=SceneWarning)
        warnings.showwarning = partial(_show_warning, said)
        prepared = load_scene(arguments.scene, arguments.overrides)
        if arguments.dry_run:
            summary = _preview_run(prepared) | {"warnings": said}
        else:
            summary = _run(prepared, path, arguments, said)
    try:
        _print(summary, arguments.json)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if not arguments.resume:
            raise
        raise UsageError(  # of a finished run the summary is the file's, whatever is in there
            f"the result lacks or garbles what a finished run has: {error}",
            where=str(path / "result.json"), remedy="move the folder away and run again",
        ) from error  # fmt: skip
    return 0


def _run(
    prepared: Prepared, path: Path, arguments: argparse.Namespace, said: list[str]
) -> dict[str, Any]:
    """The whole run with its report; its summary.  ``said``: warnings so far."""
    from qdem_fem import scene
    from trackbed.run_files import record_provenance, write_result

    folder = scene.RunFolder(path)
    manifest = {
        "scene": prepared.scene.parameters(),
        "files": prepared.files,
        "overrides": arguments.overrides,
        **record_provenance(["trackbed", *sys.argv[1:]]),
    }
    given = {"resume": arguments.resume, "force": arguments.force}
    if finished := folder.look_ahead(manifest, **given):
        return finished | {"folder": str(path)}
    run, bodies = scene.make_simulation(prepared)  # what it refuses must not leave a folder behind
    with folder.lock():
        goes_on = folder.prepare(manifest, prepared.text.text, **given)
        if prepared.scene.simulation.method == "static":
            done = scene.run_static(prepared, run, bodies, folder)
        else:
            done = scene.run_dynamic(
                prepared, run, bodies, folder, resume=goes_on, progress=Progress()
            )
        summary = scene.summarise_run(prepared, done, folder) | {"warnings": said}
        more: Iterable[tuple[Path, str]] = ()
        if "track" in prepared.text.data:  # other scenes do not pay for its import
            from qdem_fem.report import draw_track_pictures, list_track_facts
            from qdem_fem.track import TrackPrepared

            assert isinstance(prepared, TrackPrepared)
            summary["track"] = list_track_facts(path, prepared.load)
            summary["bed"] = prepared.trial
            more = draw_track_pictures(path, prepared.load)
        scene.write_report(folder, manifest, summary, None if arguments.no_pictures else done, more)
        write_result(path, summary)
    return summary | {"folder": str(path)}


def _show_warning(said: list[str], message: Warning | str, *_args: Any, **_options: Any) -> None:
    """A warning as a sentence, without the line of code it comes from; kept in ``said``."""
    said.append(str(message))
    print(f"warning: {message}", file=sys.stderr, flush=True)


def _preview_run(prepared: Prepared) -> dict[str, Any]:
    """What a run would be: bodies, steps, and the cost as a short trial tells it."""
    from qdem_fem import scene
    from qdem_fem.files import StepWarning

    outlook: dict[str, Any] = {
        "title": prepared.scene.title,
        "method": prepared.scene.simulation.method,
        "left_out": prepared.scene.list_left_out(),
    }
    if "track" in prepared.text.data:
        from qdem_fem.track import TrackPrepared, preview_bed

        assert isinstance(prepared, TrackPrepared)
        if bed := preview_bed(prepared):  # what follows it is known when it stands
            return outlook | {"bed": bed}
    run, bodies = scene.make_simulation(prepared)
    other = "track" not in prepared.text.data and prepared.scene.simulation.device == "cpu"
    scene.warn_of_bending(bodies, others=other)
    outlook |= {
        "bodies": scene.list_body_facts(bodies),
        "critical_step": scene.describe_critical_step(run),
        "mass_scaling": scene.list_mass_scaling_facts(run),
    }
    if prepared.scene.simulation.method == "dynamic":
        plan = scene.make_plan(prepared, float(run.step))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StepWarning)  # the outlook has its text
            seconds = time_step(run.advance, float(run.step), plan.total)
        outlook |= {
            "step": plan.step,
            "steps": plan.total,
            "rows": plan.total // plan.sampling + 1,
            "vtu_files": len(plan.list_field_files(plan.total)),
            "estimated_s": seconds * plan.total,
        }
    return outlook


def _print(content: dict[str, Any], as_json: bool) -> None:
    """A summary on standard output, as JSON or as lines a reader takes in."""
    if as_json:
        print(json.dumps(content, indent=2, allow_nan=False))
        return
    for name, body in content.get("bodies", {}).items():
        print(
            f"{name}: {body['elements']} elements ({body.get('element', 'linear')}), "
            f"{body['nodes']} nodes, smallest altitude "
            f"{body['smallest_altitude']:.4g} m in element {body['thinnest_element']}, "
            f"{body['flipped']} turned right-handed, {body['unused_nodes']} unused nodes"
        )
        if gain := body.get("gain"):  # results of earlier versions have none
            print(f"{name}: {gain}")
    if critical := content.get("critical_step"):
        if critical["value"] is not None:
            print(f"critical step {critical['value']:.4g} s, governed by {critical['governor']}")
        if critical["remark"]:
            print(f"warning: {critical['remark']}")
        if content["method"] == "dynamic":
            share = f"{100 * critical['share_used']:.1f} % of the critical one"
            print(f"{content['steps']} steps of {content['step']:.4g} s, {share}")
    if scaled := content.get("mass_scaling"):
        print(
            f"mass scaling adds {scaled['added_mass']:.4g} kg, "
            f"{100 * scaled['share']:.3g} % of the bodies' own mass"
            + ("" if "gravity" in content["left_out"] else ", and as much of their weight")
        )
    if "estimated_s" in content:
        print(f"estimated time {content['estimated_s']:.3g} s on this machine")
        print(f"{content['rows']} rows of probes, {content['vtu_files']} VTU files")
    print(f"not in this run: {'; '.join(content['left_out'])}")
    if "cost" in content:
        cost = content["cost"]
        speed = cost.get("million_elements_per_s")
        rate = f", {speed:.3g} million element-steps per second" if speed else ""
        print(f"{cost['cpu_s']:.3g} s of CPU time{rate}")
        print(f"{content['folder']}/report.html")
    if words := content.get("bed", {}).get("words"):
        print(f"the bed: {words}")
    if found := content.get("discretisation") or {}:
        print(
            f"errors of the mesh, estimated: {100 * found['displacement']:.2g} % of displacements "
            f"missing, {100 * found['stress']:.2g} % of stresses wrong, "
            f"{100 * found['frequency']:.2g} % of frequencies too much"
        )
    of_lengths, of_frequencies = (
        count_digits(found.get(of)) for of in ("displacement", "frequency")
    )
    for name, probe in content.get("probes", {}).items():
        end = " ".join(f"{value:.{of_lengths}g}" for value in probe["end"])
        print(f"{name} at the end (m): {end}")
    for name, modes in content.get("modes", {}).items():
        frequencies = [f"{mode['frequency']:.{of_frequencies}g} Hz" for mode in modes]
        print(f"{name}: {', '.join(frequencies)}")


def count_digits(error: float | None) -> int:
    """Digits of a figure that its mesh errs by, as a share; seven where no error is known."""
    return 7 if not error else min(max(2, 1 - floor(log10(error))), 7)
