"""Sentences of docs/qdem-track.md on two frictions are those of the committed record."""

from __future__ import annotations

import json

import numpy as np

from validation.track_packings import PACKINGS


def test_sentences_about_two_frictions() -> None:
    """The higher one reduces settlement and lateral motion on every packing, but of B3."""
    record = json.loads(PACKINGS.read_text(encoding="utf-8"))
    low, high = (list(record[key].values()) for key in ("runs", "other"))
    assert {run["friction"] for run in low} == {0.577}
    assert {run["friction"] for run in high} == {1.73}
    assert [run["seed"] for run in low] == [run["seed"] for run in high] == [1, 2, 3]
    assert all(run["energy"]["relative_imbalance"] < 1e-3 for run in low + high)

    def micrometres(runs: list[dict], name: str, what: str) -> np.ndarray:
        points = [run["points"][name] for run in runs]
        if what == "behind":
            found = [point["passages"][-1]["end"] for point in points]
        elif what == "greatest":
            found = [max(p["greatest"] for p in point["passages"]) for point in points]
        else:
            found = [point["lateral_greatest"] for point in points]
        return 1e6 * np.array(found)

    assert [round(micrometres(r, "sleeper", "behind").mean()) for r in (low, high)] == [168, 2]
    assert [round(micrometres(r, "sleeper", "lateral").mean()) for r in (low, high)] == [138, 5]
    for name in ("sleeper", "B1", "B2"):
        for what in ("greatest", "lateral"):
            assert (micrometres(high, name, what) < micrometres(low, name, what)).all(), name
    assert (micrometres(high, "sleeper", "behind") < micrometres(low, "sleeper", "behind")).all()
    aside = [micrometres(runs, "B3", "lateral").mean() for runs in (low, high)]
    assert aside[1] > aside[0]
