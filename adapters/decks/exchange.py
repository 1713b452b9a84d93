"""Grains that a deck's own cycles delete, make and wear: counted, and told from lost ones.

A grain keeps its identifier as long as it is there, and no other has it later.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.decks.engine import Adopted
from adapters.errors import NotCredible

WORN = 0.1
"""Greatest share of its mass that one grain gains or loses in a cycle [-]: wear takes 1e-6 to 1e-3,
and a fragment has at most half of what broke."""
DELETED = re.compile(r"^Deleted (\d+) atoms", re.MULTILINE)
"""What LIGGGHTS and LAMMPS say of ``delete_atoms``."""
DELETING = re.compile(
    r"fix \S+ \S+ (?:remove|evaporate|multisphere/break|massflow/mesh\S* .*\bdelete_atoms yes)"
    r"|(?s:.*)\.erase\("
)
"""Commands, and statements of a script, that take grains away and do not say how many."""


def count_exchange(mass: FloatArray) -> FloatArray:
    """Of each cycle grains that came, their mass [kg], grains that went, their mass [kg], and the
    mass that the others lost [kg], shape (c - 1, 5).

    ``mass``: masses at c cycle ends [kg], shape (c, n), nan where a grain is not there.
    """
    before, after = mass[:-1], mass[1:]
    came, went = (np.isnan(a) & ~np.isnan(b) for a, b in ((before, after), (after, before)))
    parts = (came, np.where(came, after, 0.0), went, np.where(went, before, 0.0), before - after)
    return np.column_stack([np.nansum(one, axis=1) for one in parts])


def refuse_strangers(identifier: IntArray, mass: FloatArray, first: int, folder: Path) -> None:
    """Raise `NotCredible` where an ``identifier`` (n,) is that of another grain later on.

    ``mass``: as `count_exchange`; the first end is that of cycle ``first`` in this window.
    """
    came = np.diff(np.isfinite(mass).astype(int), axis=0, prepend=0) == 1
    other = came & (came.cumsum(axis=0) > 1)
    other[1:] |= abs(np.diff(mass, axis=0)) > WORN * mass[:-1]
    if other.any():
        cycle, row = np.argwhere(other)[0]
        raise NotCredible(
            f"grain {identifier[row]} is another one at the end of cycle {first + cycle} of this "
            f"window: it has {mass[cycle, row]:.3g} kg", where=str(folder),
            remedy="make new grains before old ones are deleted, these with 'compress no', so that "
            "no identifier is used again; a grain wears by a tenth in a cycle at most",
        )  # fmt: skip


def refuse_losses(exchange: FloatArray, bed: Adopted, folder: Path) -> None:
    """Raise `NotCredible` where more grains went than the deck deletes: they left the box.

    ``exchange``: rows of `count_exchange`, (c, 5).
    """
    went, mass = exchange[:, 2].sum(), exchange[:, 3].sum()
    screen = folder / "screen.txt"
    said = screen.read_text(errors="replace") if went and screen.exists() else ""
    deleted = sum(map(int, DELETED.findall(said)))
    if went > deleted and not any(DELETING.match(one.plain) for one in bed.deck.commands):
        raise NotCredible(
            f"{went:.0f} grains of {mass:.3g} kg went in this window, and the deck deletes "
            f"{deleted}: the others were lost", where=str(folder),
            remedy="thermo_modify lost error; look where they leave the box",
        )  # fmt: skip
