"""Decks of the user's own, in one process and in windows, on the engines themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from adapters.decks.check import check_cut
from adapters.decks.engine import Adopted
from adapters.decks.parse import BEGIN, read_deck
from tests import own_decks
from tests.unit.test_own_decks import write_deck
from trackbed import command

PLATED = own_decks.LIGGGHTS.partition(BEGIN)[0] + own_decks.PLATE + own_decks.PRESSED


@pytest.mark.long
@pytest.mark.parametrize(("engine", "text", "said"), [
    pytest.param("liggghts", own_decks.LIGGGHTS, "80 grains", marks=pytest.mark.engine("liggghts")),
    pytest.param("liggghts", PLATED, "body differ by 0 m", marks=pytest.mark.engine("liggghts")),
    pytest.param("liggghts", own_decks.STONES, "integr (multisphere)",
                 marks=pytest.mark.engine("liggghts")),
    pytest.param("lammps", own_decks.LAMMPS, "60 grains", marks=pytest.mark.engine("lammps")),
], ids=["spheres", "plate", "stones", "lammps"])  # fmt: skip
def test_windows_compute_what_one_process_does(
    engine: str, text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """To the last bit: grains that move by tenths of a millimetre, and the plate on them."""
    path = str(write_deck(tmp_path, text))
    assert command.main(["adopt", path, "--engine", engine, "--check"]) == 0
    out = capsys.readouterr().out
    assert out.count("places differ by 0 m at most") == 2
    assert "grains went 0 m" not in out
    assert said in out


WIGGLED = own_decks.LAMMPS.replace(
    "run 9000",
    "run 9000\n"
    "fix floor all wall/gran hertz/history 5e6 NULL 5e6 NULL 0.5 0 zplane 0 NULL &\n"
    "wiggle z 1e-3 0.1\nrun 1000",
)
"""A wall whose phase starts again in each window: what `find_phases` refuses."""


@pytest.mark.long
@pytest.mark.engine("lammps")
def test_the_check_sees_what_a_cut_loses(tmp_path, capsys) -> None:
    """A floor that starts its wave again is another floor, and is refused before that is run."""
    bed = Adopted(read_deck(write_deck(tmp_path, WIGGLED)), "lammps")
    assert not check_cut(bed, tmp_path, cycles=1).agrees
    assert command.main(["adopt", str(tmp_path / "in.mybed"), "--engine", "lammps"]) == 3
    assert "first phase" in capsys.readouterr().err
