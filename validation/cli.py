"""The verb ``trackbed validate``."""

from __future__ import annotations

import argparse
import os
from math import nan
from pathlib import Path

from adapters.errors import NotCredible, UsageError


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``validate`` to its parser."""
    parser.add_argument("case", nargs="?", metavar="CASE", help="name; left out: list the cases")
    parser.add_argument("--quick", action="store_true", help="the small form, minutes at most")
    parser.add_argument(
        "--json", type=Path, metavar="FILE",
        help="write checks and provenance; of a case that has a report, it beside as FILE.html",
    )  # fmt: skip
    parser.description = (
        f"{parser.description}\n\nExit code 0 when all checks hold but bars whose miss is known "
        "and documented,\ntold as missed with the reason (JSON: ok false, and why); 6 otherwise."
    )
    parser.set_defaults(command=validate_command)


def validate_command(arguments: argparse.Namespace) -> int:
    """Run a case, record and print its checks; 0 when all hold but bars that are known to be
    missed, which are reported as such."""
    from trackbed.run_files.provenance import record_provenance as provenance
    from validation.case import (
        Check,
        build_record,
        describe_case_age,
        list_cases,
        load_case,
        load_report,
        summarise_checks,
        tabulate_checks,
        write_record,
    )

    name, path = arguments.case, arguments.json
    if name is None:
        print("\n".join(list_cases()))
        return 0
    run = load_case(name)
    if path is not None and not path.parent.is_dir():
        raise UsageError("the folder of --json does not exist", where=str(path))
    origin = provenance(["trackbed", "validate", name, *["--quick"] * arguments.quick])
    failure: Exception | None = None
    try:
        checks = run(arguments.quick)
    except Exception as error:  # a failure is a result too: it is recorded, then reported
        checks, failure = [Check("ran to its end", nan, f"no error; had: {error}", ok=False)], error
    if path is not None:
        write_record(path, build_record(name, checks, origin))
    if failure is not None:
        raise failure
    print(tabulate_checks(checks))
    if age := describe_case_age(name):
        print(age)
    report, page = load_report(name), find_report_path(name, path)
    if report is not None and page is not None:
        report(page, checks, origin)
        print(f"report: {page}")
    if any(check.known for check in checks):
        print(summarise_checks(checks))
    failed = [check.name for check in checks if not (check.holds or check.known)]
    if failed or not checks:
        raise NotCredible(
            f"{len(failed)} of {len(checks)} checks do not hold: {', '.join(failed)}", where=name
        )
    return 0


def find_report_path(name: str, path: Path | None) -> Path | None:
    """Where a case's report is written: beside its JSON at ``path``; without one in the folder
    TRACKBED_VALIDATION, and nowhere where that is not set."""
    if path is not None:
        return path.with_suffix(".html")
    home = os.environ.get("TRACKBED_VALIDATION")
    return Path(home) / f"{name}.html" if home else None
