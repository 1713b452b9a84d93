"""Run the hard cases of the settlement procedure:

    python -m validation.settlement_hard_runs --work FOLDER [--only NAME ...] [--fresh]

Each is one call of ``trackbed run`` (or two), about ten CPU seconds, and a line of
``validation/results/settlement-hard-cases.jsonl``; a second call goes on where the record ends.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from adapters.provenance import commit, machine
from adapters.run_folder import write_atomically
from scenes import scene_path
from validation.case import Check
from validation.settlement_hard_beds import bed_prepare
from validation.settlement_hard_checks import Ended, checks_of
from validation.settlement_hard_scenes import CASES, DEMO, HardCase, case_named

ROOT = Path(__file__).parents[1]
RECORD = Path(__file__).parent / "results" / "settlement-hard-cases.jsonl"

Row = dict[str, Any]


def record_read(path: Path = RECORD) -> list[Row]:
    """Rows of the record; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def case_run(case: HardCase, folder: Path) -> Row:
    """Run a case as a user does, in an empty ``folder``, and check how it ended."""
    before = children_cpu_s()
    if case.bed:
        bed_prepare(case.bed, scene_path(DEMO), case.overrides, folder)
    done = called(folder, case.overrides)
    kept = None
    if case.then and done.returncode == 0:
        table = (folder / "settlement.csv").read_bytes()
        done = called(folder, [*case.overrides, *case.then])
        kept = (folder / "settlement.csv").read_bytes() == table
    cpu_s = children_cpu_s() - before
    reason = said(done.stderr, folder)
    row: Row = {
        "name": case.name,
        "code": done.returncode,
        "says": reason,
        "cpu_s": round(cpu_s, 1),
    }
    ended = Ended(case.scene(), folder) if done.returncode == 0 else None
    row |= judged(case, row, ended)
    if kept is not None:
        check = Check("the run before is as it was", float(kept), "= 1", kept)
        row["checks"].append(told(check))
    return row


def called(folder: Path, overrides: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """One call of ``trackbed run`` on the demo's scene with ``overrides``."""
    words = [word for setting in overrides for word in ("--set", setting)]
    command = [sys.executable, "-m", "trackbed", "run", str(scene_path(DEMO))]
    return subprocess.run(
        [*command, "--run-folder", str(folder), *words],
        capture_output=True,
        text=True,
        errors="replace",
        cwd=ROOT,
    )


def told(check: Check) -> Row:
    """A check as the record keeps it."""
    return asdict(check) | {"value": float(f"{check.value:.5g}"), "ok": check.holds}


def judged(case: HardCase, row: Row, ended: Ended | None) -> Row:
    """Checks of a case that ended, or of its refusal."""
    expected = f"= {case.code}"
    checks = [Check("exit code", float(row["code"]), expected, row["code"] == case.code)]
    figures: Row = {}
    if ended is None:
        there = bool(case.says) and case.says in row["says"]
        checks.append(Check("the reason is given", float(there), "= 1", there))
    else:
        checks += checks_of(ended, case.checks)
        figures = ended.figures | {
            "settlement": [float(f"{value:.5g}") for value in ended.settlement],
            "cycle": [row["cycle"] for row in ended.rows],
            "coordination": [round(row["coordination_number"], 4) for row in ended.rows],
        }
    return {"figures": figures, "checks": [told(check) for check in checks]}


def said(errors: str, folder: Path) -> str:
    """The error that ``trackbed`` printed, without warnings and paths of this machine."""
    start = errors.find("trackbed: ")
    if start < 0:
        return ""
    text = " ".join(errors[start:].split()).removeprefix("trackbed: ")
    return text.replace(str(folder), "RUN").replace(str(scene_path(DEMO)), f"{DEMO}.toml")


def children_cpu_s() -> float:
    """CPU time of this process's finished children, theirs included [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def go_on(cases: Sequence[HardCase], work: Path, path: Path = RECORD) -> None:
    """Run every case that the record lacks; the record keeps the order of the cases."""
    rows = {row["name"]: row for row in record_read(path)}
    origin = {"commit": commit()[:7], "machine": machine()}
    for case in cases:
        if case.name in rows:
            continue
        folder = work / case.name
        shutil.rmtree(folder, ignore_errors=True)
        row = case_run(case, folder) | origin
        rows[case.name] = row
        known = [rows[each.name] for each in CASES if each.name in rows]
        write_atomically(path, "".join(json.dumps(each) + "\n" for each in known))
        failing = [check["name"] for check in row["checks"] if not check["ok"]]
        print(
            f"{case.name}: code {row['code']}, {row['cpu_s']} CPU s", *failing, sep="; ", flush=True
        )


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and go on."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for the runs")
    parser.add_argument("--only", nargs="+", default=[case.name for case in CASES])
    parser.add_argument("--fresh", action="store_true", help="run the named cases again")
    arguments = parser.parse_args(words)
    cases = [case_named(name) for name in arguments.only]
    arguments.work.mkdir(parents=True, exist_ok=True)
    if arguments.fresh:
        kept = [row for row in record_read() if row["name"] not in arguments.only]
        write_atomically(RECORD, "".join(json.dumps(row) + "\n" for row in kept))
    go_on(cases, arguments.work)


if __name__ == "__main__":
    main()
