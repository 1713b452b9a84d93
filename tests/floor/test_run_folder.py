"""One writer, whole files, no way out of a run folder, and what may be written over."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from trackbed.errors import DiskFull, UsageError
from trackbed.run_files.folder import RunFolder, is_written, lock_folder, refuse_links
from trackbed.run_files.whole import append_text, replace_file, seal_file, write_whole

ROOT = Path(__file__).parents[2]
FOLDERS = (
    "adapters.files.run_folder", "qdem_fem.scene.run", "rigid_lcp.scene.run",
    "track_line.scene.run",
)  # fmt: skip


class Folder(RunFolder):
    """A story's folder."""

    own = ("scene.toml", "manifest.json", "result.json", "state_*", ".*.partial")
    states = "state_*"
    free = ("scene.title",)


def manifest(**scene: Any) -> dict[str, Any]:
    return {"scene": {"title": "a", "step": 1, **scene}, "versions": {"trackbed": "0.1.0"}}


def tree(folder: Path) -> dict[str, bytes]:
    """Every file with its content."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


# --- the lock -------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("room", FOLDERS)
def test_second_writer_is_refused(room: str, tmp_path: Path) -> None:
    """Another process gets the pid of the first; when the first is gone the folder is free."""
    code = (
        f"import sys; from pathlib import Path; from {room} import RunFolder\n"
        "with RunFolder(Path(sys.argv[1])).lock():\n"
        "    print('in', flush=True); sys.stdin.read()"
    )
    name = "lock" if room.startswith("adapters") else ".lock"
    first = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)],
        cwd=ROOT, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert first.stdout is not None
        assert first.stdout.readline() == "in\n"
        before = tree(tmp_path)
        with pytest.raises(UsageError, match=f"pid {first.pid} on "), lock_folder(tmp_path, name):
            pass
        assert tree(tmp_path) == before
    finally:
        first.kill()
        first.communicate()
    with lock_folder(tmp_path, name):
        assert f"pid {os.getpid()} on " in (tmp_path / name).read_text()


@pytest.mark.parametrize("name", [".lock", "state_1", "notes", "stage/deep/notes"])
def test_links_are_refused(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A symbolic link in the folder is named; the file behind it is neither cut nor read."""
    (tmp_path / "mine").write_text("mine")
    folder = Folder(tmp_path / "run")
    (folder.path / name).parent.mkdir(parents=True, exist_ok=True)
    (folder.path / name).symlink_to(tmp_path / "mine")
    with pytest.raises(UsageError, match=rf"run: .*symbolic link \({name}\)"), folder.lock():
        pass
    assert (tmp_path / "mine").read_text() == "mine"
    monkeypatch.setattr(os, "scandir", Mock(side_effect=PermissionError))
    with pytest.raises(UsageError, match="get leave to read it"):
        refuse_links(folder.path)


def test_what_has_no_end_is_refused(tmp_path: Path) -> None:
    """A pipe among the files of a run would be waited for; a device read until memory is full."""
    (tmp_path / "stage").mkdir()
    os.mkfifo(tmp_path / "stage" / "end.restart")
    with pytest.raises(UsageError, match=r"pipe or device \(stage/end.restart\)"):
        refuse_links(tmp_path)


def test_a_lock_that_becomes_a_link_is_not_followed(tmp_path, monkeypatch) -> None:
    """Even where the link was put there behind the look for links."""
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / ".lock").symlink_to(tmp_path / "mine")
    monkeypatch.setattr("trackbed.run_files.folder.refuse_links", lambda path: None)
    with pytest.raises(UsageError, match="symbolic link"), lock_folder(tmp_path / "run"):
        pass
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_disk_without_locks_is_not_another_writer(tmp_path, monkeypatch) -> None:
    """ENOLCK, as some network disks answer, has a sentence of its own."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(UsageError, match="has no locks") as caught, lock_folder(tmp_path):
        pass
    assert "another process" not in str(caught.value)


@pytest.mark.parametrize("below", [False, True])
def test_a_file_in_place_of_the_folder_is_named_as_that(tmp_path: Path, below: bool) -> None:
    """And not as a lack of leave to write there."""
    (tmp_path / "file").write_text("mine")
    path = tmp_path / "file" / "run" if below else tmp_path / "file"
    with (
        pytest.raises(UsageError, match=f"{path}: can not be written") as caught,
        lock_folder(path),
    ):
        pass
    assert caught.value.remedy == "a file is where the folder should be: give another folder"
    assert (tmp_path / "file").read_text() == "mine"


def test_leftovers_of_a_killed_writer_go(tmp_path: Path) -> None:
    """Half-written hidden files are removed by the next writer, and nothing else is."""
    (tmp_path / ".table.csv.123.partial").write_text("ha")
    (tmp_path / ".mine.partial").mkdir()
    (tmp_path / "table.csv").write_text("whole")
    with lock_folder(tmp_path):
        assert sorted(p.name for p in tmp_path.iterdir()) == [
            ".lock", ".mine.partial", "table.csv",
        ]  # fmt: skip


# --- whole files ----------------------------------------------------------------------------


def test_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A writer that dies half-way, or a full disk, leaves the file as it was, and no rubbish."""
    path = tmp_path / "table.csv"
    write_whole(path, "old")

    def die() -> None:
        with replace_file(path) as temporary:
            temporary.write_text("new")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        die()

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(DiskFull, match=r"table\.csv: can not be written \(No space left"):
        write_whole(path, "new")
    assert [one.name for one in tmp_path.iterdir()] == ["table.csv"]
    assert path.read_text() == "old"


def test_no_file_is_written_through_a_link(tmp_path: Path) -> None:
    """A whole file takes the link's place; a line is not appended to what it names."""
    (tmp_path / "mine").write_text("mine")
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "mine")
    with pytest.raises(OSError, match="symbolic"):
        append_text(link, "more")
    (tmp_path / f".link.{os.getpid()}.partial").symlink_to(tmp_path / "mine")
    with pytest.raises(UsageError, match="symbolic link"):
        write_whole(link, "new")
    write_whole(link, "new")
    assert not link.is_symlink()
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_seal_is_the_digest_of_what_is_on_the_disk(tmp_path, monkeypatch) -> None:
    """SHA-256, and the file is given to the disk first."""
    synced = []
    monkeypatch.setattr(os, "fsync", synced.append)
    (tmp_path / "a").write_bytes(b"abc")
    assert seal_file(tmp_path / "a").startswith("ba7816bf 8f01cfea".replace(" ", ""))
    assert len(synced) == 1


# --- whose run is there ---------------------------------------------------------------------


def test_an_empty_folder_is_taken_and_a_run_goes_on(tmp_path: Path) -> None:
    """Another scene, an unfinished or finished run, later versions: each refused in its words."""
    folder = Folder(tmp_path)

    def settle(resume: bool = False, force: bool = False, **scene: Any) -> bool:
        with folder.lock():
            return folder.prepare(manifest(**scene), "text", resume=resume, force=force)

    assert settle() is False
    with pytest.raises(UsageError, match="is not finished"):
        settle()
    assert settle(resume=True, title="another") is True
    with pytest.raises(UsageError, match=r"another scene:\n  scene\.step: 1 there, 2 now"):
        settle(resume=True, step=2)
    (tmp_path / "result.json").write_text('{"done": 1}')
    with pytest.raises(UsageError, match="is finished"):
        settle()
    assert folder.look_ahead(manifest(title="another"), resume=True, force=False) == {"done": 1}
    assert folder.look_ahead(manifest(title="a third"), resume=True, force=False) is None
    assert settle(resume=True, title="another")
    assert folder.summary
    assert settle(resume=True, title="a third")
    assert folder.summary is None  # what was found is not of these keys
    later = json.loads((tmp_path / "manifest.json").read_text()) | {"format": 2}
    (tmp_path / "manifest.json").write_text(json.dumps(later))
    with pytest.raises(UsageError, match="of format 2") as caught:
        settle(resume=True)
    assert "go on with the trackbed 0.1.0" in caught.value.remedy
    (tmp_path / "mine.txt").write_text("mine")
    assert settle(force=True, step=2) is False
    assert sorted(tree(tmp_path)) == [".lock", "manifest.json", "mine.txt", "scene.toml"]


def test_runs_of_the_first_version_go_on(tmp_path: Path) -> None:
    """Their manifests have no format."""
    (tmp_path / "manifest.json").write_text(json.dumps(manifest()))
    assert Folder(tmp_path).prepare(manifest(), "text", resume=True, force=False)


@pytest.mark.parametrize("damage", ["", "[]", '{"scene": '])
def test_states_without_their_manifest_are_not_lost(tmp_path: Path, damage: str) -> None:
    """A manifest that is gone or damaged says nothing of the states beside it."""
    (tmp_path / "state_1").write_text("hours")
    if damage:
        (tmp_path / "manifest.json").write_text(damage)
    for resume in (True, False):
        with pytest.raises(UsageError, match="missing or can not be read"):
            Folder(tmp_path).prepare(manifest(), "text", resume=resume, force=False)
    assert (tmp_path / "state_1").read_text() == "hours"


def test_a_folder_of_others_is_never_taken(tmp_path: Path) -> None:
    """There may be anything behind a typo, --force or not."""
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(UsageError, match=r"other files .thesis\.tex"):
        Folder(tmp_path).prepare(manifest(), "text", resume=False, force=True)
    assert tree(tmp_path) == {"thesis.tex": b"mine"}


@pytest.mark.parametrize("force", [True, False])
def test_a_picture_of_curves_goes_with_the_run_that_it_shows(force: bool, tmp_path: Path) -> None:
    """Where a run begins again or has other free keys; alone it keeps nobody from the folder."""
    (tmp_path / "plot.png").write_bytes(b"of no run")
    assert not Folder(tmp_path).prepare(manifest(), "text", resume=False, force=False)
    (tmp_path / "plot.png").write_bytes(b"of the first")
    Folder(tmp_path).prepare(manifest(title="b"), "text", resume=not force, force=force)
    assert not (tmp_path / "plot.png").exists()


def test_a_folder_that_was_replaced_is_noticed(tmp_path: Path) -> None:
    """Removed and made again by another while we hold the lock."""
    folder = Folder(tmp_path / "run")
    with folder.lock():
        folder.refuse_if_replaced()
        (folder.path / ".lock").unlink()
        with pytest.raises(UsageError, match="removed or replaced"):
            folder.refuse_if_replaced()
        (folder.path / ".lock").touch()
        with pytest.raises(UsageError, match="removed or replaced"):
            folder.refuse_if_replaced()


def test_a_lock_that_is_no_text_is_held_by_nobody(tmp_path: Path) -> None:
    (tmp_path / ".lock").write_bytes(b"pid 1 on \xff")
    assert not is_written(tmp_path)
