"""One description of a scene, several engines: what is passed on, and what happens without one."""

from __future__ import annotations

import json
import sys
from math import pi, radians, tan
from pathlib import Path

import numpy as np
import pytest

from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon
from validation import rigid_scene_lmgc90 as lmgc90
from validation import rigid_scene_peers as peers
from validation import rigid_scene_shapes as shapes
from validation import rigid_scene_top as top
from validation import rigid_scene_worker as worker
from validation.rigid_scene_peers import PEERS, peer_missing, peer_run, scene_data

G = 9.81
STEP = 1e-3


def block(slope: float, mu: float) -> Scene:
    """A unit block on an incline, in the frame of the incline."""
    scene = Scene(2, (G * np.sin(slope), -G * np.cos(slope)))
    scene.add(Polygon.rectangle(1, 1), density=2700, position=(0, 0.5))
    scene.add(HalfSpace((0, 1)), friction=mu)
    return scene


def test_scene_is_plain_data() -> None:
    """Numbers, words and lists only, with all an engine needs; JSON keeps every bit of them."""
    scene = block(0.3, 0.5)
    scene.add(Disc(0.2), density=1000, position=(3, 0.2), velocity=(1, 0), spin=2.0, restitution=1)
    data = scene_data(scene, [[1.0, 2.0, 3.0], [0.0] * 3, [0.0] * 3])
    assert json.loads(json.dumps(data)) == data
    box, floor, disc = data["bodies"]
    assert box["mass"] == 2700
    assert box["inertia"] == pytest.approx(450)
    assert box["load"] == [1, 2, 3]
    assert floor["kind"] == "half-space"
    assert floor["fixed"]
    assert disc["radius"] == 0.2
    assert disc["mass"] == pytest.approx(1000 * pi * 0.04)
    assert (disc["velocity"], disc["spin"], disc["restitution"]) == ([1, 0], 2, 1)
    assert "load" not in disc


@pytest.mark.parametrize(
    ("a", "b", "mu"), [(0.5, 0.2, 0.2), (None, 0.2, 0.2), (0.5, None, 0.5), (None, None, 0.0)]
)
def test_friction_of_a_pair_is_as_in_a_scene(a: float | None, b: float | None, mu: float) -> None:
    """The worker runs under another Python and has this rule again: it must not differ."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(1, 1), density=1, position=(0, 0.5), friction=a)
    scene.add(HalfSpace((0, 1)), friction=b)
    from rigid_lcp.scene import world_of

    world, motion = world_of(scene)
    assert world.contacts(motion, 0.1).friction == pytest.approx(mu)
    first, second = scene_data(scene)["bodies"]
    assert shapes.pair_friction(first, second) == mu


def test_nothing_is_imported_unless_asked_for() -> None:
    """Neither the description nor the worker pulls an engine in."""
    modules = (worker, peers, shapes, lmgc90, top)
    source = "".join(Path(str(module.__file__)).read_text() for module in modules)
    for line in source.splitlines():
        if line.startswith(("import ", "from ")) and not line.startswith("from validation."):
            assert not any(name in line for name in ("mujoco", " ode", "lmgc90"))


def test_peer_that_is_not_there_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    peer_missing.cache_clear()
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    monkeypatch.setattr(peers, "SYSTEM_PYTHON", "/nowhere/python3")
    try:
        for engine in PEERS:
            made = peer_run(engine, scene_data(block(0, 0.5)), STEP, 1)
            assert "not installed" in made.why
            assert made.why.endswith(peers.INSTALL[engine])
            assert np.isnan(made.greatest)
    finally:
        peer_missing.cache_clear()


def test_peer_that_dies_or_hangs_is_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers, "peer_missing", lambda engine: "")
    monkeypatch.setattr(peers, "SYSTEM_PYTHON", sys.executable)
    script = tmp_path / "worker.py"
    monkeypatch.setattr(peers, "WORKER", script)
    script.write_text("import os; os.abort()")
    assert "died with code -6" in peer_run("ode", {}, STEP, 1).why
    script.write_text("import time; time.sleep(60)")
    assert "not done after 0.2 s" in peer_run("ode", {}, STEP, 1, limit=0.2).why


def test_what_an_engine_lacks_is_said() -> None:
    scene = Scene(2)
    scene.add(Polygon([(0, 0), (1, 0), (0, 1)]), density=1, restitution=0.5, position=(0, 2))
    scene.add(HalfSpace((0, 1)), restitution=0.5)
    with pytest.raises(shapes.NotThere, match="restitution"):
        worker.mujoco_model(scene_data(scene), STEP)
    scene.add(HalfSpace((1, 0), -1), restitution=0.2)
    with pytest.raises(shapes.NotThere, match="one coefficient of restitution"):
        lmgc90.run_lmgc90(scene_data(scene), STEP, 1)
    scene.bodies.pop()
    with pytest.raises(shapes.NotThere, match="RST_CLB"):
        lmgc90.run_lmgc90(scene_data(scene), STEP, 1)
    scene.bodies[0].velocity[:] = 1.0, 0.0
    scene.add(Polygon([(0, 0), (1, 0), (0, 1)]), density=1, position=(3, 2))
    with pytest.raises(shapes.NotThere, match="at rest"):
        lmgc90.run_lmgc90(scene_data(scene), STEP, 1)


def test_slab_is_closed_and_faces_outwards() -> None:
    """Volume of a slab by the divergence theorem over its faces: area times depth, positive."""
    outline = [[0.0, 0.0], [2.0, 0.0], [1.5, 1.0], [0.0, 1.0]]
    made = shapes.slab(outline, 0.3)
    points = np.array(made["vertices"])
    volume = 0.0
    for face in made["faces"]:
        for k in range(1, len(face) - 1):
            a, b, c = points[[face[0], face[k], face[k + 1]]]
            volume += float(np.dot(a, np.cross(b, c))) / 6
    assert volume == pytest.approx(1.75 * 0.3)


@pytest.mark.parametrize("engine", PEERS)
def test_peer_slides_as_coulomb_says(engine: str) -> None:
    """A block at mu = 0.8 tan(20°): g (sin - mu cos) t²/2, to a per cent; at 1.5 tan it stays."""
    if remedy := peer_missing(engine):
        pytest.skip(remedy)
    slope, steps = radians(20), 500
    way = G * np.sin(slope) * 0.2 * (steps * STEP) ** 2 / 2
    slides = peer_run(engine, scene_data(block(slope, 0.8 * tan(slope))), STEP, steps)
    assert slides.why == ""
    assert slides.displacement[0, 0] == pytest.approx(way, rel=1e-2)
    assert slides.cpu_s >= 0
    stays = peer_run(engine, scene_data(block(slope, 1.5 * tan(slope))), STEP, steps)
    assert stays.greatest < 1e-2 * way


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_peer_takes_motion_and_loads(engine: str) -> None:
    """Free flight: v t + (g + f/m) t²/2 and omega t + M/J t²/2, to the first order in the step."""
    if remedy := peer_missing(engine):
        pytest.skip(remedy)
    scene = Scene(2)
    scene.add(Disc(0.1), density=100, position=(0, 5), velocity=(1, 2), spin=3.0)
    scene.add(HalfSpace((0, 1)))
    mass, inertia = scene.bodies[0].mass, scene.bodies[0].inertia
    load = [mass * 2.0, mass * 3.0, inertia * 4.0]
    made = peer_run(engine, scene_data(scene, [load, [0.0] * 3]), STEP, 200)
    t = 200 * STEP
    exact = np.array([t + t * t, 2 * t + (3 - G) * t * t / 2, 3 * t + 2 * t * t])
    np.testing.assert_allclose(made.displacement[0], exact, atol=2 * G * t * STEP)


@pytest.mark.parametrize(
    ("engine", "restitution"), [("mujoco", 1.0), ("ode", 0.5), ("lmgc90", 1.0)]
)
def test_peer_bounces_and_tells_its_path(engine: str, restitution: float) -> None:
    """A box that lands flat, going sideways, leaves with ``e`` of its speed; a frame a step."""
    if remedy := peer_missing(engine):
        pytest.skip(remedy)
    scene = Scene(2)
    scene.add(
        Polygon.rectangle(0.2, 0.2), density=1000, position=(0, 0.15), velocity=(0.5, 0),
        restitution=restitution,
    )  # fmt: skip
    scene.add(HalfSpace((0, 1)))
    made = peer_run(engine, scene_data(scene, impacts=True), STEP, 150, every=1)
    assert made.why == ""
    assert made.path.shape == (150, 2, 6)
    landing = np.sqrt(2 * G * 0.05)
    assert made.path[:, 0, 4].max() == pytest.approx(restitution * landing, rel=0.05)
    np.testing.assert_allclose(made.path[-1, 0, [0, 3]], [0.075, 0.5], rtol=1e-6)


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_peer_turns_a_top_about_an_axis_of_inertia(engine: str) -> None:
    """2 rad about z, to (w h)^2 / 12 of it: the quaternion (cos 1, 0, 0, sin 1)."""
    if remedy := peer_missing(engine):
        pytest.skip(remedy)
    body = {"inertia": [1.0, 1.5, 2.0], "spin": [0.0, 0.0, 4.0], "integrator": "RK4"}
    made = peer_run(engine, {"top": body}, STEP, 500)
    np.testing.assert_allclose(made.path[0, 0], [np.cos(1), 0, 0, np.sin(1)], atol=5e-6)
