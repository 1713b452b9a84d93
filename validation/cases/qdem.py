"""QDEM judged by scikit-fem and closed forms: statics, vibration, energy, viscosity, rotation.

    trackbed validate qdem            meshes to the paper's 488,400 elements: about an hour
    trackbed validate qdem --quick    2,304 elements and less: under three minutes

The full form is made of parts; each part that is done is a line of
``validation/results/qdem.jsonl`` and is not computed again by the same code.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation import (
    qdem_energy,
    qdem_rotation,
    qdem_static,
    qdem_vibration,
    qdem_viscous,
    qdem_waves,
)
from validation.case import Check

ROOT = Path(__file__).parents[2]
RECORD = ROOT / "validation" / "results" / "qdem.jsonl"
Part = Callable[[], list[Check]]

QUICK: dict[str, Part] = {
    "rotation": qdem_rotation.quick_checks,
    "waves": qdem_waves.quick_checks,
    "energy": qdem_energy.quick_checks,
    "viscous": qdem_viscous.quick_checks,
    "static": qdem_static.quick_checks,
    "vibration": qdem_vibration.quick_checks,
}
FULL: dict[str, Part] = {
    "rotation": qdem_rotation.full_checks,
    "waves": qdem_waves.full_checks,
    "energy": qdem_energy.full_checks,
    "viscous": qdem_viscous.full_checks,
    "static": qdem_static.full_checks,
    "vibration": qdem_vibration.full_checks,
    "paper size, relaxed": qdem_static.paper_size_relaxed_checks,
    "paper size, settled": qdem_static.paper_size_settled_checks,
    "paper size, vibration": qdem_vibration.paper_size_checks,
}


def run(quick: bool) -> list[Check]:
    """All checks, part after part."""
    if quick:
        return [check for part in QUICK.values() for check in part()]
    return [check for name in FULL for check in part_recorded(name)]


def part_recorded(name: str, path: Path = RECORD) -> list[Check]:
    """The checks of a part of the full form, from the record if this code made it."""
    for line in record_lines(path):
        if line["part"] == name and line["code"] == CODE:
            return [Check(**check) for check in line["checks"]]
    started, wall = time.process_time(), time.time()
    checks = FULL[name]()
    line = {
        "part": name,
        "code": CODE,
        "when": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "cpu_s": round(time.process_time() - started, 1),
        "wall_s": round(time.time() - wall, 1),
        "checks": [asdict(check) for check in checks],
    }
    others = [other for other in record_lines(path) if other["part"] != name]
    text = "".join(json.dumps(each) + "\n" for each in [*others, line])
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)
    return checks


def record_lines(path: Path = RECORD) -> list[dict[str, Any]]:
    """The parts recorded so far."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def code_digest() -> str:
    """Digest of what the figures depend on: QDEM and its judge."""
    files = [*(ROOT / "qdem_fem").glob("*.py"), *(ROOT / "validation").glob("qdem_*.py")]
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


CODE = code_digest()
"""Of the code as it was imported; files may change while a long part runs."""
