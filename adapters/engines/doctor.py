"""What this machine has for trackbed: engines, libraries, versions, and how to get the rest."""

import platform
from dataclasses import dataclass
from importlib import metadata

from adapters.engines.contract import get_engine, list_real_engines
from adapters.errors import EngineMissing

LIBRARIES = (
    "numpy", "scipy", "numba", "pydantic", "matplotlib", "rich", "meshio", "scikit-fem",
)  # fmt: skip
"""Distributions that pyproject.toml asks for."""


@dataclass(frozen=True)
class Finding:
    """One thing looked for on this machine."""

    kind: str  # "engine", "python" or "library"
    name: str
    version: str  # as the thing prints it; empty when it is not there
    where: str = ""  # path of a program
    remedy: str = ""  # what to do; empty when nothing is wrong


def _check_engine(name: str) -> Finding:
    path = ""
    try:
        engine = get_engine(name)
        path = (engine.program() or [""])[-1]
        return Finding("engine", name, engine.version(), path)
    except EngineMissing as error:
        return Finding("engine", name, "", path, f"{error.what}: {error.remedy}")
    except ImportError as error:  # a library below is missing, and without it nothing runs
        return Finding("engine", name, "", path, f"cannot be asked: {error}")


def _check_library(name: str) -> Finding:
    try:
        return Finding("library", name, metadata.version(name))
    except metadata.PackageNotFoundError:
        return Finding("library", name, "", remedy=f"pip install {name}")


def list_findings() -> list[Finding]:
    """Everything looked for, engines first; a finding with a ``remedy`` asks for a hand."""
    return [
        *(_check_engine(name) for name in list_real_engines()),
        Finding("python", "python", platform.python_version()),
        *(_check_library(name) for name in LIBRARIES),
    ]


def has_usable_engine(found: list[Finding]) -> bool:
    """True when at least one engine is here and prints its version."""
    return any(finding.kind == "engine" and finding.version for finding in found)
