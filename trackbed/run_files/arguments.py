"""Arguments of the verbs that run a scene from its start to its end in a folder."""

from __future__ import annotations

import argparse
from pathlib import Path

from trackbed.errors import UsageError


def add_run_arguments(
    parser: argparse.ArgumentParser, scene: str, override: str, resumed_from: str
) -> None:
    """Add SCENE and its flags; the words say what a scene is, an override, and what goes on."""
    parser.add_argument("scene", metavar="SCENE", type=Path, help=scene)
    parser.add_argument(
        "--run-folder", type=Path, metavar="FOLDER", help="default: SCENE-run beside the scene"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help=f"change a key of the scene, such as {override}; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--dry-run", action="store_true",
        help="check the scene and say what would run: steps, their length, what is left out",
    )  # fmt: skip
    parser.add_argument("--resume", action="store_true", help=f"go on from {resumed_from}")
    parser.add_argument(
        "--force", action="store_true", help="lose the run that is in the folder and start again"
    )
    parser.add_argument("--no-pictures", action="store_true", help="write the report without any")
    parser.add_argument("--json", action="store_true", help="print JSON on standard output")


def refuse_both(arguments: argparse.Namespace) -> None:
    """Raise `UsageError` for ``--resume`` beside ``--force``."""
    if arguments.resume and arguments.force:
        raise UsageError("--resume and --force exclude each other", remedy="give one of them")


def place_run(arguments: argparse.Namespace) -> Path:
    """The run's folder: the one given, or SCENE-run beside the scene."""
    scene: Path = arguments.scene
    return arguments.run_folder or scene.with_name(f"{scene.stem}-run")
