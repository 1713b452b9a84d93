"""The ensemble's runs on the engine without mechanics: killed, resumed, damaged; its statistics."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.errors import UsageError
from adapters.run_folder import RunFolder
from adapters.window import PistonTrack
from tests.engine_sample import fake_damaged
from validation.settlement_ensemble import KINDS, STEP, Kind, Piece, piston_stiffness
from validation.settlement_ensemble_reading import (
    at_cycle,
    column_mean,
    column_since,
    cost,
    curves,
    nested,
)
from validation.settlement_ensemble_record import RECORD, EnsembleRecord, Kept
from validation.settlement_ensemble_runs import (
    advance,
    go_on,
    next_piece,
    scene_digest,
    share_done,
)

ROOT = Path(__file__).parents[2]
TINY = Kind(
    "tiny",
    "forty grains without mechanics",
    "karrech-coarse",
    (
        "sample.radius=0.018",
        "sample.count=40",
        "material.grain.young=2e8",
        "loading.piston_mass=0.001",
    ),
    packings=2,
    members=2,
    k_i=4,
    last=7,
    window=2,
    marks=(0, 4, 6, 7),
    told=(1, 4, 7),
    engine="fake",
)
"""Two windows to k_i, then one of two cycles and one of a single one."""
RUNS = ("tiny-1", "tiny-2", "tiny-1-0", "tiny-2-0", "tiny-1-1", "tiny-2-1")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> EnsembleRecord:
    """The record of all runs in one go."""
    folder = tmp_path_factory.mktemp("ensemble")
    record = EnsembleRecord(folder / "record")
    go_on([TINY], record, folder / "work")
    return record


def content(record: EnsembleRecord) -> dict[str, object]:
    """All that a record says, less times: rows without CPU time, checkpoints, states."""
    found: dict[str, object] = {}
    for path in sorted(record.path.iterdir()):
        if path.suffix != ".csv":
            found[path.name] = path.read_bytes()
            continue
        kept = record.kept(path.stem)
        assert kept is not None
        rows = [row.rpartition(",")[0] for row in kept.rows]
        record.restart(kept)
        record.states(path.stem)
        found[path.name] = (rows, replace(kept, rows=(), parts=(), preparation={}))
    return found


def kept_of(record: EnsembleRecord, name: str) -> Kept:
    kept = record.kept(name)
    assert kept is not None
    return kept


# --- runs -----------------------------------------------------------------------------------

KILLS = """
import json, os, signal, sys
from pathlib import Path
from tests import forked_commands
from tests.unit.test_settlement_ensemble import TINY, EnsembleRecord, content, go_on, replace

folder = Path(sys.argv[1])
kind = replace(TINY, packings=1, members=1, k_i=2, last=4, marks=(0, 2, 4))
go_on([kind], EnsembleRecord(folder / "whole"), folder / "work")
whole, number, killed = content(EnsembleRecord(folder / "whole")), 0, True
while killed:
    number += 1
    record = EnsembleRecord(folder / f"killed_{number}")
    child = os.fork()
    if child == 0:
        forked_commands.count_operations(str(record.path), number)
        go_on([kind], record, folder / "work")
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert status in (0, -signal.SIGKILL), (number, status)
    killed = status == -signal.SIGKILL
    for path in record.path.glob("[!.]*.csv"):  # what a killed writer left is whole
        record.restart(record.kept(path.stem))
    go_on([kind], record, folder / "work")
    assert content(record) == whole, number
print(json.dumps(number - 1))
"""


@pytest.mark.long
def test_killed_at_every_file_operation(tmp_path: Path) -> None:
    """SIGKILL in place of any one change of the record: resumed, the record is the same.

    The work folder is left as the kill left it.
    """
    done = subprocess.run(
        [sys.executable, "-c", KILLS, str(tmp_path)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    kills = json.loads(done.stdout.splitlines()[-1])
    assert kills >= 4 * 3  # table and checkpoint, each opened and renamed, of three stages


def test_stopped_by_the_clock_and_gone_on(whole: EnsembleRecord, tmp_path: Path) -> None:
    """No minutes, no window; a window at a time in an empty folder gives the same record."""
    record = EnsembleRecord(tmp_path / "record")
    go_on([TINY], record, tmp_path / "work", minutes=0)
    assert not record.path.exists()
    number = 0
    while (piece := next_piece([TINY], record)) is not None:
        advance(piece, record, tmp_path / str(number))
        assert not list((tmp_path / str(number)).iterdir())
        number += 1
    assert number == 2 * 3 + 4 * 2
    assert content(record) == content(whole)


def test_ensemble_grows_evenly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All rains, all packings to k_i, then the members, each time the one with the fewest."""
    record = EnsembleRecord(tmp_path / "record")
    go_on([TINY], record, tmp_path / "work")
    said = [line.split(" of ")[0] for line in capsys.readouterr().out.splitlines()[:-1]]
    packings = [f"tiny-{seed}: cycle {cycle}" for cycle in (0, 2, 4) for seed in (1, 2)]
    members = [f"{name}: cycle {cycle}" for cycle in (6, 7) for name in RUNS[2:]]
    assert said == packings + members
    assert share_done(TINY, record) == 1
    assert next_piece([TINY], record) is None
    other = replace(TINY, name="other")
    assert next_piece([TINY, other], record) == Piece(other, 1)


def test_named_runs_share_an_ensemble(whole: EnsembleRecord, tmp_path: Path) -> None:
    """Two copies of the record, each with runs of its own, give together the record of one."""
    record = EnsembleRecord(tmp_path / "record")
    go_on([TINY], record, tmp_path / "work", names=["tiny-1", "tiny-1-1"])
    assert {path.stem for path in record.path.glob("*.csv")} == {"tiny-1", "tiny-1-1"}
    go_on([TINY], record, tmp_path / "work", names=set(RUNS) - {"tiny-1", "tiny-1-1"})
    assert content(record) == content(whole)
    with pytest.raises(UsageError, match="no run of the ensemble is named tiny-9"):
        go_on([TINY], record, tmp_path / "work", names=["tiny-9"])


def test_members_differ_by_one_grain(whole: EnsembleRecord) -> None:
    """Number 0 goes on as it is, number 1 with one grain 1e-10 m aside; packings by their seed."""
    for seed in (1, 2):
        radius, first = whole.states(f"tiny-{seed}-0")
        _, second = whole.states(f"tiny-{seed}-1")
        for cycle in (6, 7):  # moved once, not in every window
            difference = second[cycle] - first[cycle]
            assert difference[0, 0] == pytest.approx(STEP, rel=1e-5)
            assert np.count_nonzero(difference) == 1
        assert list(first) == [6, 7]
        assert list(whole.states(f"tiny-{seed}")[1]) == [0, 4]
    assert not np.array_equal(radius, whole.states("tiny-1")[0])


def test_tables_are_those_of_the_stages(whole: EnsembleRecord) -> None:
    """u = -a ln(1 + N) in the mean of the grains, so also of a member, counted since the rain."""
    for name, last in (("tiny-1", 4), ("tiny-2-1", 7)):
        table = whole.table(name)
        assert table["cycle"].tolist() == list(range(last - len(table["cycle"]) + 1, last + 1))
        np.testing.assert_allclose(table["settlement"], 2e-5 * np.log1p(table["cycle"]), rtol=1e-6)
    assert np.isfinite(list(whole.table("tiny-2-1").values())).all()


def test_a_failed_run_ends_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A window that is not credible ends its run, with the reason in the record; once."""

    def lose(folder: Path) -> None:
        if folder.parents[1].name == "tiny-1-1":
            (folder / "piston.txt").write_text("step ...\n1 nan nan nan nan nan\n")

    fake_damaged(monkeypatch, lose, "window_000006")
    record = EnsembleRecord(tmp_path / "record")
    go_on([TINY], record, tmp_path / "work")
    failed = kept_of(record, "tiny-1-1")
    assert (failed.cycle, len(failed.rows)) == (6, 2)
    assert "piston" in failed.failed
    record.restart(failed)
    assert [kept_of(record, name).cycle for name in RUNS] == [4, 4, 7, 7, 6, 7]
    assert cost(TINY, record).missing == 0


@pytest.mark.parametrize("damage", ["rows", "head", "checkpoint", "no checkpoint", "states"])
def test_damage_is_refused(whole: EnsembleRecord, tmp_path: Path, damage: str) -> None:
    """What does not belong together is told, with the file, before anything is computed."""
    record = EnsembleRecord(tmp_path / "record")
    shutil.copytree(whole.path, record.path)
    table, name = record.path / "tiny-2-1.csv", "tiny-2-1"
    kept = kept_of(record, name)
    checkpoint = record.path / kept.checkpoint.file
    if damage == "rows":
        table.write_text(table.read_text().replace("\n6,", "\n5,"))
    elif damage == "head":
        table.write_text(table.read_text()[5:])
    elif damage == "checkpoint":
        checkpoint.write_bytes((record.path / "tiny-2.000004.restart.xz").read_bytes())
    elif damage == "no checkpoint":
        checkpoint.unlink()
    else:
        shutil.copyfile(record.path / "tiny-1.states.npz", record.path / f"{name}.states.npz")

    def read() -> None:
        record.restart(kept_of(record, name))
        record.states(name)

    with pytest.raises(UsageError, match=name):
        read()


def test_another_scene_and_a_second_process_are_refused(
    whole: EnsembleRecord, tmp_path: Path
) -> None:
    record = EnsembleRecord(tmp_path / "record")
    shutil.copytree(whole.path, record.path)
    longer = replace(TINY, last=9, settings=(*TINY.settings, "material.grain.friction=0.4"))
    with pytest.raises(UsageError, match="another scene"):
        go_on([longer], record, tmp_path / "work")
    assert content(record) == content(whole)
    with RunFolder(tmp_path / "work").locked(), pytest.raises(UsageError, match="another process"):
        go_on([TINY], record, tmp_path / "work")


def test_kinds_can_be_run() -> None:
    """Windows end at k_i; names are unique; each kind has runs enough for its bands."""
    names = [piece.name for kind in KINDS.values() for piece in kind.runs()]
    assert len(set(names)) == len(names)
    for kind in KINDS.values():
        assert kind.k_i % kind.window == (kind.last - kind.k_i) % kind.window == 0
        assert max(kind.marks) == max(kind.told) == kind.last
        assert {0, kind.k_i} <= set(kind.marks)
        assert kind.scene(2).sample.seed == 2
    counts = {name: (kind.packings, kind.packings * kind.members) for name, kind in KINDS.items()}
    for name, (packings, members) in {"confined": (3, 5), "partial": (3, 3)}.items():
        assert counts[name][0] >= packings
        assert counts[name][1] >= members
    assert counts["coarse"][1] >= 10


# --- figures --------------------------------------------------------------------------------


def test_piston_stiffness_is_the_slope_of_unloading() -> None:
    """Force k z on the way down; loading is of another slope and does not count."""
    phase = np.tile(np.arange(1, 101) / 100, 2)
    force = np.concatenate(
        [2.0 * np.sin(np.pi * phase[:100]) ** 2, np.sin(np.pi * phase[100:]) ** 2]
    )
    stiffness = np.where(phase <= 0.5, 1e5, np.repeat([3e5, 4e5], 100))
    peak = np.repeat([2.0, 1.0], 100)
    height = 0.06 - peak / np.repeat([3e5, 4e5], 100) + (peak - force) / stiffness
    zero = np.zeros_like(force)
    track = PistonTrack(np.arange(10, 2001, 10), force, force, height, zero, zero)
    assert piston_stiffness(track, 1000) == pytest.approx([3e5, 4e5])


def test_nested_means() -> None:
    """Packings 1, 2, 3 +- 1/2 about their means: by hand, t(2) = 4.30265, t(3) = 3.18245."""
    found = nested({seed: np.array([seed - 0.5, seed + 0.5]) for seed in (1, 2, 3)})
    assert (found.mean, found.packings, found.members) == (2, 3, 6)
    assert found.half == pytest.approx(4.30265 / 3**0.5, rel=1e-5)
    assert found.within == pytest.approx(0.5**0.5)
    assert found.half_given == pytest.approx(3.18245 * (0.25 / 3) ** 0.5, rel=1e-5)
    assert found.between == pytest.approx((1 - 0.25) ** 0.5)
    lonely = nested({1: np.array([1.0]), 2: np.array([4.0])})
    assert np.isnan([lonely.within, lonely.half_given]).all()
    assert lonely.half > 0
    assert np.isnan(nested({1: np.array([1.0, 2.0])}).half)


def test_bands_hold_what_they_say() -> None:
    """3 packings of 2 members, between 3, within 1: both intervals hold 95 % +- 4 sigma."""
    draws, generator = 1500, np.random.default_rng(6)
    hits = np.zeros(2)
    for _ in range(draws):
        packing = generator.normal(0, 3, 3)
        values = packing[:, None] + generator.normal(0, 1, (3, 2))
        found = nested(dict(enumerate(values)))
        hits += abs(found.mean) < found.half, abs(found.mean - packing.mean()) < found.half_given
    assert hits / draws == pytest.approx(0.95, abs=4 * (0.95 * 0.05 / draws) ** 0.5)


def test_figures_of_a_cycle(whole: EnsembleRecord) -> None:
    """Packings up to k_i, members behind it; since k_i a ln((1 + N)/(1 + k_i)) by both ways."""
    runs = curves(TINY, whole)
    assert {piece.name for piece in runs} == set(RUNS)
    for name, sign in (("settlement", 1.0), ("piston_height", -1.0)):
        found = at_cycle(TINY, runs, column_since(name, sign), 7)
        assert found is not None
        # Piston heights are written to 9 digits: 1e-10 m in 1e-5.
        assert found.mean == pytest.approx(2e-5 * np.log(8 / 5), rel=1e-4)
        assert (found.packings, found.members) == (2, 4)
        assert at_cycle(TINY, runs, column_since(name, sign), 4) is None
    assert at_cycle(TINY, runs, column_mean("settlement"), 7) is None  # fewer than ten cycles
    assert at_cycle(TINY, runs, column_since("settlement", 1.0), 8) is None


def test_cost_counts_what_is_missing(whole: EnsembleRecord, tmp_path: Path) -> None:
    found = cost(TINY, whole)
    assert (found.cycles_done, found.cycles_planned, found.missing) == (20, 20, 0)
    assert found.spent > 20 * found.cycle / 2 > 0
    none = cost(TINY, EnsembleRecord(tmp_path))
    assert (none.cycles_done, none.spent) == (0, 0)
    assert np.isnan(none.missing)
    half = EnsembleRecord(tmp_path / "half")
    shutil.copytree(whole.path, half.path, ignore=shutil.ignore_patterns("tiny-2*"))
    part = cost(TINY, half)
    assert part.missing == pytest.approx(10 * part.cycle + part.rain)


def test_the_committed_runs_go_on_with_scenes_as_they_are_read_today() -> None:
    """A key that came later is left out of a scene's record at its default."""
    record, seen = EnsembleRecord(RECORD), 0
    for kind in KINDS.values():
        for seed in range(1, 4):
            kept = record.kept(f"{kind.name}-{seed}")
            if kept is not None:
                assert kept.scene_sha256 == scene_digest(kind.scene(seed))
                seen += 1
    assert seen >= 4
