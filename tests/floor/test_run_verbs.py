"""status, report, export and resume know every kind of run folder by what is in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from trackbed.command import main
from trackbed.run_files.folder import lock_folder, write_result
from trackbed.run_verbs import find_kind

STARTED = "trackbed VERB a.toml --set 'x=[1, 2]' --force"
SCENES: dict[str, Any] = {
    "qdem": {"scene": {"title": "beam", "simulation": {}}, "files": {}},
    "rigid": {"scene": {"title": "pile", "run": {}}},
    "line": {"scene": {"title": "a kilometre", "line": {}}},
}
STATES = {"qdem": "checkpoint.npz", "rigid": "frame_000000.npz", "line": "state.npz"}


def folder_of(kind: str, path: Path) -> Path:
    """A run of this kind that was stopped."""
    path.mkdir()
    command = STARTED.replace("VERB", kind)
    origin = {"command": command} if kind == "qdem" else {"provenance": {"command": command}}
    (path / "manifest.json").write_text(json.dumps(SCENES[kind] | origin))
    (path / STATES[kind]).touch()
    return path


@pytest.mark.parametrize("kind", SCENES)
def test_status_tells_how_far_a_run_is(kind: str, tmp_path, capsys) -> None:
    """Stopped, running, finished, and what to do next, in the words of the command."""
    folder = folder_of(kind, tmp_path / "run")
    assert main(["status", str(folder), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert (shown["kind"], shown["state"], shown["saved_states"]) == (kind, "stopped", 1)
    assert shown["next"] == f"trackbed {kind} a.toml --set 'x=[1, 2]' --resume"
    with lock_folder(folder):
        assert main(["status", str(folder), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["state"] == "running"
    (folder / "result.json").write_text('{"time": 0.5, "steps": 3}')
    assert main(["status", str(folder)]) == 0
    told_to_people = capsys.readouterr().out
    assert "state                       finished\n" in told_to_people
    assert "steps                       3\n" in told_to_people


@pytest.mark.parametrize("kind", SCENES)
def test_a_changed_table_of_a_finished_run_is_named(kind: str, tmp_path, capsys) -> None:
    """By status and report, whether a digit was changed or the file is gone; a result that names
    what is no table, or other folders' files, is no harm."""
    folder = folder_of(kind, tmp_path / "run")
    table = folder / "energy.csv"
    table.write_text("time,total\n0,1.5\n")
    (folder / "report.html").touch()
    write_result(folder, {"time": 0.5})
    for change, said in ((None, ""), ("time,total\n0,1.4\n", "energy.csv"), ("", "energy.csv")):
        if change is not None:
            table.write_text(change) if change else table.unlink()
        assert main(["status", str(folder), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["damaged"] == said
        assert main(["report", str(folder)]) == 0
        assert ("changed since the run was finished" in capsys.readouterr().err) == bool(said)
    for digests in ("[1]", '{"../../etc/passwd": 3}'):
        (folder / "result.json").write_text('{"digests": ' + digests + "}")
        assert main(["status", str(folder)]) == 0


def test_a_changed_result_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A number of ``result.json`` that was changed by hand; the order of its keys is none."""
    folder = folder_of("qdem", tmp_path / "run")
    (folder / "report.html").touch()
    write_result(folder, {"time": 0.5, "steps": 3})
    file = folder / "result.json"
    result = json.loads(file.read_text())
    for change, said in ((dict(reversed(result.items())), ""), (result | {"steps": 4}, file.name)):
        file.write_text(json.dumps(change))
        assert main(["status", str(folder), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["damaged"] == said


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["report"], "this VERB run is stopped, and its report is written at its end"),
        (["resume"], "a VERB run goes on with the command that started it\n  -> trackbed VERB a"),
        (["export", "--to", "csv"], "only settlement runs are exported"),
    ],
)
def test_what_a_story_has_no_verb_for_is_a_sentence(
    kind: str, words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, and what to do instead."""
    folder = folder_of(kind, tmp_path / "run")
    assert main([words[0], str(folder), *words[1:]]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith(f"trackbed: {folder}: ")
    assert said.replace("VERB", kind) in shown
    assert "\n  -> " in shown


@pytest.mark.parametrize("words", [["status"], ["report"], ["export", "--to", "csv"], ["resume"]])
def test_links_are_refused_by_every_verb(words: list[str], tmp_path, capsys) -> None:
    """What would be written to ``export`` or ``figures`` would follow a link out of the folder."""
    (tmp_path / "mine").mkdir()
    for name in ("export", "figures"):
        folder = folder_of("rigid", tmp_path / f"run-{name}")
        (folder / name).symlink_to(tmp_path / "mine")
        assert main([words[0], str(folder), *words[1:]]) == 2
        assert f"symbolic link ({name})" in capsys.readouterr().err
    assert not list((tmp_path / "mine").iterdir())


@pytest.mark.parametrize("kind", SCENES)
def test_report_of_a_finished_run_is_shown(kind: str, tmp_path, capsys) -> None:
    """Its path."""
    folder = folder_of(kind, tmp_path / "run")
    (folder / "result.json").write_text('{"time": 0.5}')
    (folder / "report.html").touch()
    assert main(["report", str(folder)]) == 0
    assert capsys.readouterr().out == f"{folder}/report.html\n"


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("runs", "this is not a run folder\n  -> its runs: {}/runs/a"),
        ("runs/a/stage", "this is not a run folder\n  -> it is a part of the run {}/runs/a"),
        ("runs/b", "there is no such folder\n  -> the runs beside it: {}/runs/a"),
        ("file", "this is a file, not a run folder\n  -> the runs beside it: none"),
    ],
)
@pytest.mark.parametrize("verb", ["status", "report", "resume"])
def test_a_place_beside_a_run_folder_names_the_run(
    verb: str, place: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "runs").mkdir()
    (folder_of("rigid", tmp_path / "runs" / "a") / "stage").mkdir()
    (tmp_path / "file").touch()
    assert main([verb, str(tmp_path / place)]) == 2
    assert said.replace("{}", str(tmp_path)) in capsys.readouterr().err


@pytest.mark.parametrize(
    "content", [None, b"", b"{", b"[]", b"null", b"\xff", b'{"scene": 3}', b'{"scene": {}}']
)
@pytest.mark.parametrize("verb", ["status", "report", "resume"])
def test_other_folders_are_no_run_folders(
    verb: str, content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As before: a sentence of the settlement's verbs that names the folder; nothing is written."""
    if content is not None:
        (tmp_path / "manifest.json").write_bytes(content)
    there = sorted(tmp_path.iterdir())
    assert find_kind(tmp_path) is None
    assert main([verb, str(tmp_path)]) == 2
    assert f"{tmp_path}: this is not a run folder" in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == there
