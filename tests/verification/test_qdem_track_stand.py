"""Whether a bed stands: a block on a slope that is let go, with friction enough or too little.

It lies with four spheres on those of one that is held, on a slope of tan(alpha) = 0.2, at rest with
friction 0.5: what its contacts hold across is 0.2 of what they bear, on the upper ones more, as the
weight has a lever.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.contact.sphere_state import SphereContacts
from qdem_fem.files.errors import NotConverged
from qdem_fem.march.kinetic_damping import compute_masses, find_rest
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from qdem_fem.track import stand as track_stand
from qdem_fem.track.bed import Bed, read_bed, write_bed
from qdem_fem.track.bodies import place_grains
from qdem_fem.track.enter import TrackPrepared, choose_contact
from qdem_fem.track.recipe import make_bed_grains
from qdem_fem.track.stand import begin_bed, judge_bed, let_bed_stand
from tests.verification.test_qdem_track import RADIUS, RECIPE, STIFFNESS, STONE
from validation.bench.track_trials import SCENE

SLOPE, TIME = np.arctan(0.2), 5e-3
DOWN = 9.81 * np.array([np.sin(SLOPE), 0.0, -np.cos(SLOPE)])
SLOPING = replace(RECIPE, gravity=tuple(DOWN), stiffness=(STIFFNESS, STIFFNESS))


def contact(friction: float) -> q.SphereContact:
    return q.SphereContact(RADIUS, STIFFNESS, friction)


@pytest.fixture
def bed(monkeypatch: pytest.MonkeyPatch) -> Bed:
    """The block at rest on the other with friction 0.5."""

    def bodies(*_: object, **__: object) -> dict[str, q.Body]:
        size, apart = (0.05, 0.05, 0.05), 0.05 + 2 * RADIUS
        made = [make_box_mesh(size, (1, 1, 1), origin=(0.0, 0.0, z)) for z in (0.0, apart)]
        return {
            name: q.Body(mesh, STONE, name=name, rigid=True)
            for name, mesh in zip(("held", "sleeper"), made, strict=True)
        }

    def hold(run: q.Simulation, *_: object, **__: object) -> None:
        run.fix(run.bodies[0], np.arange(8), "xyz")

    monkeypatch.setattr(track_stand, "make_bed_bodies", bodies)
    monkeypatch.setattr(track_stand, "guide_sleeper", hold)
    monkeypatch.setattr(track_stand, "make_bed_grains", lambda recipe: None)
    nodes = [body.nodes for body in bodies().values()]
    run, _ = begin_bed(SLOPING, Bed("rest", nodes, np.zeros((16, 3)), {}, {}), contact(0.5))
    find_rest(run, 1e-3, 1e-4, 0.0, 2.0, look=5)
    assert isinstance(run.contacts, SphereContacts)
    moved = np.concatenate([body.displacement for body in run.bodies])
    return Bed("rest", nodes, moved, run.contacts.pack_state(), {"rest": {}})


def test_a_bed_with_friction_to_spare_stands(bed: Bed, tmp_path: Path) -> None:
    path = tmp_path / "bed.npz"
    write_bed(path, SLOPING, bed)
    stand = judge_bed(SLOPING, bed, path, contact(0.5), TIME, 0.01)
    assert stand.pairs == 4
    assert stand.at_limit == 0.0
    assert stand.median == pytest.approx(0.2 / 0.5, rel=0.1)
    assert stand.creep < 1e-6


def test_a_bed_with_too_little_is_refused_and_remembered(
    bed: Bed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Let go at friction 0.15 it slides; sliders take 0.15 W cos(alpha) over the way it goes and
    what the springs give way by, W (sin - 0.15 cos)/(4 k_t)."""
    path = tmp_path / "bed.npz"
    with pytest.raises(NotConverged, match=r"sliders take .* at Coulomb's limit .0\.01 asked"):
        judge_bed(SLOPING, bed, path, contact(0.15), TIME, 0.01)
    kept = read_bed(path, SLOPING)
    monkeypatch.setattr(track_stand, "let_bed_stand", None)  # read from the file
    stand = judge_bed(SLOPING, kept, path, contact(0.15), TIME, 1.0)
    assert asdict(stand) in list(kept.stands.values())
    assert stand.at_limit == 0.5  # the upper ones, which bear less
    run, bodies = begin_bed(SLOPING, bed, contact(0.15))
    before = bodies["sleeper"].displacement[:, 0].mean()
    weight = float(compute_masses(run)[1] * 9.81)
    run.advance(TIME)
    way = bodies["sleeper"].displacement[:, 0].mean() - before
    tangential = STIFFNESS / (2 * 1.2)  # k_n/(2 (1 + nu))
    way += weight * (np.sin(SLOPE) - 0.15 * np.cos(SLOPE)) / (4 * tangential)
    assert stand.slid == pytest.approx(0.15 * weight * np.cos(SLOPE) * way, rel=0.1)


def scene_in_the_air(folder: Path, text: Callable[[str], str]) -> TrackPrepared:
    """The track of 20 grains, its bed a file of grains that do not touch."""
    path = folder / "scene.toml"
    path.write_text(text(SCENE), encoding="utf-8")
    prepared = load_scene(path)
    assert isinstance(prepared, TrackPrepared)
    layout, recipe = prepared.recipe.layout, prepared.recipe
    grains = place_grains(make_bed_grains(recipe))
    nodes: list[Any] = layout.place_grains_below(grains[: recipe.below], 1)
    nodes += layout.place_beside(grains[recipe.below :], 0.6, 2)
    nodes.append(layout.sleeper(0.6).nodes)
    moved = np.zeros((sum(map(len, nodes)), 3))
    write_bed(prepared.bed_file, recipe, Bed("rest", nodes, moved, {}, {}))
    return prepared


@pytest.mark.long
def test_skin_and_friction_of_a_scene_are_the_runs(tmp_path: Path) -> None:
    prepared = scene_in_the_air(tmp_path, lambda text: text.replace(
        "radius = 0.012", "radius = 0.012\nskin = 1.5e-3"))  # fmt: skip
    assert choose_contact(prepared).skin == 1.5e-3
    run, _ = make_simulation(prepared)
    assert run.contacts is not None
    assert run.contacts.skin == 1.5e-3
    assert prepared.stand["creep"] == 0.0
    assert "let go for 0.5 ms with friction 0.577" in prepared.stand["words"]


def test_a_bed_of_grains_in_the_air_takes_nothing(tmp_path: Path) -> None:
    prepared = scene_in_the_air(tmp_path, str)
    bed = read_bed(prepared.bed_file, prepared.recipe)
    stand = let_bed_stand(prepared.recipe, bed, choose_contact(prepared), 1e-5)
    assert (stand.pairs, stand.creep, stand.at_limit) == (0, 0.0, 0.0)
