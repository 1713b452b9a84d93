"""The verb ``fit``: a law to a series, and what it predicts."""

from __future__ import annotations

import argparse
import sys
from math import floor, inf, log10
from pathlib import Path
from typing import TYPE_CHECKING

from adapters.cli.arguments import add_json, print_json
from adapters.errors import UsageError
from trackbed.plausible import Quantity, describe_implausible

if TYPE_CHECKING:
    from adapters.files import Series
    from adapters.laws.fit import Prediction

FARTHEST = 1e12
"""Load cycles that are asked for at most: a hundred thousand years of the busiest line."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Arguments of ``fit``."""
    parser.add_argument(
        "paths", nargs="+", metavar="RUN|DUMP...|CSV", type=Path,
        help="a run folder, dumps with a frame each cycle, or a table (.csv, .tsv, .txt, .dat) of "
        "cycle,settlement (m), also settlement [mm], strain [%%]; decimal commas beside ; or tabs; "
        "two columns of numbers need no header, and their unit is then unknown (see --unit)",
    )  # fmt: skip
    parser.add_argument(
        "--columns", nargs=2, metavar=("CYCLE", "SETTLEMENT"), default=(),
        help="a table's columns, where they are called otherwise",
    )  # fmt: skip
    parser.add_argument(
        "--unit", metavar="U",
        help="of a table's settlement where no header gives it: m, cm, mm, um, %%, or 1 (strain)",
    )  # fmt: skip
    parser.add_argument(
        "--law", default="log", metavar="NAME",
        help="default: log; auto: the slow laws together, refused (exit code 6) where the series "
        "ratchets or collapses, or half the 90 %% band is wider than all settlement so far",
    )  # fmt: skip
    parser.add_argument(
        "--fail-at", type=float, metavar="S",
        help="settlement or strain of failure, above zero, in the series' unit: a series or a "
        "prediction that reaches it, up or down, is refused as collapse (exit code 6); "
        "failure_excluded in the JSON: the band (of --probability, 90 %% at least) does not reach "
        "it, where the regime is steady or shakedown and the prediction at most ten times ahead",
    )  # fmt: skip
    parser.add_argument(
        "--to-cycle", type=float, metavar="N", help="cycle to predict; default: the last one given"
    )
    parser.add_argument(
        "--from-cycle", type=float, default=0.0, metavar="N", help="leave earlier cycles out"
    )
    parser.add_argument(
        "--load-change", type=float, metavar="N",
        help="the load changed at cycle N: leave the cycles up to it out, and count from there, as "
        "the law starts afresh; --to-cycle counts on from the first one",
    )  # fmt: skip
    parser.add_argument(
        "--steps-per-cycle", type=float, metavar="N",
        help="dumps only: time steps of a cycle; default: each frame is the end of one",
    )  # fmt: skip
    parser.add_argument(
        "--probability", type=float, default=0.9, metavar="P",
        help="that the band should hold the truth; default: 0.9; refusals do not depend on it",
    )  # fmt: skip
    parser.add_argument(
        "--frequency", type=float, metavar="HZ",
        help="auto only: the series is a cyclic triaxial test on ballast at so many load cycles a "
        "second, 5 to 60, from its first cycle on: lean on what such tests did",
    )  # fmt: skip
    parser.add_argument(
        "--figure", type=Path, metavar="FILE",
        help="draw readings, prediction, band, laws that agree and where it is refused: .png, .svg",
    )  # fmt: skip
    add_json(parser)
    parser.set_defaults(command=run_fit)


def run_fit(arguments: argparse.Namespace) -> int:
    """Fit a law to a series; print its parameters, a prediction and its band."""
    from adapters.errors import JumpRefused
    from adapters.files import UNKNOWN, read_series
    from adapters.laws import fit, get_law

    for flag in ("to_cycle", "from_cycle", "load_change"):
        value = getattr(arguments, flag)
        if value is not None and not 0 <= value <= FARTHEST:
            raise UsageError(
                f"{value:g} is no number of load cycles", where=f"--{flag.replace('_', '-')}",
                remedy=f"give one from 0 to {FARTHEST:g}, which no track lives to see",
            )  # fmt: skip
    auto = arguments.law == "auto"
    law = get_law("log" if auto else arguments.law)
    if arguments.frequency is not None and (not auto or arguments.load_change is not None):
        raise UsageError(
            "what tests on fresh ballast did is known to auto, from the first load on",
            where="--frequency", remedy="take --law auto without --load-change, or leave it out",
        )  # fmt: skip
    if (picture := arguments.figure) and not (
        picture.suffix in (".png", ".svg") and picture.parent.is_dir()
    ):
        raise UsageError(
            "a figure is written as .png or .svg, into a folder that is there",
            where=str(picture), remedy="name it so",
        )  # fmt: skip
    series = read_series(
        arguments.paths, arguments.steps_per_cycle, arguments.columns, arguments.unit
    )
    if arguments.steps_per_cycle is not None and series.columns:
        raise UsageError(
            "a table counts cycles, not time steps", where="--steps-per-cycle",
            remedy="leave it out; it is for dumps",
        )  # fmt: skip
    if (first := series.sinks_from) is not None:
        raise UsageError(
            f"the readings sink from {first:g} towards zero, as heights do and no settlement",
            where=series.where,
            remedy="give the first height less each; of a heave, give negative readings",
        )
    to_cycle = series.cycle.max(initial=0.0) if arguments.to_cycle is None else arguments.to_cycle
    ahead = to_cycle
    if arguments.load_change is not None:
        ahead = to_cycle - arguments.load_change
        series = series.restart_after(arguments.load_change)
    series = series.keep_from(arguments.from_cycle)

    def predict(cycle: float) -> fit.Prediction:
        asked = (cycle, arguments.probability, arguments.fail_at)
        if auto:
            return fit.fit_auto(series, *asked, arguments.frequency)
        return fit.fit_series(series, law, *asked)

    if picture and series.cycle.max(initial=0.0) > 0:
        from trackbed.report import save_figure

        save_figure(lambda: fit.draw_forecast(series, predict, ahead), picture)
    try:
        found = predict(ahead)
    except JumpRefused as refusal:
        if arguments.json:
            unexcluded = {} if arguments.fail_at is None else {"failure_excluded": False}
            print_json(refusal.to_json(series.unit) | unexcluded)
        raise
    if fall := fit.refuse_fall(series.cycle + series.counted_from, series.settlement):
        print(f"warning: {fall.why}\n  -> {fall.remedy}", file=sys.stderr)
    quantity: Quantity = "strain" if series.unit == "1" else "settlement"
    most = float(abs(series.settlement).max()) if series.unit in ("m", "1") else 0.0
    for said in (describe_implausible(quantity, most, series.where), *series.doubts):
        if said:
            print(f"warning: {said}", file=sys.stderr)
    fitted = found.to_json()
    if arguments.json:
        print_json(fitted)
        return 0
    unit = {UNKNOWN: "(unit as given)", "1": ""}.get(series.unit, series.unit)
    read = f" of {series.columns}" if series.columns else ""
    print(f"law {fitted['law']}, fitted to {len(series.cycle)} cycles{read}")
    print(*fit.describe_formula(None if auto else law, found, series, ahead, unit), sep="\n")
    print(f"regime: {fitted['regime'] or fit.UNCLAIMED}")
    if found.laws:
        agreeing = ", ".join(name for name, said in found.laws.items() if said.agrees)
        print(f"laws that agree to {fit.AGREE:.0%} of the increment: {agreeing or 'none'}")
    if auto and arguments.frequency is None:
        print_prior(series, ahead, found, unit)
    settled, low, high = round_to_band(fitted["prediction"], *fitted["band"])
    print(f"settlement at cycle {to_cycle:.10g}: {settled} {unit}".rstrip(), end=", ")
    if ahead == series.cycle.max(initial=0.0):
        print("as read; --to-cycle predicts")
    else:
        print(f"with probability {arguments.probability:g} in {low} ... {high} {unit}".rstrip())
    if found.failure_excluded is False:
        print(f"  so that failure at {arguments.fail_at:g} is not excluded")
    return 0


def print_prior(series: Series, to_cycle: float, found: Prediction, unit: str) -> None:
    """Print what the laws say without the prior, where that moved the increment by a tenth."""
    from adapters.laws import fit

    rows = series.cycle > 0
    cycle, settlement = series.cycle[rows], series.settlement[rows]
    alone = float(fit.outlook.find_outlook(cycle, settlement[:, None], to_cycle).alone[0])
    if abs(alone - found.prediction) > fit.AGREE * abs(found.prediction - settlement[-1]):
        said, *_ = round_to_band(alone, *found.band)
        print(
            f"the laws alone: {said} {unit}".rstrip() + "; the rest is the prior that ballast "
            f"comes to rest, as {len(cycle)} readings hold it back too little (docs/laws.md)"
        )


def round_to_band(value: float, low: float, high: float) -> list[str]:
    """A value and its band to two digits of half the band, or of the value where that is less; of a
    reading as it was given."""
    if not 0 < high - low < inf:
        return [f"{one:.6g}" for one in (value, low, high)]
    shown = min((high - low) / 2, abs(value) or inf)
    digits = 1 - floor(log10(shown))
    return [f"{round(one, digits):.{max(digits, 0)}f}" for one in (value, low, high)]
