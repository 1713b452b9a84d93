"""Reading scene files: lines of keys, overrides, files that are none."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from trackbed.command import main
from trackbed.errors import SceneError, UsageError
from trackbed.scene_files.lines import find_key_lines
from trackbed.scene_files.reader import Guide, SceneText, read_scene, suggest_word
from trackbed.scene_files.types import Name, Positive, Table, Text
from trackbed.scenes import find_scene_verb, read_template

GUIDE = Guide("karrech", "run.step=1")
BODY = 'run = {}\n[[body]]\nname = "a"\n'


class Body(Table):
    """An entry of a list of tables."""

    name: Name
    size: Annotated[tuple[Positive, Positive], Field(strict=False)] = (1.0, 1.0)


class Run(Table):
    """A table."""

    step: Positive = 1.0
    way: Literal["fast", "slow"] = "slow"


class Scene(Table):
    """A small scene."""

    title: Text = "none"
    run: Run
    body: Annotated[tuple[Body, ...], Field(strict=False)] = ()


def read(folder: Path, text: str, *overrides: str) -> SceneText:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    scene = read_scene(path, overrides, guide=GUIDE)
    scene.check(Scene)
    return scene


def refusal(folder: Path, text: str, *overrides: str) -> list[str]:
    """Problems of a text, one a line, without the file's name."""
    scene = read(folder, text, *overrides)
    with pytest.raises(SceneError) as caught:
        scene.refuse(scene.problems)
    assert caught.value.remedy.startswith("correct these keys; trackbed new karrech FOLDER")
    head, *lines = caught.value.what.split("\n")
    assert head == ("1 problem" if len(lines) == 1 else f"{len(lines)} problems")
    return [line.strip().removeprefix(f"{folder}/scene.toml") for line in lines]


def test_every_problem_has_its_line_in_the_order_of_the_file(tmp_path: Path) -> None:
    """One wrong table hides nothing in another, and its neighbours can still be used."""
    text = (
        '[run]\nsetp = 1\nway = "fats"\n[[body]]\nname = "a b"\n[[body]]\nname = "c"\n'
        "size = [1, 0]\n[[body]]\nname = 'd'\n"
    )
    assert refusal(tmp_path, text) == [
        ":2: run.setp: unknown key; did you mean step?",
        ":3: run.way: must be 'fast' or 'slow', not 'fats'; did you mean fast?",
        ":5: body.0.name: a name has 1 to 60 letters, digits and _ . + -, not 'a b'",
        ":8: body.1.size.1: must be above 0 (and at least 1e-18), not 0",
    ]
    assert list(read(tmp_path, text).tables) == ["body.2"]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", ": run: missing"),
        ("run = 3", ":1: run: must be a table, not 3"),
        ("run = {}\nbody = {}", ":2: body: write [[body]] tables, not {}"),
        ("run = {}\ntitle = 3", ":2: title: must be a text, not 3"),
        ('run = {}\ntitle = ""', ":2: title: must not be empty"),
        ("run.step = nan", ":1: run.step: must be a finite number, not nan"),
        ("run.step = true", ":1: run.step: must be a valid number, not True"),
        (f"{BODY}size = 1", ":4: body.0.size: must be a list in [...], not 1"),
        (f"{BODY}size = [1, 1, 1]", ":4: body.0.size: must have 2 entries, not [1, 1, 1]"),
    ],
)
def test_one_fault_one_sentence(tmp_path: Path, text: str, problem: str) -> None:
    """Each kind of fault has its words."""
    assert refusal(tmp_path, text) == [problem]


def test_overrides_reach_tables_lists_and_names(tmp_path: Path) -> None:
    """Entries of lists by number or name, new tables, bare words; wrong ones name themselves."""
    text = '[[body]]\nname = "a"\n[[body]]\nname = "b"\nsize = [1, 2]\n'
    scene = read(tmp_path, text, "run.step=2", "body.b.size=[3, 3]", "body.0.name=c", "title=x y")
    assert not scene.problems
    assert (scene.data["title"], scene.data["run"]) == ("x y", {"step": 2})
    assert [body.get("size") for body in scene.data["body"]] == [None, [3, 3]]
    assert scene.data["body"][0]["name"] == "c"
    assert refusal(tmp_path, text, "run.step=-1", "rum.x=1") == [
        "--set run.step=-1: run.step: must be above 0 (and at least 1e-18), not -1",
        "--set rum.x=1: rum: unknown key; did you mean run?",
    ]


@pytest.mark.parametrize(
    "override", ["", "run.step", "=3", "a b=3", "run.step.x=2", ".=1", "body.7.name=a"]
)
def test_unreadable_override(tmp_path: Path, override: str) -> None:
    """An override that is no table.key=value, or names no entry, is a usage error."""
    with pytest.raises(UsageError, match=r"--set[\s\S]*\n  -> "):
        read(tmp_path, "[run]\nstep = 1\n[[body]]\nname = 'a'", override)


def test_an_override_can_be_followed(tmp_path: Path) -> None:
    """What must happen behind an override happens before the next one."""
    seen: list[tuple[str, Any]] = []
    path = tmp_path / "scene.toml"
    path.write_text("run = {}")
    read_scene(
        path, ["run.step=1", "run.step=2"], guide=GUIDE,
        after_override=lambda data, key: seen.append((key, data["run"]["step"])),
    )  # fmt: skip
    assert seen == [("run.step", 1), ("run.step", 2)]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\nb = \n", 2),
        ("a = 1\na = 2\n", 2),
        ("a = 1\n[x\n", 2),
        ('a = 1\nb = "open\n', 2),
        ("a = 1\n\nb = [1,\n", 4),
        ("= 1", 1),
        ("a = " + "[" * 5000, 1),
    ],
)
def test_syntax_error_names_its_line(tmp_path: Path, text: str, line: int) -> None:
    """A file that is not TOML is refused at the line where reading stopped."""
    with pytest.raises(SceneError, match=rf"scene\.toml:{line}: this is not TOML"):
        read(tmp_path, text)


def test_unreadable_files(tmp_path: Path) -> None:
    """A missing file and a folder are usage errors, binary garbage is no scene."""
    for path in (tmp_path / "none.toml", tmp_path, Path("a\0b")):
        with pytest.raises(UsageError, match="can not read the scene"):
            read_scene(path, guide=GUIDE)
    with pytest.raises(UsageError, match="longer than 16 MiB"):
        read_scene("/dev/zero", guide=GUIDE)
    (tmp_path / "scene.toml").write_bytes(bytes(range(256)))
    with pytest.raises(SceneError, match="not a text file"):
        read_scene(tmp_path / "scene.toml", guide=GUIDE)


def test_a_file_of_a_windows_editor_is_read(tmp_path: Path) -> None:
    """With a byte-order mark and its ends of lines."""
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf[run]\r\nstep = 2\r\nx = 1\r\n")
    scene = read_scene(path, guide=GUIDE)
    assert scene.data == {"run": {"step": 2, "x": 1}}
    assert scene.places["run.x"] == f"{path}:3"


def test_lines_of_keys_of_awkward_toml() -> None:
    """Values of many lines, quotes, comments, dotted keys, inline, nested and repeated tables."""
    text = (
        '# [not.a.table]\na = """\n[x]\n""" # c,\n[[b]]\nc = [\n  1,\n  2, # ],\n]\n[b.d]\n'
        "e.f = 1 # = 3\n[[b]]\nc = { g = 1, h = [{ i = 2 }] }\n"
        "[ table . \"quoted = name\" ]\n'literal' = 0\n"
    )
    assert find_key_lines(text) == {
        "a": 2, "b": 5, "b.0": 5, "b.0.c": 6, "b.0.d": 10, "b.0.d.e": 11, "b.0.d.e.f": 11,
        "b.1": 12, "b.1.c": 13, "b.1.c.g": 13, "b.1.c.h": 13, "b.1.c.h.0": 13, "b.1.c.h.0.i": 13,
        "table.quoted = name": 14, "table.quoted = name.literal": 15,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("stpe", "; did you mean step?"),
        ("colour", "; known: step, way"),
        ("STEP", "; did you mean step?"),
    ],
)
def test_nearest_word_is_suggested(word: str, said: str) -> None:
    """The nearest known word, or all of them."""
    assert suggest_word(word, ["way", "step"]) == said


@pytest.mark.parametrize("name", ["karrech-coarse", "cantilever-vibration", "pile", "line"])
@pytest.mark.parametrize("verb", ["run", "qdem", "rigid", "line"])
def test_a_scene_names_its_verb(tmp_path, name: str, verb: str, capsys) -> None:
    """Given to another verb: exit code 3 and the command to give, no list of unknown keys."""
    own = find_scene_verb(name)
    if verb == own:
        return
    path = tmp_path / "scene.toml"
    path.write_text(read_template(name))
    assert main([verb, str(path), "--dry-run"]) == 3
    said = capsys.readouterr().err
    assert f"this is a scene of the verb {own}, not of {verb}\n  -> trackbed {own} {path}" in said
    assert "unknown key" not in said


@pytest.mark.parametrize(
    ("name", "content", "use"),
    [
        ("a.stl", b"solid stone", "trackbed stone 'a b/a.stl' packs spheres"),
        ("a.vtu", b"\0\xff", "mesh = { file = \"'a b/a.vtu'\" }"),
        ("a.csv", b"cycle,settlement\n1,2\n", "trackbed fit 'a b/a.csv'"),
        ("run/manifest.json", b'{"scene": {"simulation": {}}}', "trackbed status 'a b/run' says"),
    ],
)
def test_what_is_no_scene_names_its_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, content: bytes, use: str
) -> None:
    """A mesh, a table or the folder of a run where a scene should be."""
    monkeypatch.chdir(tmp_path)
    path = Path("a b") / name
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    with pytest.raises((SceneError, UsageError)) as caught:
        read_scene(path if path.parent == Path("a b") else path.parent, guide=GUIDE)
    assert use in (caught.value.remedy or "")
