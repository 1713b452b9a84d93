"""docs/qdem-boundaries.md is what its command makes of its record, and the record holds."""

from __future__ import annotations

from validation.parts_record import parts_read
from validation.qdem_boundaries import RECORD
from validation.qdem_boundaries_page import PAGE, ground_row, page


def test_page_is_the_records() -> None:
    """Byte for byte."""
    assert PAGE.read_text(encoding="utf-8") == page(parts_read(RECORD))


def test_record_holds_what_the_page_says() -> None:
    """Bars as derived, angles to second order, a step that dashpots leave, an end that pays."""
    parts = {name: part["rows"] for name, part in parts_read(RECORD).items()}
    for row in parts["bar"]:
        assert abs(row["absorbed"] - row["absorbed_derived"]) < 1e-9
    for row in parts["oblique"]:
        if row["cells"] >= 36:
            assert abs(row["left"] - row["derived"]) < 0.002
    assert parts["step"][0]["step"] > 0.9999 > 0.8 > parts["step"][0]["lagged"]
    for load in ("pulse", "lasting"):
        for side in (1.2, 1.8, 2.4, 3.0):
            ends = ("depth", "fixed", "free")
            depth, *others = (ground_row(parts["ground"], load, side, e)["error"] for e in ends)
            assert all(depth[k] < other[k] for other in others for k in (0, 1))
    for row in parts["cost"]:
        assert row["touching"][1] > row["touching"][0]
