"""Figures of a track run on made-up records: mobility, silence, settlement by axle, short runs."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import periodogram

from qdem_fem.files.output import Table
from qdem_fem.files.series import Series
from qdem_fem.report.spectra import BANDWIDTH, find_mobility, smooth_spectrum, transform_record
from qdem_fem.report.track import (
    FEWEST_SAMPLES,
    GRAINS,
    SENSORS,
    average_between,
    describe_smoothing,
    draw_track_pictures,
    find_acceleration_spectrum,
    find_grain_mobility,
    find_peaks,
    list_track_facts,
)

STEP = 1e-4


def load_of(force: np.ndarray, step: float = STEP) -> Series:
    """A force along z, sampled evenly from 0 on."""
    values = np.zeros((len(force), 3))
    values[:, 2] = force
    return Series(step * np.arange(len(force)), values)


def pushed(force: np.ndarray, spring: float, damper: float) -> np.ndarray:
    """Displacement of k u + c u' = F from rest at every sample, F linear between them, exactly."""
    decay, moved = np.exp(-spring / damper * STEP), np.zeros(len(force))
    for i, (now, then) in enumerate(pairwise(force)):
        lag = (then - now) / STEP * damper / spring**2
        moved[i + 1] = (moved[i] - now / spring + lag) * decay + then / spring - lag
    return moved


def test_mobility_of_a_damped_spring_under_noise() -> None:
    """|i w/(k + i w c)| up to 1 kHz.  Both spectra are of the same noise: all that it leaves is the
    slope of this over the window, k^2/(w (k^2 + w^2 c^2)) 2 pi 20 Hz = 2.5e-3 at 200 Hz, less from
    there on.  (A force half-way between samples in place of its mean: 1.7 % too much at 1 kHz.)"""
    spring, damper = 1e6, 5e3
    count = 4000
    force = np.random.default_rng(1).standard_normal(count)
    force *= np.sin(np.pi * np.clip(np.arange(count) / 3000, 0, 1)) ** 2
    time = STEP * np.arange(count)
    frequency, ratio = find_grain_mobility(time, pushed(force, spring, damper), load_of(force))
    seen = frequency >= 200
    omega = 2 * np.pi * frequency[seen]
    exact = np.abs(1j * omega / (spring + 1j * omega * damper))
    assert ratio[seen] == pytest.approx(exact, rel=2.5e-3)


@pytest.mark.parametrize("every", [1, 3, 7])
def test_a_load_sampled_otherwise_is_averaged_over_intervals(every: int) -> None:
    """Means of a chain of chords, by hand: each has the area of its trapezoids; and those of a
    parabola sampled finely are its integral's differences, to h^2/12 of its curvature."""
    time = np.array([0.0, 1.0, 2.0, 3.0])
    assert average_between(time, np.array([0.5, 1.5]), np.array([2.0, 4.0])) == pytest.approx(
        [0.5 * 2 + 0.5 * 2.5, 0.5 * 3.5 + 0.5 * 4, 4.0]
    )
    time = 0.1 * every * np.arange(10)
    fine = np.linspace(0, 9, 901)
    expected = np.diff(time**3) / 3 / np.diff(time)
    assert average_between(time, fine, fine**2)[: len(time) - 1] == pytest.approx(
        expected, abs=0.01**2 / 6 * 1.01
    )


def test_smoothing_leaves_silence_silent() -> None:
    """A load that has nothing above 200 Hz says nothing there, but for the reach of the window,
    16/u = 173 Hz: nan, whatever the grain does.  Its greatest amplitude is 1e16 times that of
    round-off, which transforms would leave everywhere."""
    frequency = np.arange(2001) * 0.5
    amplitude = np.where(frequency < 200, 1e3, 0.0)
    smooth = smooth_spectrum(frequency, amplitude)
    assert not smooth[frequency > 375].any()
    time = 1e-3 * np.arange(2000)
    force = np.exp(-(((time - 1.0) / 0.01) ** 2))  # |F| < 1e-17 of its greatest from 200 Hz on
    shaken = np.random.default_rng(2).standard_normal(2000)
    found, ratio = find_mobility(time, force, shaken)
    assert np.isnan(ratio[found > 400]).all()
    assert np.isfinite(ratio[found < 20]).all()


def test_a_grain_that_rings_at_once_has_no_low_frequencies_of_its_own() -> None:
    """Pushed aside by s it rings at 3.5 kHz and settles: |A| = 2 pi f s w0^2/|w0^2 - w^2 + 2i c w|,
    from 100 to 400 Hz 2 pi f s to (f/3.5 kHz)^2 = 1.3 %; 20 Hz see the slope, 1 % at 100 Hz.  Its
    velocity in the first interval is 25 times as much as that at 100 Hz."""
    time = STEP * np.arange(4000)
    ringing, decay, aside = 2 * np.pi * 3500.0, 100.0, 1e-9
    moved = aside * (1 - np.exp(-decay * time) * np.cos(ringing * time))
    frequency, size = find_acceleration_spectrum(time, moved)
    seen = (frequency >= 100) & (frequency <= 400)
    assert size[seen] == pytest.approx(2 * np.pi * frequency[seen] * aside, rel=0.025)
    assert moved[1] / STEP > 20 * size[seen].min()


def test_density_of_a_spectrum_is_scipys_and_holds_the_variance() -> None:
    """2 |X|^2/T is the one-sided density: scipy's, line by line, and its integral the mean square
    (Parseval: without the factor 2 at zero and at the highest frequency).  Smoothed over b the
    level of white noise, 2 sigma^2 dt, is met within 4 sqrt(1/(b T)/lines apart)."""
    count = 8000
    time = STEP * np.arange(count)
    noise = 3.0 * np.random.default_rng(5).standard_normal(count)
    frequency, spectrum = transform_record(time, noise)
    duration = count * STEP
    density = 2 * np.abs(spectrum) ** 2 / duration
    density[[0, -1]] /= 2
    other, expected = periodogram(noise, 1 / STEP, detrend=False)
    assert frequency == pytest.approx(other)
    assert density == pytest.approx(expected, rel=1e-9)
    assert density.sum() / duration == pytest.approx((noise**2).mean(), rel=1e-12)
    smooth = 2 * smooth_spectrum(frequency, np.abs(spectrum), BANDWIDTH) ** 2 / duration
    apart = len(smooth) / (BANDWIDTH * duration)
    level = 2 * 9.0 * STEP
    assert smooth[5:-5].mean() == pytest.approx(
        level, rel=4 / np.sqrt(apart * BANDWIDTH * duration)
    )


def test_peaks_at_the_edges_and_in_constants_are_none() -> None:
    frequency = np.arange(6.0)
    assert find_peaks(frequency, np.array([9.0, 1, 2, 1, 1, 9])) == [2.0]
    assert find_peaks(frequency, np.full(6, 3.0)) == []
    assert find_peaks(frequency, np.array([0.0, 1, np.nan, 1, 2, 0])) == [4.0]


def rows_written(folder: Path, count: int) -> None:
    """A table of probes of a track at ``count`` samples."""
    names = [f"{name}_{axis}" for name in (*GRAINS, *SENSORS, "sleeper") for axis in "xyz"]
    table = Table(folder / "probes.csv", ["time", *names])
    table.begin()
    time = STEP * np.arange(count)
    table.append(np.column_stack([time, *(len(names) * [1e-3 * time**2])]))


@pytest.mark.long
@pytest.mark.parametrize("count", [2, FEWEST_SAMPLES - 1, FEWEST_SAMPLES])
def test_a_run_too_short_for_spectra_ends_with_the_rest(tmp_path: Path, count: int) -> None:
    """Settlement is there, spectra from four accelerations on; a window that smooths nothing is
    not claimed."""
    rows_written(tmp_path, count)
    load = load_of(np.linspace(0, -1, count))
    facts = list_track_facts(tmp_path, load)
    assert facts["B2"]["settlement"] == pytest.approx(-1e-3 * ((count - 1) * STEP) ** 2)
    assert ("peaks" in facts["S1"]) == ("peaks" in facts["B2"]) == (count >= FEWEST_SAMPLES)
    assert (
        ("peaks" in facts["S1"]) == ("mobility_peaks" in facts["B1"]) == (count >= FEWEST_SAMPLES)
    )
    said = dict(draw_track_pictures(tmp_path, load))
    assert len(said) == (6 if count >= FEWEST_SAMPLES else 2)
    assert any("not smoothed" in caption for caption in said.values()) == (count >= FEWEST_SAMPLES)
    assert describe_smoothing(np.linspace(0.0, 0.05, 9)) == "Parzen window of 20 Hz"
