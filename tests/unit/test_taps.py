"""Porosity in the middle of a bed, and taps that bring it to the one a scene asks for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.bed.container import Container
from adapters.bed.state import FloatArray, State
from adapters.engines import taps
from adapters.engines.contract import EngineRun
from adapters.engines.plan import PLAN
from adapters.errors import NotConverged, NotCredible
from adapters.procedure.progress import describe_plan
from adapters.scene.file import load_scene
from adapters.scene.porosity import find_middle, measure_porosity
from trackbed.scenes import find_scene_file

ASKED = 0.4


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5])
def test_porosity_of_a_lattice(shift: float) -> None:
    """1 - pi/6 of touching spheres of one size wherever the faces, edges and corners of the box cut
    them: the parts inside opposite faces, a lattice apart, add up to one sphere each."""
    centre = np.array(list(product(range(8), range(7), range(8))), float) + shift - 0.5
    centre[:, 2] -= centre[:, 2].mean() - 3.0  # a bed 6 high
    box = Container("box", size_x=6.0, size_y=5.0)
    found = measure_porosity(centre, np.full(len(centre), 0.5), box)
    assert found == pytest.approx(1 - pi / 6, rel=1e-12)


@given(axis=st.integers(0, 2), away=st.floats(0, 1.6))
def test_part_inside_a_face_is_a_cap(axis: int, away: float) -> None:
    """Two spheres ``away`` on both sides of the middle of a cube of edge 2: whole spheres, caps
    pi h^2 (3 r - h)/3 or nothing count, at each of its six faces."""
    centre = np.full((2, 3), 2.0)
    centre[:, axis] += [-away, away]
    found = measure_porosity(centre, np.full(2, 0.5), Container("box", size_x=4.0, size_y=4.0))
    height = np.clip(1.5 - away, 0, 1)
    assert found == pytest.approx(1 - 2 * pi * height**2 * (1.5 - height) / 3 / 8, abs=1e-12)


def test_porosity_is_monte_carlo() -> None:
    """Of spheres of three sizes, against points drawn in the same box, within five deviations."""
    generator = np.random.default_rng(3)
    radius = np.repeat([0.4, 0.5, 0.6], 700)
    centre = generator.uniform(0, 20, (len(radius), 3))
    keep = [0]
    for i in range(1, len(radius)):  # no two overlap
        apart = np.linalg.norm(centre[keep] - centre[i], axis=1)
        if (apart > radius[keep] + radius[i]).all():
            keep.append(i)
    centre, radius = centre[keep], radius[keep]
    box = Container("box", size_x=20.0, size_y=20.0)
    height = 2 * np.average(centre[:, 2], weights=radius**3)
    grain = 2 * radius.mean()
    high = np.array([20.0, 20.0, height]) - grain
    point = generator.uniform(grain, high, (40_000, 3))
    filled = np.zeros(len(point), bool)
    for place, r in zip(centre, radius, strict=True):
        filled |= ((point - place) ** 2).sum(axis=1) < r**2
    error = sqrt(filled.mean() * (1 - filled.mean()) / len(point))
    assert abs(measure_porosity(centre, radius, box) - 1 + filled.mean()) < 5 * error


@pytest.mark.parametrize("symmetry", [(), ("x",), ("x", "y")])
def test_middle_of_a_cylinder(symmetry: tuple[str, ...]) -> None:
    """Its far corners are a grain inside the round wall, its near faces a grain inside mirrors."""
    middle = find_middle(Container("cylinder", symmetry, radius=9.0), 1.0, 7.0)
    assert middle is not None
    low, high = middle
    assert np.hypot(*high[:2]) == pytest.approx(8.0)
    assert (low[2], high[2]) == (1.0, 6.0)
    assert [low[a] == 1.0 for a in range(2)] == [axis in symmetry for axis in "xy"]
    low_bed = np.array([[0.0, 0.0, 1.95]]), np.array([0.5])
    assert np.isnan(measure_porosity(*low_bed, Container("cylinder", symmetry, radius=9.0)))


class Beds:
    """Beds with given porosities, in place of an engine that is tapped."""

    def __init__(self, porosity: list[float]) -> None:
        self.porosity, self.height = iter(porosity), 0.0
        self.started = list[FloatArray]()

    def read(self, *_: object) -> tuple[State, float]:
        """The next bed, one grain, higher than the one before by 1."""
        still, radius = np.zeros((1, 3)), np.array([0.5])
        self.height += 1.0
        place = np.array([[0, 0, self.height]])
        return State(np.array([1]), place, radius, radius, still, still), next(self.porosity)

    def settle(self, position: FloatArray, radius: FloatArray, height: float) -> EngineRun:
        """Note where the bed started."""
        assert height == pytest.approx(2 * (position[0, 2] + radius[0]))
        self.started.append(position[0, 2])
        return EngineRun(("tap",), 1.0, 2.0, 0.5, {})


Tap = Callable[..., tuple[Beds, EngineRun]]


@pytest.fixture
def tap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Tap:
    """Taps a series of porosities to `ASKED`; returns the beds and what the run cost."""
    scene = load_scene(find_scene_file("ballast"), (f"sample.porosity={ASKED}",))

    def run(*porosity: float) -> tuple[Beds, EngineRun]:
        beds = Beds([*porosity])
        monkeypatch.setattr(taps, "read_bed", beds.read)
        rain = EngineRun(("rain",), 10.0, 20.0, 5.0, {})
        return beds, taps.tap_bed(scene, tmp_path, ("floor",), rain, beds.settle)

    return run


def test_taps_end_where_the_porosity_is_reached(tap: Tap, tmp_path: Path) -> None:
    """Each tap starts from the bed before, lifted by the fall; one that packs too dense is taken
    back, and from there on the fall is half as high; the cost is that of rain and taps."""
    beds, done = tap(0.45, 0.43, 0.38, 0.42, 0.398)
    fall = PLAN.tap_fall * 1.0  # of grains of diameter 1
    assert beds.started == pytest.approx([1 + fall, 2 + fall, 2 + fall / 2, 4 + fall / 2])
    assert (done.cpu_s, done.wall_s, done.start_up_s) == (14.0, 28.0, 7.0)
    table = np.loadtxt(tmp_path / "taps.txt", skiprows=1)
    assert table[:, 2] == pytest.approx([0.45, 0.43, 0.38, 0.42, 0.398])
    assert table[:, 1] == pytest.approx([0, fall, fall, fall / 2, fall / 2])


def test_porosity_that_cannot_be_had_is_refused(tap: Tap) -> None:
    """With the one that is reached, or that the bed has before any tap; hardly less is enough."""
    with pytest.raises(NotConverged, match=r"bring the bed to a porosity of 0\.412, not 0\.4"):
        tap(0.45, *[0.412] * PLAN.taps_most)
    with pytest.raises(NotCredible, match=r"porosity of 0\.390 before any tap, below 0\.4"):
        tap(0.39)
    scene = load_scene(find_scene_file("ballast"), ('engine.name="yade"', "sample.porosity=0.4"))
    assert "taps to a porosity of 0.4" in next(describe_plan(scene, 1.0))
    beds, done = tap(ASKED - 0.9 * PLAN.porosity_step)
    assert (beds.started, done.command) == ([], ("rain",))
