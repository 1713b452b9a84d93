"""Whether a jump is kept: what it gained beside the rates computed behind it, and what follows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, inf, log, sqrt

import numpy as np
from scipy.special import stdtrit

from adapters.bed import FloatArray
from adapters.jumps.control import JUMP, Control, Decision, Settings, join_stretch, trace_curve
from adapters.jumps.forecast import Forecast, fit_forecast, integrate_gain
from adapters.jumps.rates import Stretch, count_blocks, find_noise, find_rates
from adapters.jumps.slopes import Landing, estimate_slopes, find_reseating, remove_moves


@dataclass(frozen=True)
class CheckNumbers:
    """Bounds of a jump's error, and of rates beside their forecasts."""

    roll_back: float = 2.0  # realised error over the tolerance from which a jump is taken back [-]
    changed: float = 3.5  # deviation of a rate from which the past is forgotten [standard errors]
    allowance: float = 0.5  # of each deviation left out of sums of one sign [standard errors]
    least_error: float = 0.01  # realised error over the tolerance that counts at least [-]


CHECK = CheckNumbers()


@dataclass(frozen=True)
class Check:
    """A jump compared with the cycles computed behind it; in metres unless said otherwise."""

    accepted: bool
    gained: float
    """Settlement of the bed from the jump's start to the end of its healing cycles, with what it
    settled in the window because it was moved."""
    expected: float  # the same by the rates computed on both sides: the corrected gain
    noise: float  # standard error of ``expected`` from the noise of the rates
    form: float
    """Standard deviation of ``expected`` from the unknown exponent, and from that of kappa."""
    error: float
    """``gained`` less ``expected`` and ``Decision.correction``, over the total settlement."""
    reseated: float  # what the bed settled more behind the jump because it was moved
    kappa: float  # of `adapters.jumps.slopes`, by all jumps up to this one
    deviation: float  # of the window's rate from its forecast, in standard errors
    drift: tuple[float, float]
    """Deviations summed, upwards and downwards, see `sum_drift`; standard errors."""
    changed: bool
    """The rate is another than forecast, beyond noise: in this window, or in all jumps together."""
    sources: tuple[tuple[int, int, float, float], ...] = ()
    """Of each stretch that ``expected`` rests on, the new one last: cycles done before it, its
    cycles, their long-run variance [m^2 a cycle], derivative of ``expected`` by its gain."""


def judge(
    control: Control, decision: Decision, settings: Settings, stretch: Stretch, settlement: float
) -> Check:
    """Compare a jump with the window behind it.

    ``stretch``: all cycles behind the jump, healing ones first; ``settlement`` [m] at its end.  The
    gain that is expected is that of all rates on both sides; where the window's rate is another
    than the forecast, beyond noise, that of a power law through the two rates.
    """
    landings, windows, behind = join_by_jump(control, decision, settings, stretch)
    kappa, kappa_error = estimate_slopes(behind, landings).kappa()
    every = tuple(remove_moves(one, landings, kappa) for one in windows)
    window, noises = every[-1], find_noise(every).variance
    before, both = fit_forecast(find_rates(every[:-1])), fit_forecast(find_rates(every))
    start, end = float(control.cycle), float(window.first_cycle)
    deviation = compare_rate(before, every[:-1], window)
    drift = sum_drift(control.drift, deviation)
    changed = max(drift) > CHECK.changed - CHECK.allowance
    if changed:
        expected = expect_by_two_rates(before, both, window, float(noises[-1]), start)
    else:
        expected = expect_by_all(both, start, end)
    sources = list_sources(every, noises, expected.shares)
    by_kappa = sum(
        source[3] * float(find_reseating(one, landings).sum())
        for source, one in zip(sources, windows, strict=True)
    )
    gained = settlement - float(window.gain.sum()) - control.settlement
    healed = float(both.gain(float(landings[-1].cycle), end))
    total = abs(control.settlement + gained)
    error = gained - expected.mean - decision.correction
    relative = error / total if total > 0 else (inf if error else 0.0)
    return Check(
        accepted=abs(relative) <= CHECK.roll_back * settings.tolerance, gained=gained,
        expected=expected.mean, noise=expected.noise,
        form=hypot(expected.form, kappa_error * by_kappa), error=relative, deviation=deviation,
        drift=drift, changed=changed, reseated=gained - decision.moved - healed, kappa=kappa,
        sources=sources,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Expected:
    """Gain over a jump and its healing cycles by the rates on both sides; metres."""

    mean: float
    noise: float  # standard error from the noise of the rates
    form: float  # standard deviation from the unknown exponent
    shares: FloatArray  # derivative by the gain of each block, shape (b,)


def compare_rate(before: Forecast, past: Sequence[Stretch], window: Stretch) -> float:
    """What the rate of a window exceeds its forecast by, in standard errors: of the window's own
    noise and of the forecast ``before`` it, made from ``past``."""
    start, end, k = float(window.first_cycle), float(window.last_cycle), len(window.gain)
    expected = float(before.gain(start, end)) / k
    known = np.array(before.half_widths(start, end, JUMP.probability)) / k
    student = float(stdtrit(before.freedom, (1 + JUMP.probability) / 2))
    noise = float(find_noise(past).variance[-1]) / k
    error = sqrt(noise + float((known / student) @ (known / student)))
    difference = window.rate - expected
    return difference / error if error > 0 else (inf if difference else 0.0)


def sum_drift(drift: tuple[float, float], deviation: float) -> tuple[float, float]:
    """Sums of deviations upwards and downwards with one more of them; standard errors.

    S = max(0, S + d - `CHECK.allowance`), and the same of -d (Page's cumulative sum, 1954): windows
    that all lie a little to one side of their forecasts ring where none would alone, as behind a
    rate that drifts.  A sum from 0 rings where its one deviation exceeds `CHECK.changed`.
    """
    up, down = drift
    return max(0.0, up + deviation - CHECK.allowance), max(0.0, down - deviation - CHECK.allowance)


def expect_by_all(both: Forecast, start: float, end: float) -> Expected:
    """By the forecast of all windows on both sides."""
    student = float(stdtrit(both.freedom, (1 + JUMP.probability) / 2))
    noise, form = (float(one) / student for one in both.half_widths(start, end, JUMP.probability))
    return Expected(float(both.gain(start, end)), noise, form, both.shares(start, end))


def expect_by_two_rates(
    before: Forecast, both: Forecast, window: Stretch, variance: float, start: float
) -> Expected:
    """By a power law through the rate before the jump and the ``window``'s.

    ``variance``: long-run one of the window's gains [m^2 a cycle].
    """
    end, k, rate = float(window.first_cycle), len(window.gain), float(before.rate @ before.weight)
    mean = integrate_gain(rate, window.rate, start, end)
    sides = float(before.weight @ before.error**2), variance / k
    x = 0.5 * log(end / start)
    noise = x * sqrt(sides[0] * start**2 + sides[1] * end**2)
    form = abs(mean - 0.5 * (end - start) * (rate + window.rate)) / 2
    blocks = len(both.influence) - len(before.influence)
    shares = [x * start * (before.influence @ before.weight), np.full(blocks, x * end / k)]
    return Expected(mean, noise, form, np.concatenate(shares))


def join_by_jump(
    control: Control, decision: Decision, settings: Settings, stretch: Stretch
) -> tuple[tuple[Landing, ...], tuple[Stretch, ...], tuple[Stretch, ...]]:
    """Landings, windows and windows with healing cycles, those of a jump the last of each.

    ``stretch``: all cycles behind the jump.  Its first cycle is left out: contacts that were moved
    do not bear yet.
    """
    landing = Landing(stretch.first_cycle, decision.moved)
    k = len(stretch.gain)
    window, behind = (stretch.part(min(one, k - 1), k) for one in (settings.healing, 1))
    landings = (*control.landings, landing)
    return landings, (*control.windows, window), (*control.behind, behind)


def list_sources(
    stretches: Sequence[Stretch], noises: FloatArray, shares: FloatArray
) -> tuple[tuple[int, int, float, float], ...]:
    """`Check.sources` from the derivatives by each block's gain, shape (b,)."""
    blocks = [count_blocks(one) for one in stretches]
    parts = np.split(shares, np.cumsum(blocks)[:-1])
    return tuple(
        (one.first_cycle, len(one.gain), float(noise), float(part.mean()))
        for one, noise, part in zip(stretches, noises, parts, strict=True)
    )


def accept(
    control: Control, decision: Decision, check: Check, settings: Settings, stretch: Stretch,
    settlement: float,
) -> Control:  # fmt: skip
    """The state after a jump that is kept.

    The next one may be longer by a step-size controller's factor (proportional and integral),
    0.9 (tol / e)^(0.7/2) (e_last / tol)^(0.4/2), between 1/5 and `JUMP.growth`, where e is what the
    realised error exceeds its own standard error by.  Where the rate changed, the past is
    forgotten, and the next jump is at most half as long: what is left is one window.
    """
    landings, windows, behind = join_by_jump(control, decision, settings, stretch)
    stretch = windows[-1]
    total = abs(control.settlement + check.gained)
    certain = abs(check.error) * total - hypot(check.noise, check.form) if total else 0.0
    error = max(certain / (settings.tolerance * total) if total else 0.0, CHECK.least_error)
    factor = JUMP.safety * error**-0.35 * control.last_error**0.2
    cycles, curve = trace_curve(stretch, settlement)
    if check.changed:
        windows, behind = windows[-1:], behind[-1:]
    past = ((), ()) if check.changed else (control.curve_cycle, control.curve_settlement)
    return replace(
        control,
        cycle=stretch.last_cycle,
        settlement=settlement,
        windows=join_stretch(windows[:-1], windows[-1]),
        behind=join_stretch(behind[:-1], behind[-1]),
        landings=landings,
        kappa=check.kappa,
        ahead=control.ahead + check.gained - check.expected,
        reseated=control.reseated + check.reseated,
        curve_cycle=past[0] + cycles,
        curve_settlement=past[1] + curve,
        last_jump=decision.jump,
        longest=decision.jump * min(max(factor, 0.2), 0.5 if check.changed else JUMP.growth),
        last_error=error,
        drift=(0.0, 0.0) if check.changed else check.drift,
        attempts=0,
        window=len(stretch.gain),
    )


def reject(control: Control, decision: Decision, error: float, settings: Settings) -> Control:
    """The state before a jump that was taken back: the next one is shorter.

    By 0.9 (tol / e)^(1/2), between 1/10 and 1/2; ``error`` is the realised one, not a number where
    the jump failed otherwise.
    """
    ratio = settings.tolerance / abs(error) if np.isfinite(error) and error else 0.0
    factor = min(max(JUMP.safety * sqrt(ratio), 0.1), 0.5) if ratio else 0.5
    return replace(control, longest=decision.jump * factor, attempts=control.attempts + 1)
