"""The command ``trackbed``: names the verbs and hands each to its package, loaded only then."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from textwrap import wrap

from trackbed import __version__
from trackbed.errors import NO_ROOM, Interrupted, TrackbedError, describe_exit_codes
from trackbed.run_files import note_interrupts
from trackbed.run_verbs import choose_command

START, RUN = "adapters.cli.start", "adapters.cli.run"
VERBS = {
    "doctor": (START, "engines and libraries: versions, what is missing, how to get it"),
    "new": (START, "write a commented example scene into a folder"),
    "adopt": ("adapters.cli.adopt", "take a deck or a YADE script of your own for cycle jumps"),
    "stone": ("adapters.cli.stone", "a form for stones from a mesh, by packing spheres into it"),
    "run": (RUN, "the whole procedure of a scene: prepare, compute, jump, relax, repeat"),
    "resume": (RUN, "go on with an interrupted run"),
    "sweep": ("adapters.cli.sweep", "several seeds and values of a scene's keys, side by side"),
    "status": (RUN, "how far a run is, its settlement and speed-up"),
    "report": (RUN, "write report.html and the figures of a run"),
    "plot": ("adapters.cli.compare", "curves of runs of one kind, as plot.png in the first"),
    "compare": ("adapters.cli.compare", "two runs of one kind side by side: keys and results"),
    "export": ("adapters.cli.export", "a run as files of ParaView, OVITO, ON-DEM or CSV"),
    "fit": (
        "adapters.cli.fit",
        "fit a residual law to a run, dumps or a CSV series and extrapolate it",
    ),
    "relax": ("adapters.cli.relax", "bring the overlaps of a state back to equilibrium"),
    "qdem": ("qdem_fem.cli.run", "vibration and statics of deformable bodies, from a scene file"),
    "grains": ("qdem_fem.cli.track", "random ballast grains of a standard grading, as a file"),
    "train": ("qdem_fem.cli.track", "load of a passing train on a sleeper's rail seats, as CSV"),
    "rigid": ("rigid_lcp.cli", "rigid, sharp-edged grains with friction, from a scene file"),
    "line": ("track_line.cli", "how uneven a line becomes and when to tamp it, from a scene file"),
    "validate": ("validation.cli", "measure trackbed against a case with a known answer"),
    "cite": (START, "print what to cite, as BibTeX"),
}
"""Verb -> module whose ``register(verb, parser)`` adds the verb's arguments, and a summary."""


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Help whose lines do not break at hyphens: names of scenes and flags stay whole."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return wrap(" ".join(text.split()), width, break_on_hyphens=False)


def build_parser(verb: str | None) -> argparse.ArgumentParser:
    """The command's parser; only ``verb`` gets its arguments, so only its package is loaded."""
    parser = argparse.ArgumentParser(
        prog="trackbed",
        description="Railway ballast: settlement under load cycles, vibration, hard grains, lines.",
        epilog=describe_exit_codes(),
        formatter_class=HelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"trackbed {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", title="verbs", required=True)
    for name, (module, summary) in VERBS.items():
        verb_parser = verbs.add_parser(
            name, help=summary, description=summary, allow_abbrev=False,
            epilog=describe_exit_codes(), formatter_class=HelpFormatter,
        )  # fmt: skip
        verb_parser.add_argument(
            "--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
        )
        if name == verb:
            if name == "validate":
                find_checkout()
            import_module(module).register(name, verb_parser)
    return parser


def complete_line(line: str) -> None:
    """Answer a shell that completes a line, by argcomplete, and end: no verb runs."""
    from argcomplete import autocomplete

    verb = next((word for word in line.split() if word in VERBS), None)
    autocomplete(build_parser(verb))


def find_checkout() -> None:
    """Put the checkout that this file lies in on the path: its studies are in no wheel.

    Raises `ImportError` where trackbed is installed and there is no checkout.
    """
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    own = "pyproject.toml", "validation/cli.py"  # beside an installation it may be another project
    if not all(os.path.exists(os.path.join(root, one)) for one in own):
        raise ImportError("the studies are not in this installation", name="validation")
    if root not in sys.path:
        sys.path.insert(0, root)


def find_verb(words: Sequence[str]) -> str | None:
    """The first word that is no flag; exits with a suggestion when it is no verb."""
    verb = next((word for word in words if not word.startswith("-")), None)
    if verb is not None and verb not in VERBS:
        from difflib import get_close_matches

        near = get_close_matches(verb, VERBS, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"the verbs are {', '.join(VERBS)}"
        build_parser(None).error(f"there is no verb '{verb}'; {hint}")
    return verb


def explain_import(error: ImportError) -> str:
    """Why a package can not be imported, and what to do; empty when the fault is ours."""
    from importlib import metadata

    if error.name == "validation":
        return (
            f"validate: {error}\n  -> git clone https://github.com/trackbed/trackbed, then there "
            "./setup.sh and .venv/bin/trackbed validate"
        )
    try:
        metadata.distribution("adapters")
    except metadata.PackageNotFoundError:
        if (error.name or "").partition(".")[0] in ("", "adapters"):
            return ""
        return f"{error}\n  -> install trackbed with its dependencies: pip install -e ."
    return (
        f"{error}: the unrelated PyPI package 'adapters' is installed beside trackbed, and both "
        "have a folder adapters/\n  -> pip uninstall adapters, then reinstall trackbed; "
        "or give trackbed a virtual environment of its own"
    )


def find_interrupt(error: BaseException | None) -> BaseException | None:
    """The Ctrl-C that an error came of: what compiles or unpacks wraps it in one of its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        explained = isinstance(error, TrackbedError | OSError)
        error = error.__cause__ or (None if explained else error.__context__)
    return error


def explain_error(error: BaseException) -> tuple[str, int]:
    """What to say of an error, and the exit code."""
    error = find_interrupt(error) or error
    if isinstance(error, TrackbedError | Interrupted):
        return str(error), error.exit_code
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", 130
    if isinstance(error, ImportError) and (why := explain_import(error)):
        return why, 4
    if isinstance(error, MemoryError):
        return f"there is too little memory ({error})\n  -> ask for less, or on a larger machine", 5
    if isinstance(error, OSError):
        return str(error), 5 if error.errno in NO_ROOM else 2
    return (
        f"{type(error).__name__}: {error}\n  -> this is a bug in trackbed; run again with --debug "
        "and report the traceback",
        1,
    )


def main(words: Sequence[str] | None = None) -> int:
    """Run one verb; every outcome is an exit code and, if bad, a sentence on stderr."""
    words = sys.argv[1:] if words is None else words
    try:
        with note_interrupts():
            if "_ARGCOMPLETE" in os.environ:
                complete_line(os.environ["COMP_LINE"])
            arguments = build_parser(find_verb(words)).parse_args(words)
            code = choose_command(arguments)(arguments)
            sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader of our output went away, as in: trackbed ... | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (KeyboardInterrupt, Exception) as error:
        if "--debug" in words:
            import traceback

            traceback.print_exc()
        message, code = explain_error(error)
        print(f"trackbed: {message}", file=sys.stderr)
        return code
