"""The verb ``trackbed line SCENE``: what it computes with is loaded when it runs."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackbed.errors import UsageError
from trackbed.plausible import describe_implausible
from trackbed.run_files import Progress, add_run_arguments, place_run
from trackbed.run_verbs import print_fields

if TYPE_CHECKING:
    from track_line.scene import SceneFile


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``line`` to its parser."""
    assert verb == "line"
    add_run_arguments(
        parser, "a scene of a line (TOML); not needed beside --beds", "line.axles=1e7",
        "the last saved state", needed=False,
    )  # fmt: skip
    parser.add_argument(
        "--beds", type=Path, metavar="PATH",
        help="folder of a sweep, or a table of cycles and a column for each sleeper: law, scatter "
        "and persistence of these beds; beside SCENE they replace its own, before --set",
    )  # fmt: skip
    parser.add_argument(
        "--law", metavar="NAME", help="settlement law that --beds are fitted by (default: the best)"
    )
    parser.set_defaults(command=run_line)


def run_line(arguments: argparse.Namespace) -> int:
    """Run a scene, or say what would run; the last line is the engineer's sentence."""
    from track_line.scene import list_doubts, load_scene, preview_run

    _refuse_no_scene(arguments)
    settings, doubts = _fit_beds(arguments) if arguments.beds else ([], [])
    if arguments.scene is None:
        return 0
    path = place_run(arguments)
    file = load_scene(arguments.scene, [*settings, *arguments.overrides])
    for doubt in list_doubts(file):
        print(f"warning: {doubt}", file=sys.stderr)
    answer = preview_run(file) if arguments.dry_run else _run(file, path, arguments, doubts)
    sentence = "" if arguments.json else answer.pop("sentence", "")
    print_fields(answer, arguments.json)
    if sentence:
        print(sentence)
    return 0


def _refuse_no_scene(arguments: argparse.Namespace) -> None:
    """Raise `UsageError` where there is no scene, and beds alone are not all that is asked; or no
    beds to fit a law to."""
    given = vars(arguments)
    names = ("run_folder", "overrides", "dry_run", "resume", "force", "no_pictures")
    if given["scene"] is None and (given["beds"] is None or any(given[name] for name in names)):
        raise UsageError(
            "no scene is given", remedy="trackbed new line my-line writes one; without a scene "
            "there are --beds, --law and --json alone",
        )  # fmt: skip
    if given["law"] and given["beds"] is None:
        raise UsageError("--law is of --beds", remedy="of a scene's own beds: --set law.name=...")


def _fit_beds(arguments: argparse.Namespace) -> tuple[list[str], list[str]]:
    """Fit measured beds and say what they know; the keys of a scene that they give, and doubts."""
    from track_line import measured

    ensemble = measured.read_beds(arguments.beds)
    fit = measured.fit_beds(ensemble, arguments.law)
    settings, doubts = measured.format_settings(fit), list(measured.list_doubts(ensemble, fit))
    if arguments.scene is None:
        figures = measured.summarise_fit(ensemble, fit)
        if arguments.json:
            print_fields(figures | {"settings": settings, "doubts": doubts}, True)
        else:
            keys = (f"--set {shlex.quote(one)}" for one in settings)
            print(measured.format_figures(figures), "", *keys, "", *doubts, sep="\n")
    else:
        print(*(f"note: {one}" for one in (*settings, *doubts)), sep="\n", file=sys.stderr)
    return settings, doubts


def _run(
    file: SceneFile, path: Path, arguments: argparse.Namespace, doubts: list[str]
) -> dict[str, Any]:  # fmt: skip
    """The whole run with its report, which says the ``doubts`` about its beds; its summary."""
    from track_line.scene import PLAN, RunFolder, run_scene, summarise_run, write_report
    from trackbed.run_files import make_manifest, open_run, write_result

    folder, manifest = RunFolder(path), make_manifest(file.tables.model_dump(mode="json"))
    manifest |= {"beds": doubts, "rolling_speed": file.rolling_speed}
    given = {"resume": arguments.resume, "force": arguments.force}
    if finished := folder.look_ahead(manifest, **given):
        return finished | {"folder": str(path)}
    kept = "the last saved state is kept"
    with open_run(folder, manifest, file.text, arguments, kept) as goes_on:
        records, error = run_scene(file, folder, resume=goes_on, progress=Progress().report)
        summary = summarise_run(file, records, error)
        write_report(folder, records, manifest, summary, draw=not arguments.no_pictures)
        write_result(path, summary)
    if doubt := describe_implausible("settlement", summary["settlement_m"], "mean settlement"):
        print(f"warning: {doubt}", file=sys.stderr)
    if error > PLAN.doubtful:
        print(f"warning: D1 errs by about {100 * error:.2g} % by its blocks", file=sys.stderr)
    return summary | {"folder": str(path)}
