"""The pages name what exists: links, modules, verbs, flags, studies, files."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from trackbed.command import VERBS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("docs/*.md"))]
PACKAGES = ("adapters", "qdem_fem", "rigid_lcp", "track_line", "trackbed", "validation")
STUDIES = {path.parent.name.replace("_", "-") for path in ROOT.glob("validation/studies/*/page.md")}
HISTORY = re.compile(r"`[^`]*6035ef5:[^`]*`")  # places in an earlier commit
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)")
MODULE = re.compile(r"python -m ([\w.]+)")
STUDY = re.compile(r"validation\.study ([a-z-]+)")
CODE = re.compile(r"^```\w*\n.*?^```|^ {4}[^\n]*|`[^`\n]+`", re.MULTILINE | re.DOTALL)
VERB = re.compile(r"(?:^\s*|[`$] ?)trackbed ([a-z]+)(?= |$|`)([^`\n]*)", re.MULTILINE)
PLACE = re.compile(rf"`((?:{'|'.join(PACKAGES)}|tests|docs|\w+_inputs|yade_scripts)/[\w./-]*)`")
DOTTED = re.compile(rf"`((?:{'|'.join(PACKAGES)})(?:\.\w+)+)`")
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
OUTSIDE = {"mpi": "an MPI's or the launcher's own", "mca": "OpenMPI's"}  # flags inside a launcher


@cache
def product_text() -> str:
    """All source of the packages."""
    return "\n".join(
        path.read_text(encoding="utf-8")
        for name in PACKAGES
        for path in ROOT.glob(f"{name}/**/*.py")
    )


def find_module(name: str) -> Path | None:
    """File of a module or package; None where there is none."""
    place = ROOT.joinpath(*name.split("."))
    files = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in files if file.is_file()), None)


def names_something(dotted: str) -> bool:
    """Whether a dotted name is a module, or what is behind the last module is in its text."""
    parts = dotted.split(".")
    for k in range(len(parts), 0, -1):
        if file := find_module(".".join(parts[:k])):
            text = file.read_text(encoding="utf-8")
            return all(re.search(rf"\b{part}\b", text) for part in parts[k : k + 1])
    return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_names_what_exists(page: Path) -> None:
    """A link, module, study, verb, flag, file or dotted name that is not there is listed."""
    text = HISTORY.sub("", page.read_text(encoding="utf-8"))
    missing = [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    modules = {name.rstrip(".") for name in MODULE.findall(text)}
    missing += [name for name in modules if name.startswith(PACKAGES) and not find_module(name)]
    missing += [name for name in STUDY.findall(text) if name not in STUDIES]
    for verb, rest in VERB.findall("\n".join(CODE.findall(text))):
        missing += [verb] * (verb not in VERBS)
        flags = [flag for flag in FLAG.findall(rest) if flag[2:] not in OUTSIDE]
        missing += [flag for flag in flags if f'"{flag}"' not in product_text()]
    places = [place for place in PLACE.findall(text) if "NAME" not in place]
    missing += [place for place in places if not (ROOT / place).exists()]
    missing += [name for name in DOTTED.findall(text) if not names_something(name)]
    assert missing == []
