"""Make docs/jump-history.md and its picture: ``python -m validation.jump_history_page``.

Jumps on the curves of the reference ensemble, where every cycle is known: what each way to forecast
the settlement of a jump errs by, with no bed, no relaxation and no engine.  Seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from adapters import jump_slopes
from adapters.jump_history import SEATING, Jumped, asked_gain
from adapters.jump_rates import Stretch
from adapters.laws import law_named
from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.jump_history_layers import table_layers
from validation.page_text import page_filled, table
from validation.settlement_ensemble import COARSE, CONFINED, Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import FIRST_WINDOW, HEALING, jump_length
from validation.settlement_rivals_reading import rms
from validation.settlement_rivals_reference import columns_by_cycle

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "jump-history.md"
CASES: tuple[tuple[Kind, int, tuple[int, ...]], ...] = (
    (COARSE, 500, (2, 5, 10)),
    (COARSE, 2800, (2, 5, 10, 20)),
    (CONFINED, 500, (2, 5, 10)),
)
"""Ensemble, last cycle, numbers of equal jumps."""
FIRST_CYCLE, KAPPA = 0.15, 0.1
"""What a moved bed was made to settle more by, over what it was moved by: in the first cycle behind
the jump, and times 1 / n in each later one."""

CHOICES: dict[str, dict[str, float]] = {
    "as chosen": {},
    "kappa's scale / 2": {"RESEATING": jump_slopes.RESEATING / 2},
    "x 2": {"RESEATING": jump_slopes.RESEATING * 2},
    "drift / 2": {"DRIFT": jump_slopes.DRIFT / 2},
    "drift x 2": {"DRIFT": jump_slopes.DRIFT * 2},
}
"""What is changed of `adapters.jump_slopes`, one at a time, to see what the choice is worth,"""
CHOICES_JUMPS = 5
"""with so many jumps."""

Way = Callable[[Sequence[Stretch], int, Sequence[Jumped]], float]
"""Settlement [m] over a jump of h cycles behind the last of the stretches that were computed, and
the jumps between them."""


def way_nothing(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """The null hypothesis."""
    return 0.0


def way_window(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """The logarithm fitted to the last window, as the procedure does with every grain."""
    law, computed = law_named("log"), known[-1]
    last = computed.part(max(len(computed.gain) - FIRST_WINDOW, 0), len(computed.gain))
    cycle = last.first_cycle + np.arange(len(last.gain) + 1.0)
    path = np.append(0.0, np.cumsum(last.gain))
    return float(law.increment(law.fit(cycle, path), cycle[-1], cycle[-1] + h))


def way_one_slope(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """One slope du / d ln N for all cycles computed."""
    span = sum(np.log(one.last_cycle / one.first_cycle) for one in known)
    return float(sum(one.gain.sum() for one in known) / span * np.log1p(h / known[-1].last_cycle))


def way_history(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """`adapters.jump_history`."""
    return asked_gain(known, h, jumps)


WAYS: dict[str, Way] = {
    "nothing": way_nothing,
    "log, last window": way_window,
    "one slope of all cycles": way_one_slope,
    "history": way_history,
}


@dataclass(frozen=True, eq=False)
class Forecasts:
    """Errors of a way over all runs of an ensemble."""

    kind: Kind
    last: int
    jumps: int
    way: str
    moved: bool
    """Whether the bed settles more behind a jump, as a moved one does."""
    error: FloatArray
    """Settlement by the jumps less that of the run, over the mean of all runs, shape (r,)."""

    @property
    def computed(self) -> float:
        """Share of the cycles behind k_i that is computed."""
        cycles = FIRST_WINDOW + self.jumps * (HEALING + FIRST_WINDOW)
        return cycles / (self.last - self.kind.k_i)


def stretch(curve: FloatArray, first: int, last: int) -> Stretch:
    """Cycles behind ``first`` to ``last`` of a settlement ``curve`` [m] by cycle, 0 first."""
    gain = np.diff(curve[first : last + 1])
    return Stretch(first, gain, np.zeros(len(gain)), np.zeros(len(gain)))


def jumped_error(
    curve: FloatArray, k_i: int, lengths: Sequence[int], way: Way, moved: bool = False
) -> float:
    """Settlement by jumps of ``lengths`` h less that of the ``curve`` [m].

    Windows and healing are its own; where the bed is ``moved`` they settle more by `FIRST_CYCLE`
    and `KAPPA`.
    """
    end = k_i + FIRST_WINDOW
    known = [stretch(curve, round(SEATING * k_i), k_i), stretch(curve, k_i, end)]
    since = np.arange(1, HEALING + FIRST_WINDOW + 1)
    more = moved * np.where(since == 1, FIRST_CYCLE, KAPPA / since)
    settled, made = float(curve[end]), list[Jumped]()
    for h in lengths:
        gain, before, behind = way(known, h, made), end, end + h
        end = behind + len(since)
        path = curve[behind : end + 1] + gain * np.append(0.0, np.cumsum(more))
        window = stretch(path, 0, len(since))
        known.append(replace(window.part(1, len(since)), first_cycle=behind + 1))
        ends = settled + np.array([0.0, gain, gain + window.gain.sum()])
        made.append(Jumped(np.array([before, behind, end]), ends))
        settled = float(ends[2])
    return settled - float(curve[end])


def curves_of(kind: Kind, last: int, record: EnsembleRecord) -> list[FloatArray]:
    """Settlement [m] by cycle, from 0 on, of all members that have come to ``last``."""
    curves = []
    for piece in kind.runs():
        kept = record.kept(piece.name)
        if isinstance(piece, Piece) and piece.packing and kept and kept.cycle >= last:
            found = columns_by_cycle(piece, record)
            path = [found[cycle]["settlement"] for cycle in range(1, last + 1)]
            curves.append(np.append(0.0, path))
    return curves


def study(record: EnsembleRecord) -> list[Forecasts]:
    """All cases, all ways."""
    found = []
    for kind, last, numbers in CASES:
        curves = curves_of(kind, last, record)
        scale = float(np.mean([curve[last] - curve[kind.k_i] for curve in curves]))
        for jumps, (name, way), moved in product(numbers, WAYS.items(), (False, True)):
            lengths = jumps * [jump_length(jumps, last, kind.k_i)]
            errors = [jumped_error(one, kind.k_i, lengths, way, moved) for one in curves]
            found.append(Forecasts(kind, last, jumps, name, moved, np.array(errors) / scale))
    return found


def table_errors(found: Sequence[Forecasts], moved: bool) -> str:
    """A line for each schedule: mean, scatter and root mean square of each way."""
    found = [one for one in found if one.moved == moved]
    lines = []
    for kind, last, numbers in CASES:
        for jumps in numbers:
            mine = [f for f in found if (f.kind, f.last, f.jumps) == (kind, last, jumps)]
            cells = [
                f"{100 * f.error.mean():+.0f} ± {100 * f.error.std(ddof=1):.0f} "
                f"(**{100 * rms(f.error):.0f}**)"
                for f in mine
            ]
            share = f"{100 * mine[0].computed:.0f}"
            lines.append([f"{kind.name} to {last:,}", str(len(mine[0].error)), str(jumps), share])
            lines[-1] += cells
    head = ["run", "runs", "jumps", "cycles computed, %", *(f"{name}, %" for name in WAYS)]
    return table(head, lines)


@contextmanager
def chosen(choice: dict[str, float]) -> Iterator[None]:
    """`adapters.jump_slopes` with other scales."""
    before = {name: getattr(jump_slopes, name) for name in choice}
    try:
        for name, value in choice.items():
            setattr(jump_slopes, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(jump_slopes, name, value)


def table_choices(record: EnsembleRecord) -> str:
    """What the scales of `CHOICES` are worth on beds that settle more behind a jump."""
    lines = []
    for kind, last, _ in CASES:
        curves = curves_of(kind, last, record)
        scale = float(np.mean([curve[last] - curve[kind.k_i] for curve in curves]))
        lengths = CHOICES_JUMPS * [jump_length(CHOICES_JUMPS, last, kind.k_i)]
        lines.append([f"{kind.name} to {last:,}"])
        for choice in CHOICES.values():
            with chosen(choice):
                errors = [
                    jumped_error(one, kind.k_i, lengths, way_history, True) / scale
                    for one in curves
                ]
            lines[-1].append(f"{100 * np.mean(errors):+.0f} ± {100 * np.std(errors, ddof=1):.0f}")
    return table([f"run, {CHOICES_JUMPS} jumps", *(f"{name}, %" for name in CHOICES)], lines)


def draw(found: Sequence[Forecasts], target: Path) -> None:
    """Root mean square error against the share of cycles computed, a panel an ensemble."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(CASES), figsize=(13, 4), layout="constrained")
    colours = dict(zip(WAYS, ("0.5", "#0072B2", "#E69F00", "#882255"), strict=True))
    for axis, (kind, last, _) in zip(axes, CASES, strict=True):
        for name in WAYS:
            key = (kind, last, name, False)
            mine = [f for f in found if (f.kind, f.last, f.way, f.moved) == key]
            share = [100 * f.computed for f in mine]
            errors = [100 * rms(f.error) for f in mine]
            axis.plot(share, errors, "o-", color=colours[name], label=name)
        axis.set(
            title=f"{kind.name}, to cycle {last:,}", ylim=(0, None),
            xlabel="cycles computed [%]", ylabel="error of the settlement, rms over runs [%]",
        )  # fmt: skip
    axes[0].legend(fontsize=8)
    figure.savefig(target, dpi=80)
    plt.close(figure)


def page(found: Sequence[Forecasts], record: EnsembleRecord) -> str:
    """The page of a study."""
    parts = {
        "ERRORS": table_errors(found, False),
        "ERRORS_MOVED": table_errors(found, True),
        "CHOICES": table_choices(record),
        "LAYERS": table_layers(record),
        "K": str(FIRST_WINDOW),
        "HEALING": str(HEALING),
        "FIRST_CYCLE": f"{FIRST_CYCLE:g}",
        "KAPPA": f"{KAPPA:g}",
    }
    return page_filled(TEMPLATE.read_text(encoding="utf-8"), parts)


def main() -> None:
    """Write page and picture."""
    record = EnsembleRecord()
    found = study(record)
    write_atomically(PAGE, page(found, record))
    draw(found, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
