"""Boundaries: a periodic width, absorbing faces; invariance, closed forms, conservation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import qdem_fem as q
from qdem_fem.contact.search.pairs import find_near_pairs, find_periodic_pairs
from qdem_fem.files.errors import CheckpointError, ConditionError, SceneError
from qdem_fem.files.output import read_table
from qdem_fem.march.leapfrog import find_free_accelerations
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.build import simulation_of
from qdem_fem.scene.checks import load_scene
from tests.qdem_boundary_waves import GROUND, PRESSURE, SPEED, bar, bar_share, oblique_share
from trackbed import command

Floats = NDArray[np.float64]
STONE = q.Material(30e9, 0.2, 2700.0)
SIDE, RADIUS, WIDTH = 0.03, 0.006, 0.1
ACROSS = q.PeriodicWidth("y", WIDTH)
MODELS = "spheres", "surface", "overlaps"
BY_MODEL = pytest.mark.parametrize(
    "model",
    [
        model if model == "spheres" else pytest.param(model, marks=pytest.mark.long)
        for model in MODELS
    ],
)  # the loop of surfaces compiles for a minute


def touch(model: str, periodic: Any = ACROSS, **more: Any) -> Any:
    """Contact of a model with friction."""
    if model == "spheres":
        return q.SphereContact(RADIUS, 1e8, 0.5, periodic=periodic, **more)
    faces = "overlaps" if model == "overlaps" else "points"
    return q.SurfaceContact(1e12, 0.5, depth=1e-3, faces=faces, periodic=periodic, **more)


def block(name: str, origin: Any, rigid: bool = False, size: Any = (SIDE,) * 3) -> q.Body:
    """A block of stone of 2 x 2 x 2 cells."""
    mesh = make_box_mesh(size, (2, 2, 2), "kuhn", tuple(origin))
    return q.Body(mesh, STONE, name=name, rigid=rigid)


def thrown(bodies: list[q.Body], velocity: Any, spin: Any, drift: Any) -> None:
    """Velocities: of the second body against the first, its spin, and what all have."""
    for number, body in enumerate(bodies):
        arm = body.nodes - body.nodes.mean(axis=0)
        body.velocity = number * (np.cross(spin, arm) + velocity) + drift


def clash(model: str, images: int, start: float, drift: float = 0.0) -> Floats:
    """Motion of two blocks that hit each other along y, less their drift; (2, n, 3) [m].

    The second is rigid, so that one compiled loop serves all tests of a model.

    The first lies from ``start`` [m] on, the second ``images`` widths from where it meets it.
    """
    gap = np.sqrt((2 * RADIUS) ** 2 - 0.005**2) if model == "spheres" else 0.0
    place = start + SIDE + gap + 1e-6 + images * WIDTH
    bodies = [block("one", (0, start, 0)), block("other", (0.004, place, 0.003), True)]
    run = q.Simulation(bodies, contact=touch(model), threads=1, step=2e-7)
    thrown(bodies, (0, -2.0, 0.5), (3.0, 2.0, 5.0), (0, drift, 0))
    run.advance(1e-4)
    assert run.energy().friction > 1e-3
    return np.stack([body.displacement - (0, drift * run.time, 0) for body in bodies])


@BY_MODEL
def test_images_meet_as_bodies_do(model: str) -> None:
    """One collision, with the side of the width anywhere and any image of the other body.

    The blocks begin within one width, with a face exactly at its side, with the other body three
    widths away or two behind; and both fly along y at 900 m/s, so that they cross a side during
    the collision: Galilei.  Rounding of coordinates below 0.5 m, some 1e-16 m, is what differs;
    it grows with the contact's own vibration, k/m dt^2 a step, over 500 steps to far below 1e-12.
    """
    asked = clash(model, 0, 0.012)
    assert np.abs(asked).max() > 1e-4
    for images, start, drift in ((3, 0.012, 0.0), (-2, WIDTH - SIDE, 0.0), (0, 0.03, 900.0)):
        found = clash(model, images, start, drift)
        assert found == pytest.approx(asked, abs=1e-11 if drift else 1e-12)


@BY_MODEL
def test_a_closed_ring_is_at_rest(model: str) -> None:
    """Two blocks that fill the width, pressed into each other alike on both sides: no net force.

    Without the period each would fly off; and the contact's energy is that of both sides.
    """
    reach = 2 * RADIUS if model == "spheres" else 0.0
    overlap = 1e-5
    size = (SIDE, WIDTH / 2 + overlap - reach, SIDE)
    energies = []
    for periodic in (ACROSS, None):
        bodies = [block(f"{n}", (0, n * WIDTH / 2, 0), True, size) for n in range(2)]
        run = q.Simulation(bodies, contact=touch(model, periodic), threads=1, step=1e-7)
        energies.append(run.energy().contact)
        run.advance(2e-6)
        moved = np.abs(bodies[0].velocity).max()
        # where edges coincide, overlaps turn a body by rounding: as much in a row without a period
        still = 1e-3 if model == "overlaps" else 1e-9
        assert moved < still if periodic else moved > 1e-2
    assert energies[0] == pytest.approx(2 * energies[1], rel=1e-9)


def slab(cells: int = 5) -> q.Body:
    """A slab as wide as the width."""
    mesh = make_box_mesh((0.06, WIDTH, 0.02), (3, cells, 1), "kuhn", (-0.015, 0, -0.02))
    return q.Body(mesh, STONE, name="slab")


def slide(model: str, start: float, ways: int = 0) -> Floats:
    """Motion of a block thrown on a slab that is joined over the width, and of the slab's top."""
    ground = slab()
    height = 2 * RADIUS * 0.88 if model == "spheres" else 0.0
    stone = block("stone", (0.001, start + ways * WIDTH, height - 1e-6), True)
    run = q.Simulation([ground, stone], contact=touch(model), threads=1, step=2e-7)
    x = ground.nodes
    run.periodic(ground, x[:, 1] < 1e-9, x[:, 1] > WIDTH - 1e-9)
    run.fix(ground, x[:, 2] < -0.0199)
    stone.velocity = np.tile([0.0, 40.0, -0.5], (len(stone.nodes), 1))
    run.advance(6e-5)
    assert run.energy().friction > 0
    return np.asarray(stone.displacement)


@BY_MODEL
def test_a_joined_slab_has_no_seam(model: str) -> None:
    """A block slides 2.4 mm along a joined slab: over its middle, over its seam, an image away.

    The slab's mesh repeats every 20 mm, so that the motion is the same but for rounding; how that
    grows is seen from two places off the seam.
    """
    asked = slide(model, 0.029)
    assert np.abs(asked[:, 1]).max() > 2e-3
    rounding = 10 * np.abs(slide(model, 0.049) - asked).max() + 1e-13
    assert rounding < 1e-8
    for start, ways in ((0.069, 0), (0.089, 0), (0.089, -2)):
        assert slide(model, start, ways) == pytest.approx(asked, abs=rounding)


@BY_MODEL
def test_goes_on_in_the_middle_of_a_crossing(model: str, tmp_path: Path) -> None:
    """Saved while springs are stretched across the side: the same bits."""

    def made(periodic: Any = ACROSS) -> q.Simulation:
        bodies = [block("one", (0, WIDTH - SIDE, 0)), block("other", (0.004, 2e-6, 0.003), True)]
        if model == "spheres":
            bodies = [block("one", (0, 0.065, 0)), block("other", (0.004, 0.00591, 0.003), True)]
        run = q.Simulation(bodies, contact=touch(model, periodic), threads=1, step=2e-7)
        thrown(bodies, (0, -2.0, 0.5), (3.0, 2.0, 5.0), (0, 30.0, 0))
        return run

    whole = made()
    whole.advance(1.2e-5)
    assert whole.energy().contact > 0
    whole.save(tmp_path / "state")
    whole.advance(3e-5)
    again = made()
    again.restore(tmp_path / "state")
    again.advance(3e-5)
    for one, other in zip(whole.bodies, again.bodies, strict=True):
        assert np.array_equal(one.displacement, other.displacement)
        assert np.array_equal(one.velocity, other.velocity)
    with pytest.raises(CheckpointError, match="periodic width"):
        made(q.PeriodicWidth("y", 0.2)).restore(tmp_path / "state")


def test_list_is_that_of_all_images() -> None:
    """Pairs and images of 300 spheres, some exactly at a side, against every image of every one."""
    random = np.random.default_rng(3)
    side, skin = q.PeriodicWidth("z", 1.0), 0.02
    position = random.uniform(-3, 3, (300, 3)) * (0.3, 0.3, 1.0)
    position[:40, 2] = np.rint(position[:40, 2])
    position[40:50, 2] = -1e-17
    radius, body = random.uniform(0.05, 0.1, 300), random.integers(0, 40, 300)
    first, second, image = find_periodic_pairs(position, radius, body, skin, side)
    found = dict(zip(zip(np.repeat(np.arange(300), np.diff(first)), second, strict=True),
                     image, strict=True))  # fmt: skip
    expected = {}
    for n in range(-7, 8):
        apart = np.linalg.norm(position[:, None] - position - n * side.way, axis=2)
        near = (apart <= radius[:, None] + radius + skin) & (body[:, None] != body)
        expected |= {(i, j): n * side.way for i, j in np.argwhere(np.triu(near, 1))}
    assert len(expected) > 250
    assert found.keys() == expected.keys()
    for key, way in expected.items():
        assert np.array_equal(found[key], way)
    inside = np.abs(position[:, 2] - 0.5) < 0.2  # nothing there can reach a side
    alone = find_near_pairs(position[inside], radius[inside], body[inside], skin)
    same = find_periodic_pairs(position[inside], radius[inside], body[inside], skin, side)
    for one, other in zip(alone, same[:2], strict=True):
        assert np.array_equal(one, other)


@BY_MODEL
def test_what_meets_itself_is_refused(model: str) -> None:
    """A body as long as the width, one that turns into its image, a wall across, a loose slab."""
    long = block("plank", (0, 0, 0), True, (0.01, 0.0995, 0.01))
    with pytest.raises(ConditionError, match=r"plank is 0.0995 m long along y.*its own image"):
        q.Simulation([long], contact=touch(model), step=1e-7).advance(1e-6)
    turning = block("plank", (0, 0, 0), True, (0.084, 0.056, 0.01))
    run = q.Simulation([turning], contact=touch(model), step=1e-6)
    thrown([turning, turning], (0, 0, 0), (0, 0, 800.0), (0, 0, 0))
    with pytest.raises(ConditionError, match=r"t = .*step \d+: plank is 0.0.*its own image"):
        run.advance(3e-3)
    with pytest.raises(ConditionError, match="part along y"):
        touch(model, planes=[q.ContactPlane((0, 0, 0), (0, 1, 1))])
    stone = block("stone", (0, 0, 0), False, (1e-3,) * 3)
    with pytest.raises(ConditionError, match="two reaches"):
        q.Simulation([stone], contact=touch(model, q.PeriodicWidth("x", 0.002))).advance(1e-9)
    with pytest.raises(ConditionError, match="join"):
        q.Simulation([slab()], contact=touch(model)).advance(1e-7)
    run = q.Simulation([ground := slab()], contact=touch(model, q.PeriodicWidth("y", 0.2)))
    y = ground.nodes[:, 1]
    run.periodic(ground, y < 1e-9, y > WIDTH - 1e-9)
    with pytest.raises(ConditionError, match=r"slab are joined over 0\.1 m along y"):
        run.advance(1e-7)


SCENE = """
[[body]]
name = "stone"
mesh = { box = { size = [0.03, 0.03, 0.03], cells = [1, 1, 1] } }
material = { young = 30e9, poisson = 0.2, density = 2700 }
[simulation]
duration = 1e-6
[contact]
model = "spheres"
friction = 0.5
radius = 0.006
normal_stiffness = 1e8
periodic = { axis = "y", width = 0.1 }
[[contact.plane]]
point = [0, 0, -0.1]
normal = [0, 0, 1]
"""


def test_a_scene_names_the_width(tmp_path: Path) -> None:
    """The keys reach the contact; what does not fit them is named with its key."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    run, _ = simulation_of(load_scene(path))
    assert run.contact.periodic == ACROSS
    for change, words in (
        ("contact.periodic.width=0.04", "contact.periodic.width: stone is 0.03 m long"),
        ('contact.periodic.axis="w"', "contact.periodic.axis: must be 'x', 'y' or 'z'"),
        ("contact.periodic.width=0", "contact.periodic.width: must be above 0"),
        ("contact.plane.0.normal=[0, 1, 1]", "contact.plane.0.normal: its normal has a part"),
    ):
        with pytest.raises(SceneError) as told:
            simulation_of(load_scene(path, [change]))
        assert words in str(told.value), change


# --- absorbing faces ------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [None, 0.5])
@pytest.mark.parametrize("wave", ["p", "s"])
def test_a_bar_sends_back_what_is_derived(wave: str, depth: float | None) -> None:
    """A p- or s-pulse on the end of a bar, with dashpots, and with springs of a layer beside them.

    The bar is a chain of planes, of which the answer is known for every frequency, mesh and step
    included: to rounding (1e-9) what dashpots take; what is left, as soon as it has come out of
    the springs and left the free end.  Dashpots alone let less than 2e-5 back of pulses of 5 cells.
    """
    share = bar_share(wave, depth, 80 if depth is None else 120)
    assert share.absorbed == pytest.approx(share.absorbed_derived, abs=1e-9)
    assert share.left == pytest.approx(share.left_derived, rel=1e-3)
    if depth is None:
        assert share.left == pytest.approx(share.left_derived, rel=1e-8)
        assert share.left < 2e-5


@pytest.mark.parametrize("end", ["fixed", "free"])
def test_other_ends_send_all_back(end: str) -> None:
    """Where the face is held or free: nothing is absorbed."""
    share = bar_share("p", end=end)
    assert share.left == pytest.approx(1.0, abs=0.01)
    assert share.absorbed == 0.0


@pytest.mark.long
def test_oblique_waves_come_back_as_derived() -> None:
    """A packet at 30 degrees: the closed form's share, to second order in the cell; one at 60.

    24 and 36 cells across the trace: the error falls by 1.5 squared at least.
    """
    coarse, fine = oblique_share(30.0, 24), oblique_share(30.0, 36)
    errors = [share.left - share.left_derived for share in (coarse, fine)]
    assert errors[0] > 1.5**2 * errors[1] > 0
    assert errors[1] < 4e-4
    steep = oblique_share(60.0, 24)
    assert steep.left == pytest.approx(steep.left_derived, abs=4e-3)
    assert 0.9 < steep.absorbed < 1 - steep.left


def test_dashpots_alone_creep_and_a_depth_holds() -> None:
    """A lasting pressure: speed P/(rho c_p) without a depth, displacement P H/(lambda + 2 mu) with.

    It grows over 20 transits of the bar and stays for 40: of the bar's vibration less than 1e-4 is
    left, of a spring's way exp(-t c/H).
    """
    pressure = 1e3
    for depth in (None, 0.4):
        run = bar(4)
        body = run.bodies[0]
        run.absorb(body, body.nodes[:, 0] > 0.35, depth)
        transit = 0.4 / SPEED["p"]
        run.pressure(body, body.nodes[:, 0] < 0.05, q.ramp(20 * transit, pressure))
        run.advance(60 * transit)
        speed = pressure / (GROUND.density * SPEED["p"])
        if depth is None:
            assert body.velocity[:, 0] == pytest.approx(speed, rel=1e-4)
        else:
            there = body.displacement[body.nodes[:, 0] > 0.35, 0]
            assert there == pytest.approx(pressure * depth / PRESSURE, rel=1e-4)
            assert np.abs(body.velocity).max() < 1e-4 * speed
        energy = run.energy()
        stored = energy.kinetic + energy.elastic + energy.absorbed + energy.foundation
        assert stored == pytest.approx(energy.external, rel=1e-4)


def corner(**options: Any) -> tuple[q.Simulation, q.Body]:
    """A block whose faces x-max and y-max absorb, of two depths, held and moved elsewhere."""
    body = q.Body(make_box_mesh((0.3, 0.2, 0.2), (3, 2, 2), "kuhn"), GROUND, name="block")
    run = q.Simulation([body], threads=1, **options)
    x, y, z = body.nodes.T
    run.absorb(body, x > 0.29, 0.5)
    run.absorb(body, y > 0.19, 0.2)
    run.roller(body, (x > 0.29) & (z < 0.01), (1, 0, 2))
    run.fix(body, (y > 0.19) & (z > 0.19), "y")
    run.prescribe(body, x < 0.01, "z", q.ramp(1e-3, 1e-5))
    run.load(body, (x > 0.29) & (y > 0.19), q.ramp(5e-4, (30.0, 20.0, 10.0)))
    return run, body


def test_energies_close_with_all_at_once() -> None:
    """Loads on absorbing nodes, faces that meet, rollers and holds among them: second order.

    The account errs as the trapezoidal rule does: a quarter with half the step; and by less than
    1e-3.  Held components and rollers stay where they are.
    """
    missing = []
    for safety in (0.4, 0.2):
        run, body = corner(safety=safety)
        run.advance(2e-3)
        energy = run.energy()
        stored = energy.kinetic + energy.elastic + energy.absorbed + energy.foundation
        missing.append(abs(stored / energy.external - 1))
        assert energy.absorbed > 0.05 * energy.external
        x, y, z = body.nodes.T
        slope = body.displacement[(x > 0.29) & (z < 0.01)] @ (1, 0, 2)
        assert np.abs(slope).max() < 1e-18
        assert not body.displacement[(y > 0.19) & (z > 0.19), 1].any()
    assert 3 < missing[0] / missing[1] < 5
    assert missing[1] < 1e-3


def test_stone_falls_on_an_absorbing_joined_layer() -> None:
    """A rigid stone hits a joined slab across its seam; the slab's ground absorbs: energies close.

    What has come as the fall's energy is in the account to 1e-3, and vertical momentum to the
    ground's force: of the springs and dashpots nothing is left out.
    """
    ground = slab()
    stone = block("stone", (0.001, 0.089, 2 * RADIUS * 0.9), True)
    run = q.Simulation([ground, stone], contact=touch("spheres"), threads=1, safety=0.2)
    y, z = ground.nodes[:, 1], ground.nodes[:, 2]
    run.periodic(ground, y < 1e-9, y > WIDTH - 1e-9)
    run.absorb(ground, z < -0.0199, 0.5)
    stone.velocity = np.tile([0.0, 3.0, -2.0], (len(stone.nodes), 1))
    before = run.energy()
    came = before.kinetic + before.contact
    run.advance(1.5e-4)
    energy = run.energy()
    taken = energy.friction + energy.absorbed + energy.foundation
    total = energy.kinetic + energy.elastic + energy.contact + taken
    assert energy.absorbed > 1e-3 * came < energy.friction * 10
    assert total == pytest.approx(came, rel=1e-3)


def test_step_is_that_of_the_springs_alone(tmp_path: Path) -> None:
    """Critical step against all eigenvalues; at 0.999 of it nothing grows; goes on to the bit.

    Dashpots on the mean velocity leave it as it is: with them and without, the same number; springs
    of a layer of 2 mm shorten it.  Random velocities, 20,000 steps: kinetic energy only falls.
    """
    steps = []
    for depth in (None, 0.002):
        run = bar(3)
        body = run.bodies[0]
        plain = run.critical_step.value
        run.absorb(body, body.nodes[:, 0] > 0.25, depth)
        assert run.absorbers is not None
        columns, scale = [], np.sqrt(np.where(run.assembly.mass > 0, run.assembly.mass, 1.0))
        for unit in np.eye(3 * len(body.nodes)):
            u = 1e-9 * unit.reshape(-1, 3)[run.master]
            rate = find_free_accelerations(run, u, 0 * u) / 1e-9
            rate[run.master != np.arange(len(u))] = 0.0
            columns.append(rate.ravel())
        root = np.repeat(scale, 3)
        kernel = -np.array(columns).T * root[:, None] / root
        exact = 2 / np.sqrt(np.linalg.eigvalsh((kernel + kernel.T) / 2)[-1])
        assert run.critical_step.value == pytest.approx(exact, rel=1e-4)
        steps.append(run.critical_step.value / plain)
    assert steps[0] == pytest.approx(1.0, rel=1e-4)
    assert steps[1] < 0.7
    run, body = corner(safety=0.999, strain="small")
    for condition in run.conditions.loads[:]:
        run.remove(condition)
    body.velocity = 1e-3 * np.random.default_rng(4).normal(size=body.nodes.shape)
    run.advance(2000 * run.step)
    before = run.energy()
    run.advance(20_000 * run.step)
    assert run.energy().kinetic < before.kinetic + before.elastic + before.foundation
    again, twin = corner(safety=0.999, strain="small")
    again.remove(again.conditions.loads[0])
    run.save(tmp_path / "state")
    again.restore(tmp_path / "state")
    for each in (run, again):
        each.advance(1e-4)
    assert np.array_equal(twin.displacement, body.displacement)
    assert again.energy() == run.energy()


def test_what_can_not_absorb_is_refused() -> None:
    """Rigid bodies, single precision, no whole face, a depth of zero, a static answer."""
    run = bar(2)
    body = run.bodies[0]
    face = body.nodes[:, 0] > 0.15
    with pytest.raises(ConditionError, match="depth of 0"):
        run.absorb(body, face, 0)
    with pytest.raises(ConditionError, match="no surface face"):
        run.absorb(body, 0)
    run.absorb(body, face)
    with pytest.raises(ConditionError, match="no static answer"):
        run.relax()
    stone = block("stone", (0, 0, 0), True)
    with pytest.raises(ConditionError, match="is rigid"):
        q.Simulation([stone]).absorb(stone, stone.nodes[:, 2] < 1e-9)
    with pytest.raises(ConditionError, match="double precision"):
        bar(2, precision="float32").absorb(body, face)


ABSORBING = """
[[body]]
name = "ground"
mesh = { box = { size = [0.2, 0.1, 0.1], cells = [2, 1, 1] } }
material = { young = 200e6, poisson = 0.25, density = 2000 }
[simulation]
duration = 2e-3
[[absorb]]
body = "ground"
nodes = { set = "z-min" }
depth = 0.5
[[pressure]]
body = "ground"
nodes = { set = "z-max" }
pressure = { ramp = 1e-3, value = 1e3 }
"""


def test_a_scene_names_absorbing_faces(tmp_path: Path) -> None:
    """Its energies are columns of energy.csv, which close; what is wrong is named with its key."""
    path = tmp_path / "scene.toml"
    path.write_text(ABSORBING)
    assert command.main(["qdem", str(path), "--no-pictures"]) == 0
    rows = read_table(next(tmp_path.rglob("energy.csv")))
    assert rows["absorbed"][-1] > 0.0 < rows["foundation"][-1]
    stored = sum(rows[name] for name in ("kinetic", "elastic", "absorbed", "foundation"))
    assert stored[-1] == pytest.approx(rows["external"][-1], rel=1e-3)
    for change, words in (
        ("absorb.0.depth=0", "absorb.0.depth: must be above 0"),
        ("absorb.0.nodes={nearest=[0, 0, 0]}", "absorb.0: no surface face"),
        ('simulation.method="static"', "absorb.0: a static answer"),
        ('simulation.precision="float32"', "absorb.0: absorbing faces are computed in double"),
    ):
        with pytest.raises(SceneError) as told:
            simulation_of(load_scene(path, [change]))
        assert words in str(told.value), change
