"""Spectra of recorded motion: amplitude, Parzen smoothing, damped modes, mobility.

All series are evenly sampled.  Two transforms are in use:

Fourier spectrum    X(f) = dt sum x_k exp(-2 pi i f t_k)         [unit s]; the paper's "linear
                                                                 spectrum" is its amplitude
amplitude spectrum  2 |sum w_k x_k exp(...)| / sum w_k           [unit]; the amplitude of a cosine
"""

from dataclasses import dataclass
from math import pi

import numpy as np
import numpy.typing as npt

from qdem_fem.files import Floats, UsageError

ComplexArray = npt.NDArray[np.complex128]

BANDWIDTH = 20.0  # of the Parzen window [Hz], as in Figs. 9 to 12 of the paper
UNEVEN_INTERVAL = 1e-6  # greatest departure of a time interval from the mean one, relative [-]


@dataclass(frozen=True)
class ModeNumbers:
    """Search for damped modes."""

    padding: int = 8  # samples of a padded spectrum over those of the record [-]
    decays: tuple[float, ...] = (0.0, 2.0, 6.0, 20.0, 60.0)  # over the record, fits begin there [-]
    floor: float = 1e-3  # least amplitude over the greatest [-]
    remainder: float = 1e-10  # of a fit, over the record, in which no mode is sought [-]


MODES = ModeNumbers()


@dataclass(frozen=True)
class Mode:
    """One damped cosine A exp(-decay (t - t_0)) cos(2 pi f (t - t_0) + phase)."""

    frequency: float  # of the damped motion [Hz]
    decay: float  # [1/s]; damping ratio = decay / (2 pi f), where that is small
    amplitude: float  # at the first sample, t_0; unit of the series
    phase: float  # [rad]


def find_amplitudes(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and amplitudes [unit of values], (k // 2 + 1,) each, of a record (k,).

    The mean is taken off; the window is Hann's.  A cosine of amplitude A peaks at A when its
    frequency is one of those returned, and up to 15 % below between two of them;
    `find_peak_frequencies` has no such error.  Raises `UsageError` for a record that is no even,
    finite series.
    """
    step, values = _check_record(time, values)
    weight = np.hanning(len(values) + 1)[:-1]
    centred = values - np.average(values, weights=weight)
    amplitude = 2 * np.abs(np.fft.rfft(weight * centred)) / weight.sum()
    return np.asarray(np.fft.rfftfreq(len(values), step), float), amplitude


def transform_record(time: Floats, values: Floats) -> tuple[Floats, ComplexArray]:
    """Frequencies [Hz] and the Fourier spectrum X(f) [unit s] of a record, mean left in."""
    step, values = _check_record(time, values)
    frequency = np.asarray(np.fft.rfftfreq(len(values), step), float)
    return frequency, step * np.fft.rfft(values) * np.exp(-2j * pi * frequency * time[0])


def smooth_spectrum(frequency: Floats, amplitude: Floats, bandwidth: float = BANDWIDTH) -> Floats:
    """An amplitude spectrum smoothed by a Parzen window, as in Figs. 9-12 of the paper.

    The power |X|^2 is averaged by W(f) = 3/4 u (sin(pi u f/2) / (pi u f/2))^4, u = 280/(151 b)
    for the ``bandwidth`` b = 1 / integral W^2 [Hz]; the root of the mean is returned.  The power
    goes on beyond zero and the highest frequency as its mirror image, as that of a real record
    does.  ``frequency`` is even from zero, as `numpy.fft.rfftfreq` returns it.  Of no use when the
    bandwidth is below the spacing of the frequencies: then nothing is smoothed.
    """
    spacing = float(frequency[1] - frequency[0])
    scale = 280 / (151 * bandwidth)
    reach = min(int(np.ceil(16 / (scale * spacing))), len(amplitude) - 1)
    weight = np.sinc(scale * spacing * np.arange(-reach, reach + 1) / 2) ** 4
    power = np.pad(amplitude**2, reach, mode="reflect")
    # Term by term: by transforms, 1e-16 of the greatest power would be left everywhere, which of
    # a load that ends at some frequency is more than there is beyond it.
    return np.sqrt(np.convolve(power, weight / weight.sum(), mode="valid"))


def find_mobility(
    time: Floats, force: Floats, velocity: Floats, bandwidth: float = BANDWIDTH
) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and mobility |H| = |V| / |F| [m/(s N)] (Fig. 12 of the paper).

    Linear spectra of ``velocity`` [m/s] and ``force`` [N] over the same ``time`` [s], each
    smoothed by a Parzen window of ``bandwidth`` [Hz].  Nan where the force holds less than 1e-9 of
    its greatest amplitude: there it says nothing.
    """
    frequency, force_spectrum = transform_record(time, force)
    _, velocity_spectrum = transform_record(time, velocity)
    of_force, of_velocity = (
        smooth_spectrum(frequency, np.abs(one), bandwidth)
        for one in (force_spectrum, velocity_spectrum)
    )
    silent = of_force <= 1e-9 * of_force.max(initial=0.0)
    return frequency, np.where(silent, np.nan, of_velocity / np.where(silent, 1.0, of_force))


def find_peak_frequencies(
    time: Floats, values: Floats, count: int = 1, floor: float = MODES.floor
) -> list[Mode]:
    """The ``count`` strongest damped cosines of a record of free motion, strongest first.

    One after another: the highest peak of the padded spectrum of what is left starts a
    least-squares fit of all cosines found so far and a constant (variable projection: amplitudes
    and phases follow linearly from frequencies and decays).  Ends early when a cosine's amplitude
    is below ``floor`` of the first one's.

    Exact, to rounding, for a record that is such a sum; two periods are enough for one cosine.
    Not for forced motion, nor for modes closer to each other than one over the duration.
    """
    from scipy.optimize import least_squares

    step, values = _check_record(time, values)
    duration = step * (len(values) - 1)
    t = np.linspace(0.0, 1.0, len(values))
    scale = float(np.abs(values - values.mean()).max())
    if scale == 0 or len(values) < 8:
        return []
    target = values / scale
    start: list[float] = []
    left = target - target.mean()
    modes: list[Mode] = []
    for _ in range(count):
        # Unknowns are cycles in the record and decay over it: both of the order of one to 100.
        starts = [
            [*start, peak * duration, decay]
            for peak in {_find_highest_peak(left, step, windowed) for windowed in (True, False)}
            for decay in MODES.decays
        ]
        start = min(starts, key=lambda one: np.linalg.norm(_find_misfit(one, t, target)))
        fit = least_squares(
            _find_misfit, start, args=(t, target), x_scale="jac", method="lm",
            xtol=1e-14, ftol=1e-14, gtol=1e-14,
        )  # fmt: skip
        left = fit.fun
        found = _make_modes(fit.x, t, target, duration, scale)
        if any(not 0 < mode.frequency < 0.5 / step for mode in found):
            break
        if found[-1].amplitude < floor * max(mode.amplitude for mode in found):
            break
        start, modes = list(fit.x), found
        if np.abs(left).max() < MODES.remainder:
            break
    return sorted(modes, key=lambda mode: -mode.amplitude)


def _find_highest_peak(values: Floats, step: float, windowed: bool) -> float:
    """Frequency [Hz] of the highest peak of the padded spectrum, refined by a parabola.

    A Hann window finds modes that last, and would hide one that dies out at once.
    """
    length = MODES.padding * len(values)
    weight = np.hanning(len(values) + 1)[:-1] if windowed else np.ones(len(values))
    spectrum = np.abs(np.fft.rfft(weight * values, length))
    lowest = MODES.padding // 2
    top = lowest + int(np.argmax(spectrum[lowest:-1]))
    before, at, after = spectrum[top - 1 : top + 2]
    bend = before - 2 * at + after
    shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float((top + np.clip(shift, -1, 1)) / (length * step))


def _make_columns(unknowns: npt.ArrayLike, t: Floats) -> Floats:
    """Cosine and sine of each damped oscillation, and the constant: (k, 2 modes + 1)."""
    cycles, decay = np.reshape(unknowns, (-1, 2)).T
    damped = np.exp(-np.clip(decay, -50, 500) * t[:, None])
    angle = 2 * pi * cycles * t[:, None]
    return np.hstack([damped * np.cos(angle), damped * np.sin(angle), np.ones((len(t), 1))])


def _find_misfit(unknowns: npt.ArrayLike, t: Floats, target: Floats) -> Floats:
    columns = _make_columns(unknowns, t)
    weight = np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.asarray(target - columns @ weight)


def _make_modes(
    unknowns: Floats, t: Floats, target: Floats, duration: float, scale: float
) -> list[Mode]:
    weight = np.linalg.lstsq(_make_columns(unknowns, t), target, rcond=None)[0]
    frequency, decay = np.reshape(unknowns, (-1, 2)).T / duration
    cosine, sine = np.split(weight[:-1], 2)
    numbers = (frequency, decay, scale * np.hypot(cosine, sine), np.arctan2(-sine, cosine))
    return [Mode(*row) for row in np.transpose(numbers).tolist()]


def _check_record(time: Floats, values: Floats) -> tuple[float, Floats]:
    """Interval [s] and values of an even, finite series."""
    time, values = np.asarray(time, float), np.asarray(values, float)
    if time.ndim != 1 or time.shape != values.shape or len(time) < 4:
        raise UsageError(f"a spectrum needs at least four samples, not {values.shape}")
    if not (np.isfinite(time).all() and np.isfinite(values).all()):
        raise UsageError("a spectrum needs finite numbers")
    step = float(time[-1] - time[0]) / (len(time) - 1)
    if not (step > 0 and np.abs(np.diff(time) - step).max() <= UNEVEN_INTERVAL * step):
        raise UsageError("the samples are not evenly spaced in time")
    return step, values
