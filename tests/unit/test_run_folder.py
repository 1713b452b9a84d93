"""The run folder: what stands in its place is whole, nothing is overwritten, one writer."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.errors import UsageError
from adapters.files.run_folder import COLUMNS, Outcome, RunFolder, place_stage


def finish(folder: RunFolder, name: str, first: int, last: int, **more: Any) -> Path:
    """A finished stage with the files a run goes on from, and one it does not need."""
    work = folder.begin(name)
    (work / "states.npz").write_bytes(b"states" * 100)
    (work / "end.restart").write_bytes(b"restart" * 100)
    (work / "log.liggghts").write_text("words")
    rows = [
        {"cycle": c, "settlement": c / 3, "kind": "computed"} for c in range(first + 1, last + 1)
    ]
    kind = name.split("_")[0]
    return folder.finish(work, Outcome(kind, first, last, rows, {"engine": 0.1}, **more))


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    """A run of a preparation, two windows and a jump between them."""
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    finish(folder, "preparation", 0, 0)
    finish(folder, "window_000000", 0, 2)
    finish(folder, "jump_000002_1", 2, 4)
    finish(folder, "window_000004", 4, 5)
    return folder


def table(folder: RunFolder) -> list[list[str]]:
    lines = (folder.path / "settlement.csv").read_text().splitlines()
    assert lines[0] == ",".join(COLUMNS)
    return [line.split(",") for line in lines[1:]]


def tree(folder: Path) -> dict[str, bytes]:
    """Every file with its content."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


# --- stages ---------------------------------------------------------------------------------


def test_outcome_comes_back(run: RunFolder) -> None:
    """An outcome is read back as it was written, from JSON that any program reads; its notes name
    the files left.  Removing a log or a dump to save space does not undo it."""
    text = (run.path / "window_000000" / "outcome.json").read_text()
    assert json.loads(text)["last_cycle"] == 2
    (run.path / "window_000000" / "log.liggghts").unlink()
    outcome = run.outcome("window_000000")
    assert outcome is not None
    assert (outcome.stage, outcome.first_cycle, outcome.last_cycle) == ("window", 0, 2)
    assert outcome.rows[1] == {"cycle": 2, "settlement": 2 / 3, "kind": "computed"}
    assert outcome.notes["files"] == {"states.npz": 600, "end.restart": 700}


def test_table_is_exact(run: RunFolder) -> None:
    """Numbers in settlement.csv are the shortest that come back bit for bit; nothing is a blank."""
    rows = table(run)
    assert [row[0] for row in rows] == ["1", "2", "3", "4", "5"]
    assert [float(row[4]) for row in rows] == [c / 3 for c in range(1, 6)]
    assert {row[3] for row in rows} == {""}


def test_a_table_of_version_0_2_is_no_damage(run: RunFolder) -> None:
    """Its columns were the names in the rows; a changed number in it is named all the same."""
    path = run.path / "settlement.csv"
    rows = [f"{cycle},{cycle / 3},computed\n" for cycle in range(1, 6)]
    path.write_text("cycle,settlement,kind\n" + "".join(rows))
    assert run.list_damaged() == []
    path.write_text(path.read_text().replace("2,0.6", "2,0.7"))
    assert run.list_damaged() == ["settlement.csv"]


@pytest.mark.parametrize("name", ["states.npz", "end.restart", "outcome.json"])
@pytest.mark.parametrize("damage", ["missing", "shorter", "longer", "empty", "changed"])
def test_damaged_files_are_noticed(run: RunFolder, name: str, damage: str) -> None:
    """A stage without a file that a run goes on from, or its record, each at its size and with the
    content it had, does not count as finished."""
    path = run.path / "window_000000" / name
    text = path.read_bytes()
    assert run.outcome("window_000000") is not None
    if damage == "missing":
        path.unlink()
    elif damage == "changed":
        path.write_bytes(text.replace(b"0.1", b"0.2", 1) if name[0] == "o" else bytes(len(text)))
        assert path.stat().st_size == len(text)
    elif damage == "longer":
        path.write_bytes(text + b"}")
    else:
        os.truncate(path, len(text) - 2 if damage == "shorter" else 0)
    for folder in (run, RunFolder(run.path)):
        assert folder.outcome("window_000000") is None
        assert folder.outcome("window_000004") is not None


def test_records_of_older_runs_are_read(run: RunFolder) -> None:
    """Without a seal and digests, as version 0.1.0 wrote them first, a stage is whole."""
    path = run.path / "window_000000" / "outcome.json"
    record = json.loads(path.read_text())
    del record["seal"], record["notes"]["digests"]
    path.write_text(json.dumps(record))
    outcome = RunFolder(run.path).outcome("window_000000")
    assert outcome is not None
    assert outcome.last_cycle == 2


def test_one_more_stage_reads_no_earlier_one(run: RunFolder, monkeypatch: Any) -> None:
    """The table and the list of outcomes come from what is known; only new records are read."""
    run.outcomes()
    read = []
    real = Path.read_text
    monkeypatch.setattr(Path, "read_text", lambda p, **k: (read.append(p), real(p, **k))[1])
    finish(run, "window_000005", 5, 6)
    assert len(run.outcomes()) == 5
    assert [path.parent.name for path in read if path.name == "outcome.json"] == ["window_000005"]


def count_calls(work: Callable[..., object], *given: object) -> int:
    """Calls of functions, of Python and of C, that some work on what is ``given`` takes."""
    count = 0

    def note(frame: object, event: str, _: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        work(*given)
    finally:
        sys.setprofile(None)
    return count


def test_a_stage_costs_the_same_behind_many_others(run: RunFolder) -> None:
    """In calls, which do not depend on the clock; the table has all rows, and no other."""
    costs = []
    with run.lock():
        for n in range(5, 205):
            costs.append(count_calls(finish, run, f"window_{n:06d}", n, n + 1))
            assert len(run.outcomes()) == n
    assert max(costs[100:]) < 1.5 * min(costs[5:15])
    assert [row[0] for row in table(run)] == [str(n) for n in range(1, 206)]
    assert RunFolder(run.path).outcomes() == run.outcomes()


def test_folders_of_other_names_are_left_alone(run: RunFolder) -> None:
    """A copy of a stage is no stage, and stays where it is when stages are done again."""
    names = run.stage_names()
    for name in ("window_000004 (copy)", "jump_x", "window_", "windows"):
        (run.path / name).mkdir()
    assert run.stage_names() == names
    run.begin("window_000000")
    assert (run.path / "window_000004 (copy)").is_dir()
    run.write_settlement()


@pytest.mark.parametrize("name", ["partial", "discarded", "lock", "events.jsonl", "window_000004"])
def test_a_received_folder_leads_nowhere_else(run: RunFolder, tmp_path: Path, name: str) -> None:
    """A symbolic link in a run folder is refused with a sentence, and what it names is left."""
    outside = tmp_path / "outside"
    if name in ("lock", "events.jsonl"):
        outside.write_text("mine")
    else:
        outside.mkdir()
        (outside / "mine").write_text("mine")
    before = tree(tmp_path)
    place = run.path / name
    if place.exists():
        place.rename(tmp_path / "away")
        before = tree(tmp_path)
    place.symlink_to(outside)
    with pytest.raises(UsageError, match=f"symbolic link .{name}.") as caught, run.lock():
        pass
    assert "remove it" in caught.value.remedy
    place.unlink()
    assert tree(tmp_path) == before


@pytest.mark.parametrize(
    "content", [b"{", b"null", b"[1]", b'"text"', b"{}", b"\xff\xfe\x00", b'{"stage": "window"}']
)
def test_damaged_outcome_is_no_outcome(run: RunFolder, content: bytes) -> None:
    """A record that is cut, empty, of another kind or no text is no record."""
    (run.path / "window_000000" / "outcome.json").write_bytes(content)
    assert run.outcome("window_000000") is None
    run.write_settlement()
    assert [row[0] for row in table(run)] == ["3", "4", "5"]


@given(st.integers(0, 10**7), st.integers(0, 10**7), st.integers(1, 4))
def test_stages_sort_by_cycle(first: int, second: int, attempt: int) -> None:
    """Preparation first, then by cycle; a jump of no cycles stands before the window after it."""
    names = [f"window_{first:06d}", f"jump_{second:06d}_{attempt}", "preparation"]
    ordered = sorted(names, key=place_stage)
    assert ordered[0] == "preparation"
    jump_first = second <= first
    assert ordered[1].startswith("jump") == jump_first


def test_begin_moves_later_stages_away(run: RunFolder) -> None:
    """Doing a stage again moves it and all behind it to discarded/, under free names, unchanged."""
    before = tree(run.path / "jump_000002_1")
    run.begin("jump_000002_1")
    assert run.stage_names() == ["preparation", "window_000000"]
    discarded = run.path / "discarded"
    assert tree(discarded / "jump_000002_1.1") == before
    assert (discarded / "window_000004.1" / "states.npz").exists()
    (run.path / "partial" / "jump_000002_1").rename(run.path / "jump_000002_1")
    run.begin("jump_000002_1")
    assert tree(discarded / "jump_000002_1.1") == before
    assert (discarded / "jump_000002_1.2").exists()
    moved = [(e["stage"], e["to"]) for e in run.events() if e["event"] == "discarded"]
    assert moved == [
        ("jump_000002_1", "discarded/jump_000002_1.1"),
        ("window_000004", "discarded/window_000004.1"),
        ("jump_000002_1", "discarded/jump_000002_1.2"),
    ]


def test_unfinished_work_is_moved_away(run: RunFolder) -> None:
    """What a killed process left in partial/ is kept, and is not gone on with.  A jump of
    h = 0 and its window share a cycle: beginning the window keeps the jump."""
    finish(run, "jump_000005_1", 5, 5)
    work = run.begin("window_000005")
    (work / "states.dump").write_text("half")
    again = run.begin("window_000005")
    assert list(again.iterdir()) == []
    kept = run.path / "discarded" / "window_000005.1" / "states.dump"
    assert kept.read_text() == "half"
    assert "jump_000005_1" in run.stage_names()


def test_failed_jump(run: RunFolder) -> None:
    """A jump given up keeps its reason, drops out of table and outcomes, and is in the events."""
    run.give_up("jump_000002_1", "because")
    assert run.failure("jump_000002_1") == "because"
    assert run.failure("window_000000") == ""
    assert [o.stage for o in run.outcomes()] == ["preparation", "window", "window"]
    assert [row[0] for row in table(run)] == ["1", "2", "5"]
    assert run.events()[-1]["event"] == "jump failed"
    assert run.events()[-1]["why"] == "because"
    run.give_up("jump_000005_1", "never got as far as a folder")
    assert run.failure("jump_000005_1")
    for content in ("", "{", "null", "{}"):  # a reason that cannot be read is one all the same
        (run.path / "jump_000002_1" / "failed.json").write_text(content)
        assert "damaged" in run.failure("jump_000002_1")


def test_events_survive_a_torn_line(run: RunFolder) -> None:
    """A line cut by a crash, or bytes that are no text, hide no other event."""
    run.add_event("one", cycle=3)
    with (run.path / "events.jsonl").open("ab") as stream:
        stream.write(b'{"event": "tor\xff\n')
    run.add_event("two")
    assert [e["event"] for e in run.events()][-2:] == ["one", "two"]


def test_shared_start(run: RunFolder, tmp_path: Path) -> None:
    """The control gets the stages before the first jump, the same files, no jump, no damage."""
    control = RunFolder(tmp_path / "run" / "control")
    control.path.mkdir()
    for _ in range(2):  # a second time changes nothing
        control.share_start(run, 4)
        assert control.stage_names() == ["preparation", "window_000000"]
    for name in control.stage_names():
        assert tree(control.path / name) == tree(run.path / name)
        assert (control.path / name / "states.npz").samefile(run.path / name / "states.npz")
        assert control.outcome(name) == run.outcome(name)
    assert [row[0] for row in table(control)] == ["1", "2"]
    (run.path / "window_000000" / "end.restart").unlink()
    other = RunFolder(tmp_path / "other")
    other.path.mkdir()
    other.share_start(run, 4)
    assert other.stage_names() == ["preparation"]


@pytest.mark.parametrize(
    ("name", "content", "damaged"),
    [
        ("events.jsonl", "{broken\n5\n", ["events.jsonl"]),
        ("settlement.csv", "", ["settlement.csv"]),
        ("window_000000/outcome.json", '{"stage": "window"}', ["window_000000"]),
    ],
)
def test_changed_records_are_listed(
    run: RunFolder, name: str, content: str, damaged: list[str]
) -> None:
    """What a run left is as it was left, or named; an event that was changed counts for nothing."""
    run.add_event("decision", cycle=1)
    run.add_event("stopped")
    assert RunFolder(run.path).list_damaged() == []
    (run.path / name).write_text(content + (run.path / name).read_text() * name.startswith("ev"))
    assert RunFolder(run.path).list_damaged() == damaged
    text = (run.path / "events.jsonl").read_text()
    (run.path / "events.jsonl").write_text(text.replace('"cycle": 1', '"cycle": 2'))
    assert [event["event"] for event in RunFolder(run.path).events()] == ["stopped"]
