"""A bed from a saved state in place of the rain: what is read, kept and refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import State, load_state
from adapters.errors import SceneError
from adapters.files.states import write_state_file
from adapters.files.window import load_window
from adapters.procedure.run import resume, run_scene
from adapters.scene.bearing import warn_of_bed
from adapters.scene.file import load_scene
from adapters.scene.stages import draw_start
from tests.engine_sample import QUIET, TINY
from trackbed.scenes import find_scene_file

COARSE = find_scene_file("karrech-coarse")
FAKE = ('engine.name="fake"', *TINY)


@pytest.fixture
def bed() -> State:
    """Three grains on the floor of a cylinder, the last two of which touch by 1e-6 m."""
    position = np.array([[2e-3, 9e-3, 2e-3], [3e-3, 3e-3, 3e-3], [9e-3 - 1e-6, 3e-3, 3e-3]])
    radius, still = np.array([2e-3, 3e-3, 3e-3]), np.zeros((3, 3))
    return State(np.array([2, 5, 7]), position, radius, radius**3, still, still)


@pytest.mark.parametrize("name", ["bed.npz", "bed.dump", "bed.dump.gz", "bed.vtkhdf"])
def test_places_and_radii_are_those_of_the_file(name: str, bed: State, tmp_path: Path) -> None:
    """To the last bit, from each kind of file; grains are numbered in the order they had."""
    if name.endswith(".vtkhdf"):
        pytest.importorskip("h5py")
    write_state_file(bed, tmp_path / name)
    scene = load_scene(COARSE, [f'sample.state="{tmp_path / name}"'])
    position, radius, height = draw_start(scene)
    np.testing.assert_array_equal(position, bed.position)
    np.testing.assert_array_equal(radius, bed.radius)
    assert (scene.grain_count, height) == (3, 12e-3)
    radii = scene.sample.radii
    assert (radii.smallest, radii.mean, radii.greatest) == pytest.approx((2e-3, 8e-3 / 3, 3e-3))
    assert radii.volume_mean == pytest.approx(4 / 3 * np.pi * 62e-9 / 3)


CONTRADICT = [
    ("sample.count=9", "count: a saved bed has its own grains"),
    ("sample.grain_radius.mean=3e-3", "grain_radius: a saved bed has its own grains"),
    ('sample.form="tetrahedron"', "form: a saved bed has its own grains"),
    ("sample.seed=2", "seed: nothing is drawn for a saved bed"),
    ("sample.relative_density_start=0.1", "relative_density_start: nothing is drawn"),
    ("sample.radius=2e-3", "radii up to 0.003 m do not fit"),
    ('sample.state="nowhere.npz"', "state: cannot be read (No such file or directory)"),
    (f'sample.state="{COARSE}"', "state: this is a scene, no series and no state"),
    (f'sample.state="{COARSE.parent}"', "state: the dump cannot be opened (Is a directory)"),
]


@pytest.mark.parametrize(("override", "words"), CONTRADICT)
def test_contradictions_are_refused(override: str, words: str, bed: State, tmp_path: Path) -> None:
    write_state_file(bed, tmp_path / "bed.npz")
    with pytest.raises(SceneError, match=re.escape(words)):
        load_scene(COARSE, [f'sample.state="{tmp_path / "bed.npz"}"', override])


DEEP = [
    (slice(2, 3), (-0.16e-3, 0.0, 0.0), "1 contacts of 3 grains"),
    (slice(2, 3), (-0.16e-3, 0.0, 0.0), "of grain 5 with grain 7, by 0.0537"),
    (slice(0, 1), (0.0, 0.0, -0.12e-3), "of grain 2 with the scene's walls or floor, by 0.06"),
    (slice(0, 1), (0.0, -1.3189e-3, 0.0), "of grain 2 with grain 5, by 0.055"),
    (slice(0, 3), (0.0, 0.0, -1.0), "3 contacts of 3 grains"),
]


@pytest.mark.parametrize(("grains", "move", "words"), DEEP)
def test_a_bed_of_another_container_is_refused(
    grains: slice, move: tuple[float, float, float], words: str, bed: State, tmp_path: Path
) -> None:
    """What lies deeper than 0.05 of the smaller radius, with grain and depth; no less does."""
    for scale, allowed in ((0.8, True), (1.0, False)):
        position = bed.position.copy()
        position[grains] += scale * np.array(move)
        write_state_file(bed.move_to(position), path := tmp_path / f"{scale}.npz")
        scene = load_scene(COARSE, [f'sample.state="{path}"'])
        if allowed and move[2] != -1.0:
            draw_start(scene)
            continue
        with pytest.raises(SceneError, match=re.escape(words)):
            draw_start(scene)


def test_a_bed_that_floats_is_said(bed: State, tmp_path: Path) -> None:
    """All of it, or a grain of it; it may fall as the rain does, so it is no error."""
    for grains, words in ((slice(0), None), (slice(2), "2 of 3 grains"), (slice(1), "1 of 3")):
        position = bed.position.copy()
        position[grains, 2] += 0.03
        write_state_file(bed.move_to(position), path := tmp_path / "bed.npz")
        said = [*warn_of_bed(load_scene(COARSE, [f'sample.state="{path}"']))]
        assert [words in one for one in said if "rest neither" in one] == [True] * bool(words)


def test_a_run_keeps_its_bed(tmp_path: Path) -> None:
    """It begins where another run's last stage ended, goes on without that run, from its copy to
    the last bit, and not with another bed."""
    run_scene(COARSE, tmp_path / "old", overrides=FAKE, progress=QUIET)
    last = load_window(tmp_path / "old" / "window_000007" / "states.npz").state(-1)
    own = (*FAKE, f'sample.state="{tmp_path / "old"}"')
    run_scene(COARSE, run := tmp_path / "run", overrides=own, progress=QUIET)
    kept = load_state(run / "bed.npz")
    np.testing.assert_array_equal(kept.position, last.position)
    density = load_scene(COARSE).material.grain.density
    assert kept.mass == pytest.approx(4 / 3 * np.pi * density * last.radius**3)
    (tmp_path / "old").rename(tmp_path / "gone")
    resume(run, cycles=13, progress=QUIET)
    write_state_file(last.move_to(last.position + 1e-6), tmp_path / "old.npz")
    other = (*FAKE, f'sample.state="{tmp_path / "old.npz"}"')
    with pytest.raises(SceneError, match=r"sample\.state: .* there, .* now"):
        run_scene(COARSE, run, overrides=other, progress=QUIET)
