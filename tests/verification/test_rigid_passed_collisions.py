"""Chains of collisions within a step: Galperin's billiard, rows, gases, what runs out of rounds.

Two bodies that collide with e = 1 in a line leave with (elastic map, from momentum and energy)

    v1' = v1 - 2 m2 / (m1 + m2) (v1 - v2),    v2' = v2 + 2 m1 / (m1 + m2) (v1 - v2),

and a wall turns v1 round.  A light body between a wall and a heavy one that comes in does so in
turn until neither pair approaches: ``ceil(pi / arctan(sqrt(m / M))) - 1`` collisions (Galperin,
Regular and Chaotic Dynamics 8 (2003) 375).
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

import rigid_lcp as r
from rigid_lcp.collision import passing as passed_collisions
from rigid_lcp.report.page import write_report
from rigid_lcp.scene.file import load_scene
from rigid_lcp.scene.run import RunFolder, make_simulation, run_scene, summarise_run


def billiard(ratio: float, step: float, dim: int = 2, e: float = 1.0) -> r.Simulation:
    """A wall at 0, a light ball at rest 5 cm from it, a heavy one 5 cm further that comes in with
    1 m/s."""
    ball = r.Disc(0.1) if dim == 2 else r.Sphere(0.1)
    along = np.eye(dim)[0]
    scene = r.Scene(dim, gravity=np.zeros(dim))
    scene.add(r.HalfSpace(along, 0.0), restitution=e)
    scene.add(ball, density=1.0, position=0.15 * along, restitution=e)
    scene.add(ball, density=ratio, position=0.4 * along, velocity=-along, restitution=e)
    return r.Simulation(scene, step=step)


def billiard_answer(ratio: float) -> tuple[int, float, float]:
    """Collisions, and the velocities of the light and the heavy body after them [m/s]."""
    light, heavy, count = 0.0, -1.0, 0
    while True:
        if light > heavy:
            light, heavy = (
                light - 2 * ratio / (1 + ratio) * (light - heavy),
                heavy + 2 / (1 + ratio) * (light - heavy),
            )
        elif light < 0:
            light = -light
        else:
            return count, light, heavy
        count += 1


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("step", [1e-2, 1e-3])
@pytest.mark.parametrize("ratio", [1.0, 100.0, 1e4])
@pytest.mark.long
def test_a_light_ball_between_a_wall_and_a_heavy_one(ratio: float, step: float, dim: int) -> None:
    """Final velocities of the two-body maps, energy kept, nothing cut off (before, the heavy ball
    stopped dead at 1e4).  Round-off: 2e-16 a collision of the velocity ``sqrt(M / m)`` at most."""
    run = billiard(ratio, step, dim)
    begin = run.energy
    run.advance(0.3)
    count, light, heavy = billiard_answer(ratio)
    error = 1e-15 * (count + 10) * sqrt(ratio)
    assert run.velocities[1, 0] == pytest.approx(light, abs=error)
    assert run.velocities[2, 0] == pytest.approx(heavy, abs=error)
    assert run.energy == pytest.approx(begin, rel=1e-15 * (count + 10))
    assert run.steps_cut_off == 0


@pytest.mark.long
def test_an_inelastic_collapse_ends() -> None:
    """e = 0.9 at a mass ratio of 1e6: the light ball collides ever faster with ever less.  It is
    closed after a bounded number of rounds, energy never grows, and a message says so."""
    run = billiard(1e6, 1e-2, e=0.9)
    before = run.energy
    for _ in range(30):
        run.advance(1e-2)
        assert run.energy <= before * (1 + 1e-12)
        before = run.energy
    assert run.steps_cut_off >= 1
    assert run.overlap <= 1e-9 * run.world.length
    assert passed_collisions.PASSING.lossy_rounds < passed_collisions.PASSING.rounds


def test_a_run_tells_what_was_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the summary, in the report, and after a resumed run."""
    few = replace(passed_collisions.PASSING, rounds=20)
    monkeypatch.setattr(passed_collisions, "PASSING", few)
    path = tmp_path / "billiard.toml"
    path.write_text(
        "dimensions = 2\ngravity = [0.0, 0.0]\n[run]\nduration = 0.3\nstep = 1e-2\nframes = 2\n"
        "[surface]\nrestitution = 1.0\n[[ground]]\nnormal = [1.0, 0.0]\n"
        '[[body]]\nname = "light"\nradius = 0.1\ndensity = 1.0\nposition = [0.15, 0.0]\n'
        '[[body]]\nname = "heavy"\nradius = 0.1\ndensity = 1e4\nposition = [0.4, 0.0]\n'
        "velocity = [-1.0, 0.0]\n"
    )
    file = load_scene(path, [])
    folder = RunFolder(tmp_path / "run")
    for resume in (False, True):
        scene, run = make_simulation(file)
        with folder.lock():
            folder.prepare({"scene": {}}, file.text, resume=resume, force=False)
            run_scene(file, run, folder, resume=resume, progress=lambda *_: None)
            summary = summarise_run(file, scene, run, folder)
            assert summary["steps_cut_off"] >= 1
            page = write_report(folder, scene, {"provenance": {}}, summary, draw=False)
        assert "collisions ran out of rounds" in page.read_text()


@pytest.mark.parametrize("gap", [1e-3, 1e-4, 1e-5, 1e-6, 1e-9])
@pytest.mark.parametrize("step", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.long
def test_the_last_ball_of_a_row_leaves(gap: float, step: float, dim: int) -> None:
    """Equal balls swap velocities at each collision: one in at 1 m/s, one out, however many of the
    gaps [m] a step closes (balls at rest were not seen to be in the way of those struck: of five
    came out -0.5 0 0.5 0.5 0.5)."""
    scene = r.Scene(dim, gravity=np.zeros(dim))
    along = np.eye(dim)[0]
    for k in range(5):
        scene.add(
            r.Disc(0.01) if dim == 2 else r.Sphere(0.01), density=1.0, restitution=1.0,
            position=(0.02 + gap) * k * along, velocity=float(k == 0) * along,
        )  # fmt: skip
    run = r.Simulation(scene, step=step)
    run.advance(0.02)
    assert run.velocities[:, 0] == pytest.approx([0, 0, 0, 0, 1], abs=1e-12)
    assert run.steps == round(0.02 / step)


def test_a_long_row_within_a_step() -> None:
    """Sixty balls 1e-7 m apart: sixty rounds, and as many bodies found in the way."""
    scene = r.Scene(2, gravity=(0, 0))
    for k in range(60):
        scene.add(
            r.Disc(0.01), density=1.0, restitution=1.0, position=((0.02 + 1e-7) * k, 0),
            velocity=(float(k == 0), 0),
        )  # fmt: skip
    run = r.Simulation(scene, step=1e-3)
    run.advance(1e-3)
    assert run.velocities[:, 0] == pytest.approx([0.0] * 59 + [1.0], abs=1e-12)


@pytest.mark.parametrize("gap", [1e-3, 1e-5])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_row_of_unequal_balls(gap: float, dim: int) -> None:
    """Each a third as heavy as the one before it: by the map above it leaves with 1.5 times the
    velocity, so that a struck ball gets further in a step than any was at its start."""
    scene = r.Scene(dim, gravity=np.zeros(dim))
    along = np.eye(dim)[0]
    for k in range(4):
        scene.add(
            r.Disc(0.01) if dim == 2 else r.Sphere(0.01), density=3.0**-k, restitution=1.0,
            position=(0.02 + gap) * k * along, velocity=float(k == 0) * along,
        )  # fmt: skip
    run = r.Simulation(scene, step=4e-3)
    run.advance(0.02)
    left = [0.5, 0.75, 1.125, 3.375]  # v1' = v1 / 2 for m2 = m1 / 3
    assert run.velocities[:, 0] == pytest.approx(left, abs=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.long
def test_a_gas_of_light_and_heavy_keeps_its_energy(dim: int, seed: int) -> None:
    """Mass ratios to 1e4, e = 1, no friction, a wall on every side: energy to round-off, about
    1e-15 for each of a hundred rounds in each of a hundred steps (before, a third of it went in a
    second).  Without walls momentum stays as well, to round-off of the heaviest."""
    generator = np.random.default_rng(seed)
    side = 4 if dim == 2 else 2
    for walls in (True, False):
        scene = r.Scene(dim, gravity=np.zeros(dim))
        for normal in np.eye(dim) if walls else []:
            scene.add(r.HalfSpace(normal, 0.0), restitution=1.0)
            scene.add(r.HalfSpace(-normal, -0.2 * side), restitution=1.0)
        for place in np.ndindex(*(side,) * dim):
            inward = (side - 1) / 2 - np.array(place)
            scene.add(
                r.Disc(0.09) if dim == 2 else r.Sphere(0.09), restitution=1.0,
                density=10 ** generator.uniform(0, 4), position=0.1 + 0.2 * np.array(place),
                velocity=inward + generator.normal(size=dim),
            )  # fmt: skip
        run = r.Simulation(scene, step=2e-3)
        moving = run.world.movable
        mass = run.world.mass[moving, None]
        momentum, begin = (mass * run.velocities[moving]).sum(axis=0), run.energy
        run.advance(0.2)
        assert run.energy == pytest.approx(begin, rel=1e-11)
        assert run.steps_cut_off == 0
        if not walls:
            scale = float((mass * np.abs(run.velocities[moving])).sum())
            after = (mass * run.velocities[moving]).sum(axis=0)
            assert after == pytest.approx(momentum, abs=1e-13 * scale)


def test_bodies_that_part_by_turning_need_no_round() -> None:
    """Two that approach at the start of a step, and part at its end as fast by going round each
    other, take no impulse; they were asked again and again until rounds ran out."""
    one = np.ones(1)
    closing = passed_collisions.Closing(
        restitution=one, friction=0 * one, gap=-1e-3 * one, before=-0.27 * one,
        offset=np.array([[0.27, 0.0]]), turning=0.27 * one, slow=0.0, h=1e-3, touching=0.0,
    )  # fmt: skip
    assert passed_collisions.find_bouncing(closing).all()
    assert not passed_collisions.needs_impulse(closing, 1e-12).any()


@pytest.mark.long
def test_boxes_that_tumble_in_a_closed_box_keep_their_energy() -> None:
    """Without friction and gravity, with restitution 1, the kinetic energy stays.

    200 steps of 8 boxes, a round-off of 1e-15 each in every box: 1.6e-12.
    """
    generator = np.random.default_rng(0)
    scene = r.Scene(dim=3, gravity=(0.0, 0.0, 0.0))
    for normal in np.vstack([np.eye(3), -np.eye(3)]):
        scene.add(r.HalfSpace(normal, -0.3), restitution=1.0)
    for corner in np.indices((2, 2, 2)).reshape(3, -1).T - 0.5:
        scene.add(
            r.make_box(0.1, 0.06, 0.05), density=1000, position=0.25 * corner, restitution=1.0,
            velocity=generator.normal(size=3), spin=3.0 * generator.normal(size=3),
            angle=generator.normal(size=4),
        )  # fmt: skip
    run = r.Simulation(scene, step=1e-3)
    start = run.energy
    met = 0
    for _ in range(200):
        run.advance(1e-3)
        met += int((run.contacts.normal_force > 0).any())
        assert abs(run.energy / start - 1.0) <= 1.6e-12
    assert met > 10  # they did collide
