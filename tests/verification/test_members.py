"""Members of a run, from states that differ by chance alone: each by itself, and together."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import isnan, nan, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import trackbed
from adapters.engines import fake as engine_fake
from adapters.engines.contract import EngineRun
from adapters.engines.fake import FakeBed, FakeEngine
from adapters.files.window import load_window
from adapters.procedure.members import Mean, Settled, describe_result
from adapters.procedure.status import read_status
from tests.small_bed import read_rows, small_bed
from trackbed.command import main

SCENE = small_bed(k=2, h=4, total_cycles=14)
ENDS = ("4", "14")  # cycle before the first jump, and the last
SINKING = (0.0, 1e-7, 4e-7)
"""What pistons of members sink by more in each cycle [m]: the fake engine knows no chaos."""
STUDENT = 2.91998558  # t of 90 % with two degrees of freedom, from a table


@pytest.fixture(scope="module", autouse=True)
def beds_of_members() -> Iterator[None]:
    """A bed for each member, known by its folder."""
    real = FakeEngine.run
    with pytest.MonkeyPatch.context() as patch:

        def run(self: FakeEngine, scene: Any, deck: str, folder: Path, *others: Any) -> EngineRun:
            found = re.search(r"/members/(\d+)/", str(folder))
            patch.setattr(
                engine_fake, "BED", FakeBed(sinking=SINKING[int(found[1] if found else 0)])
            )
            return real(self, scene, deck, folder, *others)

        patch.setattr(FakeEngine, "run", run)
        yield


def run_scene(folder: Path, *words: str, members: str = "3") -> Path:
    """Run the scene with members and full runs; its run folder."""
    (folder / "scene.toml").write_text(SCENE)
    assert main(["run", str(folder / "scene.toml"), "--members", members, "--control", *words]) == 0
    return folder / "run"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three members with full runs beside them; not to be changed."""
    return run_scene(tmp_path_factory.mktemp("members"))


@pytest.fixture
def copy(finished: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    shutil.copytree(finished.parent, tmp_path / "copy")
    return tmp_path / "copy" / "run"


def list_folders(run: Path) -> list[Path]:
    """Folders of the members, in order."""
    return [run, run / "members" / "1", run / "members" / "2"]


def read_tables(run: Path) -> list[bytes]:
    """Tables of the members, each with that of its full run behind it."""
    pairs = [(one, one / "control") for one in list_folders(run)]
    return [(one / "settlement.csv").read_bytes() for pair in pairs for one in pair]


def test_members_start_from_one_state_with_a_grain_moved(finished: Path) -> None:
    """The same preparation and first cycles, once on the disk; then the first grain, and no other,
    is m times 1e-10 m further along x; a full run has the window before the jump in common."""
    first, second = "window_000000/states.npz", "window_000002/states.npz"
    for number, folder in enumerate(list_folders(finished)):
        for name in ("preparation/state.npz", first):
            assert (folder / name).samefile(finished / name)
        assert (folder / second).samefile(folder / "control" / second)
        moved = load_window(folder / second).position[0] - load_window(folder / first).position[-1]
        assert moved[0, 0] == pytest.approx(number * 1e-10, rel=1e-6)
        moved[0, 0] = 0.0
        assert not moved.any()
        assert read_status(folder).state == "finished"
        assert main(["report", str(folder)]) == 0
        assert main(["export", str(folder), "--to", "csv", "--every", "10"]) == 0


def test_means_bands_and_paired_errors(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From the tables by hand: means with t s / sqrt(3), errors of the gain since cycle 4, each of
    a member less its full run over the full runs' mean; the same in status, report and JSON."""
    capsys.readouterr()
    assert main(["status", str(finished), "--json"]) == 0
    status = json.loads(capsys.readouterr().out)
    assert main(["report", str(finished)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    settled = status["result"]
    assert settled == json.loads((finished / "report.json").read_text())["settled"]
    assert (settled["members"], settled["pairs"], settled["cycle"]) == (3, 3, 14)
    for name, column, error in (
        ("loaded_body", "loaded_body_settlement", "error"),
        ("mean_grain", "mean_grain_settlement", "mean_grain_error"),
    ):
        own, full = (
            np.array([
                [float(row[column]) for row in read_rows(folder / kind) if row["cycle"] in ENDS]
                for folder in list_folders(finished)
            ])
            for kind in ("", "control")
        )  # fmt: skip
        gains = np.diff(full)[:, 0]
        wrong = (np.diff(own)[:, 0] - gains) / gains.mean()
        chaos = (own[:, 1].std(ddof=1), gains.std(ddof=1) / gains.mean())
        for key, values, spread in zip((name, error), (own[:, 1], wrong), chaos, strict=True):
            half = STUDENT * values.std(ddof=1) / sqrt(3)
            ends = [values.mean() - half, values.mean() + half]
            assert settled[key]["value"] == pytest.approx(values.mean(), rel=1e-9)
            assert settled[key]["band"] == pytest.approx(ends, rel=1e-6, abs=1e-12)
            assert settled[key]["chaos"] == pytest.approx(spread, rel=1e-9, abs=1e-12)
    assert settled["loaded_body"]["chaos"] > 1e-6
    assert status["loaded_body_m"] == settled["loaded_body"]["value"]
    assert said.startswith(f"sleeper settles {1e6 * status['loaded_body_m']:.3g} um (")
    page = (finished / "report.html").read_text()
    assert said in page
    assert "<h2>Members</h2>" in page


def test_what_is_left_is_gone_on_with(finished: Path, copy: Path) -> None:
    """A member that stopped, one never begun, and a full run: the tables are the same, and nothing
    that was finished is computed again."""
    first, second = list_folders(copy)[1:]
    for gone in (second, first / "window_000013", first / "control"):
        shutil.rmtree(gone)
    status = read_status(copy)
    assert status.state == "stopped"
    assert status.result is not None
    assert "1 of 3 members" in str(status.result)
    kept = first / "window_000002" / "outcome.json"
    before = kept.stat().st_mtime_ns
    assert main(["resume", str(copy)]) == 0
    assert read_tables(copy) == read_tables(finished)
    assert kept.stat().st_mtime_ns == before
    assert read_status(copy).state == "finished"


@pytest.mark.long
def test_members_later_and_longer(tmp_path, finished: Path, capsys) -> None:
    """A run without members is bit for bit the first of several, and gets members when asked; they
    are extended with it, as if it had been longer from the start, and none alone."""
    run = run_scene(tmp_path, members="1")
    assert not (run / "members").exists()
    assert [run_scene(tmp_path), read_tables(run)] == [run, read_tables(finished)]
    assert main(["resume", str(run / "members" / "1"), "--cycles", "24"]) == 2
    inner = ["--run-folder", str(run / "members" / "1"), "--members", "3", "--control"]
    assert main(["run", str(tmp_path / "scene.toml"), *inner]) == 2
    assert capsys.readouterr().err.count("this is member 1 of another run") == 2
    assert main(["resume", str(run), "--cycles", "24"]) == 0
    (tmp_path / "whole").mkdir()
    assert read_tables(run) == read_tables(run_scene(tmp_path / "whole", "--cycles", "24"))


def change(path: Path, old: str, new: str) -> None:
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


DAMAGE: tuple[tuple[str, int, Callable[[Path, Path, Path], object]], ...] = (
    ("this is not member 2 of the run", 3,
     lambda run, one, two: shutil.copytree(one, two, dirs_exist_ok=True)),
    ("scene.material.grain.friction: 0.6 there, 0.5 now", 3,
     lambda run, one, two: change(one / "manifest.json", '"friction": 0.5', '"friction": 0.6')),
    ("symbolic link (members/2/mine)", 2, lambda run, one, two: (two / "mine").symlink_to(run)),
    ("the folder holds something else", 2, lambda run, one, two: (two / "manifest.json").unlink()),
    ("this manifest.json is damaged", 2,
     lambda run, one, two: change(run / "manifest.json", '"members": 3', '"members": 1000000000')),
)  # fmt: skip
"""What is said of a folder that was changed so, and the exit code."""


@pytest.mark.parametrize(("said", "code", "damage"), DAMAGE)
def test_what_is_no_member_is_refused(
    said: str, code: int, damage: Callable[[Path, Path, Path], object], copy: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """With where and what to do."""
    damage(*list_folders(copy))
    assert main(["resume", str(copy)]) == code
    assert re.search(rf"{re.escape(said)}.*\n  -> ", capsys.readouterr().err, re.DOTALL)


def test_a_damaged_member_is_named_with_its_remedy(copy: Path, capsys) -> None:
    """Status and resume alike: the member's folder, not the whole run, is what to move away."""
    _, one, _ = list_folders(copy)
    (one / "manifest.json").write_text("{")
    for verb in ("status", "resume"):
        assert main([verb, str(copy)]) == 2
        assert re.search(r"members/1.*\n  -> move this folder away", capsys.readouterr().err)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "sleeper settles 3.41 mm (2.9 ... 3.9; 5 members; chaos 0.52) by cycle 10,000, "
         "2.5 mm of it in the first; stiffness 41 kN/mm (full runs: 40); 9.6 times cheaper; error "
         "+3.0 % (-2.0 ... +8.0), chaos of the full runs 15.0 %; full runs: 3.31 mm (3 ... 3.6)"),
        ({"members": 1, "asked": 1, "loaded_body": Mean(3.41e-4), "first_cycle": Mean(0.0),
          "stiffness": Mean(nan), "speed_up": 0.5, "error": Mean(-0.25), "compared_at": 1000,
          "pairs": 1, "full_run": Mean(4.5e-4)},
         "sleeper settles 341 um (one member, so no band) by cycle 10,000; 2.0 times dearer; error "
         "at cycle 1,000 -25.0 %; full run: 450 um"),
    ],
)  # fmt: skip
def test_the_sentence_says_what_is_known(changes: dict[str, Any], said: str) -> None:
    """Millimetres from one on; of one member no band."""
    settled = Settled(
        members=5, asked=5, cycle=10_000, loaded_body=Mean(3.41e-3, (2.9e-3, 3.9e-3), 5.2e-4),
        first_cycle=Mean(2.5e-3), stiffness=Mean(41e6), mean_grain=Mean(nan), cost=1.0, pairs=5,
        compared_at=10_000,
        error=Mean(0.03, (-0.02, 0.08), 0.15), mean_grain_error=Mean(nan), speed_up=9.6,
        full_run=Mean(3.31e-3, (3e-3, 3.6e-3), 5e-4), full_stiffness=Mean(40e6),
    )  # fmt: skip
    assert str(replace(settled, **changes)) == said


@pytest.mark.parametrize(("way", "loaded"), [(1e-16, False), (-5e-11, False), (1e-9, True)])
def test_a_body_on_a_prescribed_way_is_no_sleeper(
    way: float, loaded: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its settlement is the round-off of its way: the mean grain's is the last sentence then."""
    settled = Settled(
        members=1, asked=1, cycle=9, loaded_body=Mean(way), first_cycle=Mean(nan),
        stiffness=Mean(nan), mean_grain=Mean(2e-4), cost=1.0, pairs=0, compared_at=0,
        error=Mean(nan), mean_grain_error=Mean(nan), full_run=Mean(nan), full_stiffness=Mean(nan),
        speed_up=nan,
    )  # fmt: skip
    monkeypatch.setattr("adapters.procedure.members.judge_members", lambda _: settled)
    run: Any = SimpleNamespace(history=SimpleNamespace(count_computed=lambda _: 9), exchanged="")
    last = describe_result(SimpleNamespace(run=run))[-1]  # type: ignore[arg-type]
    assert last.startswith("sleeper") == loaded
    assert last.endswith("does not settle") != loaded


@pytest.mark.long
def test_settlement_from_python(copy: Path) -> None:
    """A finished run is read: the figures of its status, a line for each run; keys of the scene are
    set by name; one member has no band; the floor loads the story when the word is asked for."""
    scene, status = copy.parent / "scene.toml", read_status(copy)
    result = trackbed.settle(scene, 3)
    assert (result.loaded_body, result.mean_grain, result.stiffness) == (
        status.loaded_body_m, status.mean_grain_m, status.stiffness_n_per_m,
    )  # fmt: skip
    assert status.result is not None
    assert (result.band, result.error) == (
        status.result.loaded_body.band,
        status.result.error.value,
    )
    assert (result.cost, str(result)) == (status.cpu_s, str(status.result))
    assert len(result.plot().lines) == 6
    keys: dict[str, Any] = {"sample.seed": 2, "total_cycles": 10}
    alone = trackbed.settle(scene, run_folder=copy.parent / "alone", **keys)
    assert all(map(isnan, (*alone.band, alone.error)))
    assert (alone.record.scene.sample.seed, alone.settled.cycle) == (2, 10)
    scene.write_text(SCENE.partition("[loading]")[0] + SCENE[SCENE.index("[engine]") :])
    with pytest.raises(trackbed.errors.SceneError, match="no load cycles"):
        trackbed.settle(scene, run_folder=copy.parent / "unloaded")
    assert (
        main(["run", str(scene), "--control", "--run-folder", str(copy.parent / "unloaded")]) == 3
    )
    assert not (copy.parent / "unloaded").exists()
    loaded = "'adapters' in sys.modules"
    code = f"import sys, trackbed\nassert not {loaded}\ntrackbed.settle\nassert {loaded}"
    subprocess.run([sys.executable, "-c", code], check=True)
