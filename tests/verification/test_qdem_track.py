"""The track: rest by kinetic damping, the viscous account, the bed, loads, and what is drawn."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.cli.run import Progress
from qdem_fem.element.material import Material
from qdem_fem.files.errors import CheckpointError, EnergyLost, NotConverged, SceneError
from qdem_fem.grains.sets import make_grains
from qdem_fem.march import energies, kinetic_damping
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.report.track import find_grain_mobility
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from qdem_fem.scene.energy_account import EnergyAccount, list_energy_facts
from qdem_fem.scene.run import RunFolder, run_dynamic
from qdem_fem.track.bed import Bed, read_bed, scatter, write_bed
from qdem_fem.track.bodies import TrackBox, make_loose_lattice, make_sleeper_slice, place_grains
from qdem_fem.track.bogie import RISE, make_bogie_series
from qdem_fem.track.enter import TrackPrepared, choose_contact
from qdem_fem.track.loads.rail import Track, find_seat_share
from qdem_fem.track.loads.train import Train
from qdem_fem.track.recipe import BedRecipe, make_bed_grains
from qdem_fem.track.sleeper_mesh import SleeperShape
from trackbed.command import main
from trackbed.scene_files.grading import Grading
from validation.bench.track_trials import SCENE, load_track

GRAVITY = (0.0, 0.0, -9.81)
STONE = Material(1e8, 0.2, 2700.0, shear_viscosity=100.0)
RADIUS, STIFFNESS = 0.01, 1e5
GROUND = q.ContactPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
RECIPE = BedRecipe(
    box=TrackBox(0.2, 0.42), below=6, beside=2, seed=3, sizes=(0.026, 0.034),
    shape=SleeperShape(), cells=(2, 3, 2), ballast=STONE, sleeper=STONE, radius=0.012,
    stiffness=(1e9, 2e9), friction=0.5, side_friction=0.0, gravity=GRAVITY, softness=1e-4,
    unbalanced=0.1, kinetic=0.01, loose=0.02, patience=5.0,
)  # fmt: skip


def stacked(rigid: bool) -> q.Simulation:
    """Two cubes of 5 cm, one above the other, a little apart, above the ground."""
    bodies = [
        q.Body(
            make_box_mesh((0.05, 0.05, 0.05), (1, 1, 1), origin=(0.0, 0.0, z)), STONE, rigid=rigid
        )
        for z in (0.0101, 0.0803)
    ]
    contact = q.SphereContact(RADIUS, STIFFNESS, 0.5, (GROUND,))
    return q.Simulation(bodies, gravity=GRAVITY, threads=1, contact=contact)


@pytest.mark.long
@pytest.mark.parametrize(("rigid", "each"), [(True, True), (True, False), (False, True)])
def test_cubes_come_to_rest_on_springs_that_bear_their_weight(rigid: bool, each: bool) -> None:
    # The ground bears both; four mirrored springs of 2 k give way by W/(8 k) if the cube is rigid.
    # What is unbalanced, 1 % of the force on a vertex, leaves at most some per cent of a body's.
    run = stacked(rigid)
    rest = kinetic_damping.find_rest(run, 1e-2, 1e-3, 0.0, 2.0, look=10 if rigid else 40, each=each)
    weight = 9.81 * kinetic_damping.compute_masses(run)
    assert run.contacts is not None
    assert rest.unbalanced <= 1e-2
    assert -run.contacts.plane_force(0)[2] == pytest.approx(weight.sum(), rel=2e-2)
    if rigid:
        overlap = RADIUS - (0.0101 + run.bodies[0].displacement[:, 2].mean())
        assert overlap == pytest.approx(weight.sum() / (8 * STIFFNESS), rel=2e-2)


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its overlap is meant
@pytest.mark.parametrize("surface", [False, pytest.param(True, marks=pytest.mark.long)])
def test_grounded_is_what_stands_on_the_ground_over_others(surface: bool) -> None:
    """A cube that touches another is grounded with it: on the ground, or where gravity is held."""
    contact: Any = q.SphereContact(RADIUS, STIFFNESS, 0.5, (GROUND,))
    gap = 2 * RADIUS
    if surface:
        contact, gap = q.SurfaceContact(1e9, 0.5, depth=2e-3, planes=(GROUND,)), 0.0

    def standing(bottom: float, apart: float, held: str = "", gravity: Any = GRAVITY) -> list[bool]:
        bodies = [
            q.Body(
                make_box_mesh((0.05,) * 3, (1, 1, 1), origin=(0, 0, z)),
                STONE,
                name=name,
                rigid=True,
            )
            for name, z in (("lower", bottom), ("upper", bottom + 0.05 + apart))
        ]
        run = q.Simulation(bodies, gravity=gravity, threads=1, contact=contact)
        if held:
            run.fix(bodies[1], np.arange(8), held)
        return kinetic_damping.find_grounded(run).tolist()

    on_ground = gap / 2 - 1e-4
    assert standing(on_ground, gap - 1e-4) == [True, True]
    assert standing(on_ground, gap + 1e-3) == [True, False]
    assert standing(0.5, gap - 1e-4) == [False, False]
    assert standing(0.5, gap - 1e-4, "xy") == [False, False]
    assert standing(0.5, gap - 1e-4, "z") == [True, True]
    assert standing(0.5, gap + 1e-3, gravity=None) == [True, True]  # nothing falls


@pytest.mark.parametrize("fall", [True, False])
def test_what_falls_is_not_stopped_in_the_air(fall: bool) -> None:
    """A cube is thrown at another high above the ground: momentum p = p_0 + M g t, to round-off.

    Without ``fall`` both are stopped behind their collision, and p is what gravity gave since.
    """
    bodies = [
        q.Body(
            make_box_mesh((0.05,) * 3, (1, 1, 1), origin=(0, 0, z)), STONE, name=str(z), rigid=True
        )
        for z in (1.0, 1.09)
    ]
    contact = q.SphereContact(RADIUS, STIFFNESS, 0.5, (GROUND,))
    run = q.Simulation(bodies, gravity=GRAVITY, threads=1, contact=contact)
    bodies[1].velocity = np.tile([0.0, 0.0, -1.0], (8, 1))
    with pytest.raises(NotConverged):
        kinetic_damping.find_rest(run, 0.0, 0.0, 0.0, 0.05, look=10, fall=fall)
    downward = -sum(body.velocity[:, 2].mean() for body in bodies)
    expected = 1.0 + 2 * 9.81 * run.time
    assert run.time < 0.3  # both are still in the air
    if fall:
        assert downward == pytest.approx(expected, rel=1e-10)
    else:
        assert downward < 0.9 * expected


@pytest.mark.long
def test_grains_that_fall_in_a_column_do_not_stand_as_a_tower() -> None:
    """Eight of the paper's grains in one column of the lattice, scattered, all lie on the ground.

    Plumb, some stand on each other, four high, on processors that round so.
    """
    grains = make_grains(8, 1, None, Grading(np.array([0.022, 0.030]), np.array([0.0, 1.0])))
    placed = make_loose_lattice(place_grains(grains), [(0.0, 0.09, 0.0, 0.09)], 0.0, 0.012, 1)
    material = Material(30e9, 0.2, 2700.0)
    bodies = [
        q.Body(replace(grains.mesh(k), nodes=nodes), material, name=str(k), rigid="lumped")
        for k, nodes in enumerate(placed)
    ]
    scatter(bodies, 1)
    contact = q.SphereContact(0.012, 1.613e5, 0.577, (GROUND,), contacts=1)
    run = q.Simulation(bodies, gravity=GRAVITY, threads=1, contact=contact)
    with suppress(NotConverged):  # by its rounding a machine may leave eight grains rocking
        kinetic_damping.find_rest(run, 0.3, 0.1, 0.2, 3.0, fall=True)
    top = max(float((body.nodes + body.displacement)[:, 2].mean()) for body in bodies)
    assert top < 0.05


@pytest.mark.long
@pytest.mark.parametrize("slow", [2, 100])
def test_what_rings_while_the_sum_of_all_grows_is_stopped_by_itself(slow: int, monkeypatch) -> None:
    """A cube falls, so all together have no peak; the other rings on its springs with a third of
    what bears it, and goes on for ever, unless bodies are stopped one by one now and then."""
    numbers = replace(kinetic_damping.KINETIC, slow_after=slow, looks=200)
    monkeypatch.setattr(kinetic_damping, "KINETIC", numbers)
    mass, size = 2700.0 * 0.05**3, (0.05, 0.05, 0.05)
    sunk, omega = mass * 9.81 / (8 * STIFFNESS), np.sqrt(8 * STIFFNESS / mass)
    places = ((0.0, RADIUS - sunk), (0.2, 2.0))
    bodies = [
        q.Body(make_box_mesh(size, (1, 1, 1), origin=(x, 0.0, z)), STONE, rigid=True)
        for x, z in places
    ]
    contact = q.SphereContact(RADIUS, STIFFNESS, 0.5, (GROUND,))
    run = q.Simulation(bodies, gravity=GRAVITY, threads=1, contact=contact, step=0.1 / omega)
    bodies[0].velocity = np.tile([0.0, 0.0, sunk / 3 * omega], (8, 1))
    rings = []

    def keep(_state: kinetic_damping.Damping) -> None:
        ring = kinetic_damping.find_kinetic_each(run)[0]
        lift = bodies[0].displacement[:, 2].mean()
        rings.append((ring + 4 * STIFFNESS * lift**2) / (mass * (sunk / 3 * omega) ** 2 / 2))

    most = 3.5 * 200 * run.step
    with pytest.raises(NotConverged):
        kinetic_damping.find_rest(run, 0.0, 0.0, 0.0, most, look=1, each=False, keep=keep)
    assert len(rings) == 4
    assert bodies[1].velocity[:, 2] == pytest.approx(-9.81 * run.time, rel=1e-9)
    stopped = slow == 2  # velocities half a step behind: omega dt/2 = 0.05 of the energy at most
    assert rings[:3] == pytest.approx([1.0] * 3, abs=0.07)
    assert rings[3] == pytest.approx(0.0 if stopped else 1.0, abs=0.01 if stopped else 0.07)


def test_no_equilibrium_in_time_is_an_error() -> None:
    with pytest.raises(NotConverged, match=r"asked.*kinetic energy.*bodies loose"):
        kinetic_damping.find_rest(stacked(True), 1e-3, 1e-4, 0.0, 1e-3, look=1)


@pytest.mark.parametrize(("share", "last"), [(0.02, 50), (0.5, kinetic_damping.KINETIC.wait)])
def test_what_does_not_rest_is_left_longer_between_stops(
    share: float, last: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Doubled again and again, up to the time in which a slide gathers way, of looks so long."""
    run, waits = stacked(True), []
    numbers = replace(kinetic_damping.KINETIC, slow_after=2, looks=2, longest_wait=run.step / share)
    monkeypatch.setattr(kinetic_damping, "KINETIC", numbers)

    def keep(state: kinetic_damping.Damping) -> None:
        waits.append(state.wait)

    with pytest.raises(NotConverged):
        kinetic_damping.find_rest(run, 0.0, 0.0, 0.0, 39 * run.step, look=1, keep=keep)
    first = kinetic_damping.KINETIC.wait
    doubled = [min(first * 2 ** (n // 2), max(last, first)) for n in range(1, len(waits) + 1)]
    assert waits == doubled
    assert waits[-1] == last


def shaken(folder: Path, text: str = "") -> tuple[object, ...]:
    """A scene of a viscous block that is struck, with an audit."""
    path = folder / "scene.toml"
    path.write_text(
        """
        [[body]]
        name = "block"
        mesh = { box = { size = [0.2, 0.1, 0.1], cells = [2, 1, 1] } }
        material = { young = 1e8, poisson = 0.2, density = 2000.0, shear_viscosity = 2000.0 }
        [simulation]
        duration = 0.01
        safety = 0.02
        threads = 1
        [[load]]
        body = "block"
        nodes = { set = "x-max" }
        force = { times = [0, 1e-3, 2e-3], values = [[0, 0, 0], [500, 200, 0], [0, 0, 0]] }
        [output]
        energy_interval = 1e-3
        audit = 1e-2
        """
        + text,
        encoding="utf-8",
    )
    prepared = load_scene(path)
    return prepared, *make_simulation(prepared), RunFolder(folder / "run")


def test_what_viscosity_takes_closes_the_account(tmp_path: Path) -> None:
    prepared, run, bodies, folder = shaken(tmp_path)
    with folder.lock():  # type: ignore[attr-defined]
        run_dynamic(prepared, run, bodies, folder, resume=False, progress=Progress())  # type: ignore[arg-type]
    energy = run.energy()  # type: ignore[attr-defined]
    kept = energy.kinetic + energy.elastic + energy.viscous
    assert energy.viscous > 0.05 * energy.external  # or the test shows nothing
    assert kept == pytest.approx(energy.external, rel=1e-2)


def test_a_run_whose_account_is_open_stops(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(energies, "find_viscous_half", lambda run: -float(run.motion.work[2]))
    prepared, run, bodies, folder = shaken(tmp_path)
    with (
        folder.lock(),  # type: ignore[attr-defined]
        pytest.raises(EnergyLost, match="missing in the account"),
    ):
        run_dynamic(prepared, run, bodies, folder, resume=False, progress=Progress())  # type: ignore[arg-type]


def test_account_of_energies_is_the_same_row_by_row() -> None:
    """As `list_energy_facts` of all rows; a maximum that is past still counts."""
    random = np.random.default_rng(3)
    names = ("kinetic", "elastic", "contact", "friction", "external")
    rows = {name: np.cumsum(random.normal(size=20)) ** 2 for name in names}
    account = EnergyAccount()
    for cuts in ((0, 1), (1, 4), (4, 20)):
        account.add_rows({name: one[slice(*cuts)] for name, one in rows.items()})
    whole = list_energy_facts(rows)
    assert account.relative == whole["relative_imbalance"]
    assert account.missing == whole["greatest_imbalance"]
    assert account.last == {name: whole[name] for name in names}


@pytest.mark.parametrize(
    ("text", "allowed"), [("", None), ("audit = 0.5", 0.5), ("[contact]", 1e-3)]
)
def test_where_bodies_touch_the_account_is_looked_at(
    tmp_path: Path, text: str, allowed: float | None
) -> None:
    """By default there and only there."""
    path = tmp_path / "scene.toml"
    touch = 'model = "spheres"\nradius = 0.01\nnormal_stiffness = 1e6\nfriction = 0.5'
    path.write_text(
        f"""
        [[body]]
        name = "block"
        mesh = {{ box = {{ size = [0.2, 0.1, 0.1], cells = [2, 1, 1] }} }}
        material = {{ young = 1e8, poisson = 0.2, density = 2000.0 }}
        [simulation]
        duration = 0.01
        gravity = [0, 0, -9.81]
        [output]
        {text}
        """
        + touch * (text == "[contact]"),
        encoding="utf-8",
    )
    assert load_scene(path).scene.audit == allowed


def test_loose_grains_touch_neither_each_other_nor_walls_nor_sleeper() -> None:
    band = (0.13, 0.29)
    grains = place_grains(make_bed_grains(RECIPE))
    rooms = [(0.0, 0.2, 0.0, band[0]), (0.0, 0.2, band[1], 0.42)]
    placed = make_loose_lattice(grains, rooms, 0.0, RECIPE.radius, 5)
    assert len(placed) == 8
    for i, nodes in enumerate(placed):
        assert (nodes >= RECIPE.radius).all()
        assert (nodes[:, :2] <= np.array([0.2, 0.42]) - RECIPE.radius).all()
        y = nodes[:, 1]
        assert y.max() <= band[0] - RECIPE.radius or y.min() >= band[1] + RECIPE.radius
        for other in placed[:i]:
            apart = np.linalg.norm(nodes[:, None] - other[None], axis=2).min()
            assert apart > 2 * RECIPE.radius


def test_slice_of_a_sleeper_reaches_from_wall_to_wall() -> None:
    block = make_sleeper_slice(RECIPE.shape, RECIPE.box, 0.3, RECIPE.radius, (8, 4, 3))
    ends = block.nodes[block.node_sets["ends"], 0]
    assert ends.min() - RECIPE.radius == pytest.approx(0.0, abs=2e-6)
    assert ends.max() + RECIPE.radius == pytest.approx(0.2, abs=2e-6)
    assert block.nodes[:, 2].min() == pytest.approx(0.3)
    assert len(block.node_sets["seat"]) > 5
    assert block.nodes[block.node_sets["S2"], 0] == pytest.approx(0.1, abs=1e-3)


def test_a_bed_is_read_as_written_and_refused_for_another_recipe(tmp_path: Path) -> None:
    path = tmp_path / "bed.npz"
    nodes = [np.arange(6.0).reshape(2, 3), np.ones((1, 3))]
    bed = Bed("rest", nodes, np.full((3, 3), 0.5), {"contact_slid": np.ones(2)}, {"rest": {}})
    write_bed(path, RECIPE, bed)
    found = read_bed(path, RECIPE)
    assert [x.tolist() for x in found.positions] == [(x + 0.5).tolist() for x in nodes]
    assert found.contact["contact_slid"].tolist() == [1.0, 1.0]
    with pytest.raises(CheckpointError, match="friction differ"):
        read_bed(path, replace(RECIPE, friction=0.6))
    path.write_bytes(b"PK")
    with pytest.raises(CheckpointError, match="no bed"):
        read_bed(path, RECIPE)


def test_the_load_of_a_bogie_is_that_of_its_axles_and_begins_and_ends_at_rest() -> None:
    train, track = Train(cars=1), Track()
    series = make_bogie_series(train, track, 0.4, 3.0, 0.05)
    force = -series.values[:, 2]
    assert force[0] == 0.0
    assert not force[series.times > (6.0 + 2.1) / 32.0].any()
    at = 3.0 / 32.0  # the front axle stands over the sleeper
    expected = (
        0.4
        * 50e3
        * (find_seat_share(np.zeros(1), track) + find_seat_share(np.array([-2.1]), track))
    )
    assert np.interp(at, series.times, force) == pytest.approx(float(expected[0]), rel=1e-3)
    inside = (series.times > RISE) & (series.times < (6.0 + 2.1) / 32.0 - RISE)
    impulse = np.trapezoid(force[inside], series.times[inside])
    whole = 2 * 0.4 * 50e3 * track.spacing / train.speed  # sum of shares is one
    assert impulse == pytest.approx(whole, rel=0.05)  # e^-3.5: what lies beyond 3 m


@pytest.mark.parametrize("samples", [4000, 4001, 4002, 4003])
@pytest.mark.parametrize("interval", [1e-4, 9.9989e-5, 3e-5])
def test_mobility_of_a_grain_that_drops_off(samples: int, interval: float) -> None:
    """A grain that drops by s from one sample to the next has |V| = s at all frequencies, up to the
    highest, as means over intervals have it.  Of the blow J these are J/2, J, J/2: |F| =
    J (1 + cos(2 pi f dt)).  (Central differences have a zero at the highest frequency, and
    smoothing spread what it was divided by over all others.)"""
    time = interval * np.arange(samples)
    middle, slip, impulse = samples // 2, 2e-5, 3.0
    force = np.zeros((samples, 3))
    force[middle - 1 : middle + 1, 2] = impulse / interval  # one sample half-way between them
    drop = np.where(np.arange(samples) < samples - 1, 0.0, slip)  # in the last interval
    frequency, ratio = find_grain_mobility(time, drop, q.Series(time, force))
    assert frequency[-1] > 1000.0 - 1 / (samples * interval) - 1e-6
    blow = impulse * (1 + np.cos(2 * np.pi * frequency * interval))
    exact = slip / blow
    assert ratio[5:] == pytest.approx(exact[5:], rel=1e-2)  # 20 Hz see a curved blow


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("pressure = {", 'bogie = {}\npressure = {'), "give one of pressure, bogie"),
        (("[contact]", "[[fix]]\nbody = 'a'\n[contact]"), "makes the bodies and their conditions"),
        (("radius =", "periodic = {axis='y', width=0.4}\nradius="), "repeats along y"),
        (("sleeper = 2.39e9", "concrete = 2.39e9"), "give {ballast = ..., sleeper = ...}"),
        (("below = 14", "bellow = 14"), "did you mean below"),
        (("gravity = [0, 0, -9.81]", ""), "needs gravity"),
        (("share = 0.13", "share = 0.13\nsizes = [0.01, 0.03]"), "smaller than the radius of a"),
    ],
)  # fmt: skip
def test_a_wrong_track_is_refused_with_a_sentence(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace(*change), encoding="utf-8")
    with pytest.raises(SceneError, match=said.replace("{", r"\{").replace("...", r"\.\.\.")):
        load_scene(path)


def test_skin_and_friction_of_a_scene_are_the_runs(tmp_path: Path) -> None:
    prepared = load_track(tmp_path, "contact.skin=1.5e-3", "contact.friction=0.4")
    contact = choose_contact(prepared)
    assert (contact.skin, contact.friction) == (1.5e-3, 0.4)
    assert prepared.recipe.friction == 0.577


def test_a_dry_run_prepares_no_bed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It tells what comes first, within a second, and writes nothing."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    prepared = load_scene(path)
    assert isinstance(prepared, TrackPrepared)
    count = prepared.recipe.below + prepared.recipe.beside
    assert main(["qdem", str(path), "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "to be prepared first (stages bed to rest, then slow pulses)" in shown
    assert f"the bed: {count} grains" in shown
    assert main(["qdem", str(path), "--dry-run", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bed"]["grains"] == count
    assert [file.name for file in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.long
def test_scene_of_the_small_track_is_sound() -> None:
    prepared = load_scene(Path(__file__).parents[2] / "trackbed" / "scenes" / "track-small.toml")
    assert isinstance(prepared, TrackPrepared)
    assert prepared.recipe.below + prepared.recipe.beside == 300
    assert prepared.scene.simulation.duration == pytest.approx(prepared.load.times[-1], abs=1e-3)
