"""Engines, one file each: how a window of load cycles is written, run and judged."""

from adapters.engines.contract import (
    ENGINE_REMEDY,
    Engine,
    EngineRun,
    EngineStart,
    find_engine,
    get_engine,
    interruptible,
    list_real_engines,
)
from adapters.engines.decks import bound_section
from adapters.engines.doctor import findings, has_usable_engine
from adapters.engines.process import run_process

__all__ = [
    "ENGINE_REMEDY", "Engine", "EngineRun", "EngineStart", "bound_section",
    "find_engine", "findings", "get_engine", "has_usable_engine", "interruptible",
    "list_real_engines", "run_process",
]  # fmt: skip
