"""A periodic width: invariance, conservation, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.contact.search.pairs import find_near_pairs, find_periodic_pairs
from qdem_fem.files import Floats
from qdem_fem.files.errors import CheckpointError, ConditionError, SceneError
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from tests.qdem_restored import go_on

STONE = q.Material(30e9, 0.2, 2700.0)
SIDE, RADIUS, WIDTH = 0.03, 0.006, 0.1
ACROSS = q.PeriodicWidth("y", WIDTH)


def touch(periodic: Any = ACROSS, **more: Any) -> q.SphereContact:
    """Contact with friction."""
    return q.SphereContact(RADIUS, 1e8, 0.5, periodic=periodic, **more)


def block(name: str, origin: Any, rigid: bool = False, size: Any = (SIDE,) * 3) -> q.Body:
    """A block of stone of 2 x 2 x 2 cells."""
    mesh = make_box_mesh(size, (2, 2, 2), "kuhn", tuple(origin))
    return q.Body(mesh, STONE, name=name, rigid=rigid)


def thrown(bodies: list[q.Body], velocity: Any, spin: Any, drift: Any) -> None:
    """Velocities: of the second body against the first, its spin, and what all have."""
    for number, body in enumerate(bodies):
        arm = body.nodes - body.nodes.mean(axis=0)
        body.velocity = number * (np.cross(spin, arm) + velocity) + drift


def clash(images: int, start: float, drift: float = 0.0) -> Floats:
    """Motion of two blocks that hit each other along y, less their drift; (2, n, 3) [m].

    The second is rigid, so that one compiled loop serves all tests.

    The first lies from ``start`` [m] on, the second ``images`` widths from where it meets it.
    """
    gap = np.sqrt((2 * RADIUS) ** 2 - 0.005**2)
    place = start + SIDE + gap + 1e-6 + images * WIDTH
    bodies = [block("one", (0, start, 0)), block("other", (0.004, place, 0.003), True)]
    run = q.Simulation(bodies, contact=touch(), threads=1, step=2e-7)
    thrown(bodies, (0, -2.0, 0.5), (3.0, 2.0, 5.0), (0, drift, 0))
    run.advance(1e-4)
    assert run.energy().friction > 1e-3
    return np.stack([body.displacement - (0, drift * run.time, 0) for body in bodies])


def test_images_meet_as_bodies_do() -> None:
    """One collision, with the side of the width anywhere and any image of the other body.

    The blocks begin within one width, with a face exactly at its side, with the other body three
    widths away or two behind; and both fly along y at 900 m/s, so that they cross a side during
    the collision: Galilei.  Rounding of coordinates below 0.5 m, some 1e-16 m, is what differs;
    it grows with the contact's own vibration, k/m dt^2 a step, over 500 steps to far below 1e-12.
    """
    asked = clash(0, 0.012)
    assert np.abs(asked).max() > 1e-4
    for images, start, drift in ((3, 0.012, 0.0), (-2, WIDTH - SIDE, 0.0), (0, 0.03, 900.0)):
        found = clash(images, start, drift)
        assert found == pytest.approx(asked, abs=1e-11 if drift else 1e-12)


@pytest.mark.long
def test_a_closed_ring_is_at_rest() -> None:
    """Two blocks that fill the width, pressed into each other alike on both sides: no net force.

    Without the period each would fly off; and the contact's energy is that of both sides.
    """
    overlap = 1e-5
    size = (SIDE, WIDTH / 2 + overlap - 2 * RADIUS, SIDE)
    energies = []
    for periodic in (ACROSS, None):
        bodies = [block(f"{n}", (0, n * WIDTH / 2, 0), True, size) for n in range(2)]
        run = q.Simulation(bodies, contact=touch(periodic), threads=1, step=1e-7)
        energies.append(run.energy().contact)
        run.advance(2e-6)
        moved = np.abs(bodies[0].velocity).max()
        assert moved < 1e-9 if periodic else moved > 1e-2
    assert energies[0] == pytest.approx(2 * energies[1], rel=1e-9)


def test_goes_on_in_the_middle_of_a_crossing(tmp_path: Path) -> None:
    """Saved while springs are stretched across the side: the same bits."""

    def made(periodic: Any = ACROSS) -> q.Simulation:
        bodies = [block("one", (0, 0.065, 0)), block("other", (0.004, 0.00591, 0.003), True)]
        run = q.Simulation(bodies, contact=touch(periodic), threads=1, step=2e-7)
        thrown(bodies, (0, -2.0, 0.5), (3.0, 2.0, 5.0), (0, 30.0, 0))
        return run

    go_on(made, tmp_path / "state", 1.2e-5, 3e-5)
    saved = made()
    saved.restore(tmp_path / "state")
    assert saved.energy().contact > 0
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


def test_what_meets_itself_is_refused() -> None:
    """A body as long as the width, one that turns into its image, a wall across, joined faces."""
    long = block("plank", (0, 0, 0), True, (0.01, 0.0995, 0.01))
    with pytest.raises(ConditionError, match=r"plank is 0.0995 m long along y.*its own image"):
        q.Simulation([long], contact=touch(), step=1e-7).advance(1e-6)
    turning = block("plank", (0, 0, 0), True, (0.084, 0.056, 0.01))
    run = q.Simulation([turning], contact=touch(), step=1e-6)
    thrown([turning, turning], (0, 0, 0), (0, 0, 800.0), (0, 0, 0))
    with pytest.raises(ConditionError, match=r"t = .*step \d+: plank is 0.0.*its own image"):
        run.advance(3e-3)
    with pytest.raises(ConditionError, match="part along y"):
        touch(planes=[q.ContactPlane((0, 0, 0), (0, 1, 1))])
    stone = block("stone", (0, 0, 0), False, (1e-3,) * 3)
    with pytest.raises(ConditionError, match="two reaches"):
        q.Simulation([stone], contact=touch(q.PeriodicWidth("x", 0.002))).advance(1e-9)
    stone = block("stone", (0, 0, 0))
    run = q.Simulation([stone], contact=touch())
    run.periodic(stone, stone.nodes[:, 1] == 0, stone.nodes[:, 1] == SIDE)
    with pytest.raises(ConditionError, match=r"stone are joined over 0\.03 m along y"):
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
    run, _ = make_simulation(load_scene(path))
    assert run.contact.periodic == ACROSS
    for change, words in (
        ("contact.periodic.width=0.04", "contact.periodic.width: stone is 0.03 m long"),
        ('contact.periodic.axis="w"', "contact.periodic.axis: must be 'x', 'y' or 'z'"),
        ("contact.periodic.width=0", "contact.periodic.width: must be above 0"),
        ("contact.plane.0.normal=[0, 1, 1]", "contact.plane.0.normal: its normal has a part"),
        ('contact.model="surface"', "contact.periodic: a width is for spheres"),
    ):
        with pytest.raises(SceneError) as said:
            make_simulation(load_scene(path, [change]))
        assert words in str(said.value), change
