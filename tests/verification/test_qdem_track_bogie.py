"""Scenes of a track: flats of a bogie's wheels against the command's record, what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from qdem_fem.cli.track import SEAT_AREA
from qdem_fem.files.errors import SceneError
from qdem_fem.files.output import read_table
from qdem_fem.scene.checks import load_scene
from qdem_fem.track import bearing
from qdem_fem.track import enter as track_scene
from qdem_fem.track.bogie import RISE, make_bogie_series
from qdem_fem.track.enter import TrackPrepared
from qdem_fem.track.loads.rail import QUIET, Track, find_seat_share
from qdem_fem.track.loads.train import Train
from trackbed.command import main
from validation.bench.track_trials import SCENE

SHARE = 0.13  # of `SCENE`
LEAD = QUIET * Track().elastic_length + Track().spacing / 2
"""With this one a bogie begins where the command's train does, so both are sampled alike."""
SPEED = Train().speed
TURN = 2 * np.pi * 0.43


def load_of(folder: Path, bogie: str, *overrides: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and force on the seat of `SCENE`'s slice under a bogie, downwards [N]."""
    path = folder / "scene.toml"
    pressure = SCENE[SCENE.index("pressure = {") :].split("\n")[0]
    path.write_text(SCENE.replace(pressure, f"bogie = {{ {bogie} }}"), encoding="utf-8")
    prepared = load_scene(path, overrides)
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
        pressures.append(read_table(tmp_path / name)["rp1"])
    table = ", ".join(f"{{ axle = {a}, peak = {p}, duration = {d} }}" for a, p, d in flats)
    time, round_load = load_of(tmp_path, f"lead = {LEAD}")
    _, flat_load = load_of(tmp_path, f"lead = {LEAD}, flat = [{table}]")
    full = (time > RISE) & (time < (2 * LEAD + 2.1) / SPEED - RISE)
    expected = SHARE * SEAT_AREA * (pressures[1] - pressures[0])[: len(time)][full]
    assert np.abs(expected).max() > 0.9 * SHARE * 60e3 * find_seat_share(np.zeros(1), Track())[0]
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
        expected = SHARE * 60e3 * find_seat_share(np.array([place]), Track())[0]
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
    assert (-make_bogie_series(train, Track(), SHARE, 2.0, 0.05).values[:, 2] == default).all()


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


@pytest.mark.long
@pytest.mark.parametrize(
    ("bogie", "said"),
    [
        # v 0.01 s = 0.32 m: nearer, the half-cosine would take a part of the first axle's load
        ("lead = 0.319", "give a lead of 0.32 m or more"),
        ("lead = 1.0, speed = 300.0", "give a lead of 3 m or more, or less speed"),
        ("speed = 1e-9", "give more speed, less lead or less rest"),
        ("lead = 1e12", "give more speed, less lead or less rest"),
        ("rest = 1e15", "give more speed, less lead or less rest"),
        ("roughness = { highest = 5001 }", "at most 5000 Hz"),
        ("roughness = { highest = 1e15 }", "at most 5000 Hz"),
        ("speed = 0.1, roughness = { highest = 5000 }", "or a lower highest frequency"),
        ("roughness = { amplitude = 1e6 }", "leaves the rail"),
    ],
)
def test_a_bogie_no_record_holds_is_refused_by_key(tmp_path: Path, bogie: str, said: str) -> None:
    """Before any array of that size is asked for."""
    with pytest.raises(SceneError, match=said) as caught:
        load_of(tmp_path, bogie)
    assert "track.bogie: " in str(caught.value)
    assert "trackbed new track-small FOLDER" in str(caught.value)


def test_a_bogie_as_near_as_may_be_has_all_of_its_load(tmp_path: Path) -> None:
    """Over the sleeper the front axle's share is there to the last part of the half-cosine."""
    time, force = load_of(tmp_path, f"lead = {RISE * SPEED + 1e-9}")
    expected = SHARE * 50e3 * find_seat_share(np.array([0.0, -2.1]), Track()).sum()
    assert np.interp(RISE, time, force) == pytest.approx(expected, rel=1e-3)


def test_a_run_that_ends_before_the_bogie_has_passed_says_so(tmp_path, capsys) -> None:
    """(2 x 1 m + 2.1 m)/(32 m/s) = 0.128 s."""
    load_of(tmp_path, "lead = 1.0")
    words = ["qdem", str(tmp_path / "scene.toml"), "--dry-run"]
    assert main(words) == 0
    assert "bogie's passing: it takes 0.1281 s, this run 0.015 s" in capsys.readouterr().out
    assert main([*words, "--set", "simulation.duration=0.13"]) == 0
    assert "passing" not in capsys.readouterr().out


def test_a_record_of_the_load_belongs_to_the_run(tmp_path: Path) -> None:
    """Its digest is among the files, by which a resumed run knows that it goes on with the same."""
    (tmp_path / "record.csv").write_text("time,p\n0,0\n0.004,700e3\n", encoding="utf-8")
    path = tmp_path / "scene.toml"
    pressure = SCENE[SCENE.index("pressure = {") :].split("\n")[0]
    record = 'pressure = { csv = "record.csv", value = "p" }'
    path.write_text(SCENE.replace(pressure, record), encoding="utf-8")
    digests = [load_scene(path).files["record.csv"]]
    (tmp_path / "record.csv").write_text("time,p\n0,0\n0.004,701e3\n", encoding="utf-8")
    digests.append(load_scene(path).files["record.csv"])
    assert len(set(digests)) == 2
    path.write_text(SCENE.replace(pressure, record.replace('"p"', '"q"')), encoding="utf-8")
    with pytest.raises(SceneError, match="there is no column q among time, p"):
        load_scene(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("track.width=0.264", "the sleeper with its spheres is 0.264 m wide"),
        ("simulation.gravity=[0, 0, 9.81]", "must point down"),
        ("simulation.gravity=[9.81, 0, 0]", "must point down"),
        ("track.bed=none/bed.npz", "track.bed: there is no folder"),
        ("contact.modulus=1e9", "contact.modulus: the model 'spheres' does not use it"),
        ("simulation.precision=float32", "contact is computed in double precision"),
        (
            "roller=[{ body = 'sleeper', nodes = { set = 'top' }, normal = [0, 0, 1] }]",
            "roller: .track. makes the",
        ),
    ],
)
def test_an_impossible_track_is_refused(tmp_path: Path, change: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load_of(tmp_path, "lead = 1.0", change)


def test_a_scene_writes_no_bed_outside_its_folder(tmp_path: Path) -> None:
    """Unless the user says where: a scene may come from anyone."""
    load_of(tmp_path, "lead = 1.0")
    path = tmp_path / "scene.toml"
    text = re.sub(r"(?m)^bed = .*", 'bed = "../bed.npz"', path.read_text(encoding="utf-8"))
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=r"track\.bed: a scene writes into its own folder, not"):
        load_scene(path)
    prepared = load_scene(path, ("track.bed=../bed.npz",))
    assert isinstance(prepared, TrackPrepared)


def test_device_of_a_scene_is_of_its_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run on a processor that says it was on a GPU is none."""

    class Begun(Exception):
        """The options that a simulation would begin with."""

    def begin(*_: object, **options: object) -> None:
        raise Begun(options)

    monkeypatch.setattr(track_scene, "prepare_bed", lambda *_: None)
    monkeypatch.setattr(bearing, "run_in", lambda *_: (None, None))
    monkeypatch.setattr(bearing, "begin_bed", begin)
    load_of(tmp_path, "lead = 1.0")
    prepared = load_scene(tmp_path / "scene.toml", ("simulation.device=cuda",))
    assert isinstance(prepared, TrackPrepared)
    with pytest.raises(Begun) as caught:
        track_scene.enter_track(prepared)
    (options,) = caught.value.args
    assert options["device"] == "cuda"


def test_no_room_beside_the_sleeper_is_refused_before_grains_fall(tmp_path, capsys) -> None:
    """Grains of 70 mm between a sleeper of 240 mm and walls 300 mm apart; no file is begun."""
    load_of(tmp_path, "lead = 1.0")
    change = ["--set", "track.width=0.3", "--set", "track.below=2", "--set", "track.beside=1"]
    assert main(["qdem", str(tmp_path / "scene.toml"), *change]) == 3
    assert "track, beside the sleeper: grains up to 0.07" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["scene.toml"]
