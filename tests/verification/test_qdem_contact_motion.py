"""Bodies that touch: conservation, convergence, thresholds, invariance, history on disk."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import qdem_fem as q
from qdem_fem.contact import window as contact_window
from qdem_fem.contact.search.pairs import SEARCH, choose_skin
from qdem_fem.contact.search.periodic import find_extents
from qdem_fem.contact.spheres.options import SKIN_OF_SPHERES
from qdem_fem.files import Floats
from qdem_fem.files.errors import (
    CheckpointError,
    ConditionError,
    ContactTooDeep,
    SceneError,
    StepWarning,
)
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from tests.qdem_restored import go_on
from tests.qdem_slopes import slope_gain

STONE = q.Material(30e9, 0.2, 2700.0)
SIDE, RADIUS = 0.03, 0.006


def block(name: str = "block", origin: Any = (0, 0, 0), cells: Any = (2, 2, 2)) -> q.Body:
    """A cube of stone, its vertices 15 mm apart."""
    return q.Body(make_box_mesh((SIDE,) * 3, cells, "kuhn", tuple(origin)), STONE, name=name)


def two(
    gap: float = 1e-6,
    shift: Any = (0.0, 0.0),
    stiffness: float = 1e8,
    friction: float = 0.5,
    **options: Any,
) -> q.Simulation:
    """Two cubes, one above the other by ``gap`` [m] more than it takes their spheres to touch."""
    reach = np.sqrt((2 * RADIUS) ** 2 - np.dot(shift, shift))
    above = block("above", (*shift, SIDE + reach + gap))
    touch = q.SphereContact(RADIUS, stiffness, friction, **options.pop("contact", {}))
    return q.Simulation([block("below"), above], threads=1, contact=touch, **options)


def thrown(run: q.Simulation, velocity: Any) -> q.Simulation:
    """The second body with a velocity [m/s]."""
    run.bodies[1].velocity = np.tile(np.asarray(velocity, float), (len(run.bodies[1].nodes), 1))
    return run


def momenta(run: q.Simulation) -> tuple[Floats, Floats]:
    """Momentum [kg m/s] and angular momentum [kg m^2/s] of all bodies."""
    velocity = np.concatenate([body.velocity for body in run.bodies])
    place = np.concatenate([body.nodes + body.displacement for body in run.bodies])
    carried = run.assembly.mass[:, None] * velocity
    return carried.sum(axis=0), np.cross(place, carried).sum(axis=0)


def total(run: q.Simulation) -> float:
    """All energy less the work put in [J]."""
    e = run.energy()
    return e.kinetic + e.elastic + e.contact + e.friction - e.external


# --- conservation --------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_collision_keeps_momentum_and_energy(friction: float) -> None:
    """An oblique, off-centre collision: momentum to rounding, angular momentum without friction.

    Where a contact begins or ends within a step, the trapezoidal rule errs by at most
    ``k (v dt)^2/8``: nine contacts, twice each, and as much again for the nodes' own vibration.
    """
    for step in (1.2e-6, 0.3e-6):
        run = two(shift=(0.004, 0.002), friction=friction, step=step)
        thrown(run, (0.02, 0.01, -0.1))
        (p, spin), before = momenta(run), total(run)
        for _ in range(5):
            run.advance(0.8e-4)
            assert abs(total(run) - before) < 36 * 1e8 * (0.1 * step) ** 2 / 8
        assert run.energy().contact == 0.0
        after = momenta(run)
        assert after[0] == pytest.approx(p, abs=1e-13 * np.linalg.norm(p))
        change, lost = np.linalg.norm(after[1] - spin), run.energy().friction
        if friction == 0.0:
            assert change < 1e-12 * np.linalg.norm(spin)
            assert lost == 0.0
        else:  # the paper's spheres have no spin to take the moment of the tangential force
            assert change > 0.1 * np.linalg.norm(spin)
            assert lost > 0.1 * before


def head_on(step: float, stiffness: float = 1e4) -> q.Simulation:
    """Two cubes that meet squarely at 0.05 m/s each, their spheres just touching."""
    run = two(gap=0.0, stiffness=stiffness, step=step, friction=0.0)
    for body, speed in zip(run.bodies, (0.05, -0.05), strict=True):
        body.velocity = np.tile([0.0, 0.0, speed], (27, 1))
    return run


def test_head_on_collision_converges_at_second_order() -> None:
    """While the contact lasts, halving the step takes the error to a quarter.

    The reference has a sixteenth of the step; vibration of the cubes leaves the ratios between
    3 and 5 at these steps.
    """
    fields = []
    for n in (16, 4, 2, 1):
        run = head_on(2.4e-6 / n)
        run.advance(2.4e-4)
        fields.append(np.concatenate([body.displacement for body in run.bodies]))
    errors = [np.abs(field - fields[0]).max() for field in fields[1:]]
    assert 2.5 < errors[1] / errors[0] < 6
    assert 2.5 < errors[2] / errors[1] < 6
    assert errors[2] < 1e-5 * np.abs(fields[0]).max()


def test_soft_head_on_collision_is_half_a_period_of_one_spring() -> None:
    """Nine springs between two masses: greatest overlap ``v/omega`` after a quarter period; then

    the velocities are exchanged.  What the cubes deform is ``9 k`` over ``E`` times their side,
    1e-4; at corners it is twice as much.
    """
    run = head_on(2.4e-6)
    mass = run.assembly.mass.sum() / 2
    omega = np.sqrt(9 * 1e4 / (mass / 2))
    run.advance(np.pi / omega / 2)
    overlap = run.contacts.touching().overlap
    assert overlap == pytest.approx(np.full(9, 0.1 / omega), rel=2e-4)
    run.advance(np.pi / omega * 0.6)
    for body, speed in zip(run.bodies, (-0.05, 0.05), strict=True):
        assert body.velocity.mean(axis=0)[2] == pytest.approx(speed, rel=1e-4)


# --- friction ------------------------------------------------------------------------------------


def test_block_on_a_slope_slides_above_the_angle_of_friction_and_rests_below() -> None:
    """mu 1 % below ``tan(alpha) = 1/2``: it gains ``g (sin alpha - mu cos alpha)``; 1 % above: it
    stays within a hundredth of that way.

    The cube's elastic rocking changes the pressure by some per mille, a tenth of that per cent.
    """
    gain, rigid, way = slope_gain(0.99)
    assert gain == pytest.approx(rigid, rel=0.1)
    assert way > 1e-5
    assert abs(slope_gain(1.01)[2]) < 1e-7


# --- invariance and history ----------------------------------------------------------------------


def test_units_change_no_bit() -> None:
    """Metres, seconds and kilograms times powers of two: every number scales exactly."""
    fields = []
    for metre, second, kilogram in ((1.0, 1.0, 1.0), (8.0, 4.0, 2.0)):
        pressure = kilogram / (metre * second**2)
        stone = q.Material(30e9 * pressure, 0.2, 2700.0 * kilogram / metre**3)
        bodies = [
            q.Body(make_box_mesh((SIDE * metre,) * 3, (2, 2, 2), "kuhn", place), stone, name=name)
            for name, place in (
                ("below", (0.0, 0.0, 0.0)),
                ("above", (0.001 * metre, 0.0, 0.04195 * metre)),
            )
        ]
        run = q.Simulation(
            bodies, threads=1, step=1.2e-6 * second,
            contact=q.SphereContact(
                0.006 * metre, 1e6 * kilogram / second**2, 0.05,
                planes=[q.ContactPlane((0, 0, -0.00599 * metre), (0, 0, 1))],
            ),
        )  # fmt: skip
        thrown(run, (0.03 * metre / second, 0, -0.2 * metre / second))
        run.advance(40 * run.step)
        e = run.energy()
        assert e.contact > 0
        assert e.friction > 0
        assert run.contacts.plane_force(0).any()
        joule = kilogram * metre**2 / second**2
        fields.append([*(body.displacement / metre for body in bodies),
                       *(body.velocity * second / metre for body in bodies),
                       np.array([e.contact / joule, e.friction / joule])])  # fmt: skip
    for one, other in zip(*fields, strict=True):
        assert np.array_equal(one, other)


def grinding(skin: float | None = None, threads: int = 1) -> q.Simulation:
    """Two cubes pressed on each other and on a wall, the upper one sliding fast."""
    run = two(
        gap=-2e-6, shift=(0.004, 0.002), stiffness=1e6, step=1.2e-6,
        contact={"planes": [q.ContactPlane((0, 0, -0.00599), (0, 0, 1), 0.2)], "skin": skin},
    )  # fmt: skip
    run.threads = threads
    return thrown(run, (0.5, -0.3, -0.2))


def state_of(run: q.Simulation) -> list[Any]:
    """Everything a step reads, to the bit; springs of what touches."""
    c = run.contacts
    return [
        *(body.displacement.tobytes() for body in run.bodies),
        *(body.velocity.tobytes() for body in run.bodies),
        run.energy(), repr(run.motion), c.touching().spring.tobytes(),
        c.kernel.planes.spring.tobytes(), c.kernel.slid.tobytes(),
    ]  # fmt: skip


def test_history_survives_renewals_of_the_list() -> None:
    """A skin so thin that pairs are looked for in every few steps, or never: the same bits."""
    states = []
    for skin in (2e-6, 6e-3):
        run = grinding(skin)
        run.advance(60 * run.step)
        states.append(state_of(run)[:4] + state_of(run)[6:])
        assert np.abs(run.contacts.touching().spring).max() > 1e-8
        assert (run.contacts.renewals > 10) == (skin < 1e-3)
    assert states[0] == states[1]


def test_what_meets_or_parts_in_the_step_that_outlives_the_list_is_not_missed() -> None:
    """Cubes that go 20 um a step, 1 um more than a skin of 0.1 mm apart: in the third step each is

    past half the skin, and they overlap by 19 um.  Half a period of their springs, 0.2 ms, later
    they part with a spring to let go, from each other and from a wall, by more than a thin skin.
    """
    states = []
    for skin in (1e-4, 1e-5, 6e-3):
        wall = q.ContactPlane((0, 0, -RADIUS - 101e-6), (0, 0, 1))
        run = two(gap=101e-6, stiffness=1e6, step=1e-6, contact={"skin": skin, "planes": [wall]})
        for body, speed in zip(run.bodies, (20.0, -20.0), strict=True):
            body.velocity = np.tile([1.0, 0, speed], (len(body.nodes), 1))
        run.advance(3 * run.step)
        assert run.energy().contact > 0
        run.advance(997 * run.step)
        e = run.energy()
        assert e.friction > 0
        assert e.contact == 0
        assert not run.contacts.kernel.force.any()
        states.append(state_of(run))
    assert states[0] == states[1] == states[2]


def test_the_skin_follows_the_motion_and_changes_no_bit() -> None:
    """Two collide while both fly at 20 m/s: lists come to last longer, forces are the same."""
    states, runs = [], []
    for skin in (None, SKIN_OF_SPHERES * RADIUS):
        run = two(gap=1e-6, shift=(0.004, 0.002), step=1.2e-6, contact={"skin": skin})
        for body, own in zip(run.bodies, ((20.0, 0, 0), (20.3, -0.3, -0.2)), strict=True):
            body.velocity = np.tile(np.array(own), (len(body.nodes), 1))
        for _ in range(10):
            run.advance(40 * run.step)
        assert run.energy().friction > 0
        states.append(state_of(run))
        runs.append(run.contacts)
    free, thin = runs
    assert states[0] == states[1]
    assert thin.skin == thin.skins[0] < free.skin <= RADIUS
    assert 2 * free.renewals <= thin.renewals
    assert free.kernel.half_skin == free.skin / 2


@given(
    st.floats(1e-6, 1e-2), st.integers(0, 10**6), st.integers(0, 10**6), st.floats(1e-6, 1e-3),
    st.floats(1e-6, 1e-2), st.floats(1, 1e5), st.floats(0.1, 1e3),
)  # fmt: skip
def test_skin_next(
    skin: float, lasted: int, idle: int, least: float, more: float, speed: float, dense: float
) -> None:
    """Within its bounds and a factor of two; at a speed that stays, the least of all costs.

    A list of skin s is good for n = s/(2 v dt) steps and has ``dense`` s/least idle pairs a sphere:
    a step costs SEARCH/n + dense s/least, least where s^2 = 2 v dt SEARCH least/dense.
    """
    most, spheres = least + more, 10**6
    skin = float(np.clip(skin, least, most))
    found = choose_skin(skin, lasted, idle, spheres, least, most)
    assert least <= found <= most
    assert skin / 2 <= found <= 2 * skin
    way = least / (2 * speed)
    for _ in range(40):
        pairs = int(dense * skin / least * spheres)
        skin = choose_skin(skin, int(skin / 2 / way) + 1, pairs, spheres, least, most)
    best = np.clip(np.sqrt(2 * way * SEARCH * least / dense), least, most)
    # a list lasts whole steps: one too many of n
    assert skin == pytest.approx(best, rel=max(1e-6, 3 * way / best))


@given(st.lists(st.lists(st.floats(-1, 1), max_size=6), min_size=1))
def test_extents_are_those_of_each_body(bodies: list[list[float]]) -> None:
    """Against one body at a time; nothing of its own is no extent."""
    first = np.concatenate([[0], np.cumsum([len(body) for body in bodies])])
    expected = [max(body) - min(body) if body else 0.0 for body in bodies]
    assert find_extents(np.concatenate(bodies), first).tolist() == expected


@pytest.mark.long
def test_a_skin_leaves_room_to_the_images_across_the_width() -> None:
    """A cube of 30 mm in a width of 43.6, a reach of 12 mm and the skin: 1.6 mm are left."""
    run = two(gap=0.05, contact={"periodic": q.PeriodicWidth("y", 0.0436)}, step=1.2e-6)
    thrown(run, (30.0, 0.0, 0.0))
    for _ in range(40):
        run.advance(10 * run.step)
    c = run.contacts
    assert c.renewals > 5
    assert c.skins[0] < c.skin
    assert SIDE + 2 * RADIUS + c.skin < 0.0436


def test_a_saved_run_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    """History, list and losses are in the checkpoint; another contact's is refused."""
    half = 80 * grinding().step
    whole, again = go_on(grinding, tmp_path / "state.npz", half, half)
    assert state_of(again) == state_of(whole)
    assert whole.energy().friction > 0
    with pytest.raises(CheckpointError, match="contact differ"):
        grinding(skin=1e-4).restore(tmp_path / "state.npz")


def rigid_pair(threads: int | None, layers: int = 2) -> q.Simulation:
    """Two rigid cubes that grind on each other."""
    cells = (2, 2, layers)
    bodies = [
        q.Body(make_box_mesh((SIDE,) * 3, cells, origin=origin), STONE, name=str(k), rigid=True)
        for k, origin in enumerate(((0, 0, 0), (0.004, 0.002, SIDE + 0.01113)))
    ]
    contact = q.SphereContact(RADIUS, 1e6, 0.5)
    run = q.Simulation(bodies, threads=threads, gravity=(0, 0, -9.81), contact=contact)
    bodies[1].velocity = np.tile([0.5, -0.3, -0.2], (len(bodies[1].nodes), 1))
    return run


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="numba has one thread only")
def test_rigid_bodies_are_on_the_threads_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """They have no elements that could be shared; by default as many as the spheres are worth."""
    asked = {threads: rigid_pair(threads) for threads in (1, 2, None)}
    for run in asked.values():
        run.energy()  # finds the contacts
    kernels = {threads: run.contacts.kernel for threads, run in asked.items()}
    found = {n: contact_window.choose_threads(asked[n], kernels[n]) for n in asked}
    assert found == {1: 1, 2: 2, None: 1}
    monkeypatch.setattr(contact_window, "THREAD_SPHERES", 20)
    assert contact_window.choose_threads(asked[None], kernels[None]) == 2
    assert contact_window.choose_threads(asked[2], None) == asked[2].assembly.threads == 1


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="numba has one thread only")
@pytest.mark.parametrize("make", [lambda n: grinding(threads=n), lambda n: rigid_pair(n, 80)])
@pytest.mark.long
def test_threads_change_no_bit(make: Callable[[int], q.Simulation]) -> None:
    """Of a whole contact window; the rigid ones' 1300 spheres go to the threads by 512."""
    runs = [make(1), make(2)]
    for run in runs:
        run.advance(60 * run.step)
    assert runs[0].energy().friction > 0
    assert state_of(runs[0]) == state_of(runs[1])


def test_bodies_that_do_not_touch_move_as_without_contact() -> None:
    """To the bit: the step of the elements is the same; without the key nothing looks for any."""
    fields = []
    for contact in (None, q.SphereContact(RADIUS, 1e8, 0.5)):
        bodies = [block("below"), block("above", (0, 0, 0.1))]
        run = q.Simulation(bodies, threads=1, step=1.2e-6, contact=contact)
        run.fix(bodies[0], bodies[0].nodes[:, 2] == 0)
        run.load(bodies[0], bodies[0].nodes[:, 2] == SIDE, lambda t: np.array([t, 0, 1.0]))
        thrown(run, (0.1, 0.0, 0.2))
        run.advance(100 * run.step)
        fields.append([body.displacement.tobytes() for body in bodies])
        assert (run.contacts is None) == (contact is None)
    assert fields[0] == fields[1]


# --- what is refused, and warned of --------------------------------------------------------------


def test_too_deep_is_refused_at_the_start_and_on_the_way() -> None:
    """A centre in another sphere: named, with what to do."""
    with pytest.raises(ContactTooDeep, match=r"node .* of below and node .* of above overlap by"):
        two(gap=-RADIUS).advance(1e-6)
    run = thrown(two(stiffness=1e2), (0, 0, -20.0))
    with pytest.raises(ContactTooDeep, match=r"overlap by 0\.006"):
        run.advance(1e-3)


def test_more_contacts_than_the_step_allows_for_are_warned_of() -> None:
    """A stiff contact of each vertex where the step allows for less than the wall adds."""
    run = two(gap=-1e-7, stiffness=1e12, contact={
        "contacts": 1, "planes": [q.ContactPlane((0, 0, -0.00599), (0, 0, 1))]
    })  # fmt: skip
    assert run.critical_step.value < 0.1 * run.elements_critical_step.value
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        run.advance(2 * run.step)
    assert any("contacts of a vertex make" in str(w.message) for w in shown)
    run = two(gap=-1e-7, stiffness=1e12, step=run.step * 3, contact={"contacts": 1})
    with pytest.warns(StepWarning, match="governs"):
        run.advance(run.step)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"radius": -1.0}, "radius: -1.0 is not above zero"),
        ({"normal_stiffness": {"above": np.nan}}, "normal_stiffness: nan is not above"),
        ({"friction": -0.1}, "friction: -0.1 is not at least zero"),
        ({"skin": 0}, "skin: 0 is not above"),
        ({"contacts": 0}, "0 contacts of a vertex"),
        ({"planes": [q.ContactPlane((0, 0, 0), (0, 0, 0))]}, "plane.0.normal: it has no direction"),
        ({"planes": [q.ContactPlane((0, 0), (0, 0, 1))]}, "plane.0.point: .* are not three"),
        ({"planes": [q.ContactPlane((0, 0, 0), (0, 0, 1), -1)]}, "plane.0.friction"),
    ],
)
def test_wrong_numbers_are_named(words: dict[str, Any], said: str) -> None:
    """Before anything is computed."""
    with pytest.raises(ConditionError, match=said):
        q.SphereContact(**{"radius": 1.0, "normal_stiffness": 1.0, "friction": 0.5} | words)


def test_what_contact_can_not_be_joined_with_is_refused() -> None:
    """Single precision, static answers, bodies without a radius."""
    with pytest.raises(ConditionError, match="double precision"):
        two(precision="float32")
    with pytest.raises(ConditionError, match="no static answer"):
        two().relax()
    contact = q.SphereContact({"below": 0.01}, 1e8, 0.5)
    run = q.Simulation([block("below"), block("above", (0, 0, 1))], contact=contact)
    with pytest.raises(ConditionError, match="body above has none"):
        run.advance(1e-6)


SCENE = """
[[body]]
name = "below"
mesh.box = { size = [0.03, 0.03, 0.03], cells = [1, 1, 1] }
material = { young = 30e9, poisson = 0.2, density = 2700 }
[[body]]
name = "above"
mesh.box = { size = [0.03, 0.03, 0.03], cells = [1, 1, 1], origin = [0, 0, 0.042] }
material = { young = 30e9, poisson = 0.2, density = 2700 }
[simulation]
duration = 1e-4
gravity = [0, 0, -9.81]
[contact]
model = "spheres"
radius = { below = 0.006, above = 0.005 }
normal_stiffness = 1e8
friction = 0.5
[[contact.plane]]
point = [0, 0, -0.006]
normal = [0, 0, 1]
friction = 0.2
"""


def scene_of(folder: Path, change: Callable[[str], str] = str) -> Any:
    """`SCENE`, changed, as a scene file."""
    (folder / "scene.toml").write_text(change(SCENE), encoding="utf-8")
    return load_scene(folder / "scene.toml")


def test_a_scene_names_its_contact(tmp_path: Path) -> None:
    """The table becomes the simulation's contact, and what is left out says so."""
    prepared = scene_of(tmp_path)
    run, _ = make_simulation(prepared)
    assert run.contact.find_value("above", "radius") == 0.005
    assert run.contact.planes[0].friction == 0.2
    assert not [text for text in prepared.scene.list_left_out() if "contact" in text]
    surface = scene_of(
        tmp_path,
        lambda text: re.sub("radius.*|normal_stiff.*", "", text).replace(
            '"spheres"', '"surface"\nmodulus = { below = 1e12, above = 2e12 }\npoints = 3'
        ),
    )
    contact = make_simulation(surface)[0].contact
    assert (contact.find_value("above", "modulus"), contact.points) == (2e12, 3)
    without = scene_of(tmp_path, lambda text: text[: text.index("[contact]")])
    assert make_simulation(without)[0].contact is None
    assert [text for text in without.scene.list_left_out() if "contact" in text]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("above = 0.005", "abov = 0.005", "contact.radius.abov: there is no body 'abov'"),
        (", above = 0.005", "", "contact.radius: body 'above' has none"),
        (
            "radius = {",
            "modulus = 1e12\nradius = {",
            "contact.modulus: the model 'spheres' does not",
        ),
        ('"spheres"', '"surface"', "contact.modulus: missing: the model 'surface' needs it"),
        ("1e8", "0", "contact.normal_stiffness: must be above 0"),
        ('"spheres"', '"cubes"', "contact.model: must be 'spheres'"),
        ("normal = [0, 0, 1]", "normal = [0, 0, 0]", "contact.plane.0.normal: has no direction"),
        ("duration", 'precision = "float32"\nduration', "simulation.precision: contact is"),
        ("duration", 'method = "static"\nduration', "simulation.method: bodies in contact"),
    ],
)
def test_a_wrong_contact_of_a_scene_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    """By its key, in a sentence."""
    with pytest.raises(SceneError, match=said):
        scene_of(tmp_path, lambda text: text.replace(old, new))
