"""Spectra: transforms of known records, the Parzen window's two integrals, fits of damped modes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem.files.errors import UsageError
from qdem_fem.report.spectra import (
    Floats,
    find_amplitudes,
    find_peak_frequencies,
    smooth_spectrum,
    transform_record,
)


def damped(
    time: Floats, frequency: float, decay: float = 0.0, amplitude: float = 1.0, phase: float = 0
) -> Floats:
    """A exp(-decay t) cos(2 pi f t + phase), t from the first sample."""
    t = time - time[0]
    return amplitude * np.exp(-decay * t) * np.cos(2 * np.pi * frequency * t + phase)


def test_amplitude_of_a_cosine() -> None:
    """A cosine of whole periods peaks at its amplitude and frequency; its mean is taken off."""
    time = np.arange(1000) * 1e-3
    frequency, amplitude = find_amplitudes(time, 5 + damped(time, 40, amplitude=3e-4))
    assert frequency[np.argmax(amplitude)] == pytest.approx(40, rel=1e-12)
    assert amplitude.max() == pytest.approx(3e-4, rel=1e-12)
    assert amplitude[0] < 1e-12


def test_fourier_spectrum_of_an_exponential() -> None:
    """exp(-a t), t > 0 transforms to 1 / (a + 2 pi i f), up to dt/2 of the rule's first sample."""
    time, rate = np.arange(200_000) * 1e-5, 60.0
    values = np.exp(-rate * time)
    values[0] = 0.5  # trapezoidal rule; its error is dt^2/12 |a + i w|^2 relative
    frequency, spectrum = transform_record(time, values)
    low = frequency < 100
    exact = 1 / (rate + 2j * np.pi * frequency[low])
    bound = (1e-5 * np.abs(1 / exact)) ** 2 / 12 + 1e-12
    assert (np.abs(spectrum[low] / exact - 1) < 1.1 * bound).all()


def test_parzen_window_has_the_bandwidth_it_is_asked_for() -> None:
    """Of a spectral line it leaves W: integral W df = 1 and 1 / integral W^2 df = bandwidth.

    W(f) = 3/4 u (sin(pi u f/2)/(pi u f/2))^4 with u = 280/(151 b).
    """
    frequency = np.arange(40_001) * 0.05
    line = np.zeros(len(frequency))
    line[20_000] = 1.0
    smooth = smooth_spectrum(frequency, line, 20.0) ** 2 / 0.05
    assert 0.05 * smooth.sum() == pytest.approx(1, rel=1e-6)
    assert 1 / (0.05 * (smooth**2).sum()) == pytest.approx(20, rel=1e-3)
    u = 280 / (151 * 20.0)
    away = frequency - frequency[20_000]
    assert smooth == pytest.approx(0.75 * u * np.sinc(u * away / 2) ** 4, abs=1e-6)


@settings(max_examples=40)
@given(
    frequency=st.floats(0.5, 5e3),
    periods=st.floats(1.5, 12),
    ratio=st.floats(0, 0.15),
    phase=st.floats(0, 6.28),
    offset=st.floats(-3, 3),
    scale=st.sampled_from([1e-9, 1.0, 1e6]),
    start=st.sampled_from([0.0, 3.0]),
    samples=st.integers(60, 900),
)
def test_one_damped_cosine_is_found(
    frequency: float, periods: float, ratio: float, phase: float, offset: float, scale: float,
    start: float, samples: int,
) -> None:  # fmt: skip
    """From 1.5 periods on, any damped cosine about any mean is found to rounding (the goal is
    0.1 %)."""
    time = start + np.linspace(0, periods / frequency, samples)
    decay = 2 * np.pi * frequency * ratio
    values = scale * (offset + damped(time, frequency, decay, 1.0, phase))
    (mode,) = find_peak_frequencies(time, values)
    rounding = 1e-8 + 1e-15 * start * frequency
    assert mode.frequency == pytest.approx(frequency, rel=rounding)
    assert mode.decay == pytest.approx(decay, rel=1e-5, abs=1e-6 * frequency)
    assert mode.amplitude == pytest.approx(scale, rel=1e-5)


def test_modes_of_a_beam_are_separated() -> None:
    """Bending modes at 1 : 6.2 : 17 of falling strength, four periods of the first, with noise."""
    generator = np.random.default_rng(4)
    time = np.arange(0, 4 / 27, 1e-4)
    expected = np.array([27.0, 167.4, 459.0])
    values = 1e-5 * generator.standard_normal(len(time))
    for frequency, amplitude in zip(expected, (1, 0.1, 0.02), strict=True):
        values += damped(time, frequency, 0.01 * frequency, amplitude, generator.uniform(0, 6))
    modes = find_peak_frequencies(time, values, 3)
    assert [mode.frequency for mode in modes] == pytest.approx(expected, rel=1e-3)
    assert [mode.amplitude for mode in modes] == pytest.approx([1, 0.1, 0.02], rel=0.01)


def test_nothing_is_found_in_nothing() -> None:
    """A constant record has no modes; a sum of two cosines has no third."""
    time = np.linspace(0, 1, 200)
    assert find_peak_frequencies(time, np.full(200, 2.0), 2) == []
    two = damped(time, 7) + damped(time, 23.5, 1.0, 0.3)
    assert len(find_peak_frequencies(time, two, 5)) == 2


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ([0, 1, 2], "four samples"),
        ([0, 1, 2, 4], "evenly"),
        ([0, 1, 2, np.nan], "finite"),
        ([0, 0, 0, 0], "evenly"),
    ],
)
def test_uneven_records_are_refused(time: list[float], words: str) -> None:
    """A record that is no even, finite series of four samples is refused."""
    with pytest.raises(UsageError, match=words):
        find_amplitudes(np.array(time, float), np.ones(len(time)))
