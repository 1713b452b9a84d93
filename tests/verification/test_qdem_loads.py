"""Sleeper and loads: modes against beams, a train against its closed-form spectrum, bad records."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.linalg import eigh

from qdem_fem import Body, Simulation
from qdem_fem.element.material import Material
from qdem_fem.files.errors import ConditionError, MeshError, NotConverged
from qdem_fem.grains.hulls import GrainRecipe, draw_grain
from qdem_fem.grains.meshing import make_grain_tetrahedra
from qdem_fem.mesh.tetrahedra import TetMesh, element_gradients, lumped_mass
from qdem_fem.report.spectra import fourier_spectrum
from qdem_fem.track.loads.rail import Track, seat_share
from qdem_fem.track.loads.record import LoadRecord, load_record_read, load_record_write
from qdem_fem.track.loads.train import (
    Train,
    WheelFlat,
    find_seat_forces,
    make_train_record,
    train_spectrum,
)
from qdem_fem.track.sleeper_mesh import SleeperShape, sleeper_mesh
from qdem_fem.track.sleeper_modes import find_free_modes
from trackbed.command import main

CONCRETE = Material(young=45e9, poisson=0.167, density=2350)
TRACK = Track()


# --- sleeper ------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(
    top=st.floats(0.1, 0.24), centre=st.floats(0.08, 0.174), end=st.floats(0.08, 0.174),
    along=st.integers(6, 20),
)  # fmt: skip
def test_mesh_fills_the_shape(top: float, centre: float, end: float, along: int) -> None:
    """All faces of the shape are planes between stations, so its tetrahedra fill it exactly."""
    shape = SleeperShape(top_width=top, centre_height=centre, end_height=end)
    mesh = sleeper_mesh(shape, along, 3, 2)
    _, volumes = element_gradients(mesh.nodes, mesh.elements)
    assert volumes.sum() == pytest.approx(shape.volume, rel=1e-12)
    np.testing.assert_allclose(np.ptp(mesh.nodes, axis=0), [2.0, 0.24, 0.174], rtol=1e-12)


def test_sets_lie_where_they_say() -> None:
    shape = SleeperShape(end_height=0.14)
    mesh = sleeper_mesh(shape, 40, 4, 3)
    seat = mesh.nodes[mesh.node_sets["seat-1"]]
    assert (seat[:, 0].min(), seat[:, 0].max()) == pytest.approx((0.369, 0.499))
    np.testing.assert_allclose(seat[:, 2], 0.174)
    assert np.ptp(seat[:, 1]) == pytest.approx(0.17)
    other = mesh.nodes[mesh.node_sets["seat-2"]]
    np.testing.assert_allclose(np.sort(2 - other[:, 0]), np.sort(seat[:, 0]))
    x = [mesh.nodes[mesh.node_sets[name]][0, 0] for name in ("S1", "S2", "S3")]
    np.testing.assert_allclose(x, [0, 0.499, 1.0])
    assert (mesh.nodes[mesh.node_sets["bottom"], 2] == 0).all()


def test_box_modes_are_those_of_a_beam() -> None:
    """A slender free box: Euler-Bernoulli bending (kL)^2 = 22.373, 61.673, less shear and rotary
    inertia, which take (1 + E/(k G)) (r/L)^2 (kL)^2/2 or so: 0.4 % and 1.1 % at r/L = 1/139, and
    a wave along it, c/2 L, less the inertia of its sides: (nu pi r/L)^2, nothing here."""
    shape = SleeperShape(width=0.05, height=0.05, top_width=0.05, centre_height=0.05,
                         end_height=0.05)  # fmt: skip
    modes = find_free_modes(sleeper_mesh(shape, 30, 1, 1), CONCRETE, 12, quadratic=True)
    wave = sqrt(45e9 / 2350)
    vertical = modes.frequency[[kind == "vertical" for kind in modes.kind]]
    beam = np.array([22.373, 61.673]) / (2 * pi * 4) * wave * 0.05 / sqrt(12)
    assert (vertical[:2] < 1.005 * beam).all()  # elements are stiffer by their O(h^4)
    np.testing.assert_allclose(vertical[:2], beam, rtol=0.012)
    lateral = modes.frequency[[kind == "lateral" for kind in modes.kind]]
    np.testing.assert_allclose(lateral[:2], vertical[:2], rtol=5e-3)


def test_twist_and_stretch_of_the_paper_s_block() -> None:
    """2 x 0.24 x 0.174 m: torsion sqrt(G J/(rho I_p))/2 L with Saint-Venant's J of a rectangle,
    axial c/2 L less (nu pi r/L)^2/2: 0.03 %.  Three cells over the width are 0.6 % too stiff in
    torsion, and converge."""
    b, h = 0.24, 0.174
    modes = find_free_modes(sleeper_mesh(SleeperShape(top_width=b), 24, 3, 3), CONCRETE, 9, True)
    odd = np.arange(1, 40, 2)
    torsion = b * h**3 / 3 * (1 - 192 * h / (pi**5 * b) * (np.tanh(odd * pi * b / 2 / h)
                                                           / odd**5).sum())  # fmt: skip
    polar = b * h * (b**2 + h**2) / 12
    shear = 45e9 / 2 / 1.167
    expected = {
        "torsion": sqrt(shear * torsion / 2350 / polar) / 4,
        "axial": sqrt(45e9 / 2350) / 4,
    }
    for kind, frequency in expected.items():
        assert modes.frequency[modes.kind.index(kind)] == pytest.approx(frequency, rel=0.008)


def test_modes_of_a_grain_scale_with_its_size() -> None:
    """A body that is no beam, with slices of a single node: f goes with 1/size, and E with f^2."""
    form = draw_grain(np.random.default_rng(0), GrainRecipe())
    mesh = make_grain_tetrahedra(form.nodes, form.corner_faces)
    small = TetMesh(0.01 * mesh.nodes, mesh.elements)
    soft = Material(young=45e7, poisson=0.167, density=2350)
    frequency = find_free_modes(mesh, CONCRETE, 4).frequency
    np.testing.assert_allclose(
        find_free_modes(small, CONCRETE, 4).frequency, 100 * frequency, rtol=1e-9
    )
    np.testing.assert_allclose(find_free_modes(mesh, soft, 4).frequency, frequency / 10, rtol=1e-9)


def test_modes_are_found_again_to_the_bit_and_are_those_of_the_whole_matrix() -> None:
    """No draw decides them: from one start in forty the six rigid motions were found as five.

    The stiffness matrix is the forces of unit displacements, by QDEM's own elements.
    """
    form = draw_grain(np.random.default_rng(0), GrainRecipe())
    mesh = make_grain_tetrahedra(form.nodes, form.corner_faces)
    found = [find_free_modes(mesh, CONCRETE, 6) for _ in range(2)]
    assert np.array_equal(found[0].shape, found[1].shape)
    gradient, volume = element_gradients(mesh.nodes, mesh.elements)
    full = np.concatenate([-gradient.sum(axis=1, keepdims=True), gradient], axis=1)
    stretch = np.einsum("eai,ebj->eaibj", full, full) * volume[:, None, None, None, None]
    crossed = stretch.transpose(0, 1, 4, 3, 2)
    along = np.einsum("eakbk->eab", stretch)[:, :, None, :, None] * np.eye(3)[:, None]
    blocks = CONCRETE.lame_first * stretch + CONCRETE.lame_second * (crossed + along)
    at = (3 * mesh.elements[:, :, None] + np.arange(3)).reshape(-1, 12)
    matrix = np.zeros((3 * len(mesh.nodes),) * 2)
    np.add.at(matrix, (at[:, :, None], at[:, None]), blocks.reshape(-1, 12, 12))
    mass = lumped_mass(mesh.elements, volume, CONCRETE.density, len(mesh.nodes))
    value = eigh(matrix, np.diag(np.repeat(mass, 3)), eigvals_only=True)[6:12]
    np.testing.assert_allclose(found[0].frequency, np.sqrt(value) / 2 / pi, rtol=1e-9)


def test_modes_of_two_blocks_are_refused() -> None:
    one = sleeper_mesh(SleeperShape(), 6, 1, 1)
    nodes = np.vstack([one.nodes, one.nodes + np.array([0.0, 1.0, 0.0])])
    elements = np.vstack([one.elements, one.elements + len(one.nodes)])
    with pytest.raises(NotConverged, match="more than six motions"):
        find_free_modes(TetMesh(nodes, elements), CONCRETE, 8)


@pytest.mark.parametrize(
    "wrong",
    [{"length": 0.0}, {"top_width": 0.3}, {"end_height": 0.2}, {"centre_height": 0.2},
     {"seat_distance": 1.95}, {"height": float("nan")}],
)  # fmt: skip
def test_measures_of_no_sleeper_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(MeshError, match=f"{next(iter(wrong))} = .* makes no sleeper"):
        SleeperShape(**wrong)
    with pytest.raises(MeshError, match="5 cells along"):
        sleeper_mesh(SleeperShape(), 5, 1, 1)


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
    shares = seat_share(place + spacing * np.arange(-reach, reach + 1), track)
    assert shares.sum() == pytest.approx(1, abs=1e-12)


def test_share_is_that_of_zimmermann_s_beam() -> None:
    """EI w'''' + u w = 0 off the wheel: shares of a narrow sleeper are u w a, checked with w as
    a finite difference of itself; at the wheel P/(2 L) a."""
    track = Track(spacing=1e-3)
    length = track.elastic_length
    assert seat_share(np.zeros(1), track)[0] == pytest.approx(1e-3 / 2 / length, rel=1e-3)
    x, h = np.linspace(0.5, 3, 6), 0.02
    w = [seat_share(x + k * h, track) for k in (-2, -1, 0, 1, 2)]
    fourth = (w[0] - 4 * w[1] + 6 * w[2] - 4 * w[3] + w[4]) / h**4
    bent, carried = track.rail_stiffness * fourth, track.modulus * w[2]
    np.testing.assert_allclose(bent, -carried, atol=2e-3 * np.abs(carried).max())
    assert seat_share(np.array([3.2 * pi / 4 * length]), track)[0] < 0  # the rail lifts


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
    struck = seat_share(2 * pi * 0.43 * np.arange(-3, 9), TRACK).sum()
    got = trapezoid(added[:, 0], time)
    assert got == pytest.approx(2 / pi * 60e3 * 1e-3 * struck, rel=2e-3)  # it moves 32 mm meanwhile


def test_spectrum_is_the_closed_form() -> None:
    """The transform of the samples is that of the load but for aliases, (f/10 kHz)^-5 of it, and
    the cut ends, e^-12."""
    train = Train()
    lead = (12 * TRACK.elastic_length + 0.3) / train.speed
    time = np.arange(-round(lead * 10000) - 5000, 45000) / 10000
    force = find_seat_forces(time, train, TRACK)[:, 0]
    frequency, got = fourier_spectrum(time, force)
    exact = train_spectrum(frequency, train, TRACK)
    assert np.abs(got - exact).max() < 3e-6 * np.abs(exact[0])
    assert abs(exact[0]) == pytest.approx(20 * 50e3 * 0.6 / 32, rel=1e-12)


def test_peaks_of_the_spectrum_are_at_multiples_of_speed_over_car_length() -> None:
    """Every local peak that is no side lobe (22 % of its main one) lies within a third of the width
    of a lobe, v/(8 cars), of n v/car length; pairs of axles and bogies say which n are weak."""
    train = Train(cars=8)
    step = train.speed / train.car_length
    frequency = np.linspace(0.5 * step, 12.5 * step, 4801)
    size = np.abs(train_spectrum(frequency, train, TRACK))
    inner = size[1:-1]
    peak = (inner > size[:-2]) & (inner > size[2:]) & (inner > 0.4 * size.max())
    order = frequency[1:-1][peak] / step
    assert len(order) == 3
    assert np.abs(order - np.rint(order)).max() < 1 / train.cars / 3
    weak = train_spectrum(np.array([train.speed / 2 / train.bogie_distance]), train, TRACK)
    assert abs(weak[0]) < 1e-9 * size.max()


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


def test_record_is_linear_between_samples(tmp_path: Path) -> None:
    """Read back to nine digits; between samples exactly the chord, outside the end values."""
    made = make_train_record(Train(cars=1), TRACK, 0.0221)
    path = tmp_path / "train.csv"
    load_record_write(path, made)
    record = load_record_read(path)
    np.testing.assert_allclose(record.pressure, made.pressure, rtol=1e-8, atol=1e-3)
    series = record.seat(2)
    for k in (0, 1000, len(record.time) - 2):
        between = series(0.75 * record.time[k] + 0.25 * record.time[k + 1])
        chord = 0.75 * record.pressure[k, 1] + 0.25 * record.pressure[k + 1, 1]
        assert between == pytest.approx(chord, rel=1e-9)
    assert series(-1.0) == record.pressure[0, 1]
    force = record.force(1, area=0.0221, down=[0, 0, -1])
    middle = float(record.time[2000])
    np.testing.assert_allclose(
        force(middle), [0, 0, -record.pressure[2000, 0] * 0.0221], rtol=1e-12
    )


def test_a_free_sleeper_takes_up_the_impulse_of_the_record() -> None:
    """Both seats loaded by a record in steps: momentum is the integral of the forces, its moment
    about the centre that of their difference."""
    record = LoadRecord(np.arange(5) * 1e-4, np.outer(np.arange(5.0), [2e5, 1e5]))
    body = Body(sleeper_mesh(SleeperShape(), 12, 2, 1), CONCRETE)
    simulation = Simulation([body])
    for seat in (1, 2):
        nodes = body.mesh.node_sets[f"seat-{seat}"]
        simulation.load(body, nodes, record.force(seat, 0.0221, [0, 0, -1]))
    duration = 3e-4
    simulation.advance(duration)
    time = simulation.time
    _, volumes = element_gradients(body.nodes, body.elements)
    mass = lumped_mass(body.elements, volumes, 2350.0, len(body.nodes))
    momentum = mass @ body.velocity
    # forces grow in proportion to time: integral q t^2/2, of a sum over steps to their length
    slope = 0.0221 * 3e5 / 1e-4
    lag = simulation.step / time
    assert momentum[2] == pytest.approx(-slope * time**2 / 2, rel=2 * lag)
    arm = body.nodes[:, 0] - 1.0
    turning = (mass * arm) @ body.velocity[:, 2]
    expected = 0.566 * slope / 3 * time**2 / 2
    assert turning == pytest.approx(expected, rel=2 * lag)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        ("time,rp1\n0,1\n0.0001,2\n", "no column rp2"),
        ("", "the file is empty"),
        ("time,rp1,rp2\n", "no rows"),
        ("time,rp1,rp2\n0,1,2\n", "two or more times"),
        ("time,rp1,rp2\n0,1,2\n0.0001,x,3\n", "'x' is not a number"),
        ("time,rp1,rp2\n0,1,2\n0.0001,nan,3\n", "not a finite number"),
        ("time,rp1,rp2\n0,1,2\n0,1,2\n", "does not increase"),
        ("time,rp1,rp2\n0,1,2\n0.0001,1,2\n0.0003,1,2\n", "sampled evenly"),
        ("time,rp1,rp2\n0,1,2\n0.1,1,2\n0.2,1,2\n", "sampled at 10 Hz, not 10000 Hz"),
    ],
)
def test_bad_records_are_refused_with_a_sentence(tmp_path: Path, content: str, word: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(content)
    with pytest.raises(ConditionError, match=word) as caught:
        load_record_read(path)
    assert "record.csv" in str(caught.value)
    assert "->" in str(caught.value)


def test_no_file_other_rates_and_wrong_seats(tmp_path: Path) -> None:
    with pytest.raises(ConditionError, match="can not read the series"):
        load_record_read(tmp_path / "none.csv")
    path = tmp_path / "slow.csv"
    path.write_text("time,rp1,rp2\n0,1,2\n0.1,1,2\n0.2,1,2\n")
    record = load_record_read(path, rate=None)
    assert record.rate == pytest.approx(10)
    with pytest.raises(ConditionError, match="rail seat 3"):
        record.seat(3)
    with pytest.raises(ConditionError, match="area of 0"):
        record.force(1, 0.0, [0, 0, -1])
    with pytest.raises(ConditionError, match="shape"):
        LoadRecord(np.arange(3.0), np.zeros((3, 3)))


def test_command_writes_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "train.csv"
    assert main(["train", "--cars", "1", "--out", str(path)]) == 0
    assert "10000 Hz" in capsys.readouterr().out
    assert load_record_read(path).pressure.max() > 1e5


def test_command_gives_wheels_flats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Over the sleeper the flat of axle 2 strikes with its peak times the seat's share; an axle
    that is none, or half of one, is refused."""
    paths = [tmp_path / "round.csv", tmp_path / "flat.csv"]
    flat = ["--flat", "2", "60e3", "2e-3"]
    for path, more in zip(paths, ([], flat), strict=True):
        assert main(["train", "--cars", "1", *more, "--out", str(path)]) == 0
    even, struck = (load_record_read(path).pressure for path in paths)
    centre = 60e3 * seat_share(np.zeros(1), TRACK)[0] / (0.13 * 0.17)
    assert (struck - even).max() == pytest.approx(centre, rel=0.01)
    for axle in ("4", "0.5", "-1", "nan"):
        assert main(["train", "--cars", "1", "--flat", axle, *flat[2:], "--out", str(path)]) == 3
    assert "on axle nan" in capsys.readouterr().err


def test_command_refuses_with_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", "--speed", "-3", "--out", str(tmp_path / "train.csv")]) == 3
    assert "speed = -3.0" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
