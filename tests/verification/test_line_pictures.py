"""What the report of a line draws: spectra, voids along the line, sections at their limit; and that
none of it depends on other lines."""

from __future__ import annotations

import json

import numpy as np
import pytest

from track_line.beam import Track
from track_line.beds import Scatter, Zone
from track_line.laws import get_law
from track_line.scene import run
from track_line.scene.page import tabulate_records
from track_line.settling import BANDS, Axle, Record, make_line
from track_line.settling.level import measure_spectrum
from track_line.settling.march import march_line, start_line
from trackbed.command import main
from trackbed.scenes import read_template


def test_a_wave_is_in_its_band_and_noise_in_all() -> None:
    """A/sqrt(2) of a wave in the band that has it, but for 1 % that the window spreads; the squares
    of white noise add up to its variance, as far as it is within the bands, and go as their
    widths."""
    place = 0.6 * np.arange(3001)
    wave = np.cos(2 * np.pi * place / 6.7)
    found = measure_spectrum(np.stack([wave, -2 * wave]), 0.6)
    band = int(np.flatnonzero((BANDS[:-1] > 6.7) & (BANDS[1:] <= 6.7))[0])
    assert found[band] == pytest.approx(np.sqrt(5 / 4), rel=0.01)
    assert np.delete(found, band).max() < 0.02
    noise = np.random.default_rng(4).normal(size=(200, 3001))
    power = measure_spectrum(noise, 0.6) ** 2
    share = np.diff(1 / BANDS) / (1 / (2 * 0.6))  # of frequencies up to the highest, 1/1.2 m
    np.testing.assert_allclose(power[6:], share[6:], rtol=0.05)


def test_voids_are_where_a_bridge_ends() -> None:
    """Sleepers beside beds that do not settle hang in all lines, those far away in none."""
    zone = Zone(begin=40.0, end=60.0, stiffness=5.0, settlement=0.0)
    line = make_line(100.0, Track(), get_law("shenton")(), (Axle(load=200e3),),
                     Scatter(stiffness=0.0, settlement=0.01), zones=(zone,), lines=4)  # fmt: skip
    *_, (_, record) = march_line(line, start_line(line), 1e5)
    place = line.beds.place[line.inside]
    assert record.hanging.shape == place.shape
    assert (record.hanging[(place > 38.5) & (place < 39.9)] == 1).any()
    assert (record.hanging[(place < 20) | (place > 80)] == 0).all()


def test_a_section_at_its_limit_stays_there_until_it_is_tamped() -> None:
    """The share that has reached the limit never falls, though D1 may."""
    one = np.zeros((2, 1))
    deviations = [[1.0, 0.5], [2.0, 1.0], [1.9, 1.5], [1.8, 2.5]]
    records = [Record(k, one[:, 0], np.array([d]).T, one, one[:, 0], one, one)
               for k, d in enumerate(deviations, 1)]  # fmt: skip
    assert tabulate_records(records, 4.0, 2.0)[:, -1].tolist() == [0, 0.5, 0.5, 1]


def test_lines_with_memory_do_not_depend_on_their_number() -> None:
    """The scatter is renewed by each line's own settlement: two lines of six are those of two, on
    blocks that both kinds of runs may have."""

    def settle(lines: int) -> np.ndarray:
        line = make_line(60.0, Track(), get_law("shenton")(), (Axle(load=200e3),),
                         Scatter(settlement=0.3, memory=1e-3, length=20.0),
                         lines=lines)  # fmt: skip
        *_, (state, record) = march_line(line, start_line(line), 1e4)
        assert np.ptp(record.settlement) > 1e-4  # lines differ by more than a step of renewal
        return state.settled[:2]

    np.testing.assert_allclose(settle(6), settle(2), rtol=1e-9)


@pytest.mark.long
def test_another_limit_needs_no_other_run(tmp_path, capsys, monkeypatch):
    """A finished run goes on at its last state, says when a later limit is reached, and its
    manifest has that limit; another seed is another run, and another speed where masses roll."""
    scene, folder, begins = tmp_path / "line.toml", tmp_path / "line-run", []
    scene.write_text(read_template("line"))
    sets = ("line.length=60", "line.realisations=2", "line.axles=1e3")
    words = ["line", str(scene), "--no-pictures", *(w for s in sets for w in ("--set", s))]
    assert main(words) == 0

    def march(line, state, end, **given):
        begins.append(state.cycle)
        return march_line(line, state, end, **given)

    monkeypatch.setattr(run, "march_line", march)
    assert main([*words, "--resume", "--set", "line.limit=1e-6"]) == 0
    assert begins == [0, 1e3, 0]  # what is ahead, by a short line; the run; its check
    assert json.loads((folder / "result.json").read_text())["share_over_limit"] == 1
    assert json.loads((folder / "manifest.json").read_text())["scene"]["line"]["limit"] == 1e-6
    assert main([*words, "--resume", "--set", "line.seed=2"]) == 2
    assert "line.seed: 1 there, 2 now" in capsys.readouterr().err
    rolling = [*words, "--set", "axle.0.unsprung_mass=800.0"]
    assert main([*rolling, "--force"]) == 0
    assert main([*rolling, "--resume", "--set", "line.speed=50.0"]) == 2
    assert "rolling_speed: 40.0 there, 50.0 now" in capsys.readouterr().err
