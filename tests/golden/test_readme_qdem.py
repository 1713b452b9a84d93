"""What README says of QDEM against the pages and records in which it was measured."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def cells(row: str) -> list[str]:
    return [cell.strip().strip("*") for cell in row.strip().strip("|").split("|")]


def test_costs_are_those_of_the_page() -> None:
    """README's two rows are the rows of 5 % of the page's two tables, in the page's order."""
    of_page = [cells(row)[1:] for row in re.findall(r"^\| 5% \|.*$", page("qdem-cost.md"), re.M)]
    of_readme = [
        cells(row)[1:] for row in re.findall(r"^\| (?:slow bending|a 50 µs pulse).*$", README, re.M)
    ]
    assert len(of_page) == len(of_readme) == 2
    assert of_readme == of_page


def found(pattern: str, text: str) -> str:
    """The first group of a pattern that is there."""
    match = re.search(pattern, text)
    assert match is not None, pattern
    return match[1]


def test_agreement_is_that_of_the_page() -> None:
    """Tip, von Mises stress and distance from the limit of fine meshes."""
    text, plain = page("qdem-validation.md"), " ".join(README.split())
    tip = found(r"\*\*Static cantilever\*\*: tip, same mesh \| < 1e-05 \| ([\d.e+-]+) \|", text)
    stress = found(r"the same, greatest difference \| < 0.12 % \| ([\d.]+) %", text)
    stiff = found(r"\| QDEM, 488,400 elements \| [\d.]+ \| -([\d.]+) % \|", text)
    assert f"cantilever to {tip} of scikit-fem's" in plain
    assert f"stress within {stress} %" in plain
    assert f"itself is {stiff} % too stiff" in plain


def test_speeds_are_those_of_the_record() -> None:
    """README quotes the last line of the record, whose checks all hold."""
    text = (ROOT / "validation/results/qdem-speed.jsonl").read_text(encoding="utf-8")
    run = {check["name"]: check for check in json.loads(text.splitlines()[-1])["checks"]}
    plain = " ".join(README.split())
    for name, form in (
        ("speed, float64, 2 threads", "{:.0f} million elements a second"),
        ("over MKL's best, float64, 2 threads", "{:.2f} times MKL"),
        ("over scipy, float64, 2 threads", "{:.1f} times scipy"),
        ("float32 over float64, 2 threads", "float32 {:.2f} times"),
        ("2 threads over 1, float64", "two threads {:.2f} times one"),
        ("cost of viscosity, float64, 2 threads", "{:.2f} with viscosity"),
    ):
        assert form.format(run[name]["value"]) in plain, name
    assert all(check["ok"] for check in run.values())
    assert "all its bars hold" in plain
