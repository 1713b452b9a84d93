"""Scenes to copy and edit: ``list_scenes`` lists them, ``read_template`` is the text of one."""

import re
import tomllib
from importlib.resources import files
from pathlib import Path
from textwrap import shorten

from trackbed.run_verbs import find_scene_kind

__all__ = ["find_scene_file", "find_scene_verb", "list_scenes", "read_template", "read_title"]


def list_scenes() -> tuple[str, ...]:
    """Names of the scenes that ship with the package, sorted."""
    names = [entry.name for entry in files(__name__).iterdir()]
    return tuple(sorted(n.removesuffix(".toml") for n in names if n.endswith(".toml")))


def read_template(name: str) -> str:
    """Text of the scene file ``name``; raises KeyError, which lists the names, for another."""
    if name not in list_scenes():
        raise KeyError(f"no scene {name!r}; there are {', '.join(list_scenes())}")
    return (files(__name__) / f"{name}.toml").read_text(encoding="utf-8")


def read_title(name: str) -> str:
    """The first sentence of the comment that the scene ``name`` begins with."""
    comment = " ".join(re.findall(r"^# (.*)", read_template(name).split("\n\n")[0], re.MULTILINE))
    return shorten(re.split(r"\.\s+(?=[A-Z])|\.\s\s+|[:;.]$", comment)[0], 100, placeholder=" ...")


def find_scene_file(name: str) -> Path:
    """File of the scene ``name``."""
    return Path(str(files(__name__) / f"{name}.toml"))


def find_scene_verb(name: str) -> str:
    """The verb of ``trackbed`` that runs the scene ``name``, known by a table only it has."""
    kind = find_scene_kind(tomllib.loads(read_template(name)))
    return kind.verb if kind else "run"
