"""What a residual does not see: flush joints, level edges and bodies that pass within a step.

Reference: the same motion on one slab; closed forms of sliding; the acceleration method.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from rigid_lcp import Disc, HalfSpace, Polygon, Polyhedron, Scene, Simulation, Sphere, make_box
from rigid_lcp.arrays import Floats
from rigid_lcp.errors import NotConverged
from rigid_lcp.motion import count_parts, make_world

GRAVITY = 9.81
SIDE = 0.1  # side of a tile [m]


def lay_floor(scene: Scene, kind: str, gap: float, rng: np.random.Generator) -> None:
    """Fixed pieces with level tops at z = 0, ``gap`` [m] apart; "one" is a single slab."""
    if kind == "one":
        scene.add(Polygon.rectangle(8, SIDE) if scene.dim == 2 else make_box(8, 8, SIDE),
                  position=[*[0.0] * (scene.dim - 1), -SIDE / 2], fixed=True)  # fmt: skip
        return
    width = SIDE - gap
    if scene.dim == 2:
        for k in range(-3, 9):
            piece = Polygon.rectangle(width, SIDE)
            scene.add(piece, position=[SIDE * (k + 0.5), -SIDE / 2], fixed=True)
    elif kind == "tiles":
        for i, j in np.ndindex(8, 5):
            place = [SIDE * (i - 1.5), SIDE * (j - 2), -SIDE / 2]
            scene.add(make_box(width, width, SIDE), position=place, fixed=True)
    else:  # a floor of triangles
        corners = np.column_stack([rng.uniform(-0.3, 0.7, 40), rng.uniform(-0.3, 0.3, 40)])
        for one in Delaunay(corners).simplices:
            foot = np.column_stack([corners[one], np.zeros(3)])
            piece = Polyhedron(np.vstack([foot, foot - [0, 0, SIDE]]))
            if piece.width > 1e-3:
                scene.add(piece, position=piece.centroid, fixed=True)


def slide(kind: str, gap: float, dim: int, seed: int) -> Floats:
    """Where a block is after it slid over joints, pushed or thrown or dropped from a little above,
    however slow, and whatever the step."""
    rng = np.random.default_rng(seed)
    speed, turn, step = (
        10 ** rng.uniform(-2.5, 0.5),
        rng.uniform(0, 1.5),
        10 ** -rng.uniform(2.4, 3),
    )
    start, height, push = rng.uniform(0, 0.2), 0.0, 0.0
    if seed % 5 == 0:  # from rest, its front just at a joint
        speed, turn, start, push = 0.0, 0.0, 0.07, 0.5
    if seed % 5 == 1:
        height = 10 ** rng.uniform(-5, -3)
    scene = Scene(dim, [*[0.0] * (dim - 1), -GRAVITY])
    lay_floor(scene, kind, gap, rng)
    place = [start, *[0.013] * (dim - 2), 0.02 + height]
    half = turn * (seed % 2) / 2
    block = scene.add(
        Polygon.rectangle(0.06, 0.04) if dim == 2 else make_box(0.06, 0.05, 0.04), density=2700.0,
        position=place, velocity=[speed, *[0.1 * speed] * (dim - 2), 0.0], friction=0.2,
        angle=0.0 if dim == 2 else [np.cos(half), 0, 0, np.sin(half)],
    )  # fmt: skip
    force = np.zeros((len(scene.bodies), 3 * (dim - 1)))
    force[block, 0] = push * GRAVITY * scene.bodies[block].mass
    run = Simulation(scene, step=step, loads=lambda *_: force)
    run.advance(0.05 if speed > 1 else 0.1)
    return run.positions[block]


FLOORS = [
    (2, "slabs", 0.0, 60), (2, "slabs", 1e-3, 40), (3, "tiles", 0.0, 40), (3, "tiles", 1e-3, 20),
    (3, "triangles", 0.0, 40),
]  # fmt: skip


@pytest.mark.parametrize(
    ("dim", "kind", "gap", "starts"),
    [(*floor[:3], 6) for floor in FLOORS]
    + [pytest.param(*f, marks=pytest.mark.long) for f in FLOORS],
)
def test_a_block_slides_over_joints_as_over_one_slab(dim, kind, gap, starts):
    """At any place, speed and step, flush or a millimetre apart: 200 starts, to 1e-9 m."""
    for seed in range(starts):
        alone = slide("one", 0.0, dim, seed)
        assert slide(kind, gap, dim, seed) == pytest.approx(alone, abs=1e-9), seed


@pytest.mark.parametrize("dim", [2, 3])
def test_a_block_slides_over_loose_slabs_that_touch_each_other(dim):
    """Their own contacts have the normal of the end that it must not trip over."""
    scene, flat, up = Scene(dim, [*[0] * (dim - 1), -GRAVITY]), [0.0] * (dim - 2), [0.0] * (dim - 1)
    scene.add(HalfSpace([*up, 1.0], -SIDE), friction=1.0)
    for k in range(4):
        slab = Polygon.rectangle(SIDE, SIDE) if dim == 2 else make_box(SIDE, SIDE, SIDE)
        scene.add(slab, density=2700.0, position=[SIDE * k, *flat, -SIDE / 2], friction=0.6)
    block = scene.add(
        Polygon.rectangle(0.06, 0.04) if dim == 2 else make_box(0.06, 0.05, 0.04), density=2700.0,
        position=[0.01, *flat, 0.02], velocity=[2.0, *up], friction=0.2,
    )  # fmt: skip
    run = Simulation(scene, step=5e-4)
    run.advance(0.05)
    way = 2.0 * 0.05 - 0.2 * GRAVITY * 0.05**2 / 2
    assert run.positions[block] == pytest.approx([0.01 + way, *flat, 0.02], abs=1e-9)


@pytest.mark.parametrize("step_down", [1e-4, 5e-4, 2e-3])
def test_a_block_slides_off_a_low_step_without_tripping(step_down):
    """The next slab lies lower by less than the way of a step: x = v t - mu g t^2 / 2 while the
    force on its base is over the first slab."""
    scene = Scene(2, [0, -GRAVITY])
    scene.add(Polygon.rectangle(1, 0.1), position=[-0.5, -0.05], fixed=True)
    scene.add(Polygon.rectangle(1, 0.1), position=[0.5, -0.05 - step_down], fixed=True)
    block = Polygon.rectangle(0.06, 0.04)
    scene.add(block, density=1.0, position=[-0.05, 0.02], velocity=[2.0, 0.0], friction=0.2)
    run = Simulation(scene, step=1e-3)
    run.advance(0.02)
    way = 2.0 * 0.02 - 0.2 * GRAVITY * 0.02**2 / 2
    assert run.positions[2] == pytest.approx([-0.05 + way, 0.02], abs=1e-9)


@pytest.mark.parametrize("slope", [-0.1, 0.1, 0.3])
def test_a_frictionless_block_takes_a_bend_by_the_law_of_impacts(slope):
    """Convex pieces that meet at an angle.  The front corner meets the slope and the rear one stays
    on the floor: impulses of both take away dE = g.(J M^-1 J^T)^-1 g / 2, g = J v before.  Downhill
    it takes off and loses none."""
    along = np.array([np.cos(slope), np.sin(slope)])
    normal = np.array([-along[1], along[0]])
    scene = Scene(2, [0, 0])
    scene.add(Polygon.rectangle(1, 0.1), position=[-0.5, -0.05], fixed=True)
    ramp = Polygon(np.array([[0, -0.5], 0.5 * along - [0, 0.5], 0.5 * along, [0, 0]]))
    scene.add(ramp, position=ramp.centroid, fixed=True)
    block = Polygon.rectangle(0.06, 0.04)
    scene.add(block, density=1.0, position=[-0.05, 0.02], velocity=[2.0, 0.0])
    run = Simulation(scene, step=1e-4)
    start = run.energy
    run.advance(0.0102)
    mass, inertia = block.mass_properties(1.0)
    jacobian = np.array([[*normal, 0.03 * normal[1] + 0.02 * normal[0]], [0, 1, -0.03]])
    approach = jacobian[:, 0] * 2.0
    delassus = jacobian / [mass, mass, inertia] @ jacobian.T
    lost = approach @ np.linalg.solve(delassus, approach) / 2 if slope > 0 else 0.0
    assert start - run.energy == pytest.approx(lost, rel=2e-3, abs=1e-12)


@pytest.mark.parametrize("height", np.linspace(0.2, 2.2, 21))
def test_a_thin_plate_stops_what_falls_on_it(height):
    """A disc falls by several times the plate's thickness in a step, from any height."""
    scene = Scene(2, [0, -GRAVITY])
    scene.add(HalfSpace([0, 1], -1.0))
    scene.add(Polygon.rectangle(1.0, 0.005), fixed=True)
    scene.add(Disc(0.005), density=2700.0, position=[0, height], friction=0.3)
    run = Simulation(scene, step=5e-3)
    run.advance(1.0)
    assert run.positions[2] == pytest.approx([0, 0.0075], abs=1e-9)


def test_two_balls_shot_at_each_other_meet():
    """Equal balls at 50 m/s each, ten diameters a step, without restitution: both stop, as momentum
    is kept, in touch."""
    scene = Scene(3, [0, 0, 0])
    for side in (-1, 1):
        scene.add(Sphere(0.005), density=2700.0, position=[side, 0, 0], velocity=[-50 * side, 0, 0])
    run = Simulation(scene, step=1e-3)
    run.advance(0.05)
    assert run.positions == pytest.approx(np.array([[-0.005, 0, 0], [0.005, 0, 0]]), abs=1e-9)


@pytest.mark.parametrize(
    ("speed", "gap", "parts"),
    [((3, 0), 0, 1), ((5, 0), 0, 2), ((17, 0), 0, 5), ((4000, 0), 0, 1000), ((5, 0), 9, 2),
     ((5, 0), 11, 1), ((-5, 0), 0, 1), ((0, 5), 3, 1)],
)  # fmt: skip
def test_a_part_of_a_step_is_half_of_what_meets(speed, gap, parts):
    """Discs of radius R = 8 h that approach by 2 v h take ceil(2 v / 8) parts, 1000 at most; one if
    they part, pass by, or are farther apart, ``gap`` h.  Powers of two leave no round-off."""
    scene, h = Scene(2, [0, 0]), 2.0**-10
    for side in (-1, 1):
        place, way = [side * (8 * h + gap * h / 2), 0], [-side * v for v in speed]
        scene.add(Disc(8 * h), density=1.0, position=place, velocity=way)
    assert count_parts(*make_world(scene), h) == parts


def test_what_gravity_adds_within_a_step_counts():
    """A disc at rest above a plate of thickness d meets it within the step: its way is g h^2, and a
    part of d / 2 is a part of the step."""
    scene, h, d = Scene(2, [0, -GRAVITY]), 0.1, 0.005
    scene.add(Polygon.rectangle(1.0, d), fixed=True)
    scene.add(Disc(0.01), density=1.0, position=[0, d / 2 + 0.01 + 0.03])
    assert count_parts(*make_world(scene), h) == np.ceil(GRAVITY * h**2 / (d / 2))


def test_a_step_too_long_for_bodies_that_meet_is_refused():
    """With the bodies, their speed and the step to take; that step is then enough."""
    scene = Scene(2, [0, 0])
    scene.add(Polygon.rectangle(1, 1e-4), fixed=True, name="foil")
    scene.add(Disc(0.01), density=1.0, position=[0, 1.0], velocity=[0, -100.0], name="shot")
    with pytest.raises(NotConverged, match=r"100 m/s.*\n.*shorter than 0.0005 s") as caught:
        Simulation(scene, step=0.02).advance(0.02)
    assert {"foil", "shot"} <= set(str(caught.value).replace(":", "").split())
    run = Simulation(scene, step=4e-5)
    run.advance(0.02)
    assert run.positions[1] == pytest.approx([0, 0.01 + 5e-5], abs=1e-9)


def throw(seed: int, method: str, step: float) -> Floats:
    """Where a box, a disc or a pentagon is that was thrown on flush slabs."""
    rng = np.random.default_rng(seed)
    scene = Scene(2, [0, -GRAVITY])
    lay_floor(scene, "slabs", 0.0, rng)
    corner = 2 * np.pi * np.arange(5) / 5
    shape = [
        Polygon.rectangle(0.06, 0.04), Disc(0.025),
        Polygon(0.03 * np.column_stack([np.cos(corner), np.sin(corner)])),
    ][seed % 3]  # fmt: skip
    body = scene.add(
        shape, density=2700.0, position=[0.0, rng.uniform(0.05, 0.07)], angle=rng.uniform(0, 3),
        velocity=rng.uniform(-1, [1, 0.3]), spin=rng.uniform(-5, 5), friction=rng.uniform(0, 0.6),
    )  # fmt: skip
    run = Simulation(scene, method, step=step)
    run.advance(0.1)
    return run.positions[body]


@pytest.mark.long
def test_time_stepping_agrees_with_the_acceleration_method():
    """Contacts open and close within a step: an error of first order in it.  At 2 m/s a step's way
    is 2e-3 m; the mean error falls with the step; a false contact would leave a centimetre."""
    error = {1e-3: [], 2.5e-4: []}
    for seed in range(12):
        exact = throw(seed, "acceleration", 1e-3)
        for step, found in error.items():
            found.append(float(np.abs(throw(seed, "time-stepping", step) - exact).max()))
    assert max(error[1e-3]) < 2e-3
    assert np.mean(error[2.5e-4]) < 0.5 * np.mean(error[1e-3])


def test_a_box_that_falls_flat_across_a_joint_collides():
    """Acceleration method: the corner that comes down beside a joint is a collision, not what bears
    on after another one slid off.  Without that its friction was lost, or the run ended."""
    found = []
    for joints in ("slabs", "one"):
        scene = Scene(2, [0, -GRAVITY])
        lay_floor(scene, joints, 0.0, np.random.default_rng(0))
        block, place = Polygon.rectangle(0.06, 0.04), [0.0, 0.0662845]
        scene.add(block, density=2700.0, position=place, velocity=[-0.81616812, -0.21986932],
                  angle=0.45, spin=-0.67, friction=0.157)  # fmt: skip
        run = Simulation(scene, "acceleration", step=1e-3)
        run.advance(0.1)
        found.append([*run.positions[-1], *run.velocities[-1]])
    assert found[0] == pytest.approx(found[1], abs=2e-4)
