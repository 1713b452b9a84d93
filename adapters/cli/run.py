"""The verbs ``run``, ``resume``, ``status`` and ``report``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from adapters.cli.arguments import add_json, add_run_argument, add_scene_arguments, list_overrides
from adapters.errors import UsageError
from trackbed.run_verbs import print_fields, show_page

if TYPE_CHECKING:
    from adapters.procedure import Record

JUMP_KEYS = ("procedure.k", "procedure.h")
"""Keys that ``--tolerance`` stands for."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``verb`` to its parser."""
    if verb == "run":
        register_run(parser)
    else:
        add_run_argument(parser)
    if verb in ("run", "resume"):
        parser.add_argument(
            "--cycle-by-cycle", action="store_true",
            help="where the bed ratchets or collapses, so that no jump is allowed, or a jump and "
            "its shorter tries failed, compute cycles instead of stopping with exit code 6",
        )  # fmt: skip
    if verb == "resume":
        parser.add_argument(
            "--cycles", type=int, metavar="N", help="extend the run to N cycles in all"
        )
    elif verb == "status":
        add_json(parser)
    elif verb == "report":
        parser.add_argument("--open", action="store_true", help="show it, when there is a display")
    commands = {
        "run": run_command, "resume": run_resume, "status": run_status, "report": run_report,
    }  # fmt: skip
    parser.set_defaults(command=commands[verb])


def register_run(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``run`` alone."""
    add_scene_arguments(parser)
    parser.add_argument(
        "--run-folder", type=Path, metavar="FOLDER", help="default: run/ beside the scene"
    )
    parser.add_argument(
        "--control", action="store_true", help="also run every cycle, to know the error"
    )
    parser.add_argument(
        "--members", type=int, metavar="M",
        help="M runs from states that differ by 1e-10 m, with --control beside M full runs, to "
        "know result and error with their bands; short for --set procedure.members=M",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help="change a key of the scene, such as procedure.h=10; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--procedure", choices=("paper", "growing", "tolerance"),
        help="the procedure by name, in place of the scene's own: as in the paper, jumps that grow "
        "(the default of a scene that has none), or jumps that choose themselves",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=float, metavar="T",
        help="jumps choose themselves: error of the settlement gained in a jump over the total "
        "settlement, such as 0.02; short for --set procedure.tolerance=T, instead of k and h",
    )  # fmt: skip
    parser.add_argument(
        "--fast", action="store_true",
        help="twice the usual time step, at half of the cost (errors: docs/engines.md); short for "
        '--set engine.rayleigh_share="fast"',
    )  # fmt: skip
    parser.add_argument(
        "--cycles", type=int, metavar="N", help="short for --set procedure.total_cycles=N"
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="say what would run and about what it would cost, write the decks, and print the "
        "engine's command",
    )


def list_jump_overrides(arguments: argparse.Namespace) -> list[str]:
    """KEY=VALUE of ``--tolerance``, ``--cycles``, ``--members`` and ``--fast``; `UsageError` beside
    a k or h by hand."""
    if arguments.tolerance is not None:
        if arguments.procedure not in (None, "tolerance"):
            raise UsageError(
                f"--tolerance is the procedure tolerance, not {arguments.procedure}",
                where="--procedure", remedy="leave one of the two out",
            )  # fmt: skip
        by_hand = [one for one in arguments.overrides if one.split("=")[0].strip() in JUMP_KEYS]
        if by_hand:
            raise UsageError(
                f"--tolerance chooses k and h, and --set {by_hand[0]} gives one by hand",
                remedy="leave one of the two out",
            )
    given = {
        "procedure.tolerance": arguments.tolerance, "procedure.total_cycles": arguments.cycles,
        "engine.rayleigh_share": '"fast"' if arguments.fast else None,
        "procedure.members": arguments.members,
    }  # fmt: skip
    return [f"{key}={value}" for key, value in given.items() if value is not None]


def run_command(arguments: argparse.Namespace) -> int:
    """Run a scene from its start."""
    from adapters.decks import is_deck_scene, run_deck_scene
    from adapters.procedure import run as procedure

    named = [f"procedure.name={arguments.procedure}"] if arguments.procedure else []
    folder = arguments.run_folder or arguments.scene.parent / "run"
    overrides = named + list_overrides(arguments) + list_jump_overrides(arguments)
    if is_deck_scene(arguments.scene):
        if arguments.dry_run:
            raise UsageError(
                "the scene of a deck has no dry run", where=str(arguments.scene),
                remedy="trackbed adopt DECK --check runs two of its cycles",
            )  # fmt: skip
        run_deck_scene(arguments.scene, folder, control=arguments.control, overrides=overrides)
    else:
        procedure.run_scene(
            arguments.scene, folder, control=arguments.control, overrides=overrides,
            dry_run=arguments.dry_run, cycle_by_cycle=arguments.cycle_by_cycle,
        )  # fmt: skip
    if not arguments.dry_run:
        print_result(folder)
    return 0


def read_record(run_folder: Path) -> Record:
    """Read the run of a scene or of a deck."""
    from adapters.decks import is_deck_scene, read_deck_record
    from adapters.procedure import read_run_record

    deck = is_deck_scene(run_folder / "scene.toml")
    return (read_deck_record if deck else read_run_record)(run_folder)


def print_result(run_folder: Path) -> None:
    """Print the sentence that an engineer asks for; nothing of a run without load cycles."""
    from adapters.procedure import describe_result

    for sentence in describe_result(read_record(run_folder))[-1:]:
        print(sentence)


def run_resume(arguments: argparse.Namespace) -> int:
    """Go on with a run from its last window that passes the checks."""
    from adapters.decks import is_deck_scene, resume_deck
    from adapters.procedure import run as procedure

    given = {"cycles": arguments.cycles, "cycle_by_cycle": arguments.cycle_by_cycle}
    if not is_deck_scene(arguments.run_folder / "scene.toml"):
        procedure.resume(arguments.run_folder, **given)
    elif any(given.values()):
        raise UsageError("the run of a deck is as long as its scene says", remedy="resume alone")
    else:
        resume_deck(arguments.run_folder)
    print_result(arguments.run_folder)
    return 0


def run_status(arguments: argparse.Namespace) -> int:
    """Print how far a run is, and in sentences what came out."""
    from dataclasses import asdict

    from adapters.procedure import describe_result, judge_progress, make_plain

    record = read_record(arguments.run_folder)
    content = make_plain(asdict(judge_progress(record)))
    if not arguments.json:
        del content["result"]  # the sentences say it
    print_fields(content, arguments.json)
    if not arguments.json:
        print("", *describe_result(record), sep="\n")
    return 0


def run_report(arguments: argparse.Namespace) -> int:
    """Write report.html and the figures; print the path and the result."""
    from adapters.decks import is_deck_scene
    from adapters.report import write_brief_report, write_report

    folder = arguments.run_folder
    brief = is_deck_scene(folder / "scene.toml")
    record = read_record(folder)
    page = write_brief_report(record) if brief else write_report(folder, record)
    if record.damaged:
        print(f"warning: not as the run left it: {', '.join(record.damaged)}", file=sys.stderr)
    show_page(page, arguments.open)
    print_result(arguments.run_folder)
    return 0
