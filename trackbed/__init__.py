"""trackbed: the command, and the floor that the four stories stand on."""

from importlib import import_module
from typing import Any

__version__ = "0.3.0"
STORIES = {"jump": "adapters.decks", "settle": "adapters.settle"}
"""Word of the interface for Python -> module of the story that has it, loaded at its first use."""


def __getattr__(name: str) -> Any:
    if name not in STORIES:
        raise AttributeError(f"module 'trackbed' has no attribute {name!r}")
    return getattr(import_module(STORIES[name]), name)
