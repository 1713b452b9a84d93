"""Settlement curves with known laws and noise, and the controller played on them, no engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import Any

import numpy as np
from scipy.signal import lfilter

from adapters.bed.state import FloatArray
from adapters.engines.fake import FakeBed
from adapters.jumps.check import accept, judge, reject
from adapters.jumps.control import Control, Decision, Settings, decide, observe
from adapters.jumps.rates import Stretch
from adapters.jumps.slopes import Landing, remove_moves

Law = Callable[[FloatArray], FloatArray]

MICRO = 1e-6


def _load_step(cycle: FloatArray) -> FloatArray:
    after = np.maximum(cycle - 600, 0.0)
    return 100 * MICRO * np.log1p(cycle) + 100 * MICRO * np.log1p(after / 60)


CURVES: dict[str, Law] = {
    "log": lambda n: 100 * MICRO * np.log1p(n),
    "power": lambda n: 60 * MICRO * n**0.2,
    "stretched": lambda n: 600 * MICRO * -np.expm1(-((n / 300) ** 0.4)),
    "hyperbolic": lambda n: 500 * MICRO * n / (150 + n),
    "sato": lambda n: 300 * MICRO * -np.expm1(-n / 60) + 0.01 * MICRO * n,
    "load step": _load_step,
    "early load step": lambda n: (
        20 * MICRO * np.log1p(n) + 1 * MICRO * np.maximum(n - 110, 0.0) ** 0.8
    ),
    "ratcheting": lambda n: 1 * MICRO * n,
    "collapse": lambda n: 0.02 * MICRO * n**2.5,
    "rest": lambda n: np.zeros_like(n),
    "drift": lambda n: 200 * MICRO * np.log1p(n) - 0.3 * MICRO * n,
    "early drift": lambda n: 200 * MICRO * (np.log1p(n) - n / 300),
    "late drift": lambda n: 200 * MICRO * (np.log1p(n) - n / 1500),
    "drift to rest": lambda n: (
        200 * MICRO * (np.log1p(np.minimum(n, 666)) - np.minimum(n, 666) / 667)
    ),
    "waves": lambda n: 100 * MICRO * (np.log1p(n) + 0.8 * np.sin(1.5 * np.log1p(n))),
}
"""u(N) [m] of the mean of many beds."""


BURST_CHANCE, BURST_CYCLES = 0.2, 2.0
"""Chance of a burst in a cycle, and cycles in which it dies away by e."""


@cache
def draw_bursts(seed: int, count: int) -> FloatArray:
    """Gains of ``count`` cycles over their mean: bursts of exponential size that die away slowly.

    Mean 1, standard deviation 1.5, correlation exp(-1/2) from one cycle to the next.  The first
    cycles of a longer series are those of a shorter one.
    """
    came = np.random.default_rng([seed, 0]).random(count) < BURST_CHANCE
    size = np.random.default_rng([seed, 1]).exponential(size=count) * came / BURST_CHANCE
    kept = np.exp(-1 / BURST_CYCLES)
    return np.asarray(lfilter([1 - kept], [1, -kept], size))


@dataclass(frozen=True)
class Curve(FakeBed):
    """A law with the noise of one run."""

    bursts: float = 0.0
    """Share of the settlement that comes in bursts; a cycle's is the same in every run."""
    seed: int = 1
    jitter: float = 0.0  # deviation of each reading [m], independent from cycle to cycle
    first_cycle: float = 0.0
    """What the bed settles more in the first cycle behind a jump, over what it was moved by."""
    kappa: float = 0.0  # the same in the n-th, times n (`jump_slopes`)

    def settlement(self, first: int, cycles: int) -> FloatArray:
        """u [m] at the ends of ``cycles`` cycles from ``first`` on, less u before them."""
        count = np.arange(first, first + cycles + 1)
        gain = np.diff(self.law(count.astype(float)))
        drawn = 1 << max(first + cycles + 1, 2).bit_length()  # so that few series are made
        if self.bursts:
            share = draw_bursts(self.seed, drawn)[first : first + cycles]
            gain = gain * (1 - self.bursts + self.bursts * share)
        path = np.concatenate([[0.0], np.cumsum(gain)])
        if self.jitter:
            reading = np.random.default_rng([self.seed, 2]).standard_normal(drawn)
            path += self.jitter * (reading[count] - reading[first])
        return path

    def mean(self, first: int, last: int) -> float:
        """What many beds gain on the mean [m]."""
        return float(np.diff(self.law(np.array([first, last], float)))[0])


@dataclass
class Play:
    """What a controlled run did."""

    decisions: list[Decision] = field(default_factory=list)
    checks: list[dict[str, Any]] = field(default_factory=list)
    """Of jumps that stand, as `adapters.jumps.estimate_band` takes them."""
    taken_back: list[dict[str, Any]] = field(default_factory=list)
    true_errors: list[float] = field(default_factory=list)
    """Gain of each jump that stands less that of the mean law, over the total."""
    computed: int = 0  # cycles, those of jumps taken back included
    settlement: float = 0.0
    truth: float = 0.0  # what the mean bed would have from the same state after k_i cycles [m]
    refused: bool = False

    @property
    def errors(self) -> FloatArray:
        """Absolute true errors of the jumps that stand."""
        return np.abs(self.true_errors)


def make_stretch(curve: FakeBed, first: int, cycles: int) -> Stretch:
    """Cycles of a bed as the controller sees them."""
    unknown = np.full(cycles, np.nan)
    return Stretch(first, np.diff(curve.settlement(first, cycles)), unknown, unknown)


def moved_more(curve: Curve, stretch: Stretch, landings: Sequence[Landing]) -> Stretch:
    """A stretch as it is behind jumps: the bed settles more."""
    more = remove_moves(stretch, landings, -curve.kappa)
    if landings and landings[-1].cycle == stretch.first_cycle:
        more.gain[0] += (curve.first_cycle - curve.kappa) * landings[-1].moved
    return more


def play(curve: Curve, k_i: int, settings: Settings) -> Play:
    """Let the controller run on a curve from the state after ``k_i`` cycles."""
    out = Play()
    start = float(curve.settlement(0, k_i)[-1])
    control = Control(k_i, start)
    out.computed = k_i

    while True:
        decision = decide(control, settings)
        out.decisions.append(decision)
        if decision.action in ("end", "refuse"):
            out.refused = decision.action == "refuse"
            break
        if decision.action == "compute":
            window = make_stretch(curve, control.cycle, decision.window)
            window = moved_more(curve, window, control.landings)
            out.computed += decision.window
            control = observe(control, window, control.settlement + float(window.gain.sum()))
            continue
        landed = control.cycle + decision.jump
        window = make_stretch(curve, landed, settings.healing + decision.window)
        window = moved_more(curve, window, (*control.landings, Landing(landed, decision.moved)))
        out.computed += settings.healing + decision.window
        settlement = control.settlement + decision.moved + float(window.gain.sum())
        check = judge(control, decision, settings, window, settlement)
        said = asdict(check) | {
            "jump": decision.jump,
            "window": settings.healing + decision.window,
            "cycle": control.cycle,
        }
        if check.accepted:
            error = decision.gain - curve.mean(control.cycle, landed)
            total = abs(control.settlement + decision.gain)
            out.true_errors.append(error / total if total else 0.0)
            out.checks.append(said)
            control = accept(control, decision, check, settings, window, settlement)
        else:
            out.taken_back.append(said)
            control = reject(control, decision, check.error, settings)
    out.settlement = control.settlement
    out.truth = start + curve.mean(k_i, control.cycle)
    return out
