"""Scene files of rigid bodies: what they become, and what is said of bad ones."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.scene.file import (
    build_scene,
    find_force,
    list_doubts,
    list_unused,
    load_scene,
    make_loads,
)
from rigid_lcp.scene.run import list_left_out
from rigid_lcp.scene.types import Load
from rigid_lcp.shapes.irregular import draw_polygon

pytestmark = pytest.mark.lowest

PILE = Path(__file__).parents[2] / "trackbed" / "scenes" / "pile.toml"
SMALL = """\
dimensions = 2

[run]
duration = 0.01

[[ground]]
normal = [0, 1]

[[body]]
name = "block"
box = [0.2, 0.1]
density = 2000.0
position = [0.0, 0.05]
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_block_on_the_ground_has_the_mass_of_its_area(tmp_path: Path) -> None:
    scene = build_scene(load_scene(written(tmp_path, SMALL)))
    block = scene.bodies[1]
    assert block.mass == pytest.approx(2000 * 0.2 * 0.1)
    assert block.inertia == pytest.approx(block.mass * (0.2**2 + 0.1**2) / 12)
    assert block.friction == 0.0
    given = build_scene(load_scene(written(tmp_path, SMALL + "inertia = 1e6\n"))).bodies[1]
    assert (given.mass, given.inertia) == (block.mass, 1e6)


def test_surface_serves_bodies_without_values_of_their_own(tmp_path: Path) -> None:
    text = SMALL + "friction = 0.2\n\n[surface]\nfriction = 0.7\nrestitution = 0.1\n"
    scene = build_scene(load_scene(written(tmp_path, text)))
    assert [body.friction for body in scene.bodies] == [0.7, 0.2]
    assert [body.restitution for body in scene.bodies] == [0.1, 0.1]


def test_every_problem_is_named_with_its_line(tmp_path: Path) -> None:
    text = SMALL.replace("duration = 0.01", "duration = -1\nstpe = 1").replace("2000.0", "0")
    with pytest.raises(SceneError) as caught:
        load_scene(written(tmp_path, text))
    message = str(caught.value)
    assert "3 problems" in message
    assert "scene.toml:4: run.duration" in message
    assert "scene.toml:5: run.stpe" in message
    assert "density" in message
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("box = [0.2, 0.1]", "", "give one of box, radius and vertices"),
        ("density = 2000.0", "", "give a density, or fixed = true"),
        ("position = [0.0, 0.05]", "position = [0.0, 0.05, 1.0]", "3 numbers in 2 dimensions"),
        ('name = "block"', 'name = ""', "name"),
        ("dimensions = 2", "dimensions = 4", "dimensions"),
        ("[[body]]", "[body]", "write \\[\\[body\\]\\] tables"),
        ("density = 2000.0", "density = nan", "finite"),
        ("duration = 0.01", 'duration = "long"', "duration"),
        ("density = 2000.0", "fixed = true", "no body can move"),
        ("density = 2000.0", "density = 2000.0\nfriction = true", "friction: .*valid number"),
        ("duration = 0.01", "duration = 1e300", "duration: must be at most 1e.18"),
        ("duration = 0.01", "duration = 1e-17", "between two frames"),
        (
            "[[body]]",
            '[[load]]\nbody = "block"\nforce = [1, 0]\nbegin = 2\nend = 1\n[[body]]',
            "load.0: end .1 s. is not after begin",
        ),
        (  # it would be constant
            "[[body]]",
            '[[load]]\nbody = "block"\nforce = [1, 0]\nleast = [0, 0]\n[[body]]',
            "load.0: least and phase are of a cyclic load",
        ),
        (  # it would do nothing
            "[[body]]",
            '[[load]]\nbody = "a"\nforce = [1, 0]\n'
            '[[body]]\nname = "a"\nradius = 1\nfixed = true\n[[body]]',
            "load.0.body: a is fixed",
        ),
        (  # the second corner was a traceback of numpy
            "box = [0.2, 0.1]",
            "vertices = [[0, 0], [1, 0, 0], [0, 1]]",
            "11: body.0.vertices.1: has 3 numbers in 2 dimensions.*correct these keys",
        ),
        (
            SMALL,
            SMALL.replace("= 2\n", "= 3\n")
            .replace("[0, 1]", "[0, 0, 1]")
            .replace("[0.0, 0.05]", "[0, 0, 1]")
            .replace("box = [0.2, 0.1]", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0]]"),
            "body.0.vertices.3: has 2 numbers in 3 dimensions",
        ),
        (
            "[[body]]",
            '[[load]]\nbody = "train"\nforce = [0, -1]\n[[body]]',
            "load.0.body: there is no body train",
        ),
        (
            "[[body]]",
            '[[body]]\nname = "a"\nradius = 1\nfixed = true\ninertia = 1.0\n[[body]]',
            "inertia: for bodies that move",
        ),
        ("density =", "densty =", "body.0.densty: unknown key; did you mean density?"),
        (  # those asked for with three had four, and no message said so
            SMALL,
            "dimensions = 3\nrun.duration = 0.1\n[[grains]]\ncount = 1\nsize = [0.1, 0.1]\n"
            "corners = [3, 6]\ndensity = 1.0\nregion_low = [0, 0, 0]\nregion_high = [1, 1, 1]",
            "grains.0.corners: a polyhedron has at least 4",
        ),
        (
            "[[body]]",
            '[[load]]\nbody = "block"\nforce = [0, -1e300]\n[[body]]',
            r"load.0.force.1: must be at least -1e\+18, not -1e\+300",
        ),
        ("= 2\n", "= 2\ngravity = [0, -1e200]\n", r"gravity.1: must be at least -1e\+18, not"),
        ("0.01", "0.06\nstep = 1e-17", r"is 6e\+15 steps: at most 1e\+10 can be made, and"),
        ("[[ground]]", "[[grund]]", "grund: unknown key; did you mean ground?"),
        ("density =", "colour = 1\ndensity =", "body.0.colour: unknown key; known: angle, box,"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(SceneError, match=r"(?s)" + said):
        load_scene(written(tmp_path, SMALL.replace(old, new)))


def test_cyclic_load_runs_between_its_forces() -> None:
    load = Load(body="a", force=[0, -8], least=[0, -2], frequency=5, begin=1.0, end=3.0)
    np.testing.assert_allclose(find_force(load, 1.0), [0, -2])
    np.testing.assert_allclose(find_force(load, 1.1), [0, -8])
    np.testing.assert_allclose(find_force(load, 1.2), [0, -2], atol=1e-12)
    np.testing.assert_array_equal(find_force(load, 0.999), [0, 0])
    np.testing.assert_array_equal(find_force(load, 3.001), [0, 0])
    load = Load(body="block", force=[3.0, 0.0], least=[-3.0, 0.0], frequency=2.0, phase=np.pi / 2)
    for time in (0.0, 0.05, 0.2, 0.4):  # from a quarter of a cycle on: 3 sin(2 pi f t)
        expected = [3 * np.sin(4 * np.pi * time), 0.0]
        np.testing.assert_allclose(find_force(load, time), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[[ground]]\nnormal = [0, 1]", "[[ground]]\nnormal = [0, 0]", "ground 0: the normal"),
        ("box = [0.2, 0.1]", "vertices = [[0,0],[1,0],[0.2,0.2],[0,1]]", "body block"),
    ],
)
def test_a_shape_that_is_none_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(ShapeError, match=said):
        build_scene(load_scene(written(tmp_path, SMALL.replace(old, new))))


CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]


@pytest.mark.parametrize("more", [[0.5, 0.5, 0.5], [0.5, 0.5, 0], [0.5, 0, 0]])
def test_vertices_of_another_body_than_their_hull_are_refused(tmp_path, more: list[float]) -> None:
    """In space as in the plane: inside it, in a face, on an edge."""
    text = SMALL.replace("= 2\n", "= 3\n").replace("[0, 1]", "[0, 0, 1]")
    text = text.replace("[0.0, 0.05]", "[0, 0, 1]")
    whole, other = (
        text.replace("box = [0.2, 0.1]", f"vertices = {v}") for v in (CUBE, [more, *CUBE])
    )
    assert build_scene(load_scene(written(tmp_path, whole))).bodies[-1].mass == pytest.approx(2000)
    with pytest.raises(ShapeError, match=r"body block: .*vertices: 0 \(1 of 9, counted from 0\)"):
        build_scene(load_scene(written(tmp_path, other)))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("box = [0.2, 0.1]", "box = [200, 100]", "body.0: a body of 200 m is above 100; as mm it"),
        ("box = [0.2, 0.1]", "radius = 60", "body.0: a body of 120 m is above 100"),
        ("density = 2000.0", "density = 2.0", "body.0.density: a density of 2 .* is below 500"),
        ("density = 2000.0", "density = 2000.0\nfriction = 30", "body.0.friction: .* angle in deg"),
    ],
)
def test_values_in_another_unit_are_doubted(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert list_doubts(load_scene(written(tmp_path, SMALL)).tables) == []
    (doubt,) = list_doubts(load_scene(written(tmp_path, SMALL.replace(old, new))).tables)
    assert re.search(said, doubt)


def test_a_load_acts_on_the_named_body_alone() -> None:
    file = load_scene(PILE)
    scene = build_scene(file)
    loads = make_loads(file)
    assert loads is not None
    from rigid_lcp.motion.world import make_world

    _, motion = make_world(scene)
    peak = file.tables.load[0].begin + 0.5 / (file.tables.load[0].frequency or 1.0)
    forces = np.asarray(loads(peak, motion))
    loaded = np.flatnonzero(np.abs(forces).sum(axis=1))
    assert [scene.bodies[n].name for n in loaded] == ["sleeper"]
    np.testing.assert_allclose(forces[loaded[0]], [0, -8000, 0])


def test_the_same_seed_gives_the_same_stones() -> None:
    first, again = (draw_polygon(np.random.default_rng(5), 0.05, 7) for _ in range(2))
    np.testing.assert_array_equal(first.vertices, again.vertices)
    assert len(first.vertices) == 7
    assert first.reach < 0.05


@pytest.mark.parametrize("frequency", [201.0, 700.0, 1000.0, 5000.0])
def test_a_load_of_too_few_steps_a_period_is_refused(tmp_path: Path, frequency: float) -> None:
    """The step that the refusal names is taken, frames that shorten the steps count, and ten
    forces at the middles have the impulse of half a sine within 2 %."""
    text = SMALL + f'[[load]]\nbody = "block"\nforce = [1, 0]\nfrequency = {frequency}\n'
    with pytest.raises(
        SceneError, match=r"load\.0\.frequency: .*fewer than 10.*run\.step"
    ) as caught:
        load_scene(written(tmp_path, text))
    step = re.search(r"run\.step = (\S+)", str(caught.value))[1]
    load_scene(written(tmp_path, text), [f"run.step={step}"])
    load_scene(written(tmp_path, text), [f"run.frames={int(0.1 * frequency) + 1}"])
    middles = (np.arange(5) + 0.5) * np.pi / 5
    assert 1.0 < np.sin(middles).sum() * np.pi / 5 / 2.0 < 1.02


FIXED = '[[body]]\nname = "wall"\nbox = [1, 1]\nfixed = true\nposition = [5, 0]\n'
LOAD = '[[load]]\nbody = "block"\nforce = [1, 0]\n'


@pytest.mark.parametrize(("text", "words"), [
    (FIXED + "velocity = [1, 0]\nspin = 3.0", "body.1: .*wall is fixed: velocity, spin;"),
    (FIXED + "density = 2700", "body.1: .*: density;"),
    (LOAD + "begin = 0.01", "load.0: not used, .* 20 steps of 0.0005 s"),
    (LOAD + "begin = 0.0053\nend = 0.0057", "load.0: not used"),
    ("[wear]\ncoefficient = 1e-13\nevery = 21", "wear: not used, .*every 21 of 20 steps"),
    ("[strength]\ntension = 1e5\nevery = 21", "strength: not used, .*every 21 of 20 steps"),
    ("DISC[wear]\ncoefficient = 1e-13", "wear: not used"),
    ("DISC[strength]\ntension = 1e5", "strength: not used"),
])  # fmt: skip
def test_what_is_given_in_vain_is_named(tmp_path: Path, text: str, words: str) -> None:
    """Once, and among what is left out; a load that does not act is none."""
    small = SMALL
    if text.startswith("DISC"):
        text, small = text[4:], SMALL.replace("box = [0.2, 0.1]", "radius = 0.05")
    file = load_scene(written(tmp_path, small + text + "\n"))
    (said,) = list_unused(file.tables)
    assert re.search(words, said)
    assert said in list_left_out(file)
    assert "loads: none but gravity" in list_left_out(file)


@pytest.mark.parametrize("text", [
    FIXED + "velocity = [0, 0]",
    LOAD + "begin = 0.0097",
    LOAD + "begin = 0.0052\nend = 0.0053",
    "[wear]\ncoefficient = 1e-13\nevery = 20",
])  # fmt: skip
def test_what_is_used_is_not_named(tmp_path: Path, text: str) -> None:
    assert list(list_unused(load_scene(written(tmp_path, SMALL + text + "\n")).tables)) == []
