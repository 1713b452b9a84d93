"""Files of a finished run that were changed: named by whatever reads the run, or refused."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.procedure.status import read_status
from trackbed.command import main
from trackbed.scenes import find_scene_file

pytestmark = pytest.mark.lowest

SMALL = (
    'engine.name="fake"', "sample.count=30", "procedure.k_i=4", "procedure.k=6", "procedure.h=5",
    "procedure.total_cycles=40", "procedure.members=2",
)  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two members of the fake engine, each beside its full run."""
    folder = tmp_path_factory.mktemp("changed") / "run"
    scene = find_scene_file("karrech-coarse")
    run_scene(scene, folder, control=True, overrides=SMALL, progress=Progress(quiet=True))
    return folder


@pytest.fixture
def run(finished: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(finished, tmp_path / "run"))


def flip_byte(path: Path) -> None:
    """Turn a byte in the middle, so that the size stays."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 255
    path.write_bytes(data)


def scale_numbers(path: Path) -> None:
    """Make settlements of 1e-05 m those of 1e-15 m."""
    path.write_text(path.read_text().replace("e-0", "e-1"))


@pytest.mark.parametrize("inside", ["", "control", "members/1", "members/1/control"])
@pytest.mark.parametrize(
    ("pattern", "change", "fitted"),
    [
        ("settlement.csv", scale_numbers, False),
        ("window_00000[1-9]/states.npz", flip_byte, False),
        ("window_00000[1-9]/outcome.json", scale_numbers, False),
        ("events.jsonl", flip_byte, True),
    ],
)
def test_a_changed_file_is_named(
    run: Path, capsys: pytest.CaptureFixture[str], inside: str, pattern: str,
    change: Callable[[Path], None], fitted: bool,
) -> None:  # fmt: skip
    """By status and report; fit, which reads the run's own table, refuses what may be wrong."""
    assert read_status(run).damaged == ""
    path = next((run / inside).glob(pattern))
    change(path)
    first = path.relative_to(run)
    name = str(first.parent if "window" in pattern else first)
    assert main(["status", str(run), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert name in said["damaged"].split(", ")
    assert (said["state"] == "finished") == fitted
    if main(["report", str(run)]) == 0:  # it refuses a stage that it needs
        assert f"warning: not as the run left it: {said['damaged']}\n" in capsys.readouterr().err
        assert f"<code>{name}</code> is not as the run left it" in (run / "report.html").read_text()
    else:
        assert " computes it again" in capsys.readouterr().err
    assert main(["fit", str(run)]) == (0 if fitted or inside else 2)
    assert inside or fitted or f"{name}\n  -> trackbed resume" in capsys.readouterr().err


def test_a_resumed_run_is_whole_again(run: Path) -> None:
    """What was changed is made again, so that the remedy of fit is one."""
    scale_numbers(run / "settlement.csv")
    flip_byte(next((run / "control").glob("window_00000[1-9]/states.npz")))
    assert main(["fit", str(run)]) == 2
    assert main(["resume", str(run)]) == 0
    assert read_status(run).damaged == ""
    assert main(["fit", str(run)]) == 0


@pytest.mark.parametrize("kind", ["link", "pipe", "manifest"])
def test_fit_reads_nothing_strange(
    run: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    """A link out of the folder, a pipe that never ends, a folder that is no run: refused."""
    table = run / "settlement.csv"
    if kind == "manifest":
        (run / "manifest.json").write_text("{}")
    elif kind == "link":
        table.symlink_to(table.rename(run.parent / "outside.csv"))
    else:
        table.unlink()
        os.mkfifo(table)
    assert main(["fit", str(run)]) == 2
    said = {"link": "a symbolic link", "pipe": "a pipe or device", "manifest": "not a run folder"}
    assert said[kind] in capsys.readouterr().err
    assert main(["relax", str(run), "--out", str(run.parent / "rest.npz")]) == 2


def test_relax_takes_a_run_and_names_a_window(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The last state of a run, by its scene (the fake engine's grains do not touch); a window,
    which has many, points to it."""
    out = run.parent / "rest.npz"
    assert main(["relax", str(run), "--out", str(out)]) == 2
    assert "nothing bears this bed" in capsys.readouterr().err
    states = next(run.glob("window_*/states.npz"))
    assert main(["relax", str(states), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "this holds the ends of many cycles" in said
    assert "\n  -> give the run folder" in said


@pytest.mark.parametrize(
    ("words", "blocked"), [(["report"], "figures"), (["export", "--to", "vtu"], "export/vtu")]
)
def test_what_can_not_be_written_is_named(
    run: Path, capsys: pytest.CaptureFixture[str], words: list[str], blocked: str
) -> None:
    """A folder that can not be made, here as a file is in its place, has a remedy."""
    (run / "export").mkdir()
    (run / blocked).write_text("mine")
    assert main([words[0], str(run), *words[1:]]) == 2
    said = capsys.readouterr().err
    assert "can not be written" in said
    assert "\n  -> a file is where the folder should be" in said
    assert (run / blocked).read_text() == "mine"
