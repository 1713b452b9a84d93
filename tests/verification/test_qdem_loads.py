"""Sleeper and loads: a train against its closed-form spectrum."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from qdem_fem import Body, Series, Simulation
from qdem_fem.cli.track import SEAT_AREA
from qdem_fem.element.material import Material
from qdem_fem.files.errors import ConditionError, MeshError
from qdem_fem.files.output import read_table
from qdem_fem.mesh.tetrahedra import find_gradients
from qdem_fem.report.spectra import transform_record
from qdem_fem.track.loads.rail import Track, find_seat_share
from qdem_fem.track.loads.train import (
    SEATS,
    LoadRecord,
    Train,
    WheelFlat,
    find_seat_forces,
    make_train_record,
)
from qdem_fem.track.sleeper_mesh import SleeperShape, make_sleeper_mesh
from trackbed.command import main

CONCRETE = Material(young=45e9, poisson=0.167, density=2350)
TRACK = Track()


def train_spectrum(frequency: np.ndarray, train: Train, track: Track) -> np.ndarray:
    """Fourier spectrum of the force on seat 1 without flats [N s], complex (k,).

        X(f) = P a/v sinc(f a/v) 4/(4 + (2 pi f L/v)^4) sum over axles of e^(-2 pi i f x_j/v)

    with sinc(x) = sin(pi x)/(pi x): the sum has its peaks at multiples of speed over car length,
    weighed by 4 cos(pi f b/v) cos(pi f c/v) of bogie distance b and axle distance c (Milne, Le Pen,
    Thompson, Powrie, J. Sound Vib. 397, 2017, 123-140).
    """
    per_metre = frequency / train.speed
    axles = np.exp(-2j * pi * np.outer(per_metre, train.axles)).sum(axis=1)
    load = train.first_share * train.axle_load * track.spacing / train.speed
    beam = 4 / (4 + (2 * pi * per_metre * track.elastic_length) ** 4)
    return np.asarray(load * np.sinc(per_metre * track.spacing) * beam * axles)


# --- sleeper ------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(top=st.floats(0.1, 0.24), along=st.integers(6, 20))
def test_mesh_fills_the_shape(top: float, along: int) -> None:
    """The faces of a sleeper are planes, so its tetrahedra fill it exactly."""
    mesh = make_sleeper_mesh(SleeperShape(top_width=top), along, 3, 2)
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    assert volumes.sum() == pytest.approx(2.0 * 0.174 * (0.24 + top) / 2, rel=1e-12)
    np.testing.assert_allclose(np.ptp(mesh.nodes, axis=0), [2.0, 0.24, 0.174], rtol=1e-12)


def test_sets_lie_where_they_say() -> None:
    mesh = make_sleeper_mesh(SleeperShape(), 40, 4, 3)
    seat = mesh.nodes[mesh.node_sets["seat-1"]]
    assert (seat[:, 0].min(), seat[:, 0].max()) == pytest.approx((0.369, 0.499))
    np.testing.assert_allclose(seat[:, 2], 0.174)
    assert np.ptp(seat[:, 1]) == pytest.approx(0.17)
    other = mesh.nodes[mesh.node_sets["seat-2"]]
    np.testing.assert_allclose(np.sort(2 - other[:, 0]), np.sort(seat[:, 0]))
    x = [mesh.nodes[mesh.node_sets[name]][0, 0] for name in ("S1", "S2", "S3")]
    np.testing.assert_allclose(x, [0, 0.499, 1.0])
    assert (mesh.nodes[mesh.node_sets["bottom"], 2] == 0).all()
    with pytest.raises(MeshError, match="5 cells along"):
        make_sleeper_mesh(SleeperShape(), 5, 1, 1)


# --- train --------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(
    place=st.floats(-5, 5), modulus=st.floats(5e6, 2e8), spacing=st.floats(0.4, 0.8),
    stiffness=st.floats(1e6, 1e7),
)  # fmt: skip
def test_sleepers_share_a_wheel_load(
    place: float, modulus: float, spacing: float, stiffness: float
) -> None:
    """The shares of all sleepers add up to one, wherever the wheel is."""
    track = Track(stiffness, modulus, spacing)
    reach = int(40 * track.elastic_length / spacing) + 20
    shares = find_seat_share(place + spacing * np.arange(-reach, reach + 1), track)
    assert shares.sum() == pytest.approx(1, abs=1e-12)


def test_share_is_that_of_zimmermann_s_beam() -> None:
    """EI w'''' + u w = 0 off the wheel: shares of a narrow sleeper are u w a, checked with w as
    a finite difference of itself; at the wheel P/(2 L) a."""
    track = Track(spacing=1e-3)
    length = track.elastic_length
    assert find_seat_share(np.zeros(1), track)[0] == pytest.approx(1e-3 / 2 / length, rel=1e-3)
    x, h = np.linspace(0.5, 3, 6), 0.02
    w = [find_seat_share(x + k * h, track) for k in (-2, -1, 0, 1, 2)]
    fourth = (w[0] - 4 * w[1] + 6 * w[2] - 4 * w[3] + w[4]) / h**4
    bent, carried = track.rail_stiffness * fourth, track.modulus * w[2]
    np.testing.assert_allclose(bent, -carried, atol=2e-3 * np.abs(carried).max())
    assert find_seat_share(np.array([3.2 * pi / 4 * length]), track)[0] < 0  # the rail lifts


def test_integral_over_time_is_axle_load_times_spacing_over_speed() -> None:
    """Each wheel leaves P a/v, flats the impulse 2/pi peak duration where they strike."""
    train = Train(first_share=0.6)
    record = make_train_record(train, TRACK, area=0.0221)
    impulse = trapezoid(record.pressure, record.time, axis=0) * 0.0221
    expected = 20 * train.axle_load * TRACK.spacing / train.speed * np.array([0.6, 0.4])
    # what is cut off at both ends is below e^-12 of a wheel
    np.testing.assert_allclose(impulse, expected, rtol=1e-5)
    assert record.rate == pytest.approx(10_000)

    time = np.arange(-20000, 80000) / 1e5
    flat = WheelFlat(axle=0, peak=60e3, duration=1e-3, place=-0.5e-3 * train.speed)
    added = find_seat_forces(time, train, TRACK, [flat]) - find_seat_forces(time, train, TRACK)
    struck = find_seat_share(2 * pi * 0.43 * np.arange(-3, 9), TRACK).sum()
    got = trapezoid(added[:, 0], time)
    assert got == pytest.approx(2 / pi * 60e3 * 1e-3 * struck, rel=2e-3)  # it moves 32 mm meanwhile


def test_spectrum_is_the_closed_form() -> None:
    """The transform of the samples is that of the load but for aliases, (f/10 kHz)^-5 of it, and
    the cut ends, e^-12."""
    train = Train()
    lead = (12 * TRACK.elastic_length + 0.3) / train.speed
    time = np.arange(-round(lead * 10000) - 5000, 45000) / 10000
    force = find_seat_forces(time, train, TRACK)[:, 0]
    frequency, got = transform_record(time, force)
    exact = train_spectrum(frequency, train, TRACK)
    assert np.abs(got - exact).max() < 3e-6 * np.abs(exact[0])
    assert abs(exact[0]) == pytest.approx(20 * 50e3 * 0.6 / 32, rel=1e-12)


def flat_of(**changed: float) -> object:
    """The load of the default train with one flat, of 60 kN for 2 ms but for what is changed."""
    sizes = {"axle": 0, "peak": 60e3, "duration": 2e-3} | changed
    return find_seat_forces(np.zeros(1), Train(), TRACK, [WheelFlat(**sizes)])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("made", "word"),
    [
        (lambda: Train(speed=0.0), "speed"),
        (lambda: Train(axle_distance=15.0), "do not nest"),
        (lambda: Train(cars=2.5), "whole number"),  # type: ignore[arg-type]
        (lambda: Train(first_share=1.0), "share"),
        (lambda: Track(modulus=float("nan")), "modulus"),
        (lambda: find_seat_forces(np.zeros(1), Train(), TRACK, [WheelFlat(20, 1, 1)]), "axle 20"),
        (lambda: flat_of(duration=2 * pi * 0.43 / 32 * 1.001), "a flat of 60000.0 N for"),
        (lambda: flat_of(peak=float("nan")), "a flat of nan N"),
        (lambda: flat_of(wheel_radius=float("inf")), "radius inf"),
        (lambda: make_train_record(Train(), TRACK, area=0.0), "area 0"),
        (lambda: make_train_record(Train(), TRACK, area=float("inf")), "area inf"),
        (lambda: make_train_record(Train(speed=1e-9), TRACK, area=1.0), "more speed or fewer cars"),
        (lambda: make_train_record(Train(cars=10**8), TRACK, area=1.0), "more speed or fewer cars"),
    ],
)  # fmt: skip
def test_a_train_that_can_not_be_is_refused(made: object, word: str) -> None:
    with pytest.raises(ConditionError, match=word):
        made()  # type: ignore[operator]


# --- records ------------------------------------------------------------------------------------


def test_a_free_sleeper_takes_up_the_impulse_of_the_record() -> None:
    """Both seats loaded by a record in steps: momentum is the integral of the forces, its moment
    about the centre that of their difference."""
    record = LoadRecord(np.arange(5) * 1e-4, np.outer(np.arange(5.0), [2e5, 1e5]))
    body = Body(make_sleeper_mesh(SleeperShape(), 12, 2, 1), CONCRETE)
    simulation = Simulation([body])
    for seat in (1, 2):
        nodes = body.mesh.node_sets[f"seat-{seat}"]
        push = 0.0221 * record.pressure[:, seat - 1, None] * np.array([0.0, 0.0, -1.0])
        simulation.load(body, nodes, Series(record.time, push))
    duration = 3e-4
    simulation.advance(duration)
    time = simulation.time
    mass = simulation.assembly.mass
    momentum = mass @ body.velocity
    # forces grow in proportion to time: integral q t^2/2, of a sum over steps to their length
    slope = 0.0221 * 3e5 / 1e-4
    lag = simulation.step / time
    assert momentum[2] == pytest.approx(-slope * time**2 / 2, rel=2 * lag)
    arm = body.nodes[:, 0] - 1.0
    turning = (mass * arm) @ body.velocity[:, 2]
    expected = 0.566 * slope / 3 * time**2 / 2
    assert turning == pytest.approx(expected, rel=2 * lag)


def test_command_writes_to_nine_digits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "train.csv"
    assert main(["train", "--cars", "1", "--out", str(path)]) == 0
    assert "10000 Hz" in capsys.readouterr().out
    made = make_train_record(Train(cars=1), TRACK, SEAT_AREA)
    found = read_table(path)
    for seat in (0, 1):
        np.testing.assert_allclose(found[SEATS[seat]], made.pressure[:, seat], rtol=1e-8, atol=1e-3)


def test_command_gives_wheels_flats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Over the sleeper the flat of axle 2 strikes with its peak times the seat's share; an axle
    that is none, or half of one, is refused."""
    paths = [tmp_path / "round.csv", tmp_path / "flat.csv"]
    flat = ["--flat", "2", "60e3", "2e-3"]
    for path, more in zip(paths, ([], flat), strict=True):
        assert main(["train", "--cars", "1", *more, "--out", str(path)]) == 0
    even, struck = (read_table(path)["rp1"] for path in paths)
    centre = 60e3 * find_seat_share(np.zeros(1), TRACK)[0] / (0.13 * 0.17)
    assert (struck - even).max() == pytest.approx(centre, rel=0.01)
    for axle in ("4", "0.5", "-1", "nan"):
        assert main(["train", "--cars", "1", "--flat", axle, *flat[2:], "--out", str(path)]) == 3
    assert "on axle nan" in capsys.readouterr().err


def test_command_refuses_in_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "--speed", "-3", "--out", str(tmp_path / "train.csv")]) == 3
    assert "speed = -3.0" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
