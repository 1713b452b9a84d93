"""QDEM judged by scikit-fem and closed forms: statics, vibration, energy, viscosity, rotation.

    trackbed validate qdem --quick      meshes to 18,432 elements: a minute
    trackbed validate qdem              meshes to the paper's 488,400: what the record holds, and
                                        what is missing there is computed, half an hour in all
    python -m validation.cases.qdem     the parts of the record, and the code that made them
    python -m validation.cases.qdem --redo [PART ...]     compute parts again, or those made by
                                        earlier code

The full form is made of parts; each that is done is a line of ``validation/results/qdem.jsonl``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from adapters.provenance import provenance
from validation import (
    qdem_energy,
    qdem_motion,
    qdem_protocol,
    qdem_rotation,
    qdem_slab,
    qdem_static,
    qdem_vibration,
    qdem_viscous,
    qdem_waves,
)
from validation.case import Check, checks_table
from validation.qdem_record import (
    RECORD,
    Outcome,
    checks_of,
    code_digest,
    line_of,
    line_write,
    record_lines,
    table_write,
)

QUICK: dict[str, Callable[[], list[Check]]] = {
    "rotation": qdem_rotation.quick_checks,
    "waves": qdem_waves.quick_checks,
    "energy": qdem_energy.quick_checks,
    "viscous": qdem_viscous.quick_checks,
    "slab": qdem_slab.quick_checks,
    "static": qdem_static.quick_checks,
    "vibration": qdem_vibration.quick_checks,
    "motion": qdem_motion.quick_checks,
}
FULL: dict[str, Callable[[], Outcome]] = {
    "rotation": qdem_rotation.full,
    "waves": qdem_waves.full,
    "energy": qdem_energy.full,
    "viscous": qdem_viscous.full,
    "slab": qdem_slab.full,
    "static": qdem_static.full,
    "vibration": qdem_vibration.full,
    "motion": qdem_motion.full,
    "protocol": qdem_protocol.full,
    "paper size, relaxed": qdem_static.paper_size_relaxed,
    "paper size, settled": qdem_static.paper_size_settled,
    "paper size, vibration": qdem_vibration.paper_size,
}
CODE = {name: code_digest(part.__module__) for name, part in FULL.items()}
"""Of the code as it was imported; files may change while a long part runs."""
EARLIER = " (made by earlier code)"


def run(quick: bool) -> list[Check]:
    """All checks, part after part."""
    if quick:
        return [check for part in QUICK.values() for check in part()]
    return [check for name in FULL for check in part_recorded(name)]


def part_recorded(name: str, path: Path = RECORD) -> list[Check]:
    """The checks of a part of the full form, from the record if it is there."""
    line = line_of(name, path)
    if line is None:
        return part_computed(name, path)
    checks = checks_of(line)
    if line["code"] == CODE[name]:
        return checks
    return [replace(check, name=check.name + EARLIER) for check in checks]


def part_computed(name: str, path: Path = RECORD) -> list[Check]:
    """Compute a part of the full form and write its line and tables into the record."""
    origin = provenance(["trackbed", "validate", "qdem"])
    started, wall = time.process_time(), time.time()
    outcome = FULL[name]()
    line = {
        "part": name,
        "code": CODE[name],
        "cpu_s": round(time.process_time() - started, 1),
        "wall_s": round(time.time() - wall, 1),
        "checks": [
            asdict(check) | {"value": check.value if check.value == check.value else None}
            for check in outcome.checks
        ],
        "tables": sorted(outcome.tables),
        **origin,
    }
    for title, table in outcome.tables.items():
        table_write(title, table, path)
    line_write(line, FULL, path)
    return outcome.checks


def parts_table(path: Path = RECORD) -> str:
    """The parts, a line each: checks that hold, cost, date, and by what code."""
    lines = {line["part"]: line for line in record_lines(path)}
    rows = []
    for name in FULL:
        if name not in lines:
            rows.append(f"{name:24} not computed yet")
            continue
        line = lines[name]
        checks = checks_of(line)
        held = sum(check.holds for check in checks)
        by = "this code" if line["code"] == CODE[name] else "earlier code"
        rows.append(
            f"{name:24} {held:3} of {len(checks):3} hold  {line['cpu_s']:7.1f} s CPU  "
            f"{line['started']}  by {by}, commit {line['commit'][:8]}"
        )
    return "\n".join(rows)


def main(words: Sequence[str] | None = None) -> None:
    """Show the parts of the record, or compute some of them again."""
    parser = argparse.ArgumentParser(description="The record of the validation of QDEM.")
    parser.add_argument(
        "--redo",
        nargs="*",
        metavar="PART",
        choices=list(FULL),
        help="compute these parts again; without a name, those not made by this code",
    )
    arguments = parser.parse_args(words)
    if arguments.redo is not None:
        made = {line["part"]: line["code"] for line in record_lines()}
        stale = [name for name in FULL if made.get(name) != CODE[name]]
        for name in arguments.redo or stale:
            print(f"{name}\n{checks_table(part_computed(name))}", flush=True)
    print(parts_table())


if __name__ == "__main__":
    main()
