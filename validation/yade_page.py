"""What docs/engines.md tells of YADE at the paper's size, from validation/results/yade.json."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

RECORD = Path(__file__).parent / "results" / "yade.json"

AT_END = "kinetic energy at the end of cycle "
"""Checks whose names end so, and with the cycle, share a line."""


def yade_read() -> dict[str, Any]:
    """The record of ``trackbed validate yade``."""
    content: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8"))
    return content


def rows_yade(content: dict[str, Any]) -> list[Sequence[str]]:
    """What, figure and bar of the checks; the energies at the ends of the cycles in one row."""
    rows: list[Sequence[str]] = []
    ends = [check["value"] for check in content["checks"] if AT_END in check["name"]]
    for check in content["checks"]:
        if AT_END not in check["name"]:
            figure = f"{check['value']:.4g} {check['unit']}".rstrip()
            rows.append([check["name"], figure, check["bar"]])
        elif check["name"].endswith(f"{AT_END}1"):
            figure = ", ".join(f"{1e6 * energy:.3g}" for energy in ends)
            rows.append([f"the same: {AT_END}1 to {len(ends)}", f"{figure} µJ", "> 0"])
    return rows


def share_told(content: dict[str, Any]) -> str:
    """What the adapter costs, on the soft bed and the stiff one."""

    def figures(name: str) -> list[float]:
        return [float(each["value"]) for each in content["checks"] if each["name"].endswith(name)]

    soft, stiff = figures("speed left by what the adapter adds")
    (engine,), (added,) = figures(": CPU time of YADE"), figures(": of it frames and record")
    (python,) = figures(": CPU time of Python beside YADE")
    told = "holds" if min(soft, stiff) >= 0.95 else "**is missed**"
    return (
        f"Frames and the piston's record take {added:.2f} s of a run of {engine:.1f} s, reading, "
        f"checking and waiting {python:.2f} s beside it: {soft:.3f} of YADE's speed is left on the "
        f"soft bed, {stiff:.3f} at the paper's stiffness; the bar of 0.95 {told}."
    )
