"""compare, plot, completion and the list of scenes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from adapters.cli.compare import CURVES, draw_curves
from tests.small_bed import small_bed
from trackbed.command import main
from trackbed.scenes import list_scenes
from trackbed.series_file import read_table

LINES = {
    "first": ({"line": {"axles": 100, "seed": 1}, "axle": [{"force": 5e4}, {"force": 9e4}]},
              {"d1": 2e-3, "limit": [1.5, 0.1 + 0.2], "sentence": "good", "digests": {"a": "1"}}),
    "second": ({"line": {"axles": 200, "seed": 1}, "axle": [{"force": 5e4}]},
               {"d1": 3e-3, "limit": [1.5, 0.3], "sentence": "bad", "digests": {"a": "2"}}),
}  # fmt: skip


@pytest.fixture
def lines(tmp_path: Path) -> list[str]:
    """Two finished runs of a line."""
    for name, (scene, result) in LINES.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "manifest.json").write_text(json.dumps({"scene": scene}))
        (tmp_path / name / "result.json").write_text(json.dumps(result))
    return [str(tmp_path / name) for name in LINES]


def test_what_differs_is_shown_and_nothing_else(lines, capsys) -> None:
    """Keys and results by dotted name, the ratio of numbers; what one run has not is None."""
    assert main(["compare", *lines, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["scene"] == {"line.axles": [100, 200], "axle.1.force": [9e4, None]}
    assert shown["found"] == {"d1": [2e-3, 3e-3], "sentence": ["good", "bad"]}
    assert main(["compare", *lines]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["line.axles", "100", "200", "2"] in rows
    assert ["d1", "0.002", "0.003", "1.5"] in rows
    assert main(["compare", lines[0], lines[0]]) == 0
    assert "scene: the same in both\nfound: the same in both\n" in capsys.readouterr().out


def test_two_settlement_runs(tmp_path: Path, capsys) -> None:
    """By what status says of each."""
    (tmp_path / "scene.toml").write_text(small_bed(k=2, h=4, total_cycles=14))
    runs = [str(tmp_path / name) for name in ("far", "near")]
    for run, words in zip(runs, ([], ["--set", "procedure.h=2"]), strict=True):
        assert main(["run", str(tmp_path / "scene.toml"), "--run-folder", run, *words]) == 0
    capsys.readouterr()
    assert main(["compare", *runs, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["scene"] == {"procedure.h.0": [4, 2]}
    few, many = shown["found"]["jumps"]
    assert 0 < few < many
    assert "cycle" not in shown["found"]
    assert main(["plot", *runs]) == 0
    assert Path(capsys.readouterr().out.strip()).stat().st_size > 10_000


def test_curves_are_those_of_the_tables(tmp_path: Path) -> None:
    """Against the first column, without rows that lack a number; all columns of probes."""
    path = tmp_path / "probes.csv"
    path.write_text("time,x10_x,tip_z\n0,1,5\n1,,6\n2,3,7\n")
    across, along = draw_curves([read_table(path)] * 2, CURVES["qdem"][1]).axes
    assert (across.get_ylabel(), along.get_xlabel()) == ("x10_x (m)", "time (s)")
    assert [line.get_xydata().tolist() for line in across.lines] == [[[0, 1], [2, 3]]] * 2
    assert along.lines[1].get_xydata().tolist() == [[0, 5], [1, 6], [2, 7]]


def test_runs_that_can_not_be_compared(lines, tmp_path: Path, capsys) -> None:
    """Of two kinds, unfinished, or none: usage, and what to do."""
    other = tmp_path / "rigid"
    other.mkdir()
    (other / "manifest.json").write_text('{"scene": {"run": {}}}')
    for words, said in (
        ((lines[0], str(other)), "a line run and a rigid run"),
        ((str(other), str(other)), "this run is not finished\n  -> first: trackbed --resume"),
        ((lines[0], str(tmp_path / "none")), "there is no such folder"),
    ):
        assert main(["compare", *words]) == 2
        assert said in capsys.readouterr().err
    assert main(["plot", lines[0]]) == 2


def test_a_shell_completes_verbs_and_flags() -> None:
    """argcomplete's protocol: words end up on file descriptor 8."""
    for line, word in (
        ("trackbed comp", "compare "),
        ("trackbed run a.toml --proc", "--procedure "),
    ):
        answer = subprocess.run(
            f"{sys.executable} -m trackbed 8>&1", shell=True, capture_output=True, text=True,
            env=os.environ | {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": f"{len(line)}"},
        )  # fmt: skip
        assert answer.stdout == word


def test_the_list_says_what_each_scene_is(capsys) -> None:
    """A line each: name, verb, the first sentence of its comment."""
    with pytest.raises(SystemExit, match="0"):
        main(["new", "--list"])
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows] == [*list_scenes()]
    title = (
        "A pile of hard, sharp-edged stones between two walls, in the plane, tamped by a sleeper"
    )
    pile = next(row for row in rows if row.startswith("pile "))
    assert pile.split(maxsplit=2)[1:] == ["rigid", title]
