"""docs/jump-history.md is what the ensemble's record says, and its sentences hold in it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from adapters.jump_schedule import jump_lengths
from adapters.state import FloatArray
from validation.jump_forecasts import (
    WAYS,
    curves_of,
    jumped_error,
    way_history,
    way_nothing,
    way_one_slope,
    way_window,
)
from validation.jump_history_layers import BETWEEN, LAYERS, compacted
from validation.jump_history_page import PAGE, Forecasts, page, study
from validation.jump_history_schedules import SCHEDULED, SCHEDULES
from validation.settlement_ensemble import CONFINED
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import HEALING
from validation.settlement_rivals_reading import rms


@pytest.fixture(scope="module")
def found() -> list[Forecasts]:
    return study(EnsembleRecord())


def errors(
    found: list[Forecasts], name: str, kind: str, jumps: int, last: int, moved: bool = False
) -> FloatArray:
    """Of a way in a case."""
    key = (name, kind, jumps, last, moved)
    (mine,) = (f.error for f in found if (f.way, f.kind.name, f.jumps, f.last, f.moved) == key)
    return mine


def test_page_is_made_from_the_record(found: list[Forecasts]) -> None:
    """Made again, the page is the one that ships."""
    assert page(found, EnsembleRecord()) == PAGE.read_text(encoding="utf-8")
    assert PAGE.with_suffix(".png").exists()


def test_a_logarithm_is_met_by_every_way_but_nothing() -> None:
    """u = a ln N: no error; with nothing, all that the jumps gained."""
    cycle = np.arange(501.0)
    curve = 1e-4 * np.log(np.maximum(cycle, 1))
    for way in (way_window, way_one_slope, way_history):
        assert abs(jumped_error(curve, 100, [165, 165], way)) < 1e-9
    gained = curve[285] - curve[120] + curve[475] - curve[310]
    assert jumped_error(curve, 100, [165, 165], way_nothing) == pytest.approx(-gained)


def test_sentences_of_the_page(found: list[Forecasts]) -> None:
    """Long jumps of the coarse bed: half the last window's error, bias at most a tenth; one slope
    of all cycles scatters least and settles too little on each; on the quiet bed history is as
    good as the last window within 4 %, and twice as good where a moved bed settles more."""
    for jumps in (2, 5, 10, 20):
        of = {way: errors(found, way, "coarse", jumps, 2800) for way in WAYS}
        assert abs(of["history"].mean()) < 0.1
        assert rms(of["history"]) < (0.5 if jumps < 20 else 0.8) * rms(of["log, last window"])
        assert rms(of["history"]) < rms(of["nothing"])
        assert of["one slope of all cycles"].std() < min(
            of[way].std() for way in ("history", "log, last window")
        )
    for one in found:
        if one.way == "one slope of all cycles" and not one.moved:
            assert one.error.mean() < 0
        if one.way == "log, last window":
            history = errors(found, "history", one.kind.name, one.jumps, one.last, one.moved)
            if one.moved:
                assert rms(one.error) > 1.5 * rms(history)
            elif one.kind.name == "confined":
                assert rms(history) < rms(one.error) + 0.04


def test_sentences_about_layers() -> None:
    """Paper scale: layers 2 to 4 of 6 take less than 2/3 of a uniform strain's, the piston sinks by
    more than twice as much; the coarse bed's piston by no more than a half further."""
    even = (2 * np.arange(LAYERS) + 1) / LAYERS
    for case in BETWEEN:
        found = compacted(*case, EnsembleRecord())
        assert found.layers.argmax() == LAYERS - 1
        if found.kind == CONFINED:
            assert (found.layers[1:4] < even[1:4] / 1.5).all()
            assert found.ratio.mean() > 4
        else:
            assert 2 < found.ratio.mean() < 3


def test_sentences_about_growing_jumps() -> None:
    """Paper scale: growing jumps err no more than equal ones, on moved beds by a third to two
    thirds as much; coarse: neither is better, by the median of all schedules."""
    record, ratios = EnsembleRecord(), dict[str, list[float]]()
    for kind, last in SCHEDULED:
        curves = curves_of(kind, last, record)
        for (jumps, window), moved in product(SCHEDULES, (False, True)):
            one, other = (
                rms(np.array([
                    jumped_error(curve, kind.k_i, lengths, way_history, moved, window)
                    for curve in curves
                ]))
                for growing in (False, True)
                for lengths in [jump_lengths(jumps, last, kind.k_i, window, HEALING, growing)]
            )  # fmt: skip
            ratios.setdefault(f"{kind.name}{', moved' if moved else ''}", []).append(other / one)
    assert max(ratios["confined"]) < 1.05
    assert 0.25 < min(ratios["confined, moved"]) < max(ratios["confined, moved"]) < 0.67
    coarse = [*ratios["coarse"], *ratios["coarse, moved"]]
    assert min(coarse) < 1 < max(coarse)
    assert 0.85 < np.median(coarse) < 1.15
