"""docs/rigid-ballast-3d.md is made from the committed record, and tells what failed."""

from __future__ import annotations

import pytest

from validation.rigid_ballast_3d import SAMPLES, STEPS, Data, Study, record_read
from validation.rigid_ballast_3d_page import PAGE, by_step, differences, page


def line(sample: int, step: float, end: float, why: str = "") -> Data:
    return {
        "sample": sample, "step": step, "stones": 10, "settlement": [0.5 * end, end],
        "contacts": 40.0, "carrying": 30.0, "sliding": 0.1, "steps": 20, "ok": not why, "why": why,
        "cpu_s": 0.4, "residual_median": 1e-9, "residual_99": 1e-8, "residual_worst": 1e-7,
        "overlap": 1e-6, "size": 0.04, "work": [2.0, 1.0], "gain": 1e-6, "machine": "m",
        "commit": "c",
    }  # fmt: skip


def test_page_is_that_of_the_record() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(record_read())


def test_record_has_every_step_of_every_sample() -> None:
    """A study that goes on may have fewer samples than it shall have, none of them in part."""
    found = {(each["sample"], each["step"]) for each in record_read()}
    last = max(sample for sample, _ in found)
    assert 3 <= last <= SAMPLES
    assert found == {(sample, step) for sample in range(1, last + 1) for step in STEPS}


def test_record_is_of_the_bed_as_it_is_now() -> None:
    assert {each["stones"] for each in record_read()} == {Study().stones}


def test_differences_are_taken_sample_by_sample() -> None:
    lines = [line(1, 1e-3, 3e-4), line(2, 1e-3, 5e-4), line(2, 5e-4, 4e-4), line(1, 5e-4, 1e-4)]
    assert differences(by_step(lines), 1e-3) == pytest.approx([2e-4, 1e-4])


def test_a_run_that_was_stopped_is_told_and_not_counted() -> None:
    lines = [
        line(1, 1e-3, 3e-4),
        line(1, 5e-4, 1e-4),
        line(3, 5e-4, 2e-4),
        line(2, 1e-3, 9.0, why="60 m/s in cycle 1"),
    ]
    text = page(lines)
    assert "* sample 2, step 1 ms: 60 m/s in cycle 1." in text
    assert "9000" not in text
