"""Scenes for ballast: what their keys mean, and what is said where they make no sense."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from adapters.bed.container import Container
from adapters.bed.overlaps import find_pairs
from adapters.bed.radii import GradedRadii, draw_radii
from adapters.bed.state import FloatArray
from adapters.engines import fake as engine_fake
from adapters.engines.fake import SETTLEMENT, FakeBed
from adapters.errors import SceneError
from adapters.files.run_folder import RunFolder
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from tests.small_bed import read_rows
from trackbed.scene_files.grading import GRADINGS, measure_passing
from trackbed.scenes import find_scene_file, read_template


@pytest.mark.parametrize("name", GRADINGS)
def test_named_gradings_keep_their_limits(name: str) -> None:
    """Of 400 spheres drawn by mass as much passes each sieve as the standard allows; their moments
    are the closed ones to the part that one slice of number holds, 1/400."""
    low, high = GRADINGS[name].limits  # type: ignore[misc]
    radii = GradedRadii(GRADINGS[name].scale(0.2))
    drawn = draw_radii(radii, 400, 3)
    passing = measure_passing(2 * drawn, 0.2 * GRADINGS[name].sieves)
    assert ((low <= passing) & (passing <= high)).all()
    assert radii.smallest <= drawn.min() <= drawn.max() <= radii.greatest
    assert drawn.mean() == pytest.approx(radii.mean, rel=1 / 400)
    assert 4 / 3 * np.pi * (drawn**3).mean() == pytest.approx(radii.volume_mean, rel=3 / 400)


def test_grading_of_a_scene_is_its_radii() -> None:
    """By name, scaled, or as a table of sieves in mm and per cent; even in ln D between two."""
    path = find_scene_file("ballast")
    radii = load_scene(path, ["sample.grading_scale=0.1"]).sample.radii
    assert (radii.smallest, radii.greatest) == pytest.approx((1.12e-3, 3.15e-3))
    table = load_scene(path, ["sample.grading=[[20, 0], [40, 100]]"])
    drawn = draw_radii(table.sample.radii, 1000, 1)
    with pytest.raises(SceneError, match=r"3 grains .* the standard's limits are"):
        draw_radii(radii, 3, 1)
    half = measure_passing(2 * drawn, np.array([0.02 * np.sqrt(2)]))
    assert half == pytest.approx(0.5, abs=2 / 1000)


@given(hnp.arrays(float, (5, 3), elements=st.floats(0.0, 0.06)), st.booleans())
def test_grains_meet_the_nearest_point_of_a_block(position: FloatArray, mirror: bool) -> None:
    """Overlaps are those with the nearest of 10^4 points of the plate, to half their spacing."""
    container = Container("box", ("x",) * mirror, size_x=0.06, size_y=0.05)
    edges = container.place_footprint((0.04, 0.02))
    walls, radius = container.walls(0.03, piston_edges=edges), np.full(5, 0.1)
    rows = find_pairs(position, radius, walls)
    x, y = np.meshgrid(np.linspace(max(edges[0], 0.0), edges[1], 101), np.linspace(*edges[2:], 101))
    plate = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.03)])
    for grain in range(5):
        row = (rows.first == grain) & (rows.second == -len(walls.plane_name))
        nearest = np.linalg.norm(plate - position[grain], axis=1).min()
        assert 0.1 - rows.overlap[row] == pytest.approx(nearest, abs=1e-3)


SECOND = "loading.stage=[{from_cycle=600, amplitude=9e3, mean=4e3, frequency=9.0}]"
REFUSED = [
    ("ballast", ['sample.grading="EN 13450 31.5/63"'], "did you mean EN 13450 31.5/50"),
    ("ballast", ["sample.grading=[[20, 0], [40, 90]]"], "percentages that grow from 0 to 100"),
    ("ballast", ["sample.grading=[[0.02, 0], [0.04, 100]]"], "sieves are given in mm"),
    ("ballast", ["sample.grading=7"], "[[sieve in mm, passing in %], ...]"),
    ("karrech", ["sample.grading_scale=0.5"], "no sample.grading to scale"),
    ("karrech-coarse", ['sample.grading="AREMA 4"'], "radii up to 0.0254 m do not fit"),
    ("ballast", ["sample.grain_radius.mean=1e-3"], "give this or grading, not both"),
    ("ballast", ["material.grain.friction=0"], "grain.rolling_friction: grains without friction"),
    ("karrech", ["loading.footprint=[0.1, 0.1]"], "needs a box that holds it, not a cylinder"),
    ("ballast", ["loading.footprint=[0.31, 0.01]"], "holds it, this one is 0.3 m by 0.28 m"),
    ("ballast", ["loading.area_share=0.5"], "a box takes loading.footprint"),
    ("karrech-partial", ["loading.crib=0.1"], "ballast beside a block: give loading.footprint"),
    ("ballast", ["loading.crib=0.1", "loading.footprint=[0.27, 0.26]"], "no grain has room beside"),
    ("ballast", ["loading.crib=0.1", 'sample.form="tetrahedron"'], "lies on spheres alone so far"),
    ("ballast", ["loading.crib=0.1", 'procedure.relaxation="karrech2007"'], "eq. 29 knows no"),
    ("ballast", ["sample.rain_friction=0.9"], "must be at most the grains' friction, 0.8"),
    ("ballast", ["sample.porosity=0.1"], "sample.porosity"),
    ("ballast", ["sample.porosity=0.4", 'sample.form="tetrahedron"'], "taps of spheres alone"),
    ("ballast", ["sample.porosity=0.4", "sample.size_x=0.13"], "where this bed is less than two"),
    ("ballast", ["sample.porosity=0.4", "sample.fill_height=0.13"], "a mean grain is 0.0346 m"),
    ("ballast", [SECOND], "from_cycle must grow, to below total_cycles = 500"),
    ("ballast", [SECOND, "procedure.tolerance=0.1"], "by history alone know when a load began"),
    ("ballast", [SECOND], "the stress would fall to mean - amplitude/2 = -500 Pa"),
]


@pytest.mark.parametrize(("scene", "overrides", "words"), REFUSED)
def test_senseless_scenes_are_refused(scene: str, overrides: list[str], words: str) -> None:
    with pytest.raises(SceneError, match=re.escape(words)):
        load_scene(find_scene_file(scene), overrides)


STAGE = "\n[[loading.stage]]\nfrom_cycle = 200\namplitude = 9e3\nmean = 4500.0\nfrequency = 30.0\n"


def test_jumps_keep_to_their_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a bed that settles by ln of the cycles of each load no jump crosses to another load, and
    jumps land within 2 % of what it settles by in all: they forecast by the cycles of their load.
    """
    bed = FakeBed(lambda n: SETTLEMENT * (np.log1p(n) + 3 * np.log1p(np.clip(n - 200, 0, None))))
    monkeypatch.setattr(engine_fake, "BED", bed)
    (tmp_path / "scene.toml").write_text(read_template("karrech-coarse") + STAGE)
    run_scene(tmp_path / "scene.toml", tmp_path / "run", overrides=('engine.name="fake"',))
    done = [one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump"]
    assert len(done) >= 6
    assert not any(one.first_cycle < 200 < one.last_cycle for one in done)
    settled = float(read_rows(tmp_path / "run")[-1]["mean_grain_settlement"])
    assert settled == pytest.approx(bed.settlement(0, 500)[-1], rel=0.02)
