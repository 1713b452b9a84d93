"""A way of the packing study on the engine without mechanics, and what its decks say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.engine_lammps import LammpsEngine
from adapters.radii import radii_sample
from adapters.sample import bed_height, sample_start
from adapters.state import FloatArray
from validation import same_packing
from validation.same_packing import TWIN, WAYS, Way, bed_scene, figures_of, run
from validation.same_packing_runs import BASE, plan

FAKE = Way("fake", "fake")


def start_of(way: Way) -> tuple[FloatArray, FloatArray]:
    """Grains that do not touch, and their radii."""
    scene = way.scene(1)
    radius = radii_sample(scene.sample.grain_radius.law, scene.grain_count, 1)
    return sample_start(radius, scene.container, 0.15, 1)[0], radius


def test_figures_of_a_run(tmp_path: Path) -> None:
    """Settlement is counted from the seated bed, the start's from the common positions."""
    start, radius = start_of(FAKE)
    figures, cpu_s = run(FAKE, 1, start, radius, tmp_path, cycles=12)
    assert cpu_s >= 0
    assert len(figures.curve) == 13
    assert figures.curve[0] == 0
    assert figures.settlement == figures.curve[-1]
    assert figures.settlement_after_first == pytest.approx(figures.curve[-1] - figures.curve[1])
    assert figures.settlement > 0


def test_density_and_coordination_are_those_of_the_positions(tmp_path: Path) -> None:
    """A window whose grains are put where the answer is known: two that touch."""
    start, radius = start_of(FAKE)
    run(FAKE, 1, start, radius, tmp_path, cycles=12)
    scene = FAKE.scene(1)
    from adapters.engine import engine_named
    from adapters.window import window_read

    names = engine_named("fake").wall_names(scene, piston=True)
    window = window_read(tmp_path / "loaded", 0, names, 0.05)
    apart = np.column_stack([np.zeros(len(radius))] * 2 + [np.arange(len(radius)) * 0.02 + 0.01])
    apart[1] = apart[0] + [0, 0, radius[0] + radius[1] - 1e-6]
    still = replace(window, position=np.repeat(apart[None], len(window.position), axis=0))
    figures = figures_of(still, apart, scene)
    assert figures.coordination == pytest.approx(2 / len(radius))
    assert figures.settlement == 0
    top = 0.9 * bed_height(apart, radius)
    assert figures.density < 4 / 3 * np.pi * np.sum(radius**3) / (scene.container.area * top)


@pytest.mark.parametrize("way", [w for w in WAYS if not w.pulls], ids=lambda w: w.name)
def test_a_way_without_pull_says_so_to_every_contact(way: Way, tmp_path: Path) -> None:
    scene = way.scene(1)
    start, radius = start_of(way)
    LammpsEngine(way.rule).write_preparation(scene, start, radius, 0.2, tmp_path)
    same_packing._edit(way, tmp_path)
    laws = [line for line in (tmp_path / "scene.in").read_text().splitlines() if "hertz" in line]
    assert len(laws) >= 4
    assert all("limit_damping" in line for line in laws)


def test_ways_differ_in_one_setting_from_an_engine() -> None:
    """Engine alone, or one of: a key of the scene, a rule, the twin; the last one has two."""
    for way in WAYS:
        changes = [bool(way.settings), bool(way.rule), not way.pulls, bool(way.aside)]
        assert sum(changes) <= 1 + (way.name == "lammps, mindlin/force, no pull")
        assert len(way.settings) <= 1
    assert [way.name for way in WAYS[:BASE]] == ["liggghts", "lammps", "yade"]
    assert [way.aside for way in WAYS if way.aside] == [TWIN]


def test_plan_has_every_run_once() -> None:
    made = [(way.name, seed) for way, seed in plan()]
    assert len(set(made)) == len(made) == len(WAYS) * len(same_packing.SEEDS)
    assert made[:4] == [("liggghts", 1), ("lammps", 1), ("yade", 1), ("liggghts", 2)]


def test_beds_differ_by_their_seed_alone() -> None:
    first, second = bed_scene(1), bed_scene(2)
    assert first.model_copy(update={"sample": second.sample}) == second
    assert first.sample.model_copy(update={"seed": 2}) == second.sample
