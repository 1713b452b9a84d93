"""Make docs/jump-history.md and its picture: ``python -m validation.jump_history_page``.

Jumps on the curves of the reference ensemble, where every cycle is known: what each way to forecast
the settlement of a jump errs by, with no bed, no relaxation and no engine.  Seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from adapters import jump_slopes
from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.jump_forecasts import (
    FIRST_CYCLE,
    KAPPA,
    WAYS,
    curves_of,
    jumped_error,
    way_history,
)
from validation.jump_history_behind import (
    STILL_COARSE,
    mean_first,
    shares_told,
    table_behind,
    way_jumps,
)
from validation.jump_history_layers import table_layers
from validation.jump_history_schedules import table_schedules
from validation.page_text import page_filled, table
from validation.settlement_ensemble import COARSE, CONFINED, Kind
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import FIRST_WINDOW, HEALING, jump_length
from validation.settlement_rivals_reading import rms

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[1] / "docs" / "jump-history.md"
CASES: tuple[tuple[Kind, int, tuple[int, ...]], ...] = (
    (COARSE, 500, (2, 5, 10)),
    (COARSE, 2800, (2, 5, 10, 20)),
    (CONFINED, 500, (2, 5, 10)),
)
"""Ensemble, last cycle, numbers of equal jumps."""
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
    still = way_jumps("coarse", STILL_COARSE)
    parts = {
        "ERRORS": table_errors(found, False),
        "ERRORS_MOVED": table_errors(found, True),
        "CHOICES": table_choices(record),
        "SCHEDULES": table_schedules(record),
        "LAYERS": table_layers(record),
        "BEHIND": table_behind(),
        **shares_told("LAW", "PROFILE"),
        "STILL_FIRST": f"{1e6 * mean_first(still):.0f}",
        "STILL_MORE": f"{1e6 * np.mean([one.more[0] for one in still]):.0f}",
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
