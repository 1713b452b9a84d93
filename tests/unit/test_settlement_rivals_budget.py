"""The error budget of a jump and its healing cycles: what is paired, what the tables' sums mean."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from validation.settlement_ensemble import COARSE
from validation.settlement_rivals import FIRST_WINDOW, K_I, Row
from validation.settlement_rivals_budget import EVERY, JUMPS, PLACE, SAME, TWIN
from validation.settlement_rivals_budget_tables import interval_of_pairs
from validation.settlement_rivals_healing import by_healing, slope
from validation.settlement_rivals_reading import between_packings, effect, law_alone

LAST = 500


def place(method: str, member: int, settlement: list[float], **more: Any) -> Row:
    """A row of the budget."""
    window = [1e-4 * np.log(PLACE - 19 + n) for n in range(20)]
    head = {"part": "budget", "method": method, "seed": 1, "member": member, "last": PLACE}
    cycles = [PLACE, PLACE + len(settlement)]
    return head | {"window": window, "settlement": settlement, "cycles": cycles} | more


def test_effects_are_paired_at_the_same_cycles() -> None:
    """A run that ends ten cycles before the other is compared where both are."""
    path = [1e-4 * np.log(PLACE + 1 + n) for n in range(30)]
    rows = [place(EVERY, member, path) for member in (0, 1)]
    rows += [place(TWIN, 0, [u + 2e-6 for u in path[:20]]), place(TWIN, 1, path[:20])]
    ends = effect(rows, TWIN, lambda row: row["settlement"][-1])
    assert ends == pytest.approx([1e-6], rel=1e-9)


def test_jumps_are_beside_another_jump_and_a_refused_one_is_beside_none() -> None:
    """Less the named part, not every cycle; a place where a part was given up counts for none."""
    path = [1e-4] * 10
    rows = [place(EVERY, member, [0.0] * 30) for member in (0, 1)]
    rows += [place(SAME, member, path, refused="") for member in (0, 1)]
    rows.append(place("law: linear", 0, [u + 3e-6 for u in path]))
    lost = place("law: linear", 1, path)
    rows.append({name: lost[name] for name in lost if name != "settlement"} | {"refused": "why"})
    last = effect(rows, "law: linear", lambda row: row["settlement"][-1], SAME)
    assert last == pytest.approx([3e-6], rel=1e-9)


def test_interval_of_another_packing_is_that_of_single_differences() -> None:
    """Packings of deviation 1: P differences of two have the interval t sqrt(2 / P), in the root
    mean square of 2,000 studies, whose own standard error is 1 %."""
    generator = np.random.default_rng(5)
    halves = []
    for _ in range(2000):
        rows = [
            place(EVERY, 0, [value] * 20) | {"seed": seed}
            for seed, value in enumerate(generator.standard_normal(5), 1)
        ]
        apart = between_packings(rows, lambda row: row["settlement"][-1])
        assert len(apart) == 10
        halves.append(interval_of_pairs(apart))
    expected = 2.776 * np.sqrt(2 / 5)
    assert np.sqrt(np.mean(np.square(halves))) == pytest.approx(expected, rel=0.03)


def test_jumps_of_the_budget_differ_in_one_key() -> None:
    """Each is a scene, of the default procedure but for one key."""
    own = COARSE.scene(1).procedure
    assert own is not None
    for part in JUMPS:
        kind = replace(COARSE, settings=(*COARSE.settings, *part.settings))
        changed = kind.scene(1).procedure
        assert changed is not None
        keys = {name for name, value in changed if value != getattr(own, name)}
        assert len(keys) == (part.name != SAME)


# --- healing cycles ------------------------------------------------------------------------------


def test_fewer_healing_cycles_make_longer_jumps_to_the_same_end() -> None:
    """Five jumps: k_i, a window, then h, healing and a window each; nothing else differs."""
    ways = by_healing()
    assert [method.healing for method in ways] == [0, 2, 5, 10] * 2
    for method in ways:
        procedure = method.kind(LAST).scene(1).procedure
        assert procedure is not None
        assert procedure.healing_cycles == method.healing
        block = procedure.jump_cycles(0) + method.healing + FIRST_WINDOW
        assert K_I + FIRST_WINDOW + 5 * block == LAST


def test_slope_behind_a_jump_is_that_of_the_logarithm() -> None:
    """u = a ln N has the slope a in any cycles but for the gain's own 1 / 2 N."""
    gains = 3e-6 * np.log((201 + np.arange(10)) / (200 + np.arange(10)))
    found = slope({"last": 200, "after": {"settlement": gains.tolist()}}, (6, 10))
    assert found == pytest.approx(3e-6, rel=3e-3)
    assert np.isnan(slope({"last": 200, "after": {"settlement": [1.0]}}, (6, 10)))


def test_a_law_that_holds_misses_nothing() -> None:
    """Window and cycles behind on one log curve: what the law adds is what came."""
    path = [1e-4 * np.log(PLACE + 1 + n) for n in range(30)]
    steeper = [path[0] + 2 * (u - path[0]) for u in path]
    missed = [law_alone([place(EVERY, 0, settlement)])[0] for settlement in (path, steeper)]
    assert missed[0] == pytest.approx(0, abs=1e-12)
    assert missed[1] < -1e-6
