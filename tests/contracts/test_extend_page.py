"""docs/extend.md is true: its diffs apply, keep the contracts, and break as the page says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "extend.md").read_text()
DIFFS = re.findall(r"^```diff\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
FILES = re.findall(r"^\+\+\+ b/(\S+)$", PAGE, re.MULTILINE)
NAMES = [Path(file).stem.replace("_", "-") for file in FILES]
BREAKS = (
    ("    minimum_cycles = 2\n", "", "the law square-root lacks minimum_cycles"),
    ('Move("cut", find_displacement)', "find_displacement",
     "MOVE of cut is no Move(name, displacement)"),
    ("(FakeEngine)", "", "the engine creep lacks command(scene, deck), "),
    ("start=None, ", "", "uzawa takes ['problem', 'tolerance']"),
    ("compute_stored_energy", "energy", "the strain measure murnaghan lacks compute_stored_energy"),
    ("return make_flat_form(", "return (", "SHAPE of blocks draws no GrainForm"),
    ("return Polygon.regular(corners, diameter / 2)", "return [(0, 1)]",
     "SHAPE of regular draws list in 2D"),
)  # fmt: skip
"""What is taken from each file of the page, and what the contract says then."""
JOIN = """
import sys
from importlib.util import find_spec, module_from_spec
for room, folder in {rooms!r}.items():
    if room in sys.modules:
        sys.modules[room].__path__.append(folder)
        continue
    spec = find_spec(room)
    spec.submodule_search_locations.append(folder)
    sys.modules[room] = module = module_from_spec(spec)
    spec.loader.exec_module(module)
"""
"""A plugin of pytest that joins folders to rooms before a room looks for its choices."""


@pytest.fixture
def pages_files(tmp_path: Path) -> Path:
    """A folder with the files of the page, as ``git apply`` makes them."""
    for original in re.findall(r"^copy from (\S+)$", PAGE, re.MULTILINE):
        (tmp_path / original).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / original, tmp_path / original)
    alone = os.environ | {"GIT_CEILING_DIRECTORIES": str(tmp_path.parent)}
    for diff in DIFFS:
        subprocess.run(["git", "apply"], input=diff, cwd=tmp_path, env=alone, text=True, check=True)
    for original in re.findall(r"^copy from (\S+)$", PAGE, re.MULTILINE):
        (tmp_path / original).unlink()
    return tmp_path


def run_contracts(folder: Path) -> subprocess.CompletedProcess[str]:
    """The contract tests of the members in a folder, beside those of the package."""
    places = sorted({Path(file).parent for file in FILES})
    rooms = {".".join(place.parts): str(folder / place) for place in places}
    (folder / "join_rooms.py").write_text(JOIN.format(rooms=rooms))
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "join_rooms", "-p", "no:cacheprovider",
         "-n", "0", f"--basetemp={folder / 'runs'}", "-k", " or ".join(NAMES), "tests/contracts",
         f"--deselect={Path(__file__).relative_to(ROOT)}"],
        cwd=ROOT, capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(folder)])},
    )  # fmt: skip


def test_page_is_short_and_shows_one_of_each_kind() -> None:
    """At most 1,200 words; a diff sets the word of each room."""
    words = set(re.findall(r"^\+?([A-Z]+) = ", "\n".join(DIFFS), re.MULTILINE))
    assert {"LAW", "MOVE", "ENGINE", "METHOD", "MEASURE", "SHAPE"} <= words
    assert len(PAGE.split()) <= 1200
    assert all(file in PAGE.replace("\n", " ") for file in re.findall(r"tests/\S+\.py", PAGE))
    for file in re.findall(r"`?((?:tests|adapters|rigid_lcp|trackbed)/[\w/]+\.py)", PAGE):
        assert file in FILES or (ROOT / file).exists(), file


@pytest.mark.long
def test_diffs_keep_the_contracts(pages_files: Path) -> None:
    """Every new file is found by being there, and all of its contract tests pass."""
    run = run_contracts(pages_files)
    assert run.returncode == 0, run.stdout[-4000:] + run.stderr[-2000:]
    assert int(re.findall(r"(\d+) passed", run.stdout)[0]) > 60


@pytest.mark.long
def test_contracts_say_what_is_missing(pages_files: Path) -> None:
    """Without a part each file fails, with the sentence of the page."""
    for file, (part, without, said) in zip(FILES, BREAKS, strict=True):
        path = pages_files / file
        text = path.read_text()
        assert part in text, file
        path.write_text(text.replace(part, without))
        assert said in " ".join(PAGE.split()), said
    run = run_contracts(pages_files)
    for _, _, said in BREAKS:
        assert said in run.stdout, f"{said}\n{run.stdout[-6000:]}"
