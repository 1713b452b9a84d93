"""The verb ``trackbed validate``."""

from __future__ import annotations

import argparse
from math import nan
from pathlib import Path

from adapters.errors import NotCredible, UsageError


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``validate`` to its parser."""
    parser.add_argument("case", nargs="?", metavar="CASE", help="name; left out: list the cases")
    parser.add_argument("--quick", action="store_true", help="the small form, minutes at most")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write checks and provenance")
    parser.set_defaults(command=validate_command)


def validate_command(arguments: argparse.Namespace) -> int:
    """Run a case, record and print its checks; 0 only when all of them hold."""
    from adapters.provenance import provenance
    from validation.case import Check, case_load, case_names, checks_table, record, record_write

    name, path = arguments.case, arguments.json
    if name is None:
        print("\n".join(case_names()))
        return 0
    run = case_load(name)
    if path is not None and not path.parent.is_dir():
        raise UsageError("the folder of --json does not exist", where=str(path))
    origin = provenance(["trackbed", "validate", name, *["--quick"] * arguments.quick])
    failure: Exception | None = None
    try:
        checks = run(arguments.quick)
    except Exception as error:  # a failure is a result too: it is recorded, then reported
        checks, failure = [Check("ran to its end", nan, f"no error; had: {error}", ok=False)], error
    if path is not None:
        record_write(path, record(name, checks, origin))
    if failure is not None:
        raise failure
    print(checks_table(checks))
    failed = [check.name for check in checks if not check.holds]
    if failed or not checks:
        raise NotCredible(
            f"{len(failed)} of {len(checks)} checks do not hold: {', '.join(failed)}", where=name
        )
    return 0
