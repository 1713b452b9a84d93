"""Scripts of YADE: read, marked, cut, and looked at for what a window would miss."""

from __future__ import annotations

from pathlib import Path

import pytest

from adapters.decks.adopt import adopt
from adapters.decks.detect import add_marks, find_obstacles, list_contents
from adapters.decks.engine import explain_failure, list_inputs
from adapters.decks.parse import BEGIN, END
from adapters.decks.scripts import read_script
from adapters.errors import UsageError
from tests import own_decks


def write_script(folder: Path, text: str = own_decks.YADE) -> Path:
    """A script in a folder, with the module that it imports."""
    (folder / "helpers.py").write_text(own_decks.HELPERS)
    path = folder / "bed.py"
    path.write_text(text)
    return path


def test_a_script_is_cut_at_its_marks(tmp_path: Path) -> None:
    """Statements above and between; the module beside it goes along, and the plate is known."""
    deck = read_script(write_script(tmp_path))
    assert [one.line for one in deck.cycle] == list(range(38, 46))
    assert list_inputs(deck) == [Path("helpers.py")]
    contents = list_contents(deck)
    assert (contents.loaded_body, contents.clumps) == ("plate", ("clumps",))
    assert find_obstacles(deck, "yade") == []


def cut(cycle: str, before: str = "") -> str:
    """A marked script."""
    return f"from yade import pack\n{before}\n{BEGIN}\n{cycle}\n{END}\n"


OBSTACLES = {
    "no run": (cut("a = 3"), "stops", "nothing is run between the marks"),
    "endless": (cut("O.run()"), "stops", "-> O.run(STEPS, True)"),
    "another bed": (cut("O.run(5)\nO.reload()"), "stops", "'O.reload()' inside the cycle"),
    "clock": (cut("O.run(5)", "O.engines += [PyRunner(command='f()', realPeriod=2)]"),
              "stops", "-> iterPeriod=STEPS"),
    "gravity": (cut("O.run(5)", "n = NewtonIntegrator(gravity=(0, -9.81, 0))"),
                "stops", "gravity is not along -z"),
    "permanent": (cut("O.run(5)", "O.forces.setPermF(3, (0, 0, -1))"),
                  "stops", "in no saved scene"),
    "forces": (cut("f = O.forces.f(3)\nO.run(5)"), "note", "forces are 0 where a window begins"),
    "outside": (cut("O.run(5)", "f = open('/home/me/load.txt')"), "stops", "is not carried along"),
    "outside by name": (cut("O.run(5)\nf = open(f'../{O.iter}.txt')\nprint(f'{a} / {b}')"),
                        "stops", "../ lies outside"),
}  # fmt: skip


@pytest.mark.parametrize("name", OBSTACLES)
def test_what_a_window_would_miss_is_said(name: str, tmp_path: Path) -> None:
    """Each of its kind, with the line to write instead."""
    text, kind, said = OBSTACLES[name]
    found = find_obstacles(read_script(write_script(tmp_path, text)), "yade")
    assert [one.kind for one in found if said in str(one)] == [kind], found
    assert len(found) == 1


def test_what_is_right_is_not_said(tmp_path: Path) -> None:
    """A run until something pauses it, a force put on in each cycle, gravity downwards."""
    text = cut(
        "O.forces.setPermF(3, (0, 0, -1))\nO.run()\nf = O.forces.f",
        "def check():\n    O.pause()\nn = NewtonIntegrator(gravity=[0.0, -0.0, -9.81])\na = 1 / 2",
    )
    assert find_obstacles(read_script(write_script(tmp_path, text)), "yade") == []


@pytest.mark.parametrize(("text", "marked"), [
    ("a = 1", ["a = 1", BEGIN, "O.run(1000, True)", END]),
    ("O.run(4)\nO.run(\n 5)\nb = 1", ["O.run(4)", BEGIN, "O.run(", " 5)", END, "b = 1"]),
    ("def f():\n    O.run(5)", ["def f():", "    O.run(5)", BEGIN, "O.run(1000, True)", END]),
])  # fmt: skip
def test_a_script_without_marks_gets_them(text: str, marked: list[str], tmp_path: Path) -> None:
    """Around its last run at the top level, or a run of 1,000 steps at its end."""
    deck = read_script(write_script(tmp_path, text))
    lines, said = add_marks(deck)
    assert lines == marked
    assert said.kind == "added"


@pytest.mark.parametrize(("name", "text", "said"), [
    ("bed.py", f"for i in range(3):\n{BEGIN}\n    O.run(5)\n{END}", "inside of a loop"),
    ("bed.py", "O.run(5", "no script of YADE"),
    ("in.bed", "O.run(5)", "end with .py"),
])  # fmt: skip
def test_scripts_that_can_not_be_cut_are_refused(name: str, text: str, said: str, tmp_path) -> None:
    """With the place; nothing is written."""
    (tmp_path / name).write_text(text)
    with pytest.raises(UsageError, match=said):
        adopt(tmp_path / name, "yade")
    assert [one.name for one in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("text", [
    '"""See https://yade-dem.org/doc\nand others."""', f'"""{"A bed of mine " * 30}/ b."""',
    "a = 'x\\0y/c.d'", "a = 'velocity [m/s]. see'",
])  # fmt: skip
def test_a_text_that_names_no_file_makes_no_folder(text: str, tmp_path: Path) -> None:
    adoption = adopt(write_script(tmp_path, cut("O.run(5)", text)), "yade")
    names = ["bed.py", "scene.toml"]
    assert sorted(one.name for one in adoption.scene.parent.iterdir()) == names


def test_encodings_of_windows_are_read_or_named(tmp_path: Path) -> None:
    """A byte order mark and ends of lines are; another encoding is not."""
    path = write_script(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + cut("O.run(5)").replace("\n", "\r\n").encode())
    assert adopt(path, "yade").deck.lines[0] == "from yade import pack"
    path.write_bytes(b"# -*- coding: latin-1 -*-\n# f\xfcr\nO.run(5)\n")
    with pytest.raises(UsageError, match="it is not in UTF-8"):
        adopt(path, "yade")


def test_where_a_script_ends_is_said() -> None:
    """Its own line, not that of trackbed's; and an exit, which fails nothing."""
    text = '  File "bed.py", line 18, in <module>\n  File "/a/adopted.py", line 9\nIndexError: x\n'
    assert "IndexError: x | bed.py, line 18" in explain_failure(1, text, Path("b")).what
    assert "as by exit or quit" in explain_failure(0, "Running script\n", Path("b")).what
