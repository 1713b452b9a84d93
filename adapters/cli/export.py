"""The verb ``trackbed export``."""

import argparse
from pathlib import Path

from adapters.cli.arguments import add_json, add_run_argument, print_json
from adapters.cli.run import read_record

OPENED_BY = {
    "vtu": "ParaView; colour grains by displacement, glyph: sphere, scale: radius, factor 2",
    "ovito": "OVITO; contacts by its modifier Load trajectory",
    "csv": "a spreadsheet, pandas or R",
    "vtkhdf": "ParaView, which takes numbered files as one series, or a code that reads ON-DEM",
}
"""Format -> what opens it."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``export`` to its parser."""
    add_run_argument(parser)
    parser.add_argument(
        "--to", required=True, choices=OPENED_BY, metavar="FORMAT", help=" or ".join(OPENED_BY)
    )
    parser.add_argument(
        "--into", type=Path, metavar="FOLDER", help="default: RUN/export (or the variant's)"
    )
    parser.add_argument(
        "--every", type=int, default=1, metavar="N", help="only every Nth cycle, and the last"
    )
    parser.add_argument(
        "--variant", default="", metavar="NAME", help="a run beside it, such as control"
    )
    add_json(parser)
    parser.set_defaults(command=run_export)


def run_export(arguments: argparse.Namespace) -> int:
    """Write a run, finished or not, in the format of another tool; print what to open."""
    from adapters.report.export import export_run, read_exported_run

    into = arguments.into or arguments.run_folder / arguments.variant / "export"
    run = read_exported_run(arguments.run_folder, arguments.variant, read_record)
    files = export_run(run, arguments.to, into, arguments.every)
    if arguments.json:
        size = sum(path.stat().st_size for path in files)
        print_json({"to": arguments.to, "bytes": size, "files": [str(path) for path in files]})
    else:
        for path in [path for path in files if path.parent == into] or files[:1]:
            print(path)
        print(f"open it in {OPENED_BY[arguments.to]}")
    return 0
