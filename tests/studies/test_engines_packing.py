"""The engines' study: the mirrored bed is in balance, a way's figures are those of positions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.bed import contact_law
from adapters.bed.radii import draw_radii
from adapters.bed.sample import GRAVITY, draw_sample_start, measure_bed_height
from adapters.bed.state import FloatArray
from adapters.errors import NotCredible
from validation.studies.engines.packing import Way, load_bed, measure, run_way
from validation.studies.engines.speed import MIRROR, SIDE, check_end, load_tiles, mirror_tiles

pytestmark = pytest.mark.studies
FAKE = Way("fake", "fake")


def start_of(way: Way) -> tuple[FloatArray, FloatArray]:
    """Grains that do not touch, and their radii."""
    scene = way.scene(1)
    radius = draw_radii(scene.sample.radii, scene.grain_count, 1)
    return draw_sample_start(radius, scene.container, 0.15, 1)[0], radius


def test_figures_of_a_run(tmp_path: Path) -> None:
    """Settlement is counted from the seated bed, the start's from the common positions."""
    start, radius = start_of(FAKE)
    figures, cpu_s = run_way(FAKE, 1, start, radius, tmp_path, cycles=12)
    assert cpu_s >= 0
    assert len(figures.curve) == 13
    assert figures.curve[0] == 0
    assert figures.settlement == figures.curve[-1]
    assert figures.settlement_after_first == pytest.approx(figures.curve[-1] - figures.curve[1])
    assert figures.settlement > 0


def test_density_and_coordination_are_those_of_the_positions(tmp_path: Path) -> None:
    """A window whose grains are put where the answer is known: two that touch."""
    start, radius = start_of(FAKE)
    run_way(FAKE, 1, start, radius, tmp_path, cycles=12)
    scene = FAKE.scene(1)
    from adapters.engines.contract import get_engine
    from adapters.files.window import read_window

    names = get_engine("fake").wall_names(scene, piston=True)
    window = read_window(tmp_path / "loaded", 0, names, 0.05)
    apart = np.column_stack([np.zeros(len(radius))] * 2 + [np.arange(len(radius)) * 0.02 + 0.01])
    apart[1] = apart[0] + [0, 0, radius[0] + radius[1] - 1e-6]
    still = replace(window, position=np.repeat(apart[None], len(window.position), axis=0))
    figures = measure(still, apart, scene)
    assert figures.coordination == pytest.approx(2 / len(radius))
    assert figures.settlement == 0
    top = 0.9 * measure_bed_height(apart, radius)
    assert figures.density < 4 / 3 * np.pi * np.sum(radius**3) / (scene.container.area * top)


def test_beds_differ_by_their_seed_alone() -> None:
    first, second = load_bed(1), load_bed(2)
    assert first.model_copy(update={"sample": second.sample}) == second
    assert first.sample.model_copy(update={"seed": 2}) == second.sample


def test_an_image_pushes_as_the_mirror_did() -> None:
    """F(d) of a rigid frictionless plane = F(2 d) of the grain and its image, exactly.

    4/3 E' sqrt(R) d^(3/2) with E' = E/(1 - nu^2), and 4/3 E'/2 sqrt(R/2) (2 d)^(3/2).
    """
    scene = load_tiles("liggghts", (1, 1), **MIRROR)
    radius, overlap = 3.2e-3, 1e-6
    mirror = contact_law.find_normal_force(overlap, scene.stiffness.mirror, radius)
    image = contact_law.find_normal_force(2 * overlap, scene.stiffness.grain, radius / 2)
    wall = contact_law.find_normal_force(overlap, scene.stiffness.wall, radius)
    assert image == pytest.approx(mirror, rel=1e-12)
    assert wall == pytest.approx(mirror, rel=1e-4)  # 46.9e9 over 1e15, the two sides without mirror


def test_tiles_are_reflected_at_each_other() -> None:
    """A grain that leans on a side by d overlaps its image by 2 d; all others keep their gaps."""
    overlap, radius = 1e-5, 3e-3
    place = np.array([[SIDE - radius + overlap, 0.02, 0.01], [0.02, radius - overlap, 0.03]])
    bed, radii = mirror_tiles(place, np.full(2, radius), (3, 2))
    assert bed.shape == (12, 3)
    assert radii.shape == (12,)
    gap = np.linalg.norm(bed[:, None] - bed, axis=2)[np.triu_indices(12, 1)]
    touching = 2 * radius - gap[gap < 2 * radius]
    # Along x the first grain of tiles 0 and 1, in each of two rows; along y the outer sides alone.
    assert len(touching) == 2
    np.testing.assert_allclose(touching, 2 * overlap, rtol=1e-9)
    assert np.all(bed.min(axis=0) >= radius - overlap - 1e-12)
    assert np.all(bed[:, :2].max(axis=0) <= np.array([3, 2]) * SIDE - radius + overlap + 1e-12)


def grains_at_rest(count: int = 4) -> np.ndarray:
    end = np.zeros((count, 9))
    end[:, 0] = np.arange(1, count + 1)
    end[:, 7], end[:, 8] = 3e-3, 3e-4
    return end


def test_no_time_is_told_of_a_bed_that_fell_apart() -> None:
    """Lost grains, nan, and grains that fly are refused; a bed at rest is not."""
    check_end(grains_at_rest(), 4)
    with pytest.raises(NotCredible, match="3 of 4 grains"):
        check_end(grains_at_rest(3), 4)
    for speed in (np.nan, np.sqrt(2 * 1.1e-3 * GRAVITY * 3e-3)):
        end = grains_at_rest()
        end[:, 4] = speed
        with pytest.raises(NotCredible):
            check_end(end, 4)
