"""Arguments that several verbs share, and their JSON."""

import argparse
import json
import shlex
from pathlib import Path
from typing import Any

from adapters.errors import UsageError


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``."""
    parser.add_argument("--json", action="store_true", help="print JSON on standard output")


def print_json(content: Any) -> None:
    """Print JSON on standard output; a number that is not finite becomes an error."""
    print(json.dumps(content, indent=2, allow_nan=False))


def add_run_argument(parser: argparse.ArgumentParser) -> None:
    """Add the argument RUN."""
    parser.add_argument("run_folder", metavar="RUN", type=Path, help="a run folder")


def add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """Add SCENE, ``--engine`` and ``--launcher``."""
    parser.add_argument("scene", metavar="SCENE", type=Path, help="a scene file (TOML)")
    parser.add_argument(
        "--engine", metavar="NAME",
        help="liggghts, lammps, yade or auto; short for --set engine.name=NAME",
    )  # fmt: skip
    parser.add_argument(
        "--launcher", metavar="WORDS", help='before the engine\'s command, as in "mpirun -np 2"'
    )


def list_overrides(arguments: argparse.Namespace) -> list[str]:
    """KEY=VALUE of ``--set``, ``--engine`` and ``--launcher``; the values are TOML."""
    overrides = list(arguments.overrides)
    if arguments.engine is not None:
        overrides.append(f"engine.name={json.dumps(arguments.engine)}")
    if arguments.launcher is not None:
        try:
            words = shlex.split(arguments.launcher)
        except ValueError as error:
            raise UsageError(f"--launcher can not be split into words: {error}") from None
        overrides.append(f"engine.launcher={json.dumps(words)}")
    return overrides
