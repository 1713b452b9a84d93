"""Decks of the user's own, in one process and in windows, on the engines themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.decks.adopt import adopt
from adapters.decks.check import check_cut
from adapters.decks.engine import Adopted
from adapters.decks.parse import BEGIN, read_deck
from adapters.decks.scene import load_deck_scene
from tests import own_decks
from tests.unit.test_decks import write_deck
from trackbed import command

PLATED = own_decks.LIGGGHTS.partition(BEGIN)[0] + own_decks.PLATE + own_decks.PRESSED


@pytest.mark.long
@pytest.mark.parametrize(("engine", "text", "body"), [
    pytest.param("liggghts", own_decks.LIGGGHTS, "", marks=pytest.mark.engine("liggghts")),
    pytest.param("liggghts", PLATED, "plate", marks=pytest.mark.engine("liggghts")),
    pytest.param("lammps", own_decks.LAMMPS, "", marks=pytest.mark.engine("lammps")),
])  # fmt: skip
def test_windows_compute_what_one_process_does(
    engine: str, text: str, body: str, tmp_path: Path
) -> None:
    """To the last bit, grains that move by tenths of a millimetre and the plate on them."""
    bed = load_deck_scene(adopt(write_deck(tmp_path, text), engine).scene)[1]
    assert (bed.loaded or ("",))[0] == body
    found = check_cut(bed, tmp_path, cycles=2)
    assert found.path.min() > 1e-6
    assert not found.place.any()
    assert not found.height.any() if body else np.isnan(found.height).all()


WIGGLED = own_decks.LAMMPS.replace(
    "run 9000",
    "run 9000\n"
    "fix floor all wall/gran hertz/history 5e6 NULL 5e6 NULL 0.5 0 zplane 0 NULL &\n"
    "wiggle z 1e-3 0.1\nrun 1000",
)
"""A wall whose phase starts again in each window: what `find_phases` refuses."""


@pytest.mark.long
@pytest.mark.engine("lammps")
def test_the_check_sees_what_a_cut_loses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A floor that starts its wave again is another floor, and is refused before that is run."""
    bed = Adopted(read_deck(write_deck(tmp_path, WIGGLED)), "lammps")
    assert not check_cut(bed, tmp_path, cycles=1).agrees
    assert command.main(["adopt", str(tmp_path / "in.mybed"), "--engine", "lammps"]) == 3
    assert "first phase" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.engine("liggghts")
def test_the_command_checks_a_deck(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The difference of each cycle is printed."""
    path = str(write_deck(tmp_path))
    assert command.main(["adopt", path, "--engine", "liggghts", "--check"]) == 0
    assert "cycle 2: places differ by 0 m at most" in capsys.readouterr().out
