"""Ways to move grains in a jump: those that left, the noise of a window, profiles, in scenes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from adapters.engines.fake import SETTLEMENT
from adapters.errors import SceneError, UsageError
from adapters.files.run_folder import RunFolder
from adapters.moves import RETIRED, get_move
from adapters.moves.contract import extrapolate_grains
from adapters.moves.profile import extrapolate_blocks, weigh_grains, within_variance
from adapters.procedure.run import record_scene, resume, run_scene
from adapters.procedure.status import status
from adapters.scene.file import load_scene
from tests.settling_bed import CYCLE, LOG, QUIET, bed, moved
from tests.small_bed import small_bed


def test_a_near_miss_is_named() -> None:
    """A move that there is not is refused with the nearest name."""
    with pytest.raises(UsageError, match="did you mean 'smoothed'"):
        get_move("smooth")


@pytest.mark.parametrize("name", RETIRED)
def test_a_way_that_left_is_refused_with_what_to_use(name: str, tmp_path: Path) -> None:
    """A scene of an older version says which way, where, what has it, and what to take."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=4, h=2, total_cycles=12))
    with pytest.raises(SceneError) as raised:
        load_scene(scene, [f'procedure.move="{name}"'])
    assert f"--set procedure.move=\"{name}\": procedure.move: unknown way '{name}'" in str(
        raised.value
    )
    assert f"trackbed 0.1 is the last to have it; use '{RETIRED[name]}'" in str(raised.value)


def test_a_run_by_a_way_that_left_is_not_resumed(tmp_path: Path) -> None:
    """A run folder of an older version is refused with the same sentence, and left as it is."""
    scene, run = tmp_path / "scene.toml", tmp_path / "run"
    scene.write_text(small_bed(k=4, h=2, total_cycles=12))
    run_scene(scene, run, progress=QUIET)
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["overrides"].append('procedure.move="shrunk"')
    (run / "manifest.json").write_text(json.dumps(manifest))
    for use in (resume, status):
        with pytest.raises(SceneError, match="is the last to have it; use 'smoothed'"):
            use(run)


# --- the noise of a window, and the profile ------------------------------------------------------


def test_blocks_share_the_window_and_the_law() -> None:
    """Four parts of five cycles; where the law goes on unchanged each says what the whole says."""
    position, _ = bed(noise=0.0)
    parts = extrapolate_blocks(CYCLE, position, LOG, 30)
    assert parts.shape == (4, 120, 3)
    np.testing.assert_allclose(
        parts, [extrapolate_grains(CYCLE, position, LOG, 30)] * 4, atol=1e-12
    )
    assert len(extrapolate_blocks(CYCLE[:4], position[:4], LOG, 30)) == 2
    assert len(extrapolate_blocks(CYCLE[:3], position[:3], LOG, 30)) == 0
    np.testing.assert_array_equal(weigh_grains(np.empty((0, 5, 3))), np.ones(5))


def test_variance_within_a_grain_is_that_of_its_mean() -> None:
    """Independent normal parts: s^2 has mean sigma^2 / b; 9 degrees of freedom each."""
    parts = 2.0 * np.random.default_rng(0).standard_normal((4, 4000, 3))
    found = within_variance(parts)
    error = np.sqrt(2 / 9 / 4000)
    assert found.mean() == pytest.approx(4 / 4, rel=5 * error)


def test_profile_keeps_fluctuations() -> None:
    """Grains at one height move down alike; outwards they move in proportion to their distance."""
    position, radius = bed(4, count=300)
    move = moved(get_move("profile"), position, radius)
    ratio = move[:, :2] / position[-1, :, :2]
    np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-9)
    order = np.argsort(position[-1, :, 2])
    height, drop = position[-1, order, 2], move[order, 2]
    slope = np.diff(drop) / np.diff(height)
    assert (
        len(np.unique(np.round(slope / np.abs(slope).max(), 6))) <= 12
    )  # 4 layers, rounding apart


# --- in a scene -----------------------------------------------------------------------------------


def test_a_run_settled_by_its_history(tmp_path: Path) -> None:
    """Jumps settle the mean grain by the slopes of all cycles, u ~ ln(1 + N) here: met within 3 %.

    The gain that is asked for is in the record of each jump, and relaxation moves it by little.
    """
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=10, h=8, total_cycles=50))
    overrides = ['procedure.settlement="history"']
    run_scene(scene, tmp_path / "run", overrides=overrides, progress=QUIET)
    with (tmp_path / "run" / "settlement.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[-1]["settlement"]) == pytest.approx(SETTLEMENT * np.log(51), rel=0.03)
    settled = {int(row["cycle"]): float(row["settlement"]) for row in rows}
    jumps = [one for one in RunFolder(tmp_path / "run").outcomes() if one.stage == "jump"]
    assert len(jumps) == 2
    for one in jumps:
        exact = SETTLEMENT * np.log((one.last_cycle + 1) / (one.first_cycle + 1))
        assert one.notes["gain"] == pytest.approx(exact, rel=0.1)
        before = settled[one.first_cycle]
        assert one.rows[0]["settlement"] - before == pytest.approx(one.notes["gain"], rel=0.1)


def test_scene_without_the_key_is_the_scene_of_older_runs(tmp_path: Path) -> None:
    """At its default the key is left out of the record; another way is kept, and refused later."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=4, h=2, total_cycles=12))
    usual, named, other = (
        record_scene(load_scene(scene, overrides))["procedure"]
        for overrides in ([], ['procedure.move="smoothed"'], ['procedure.move="profile"'])
    )
    assert "move" not in usual
    assert usual == named
    assert other == usual | {"move": "profile"}
    run_scene(scene, tmp_path / "run", progress=QUIET)
    with pytest.raises(SceneError, match=r"procedure\.move: None in the run, 'profile' now"):
        run_scene(scene, tmp_path / "run", overrides=['procedure.move="profile"'], progress=QUIET)
