"""docs/jump-history.md is what the ensemble's record says, and its sentences hold in it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from adapters.jump_schedule import jump_lengths
from adapters.state import FloatArray
from validation.jump_forecasts import (
    FIRST_CYCLE,
    KAPPA,
    WAYS,
    curves_of,
    jumped_error,
    way_history,
    way_nothing,
    way_one_slope,
    way_window,
)
from validation.jump_history_behind import (
    LAW_STILL,
    PAPER_SCALE,
    STILL_COARSE,
    TOLD,
    TOLERANCE,
    Behind,
    first_share,
    later_share,
    mean_first,
    way_jumps,
    with_error,
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


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
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


def test_sentences_about_cycles_behind_jumps() -> None:
    """Paper scale, by the law: more in the first cycle, less than the curves' trial, and a kappa
    within two errors of that; by history with profile next to nothing of both.  Nothing moved: the
    coarse bed settles more in the first cycle all the same, that at paper scale does not."""
    law, profile = (way_jumps(*TOLD[name]) for name in ("LAW", "PROFILE"))
    first, first_error = with_error(law, first_share)
    kappa, kappa_error = with_error(law, later_share)
    assert 3 * first_error < first < FIRST_CYCLE
    assert 3 * kappa_error < kappa < KAPPA + 2 * kappa_error
    for share in (first_share, later_share):
        assert abs(share(profile)) < 0.03 < share(law)
    assert len(profile) == 60
    assert len({one.run for one in profile}) == 12
    coarse, paper = way_jumps("coarse", STILL_COARSE), way_jumps(PAPER_SCALE, LAW_STILL)
    before = np.mean([one.before.mean() for one in coarse])
    assert mean_first(coarse) > 3 * before
    tolerance = way_jumps("coarse", TOLERANCE)
    assert (
        0
        < first_share(tolerance)
        < 0.15
        < sum(t.more[0] for t in tolerance) / sum(t.moved for t in tolerance)
    )
    assert mean_first(paper) < np.mean([one.before.mean() for one in paper])


def test_a_bed_made_to_settle_more_is_read_so() -> None:
    """u = a ln N on both sides of a jump, .2 G more in the first cycle, .1 G / n in the n-th."""
    a, moved = 2e-5, 1e-5
    n = np.arange(1.0, 11.0)
    before = a / (100 - 9 + n - 1)
    after = a / (300 + n) + 0.1 * moved / n
    after[0] = a / 301 + 0.2 * moved
    jump = Behind("", "", 100, 300, moved, before, after)
    assert first_share([jump]) == pytest.approx(0.2, abs=1e-3)
    assert later_share([jump]) == pytest.approx(0.1, abs=1e-3)
    assert first_share([replace(jump, unmoved=0.15 * moved)]) == pytest.approx(0.05, abs=1e-3)


def test_an_error_counts_packings() -> None:
    """Shares 0 and .2 of two packings: .1, and the standard error of two readings; more runs of
    the same tell no more."""
    a, n = 2e-5, np.arange(1.0, 11.0)
    jumps = []
    for run, packing in product(range(3), range(2)):
        after = a / (300 + n)
        after[0] += 0.2 * packing * 1e-5
        name = f"{packing}-{run}"
        jumps.append(Behind(name, str(packing), 100, 300, 1e-5, a / (90 + n), after))
    share, error = with_error(jumps, first_share)
    assert (share, error) == pytest.approx((0.1, 0.1), abs=1e-3)
