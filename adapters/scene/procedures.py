"""Procedures with names: what a scene does not say in ``[procedure]`` follows from the name and
``total_cycles``.

``paper``
    Karrech et al. (2007), Fig. 10: every grain by its own law, fitted to the last k cycles, jumps
    of one length.  Overlaps go by the smallest move: eq. 29 as printed
    (``relaxation = "karrech2007"``) may move a bed by millimetres.
``growing``
    Jumps whose ends are evenly spaced in ln N, by all cycles computed so far, every grain with its
    neighbours: the best fixed schedule of docs/settlement.md, and the default.
``tolerance``
    Jumps that choose themselves by their error (docs/jumps.md).

A bed settles by about the same in equal steps of ln N.  Of equal jumps the first is asked for most
of the settlement, when least of the bed is known; jumps whose ends are evenly spaced in ln N are
each asked for about as much.  docs/jumps.md.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import ceil, log
from typing import Any

import numpy as np

DEFAULT = "growing"
BY_HAND = ("k", "h", "tolerance")
"""Keys of a procedure without a name."""


@dataclass(frozen=True)
class NamedNumbers:
    """What the schedules of docs/settlement.md have in common."""

    first: int = 50  # cycles k_i at the start, at most a quarter of all
    window: int = 10  # cycles k of a growing schedule's window
    healing: int = 5  # cycles behind a jump, as in every scene that does not say otherwise
    ratio: float = 1.55
    """Greatest ratio of N at the ends of neighbouring windows [-]: five jumps from 60 to 500."""
    paper_window: int = 20  # cycles k of the paper's window, and
    paper_jump: int = 60  # its h
    tolerance: float = 0.02  # error of a jump's gain over the total settlement [-]


NUMBERS = NamedNumbers()


def schedule_jumps(jumps: int, last: int, k_i: int, window: int, healing: int) -> list[int]:
    """Cycles h of each of so many jumps, that the last window ends at cycle ``last``.

    From k_i a ``window``; behind each jump ``healing`` cycles and a window.  Ends of windows are
    evenly spaced in ln N.  ValueError where the first jump is of no cycle.
    """
    ends = np.rint(np.geomspace(k_i + window, max(last, 1), jumps + 1)).astype(int)
    lengths = np.diff(ends) - healing - window
    if lengths.min() < 1:
        raise ValueError(f"{jumps} jumps to cycle {last} begin with one of no cycle")
    return [int(h) for h in lengths]


def plan_growing(given: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of ``growing``: the fewest jumps within `NamedNumbers.ratio`, fewer without room.

    Beside windows and healing cycles that are ``given``, jumps are as long as these leave them.
    """
    first, total = given["k_i"], given["total_cycles"]
    k, healing = (
        given[key] if type(given.get(key)) is int and given[key] > 0 else usual
        for key, usual in (("k", NUMBERS.window), ("healing_cycles", NUMBERS.healing))
    )
    wanted = ceil(log(max(total / (first + k), 1.0)) / log(NUMBERS.ratio))
    h = [max(total, 1)]  # no jump fits: a warning of the run says so
    for jumps in range(wanted, 0, -1):
        with suppress(ValueError):
            h = schedule_jumps(jumps, total, first, k, healing)
            break
    return {"k": k, "h": h, "settlement": "history", "move": "smoothed", "seating": "waits"}


PROCEDURES: Mapping[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
    "paper": lambda _: {
        "k": NUMBERS.paper_window, "h": NUMBERS.paper_jump, "law": "log", "move": "per-grain",
    },
    "growing": plan_growing,
    "tolerance": lambda _: {"tolerance": NUMBERS.tolerance, "seating": "waits"},
}  # fmt: skip
"""Keys of each name, for the keys that are given, k_i and total_cycles among them."""


def fill_procedure(procedure: Mapping[str, Any]) -> dict[str, Any]:
    """The table ``[procedure]`` with the keys of its name, those that it has as they are.

    Without a name, and without the keys of one by hand, it is `DEFAULT`; a tolerance alone is
    ``tolerance``.  What is not valid in it is left for the checks of the scene.
    """
    name = procedure.get("name")
    if name is None and not {*BY_HAND} & {*procedure}:
        name = DEFAULT
    elif name is None and "tolerance" in procedure and "k_i" not in procedure:
        name = "tolerance"
    if not isinstance(name, str) or name not in PROCEDURES:
        return dict(procedure)
    total = procedure.get("total_cycles")
    total = total if type(total) is int and total > 0 else 4 * NUMBERS.first  # is refused later
    first = procedure.get("k_i")
    first = first if type(first) is int and first > 0 else min(NUMBERS.first, max(total // 4, 1))
    keys = PROCEDURES[name]({**procedure, "k_i": first, "total_cycles": total})
    return {"name": name, "k_i": first, **keys, **procedure}
