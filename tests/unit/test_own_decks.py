"""Decks of the user's own: read, cut at their marks, and looked at for what a window would miss."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import trackbed
from adapters.decks import engine
from adapters.decks.adopt import adopt
from adapters.decks.detect import find_obstacles
from adapters.decks.engine import Adopted, explain_failure, list_inputs, list_output_folders
from adapters.decks.jump import keep_held
from adapters.decks.parse import BEGIN, Deck, join_lines, read_deck
from adapters.decks.run import Place, write_start
from adapters.decks.scene import load_deck_scene
from adapters.decks.split import format_window, list_live
from adapters.decks.states import States, find_overlap, read_states
from adapters.errors import EngineFailed, SceneError, UsageError
from adapters.files import Frame, write_dump
from adapters.files.restart import find_mesh, find_record, move_grains, move_stones
from tests import own_decks
from trackbed import command


def write_deck(folder: Path, text: str = own_decks.LIGGGHTS) -> Path:
    """A deck in a folder, with what it reads."""
    (folder / "walls.in").write_text(own_decks.WALLS)
    (folder / "plate.stl").write_text(own_decks.PLATE_STL)
    path = folder / "in.mybed"
    path.write_text(text)
    return path


def read_text(folder: Path, text: str) -> Deck:
    """A deck of this text."""
    return read_deck(write_deck(folder, text))


def cut(before: str, cycle: str = "run 10", after: str = "") -> str:
    """A marked deck of LAMMPS."""
    start = f"units si\nregion r block 0 1 0 1 0 1\ncreate_box 1 r\n{before}\n"
    return f"{start}# trackbed: cycle\n{cycle}\n# trackbed: end\n{after}\n"


def test_commands_are_read_as_the_engines_read_them() -> None:
    """Lines go on after &, a comment ends at the line's end, quotes keep a #."""
    lines = ["fix a all print 10 &", '  "x # y" # c', "# no &", "# more", "run 5 # &", "  "]
    found = [(one.short, one.line, one.last) for one in join_lines(lines, "in")]
    assert found == [('fix a all print 10 "x # y"', 1, 2), ("run 5", 5, 6)]
    assert next(join_lines(lines, "in")).words[-1] == "x # y"


def test_a_deck_is_cut_at_its_marks_with_its_includes(tmp_path: Path) -> None:
    """Commands above, between and below the marks, those of included files in their place."""
    deck = read_deck(write_deck(tmp_path))
    assert [one.name for one in deck.cycle] == ["unfix", "fix", "run"] * 2
    assert [one.file for one in deck.before].count("walls.in") == 5
    assert list_inputs(deck) == [Path("walls.in")]
    assert list_output_folders(deck) == [Path("post")]


def test_files_that_only_include_others_go_along(tmp_path: Path) -> None:
    (tmp_path / "one.in").write_text("include two.in\n")
    (tmp_path / "two.in").write_text("# nothing\n")
    adoption = adopt(write_deck(tmp_path, own_decks.LIGGGHTS + "include one.in\n"), "liggghts")
    assert len([*adoption.scene.parent.glob("*.in")]) == 3


def test_loops_that_begin_again_or_made_the_bed_are_no_obstacles(tmp_path: Path) -> None:
    """Inside of the cycle, in a window as in one process; and above it."""
    cycle = "variable n equal 1\nvariable n equal $n+1\nvariable k loop 2\n"
    cycle += "label in\nrun $k\nnext k\njump SELF in"
    bed = cycle.replace("run $k", "variable x equal 2*$k\ncreate_atoms 1 single 0 0 $x")
    assert find_obstacles(read_text(tmp_path, cut(bed.replace("k", "m"), cycle)), "lammps") == []


def test_a_window_repeats_what_the_restart_file_does_not_hold(tmp_path: Path) -> None:
    """Header, restart file, then live declarations: nothing that made the bed, nothing undone."""
    deck = read_deck(write_deck(tmp_path))
    lines = format_window(deck, "liggghts", 3).splitlines()
    read = lines.index("read_restart cycle_0.restart")
    live = " ".join(lines[read:])
    assert ("units si" in lines[:read], "region reg" in live) == (True, True)
    assert all(f"fix {name} " in live for name in ("m1", "x1", "z1", "integr", "grav"))
    assert not any(word in live for word in ("create_box", "insert/pack", "run 9000"))


def test_nothing_from_above_clear_is_repeated(tmp_path: Path) -> None:
    """But variables; the box is the second one, and its header stands above the restart file."""
    deck = read_text(
        tmp_path,
        cut(
            "fix g all gravity 1\nvariable n index 5\nclear\nunits cgs\n"
            "region r block 0 1 0 1 0 1\ncreate_box 1 r\nfix i all nve"
        ),
    )
    lines = format_window(deck, "lammps", 1).splitlines()[1:]
    assert lines[:5] == ["variable n index 5", "units cgs", "atom_modify map array",
                         "read_restart cycle_0.restart", "region r block 0 1 0 1 0 1"]  # fmt: skip
    assert lines[5] == "fix i all nve"
    assert deck.units == (0.01, 1e-3)


@pytest.mark.parametrize("tag", [np.float64, np.int64])
def test_grains_come_in_where_they_leave_a_period(tag: type) -> None:
    """One over the low side of x, one thrice over the high side of y, one over z, a wall."""
    place = np.array([[0.1, 0.2, 0.3], [0.5, 0.9, 0.4], [0.4, 0.5, 0.9]])
    shift = np.array([[-0.2, 0, 0], [0, 2.2, 0], [0, 0, 0.2]])
    period = np.array([[0.0, 1.0], [0.0, 1.0], [np.nan, np.nan]])
    restart = pack_spheres(place, 0 * place, tag, 3)
    move_grains(restart, np.array([1, 2, 3]), place, 0 * place, shift, period)
    inside = place + shift - [[-1, 0, 0], [0, 3, 0], [0, 0, 0]]
    doubles = np.frombuffer(restart[3:-16], float).reshape(3, 12)
    assert np.allclose(doubles[:, :3], inside, rtol=0, atol=1e-15)
    assert doubles.view(tag)[:, 6].tolist() == [512 - 1, 512 + 3 * 1024, 512]


def test_a_redefinition_stands_where_others_refer_to_it(tmp_path: Path) -> None:
    """A region made again keeps its place before the wall on it; a fix made again goes last."""
    deck = read_text(tmp_path, cut(
        "region c block 0 1 0 1 0 1\nfix w all wall/gran/region hooke region c\nfix g all gravity 1"
        "\nregion c delete\nregion c block 0 2 0 2 0 2\nunfix g\nfix i all nve\nfix g all gravity 2"
        "\nvariable n index 5\nvariable n index 7\nfix_modify gone energy yes\nunfix gone"
    ))  # fmt: skip
    live = [one.text for one in list_live(deck.before)]
    assert live[1:] == [
        "region r block 0 1 0 1 0 1", "region c block 0 2 0 2 0 2",
        "fix w all wall/gran/region hooke region c", "fix i all nve", "fix g all gravity 2",
        "variable n index 5",
    ]  # fmt: skip


OBSTACLES = {
    "insertion": ("liggghts", cut("fix ins all insert/pack seed 1 insert_every once"),
                  "added", "fix ins still inserts grains"),
    "pour": ("lammps", cut("fix p all pour 100 1 4 region r"), "added", "still inserts"),
    "left fix": ("liggghts", cut("", "fix m all move/mesh mesh a\nrun 5"), "added", "unfix m"),
    "taken fix": ("liggghts", cut("fix m all nve", "unfix m\nrun 5"), "stops", "fix m all nve"),
    "left region": ("lammps", cut("", "region q plane 0 0 0 0 0 1\nrun 5"),
                    "added", "region q delete"),
    "upto": ("liggghts", cut("run 40\nrun 60", "run 300 upto"), "stops", "-> run 200"),
    "no run": ("liggghts", cut("", "fix m all nve\nunfix m"), "stops", "nothing is run"),
    "another bed": ("lammps", cut("", "clear\nrun 5"), "stops", "begins another bed"),
    "renumbered": ("lammps", cut("", 'if "1 > 0" then "delete_atoms group g"\nrun 5'),
                   "stops", "compress no"),
    "frozen step": ("lammps", cut("variable a equal step*2\nvariable b equal ${a}+v_a\n"
                                  "fix m all gravity ${b}"), "stops", "comes of step"),
    "frozen compute": ("lammps", cut("variable a equal c_1[1]\nfix m all gravity ${a}"),
                       "stops", "comes of c_1"),
    "elapsed": ("lammps", cut("variable t equal 2*PI*elapsed/100"), "note", "start of each run"),
    "wiggle": ("lammps", cut("fix w all wall/gran hooke zplane 0 NULL wiggle z 1 2"),
               "stops", "first phase"),
    "mesh wiggle": ("liggghts", cut("fix w all move/mesh mesh a wiggle period 1"),
                    "note", "8e-7 m"),
    "mesh force": ("liggghts", cut("fix a all mesh/surface/stress file a.stl\n"
                                   "variable v equal f_a[3]/2"), "note", "doubled"),
    "servo": ("liggghts", cut("fix p all mesh/surface/stress/servo file a.stl"),
              "note", "starts again"),
    "rigid": ("lammps", cut("fix i all rigid/small molecule"), "stops", "holds grains together"),
    "stones of a group": ("liggghts", cut("fix i some multisphere"),
                          "stops", "-> fix i all multisphere"),
    "missing region": ("lammps", cut("region c plane 0 0 0 0 0 1\n"
                                     "fix w all wall/gran/region hooke region c\nregion c delete"),
                       "stops", "needs the region c"),
    "include in if": ("liggghts", cut('if "1 > 0" then "include a.in"'), "stops", "refuses"),
    "fix in if": ("lammps", cut('if "1 > 0" then "fix a all nve"'), "stops", "without if"),
    "leaving": ("lammps", cut("label out", "run 5\nnext c\njump SELF out"),
                "stops", "leaves the cycle"),
    "another file": ("lammps", cut("jump in.other here"), "stops", "another file"),
    "outer loop": ("lammps", cut("variable c loop 9\nlabel out", after="next c\njump SELF out"),
                   "note", "is left out"),
    "absolute": ("lammps", cut("dump d all custom 10 /tmp/d.txt id"), "note", "/tmp/d.txt"),
    "lost": ("lammps", cut("thermo_modify lost ignore"), "note", "vanish"),
    "units": ("lammps", cut("").replace("units si", "units lj"), "note", "units lj, no metres"),
    "immediate": ("lammps", cut("variable a equal step*2\nfix m all gravity $(v_a*(2))"),
                  "stops", "$(v_a*(2)) in 'fix m"),
    "immediate step": ("lammps", cut("fix m all gravity $(step)"), "stops", "comes of step"),
    "ramp": ("lammps", cut("variable t equal vdisplace(0,1)"), "note", "start of each run"),
    "branch": ("lammps", cut("", 'if "1 > 0" then "run 5"\nrun 5'), "note", "the same branch"),
    "loop variable": ("lammps", cut("variable c loop 9\nlabel out", "fix g all gravity ${c}\n"
                                    "run 5\nunfix g", "next c\njump SELF out"),
                      "stops", "${c} in 'fix g all gravity ${c}' keeps its first value"),
    "next above": ("lammps", cut("variable c index 1 2\nnext c\nfix g all gravity v_c"),
                   "stops", "${c} in 'fix g all gravity v_c' keeps its first value"),
    "next inside": ("lammps", cut("variable c index 1 2", "fix g all gravity ${c}\nrun 5\nnext c\n"
                                  "unfix g"), "stops", "no window repeats next"),
    "count": ("lammps", cut("variable n equal 0", "variable n equal ${n}+1\nrun 5"),
              "stops", "begins again in each window"),
    "variable in if": ("lammps", cut('if "1 > 0" then "variable n equal 1"'),
                       "stops", "without if"),
    "made in a loop": ("lammps", cut("variable c loop 9\nlabel up\nfix g all gravity 1\nnext c\n"
                                     "jump SELF up"), "stops", "is made in a loop"),
    "jumped over": ("lammps", cut('if "1 > 0" then "jump SELF on"\nfix g all gravity 1\n'
                                  "label on"), "stops", "or jumped over, by 'if"),
    "dynamic": ("lammps", cut("group g dynamic all var v"), "note", "group g keeps"),
}  # fmt: skip


@pytest.mark.parametrize("name", OBSTACLES)
def test_what_a_window_would_miss_is_said(name: str, tmp_path: Path) -> None:
    """Each of the things that were measured, once, of its kind, with the line to add."""
    engine, text, kind, said = OBSTACLES[name]
    found = find_obstacles(read_text(tmp_path, text), engine)
    assert {one.kind for one in found if said in str(one)} == {kind}, found


@pytest.mark.parametrize(("engine", "text"), [("liggghts", own_decks.LIGGGHTS),
                                              ("lammps", own_decks.LAMMPS)])  # fmt: skip
def test_a_sound_deck_has_no_obstacle(engine: str, text: str, tmp_path: Path) -> None:
    """What is said of obstacles is said of nothing else."""
    assert find_obstacles(read_text(tmp_path, text), engine) == []


@pytest.mark.parametrize(("text", "said"), [
    ("# trackbed: end\nrun 5\n# trackbed: cycle", "'end' in line 1"),
    ("# trackbed: cycle\nrun 5", "not one pair"),
    ("include none.in\nrun 5", "does not exist"),
    ("include ${a}.in\nrun 5", "variable in its name"),
    ("include in.mybed\nrun 5", "includes itself"),
    ("include marked.in\nrun 5", "has a mark"),
    ("units si", "nothing is run"),
    ("run\0 5", "it is no text"),
])  # fmt: skip
def test_decks_that_can_not_be_cut_are_refused(text: str, said: str, tmp_path: Path) -> None:
    """With the place and what to do; nothing is written."""
    (tmp_path / "marked.in").write_text(f"{BEGIN}\n")
    path = write_deck(tmp_path, text)
    with pytest.raises(UsageError, match=said):
        adopt(path, "liggghts")
    assert not (tmp_path / "mybed").exists()


def test_adopting_leaves_the_deck_as_it_was(tmp_path: Path) -> None:
    """The copy has marks and lines that were missing, in any encoding; twice is once."""
    text = own_decks.LIGGGHTS.replace("unfix ins\n", "").replace("# a bed", "# B\xf6schung")
    text = "\n".join(line for line in text.split("\n") if "trackbed:" not in line)
    path = write_deck(tmp_path)
    path.write_bytes(text.encode("latin-1"))
    adoption = adopt(path, "liggghts")
    assert path.read_bytes() == text.encode("latin-1")
    copy = (tmp_path / "mybed" / "in.mybed").read_bytes().decode("latin-1").splitlines()
    added = [line for line in copy if line not in text.splitlines()]
    assert added == ["unfix ins", "# trackbed: cycle", "# trackbed: end"]
    assert copy[-4:] == ["unfix ins", "# trackbed: cycle", "run 400", "# trackbed: end"]
    assert (tmp_path / "mybed" / "walls.in").read_text() == own_decks.WALLS
    assert not adoption.stops
    assert adopt(path, "liggghts").findings == adoption.findings
    assert adopt(tmp_path / "mybed" / "in.mybed", "liggghts").findings == ()
    (tmp_path / "mybed" / "in.mybed").write_text("run 5\n")
    with pytest.raises(UsageError, match="is there already and is kept"):
        adopt(path, "liggghts")


def test_the_loaded_body_is_the_mesh_that_moves(tmp_path: Path) -> None:
    """And the scene that is written is one that can be read."""
    plated = own_decks.LIGGGHTS.partition(BEGIN)[0] + own_decks.PLATE + own_decks.PRESSED
    adoption = adopt(write_deck(tmp_path, plated), "liggghts")
    assert adoption.contents.moved == {"plate": "fix press, inside the cycle"}
    scene, bed = load_deck_scene(tmp_path / "mybed" / "scene.toml", ["procedure.total_cycles=90"])
    assert bed.loaded == ("plate", "mesh/surface/stress")
    assert (scene.deck.loaded_body, scene.procedure.total_cycles) == ("plate", 90)
    assert (tmp_path / "mybed" / "plate.stl").exists()


def test_a_deck_that_jumps_to_itself_by_name_does_not_read_itself(tmp_path: Path) -> None:
    """Its marked copy is not in the way of what it reads; the loop around the cycle is noted."""
    before = own_decks.LIGGGHTS.partition(BEGIN)[0]
    cycle = "variable i loop 9\nlabel a\n# trackbed: cycle\nrun 5\n# trackbed: end\n"
    path = write_deck(tmp_path, f"{before}{cycle}next i\njump in.mybed a\n")
    assert list_inputs(read_deck(path)) == [Path("walls.in")]
    for _ in range(2):
        adoption = adopt(path, "liggghts")
        assert not adoption.stops
        assert [one for one in adoption.findings if "loop a around the cycle" in one.what]


def test_a_mesh_or_a_bed_that_is_not_there_is_named(tmp_path: Path) -> None:
    """Before the engine is started; a name that a variable makes is left to it."""
    mesh = "fix plate all mesh/surface file meshes/plate.stl type 1\nread_data ${bed}.data\n"
    mesh += "write_data own.data\nread_data own.data\n"
    path = write_deck(tmp_path, own_decks.LIGGGHTS.replace(BEGIN, mesh + BEGIN))
    missing = [one.what for one in adopt(path, "liggghts").stops if "there is no" in one.what]
    assert missing == ["there is no file meshes/plate.stl"]


@pytest.mark.parametrize(("override", "said"), [
    ("deck.engine=yade", "no other decks, end with .py"),
    ("procedure.tolerance=0.02", "jumps that choose themselves"),
    ("procedure.k_i=300", "must exceed k_i"),
    ("procedure.members=3", "without members"),
    ("deck.body=a", "unknown key"),
    ("deck.loaded_body=a", "its meshes are: none"),
    ("deck.file=walls.in", "no load cycle is marked"),
])  # fmt: skip
def test_scenes_of_decks_are_checked(override: str, said: str, tmp_path: Path) -> None:
    """Each fault by its key."""
    adopt(write_deck(tmp_path), "liggghts")
    with pytest.raises(SceneError, match=said):
        load_deck_scene(tmp_path / "mybed" / "scene.toml", [override])


def test_what_runs_of_decks_do_not_do_is_said(tmp_path, capsys) -> None:
    """A sentence and a way on, before anything is run."""
    scene = adopt(write_deck(tmp_path), "liggghts").scene
    for words, said in ((["--dry-run"], "--check runs two"), (["--members", "3"], "members")):
        assert command.main(["run", str(scene), *words]) in (2, 3)
        assert said in capsys.readouterr().err
    assert not (scene.parent / "run").exists()


def test_the_command_says_what_stops(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 3, the line to change and the command to go on with."""
    path = write_deck(tmp_path, own_decks.LIGGGHTS.replace("run 400\n#", "run 9801 upto\n#"))
    assert command.main(["adopt", str(path), "--engine", "liggghts"]) == 3
    said = capsys.readouterr()
    assert "in.mybed, line 39: 'run 9801 upto'" in said.err
    assert f"trackbed adopt {tmp_path / 'mybed' / 'in.mybed'} --engine liggghts" in said.err
    assert "loaded body: none known" in said.out


def test_an_engine_that_failed_is_quoted() -> None:
    """Its error line, and what it means in a deck where that is known."""
    text = "Setting up\nERROR on proc 0: Attempt to remove non-existent Atom::grow() callback\n"
    error = explain_failure(1, text, Path("window.in"))
    assert ("non-existent" in error.what, "region is missing" in error.remedy) == (True, True)


def test_a_jump_follows_the_law_of_the_states() -> None:
    """u = a ln N of every grain, and the same a: the logarithm's increment to round-off."""
    start = np.random.default_rng(1).uniform(0, 1, (50, 3))
    rate = np.array([0.0, 0.0, -1e-3])
    settled = np.log(np.arange(1.0, 11.0))[:, None, None] * rate
    states = np.concatenate([start[None], start + settled])  # before any load, and N = 1 to 10
    after = trackbed.jump(states, 90, 0.02, law="log", move="per-grain")
    assert np.allclose(after, states[-1] + np.log(10) * rate, rtol=0, atol=1e-15)
    smoothed = trackbed.jump(states, 90, np.full(50, 0.02))
    assert smoothed[:, 2].mean() - states[-1, :, 2].mean() == pytest.approx(np.log(10) * -1e-3)
    assert np.array_equal(trackbed.jump(states, 0, 0.02, move="still"), states[-1])


def test_grains_that_a_deck_holds_stay() -> None:
    """Five of ten do not move in the window: no move and no strain of the mean takes them along."""
    start = np.random.default_rng(2).uniform(0, 0.1, (10, 3))
    settled = np.log(np.arange(1.0, 8.0))[:, None, None] * np.array([0.0, 0.0, -1e-3])
    states = start + settled * (np.arange(10) >= 5)[:, None]
    after = trackbed.jump(states, 20, 0.02)
    assert np.array_equal(after[:5], start[:5])
    assert (after[5:, 2] < states[-1, 5:, 2]).all()
    strained = keep_held(states, after - [0, 0, 1e-3])
    assert np.array_equal(strained[:5], start[:5])
    assert np.allclose(strained[5:], after[5:] - [0, 0, 1e-3], rtol=0, atol=0)


@pytest.mark.parametrize(("states", "radius", "said"), [
    (np.zeros((3, 4)), 1.0, r"no \(cycles"),
    (np.zeros((3, 4, 3)), np.ones(5), "are not those of 4"),
    (np.zeros((3, 4, 3)), -1.0, "above 0"),
    (np.full((3, 4, 3), np.nan), 1.0, "not finite"),
    (np.zeros((1, 4, 3)), 1.0, "determine"),
])  # fmt: skip
def test_a_jump_refuses_what_are_no_states(states: object, radius: object, said: str) -> None:
    """Each with a sentence."""
    with pytest.raises(UsageError, match=said):
        trackbed.jump(states, 5, radius, law="log")


def pack(fix: str, style: str, record: list[float]) -> bytearray:
    """A restart file with one record, as LIGGGHTS writes it, and other bytes about it."""
    key = b"".join(np.int32(len(s) + 1).tobytes() + s.encode() + b"\0" for s in (fix, style))
    return bytearray(b"head" + key + np.int32(8 * len(record)).tobytes()
                     + np.array(record).tobytes() + b"tail")  # fmt: skip


def test_meshes_and_stones_are_moved_in_their_records() -> None:
    """z of corners and reference points by the rise, all else as it was; bodies by a shift."""
    triangles = [13.0, *range(9), 0.5, 0.5, 0.5] * 2
    restart = pack("m", "mesh/surface", [2, 0, 0, *triangles, *([7.0] * 22)])
    before = find_record(restart, "m", "mesh/surface").copy()
    for heights in find_mesh(restart, "m", "mesh/surface"):
        heights -= 0.25
    moved = find_record(restart, "m", "mesh/surface") - before
    assert np.flatnonzero(moved).tolist() == [6, 9, 12, 19, 22, 25, 32, 36, 42, 46]
    assert set(moved[np.flatnonzero(moved)]) == {-0.25}
    stones = np.arange(2 * 55.0).reshape(2, 55)
    stones[:, 4] = [7, 3]
    restart = pack("i", "multisphere", [2, *stones.ravel()])
    move_stones(restart, "i", np.array([3, 7]), np.array([[1.0, 2, 3], [4, 5, 6]]))
    found = find_record(restart, "i", "multisphere")[1:].reshape(2, 55)
    for place in (slice(1, 4), slice(5, 8)):
        assert np.array_equal(found[:, place] - stones[:, place], [[4, 5, 6], [1, 2, 3]])
    assert not found[:, 8:17].any()
    assert np.array_equal(found[:, 17:], stones[:, 17:])


@pytest.mark.parametrize("metre", [1.0, 0.5])
def test_a_window_starts_with_its_grains_and_plate_where_the_jump_puts_them(
    metre: float, tmp_path: Path
) -> None:
    """In the restart file, in its units, and in the state that the window's rows go on from: each
    grain by its move and at rest, the plate down by its drop."""
    place, velocity = np.random.default_rng(3).normal(size=(2, 3, 3))
    corners = [13.0, 0, 0, 5.0, 0, 0, 5.0, 0, 0, 5.0, 0.5, 0.5, 0.5]
    restart = pack("m", "mesh/surface", [1, 0, 0, *corners, *([5.0] * 22)])
    for number in range(3):
        restart += np.array([*place[number], number + 1, 0, 0, 0, *velocity[number]]).tobytes()
    for name in ("window_000000", "jump_000004_1", "next"):
        (tmp_path / name).mkdir()
    (tmp_path / "window_000000" / "end.restart").write_bytes(restart)
    move = np.arange(9.0).reshape(3, 3) * 1e-3
    np.savez(tmp_path / "jump_000004_1" / "moved.npz", move=move, drop=0.25)
    last = np.column_stack([[1, 2, 3], place, velocity])
    states = States(np.array([1, 2, 3]), np.ones(3), np.ones(3), metre * place[None],
                    metre * velocity[None], np.array([5.0 * metre]), last)  # fmt: skip
    deck = SimpleNamespace(is_script=False, units=(metre, 1.0))
    bed = SimpleNamespace(stones="", loaded=("m", "mesh/surface"), deck=deck)
    run: Any = SimpleNamespace(folder=SimpleNamespace(path=tmp_path), bed=bed)
    at = Place(9, "window_000000", jumped="jump_000004_1")
    found = write_start(run, at, states, tmp_path / "next")
    assert np.array_equal(found.position[0], metre * place + move)
    assert found.height.tolist() == [5.0 * metre - 0.25]
    put = 5.0 - 0.25 / metre
    written = bytearray((tmp_path / "next" / "cycle_0.restart").read_bytes())
    assert all((height == put).all() for height in find_mesh(written, "m", "mesh/surface")[:1])
    grains = np.frombuffer(written[-240:], float).reshape(3, 10)
    assert np.array_equal(grains[:, :3], place + move / metre)
    assert not grains[:, 7:].any()


@pytest.mark.parametrize(("units", "metre", "gram"), [("cgs", 0.01, 1e-3), ("lj", 1.0, 1.0)])
def test_states_are_in_metres_and_kilograms(
    units: str, metre: float, gram: float, tmp_path: Path
) -> None:
    """Of a deck in centimetres and grams as of one in metres; but what matches the restart file
    stays as it stands there."""
    deck = read_text(tmp_path, cut("").replace("units si", f"units {units}"))
    columns = ("id", "x", "y", "z", "vx", "vy", "vz", "radius", "mass")
    box = np.array([[0, 2.0], [0, 2], [0, 2]])
    frame = Frame(0, columns, np.arange(1.0, 10)[None], box, boundary="pp ff ff")
    write_dump(tmp_path / "cycle_0.dump", [frame])
    states = read_states(tmp_path, 0, 0, Adopted(deck, "lammps"))
    assert np.allclose(states.position[0], metre * np.array([[2, 3, 4]]), rtol=1e-15)
    assert np.allclose(states.velocity[0], metre * np.array([[5, 6, 7]]), rtol=1e-15)
    assert np.allclose([*states.radius, *states.mass], [8 * metre, 9 * gram], rtol=1e-15)
    assert states.last.tolist() == [[1, 2, 3, 4, 5, 6, 7]]
    assert np.array_equal(states.period, [[0, 2], [np.nan] * 2, [np.nan] * 2], equal_nan=True)


@pytest.mark.parametrize("restart", [
    bytearray(b""), pack("m", "mesh", [2, 0, 0, 13])[:-12], pack("m", "mesh", [2, 0, 0, 13.0, 1]),
])  # fmt: skip
def test_damaged_restart_files_are_refused(restart: bytearray) -> None:
    """No record, one that is cut, one of another layout."""
    with pytest.raises(EngineFailed, match="restart file"):
        find_mesh(restart, "m", "mesh")


def pack_spheres(place: np.ndarray, velocity: np.ndarray, tag: type, offset: int) -> bytearray:
    """A restart file of spheres 1, 2, ... as an engine writes them, identifiers as ``tag``."""
    rows = b""
    for number, (x, v) in enumerate(zip(place, velocity, strict=True), 1):
        image = np.array([512], tag).tobytes()
        inside = np.array([number], tag).tobytes() + np.ones(2).tobytes() + image
        inside += np.array([*v, 0.01, 5e-3]).tobytes()
        rows += x.tobytes() + inside
    return bytearray(b"x" * offset + rows + bytes(16))


@pytest.mark.parametrize("offset", [0, 3, 8])
@pytest.mark.parametrize("tag", [np.float64, np.int64])
def test_spheres_are_moved_in_the_restart_file(offset: int, tag: type) -> None:
    """Each by its own shift, wherever it stands and though two share a height; all come to rest."""
    place = np.array([[0.1, 0.2, 0.3], [0.1, 0.5, 0.3], [0.4, 0.5, 0.6]])
    velocity = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]])
    shift = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    restart = pack_spheres(place, velocity, tag, offset)
    walled = np.full((3, 2), np.nan)
    move_grains(restart, np.array([1, 2, 3]), place, velocity, shift, walled)
    assert restart == pack_spheres(place + shift, 0 * velocity, tag, offset)
    with pytest.raises(EngineFailed, match="keeps grains in a way"):
        move_grains(restart, np.array([1, 2, 3]), place, velocity, shift, walled)


# --- what a referee found ---------------------------------------------------------------------


def make_folder(home: Path) -> Path:
    """A folder for a deck, with something beside it."""
    (home / "deck").mkdir()
    return home / "deck"


@pytest.mark.parametrize("name", ["../w.in", "in/../../w.in", "/tmp/w.in"])
def test_a_file_outside_of_the_folder_is_refused_and_kept(name: str, tmp_path: Path) -> None:
    """Included, or named as a mesh: no run lends it, so none can take it away."""
    (tmp_path / "w.in").write_text("# mine\n")
    path = write_deck(make_folder(tmp_path), cut(f"include {name}"))
    with pytest.raises(UsageError, match="lies outside of the folder of the deck"):
        read_deck(path)
    path.write_text(cut(f"fix m all mesh/surface file {name} type 1"))
    found = [one for one in find_obstacles(read_deck(path), "liggghts") if "outside" in one.what]
    assert [one.kind for one in found] == ["stops"]
    assert list_inputs(read_deck(path)) == []
    assert (tmp_path / "w.in").read_text() == "# mine\n"


def test_a_file_that_the_deck_writes_over_stays(tmp_path, monkeypatch) -> None:
    """An old table beside the deck is lent; what the engine writes in its place is no loan."""
    path = write_deck(make_folder(tmp_path), cut("fix p all print 1 x file hist.txt"))
    (path.parent / "hist.txt").write_text("old")
    (path.parent / "same.txt").write_text("same")
    path.write_text(cut("fix p all print 1 x file hist.txt\nvariable s file same.txt"))

    def write(command: object, folder: Path, *_: object) -> tuple[int, float, float]:
        os.utime(folder / "hist.txt", ns=(1, 1))
        (folder / "screen.txt").write_text("COMPLETE step 1\n")
        return 0, 0.0, 0.0

    monkeypatch.setattr(engine, "run_process", write)
    (tmp_path / "stage").mkdir()
    engine.run_deck(Adopted(read_deck(path), "liggghts"), "run 1\n", tmp_path / "stage" / "in.x")
    left = {one.name for one in (tmp_path / "stage").iterdir()}
    assert "hist.txt" in left
    assert "same.txt" not in left
    assert (path.parent / "hist.txt").read_text() == "old"


@pytest.mark.parametrize(
    ("line", "said"),
    [("# Trackbed: Cycle", "is no mark"), ("# trackbed: cycle (my load)", "is no mark"),
     ('"', "a quote is not closed")],
)  # fmt: skip
def test_what_is_nearly_a_mark_or_a_command_is_a_sentence(line: str, said: str, tmp_path) -> None:
    with pytest.raises(UsageError, match=said):
        read_text(tmp_path, cut(line))


def test_gravity_aside_stops_and_overlaps_are_seen(tmp_path: Path) -> None:
    text = cut("fix g all gravity 9.81 vector 0 -1 0")
    found = find_obstacles(read_text(tmp_path, text), "lammps")
    assert "gravity is not along -z" in " ".join(one.what for one in found if one.kind == "stops")
    place = np.array([[0, 0, 0], [0, 0, 1.5], [0, 9, 0.0]])
    assert find_overlap(place, np.array([1.0, 0.75, 1.0])) == pytest.approx(0.25 / 0.75)
    assert find_overlap(place[::2], np.ones(2)) == 0.0
