"""What is told of several packings: peaks that are none of noise, what they share, intervals."""

from __future__ import annotations

import numpy as np
import pytest

from qdem_fem.scene_series import TimeSeries
from qdem_fem.spectra import fourier_spectrum, parzen_smoothed
from qdem_fem.track_figures import BANDWIDTH, acceleration_spectrum, means_between, mobility
from validation.track_packings import (
    APART,
    grain_acceleration,
    packings_text,
    peaks_shared,
    peaks_standing_out,
    scatter,
)
from validation.track_rolling import LEAD, rolling_text


def test_noise_has_the_scatter_that_is_asked_of_a_peak() -> None:
    """Of white accelerations over 0.24 s the level scatters by 4.34 dB/sqrt(b T), whose double is
    the prominence asked for; a tone in it stands out at its frequency."""
    time = np.arange(2400) / 1e4
    random, spread, told = np.random.default_rng(5), [], []
    for _ in range(20):
        noise = random.standard_normal(len(time))
        bumps = np.cumsum(np.cumsum(noise)) / 1e8
        frequency, size = acceleration_spectrum(time, bumps)
        inner = (frequency > 200) & (frequency < 900)
        spread.append(np.std(20 * np.log10(size[inner])))
        tone = bumps - 0.6 * np.cos(2 * np.pi * 400 * time) / (2 * np.pi * 400) ** 2
        frequency, size = acceleration_spectrum(time, tone)
        told.append(peaks_standing_out(frequency, size, scatter(0.24)))
    assert 2 * np.mean(spread) == pytest.approx(scatter(0.24), rel=0.3)
    assert all(min(abs(f - 400) for f in one) < BANDWIDTH / 2 for one in told)
    assert peaks_shared(told) == pytest.approx([400.0], abs=BANDWIDTH / 4)


def test_peaks_are_shared_by_all_or_not_told() -> None:
    assert peaks_shared([[100.0, 300.0], [305.0, 700.0], [295.0]]) == [300.0]
    assert peaks_shared([[100.0], []]) == []
    assert peaks_standing_out(np.arange(5.0), np.array([1.0, 1.0, 1.3, 1.0, 1.0]), 3.0) == []


def test_a_rise_to_where_nothing_is_known_is_no_peak() -> None:
    """Beside a silent load mobility ends; taken for zero it would stand out by 240 dB."""
    frequency = np.arange(9.0)
    size = np.array([1.0, 2.0, 9.0, np.nan, 9.0, 2.0, 8.0, 2.0, np.nan])
    assert peaks_standing_out(frequency, size, 4.0) == [6.0]
    assert peaks_standing_out(frequency, np.full(9, np.nan), 4.0) == []


def test_acceleration_of_a_grain_follows_from_mobility_and_load() -> None:
    """2 pi f |V| = |A| line by line; 20 Hz see f change by a tenth of itself at 200 Hz, whose
    mean square adds (20 Hz/f)^2/4, and the scatter of noise over the window that of its slope."""
    time = np.arange(4000) / 1e4
    random = np.random.default_rng(3)
    fade = np.sin(np.pi * np.arange(4000) / 3999) ** 2
    force, pushed = (fade * random.standard_normal(4000) for _ in range(2))
    moved = 1e-9 * np.cumsum(np.cumsum(pushed - pushed.mean()))
    moved -= moved[-1] * np.arange(4000) / 3999
    load = TimeSeries(time, np.outer(force, [0.0, 0.0, 1.0]))
    frequency, ratio = mobility(time, moved, load)
    found_at, spectrum = fourier_spectrum(
        (time[1:] + time[:-1]) / 2, means_between(time, time, force)
    )
    of_load = parzen_smoothed(found_at, np.abs(spectrum), BANDWIDTH)
    grid = APART * np.arange(120)
    run = {
        "curves": {
            "B2": np.interp(grid, frequency, np.nan_to_num(ratio)).tolist(),
            "load": np.interp(grid, found_at, of_load).tolist(),
        }
    }
    found = grain_acceleration(run, "B2")
    expected = np.interp(grid, *acceleration_spectrum(time, moved))
    seen = grid > 200
    assert found[seen] == pytest.approx(expected[seen], rel=0.1)


def test_tables_tell_every_run() -> None:
    run = {
        "seed": 2, "friction": 0.577, "bogie": {"lead": LEAD}, "bed": {"creep": 2.5e-4},
        "points": {"B1": {"passages": 2 * [{"greatest": 3e-6, "end": 1e-6}],
                          "lateral_greatest": 1.5e-6, "lateral_over_vertical": 0.5}},
        "energy": {"relative_imbalance": 1e-5}, "cost": {"cpu_s": 700.0}, "prominence": 4.0,
        "peaks": {"load": [395.0], "S2": [100.0, 400.0], "B2": [44.0]},
        "curves": {"load": [1.0] * 60, "B2": [0.0] * 5 + [1.0] * 35 + [9.0] + [1.0] * 19},
    }  # fmt: skip
    shifted = {"load": [395.0], "S2": [404.0], "B2": []}
    other = run | {"seed": 3, "peaks": shifted, "cost": {"cpu_s": 900.0}}
    record = {
        "command": "c",
        "machine": "m",
        "started": "2026-11-23T00",
        "runs": {"a": run, "b": other},
    }
    text = packings_text(record)
    assert "| S2 | 100, 400 | 404 | 402 |" in text
    assert (
        "| peak of the acceleration of S2 near 400 Hz | 402 Hz; the load has one at 395 Hz |"
        in text
    )
    assert "| peak of the acceleration of S2 near 100 Hz | none that all share |" in text
    assert "| acceleration of B2 | 320 | 320 | 320 |" in text
    assert "| peak of the acceleration of B2 near 320 Hz | 320 Hz |" in text
    assert "| mobility of B2 | 44 | none | none |" in text
    assert "| lateral motion larger than vertical | B1 0.5 |" in text
    assert "| processor time [s] | 700 | 900 | 800 |" in text
    assert "| settlement of B1, first axle, greatest [µm] | 3 | 3 | 3 | ± 0 |" in text
    assert "| S2 | 100, 400 |  |" in packings_text(record | {"runs": {"a": run}})
    assert "another friction" not in text
    less = {"passages": 2 * [{"greatest": 2e-6, "end": 0.0}], "lateral_greatest": 1e-6}
    held = {"a": run | {"friction": 1.73, "points": {"B1": less}}}
    pair = packings_text(record | {"runs": {"a": run}, "other": held})
    assert "| quantity [µm] | friction 0.577 | 1.73 | difference | 95 % | less in |" in pair
    assert "| settlement of B1, greatest | 3 | 2 | -1 | ± nan | 1 of 1 |" in pair
    assert "| lateral motion of B1, greatest | 1.5 | 1 | -0.5 |" in pair
    level = {
        "contact": [1.0] * 5,
        "contact_all": 2.0,
        "seat": [3.0] * 5,
        "seat_all": [4.0, 5.0, 6.0],
    }
    keys = ("receptance_peaks", "force_peaks", "seat_peaks", "both_peaks")
    found = rolling_text(
        record | {"load": 5e4, "levels": {"x": level}} | {key: [7.0] for key in keys}
    )
    assert "| | on the seat | 3 | 3 | 3 | 3 | 3 | 4 | 5 | 6 |" in found
