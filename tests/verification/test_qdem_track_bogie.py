"""The bogie of a scene: its wheels' flats against the command's record, what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qdem_fem.errors import SceneError
from qdem_fem.load_record import load_record_read
from qdem_fem.load_train import QUIET, Track, Train, seat_share
from qdem_fem.scene_checks import scene_load
from qdem_fem.track_cli import SEAT_AREA
from qdem_fem.track_load import RISE, bogie_series
from qdem_fem.track_scene import TrackPrepared
from trackbed import main
from validation.track_trials import SCENE

SHARE = 0.13
"""Of `SCENE`."""
LEAD = QUIET * Track().elastic_length + Track().spacing / 2
"""With this one a bogie begins where the command's train does, so both are sampled alike."""
SPEED = Train().speed
TURN = 2 * np.pi * 0.43


def load_of(folder: Path, bogie: str, *overrides: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and force on the seat of `SCENE`'s slice under a bogie, downwards [N]."""
    path = folder / "scene.toml"
    pressure = SCENE[SCENE.index("pressure = {") :].split("\n")[0]
    path.write_text(SCENE.replace(pressure, f"bogie = {{ {bogie} }}"), encoding="utf-8")
    prepared = scene_load(path, overrides)
    assert isinstance(prepared, TrackPrepared)
    return prepared.load.times, -prepared.load.values[:, 2]


def test_flats_of_a_scene_are_those_of_the_command(tmp_path: Path) -> None:
    """What flats add to the slice is what they add to the command's record, times seat and share,
    wherever the bogie's load is not just growing or dying; the file has nine digits of 3 MPa."""
    flats = [(0, 60e3, 2e-3), (1, -20e3, 5e-4)]
    words = ["train", "--cars", "1", "--out"]
    asked = [str(word) for flat in flats for word in ("--flat", *flat)]
    pressures = []
    for name, more in (("round.csv", []), ("flat.csv", asked)):
        assert main([*words, str(tmp_path / name), *more]) == 0
        pressures.append(load_record_read(tmp_path / name).pressure[:, 0])
    table = ", ".join(f"{{ axle = {a}, peak = {p}, duration = {d} }}" for a, p, d in flats)
    time, round_load = load_of(tmp_path, f"lead = {LEAD}")
    _, flat_load = load_of(tmp_path, f"lead = {LEAD}, flat = [{table}]")
    full = (time > RISE) & (time < (2 * LEAD + 2.1) / SPEED - RISE)
    expected = SHARE * SEAT_AREA * (pressures[1] - pressures[0])[: len(time)][full]
    assert np.abs(expected).max() > 0.9 * SHARE * 60e3 * seat_share(np.zeros(1), Track())[0]
    digit = SHARE * SEAT_AREA * 3e6 * 1e-8
    np.testing.assert_allclose((flat_load - round_load)[full], expected, atol=digit)


def test_a_flat_strikes_the_seat_at_every_turn_of_its_wheel(tmp_path: Path) -> None:
    """Half-way through a blow, d = v T/2 past n turns, the seat takes share(n turns + d) of its
    peak; a sample is within 0.05 ms of it, where a half-sine of 2 ms has 1 - (0.05 pi/2)^2/2."""
    time, even = load_of(tmp_path, "lead = 4.0")
    flat = "track.bogie.flat=[{axle=1, peak=60e3, duration=2e-3}]"
    _, struck = load_of(tmp_path, "lead = 4.0", flat)
    added, half = struck - even, 1e-3 * SPEED
    for turn in (-1, 0, 1):
        place = turn * TURN + half
        middle = (4.0 + Train().axle_distance + place) / SPEED
        expected = SHARE * 60e3 * seat_share(np.array([place]), Track())[0]
        found = added[int(np.argmin(np.abs(time - middle)))]
        assert found == pytest.approx(expected, rel=5e-3, abs=1.0)
    place = SPEED * time - 4.0 - Train().axle_distance
    past = place[:, None] - TURN * np.arange(-3, 3)
    assert not added[~((past >= 0) & (past < 2 * half + 1e-9)).any(axis=1)].any()


def test_wheels_are_round_by_default(tmp_path: Path) -> None:
    """The same bits as without the key, with roughness, too."""
    for rough in ("", ", roughness = { highest = 300 }"):
        _, default = load_of(tmp_path, "lead = 2.0" + rough)
        _, none = load_of(tmp_path, "lead = 2.0, flat = []" + rough)
        assert (default == none).all()
    train = Train(cars=1)
    _, default = load_of(tmp_path, "lead = 2.0")
    assert (-bogie_series(train, Track(), SHARE, 2.0, 0.05).values[:, 2] == default).all()


@pytest.mark.parametrize(
    ("flat", "said"),
    [
        (f"{{ axle = 0, peak = 60e3, duration = {1.001 * TURN / SPEED} }}", "longer than a turn"),
        ("{ axle = 2, peak = 60e3, duration = 2e-3 }", "use an axle from 0 to 1"),
        ("{ axle = 0.5, peak = 60e3, duration = 2e-3 }", r"bogie\.flat\.0\.axle"),
        ("{ axle = 0, peak = nan, duration = 2e-3 }", r"bogie\.flat\.0\.peak"),
        ("{ axle = 0, peak = 60e3, duration = 0 }", r"bogie\.flat\.0\.duration: must be above 0"),
        ("{ axle = 0, peak = 60e3 }", r"bogie\.flat\.0\.duration: missing"),
        ("{ axle = 0, peek = 60e3, duration = 2e-3 }", "did you mean peak"),
    ],
)
def test_a_flat_that_can_not_be_is_refused_by_its_key(tmp_path: Path, flat: str, said: str) -> None:
    with pytest.raises(SceneError, match=said) as caught:
        load_of(tmp_path, f"flat = [{flat}]")
    assert "scene.toml:" in str(caught.value)
    assert "track.bogie" in str(caught.value)
