"""Engines, one file each: how a window of load cycles is written, run and judged."""

from adapters.engines.contract import (
    ENGINE_REMEDY,
    Engine,
    EngineRun,
    EngineStart,
    allow_interrupts,
    find_engine,
    get_engine,
    list_real_engines,
)
from adapters.engines.crib import find_crib_forces
from adapters.engines.decks import bound_section, copy_deck
from adapters.engines.doctor import has_usable_engine, list_findings
from adapters.engines.plan import plan_settling
from adapters.engines.process import run_process

__all__ = [
    "ENGINE_REMEDY", "Engine", "EngineRun", "EngineStart", "allow_interrupts", "bound_section",
    "copy_deck", "find_crib_forces", "find_engine", "get_engine", "has_usable_engine",
    "list_findings", "list_real_engines", "plan_settling", "run_process",
]  # fmt: skip
