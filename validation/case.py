"""A validation case: its checks, how it is found by name, and the record of a run of it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from math import isfinite
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from adapters.errors import UsageError
from validation import cases
from validation.age import describe_age
from validation.study import find_record, import_part, list_studies, read_record

UNBARRED = ("reported", "measured", "finite")
"""In place of a bar: the value is only reported."""


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
    page: str = ""
    """Page that shows the value, such as ``docs/laws.md``; empty where there is none."""
    why: str = ""
    """Why a bar that is known to be missed is, or that this is not known; else empty."""
    section: str = ""
    """Part of the case's report that it belongs to; empty where there are no parts."""

    @property
    def barred(self) -> bool:
        """False for a value that is only reported."""
        return self.bar not in UNBARRED

    @property
    def verdict(self) -> str:
        """``met``, ``missed`` where that is known, or ``FAILS``; empty where reported."""
        if not self.holds:
            return "missed" if self.known else "FAILS"
        return "met" if self.barred else ""

    @property
    def asked(self) -> str:
        """The bar with its unit behind the number; words alone where it has none."""
        bound = re.match(r"[<>=]=? ?[^\s,]*\d(?=$|[\s,]\D)|.*\d$", self.bar)
        return f"{bound[0]} {self.unit}".rstrip() + self.bar[bound.end() :] if bound else self.bar

    @property
    def known(self) -> bool:
        """True when a finite value misses the bar and `why` explains it: no failure."""
        return bool(self.why) and not self.holds and isfinite(self.value)

    @property
    def holds(self) -> bool:
        """True when the bar is met by a value that is a finite number."""
        return bool(self.ok) and isfinite(self.value)


def list_live_cases() -> dict[str, str]:
    """Modules that measure now, by name: files of ``validation/cases``."""
    names = [part.name for part in iter_modules(cases.__path__)]
    return {name.replace("_", "-"): f"validation.cases.{name}" for name in names}


def list_cases() -> list[str]:
    """Names of the studies, judged by their records, and of the cases that measure now."""
    return sorted({*list_studies(), *list_live_cases()})


def load_case(name: str) -> Callable[[bool], list[Check]]:
    """The function ``run(quick)`` of a case, or of a study its bars from the record; raises
    `UsageError` for a name that is none."""
    live = list_live_cases()
    if name in live:
        run: Callable[[bool], list[Check]] = import_module(live[name]).run
        return run
    if name in list_studies():
        return partial(judge_study, name)
    from trackbed.scene_files.reader import suggest_word  # pydantic, which no case on a GPU needs

    known = suggest_word(name, list_cases())
    raise UsageError(f"there is no validation case {name}{known}")


def judge_study(name: str, quick: bool) -> list[Check]:
    """Bars of a study from its record; there is nothing to make quicker."""
    checks: list[Check] = import_part(name, "bars").check_bars(read_record(find_record(name)))
    return checks


def describe_case_age(name: str) -> str:
    """Which parts of a study's record are older than their code; empty for what measures now."""
    return describe_age(name, read_record(find_record(name))) if name in list_studies() else ""


def load_report(name: str) -> Callable[[Path, Sequence[Check], dict[str, Any]], None] | None:
    """The function ``report_write(path, checks, provenance)`` of a case, None where it has none."""
    live = list_live_cases()
    return getattr(import_module(live[name]), "write_report", None) if name in live else None


def build_record(name: str, checks: Sequence[Check], provenance: dict[str, Any]) -> dict[str, Any]:
    """What is written of a run of a case; a value that is no finite number becomes null."""
    rows = []
    for check in checks:
        value = float(check.value) if isfinite(check.value) else None
        rows.append(asdict(check) | {"value": value, "ok": check.holds})
    return {"case": name, "checks": rows, "provenance": provenance}


def write_record(path: Path, content: dict[str, Any]) -> None:
    """Write a record as JSON, atomically."""
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n")
    temporary.replace(path)


def summarise_checks(checks: Sequence[Check]) -> str:
    """How many bars there are, how many are met, and how many known to be missed, in a sentence."""
    bars = [check for check in checks if check.barred]
    met, known = (sum(getattr(check, what) for check in bars) for what in ("holds", "known"))
    said = f"Of {len(bars)} bars {met} are met and {known} are known to be missed"
    failing = len(bars) - met - known
    return f"{said}; {failing} fail." if failing else f"{said}."


def tabulate_checks(checks: Sequence[Check]) -> str:
    """The checks as text, a line each."""
    rows = [
        (
            "ok" if check.holds else check.verdict,
            check.name,
            f"{check.value:.4g} {check.unit}".rstrip(),
            f"bar {check.asked}",
            check.why if check.known else "",
        )
        for check in checks
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
