"""The house rules that a machine can hold: who imports whom, names, what is packaged."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = [
    pattern.removesuffix("*")
    for pattern in PYPROJECT["tool"]["setuptools"]["packages"]["find"]["include"]
]


def imported(source: str) -> set[str]:
    """Top-level names that a source imports anywhere, ``import_module`` of a literal included."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add((node.module or "").partition(".")[0])
        elif isinstance(node, ast.Call) and "import_module" in ast.unparse(node.func):
            names |= {
                word.value.partition(".")[0]
                for word in node.args
                if isinstance(word, ast.Constant) and isinstance(word.value, str)
            }
    return names


def test_rigid_lcp_loads_no_library_for_one_job() -> None:
    """What only one job of `rigid_lcp` needs is imported in the function that does it."""
    for_one_job = {"clarabel", "coal", "h5py", "matplotlib", "meshio", "osqp", "rich", "shapely"}
    for path in (ROOT / "rigid_lcp").rglob("*.py"):
        module = ast.parse(path.read_text())
        module.body = [
            part for part in module.body if isinstance(part, ast.Import | ast.ImportFrom)
        ]
        assert not imported(ast.unparse(module)) & for_one_job, path


def test_data_files_are_packaged() -> None:
    """Each file beside the decks, scenes and results matches a package-data pattern."""
    patterns = PYPROJECT["tool"]["setuptools"]["package-data"]
    for package, globs in patterns.items():
        folder = ROOT / package.replace(".", "/")
        packaged = {path for pattern in globs for path in folder.glob(pattern)}
        data = {
            path
            for path in folder.rglob("*")
            if path.is_file()
            and path.suffix not in {".py", ".pyc", ".md"}
            and "__pycache__" not in path.parts
        }
        assert data <= packaged, f"{package}: not packaged {data - packaged}"


def test_imported_packages_are_ours() -> None:
    """``import adapters`` finds this project's folder, not the PyPI package of the same name."""
    for package in PACKAGES:
        found = subprocess.run(
            [sys.executable, "-c", f"import {package} as p; print(p.__file__)"],
            capture_output=True, text=True, cwd=ROOT,
        )  # fmt: skip
        expected = ROOT / Path(*package.split(".")) / "__init__.py"
        assert found.stdout.strip() == str(expected), (
            f"{package} is imported from {found.stdout.strip() or found.stderr}: if that is the "
            "unrelated PyPI package 'adapters', pip uninstall adapters"
        )


def test_version_is_one() -> None:
    """CITATION.cff and CHANGELOG.md name the version of ``trackbed --version``."""
    import trackbed

    assert f"version: {trackbed.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## [{trackbed.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


@pytest.mark.long
@pytest.mark.parametrize(("option", "outcome"), [(["--nothing-missing"], "error"), ([], "skipped")])
def test_markers_of_what_may_be_missing(tmp_path: Path, option: list[str], outcome: str) -> None:
    """Without its engine or library a test is skipped with the reason; in ``test-all`` it fails."""
    (tmp_path / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n  engine\n  peer\naddopts = -ra\n")
    (tmp_path / "test_one.py").write_text(
        "import pytest\n\n@pytest.mark.engine('no-such-engine')\ndef test_one(): pass\n"
        "\n@pytest.mark.peer('no_such_library')\ndef test_two(): pass\n"
    )
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *option, str(tmp_path)],
        capture_output=True, text=True, cwd=tmp_path,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT)},  # this checkout's engines
    )  # fmt: skip
    assert f"2 {outcome}" in run.stdout
    assert "the engine no-such-engine is not installed" in run.stdout
    assert "no_such_library can not be imported" in run.stdout


def test_lowest_versions_are_those_of_pyproject() -> None:
    """What ``make test-lowest`` installs is what pyproject.toml allows at least."""
    project = PYPROJECT["project"]
    asked = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    least = dict(word.partition(";")[0].split(">=") for word in asked)
    lines = (ROOT / "tests" / "lowest.txt").read_text().splitlines()
    pinned = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert pinned.keys() == least.keys()
    for name, version in least.items():
        assert f"{pinned[name]}.".startswith(f"{version}."), name


def test_validate_wants_a_checkout(tmp_path: Path) -> None:
    """An installed trackbed holds no studies, and is not misled by another project's package."""
    shutil.copytree(ROOT / "trackbed", tmp_path / "trackbed")
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation" / "__init__.py").write_text("raise SystemExit('not ours')")
    run = subprocess.run(
        [sys.executable, "-m", "trackbed", "validate"], cwd=tmp_path, capture_output=True,
        text=True, env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert run.returncode == 4
    assert "validate: the studies are not in this installation" in run.stderr
    assert "git clone https://github.com/trackbed/trackbed" in run.stderr
    assert "Traceback" not in run.stderr
