"""Grains that a user's deck deletes, makes and wears, and those that are lost."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy import nan

import trackbed
from adapters.decks.exchange import count_exchange, refuse_losses, refuse_strangers
from adapters.decks.parse import read_deck
from adapters.decks.run import make_row
from adapters.decks.states import States
from adapters.errors import NotCredible
from tests.unit.test_own_decks import cut, write_deck


def test_what_came_went_and_wore_is_counted() -> None:
    """A grain of 4 kg becomes two of 1 kg, another loses 0.25 kg; then all stays."""
    mass = np.array([[4, 3, nan, nan], [nan, 2.75, 1, 1], [nan, 2.75, 1, 1]])
    assert count_exchange(mass).tolist() == [[2, 2, 1, 4, 0.25], [0, 0, 0, 0, 0]]


@pytest.mark.parametrize("mass", [[1.0, 1.0, 0.89], [1.0, 1.0, 1.11], [1.0, nan, 1.0]])
def test_an_identifier_that_is_used_again_is_named(mass: list[float]) -> None:
    """By a fragment, by a larger grain, behind a cycle without it."""
    with pytest.raises(NotCredible, match="grain 7 is another one"):
        refuse_strangers(np.array([3, 7]), np.column_stack([np.ones(3), mass]), Path())


@pytest.mark.parametrize(("cycle", "deleted", "said"), [
    ("delete_atoms group g compress no", 2, ""), ("delete_atoms group g compress no", 1, "lost"),
    ("fix e all evaporate 10 1 all 5", 0, ""), ("run 1", 0, "2 grains of 0.75 kg went"),
])  # fmt: skip
def test_what_nothing_deleted_is_lost(cycle: str, deleted: int, said: str, tmp_path: Path) -> None:
    bed: Any = SimpleNamespace(deck=read_deck(write_deck(tmp_path, cut("", cycle))))
    (tmp_path / "screen.txt").write_text(f"\nDeleted {deleted} atoms, new total = 8\n")
    with pytest.raises(NotCredible, match=said) if said else nullcontext():
        refuse_losses(np.array([[0, 0, 1, 0.5, 0], [1, 0.1, 1, 0.25, 0]]), bed, tmp_path)


def test_a_new_grain_goes_with_its_neighbours() -> None:
    """Where all settle by a ln N so does a fragment, whenever it came and wherever it fell before;
    settlement goes on from before the window, of those there all through it."""
    start = np.random.default_rng(1).uniform(0, 1, (50, 3))
    settled = np.log(np.arange(1.0, 7.0))[:, None, None] * np.array([0.0, 0.0, -1e-3])
    states = start + settled
    states[3:5, 0, 2] += 0.1  # still falls
    states[:3, 0] = states[:5, 1] = nan
    after = trackbed.jump(states, 6, 0.02, move="per-grain", first_cycle=1)
    assert np.allclose(after, start + settled[-1] + settled[1], rtol=0, atol=1e-14)
    states[3, 2, 2], states[5, 2] = 7.0, nan
    bed = States(np.arange(50), np.ones(50), np.ones(50), states, 0 * states, np.full(6, nan),
                 np.ones((1, 7)), exchange=np.zeros((5, 5)))  # fmt: skip
    sunk = make_row(3, 10, 0, bed, 0.5, nan)["settlement"]
    assert sunk == pytest.approx(0.5 + 1e-3 * np.log(4), abs=1e-15)
