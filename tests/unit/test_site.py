"""The site: its reference says what the code does, pictures and notebooks run, links lead on."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from pydantic import ValidationError

from track_line.beam import Track
from trackbed.command import VERBS

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(ROOT.glob("docs/gallery/*.py"))
QUICK = ("grading", "which_law")
LINES = 40
"""Of a script at most, so that it can be read beside its picture."""
COLOURED = 1e-3
"""Share of the pixels at least: an empty frame with its labels is grey."""


@pytest.fixture(scope="module")
def reference() -> ModuleType:
    """docs/site/reference.py, which lies in no package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs" / "site")
        return import_module("reference")


@pytest.fixture(scope="module")
def keys(reference: ModuleType) -> dict[str, list[str]]:
    """Type, unit, default and words of every key: its scene's first word, table and name."""
    return {
        f"{title.split()[1]} {table} {row[0]}": row[1:]
        for title, table, rows in reference.list_scenes()
        for row in rows
    }


def test_every_key_has_words_and_every_number_a_unit(keys: dict[str, list[str]]) -> None:
    """Of all tables of all scenes; what lacks them is named."""
    number = re.compile("(?<!whole )number")
    bare = [key for key, (kind, unit, *_) in keys.items() if number.search(kind) and not unit]
    assert bare == []
    assert [key for key, (*_, words) in keys.items() if not words and "] as `[" not in key] == []
    assert len(keys) > 200


def test_a_key_is_described_as_its_model_takes_it(keys: dict[str, list[str]]) -> None:
    """Bounds refuse what lies beyond them, a comment and a string are both read, and a table that
    was listed is not listed again."""
    at = "line: [track] `spacing`"
    assert keys[at] == ["number from 0.2 to 1.2", "m", "`0.6`", "from sleeper to sleeper"]
    for beyond in (0.199, 1.201):
        with pytest.raises(ValidationError):
            Track(spacing=beyond)
    kind, unit, default, words = keys["bed: [procedure] `healing_cycles`"]
    assert (kind, unit, default) == ("whole number from 0", "", "`5`")
    assert words == "Cycles computed after a jump and kept out of the fit."
    assert keys["grains: [[body]] `box`"][0] == "list of 2 to 3: number"
    assert keys["or [body.regions.NAME] `young`"][:2] == ["number above 0", "Pa"]
    assert "or [load.nodes] as `[fix.nodes]`" in keys


def test_every_verb_and_flag_is_listed(reference: ModuleType) -> None:
    """What the sources of the command add is on the page, and no argument is without words."""
    page = reference.write_verbs()
    for verb in VERBS:
        assert f"\n## {verb}\n" in page
    sources = [*ROOT.glob("*/cli/*.py"), *ROOT.glob("*/cli.py"), *ROOT.glob("trackbed/**/*.py")]
    added = re.compile(r'add_argument\(\s*"(--[a-z-]+)"')
    flags = {flag for path in sources for flag in added.findall(path.read_text())}
    assert len(flags) > 40
    hidden = {"--debug", "--version"}  # of the command itself
    assert {flag for flag in flags - hidden if not re.search(f"`{flag}[` ]", page)} == set()
    assert not re.search(r"^\| `.*\|\s*\|$", page, re.MULTILINE)


@pytest.mark.parametrize(
    "script",
    [
        pytest.param(
            script,
            id=script.stem,
            marks=[pytest.mark.long] * (script.stem not in QUICK)
            + [pytest.mark.engine] * ("trackbed.settle" in script.read_text()),
        )
        for script in SCRIPTS
    ],
)
def test_a_picture_is_drawn(script: Path, tmp_path: Path) -> None:
    """Each script of the gallery is short, runs, and what it draws is not empty."""
    from matplotlib.image import imread

    assert len(script.read_text().splitlines()) <= LINES
    picture = tmp_path / "picture.png"
    words = [sys.executable, "-W", "error", str(script), str(picture)]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    run = subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    assert (np.ptp(imread(picture)[..., :3], axis=2) > 0.1).mean() > COLOURED


@pytest.mark.long
@pytest.mark.parametrize("name", ["friction", pytest.param("settlement", marks=pytest.mark.engine)])
def test_a_notebook_runs(name: str, tmp_path: Path) -> None:
    """Its cells run in order in an empty folder; it is kept without what they print and draw."""
    content = json.loads((ROOT / "docs" / "notebooks" / f"{name}.ipynb").read_text())
    cells = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in cells)
    words = [sys.executable, "-W", "error", "-c", "\n".join("".join(c["source"]) for c in cells)]
    env = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    run = subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]


@pytest.mark.long
@pytest.mark.peer("mkdocs")
def test_the_site_is_built(tmp_path: Path) -> None:
    """Without a warning, so every link leads somewhere; pages stand in the search index."""
    words = [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(tmp_path / "site")]
    run = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    index = (tmp_path / "site" / "search" / "search_index.json").read_text()
    assert all(word in index for word in ("healing_cycles", "solve_friction", "--dry-run"))
