"""Grains that a deck's own cycles delete, make and wear: counted; and those that are lost."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.decks.engine import Adopted
from adapters.errors import NotCredible
from adapters.files import EXCHANGE, Outcome

WORN = 0.1
"""Greatest change of the mass of a grain in a cycle, over it [-]; fragments have half at most."""
DELETED = re.compile(r"^Deleted (\d+) atoms", re.MULTILINE)
"""What LIGGGHTS and LAMMPS say of ``delete_atoms``."""
DELETING = re.compile(
    r"(?s)fix \S+ \S+ (remove|evaporate|multisphere/break|massflow.* delete_atoms yes)|.*\.erase\("
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


def describe_exchange(outcomes: Sequence[Outcome]) -> str:
    """Grains that came, went and wore in the computed cycles of a user's deck; empty for none."""
    rows = [row for one in outcomes for row in one.rows]
    came, new, went, gone, worn = (sum(row.get(key) or 0 for row in rows) for key in EXCHANGE)
    said = f", in which {came:.0f} grains of {new:.3g} kg came, {went:.0f} of {gone:.3g} kg went, "
    said += f"{worn:.3g} kg wore off; the mean is of grains there all through a window"
    return said if came or went or worn else ""


def refuse_strangers(identifier: IntArray, mass: FloatArray, folder: Path) -> None:
    """Raise `NotCredible` where an ``identifier`` (n,) is another grain's later; masses (c, n)."""
    came = np.diff(np.isfinite(mass).astype(int), axis=0, prepend=0) == 1
    other = came & (came.cumsum(axis=0) > 1)
    other[1:] |= abs(np.diff(mass, axis=0)) > WORN * mass[:-1]
    if other.any():
        raise NotCredible(
            f"later on, grain {identifier[other.any(axis=0)][0]} is another one", where=str(folder),
            remedy="make new grains before you delete old ones, with 'compress no', so that none "
            f"has the identifier of another; a grain may wear by {WORN:.0%} in a cycle",
        )  # fmt: skip


def refuse_losses(exchange: FloatArray, bed: Adopted, folder: Path) -> None:
    """Raise `NotCredible` where more grains went than the deck deletes, by `count_exchange`."""
    went, mass = exchange[:, 2:4].sum(axis=0)
    said = (folder / "screen.txt").read_text(errors="replace") if went else ""
    silent = any(DELETING.match(one.plain) for one in bed.deck.commands)
    if went > (deleted := sum(map(int, DELETED.findall(said)))) and not silent:
        raise NotCredible(
            f"{went:.0f} grains of {mass:.3g} kg went in this window, and the deck deletes "
            f"{deleted}: the others were lost", where=str(folder),
            remedy="thermo_modify lost error; look where they leave the box",
        )  # fmt: skip
