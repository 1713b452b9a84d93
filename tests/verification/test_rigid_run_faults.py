"""Whatever befalls a rigid run, its frames stay, and resumed it ends with the same bits."""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import trackbed
from rigid_lcp import Simulation
from rigid_lcp.scene.run import RunFolder
from tests.forked_commands import Commands
from tests.rigid_runs import SLIDING_BLOCK, frame_bits
from trackbed import command

SEED = 2002


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """A server that has run the scene once, uninterrupted, in ``whole``."""
    folder = tmp_path_factory.mktemp("rigid")
    (folder / "scene.toml").write_text(SLIDING_BLOCK, encoding="utf-8")
    server = Commands(folder)
    server.run(*run_words(folder / "scene.toml", folder / "whole"), here=True)
    yield server
    server.close()


@pytest.fixture
def scene(commands: Commands) -> Path:
    return commands.folder / "scene.toml"


@pytest.fixture
def whole(commands: Commands) -> list[dict[str, Any]]:
    """Frames of the uninterrupted run."""
    frames = frame_bits(commands.folder / "whole")
    assert len(frames) == 4
    return frames


def run_words(scene: Path, folder: Path, *more: str) -> list[str]:
    return ["rigid", str(scene), "--run-folder", str(folder), "--no-pictures", *more]


def goes_on(scene: Path, folder: Path, whole: list[dict[str, Any]]) -> None:
    """The same command with --resume brings the run to the end it would have had."""
    assert command.main(run_words(scene, folder, "--resume")) == 0
    assert frame_bits(folder) == whole
    assert RunFolder(folder).summary is not None
    assert not list(folder.glob(".*.partial"))


# --- the disk ---------------------------------------------------------------------------------


class RefusingDisk:
    """Counts what changes files below a folder; refuses number ``refused`` and all after it."""

    def __init__(self, root: Path, patch: pytest.MonkeyPatch, refused: int) -> None:
        self.root, self.refused, self.count = str(root), refused, 0
        for name in ("mkdir", "open", "write", "truncate", "fsync", "replace"):
            patch.setattr(os, name, self.refusing(getattr(os, name), name))
        patch.setattr(Path, "open", self.refusing(Path.open, "open"))

    def refusing(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        def refuse(*arguments: Any, **named: Any) -> Any:
            place = arguments[0]
            if isinstance(place, int):
                place = os.readlink(f"/proc/self/fd/{place}")
            reads = name == "open" and "r" in str(arguments[1:2] or "r")
            if str(place).startswith(self.root) and not reads:
                self.count += 1
                if self.count >= self.refused:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return function(*arguments, **named)

        return refuse


@pytest.mark.long
def test_full_disk_at_every_write(scene, whole, tmp_path, capsys):
    """Exit code 5 and a sentence, no part of a file; with room again it goes on."""
    for refused in range(1, 1000):
        folder = tmp_path / str(refused)
        with pytest.MonkeyPatch.context() as patch:
            disk = RefusingDisk(folder, patch, refused)
            code = command.main(run_words(scene, folder))
        said = capsys.readouterr().err
        if disk.count < refused:
            break
        assert code == 5, said
        assert "can not be written (No space left on device)" in said
        assert "make room" in said
        assert not list(folder.glob(".*.partial"))
        frames = frame_bits(folder) if folder.exists() else []
        assert frames == whole[: len(frames)]
        goes_on(scene, folder, whole)
    assert code == 0
    assert refused > 4 + 3 * 9  # folder and lock; scene, manifest, frames, table, report, result


@pytest.mark.parametrize("name", ["picture-000002.png", "movie.gif", "picture-end.png"])
@pytest.mark.long
def test_full_disk_at_a_picture(scene, tmp_path, name, capsys):
    run = ["rigid", str(scene), "--run-folder", str(tmp_path / "run"), "--set", "run.frames=2"]
    with pytest.MonkeyPatch.context() as patch:
        disk = RefusingDisk(tmp_path / "run" / f".{name}", patch, 1)
        assert command.main(run) == 5
    assert disk.count == 1
    assert f"{name}: can not be written (No space left" in capsys.readouterr().err
    assert command.main([*run, "--resume"]) == 0
    assert (tmp_path / "run" / name).stat().st_size > 0


# --- killed and stopped -----------------------------------------------------------------------


@pytest.mark.long
def test_killed_at_every_file_operation(commands, scene, whole, tmp_path):
    """A kill in place of any one change: what is there is whole, and the run goes on."""
    assert commands.run(*run_words(scene, tmp_path / "0"), root=str(tmp_path)) == 0
    count = commands.operations
    assert count > 20
    for number in range(1, count + 1):
        folder = tmp_path / str(number)
        words = run_words(scene, folder, "--resume")
        assert commands.run(*words, root=str(tmp_path), crash=number) == -signal.SIGKILL
        found = frame_bits(folder) if folder.exists() else []
        assert len(found) == len(list(folder.glob("frame_*")))
        assert found == whole[: len(found)]
        goes_on(scene, folder, whole)


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stopped_by_a_signal(scene, whole, tmp_path, number, capsys):
    """Exit code 130, and what to do next."""
    advance, before = Simulation.advance, signal.getsignal(number)

    def stop(run: Simulation, seconds: float) -> None:
        advance(run, seconds)
        if run.steps == 20:
            os.kill(os.getpid(), number)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Simulation, "advance", stop)
        assert command.main(run_words(scene, tmp_path / "run")) == 130
    said = capsys.readouterr().err
    assert f"stopped by {number.name}; every finished frame is saved" in said
    assert "--resume" in said
    assert signal.getsignal(number) is before
    assert len(frame_bits(tmp_path / "run")) == 2
    goes_on(scene, tmp_path / "run", whole)


@pytest.mark.long
def test_the_reader_of_the_progress_goes_away(scene: Path, tmp_path: Path) -> None:
    """As in ``trackbed rigid ... 2>&1 | head -1``: the run comes to its end all the same."""
    command = [sys.executable, "-m", "trackbed", *run_words(scene, tmp_path / "run")]
    piped = ["bash", "-c", '"$@" 2>&1 | true', "bash", *command]
    subprocess.run(piped, check=True, cwd=Path(trackbed.__file__).parents[1])
    assert RunFolder(tmp_path / "run").summary is not None


# --- other writers, damage --------------------------------------------------------------------


@pytest.mark.long
def test_damage_to_a_frame(scene: Path, whole: list[dict[str, Any]], tmp_path: Path) -> None:
    """Bytes that are lost or wrong, anywhere: from that frame on it is computed again."""
    folder, draw = tmp_path / "run", random.Random(SEED)
    shutil.copytree(scene.parent / "whole", folder)
    for trial in range(12):
        frame = folder / f"frame_{draw.choice([0, 2, 3, 3]):06d}.npz"
        damaged = bytearray(frame.read_bytes())
        place = draw.randrange(len(damaged) - 8)
        if trial % 2:
            del damaged[place:]
        else:
            damaged[place : place + 8] = draw.randbytes(8)
        frame.write_bytes(damaged)
        (folder / "result.json").unlink()
        goes_on(scene, folder, whole)


@pytest.mark.long
def test_a_damaged_result_is_made_again(scene, whole, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(scene.parent / "whole", folder)
    result = folder / "result.json"
    sound = json.loads(result.read_text(encoding="utf-8"))
    for damage in ('{"title": "A bl', "", "[1]", "\0"):
        result.write_text(damage, encoding="utf-8")
        goes_on(scene, folder, whole)
        assert json.loads(result.read_text(encoding="utf-8")).keys() == sound.keys()


def test_a_folder_that_vanishes_is_not_made_again(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Removed midway: exit code 2 and a sentence."""
    folder, advance = tmp_path / "run", Simulation.advance

    def remove(run: Simulation, seconds: float) -> None:
        advance(run, seconds)
        if run.steps == 20:
            shutil.rmtree(folder)

    monkeypatch.setattr(Simulation, "advance", remove)
    assert command.main(run_words(scene, folder)) == 2
    assert "removed or replaced while the run went on" in capsys.readouterr().err
    assert not folder.exists()
