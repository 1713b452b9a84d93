"""Make docs/settlement-far.md and its picture: ``python -m validation.settlement_far_page``.

The prediction of a law with its band, far beyond the cycles that it was fitted to: tested on full
runs of the ensemble, and made to 1e6 cycles where nothing can test it.  Beside it jumps that leave
a bed behind, from the record of the study ``far``.  Seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.fit_auto import Outlook, outlook
from adapters.fit_refusal import refusals
from adapters.laws import law_named
from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.jump_forecasts import curves_of
from validation.page_text import page_filled, table
from validation.settlement_bars import (
    BARS_CONTINUITY,
    settled_more,
    sides_compared,
    table_bars,
)
from validation.settlement_ensemble import COARSE, CONFINED, Kind
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_far_jumps import (
    STUDY,
    table_forecasts,
    table_jumps,
    table_noise,
)
from validation.settlement_far_room import (
    REARRANGED,
    short_of,
    table_behind,
    table_changed,
    table_parting,
    table_room,
)
from validation.settlement_rivals import BLOCK, FIRST_WINDOW, Row
from validation.settlement_rivals_reading import finished
from validation.settlement_rivals_runs import record_read
from validation.student import interval

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "settlement-far.md"
CASES: tuple[tuple[Kind, int, int], ...] = (
    (COARSE, 100, 1000),
    (COARSE, 200, 2000),
    (COARSE, 1000, 10_000),
    (COARSE, 200, 10_000),
    (COARSE, 500, 10_000),
    (COARSE, 2000, 10_000),
    (CONFINED, 50, 500),
    (CONFINED, 100, 500),
)
"""Ensemble, last cycle fitted, cycle predicted."""
COMPUTED, FAR = 2000, 1_000_000
"""The prediction that no run can test."""


@dataclass(frozen=True, eq=False)
class Foretold:
    """Predictions of r runs at one cycle, settlement since the rain in metres."""

    kind: Kind
    fitted: int
    to: int
    truth: FloatArray
    """Mean over the last `BLOCK` cycles, as a soft bed springs at a cycle's end, shape (r,)."""
    outlook: Outlook
    logarithm: FloatArray
    """By the logarithm of all cycles fitted, shape (r,)."""

    def error(self, prediction: FloatArray) -> FloatArray:
        """Of each run, over what it settles, shape (r,)."""
        return prediction / self.truth - 1

    @property
    def trusted(self) -> FloatArray:
        """1 where a prediction is not refused, else 0: no band holds there; (r,)."""
        return np.array([refusal is None for refusal in refusals(self.outlook)], float)

    @property
    def covered(self) -> FloatArray:
        """1 where the band has the truth, else 0, shape (r,)."""
        found = (self.outlook.low <= self.truth) & (self.truth <= self.outlook.high)
        return found.astype(float)


def foretold(kind: Kind, fitted: int, to: int, record: EnsembleRecord) -> Foretold:
    """Predictions for every run that has come to cycle ``to``, from its first ``fitted``."""
    curves = np.array(curves_of(kind, to, record)).T
    cycle, path = np.arange(1.0, fitted + 1), curves[1 : fitted + 1]
    law = law_named("log")
    logarithm = law.value(law.fit(cycle, path), np.array([float(to)]))[0]
    truth = curves[to - BLOCK + 1 : to + 1].mean(axis=0)
    return Foretold(kind, fitted, to, truth, outlook(cycle, path, to), logarithm)


def table_tests(found: Sequence[Foretold]) -> str:
    """A line a case."""
    lines = []
    for one in found:
        by_laws, by_log = one.error(one.outlook.prediction), one.error(one.logarithm)
        width = (one.outlook.high - one.outlook.low) / 2 / one.truth
        trusted = one.trusted.astype(bool)
        lines.append(
            [
                f"{one.kind.name}, {one.fitted:,} to {one.to:,}",
                str(len(one.truth)),
                f"{one.truth.mean() * 1e6:,.0f}",
                f"{100 * np.median(np.abs(by_log)):.0f}, {100 * np.abs(by_log).max():.0f}",
                f"{100 * np.median(np.abs(by_laws)):.0f}, {100 * np.abs(by_laws).max():,.0f}",
                f"{100 * np.median(width):.0f}",
                f"{int(one.covered.sum())} of {len(one.truth)}",
                f"{int(one.covered[trusted].sum())} of {int(trusted.sum())}",
            ]
        )
    return table(
        ["from the first cycles", "runs", "settlement, µm", "log: error, %", "auto: error, %",
         "band, ± %", "band has it", "where it may be fitted"],
        lines,
    )  # fmt: skip


def outlook_far(record: EnsembleRecord) -> tuple[FloatArray, Outlook]:
    """Settlement [m] at `COMPUTED` of every coarse run and, last, of their mean, shape (r + 1,),
    and what is foretold of them at `FAR`."""
    curves = np.array(curves_of(COARSE, COMPUTED, record)).T
    every = np.column_stack([curves, curves.mean(axis=1)])
    seen = outlook(np.arange(1.0, COMPUTED + 1), every[1 : COMPUTED + 1], FAR)
    return every[COMPUTED], seen


def table_far(record: EnsembleRecord) -> str:
    """Every coarse run, and their mean, at `FAR` from `COMPUTED`."""
    known, seen = outlook_far(record)
    names = [*(str(n) for n in range(1, len(known))), "mean of all"]
    micro = (1e6 * np.array([known, seen.low, seen.prediction, seen.high])).T
    lines = [
        [name, *(f"{value:,.0f}" for value in row), refusal.regime if refusal else regime.name]
        for name, row, regime, refusal in zip(
            names, micro, seen.regime, refusals(seen), strict=True
        )
    ]
    head = ["run", f"at {COMPUTED:,}, µm", "band from, µm", "prediction, µm", "to, µm", "regime"]
    return table(head, lines)


def continuity(rows: Sequence[Row], record: EnsembleRecord) -> dict[str, str]:
    """Whether beds go on behind jumps, a line a way, and the least and greatest share of each kind
    of figure over the ways; ``rows`` of the study `STUDY`."""
    compared, last = sides_compared(rows, STUDY.kind, record), STUDY.last
    names = [one.name for one in STUDY.methods if finished(rows, one.name, last)]
    shares = {
        bar.words: [bar.value(compared, name, last) for name in names] for bar in BARS_CONTINUITY
    }
    state = shares["coordination goes on"] + shares["stiffness goes on"]
    stays, rate = shares["rate stays"], shares["rate goes on"]
    ratios = [
        (side["last"] - side["first"]) / method.window
        for method in STUDY.methods
        for row in finished(rows, method.name, last)
        for side in row["sides"]
    ]
    return {
        "CONTINUITY": table_bars(compared, names, last, BARS_CONTINUITY),
        "STATE_GOES_ON": f"{min(state):.0f}",
        "RATE_STAYS": f"{min(stays):.0f} to {max(stays):.0f}",
        "RATE_GOES_ON": f"{min(rate):.0f} to {max(rate):.0f}",
        "LONGEST": f"{max(ratios):.0f}",
        **springing(compared),
    }


def springing(compared: Sequence[Row]) -> dict[str, str]:
    """What beds settle more than full runs in the first cycle behind a jump, and in the next nine
    [um]: the way that is judged, and with nothing moved; `sides_compared` has been called."""
    told = {}
    (still,) = (one.name for one in STUDY.methods if one.name.endswith("nothing moved"))
    for mark, name in (("MOVED", REARRANGED[0]), ("STILL", still)):
        more = 1e6 * settled_more(compared, name, STUDY.last)
        for part, values in zip(("FIRST", "NEXT"), more.T, strict=True):
            mean, half = interval(values)
            told[f"{mark}_{part}"] = f"{mean:+.0f} ± {half:.0f}"
    return told


def draw(found: Sequence[Foretold], target: Path) -> None:
    """Predictions with their bands against what the runs settled, a panel a case."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = [one for one in found if one.kind == COARSE]
    figure, axes = plt.subplots(
        1, len(shown), figsize=(2.6 * len(shown), 3.4), layout="constrained", sharey=True
    )
    for axis, one in zip(axes, shown, strict=True):
        micro = 1e6 * np.array([one.truth, one.outlook.low, one.outlook.high])
        for colour, which in (("#0072B2", one.trusted == 1), ("#D55E00", one.trusted == 0)):
            axis.vlines(*micro[:, which], color=colour, lw=3, alpha=0.4)
            axis.plot(micro[0, which], 1e6 * one.outlook.prediction[which], "o", color=colour, ms=4)
        axis.plot(micro[0], 1e6 * one.logarithm, "k_", ms=7)
        ends = [micro[0].min(), micro[0].max()]
        axis.plot(ends, ends, "0.6", lw=1, zorder=0)
        axis.set(title=f"{one.fitted:,} to {one.to:,}", xlabel="settled [µm]", yscale="log")
    ticks = [200, 500, 1000, 2000, 5000]
    axes[0].set(ylabel="predicted [µm]", ylim=(150, 8000), yticks=ticks)
    axes[0].set_yticklabels([f"{tick:,}" for tick in ticks])
    axes[0].minorticks_off()
    figure.savefig(target, dpi=80)
    plt.close(figure)


def study(record: EnsembleRecord) -> list[Foretold]:
    """All cases."""
    return [foretold(*case, record) for case in CASES]


def page(found: Sequence[Foretold], record: EnsembleRecord) -> str:
    """The page of a study."""
    coarse = np.concatenate([one.covered for one in found if one.kind == COARSE])
    parts = {"TESTS": table_tests(found), "FAR": table_far(record), "BLOCK": str(BLOCK)}
    parts["COMPUTED_TEXT"] = f"{COMPUTED:,}"
    rows = record_read(STUDY.record)
    parts |= {
        "JUMPS": table_jumps(rows),
        "SHORT": short_of(rows),
        "ROOM": table_room(rows),
        "CHANGED": table_changed(rows),
        "BEHIND": table_behind(rows),
        "PARTING": table_parting(record),
        **continuity(rows, record),
        "K": str(FIRST_WINDOW),
    }
    parts |= {"NOISE": table_noise(record), "FORECASTS": table_forecasts(record)}
    parts["RUNS"] = str(len(curves_of(COARSE, COARSE.last, record)))
    parts["COVERED"] = f"{int(coarse.sum())} of {len(coarse)}"
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    record = EnsembleRecord()
    found = study(record)
    write_atomically(PAGE, page(found, record))
    draw(found, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
