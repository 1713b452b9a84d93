"""Longitudinal level after EN 13848: wavelengths of 3 to 25 m (D1), its standard deviation.

The gain is that of a Butterworth band-pass of fourth order once, 1/sqrt(2) at 3 and 25 m, without
its phase: filtering there and back, as is common, has the square of it, and finds a tenth less.
The numbers of the standard are from memory; check them in yours.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfreqz

from track_line.arrays import Floats


@dataclass(frozen=True)
class Passband:
    """What of a level is counted, and over which lengths."""

    shortest: float = 3.0  # [m]
    longest: float = 25.0  # [m]
    section: float = 200.0  # of which a standard deviation is taken [m]
    margin: float = 30.0
    """At each end, computed but not counted: free ends settle 2.45 times as far [m]."""
    fade: float = 10.0  # of the margin, where the level fades to its mean, for it has to repeat [m]


LEVEL = Passband()

ALERT = ((80, 2.3e-3), (120, 1.8e-3), (160, 1.4e-3), (230, 1.2e-3), (300, 1.0e-3))
"""Speed up to which [km/h], standard deviation of D1 at the alert limit, its lower end [m]."""


BANDS = 96.0 / 2 ** (np.arange(19) / 3)
"""Ends of the bands of wavelength of a spectrum, each a third of an octave [m]."""


def find_alert_limit(speed: float) -> float:
    """Standard deviation of D1 [m] at which to plan tamping, at a speed [m/s]."""
    return next((limit for most, limit in ALERT if 3.6 * speed <= most), ALERT[-1][1])


def fade_ends(level: Floats, spacing: float) -> Floats:
    """Levels (..., n) [m] less their mean, which repeat as a Fourier transform takes them to do."""
    n = level.shape[-1]
    ends = np.minimum(np.arange(n), np.arange(n)[::-1]) * spacing / LEVEL.fade
    level = level - level.mean(axis=-1, keepdims=True)
    return np.asarray(level * (0.5 - 0.5 * np.cos(np.pi * np.clip(ends, 0.0, 1.0))))


def smooth_level(level: Floats, spacing: float) -> Floats:
    """D1 of levels (..., n) [m] at seats ``spacing`` [m] apart, margins at both ends with it."""
    n, level = level.shape[-1], fade_ends(level, spacing)
    band = [1 / LEVEL.longest, 1 / LEVEL.shortest]
    filters = butter(2, band, "bandpass", fs=1 / spacing, output="sos")
    _, gain = sosfreqz(filters, np.fft.rfftfreq(n, spacing), fs=1 / spacing)
    return np.asarray(np.fft.irfft(np.fft.rfft(level) * abs(gain), n))


def measure_deviations(level: Floats, spacing: float) -> Floats:
    """Standard deviation of D1 in each section of levels (b, n) [m], shape (b, sections) [m].

    A line is divided into equal sections of `Passband.section` or a little more or less.
    """
    cut = round(LEVEL.margin / spacing)
    inside = smooth_level(level, spacing)[:, cut : level.shape[1] - cut]
    sections = max(1, round(inside.shape[1] * spacing / LEVEL.section))
    parts = np.array_split(inside, sections, axis=1)
    return np.stack([part.std(axis=1) for part in parts], axis=1)


def measure_spectrum(level: Floats, spacing: float) -> Floats:
    """Root mean square of levels (b, n) [m] in each of `BANDS`, over all lines, shape (bands,) [m].

    Without the margins, through a Hann window; 0 where a line is too short for a band.
    """
    cut = round(LEVEL.margin / spacing)
    inside = level[:, cut : level.shape[1] - cut]
    n, window = inside.shape[1], np.hanning(inside.shape[1])
    waves = np.fft.rfft((inside - inside.mean(axis=1, keepdims=True)) * window)
    power = 2 * (abs(waves) ** 2).mean(axis=0) / (n * (window**2).sum())
    total, _ = np.histogram(np.fft.rfftfreq(n, spacing), 1 / BANDS, weights=power)
    return np.sqrt(total)


def find_crossings(tonnage: Floats, deviation: Floats, limit: float) -> Floats:
    """Tonnage (k,) at which each deviation (k, ...) first reaches a limit; inf where it does not.

    Linear in between; the units are the caller's.
    """
    over = deviation >= limit
    later = np.clip(over.argmax(axis=0), 1, None)
    pick = later[None]
    high, low = (np.take_along_axis(deviation, at, 0)[0] for at in (pick, pick - 1))
    share = np.clip((limit - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    found = tonnage[later - 1] + share * (tonnage[later] - tonnage[later - 1])
    return np.where(over[0], tonnage[0], np.where(over.any(axis=0), found, np.inf))
