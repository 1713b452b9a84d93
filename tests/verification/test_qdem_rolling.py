"""Rolling on rough rails: beam and contact against their definitions, power, phases, refusals."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from qdem_fem.cli.track import SEAT_AREA
from qdem_fem.files.errors import ConditionError, SceneError
from qdem_fem.files.output import read_table
from qdem_fem.scene.checks import load_scene
from qdem_fem.track.bogie import make_bogie_series
from qdem_fem.track.enter import TrackPrepared
from qdem_fem.track.loads import roughness as load_roughness
from qdem_fem.track.loads.rail import QUIET, Track, find_seat_share
from qdem_fem.track.loads.rolling import (
    STEEL_MODULUS,
    Rolling,
    find_force_response,
    find_foundation_stiffness,
    find_hertz_contact,
    find_rail_receptance,
    find_rolling_forces,
    find_seat_response,
    roll_on_rail,
)
from qdem_fem.track.loads.roughness import (
    RAIL,
    WAVELENGTHS,
    WHEEL,
    Roughness,
    draw_roughness_lines,
    find_contact_filter,
    find_roughness_power,
)
from qdem_fem.track.loads.train import Train, make_train_record
from trackbed.command import main
from validation.bench.track_trials import SCENE

TRACK, ROLLING, SPEED, LOAD = Track(), Rolling(), 32.0, 50e3
NO_LOSS = Rolling(pad_loss=1e-12, ballast_loss=1e-12)
SILENT = (-400.0,) * 35


def test_slow_rail_is_the_static_one() -> None:
    slow = np.array([1e-4])
    length = TRACK.elastic_length
    assert find_foundation_stiffness(slow, TRACK, NO_LOSS)[0].real == pytest.approx(TRACK.modulus)
    deflection = find_rail_receptance(slow, TRACK, NO_LOSS)[0]
    assert deflection == pytest.approx(length**3 / (8 * TRACK.rail_stiffness), rel=1e-9)
    places = np.linspace(-6, 6, 41)
    taken = find_seat_response(places, slow, TRACK, NO_LOSS)[:, 0]
    np.testing.assert_allclose(taken, find_seat_share(places, TRACK), atol=1e-10)


def test_a_sleeper_that_swings_by_itself_asks_nothing_of_the_rail() -> None:
    """At w^2 = k/m of half a sleeper on its ballast, 1/k = 1/(modulus times spacing) - 1/pad;
    losses of 1e-12 are left."""
    ballast = 1 / (1 / (TRACK.modulus * TRACK.spacing) - 1 / NO_LOSS.pad)
    alone = np.array([(ballast / NO_LOSS.sleeper) ** 0.5 / (2 * pi)])
    assert abs(find_foundation_stiffness(alone, TRACK, NO_LOSS)[0]) < 1e-11 * TRACK.modulus


@pytest.mark.parametrize("frequency", [40.0, 200.0, 370.0, 900.0])
def test_rail_is_the_integral_over_its_wavenumbers(frequency: float) -> None:
    """w(x) = 1/(2 pi) integral e^(i q x)/(E I q^4 + s - w^2 m) dq; a seat takes s w over a, so its
    integrand has a sinc(q a/2) besides.  Beyond 400/m the integrand is below 1/(E I q^4), of which
    1/(3 pi 400^3) is left; trapezia are far finer than the poles are from the axis."""
    some = np.array([frequency])
    support = find_foundation_stiffness(some, TRACK, ROLLING)[0]
    inertia = (2 * pi * frequency) ** 2 * ROLLING.rail_mass
    q = np.linspace(-400, 400, 400_001)
    kernel = 1 / (TRACK.rail_stiffness * q**4 + support - inertia) / (2 * pi)
    left = 1 / (3 * pi * 400**3 * TRACK.rail_stiffness)
    deflection = np.trapezoid(kernel, q)
    assert abs(find_rail_receptance(some, TRACK, ROLLING)[0] - deflection) < 2 * left
    places = np.array([0.0, 0.2, 0.3, -0.7, 2.0])
    half = np.sinc(q * TRACK.spacing / 2 / pi) * TRACK.spacing
    expected = [np.trapezoid(support * half * kernel * np.exp(1j * q * x), q) for x in places]
    taken = find_seat_response(places, some, TRACK, ROLLING)[:, 0]
    np.testing.assert_allclose(taken, expected, atol=2 * left * abs(support) * TRACK.spacing)


def test_contact_is_the_slope_of_hertz_law() -> None:
    radius = (ROLLING.wheel_radius * ROLLING.head_radius) ** 0.5

    def approach(load: float) -> float:
        return float((3 * load / (4 * STEEL_MODULUS * radius**0.5)) ** (2 / 3))

    size, stiffness = find_hertz_contact(LOAD, ROLLING)
    slope = 2.0 / (approach(LOAD + 1) - approach(LOAD - 1))
    assert stiffness == pytest.approx(slope, rel=1e-6)
    assert size**2 == pytest.approx(radius * approach(LOAD), rel=1e-9)


def test_contact_filter_is_the_directives() -> None:
    """Table G-2 of the directive [dB]: wheel load 50 kN, diameter 920 mm, waves of 100 to 25 mm.
    Its contact is not a circle but longer along the rail."""
    printed = [-0.1, -0.3, -0.6, -1.1, -1.3, -3.5, -5.3]
    waves = 10.0 ** np.arange(-1.0, -1.65, -0.1)
    size, _ = find_hertz_contact(LOAD, Rolling(wheel_radius=0.46))
    level = 20 * np.log10(find_contact_filter(SPEED / waves, SPEED, size))
    np.testing.assert_allclose(level, printed, atol=1.5)


def test_a_slow_wheel_follows_the_rail() -> None:
    """F -> -M w^2 r where nothing gives way; at high frequency the contact's spring is left."""
    slow, fast = np.array([0.05]), np.array([1e6])
    force = find_force_response(slow, SPEED, LOAD, TRACK, ROLLING)
    assert force[0] == pytest.approx(-600.0 * (0.1 * pi) ** 2, rel=1e-4)
    _, stiffness = find_hertz_contact(LOAD, ROLLING)
    force = find_force_response(fast, 1e9, LOAD, TRACK, ROLLING)
    assert abs(force[0]) == pytest.approx(stiffness, rel=1e-2)


@pytest.mark.parametrize("levels", [*RAIL.values(), *WHEEL.values()], ids=[*RAIL, *WHEEL])
def test_power_of_a_roughness_is_the_sum_of_its_third_octaves(levels: tuple[float, ...]) -> None:
    """The directive's mean square, (1 um)^2 sum of 10^(L/10) over its bands, at any speed.

    Between two middles, where the level is linear, the integral is tanh(d/2)/(d/2) of the mean of
    both ends, d = ln of their ratio: 0.3 dB less for 4 dB; the one step of 8 dB is among many."""
    for speed in (10.0, 32.0, 90.0):
        first, last = speed / (WAVELENGTHS[[0, -1]] * 10.0 ** np.array([0.05, -0.05]))
        frequency = np.geomspace(first, last, 20_001)
        whole = np.trapezoid(find_roughness_power(levels, frequency, speed), frequency)
        printed = 10 ** (np.array(levels) / 10)
        assert 10 * np.log10(whole / 1e-12 / printed.sum()) == pytest.approx(0, abs=0.3)


def test_a_realisation_has_its_power_in_every_line() -> None:
    """Parseval over the length that it repeats after, and line by line by a transform."""
    length = 2 * pi * 0.43
    rough = Roughness(wheel="composite", seed=4, highest=1500.0)
    frequency, lines = draw_roughness_lines(WHEEL["composite"], length, SPEED, rough, [0, 1])
    count = 512
    time = np.arange(count) * length / SPEED / count
    height = (np.exp(2j * pi * np.outer(time, frequency)) @ lines).real
    power = find_roughness_power(WHEEL["composite"], frequency, SPEED) * SPEED / length
    assert height.var() == pytest.approx(power.sum(), rel=1e-12)
    found = 2 * np.abs(np.fft.rfft(height) / count)[1 : len(lines) + 1]
    np.testing.assert_allclose(found, np.sqrt(2 * power), rtol=1e-9)


def test_spectrum_of_the_force_is_the_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the length that the rail repeats after, line by line, sqrt(2 S df) |H|."""
    monkeypatch.setitem(load_roughness.WHEEL, "disc", SILENT)
    length, count = 2 * (QUIET * TRACK.elastic_length + TRACK.spacing / 2), 2048
    time = np.arange(count) * length / SPEED / count
    contact, _ = roll_on_rail(
        time, SPEED, LOAD, 1, TRACK, ROLLING, Roughness("average", highest=900.0), 0
    )
    frequency = np.arange(1.0, int(900 * length / SPEED) + 1) * SPEED / length
    power = find_roughness_power(RAIL["average"], frequency, SPEED) * SPEED / length
    expected = np.sqrt(2 * power) * np.abs(
        find_force_response(frequency, SPEED, LOAD, TRACK, ROLLING)
    )
    found = 2 * np.abs(np.fft.rfft(contact[:, 0]) / count)[1 : len(frequency) + 1]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation of two series."""
    return float(one @ other / np.linalg.norm(one) / np.linalg.norm(other))


def test_wheels_of_a_rail_read_the_same_rail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where wheels are smooth, every axle leaves the same behind, later; smooth rails leave the
    wheels', which have nothing to do with each other."""
    time, rough = np.arange(-400, 400) / 1e4, Roughness(highest=700.0)
    arguments = (TRACK, ROLLING, rough, 1)
    monkeypatch.setitem(load_roughness.WHEEL, "disc", SILENT)
    contact, taken = roll_on_rail(time, SPEED, LOAD, 3, *arguments)
    np.testing.assert_allclose(contact, np.repeat(contact[:, :1], 3, axis=1), atol=1e-9)
    whole = find_rolling_forces(
        time, SPEED, np.array([0.0, 64 * 3.2e-3]), np.array([LOAD, LOAD]), TRACK, rough
    )
    np.testing.assert_allclose(whole[64:, 1], taken[64:, 0] + taken[:-64, 0], atol=1e-6)
    assert abs(alike(*whole.T)) < 0.5  # the other rail is another one
    monkeypatch.undo()
    monkeypatch.setitem(load_roughness.RAIL, "smooth", SILENT)
    contact, _ = roll_on_rail(time, SPEED, LOAD, 2, *arguments)
    assert abs(alike(*contact.T)) < 0.5


@pytest.mark.long
def test_load_is_a_seeds_own_linear_and_nothing_without_roughness() -> None:
    def series(*rough: Roughness) -> np.ndarray:
        return make_bogie_series(Train(cars=1), TRACK, 0.4, 1.0, 0.0, 1e4, *rough).values[:, 2]

    smooth = series()
    one, again = (series(Roughness(highest=500.0)) for _ in range(2))
    assert (one == again).all()
    assert (series(Roughness(highest=500.0, amplitude=0.0)) == smooth).all()
    twice = series(Roughness(highest=500.0, amplitude=2.0))
    np.testing.assert_allclose(twice - smooth, 2 * (one - smooth), atol=1e-8)
    other = series(Roughness(highest=500.0, seed=2))
    assert np.std(other - one) > 0.5 * np.std(one - smooth)
    assert not one[[0, -1]].any()


@pytest.mark.long
def test_a_record_of_rough_rails_is_written_by_the_command(tmp_path: Path) -> None:
    """Fast, so that there is little of it; the far axles of both ends leave little there."""
    words = ["train", "--out", str(tmp_path / "train.csv"), "--cars", "1", "--speed", "90"]
    assert main([*words, "--roughness", "smooth", "--seed", "3"]) == 0
    train, rough = Train(cars=1, speed=90.0), Roughness("smooth", seed=3)
    made = make_train_record(train, TRACK, SEAT_AREA, roughness=rough)
    even = make_train_record(train, TRACK, SEAT_AREA)
    found = read_table(tmp_path / "train.csv")
    written = np.stack([found["rp1"], found["rp2"]], axis=1)
    np.testing.assert_allclose(written, made.pressure, atol=1e-2)
    added = np.abs(made.pressure - even.pressure)
    assert added[[0, -1]].max() < 0.1 * added.max()
    with pytest.raises(SystemExit):
        main([*words, "--roughness", "rusty"])
    assert main([*words, "--seed", "3"]) == 2


@pytest.mark.parametrize(
    ("made", "word"),
    [
        (lambda: Roughness(rail="rusty"), "use a rail of smooth, average"),  # type: ignore[arg-type]
        (lambda: Roughness(amplitude=-1.0), "not negative"),
        (lambda: Rolling(pad=1e6, unsprung=0.0), "unsprung"),
        (lambda: find_foundation_stiffness(np.ones(1), TRACK, Rolling(pad=1e6)), "softer than"),
        (lambda: roll_on_rail(np.arange(99) / 1e3, SPEED, LOAD, 1, TRACK, ROLLING,
                              Roughness(amplitude=40.0, highest=300.0), 0), "leaves the rail"),
    ],
)  # fmt: skip
def test_rolling_that_can_not_be_is_refused(made: object, word: str) -> None:
    with pytest.raises(ConditionError, match=word):
        made()  # type: ignore[operator]


def test_a_scene_names_its_roughness(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    pressure = SCENE[SCENE.index("pressure = {") :].split("\n")[0]
    bogie = "bogie = { lead = 0.5, rest = 0, roughness = { rail = 'average', highest = 300 } }"
    path.write_text(SCENE.replace(pressure, bogie), encoding="utf-8")
    rough, smooth = (
        load_scene(path, changes) for changes in ((), ("track.bogie.roughness.amplitude=0",))
    )
    assert isinstance(rough, TrackPrepared)
    assert isinstance(smooth, TrackPrepared)
    assert np.abs(rough.load.values - smooth.load.values).max() > 10.0
    path.write_text(SCENE.replace(pressure, bogie.replace("average", "rusty")), encoding="utf-8")
    with pytest.raises(SceneError, match="rail"):
        load_scene(path)
