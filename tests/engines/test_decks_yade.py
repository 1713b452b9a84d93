"""Scripts of YADE that others wrote, in one process and in windows, moved and jumped."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from adapters.decks.adopt import adopt
from adapters.decks.check import check_cut
from adapters.decks.engine import format_run, run_deck
from adapters.decks.parse import BEGIN, END
from adapters.decks.scene import load_deck_scene
from adapters.decks.states import read_states
from adapters.errors import NotCredible
from adapters.files import RunFolder
from tests import own_decks
from tests.unit.test_yade_scripts import write_script
from trackbed import command

pytestmark = [pytest.mark.long, pytest.mark.engine("yade")]
EXAMPLES = Path("/usr/share/doc/yade/examples")
SHIFT = np.array([2e-6, -1e-6, 1e-5])  # of all grains together [m]
DIGIT = 2.0**-52 * 0.1  # last digit of a place in `own_decks.YADE` [m]


def test_windows_go_on_to_the_last_digits(tmp_path: Path) -> None:
    """With variables, functions, an engine, a body and a plot that the cycle uses.  After 800 steps
    of a bed at rest, in which a difference of a digit grows, some hundred digits at most."""
    bed = load_deck_scene(adopt(write_script(tmp_path), "yade").scene)[1]
    assert bed.loaded == ("plate", "body")
    found = check_cut(bed, tmp_path)
    assert found.grains == 40
    assert found.place[0] < 1000 * DIGIT
    assert found.height.tolist() == [0, 0]
    assert found.agrees


@pytest.mark.parametrize("name", ["clump-hopper-viscoelastic", "clump-inbox-viscoelastic"])
def test_examples_of_yade_run_changed_by_the_lines_that_are_printed(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Clumps fall through a hopper and into a box.  The marks are all that is added; behind 9,000
    steps of falling they are looked at once more, as they lie on one another."""
    path = tmp_path / f"{name}.py"
    if not (EXAMPLES / "clumps" / path.name).is_file():
        pytest.skip("the examples of Debian's yade are not installed")
    shutil.copyfile(EXAMPLES / "clumps" / path.name, path)
    words, copy = ["--engine", "yade", "--check"], tmp_path / name / path.name
    assert command.main(["adopt", str(path), *words]) == 0
    lines = path.read_text().splitlines()
    assert copy.read_text().splitlines() == [*lines, BEGIN, "O.run(1000, True)", END]
    assert "1000 steps are put at the end" in capsys.readouterr().out
    copy.write_text("\n".join([*lines, "O.run(9000, True)", BEGIN, "O.run(1000, True)", END]))
    assert command.main(["adopt", str(copy), *words]) == 0


NOTED = """
import json
kept = {f"{i.id1} {i.id2}": [*i.phys.shearForce] for i in O.interactions if i.isReal}
json.dump(kept, open(f"springs_{O.iter}.json", "w"))
"""


def test_clumps_are_moved_with_their_members_and_springs(tmp_path: Path) -> None:
    """Moved by `SHIFT` and from rest, grains keep the contacts and springs with one another that
    they have without; the plate stands where it was put.  A step of 2e-5 s carries none further
    than a dt^2, 4e-6 m under a thousand weights."""
    before = own_decks.YADE.partition(BEGIN)[0]
    text = f"{before}{BEGIN}\n{NOTED}O.run(1, True)\n{NOTED}{END}\n"
    words = ['deck.loaded_body="plate"']
    bed = load_deck_scene(adopt(write_script(tmp_path, text), "yade").scene, words)[1]
    run_deck(bed, format_run(bed, "prepare", 0), tmp_path / "prepare.in")
    start, springs = read_states(tmp_path, 0, 0, bed), []
    for shift in (0 * SHIFT, SHIFT):
        moved = np.broadcast_to(shift, start.position[0].shape)
        np.savez(tmp_path / "moved.npz", identifier=start.identifier, move=moved, drop=-shift[2])
        run_deck(bed, format_run(bed, "window", 1), tmp_path / "window.in")
        after = read_states(tmp_path, 1, 1, bed)
        far = after.position[0] - start.position[0] - shift
        assert np.abs(far).max() < 1000 * 9.81 * 2e-5**2
        assert after.height[0] == pytest.approx(start.height[0] + shift[2], abs=1e-15)
        files = (tmp_path / f"springs_{step}.json" for step in (20000, 20001))
        springs.append([json.loads(file.read_text()) for file in files])
    assert springs[0][0] == springs[1][0]
    # ten facets come first, and the walls stand still
    pairs = [pair for pair in springs[0][1] if min(map(int, pair.split())) > 9]
    assert len(pairs) > 10
    for pair in pairs:  # overlaps of 1e-6 m are the same to 1e-17 m
        assert np.allclose(springs[1][1][pair], springs[0][1][pair], rtol=1e-8, atol=1e-12)


KEYS = {"total_cycles": 30, "k_i": 6, "k": 4, "h": 5, "healing_cycles": 2, "settlement": '"law"'}


def test_a_script_is_run_with_jumps_and_a_full_run_beside_it(tmp_path, capsys) -> None:
    """Every cycle is computed or jumped once, and what is done is not done again.  Its plate goes a
    prescribed way, so the mean grain is the result."""
    scene = adopt(write_script(tmp_path), "yade").scene
    words = [word for key, value in KEYS.items() for word in ("--set", f"procedure.{key}={value}")]
    assert command.main(["run", str(scene), "--control", *words]) == 0
    run = RunFolder(scene.parent / "run")
    spans = [(one.stage, one.first_cycle, one.last_cycle) for one in run.outcomes()]
    assert [last for _, _, last in spans][:-1] == [first for _, first, _ in spans][1:]
    assert any(stage == "jump" for stage, _, _ in spans)
    assert spans[-1][2] == 30
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("mean grain settles")
    assert last.endswith("goes a prescribed way and does not settle")
    assert command.main(["resume", str(run.path)]) == 0
    assert [(one.stage, one.first_cycle, one.last_cycle) for one in run.outcomes()] == spans


@pytest.mark.parametrize(("old", "new", "said"), [
    ("top = max", "packed = pack.SpherePack()\ntop = max", "name 'packed' is not defined"),
    ("def count():", "if True:\n  def count():", "name 'count' is not defined"),
    ("plate = O.bodies[O", "plate = [*O.bodies][:0] or None and O.bodies[O", "plate holds no body"),
    ("gravity=(0, 0, -9.81)", "gravity=Vector3(0, -9.81, 0)", "gravity is not along -z"),
    ("def count():", "log = open('a', 'w')\ndef count():\n    log.write('a')",
     "name 'log' is not defined"),  # nor taken for the function of that name
    ("wallMask=31))", "wallMask=31))\nexit()", "as by exit or quit"),
    ("plate = O.b", "O.bodies.append(box((1, 1, 1), (1, 1, 1)))\nO.bodies[-1].dynamic = True\n"
     "plate = O.b", "a Box, moves by itself"),
])  # fmt: skip
def test_what_no_window_can_have_is_named(old: str, new: str, said: str, tmp_path, capsys) -> None:
    """Before a window computes another bed, with the name and what to do; exit code 5."""
    text = own_decks.YADE.replace("O.run(20000)", "O.run(20)").replace(END, f"packed\n{END}")
    text = text.replace("packed\n", "" if "packed" not in new else "packed\n")
    assert old in text
    path = write_script(tmp_path, text.replace(old, new, 1))
    assert command.main(["adopt", str(path), "--engine", "yade", "--check"]) == 5
    assert said in capsys.readouterr().err


STATE = """
import random
random.seed(3)
class Load:
    turns = 0
down = Vector3(0, 0, -30)
def pull_down(a=down, seen=[]):
    seen.append(1)
    pull_down.called = len(seen)
    return a * len(seen) - Vector3(0, 0, random.random())
down = None
plot.plots = {"i": ("i",)}
"""
CHANGED = """
Load.turns += 1
newton.gravity = pull_down()
assert Load.turns == pull_down.called
plot.plot(noShow=True).savefig("cycle_plot.png")
"""


def test_what_functions_classes_and_random_numbers_hold_goes_on(tmp_path: Path) -> None:
    """As in one process, to the last digits, in a script of the name that its window would have."""
    before, mark, cycle = own_decks.YADE.replace("O.run(20000)", "O.run(600)").partition(BEGIN)
    cycle = cycle.replace("newton.gravity = helpers.pull(weight)", CHANGED)
    path = write_script(tmp_path, before + STATE + mark + cycle).rename(tmp_path / "window.py")
    found = check_cut(load_deck_scene(adopt(path, "yade").scene)[1], tmp_path)
    assert found.place.max() < 1e-9 * found.path.max()


def test_a_bed_that_is_not_there_or_lies_still_is_named(tmp_path: Path) -> None:
    head = "O.engines = [ForceResetter(), NewtonIntegrator(gravity=(0, 0, -9.81))]\nO.dt = 1e-5\n"
    still = f"{BEGIN}\nwhile O.iter < 9: O.run(9, True)\n{END}"
    for made, said in (("", "there are no grains"), ("O.bodies.append(sphere((0, 0, 0), 1))\n",
                                                    "no grain moves in cycle 2")):  # fmt: skip
        folder = tmp_path / said
        folder.mkdir()
        path = write_script(folder, head + made + still)
        with pytest.raises(NotCredible, match=said):
            check_cut(load_deck_scene(adopt(path, "yade").scene)[1], folder)
