"""Figures quoted in docs/qdem-hard-cases.md against the committed record."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGE = " ".join((ROOT / "docs" / "qdem-hard-cases.md").read_text(encoding="utf-8").split())
RECORD = ROOT / "validation" / "results" / "qdem-hard-cases.json"
CHECKS: list[dict[str, Any]] = json.loads(RECORD.read_text(encoding="utf-8"))["checks"]
LARGE = "5,000,000 elements"
NUMBER = r"([-+\d.,e-]*\d)"

QUOTED: list[tuple[str, tuple[str, ...]]] = [
    (f"what it was, {NUMBER} of its longest edge", ("sliver", "altitude over longest")),
    (f"static field {NUMBER}, motion over two", ("sliver", "static field")),
    (f"motion over two periods {NUMBER}; ", ("sliver", "motion over two")),
    (f"; {NUMBER} times as many steps", ("sliver", "steps, times those")),
    (f"a step {NUMBER} times the element bound", ("sliver", "fastest element alone")),
    (f"the fastest element alone would be {NUMBER} times", ("sliver", "fastest element alone")),
    (f"static field {NUMBER}; ", ("sizes 1 to 1000", "static field")),
    (f"; {NUMBER} times fewer steps for", ("sizes 1 to 1000", "scaled to 0.2 ", "fewer steps")),
    (f"times fewer steps for {NUMBER} % of mass", ("sizes", "scaled to 0.2 ", "mass added")),
    (f"static field at most {NUMBER}", ("jump", "young", "static field")),
    (f"motion over two periods at most {NUMBER}", ("jump", "density", "motion over two")),
    (f"after a million steps at most {NUMBER} times", ("cube, 0.99 of", "greatest energy")),
    (f"the true one | after a million steps at most {NUMBER}", ("cube, 1 of", "greatest energy")),
    (f"{NUMBER} steps by the paper's law", ("1.01 of", "finger: steps")),
    (f"law, {NUMBER} by the linear one", ("1.01 of", "small: steps")),
    (f"stopped {NUMBER} steps after its volume vanished", ("inverted: steps",)),
    (f"six modes over 1000 steps to {NUMBER}", ("one element: vibration",)),
    (f"in another order | {NUMBER} |", ("parts apart: motion",)),
    (f"0 bits, or {NUMBER} where", ("left-handed, first two",)),
    (f"{NUMBER} nodes, on one thread", (LARGE, ": nodes")),
    (f"peak {NUMBER} GiB", (LARGE, "peak memory")),
    (f"{NUMBER} s for the critical step", (LARGE, "float64: critical step: time")),
    (f"{NUMBER} Mel/s in double", (LARGE, "float64", "speed")),
    (f"{NUMBER} Mel/s in single", (LARGE, "float32", "speed")),
    (f"every one of these meshes, to {NUMBER}:", ("nu ", "tip to same mesh")),
    (f"element to element, {NUMBER} times", ("nu 0.4999, five, 48", "alternating")),
]


def measured(parts: tuple[str, ...]) -> float:
    """The greatest value of the checks whose names hold all these parts."""
    found = [c["value"] for c in CHECKS if all(part in c["name"] for part in parts)]
    assert found, parts
    return float(max(found))


def same_digits(quoted: str, value: float) -> bool:
    """Is ``quoted`` the value, rounded to the digits it has?"""
    text = quoted.replace(",", "")
    mantissa, _, exponent = text.partition("e")
    last = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(float(text) - value) <= 0.501 * last


def test_all_checks_of_the_record_hold() -> None:
    assert len(CHECKS) > 180
    assert [check["name"] for check in CHECKS if not check["ok"]] == []


@pytest.mark.parametrize(("pattern", "parts"), QUOTED, ids=[parts[-1] for _, parts in QUOTED])
def test_page_quotes_the_record(pattern: str, parts: tuple[str, ...]) -> None:
    escaped = pattern.replace("|", r"\|")
    quoted = re.search(escaped, PAGE)
    assert quoted is not None, pattern
    assert same_digits(quoted[1], measured(parts))


def test_page_quotes_mass_scaling_of_the_sliver() -> None:
    for words, share in (("a quarter of the median element's", "0.25"), ("half of it", "0.5")):
        row = re.search(rf"\| {words} \| .{NUMBER} \| {NUMBER} % \| {NUMBER} % \|", PAGE)
        assert row is not None
        for quoted, part in zip(row.groups(), ("fewer", "mass added", "change"), strict=True):
            assert same_digits(quoted, measured(("sliver", f"scaled to {share} ", part)))


@pytest.mark.parametrize("poisson", ["0.3", "0.49", "0.4999"])
def test_page_quotes_the_locking(poisson: str) -> None:
    row = re.search(rf"\| {poisson} \|((?: 0\.\d+ \|){{6}})", PAGE)
    assert row is not None
    names = [
        f"nu {poisson}, {pattern}, {cells}"
        for cells in ("12 x 2 x 2", "24 x 4 x 4", "48 x 8 x 8")
        for pattern in ("kuhn", "five")
    ]
    for quoted, name in zip(re.findall(r"0\.\d+", row[1]), names, strict=True):
        assert same_digits(quoted, measured((name, "over that of quadratic")))
