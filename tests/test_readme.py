"""README and its pages tell the truth: their code blocks run, their make targets are there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NAMES = ("settle", "vibrate", "hard-grains", "line", "tutorial")
PAGES = ("README.md", *(f"docs/{name}.md" for name in NAMES))
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
BLOCK = re.compile(
    r"^(?P<engine><!-- runs: engine -->\n)?```(?P<language>bash|python)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
BLOCKS = [(page, block) for page in PAGES for block in BLOCK.finditer(TEXTS[page])]
SHORTER = {"total_cycles": (500, 80)}


def blocks() -> list[object]:
    """Code blocks in the order of the text; those that start an engine are marked so, and long."""
    return [
        pytest.param(
            block["language"],
            block["code"],
            id=f"{page}-line-{TEXTS[page].count(chr(10), 0, block.start()) + 1}",
            marks=[pytest.mark.engine, pytest.mark.long] if block["engine"] else [],
        )
        for page, block in BLOCKS
    ]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all blocks: later ones use what earlier ones wrote."""
    return tmp_path_factory.mktemp("readme")


@pytest.fixture(scope="module")
def done() -> set[str]:
    """Blocks that ran in the folder: where tests run in several processes, not all of them do."""
    return set()


@pytest.mark.long
@pytest.mark.parametrize(("language", "code"), blocks())
def test_block_runs(language: str, code: str, folder: Path, done: set[str]) -> None:
    """Each code block runs as it is printed, in order, in one empty folder."""
    for _, earlier in BLOCKS:
        if earlier["code"] == code:
            break
        if earlier["code"] not in done and not earlier["engine"]:
            block_run(earlier["language"], earlier["code"], folder, done)
    if code not in done:  # a later one may have needed it
        block_run(language, code, folder, done)


def block_run(language: str, code: str, folder: Path, done: set[str]) -> None:
    """Run a block, and remember it."""
    command = {"bash": ["bash", "-euo", "pipefail", "-c"], "python": [sys.executable, "-c"]}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    run = subprocess.run(
        [*command[language], code],
        cwd=folder, env=os.environ | {"PATH": path}, stdin=subprocess.DEVNULL,
        capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, f"{code}\n{run.stdout[-2000:]}\n{run.stderr[-2000:]}"
    done.add(code)
    if new := re.search(r"trackbed new karrech-coarse (\S+)", code):  # fewer cycles test the same
        scene = folder / new[1] / "scene.toml"
        text = scene.read_text()
        for key, (printed, short) in SHORTER.items():
            assert f"\n{key} = {printed}\n" in text
            text = text.replace(f"\n{key} = {printed}\n", f"\n{key} = {short}\n")
        scene.write_text(text)


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_found(page: str) -> None:
    """No fence with code escapes the reader above; a session to read is fenced as console."""
    fences = re.findall(r"^```(\w+)$", TEXTS[page], re.MULTILINE)
    assert set(fences) <= {"bash", "python", "console"}
    assert [name for name, _ in BLOCKS].count(page) == len(fences) - fences.count("console") > 0


def test_make_targets_exist() -> None:
    """Each ``make`` command of README and CONTRIBUTING is a target of the Makefile."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    text = TEXTS["README.md"] + (ROOT / "CONTRIBUTING.md").read_text()
    named = re.findall(r"(?:\$ |`)make ([a-z-]+)", text)
    assert {"demo", "test", "lint", "bench", "validate"} <= targets
    assert named
    assert set(named) <= targets


def test_every_exit_code_is_named() -> None:
    """The table of exit codes in docs/exit-codes.md is that of ``trackbed --help``."""
    from trackbed.errors import EXIT_CODES

    table = (ROOT / "docs" / "exit-codes.md").read_text().partition("| exit code |")[2]
    listed = {
        (code, meaning.strip())
        for row in re.findall(r"^\|(.*)\|$", table, re.MULTILINE)
        for code, meaning in re.findall(r"\s(\d+) \|([^|]+)", row)
    }
    assert listed == {(str(code), meaning) for code, meaning in EXIT_CODES.items()}
