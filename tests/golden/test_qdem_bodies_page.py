"""docs/qdem-bodies.md is what its command makes of the committed record, and the record holds."""

from __future__ import annotations

import pytest

from validation.parts_record import parts_read
from validation.qdem_bodies import RECORD
from validation.qdem_bodies_page import PAGE, order, page, track_read


def test_page_is_the_records() -> None:
    """Byte for byte."""
    assert PAGE.read_text(encoding="utf-8") == page(parts_read(RECORD), track_read())


def test_record_holds_what_the_page_says() -> None:
    """Order one in 1/E, order two in the step, a prediction that bounds, a step that is cheaper."""
    parts = parts_read(RECORD)
    assert all(0.9 < order(parts["stiffness"]["rows"], cells) < 1.1 for cells in (2, 3))
    first, *_, last = parts["top"]["rows"]
    assert first["error"] / last["error"] > 0.5 * (first["step"] / last["step"]) ** 2
    assert all(row["measured"] < row["predicted"] for row in parts["advise"]["rows"])
    track = track_read()
    sleeper = track["check"]["probes"]["sleeper"]
    assert sleeper == pytest.approx(0.4, abs=0.05)
    grains = [one for name, one in track["check"]["probes"].items() if name.startswith("B")]
    assert sleeper < min(grains) < max(grains) < track["check"]["predicted"] == 1.0
    assert track["rigid"] == 0
    assert all(row["rigid_s"] < row["deformable_s"] for row in parts["cost"]["rows"])
