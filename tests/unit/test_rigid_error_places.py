"""Sentences that name the place and something to do: bodies of scenes, cuts, folders, steps."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import rigid_lcp
from rigid_lcp import Disc, Polygon, Polyhedron, Scene, Simulation, Sphere, errors, make_box
from rigid_lcp.errors import NotConverged, RigidError, ShapeError, UsageError

NAMES = {
    name for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, RigidError)
}  # fmt: skip
NEAR = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1e-10, 0], [1e-10, 0, 1]]
"""Corners 0 and 4 nearly the same, so that faces do not meet edge to edge."""


@pytest.mark.parametrize("dim", [2, 3])
def test_a_line_or_plane_that_misses_names_the_body_and_how_far_to_move_it(dim):
    """By the way that the remedy names it goes through the centre of mass."""
    scene = Scene(dim=dim)
    shape = Polygon.rectangle(1, 1) if dim == 2 else make_box(1, 1, 1)
    scene.add(shape, density=1.0, name="stone", position=np.ones(dim))
    place = np.full(dim, 5.5)
    run, along = Simulation(scene), np.eye(dim)[1 if dim == 2 else 0]
    words = r"^stone: .* misses .* corners lie \S+ to \S+ m from it\n  -> move it"
    with pytest.raises(ShapeError, match=words) as raised:
        run.fragment(0, (place, 2 * along))
    place[0] += (-1.0 if dim == 2 else 1.0) * float(raised.value.remedy.split()[6])
    run.fragment(0, (place, 2 * along))
    assert run.world.mass == pytest.approx([0.5, 0.5], rel=1e-3)


@pytest.mark.parametrize(
    ("dim", "shape", "words"),
    [
        (2, Polygon.regular(1100, 0.1), "it has 1100 vertices"),
        (3, Polyhedron(NEAR), "its faces do not meet edge to edge"),
        (3, Polyhedron(np.vstack([
            np.column_stack([np.cos(a), np.sin(a), np.full(300, z)])
            for a in [2 * np.pi * np.arange(300) / 300] for z in (0.0, 1.0)
        ])), "it has 900 edges"),
    ],
)  # fmt: skip
def test_shapes_with_too_much_or_too_near_name_their_body(dim, shape, words):
    """They were ``body 1``, or only ``Polyhedron``."""
    scene = Scene(dim=dim)
    scene.add(Disc(0.1) if dim == 2 else Sphere(0.1), fixed=True)
    scene.add(shape, density=1.0, name="a")
    with pytest.raises(RigidError, match=f"^a: {words}") as raised:
        Simulation(scene)
    assert raised.value.exit_code == 3


@pytest.mark.parametrize("dim", [2, 3])
def test_a_spin_too_fast_for_the_step_names_its_body(dim):
    """1e5 rad/s for a step of 1 ms are 100 rad."""
    scene = Scene(dim=dim)
    shape = Polygon.rectangle(0.2, 0.1) if dim == 2 else make_box(0.2, 0.1, 0.1)
    scene.add(shape, density=1.0, spin=1e5 * np.eye(1 if dim == 2 else 3)[0], name="a")
    with pytest.raises(NotConverged, match=r"^a: it turns by 100 rad"):
        Simulation(scene).advance(0.01)


@pytest.mark.parametrize("method", ["time-stepping", "acceleration"])
def test_steps_without_end_are_refused(method):
    """2 ms in steps of 1e-90 s are 2e87 of them; they were begun."""
    scene = Scene()
    scene.add(Disc(0.1), density=1.0)
    run = Simulation(scene, method, step=1e-90)
    with pytest.raises(UsageError, match=r"is 2e\+87 steps: at most 1e\+10 can be made\n  -> "):
        run.advance(0.002)
    assert (run.time, run.steps) == (0.0, 0)


def test_every_error_has_a_remedy() -> None:
    """Each call of an error's class names its ``remedy`` (or passes keywords on)."""
    calls = {
        f"{path.name}:{node.lineno}": {each.arg for each in node.keywords}
        for path in Path(rigid_lcp.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMES
    }
    assert len(calls) > 100
    assert [place for place, named in calls.items() if not named & {"remedy", None}] == []
