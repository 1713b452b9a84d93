"""Procedures with names: what a scene does not say in ``[procedure]`` follows from the name and
``total_cycles``.

``paper``
    Karrech et al. (2007), Fig. 10: every grain by its own law, fitted to the last k cycles, jumps
    of one length.  Overlaps go by the smallest move: eq. 29 as printed
    (``relaxation = "karrech2007"``) may move a bed by millimetres.
``growing``
    Jumps whose ends are evenly spaced in ln N, by all cycles computed so far, moved by a profile of
    settlement by height: the best fixed schedule of docs/settlement.md, and the default.
``tolerance``
    Jumps that choose themselves by their error (docs/jumps.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, log
from typing import Any

from adapters.jumps import schedule_jumps

DEFAULT = "growing"
BY_HAND = ("k", "h", "tolerance")
"""Keys of a procedure without a name."""


@dataclass(frozen=True)
class NamedNumbers:
    """What the schedules of docs/settlement.md have in common."""

    first: int = 50  # cycles k_i at the start, at most a quarter of all
    window: int = 10  # cycles k of a growing schedule's window
    healing: int = 5  # cycles behind a jump that are kept out of the fit
    ratio: float = 1.55
    """Greatest ratio of N at the ends of neighbouring windows [-]: five jumps from 60 to 500."""
    paper_window: int = 20  # cycles k of the paper's window, and
    paper_jump: int = 60  # its h
    tolerance: float = 0.02  # error of a jump's gain over the total settlement [-]


NUMBERS = NamedNumbers()


def plan_paper(first: int, total: int) -> dict[str, Any]:
    """Keys of ``paper``."""
    return {"k": NUMBERS.paper_window, "h": NUMBERS.paper_jump, "law": "log", "move": "per-grain"}


def plan_growing(first: int, total: int) -> dict[str, Any]:
    """Keys of ``growing``: the fewest jumps within `NamedNumbers.ratio`, fewer without room."""
    k, healing = NUMBERS.window, NUMBERS.healing
    wanted = ceil(log(max(total / (first + k), 1.0)) / log(NUMBERS.ratio))
    h = [max(total, 1)]  # no jump fits: a warning of the run says so
    for jumps in range(wanted, 0, -1):
        try:
            h = schedule_jumps(jumps, total, first, k, healing)
            break
        except ValueError:
            continue
    return {"k": k, "h": h, "settlement": "history", "move": "profile", "seating": "waits"}


def plan_tolerance(first: int, total: int) -> dict[str, Any]:
    """Keys of ``tolerance``."""
    return {"tolerance": NUMBERS.tolerance, "seating": "waits"}


PROCEDURES: Mapping[str, Callable[[int, int], dict[str, Any]]] = {
    "paper": plan_paper, "growing": plan_growing, "tolerance": plan_tolerance,
}  # fmt: skip


def fill_procedure(procedure: Mapping[str, Any]) -> dict[str, Any]:
    """The table ``[procedure]`` with the keys of its name, those that it has as they are.

    Without a name, and without the keys of one by hand, it is `DEFAULT`.  What is not valid in it
    is left for the checks of the scene.
    """
    name = procedure.get("name", None if {*BY_HAND} & {*procedure} else DEFAULT)
    total = procedure.get("total_cycles")
    if name not in PROCEDURES or type(total) is not int:
        return dict(procedure)
    first = procedure.get("k_i", min(NUMBERS.first, max(total // 4, 1)))
    if type(first) is not int or first < 1:
        return dict(procedure)
    return {"name": name, "k_i": first, **PROCEDURES[name](first, total), **procedure}
