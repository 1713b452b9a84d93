"""The record behind docs/rigid-integration.md: all its parts, measured one after the other.

validation/results/rigid-integration.jsonl holds a line a row; ``table`` says of what:
``order`` `rigid_integration_order`, ``trace`` and ``drift`` `rigid_integration_steps`, ``law``
`rigid_integration_collisions`, ``impact`` `rigid_integration_impacts`, ``zeno``
`rigid_integration_zeno`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from functools import partial
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import Any

from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from validation.rigid_integration_collisions import closed_form_rows, energy_rows
from validation.rigid_integration_impacts import impact_rows, impacts
from validation.rigid_integration_order import order_rows
from validation.rigid_integration_steps import Trace, drifts, traces
from validation.rigid_integration_zeno import zeno_rows

Data = dict[str, Any]
RECORD = Path(__file__).parent / "results" / "rigid-integration.jsonl"
Rows = Callable[[bool, bool], Iterable[Any]]

TABLES: dict[str, Rows] = {
    "order": order_rows,
    "trace": lambda quick, peers: traces(0.05 if quick else 0.3),
    "drift": lambda quick, peers: drifts(quick),
    "law": lambda quick, peers: chain(closed_form_rows(), energy_rows(5 if quick else 100)),
    "impact": lambda quick, peers: chain.from_iterable(
        map(partial(impact_rows, peers=peers), impacts(quick))
    ),
    "zeno": zeno_rows,
}
"""Rows of each table, by whether the run is quick, and whether peers run."""


def plain(row: Any) -> Data:
    """A row as JSON has it: what is no finite number becomes null, steps have six digits."""
    data = asdict(row)
    if isinstance(row, Trace):
        data["steps"] = [[round(at, 9), float(f"{h:.6g}"), kept] for at, h, kept in row.steps]
    for name, value in data.items():
        if isinstance(value, float) and not isfinite(value):
            data[name] = None
    return data


def record_read(path: Path = RECORD) -> list[Data]:
    """The lines of a record; none where there is no file."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def record_make(quick: bool, tables: Sequence[str] = (), path: Path = RECORD) -> None:
    """Measure, peers too, and write the record after every table; others keep their lines.

    ``tables``: those to measure, of `TABLES`; all of them if none is named.
    """
    words = ["python", "-m", "validation.rigid_integration_page", "--run"] + ["--quick"] * quick
    words += ["--only", *tables] if tables else []
    origin = provenance(words)
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    for table in tables or TABLES:
        made = [{"table": table} | plain(row) | kept for row in TABLES[table](quick, True)]
        lines = {name: [o for o in record_read(path) if o["table"] == name] for name in TABLES}
        lines[table] = made
        text = "".join(json.dumps(line) + "\n" for part in lines.values() for line in part)
        write_atomically(path, text)
