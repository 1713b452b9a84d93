"""A validation case: its checks, how it is found by name, and the record of a run of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from math import isfinite
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from adapters.errors import UsageError
from adapters.scene_checks import did_you_mean
from validation import cases


@dataclass(frozen=True)
class Check:
    """One measured value against its bar."""

    name: str
    value: float
    bar: str
    """The bar in words and numbers, such as "<= 0.05"."""
    ok: bool
    unit: str = ""
    """SI unit of ``value`` and ``bar``; empty for a pure number."""

    @property
    def holds(self) -> bool:
        """True when the bar is met by a value that is a finite number."""
        return bool(self.ok) and isfinite(self.value)


def case_names() -> list[str]:
    """Names of the cases: the files of ``validation/cases``, with dashes."""
    return sorted(module.name.replace("_", "-") for module in iter_modules(cases.__path__))


def case_load(name: str) -> Callable[[bool], list[Check]]:
    """The function ``run(quick)`` of a case; raises `UsageError` for a name that is none."""
    if name not in case_names():
        known = did_you_mean(name, case_names())
        raise UsageError(f"there is no validation case {name}{known}")
    run: Callable[[bool], list[Check]] = import_module(
        f"validation.cases.{name.replace('-', '_')}"
    ).run
    return run


def record(name: str, checks: Sequence[Check], provenance: dict[str, Any]) -> dict[str, Any]:
    """What is written of a run of a case; a value that is no finite number becomes null."""
    rows = []
    for check in checks:
        value = float(check.value) if isfinite(check.value) else None
        rows.append(asdict(check) | {"value": value, "ok": check.holds})
    return {"case": name, "checks": rows, "provenance": provenance}


def record_write(path: Path, content: dict[str, Any]) -> None:
    """Write a record as JSON, atomically."""
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n")
    temporary.replace(path)


def checks_table(checks: Sequence[Check]) -> str:
    """The checks as text, a line each."""
    rows = [
        (
            "ok" if check.holds else "FAILS",
            check.name,
            f"{check.value:.4g} {check.unit}".rstrip(),
            f"bar {check.bar} {check.unit}".rstrip(),
        )
        for check in checks
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
