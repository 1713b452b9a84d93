"""Which jump comes next, and whether one that was made is kept: the controller, without an engine.

Every function is pure; a run is the sequence of what it observed, so a run that was killed takes
the same decisions again (`adapters.procedure.controlled` carries them out).

`tolerance` bounds the error of the settlement that the bed gains from the start of a jump of h
cycles at N to the end of the m healing cycles behind it, over the total settlement:

    |gained - true| <= tolerance * |u(N + h + m)|,

u counted from the prepared bed, before its first load cycle; "true" is what the bed would have
gained on the mean, had every cycle been computed.  It is a bound a jump; how errors of several
jumps add up is estimated by `adapters.jumps.band`.

A bed that was moved settles more than it would have (`adapters.jumps.slopes`): rates are those of
the bed itself, and what it is ahead of them by, all earlier jumps and the cycles behind them
together, is taken off the next jump with what the bed will settle more behind that one.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, inf

import numpy as np
from scipy.special import stdtrit

from adapters.bed import FloatArray
from adapters.jumps.forecast import Forecast, bound_gain_by_laws, fit_forecast
from adapters.jumps.rates import Stretch, find_noise, find_rates, fit_slope_trend, fit_state_trend
from adapters.jumps.slopes import Landing, estimate_slopes, find_reseating, remove_moves
from adapters.laws.fit import FIRST_WINDOW, WHY_NOT, WHY_NOT_PISTON, BoolArray, Regime

STATES = ("coordination", "deflection")
"""Columns of a `Stretch` that a jump leaves as they are, and that are compared behind it."""


@dataclass(frozen=True)
class JumpNumbers:
    """Length of a jump, and of the window behind it."""

    probability: float = 0.9  # with which a jump is to hold its tolerance [-]
    shortest_window: int = 10  # cycles k of a window: grains are fitted on the fewest,
    longest_window: int = 100  # a kill loses the most [cycles]
    growth: float = 2.0  # longest jump over the last one that was kept [-]
    reach: float = 2.0  # greatest ratio of the cycles after a jump to those before [-]
    state_change: float = 0.05  # most that `STATES` may change by over a jump, of their mean [-]
    safety: float = 0.9  # share of the tolerance that is aimed at [-]
    memory: float = 10.0  # stretches before N / 10 are forgotten: what one exponent can span [-]
    attempts: int = 4  # jumps tried from one state; then cycles are computed before the next


JUMP = JumpNumbers()


@dataclass(frozen=True)
class Settings:
    """What the scene says."""

    tolerance: float
    healing: int  # cycles m behind a jump that are kept out of the fit
    total_cycles: int
    cycle_by_cycle: bool = False  # where no jump is allowed: True computes on, False refuses

    @property
    def shortest_jump(self) -> int:
        """A shorter jump skips fewer cycles than its healing keeps from the fit: it never pays."""
        return max(2, self.healing)


@dataclass(frozen=True, eq=False)
class Control:
    """What is known at a state with every cycle since the last jump computed."""

    cycle: int
    settlement: float  # since the preparation [m]
    windows: tuple[Stretch, ...] = ()  # computed cycles that still count, healing ones left out
    behind: tuple[Stretch, ...] = ()
    """The same with healing cycles from the second on, which show kappa best."""
    landings: tuple[Landing, ...] = ()  # jumps that were kept
    kappa: float = 0.0  # of `adapters.jumps.slopes`
    ahead: float = 0.0  # what the bed has settled beyond its own rates, all jumps together [m]
    reseated: float = 0.0  # what it settled more because it was moved [m]
    curve_cycle: tuple[float, ...] = ()
    curve_settlement: tuple[float, ...] = ()
    """The run's own curve since the past was forgotten last [m]."""
    last_jump: int = 0  # length of the last jump that was kept; 0 before the first
    longest: float = inf  # longest jump by the errors observed
    last_error: float = 1.0  # realised error of the last jump over its tolerance
    drift: tuple[float, float] = (0.0, 0.0)
    """What rates exceeded their forecasts by, summed upwards and downwards (`jumps.check`)."""
    attempts: int = 0  # jumps from this state that were taken back
    window: int = FIRST_WINDOW  # cycles of the last window

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """`windows` of the bed itself, without what jumps made it settle more."""
        return tuple(remove_moves(one, self.landings, self.kappa) for one in self.windows)

    @property
    def share(self) -> float:
        """What the bed settles more behind a jump, over what it is moved by; from 0 to 1."""
        moved = sum(one.moved for one in self.landings)
        return min(max(self.reseated / moved, 0.0), 1.0) if moved else 0.0


@dataclass(frozen=True)
class Decision:
    """What to do from a state, and why.

    ``jump_run`` turns ``refuse`` into the error `JumpRefused`, with which ``trackbed run`` and
    ``trackbed resume`` end, exit code 6.
    """

    cycle: int  # cycles done since the start of the run, with those jumped over
    action: str  # ``jump``, ``compute``, ``refuse`` or ``end``
    window: int  # cycles k to compute: behind the healing cycles of a jump, or at once
    jump: int = 0  # cycles h
    gain: float = 0.0  # settlement expected over the h cycles [m]
    moved: float = 0.0  # settlement that the mean grain is moved by [m]
    correction: float = 0.0
    """What is to be gained beyond ``gain``, for the errors of earlier jumps [m]."""
    half_width: float = 0.0
    """How far that can be off with `JUMP.probability`, before it is tried [m]."""
    limits: tuple[tuple[str, float], ...] = ()  # longest jump by each rule [cycles]
    binding: str = ""  # the rule that set h
    regime: str = ""
    """One of `fit.regime.REGIMES`, of the bed or, where that is refused, of the piston; empty
    before the first cycles to be fitted."""
    exponent: float = 0.0  # beta: the rate goes as N^(beta - 1)
    attempt: int = 1  # which try of a jump from this cycle it is, from 1
    why: str = ""  # one sentence, or the part of one that follows "up to cycle N" where it refuses


def observe(control: Control, stretch: Stretch, settlement: float) -> Control:
    """The state after a window computed from ``control`` without a jump.

    Errors observed count less the longer ago they are: their limit doubles with every window.
    """
    behind = join_stretch(control.behind, stretch)
    kappa = estimate_slopes(behind, control.landings).kappa()[0] if control.landings else 0.0
    more = kappa * float(find_reseating(stretch, control.landings).sum())
    cycles, curve = trace_curve(stretch, settlement)
    return replace(
        control, cycle=stretch.last_cycle, settlement=settlement,
        windows=join_stretch(control.windows, stretch), behind=behind, kappa=kappa,
        ahead=control.ahead + more, reseated=control.reseated + more,
        curve_cycle=control.curve_cycle + cycles, curve_settlement=control.curve_settlement + curve,
        longest=control.longest * JUMP.growth, attempts=0, window=len(stretch.gain),
    )  # fmt: skip


def join_stretch(stretches: tuple[Stretch, ...], new: Stretch) -> tuple[Stretch, ...]:
    """Memory with a new stretch; windows that follow one another become one stretch."""
    if stretches and stretches[-1].last_cycle == new.first_cycle:
        last = stretches[-1]
        parts = (
            np.concatenate([getattr(last, name), getattr(new, name)])
            for name in ("gain", "coordination", "deflection")
        )
        stretches, new = stretches[:-1], Stretch(last.first_cycle, *parts)
    kept = [one for one in stretches if one.last_cycle * JUMP.memory >= new.last_cycle]
    return (*kept, new)


def trace_curve(stretch: Stretch, settlement: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    cycles = stretch.first_cycle + 1.0 + np.arange(len(stretch.gain))
    values = settlement - stretch.gain.sum() + np.cumsum(stretch.gain)
    return tuple(cycles.tolist()), tuple(values.tolist())


def decide(control: Control, settings: Settings, piston: Regime | None = None) -> Decision:
    """Jump, compute, refuse or end; a pure function of what was observed.

    ``piston``: regime of a piston that can sink into the bed; None where it covers all of it.
    """
    left = settings.total_cycles - control.cycle
    if left <= 0:
        return Decision(control.cycle, "end", 0, why="all cycles are done")
    if not control.stretches:
        return Decision(
            control.cycle, "compute", min(FIRST_WINDOW, left), why="the first cycles to be fitted"
        )
    forecast = fit_forecast(find_rates(control.stretches))
    regime = forecast.regime
    known = Decision(
        control.cycle, "compute", min(control.window, left), regime=regime.name,
        exponent=regime.exponent, attempt=control.attempts + 1,
    )  # fmt: skip
    for one, why_not in ((regime, WHY_NOT), (piston, WHY_NOT_PISTON)):
        if one is not None and not one.jump_allowed:
            return replace(
                known, action="compute" if settings.cycle_by_cycle else "refuse", regime=one.name,
                exponent=one.exponent, why=why_not[one.name],
            )  # fmt: skip
    room = left - settings.healing - JUMP.shortest_window
    if room < settings.shortest_jump:
        return replace(known, why="the end is too near for a jump")
    grid = np.unique(np.geomspace(1, room, 80).round())
    widths = estimate_widths(control, forecast, grid)
    limits = find_limits(control, settings, forecast, grid, widths)
    binding = min(limits, key=lambda name: limits[name])
    jump = int(min(limits[binding], room))
    if limits[binding] > room:
        binding = "end"
    window = choose_window(control, settings, forecast, limits)
    width = float(np.interp(jump, grid, np.hypot(*widths)))
    gain = float(forecast.gain(control.cycle, control.cycle + float(jump)))
    moved = (gain - control.ahead) / (1 + control.share)
    moved = moved if moved * gain > 0 else 0.0
    every = tuple((name, float(value)) for name, value in limits.items())
    known = replace(known, limits=every, binding=binding)
    if control.attempts >= JUMP.attempts:
        return replace(known, window=min(window, left), why="jumps from here were taken back")
    if jump < settings.shortest_jump:
        why = f"no jump pays: {binding} allows {jump} cycles, healing takes {settings.healing}"
        return replace(known, window=min(window, left), why=why)
    return replace(
        known, action="jump", jump=jump, window=min(window, left - jump - settings.healing),
        gain=gain, moved=moved, correction=moved * (1 + control.share) - gain, half_width=width,
        why=f"{binding} allows {jump} cycles",
    )  # fmt: skip


def find_limits(
    control: Control, settings: Settings, forecast: Forecast, grid: FloatArray,
    widths: tuple[FloatArray, FloatArray],
) -> dict[str, float]:  # fmt: skip
    """Longest jump [cycles] by each rule.

    ``grid``: lengths that are tried, ascending, from 1, shape (h,); ``widths``: `estimate_widths`
    them.

    - *slope* (Cojocaru and Karlsson 2006): the slope w = du/d ln N changes by g a unit of ln N, so
      holding it errs by g x^2 / 2, x = ln((N + h) / N).  Only what g exceeds its standard error by
      counts: a noisy slope is no curvature.
    - *noise*, *laws*: half-width of the gain from the noise of the rates, and from the exponent
      and the slow laws' spread; both together within the tolerance.  The limit has the
      name of the greater part.  And a rate that noise hides, so that its sign is not known, is not
      extrapolated, for many such jumps would add up; unless all cycles left gain too little.
    - *state*: coordination number and elastic deflection change by their trend, beyond its
      standard error, no more than `JUMP.state_change`.
    - *observed*: by the errors of the jumps before, see `accept` and `reject`.
    - *growth*: `JUMP.growth` times the last jump that was kept; the first as long as its window.
    - *reach*: `JUMP.reach` times the cycles done.
    """
    here = float(control.cycle)
    gains = forecast.gain(here, here + grid)
    allowed = JUMP.safety * settings.tolerance * np.abs(control.settlement + gains)
    slope, slope_error = fit_slope_trend(find_rates(control.stretches))
    curvature = max(abs(slope) - slope_error, 0.0)
    missed = 0.5 * curvature * np.log1p(grid / here) ** 2
    noise, law = widths
    both = np.hypot(noise, law)
    idle = noise[-1] <= allowed[-1]
    last = _find_longest(grid, (both <= allowed) & ((noise <= gains) | idle))
    place = min(int(np.searchsorted(grid, max(last, 1.0))), len(grid) - 1)
    name = "noise" if noise[place] >= law[place] else "laws"
    first = control.last_jump == 0
    return {
        "slope": _find_longest(grid, missed <= allowed),
        name: last,
        "state": min(find_state_limit(control, name) for name in STATES),
        "observed": control.longest,
        "growth": float(control.window) if first else JUMP.growth * control.last_jump,
        "reach": here * (JUMP.reach - 1),
    }


def _find_longest(grid: FloatArray, allowed: BoolArray) -> float:
    """Last of the ``grid`` up to which all are ``allowed``; inf where all are, 0 where none."""
    if allowed.all():
        return inf
    first = int(np.argmin(allowed))
    return float(grid[first - 1]) if first else 0.0


def find_state_limit(control: Control, name: str) -> float:
    mean, slope, error = fit_state_trend(control.stretches, name)
    change = max(abs(slope) - error, 0.0)
    if change <= 0 or mean == 0:
        return inf
    return control.cycle * (exp(min(JUMP.state_change * abs(mean) / change, 50.0)) - 1)


def estimate_widths(
    control: Control, forecast: Forecast, lengths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Half-widths of the gain over jumps of ``lengths`` cycles [m]: noise, laws; shape (h,) each.

    *laws* is the greater of the exponents' and of how far the slow laws, fitted to the run's own
    curve, lie from the forecast.
    """
    here = float(control.cycle)
    noise, form = forecast.half_widths(here, here + lengths, JUMP.probability)
    curve = np.array(control.curve_cycle), np.array(control.curve_settlement)
    low, high = bound_gain_by_laws(*curve, here + lengths, JUMP.probability)
    gain = forecast.gain(here, here + lengths)
    apart = np.maximum(high - gain, gain - low)
    return noise, np.maximum(form, np.where(np.isfinite(apart), apart, 0.0))


def choose_window(
    control: Control, settings: Settings, forecast: Forecast, limits: dict[str, float]
) -> int:
    """Cycles k of the next window: those with the most cycles gained for each one computed.

    With k more cycles of long-run variance S the rate is known to s^-2 = s_0^-2 + k / S, and the
    noise alone allows h(k) = N (exp(tolerance u / (t s N)) - 1), Student's t.  Where the other
    rules allow more than that, k grows; without noise the shortest window does.  A rate whose sign
    the noise would hide allows none.  Where no k makes a jump pay, twice the last window.
    """
    here = float(control.cycle)
    sizes = np.unique(np.geomspace(JUMP.shortest_window, JUMP.longest_window, 20).round())
    variance = float(find_noise(control.stretches).variance[-1])
    known = float(1 / (forecast.weight @ forecast.error**2)) if forecast.error.any() else inf
    others = min(value for name, value in limits.items() if name not in ("noise", "laws"))
    student = float(stdtrit(forecast.freedom, (1 + JUMP.probability) / 2))
    if variance > 0:
        error = 1 / np.sqrt(known + sizes / variance)
        allowed = JUMP.safety * settings.tolerance * abs(control.settlement)
        reach = np.minimum(allowed / np.maximum(student * error * here, 1e-300), 50.0)
        certain = student * error <= abs(float(forecast.rate @ forecast.weight))
        jumps = np.where(certain, np.minimum(here * np.expm1(reach), JUMP.growth * others), 0.0)
    else:
        jumps = np.full_like(sizes, others)
    pays = jumps >= settings.shortest_jump
    if not pays.any():
        return min(2 * control.window, JUMP.longest_window)
    gained = np.where(pays, 1 + np.minimum(jumps, 1e9) / (sizes + settings.healing), 0.0)
    return int(sizes[int(np.argmax(gained))])
