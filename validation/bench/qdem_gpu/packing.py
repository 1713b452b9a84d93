"""A packing of grains on a GPU: seconds of a step with contact, and of a look for pairs.

The packing is `validation.bench.qdem.grains`'s.  Wall time: the processor waits for the GPU.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

import numpy as np

import qdem_fem as q
from qdem_fem.contact.sphere_state import SphereContacts
from validation.bench.qdem.grains import FRICTION, GRAIN, RADIUS, STIFFNESS, lay_lattice
from validation.bench.qdem_gpu.search import compare_lists
from validation.case import Check

NEAR = 0.95
"""Distance of neighbours over their diameter."""
LISTS = "first", "second", "back_first", "back_pair", "acting"
"""Of `Pairs`; forces are the processor's to round-off only."""
STEP = 1e-8
"""[s], in which nothing moves far"""


def build_packing(side: int, device: Literal["cpu", "cuda"]) -> tuple[q.Simulation, SphereContacts]:
    """``side**3`` grains, each of which touches its neighbours."""
    contact = q.SphereContact(RADIUS, STIFFNESS, FRICTION)
    bodies = lay_lattice(side, 2 * NEAR * (GRAIN + RADIUS))
    run = q.Simulation(bodies, threads=1, step=STEP, device=device, contact=contact)
    assert isinstance(run.contacts, SphereContacts)
    return run, run.contacts


def time_action(action: Callable[[], object], repeats: int) -> float:
    """Median wall time of an action that has been done once before [s]."""
    action()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds))


def check_packing(side: int, steps: int = 200, repeats: int = 5) -> list[Check]:
    """Milliseconds of a step and of a look for pairs; the first list against the processor's."""
    _, expected = build_packing(side, "cpu")
    run, contacts = build_packing(side, "cuda")
    for each in (expected, contacts):
        each.refresh()
    apart = [name for name in compare_lists(expected.pairs, contacts.pairs) if name in LISTS]
    pairs = len(contacts.pairs.second)
    step = time_action(lambda: run.advance(steps * run.step, sampling=1.0), repeats) / steps
    look = time_action(contacts.find_pairs, repeats)
    name = f"GPU, packing of {side**3:,} grains, {len(contacts.nodes):,} spheres"
    return [
        Check(
            f"{name}, {pairs:,} pairs: lists unlike the processor's", len(apart), "<= 0", not apart
        ),
        Check(f"{name}: a step", 1e3 * step, "finite", bool(np.isfinite(step)), "ms"),
        Check(f"{name}: a look for pairs", 1e3 * look, "finite", bool(np.isfinite(look)), "ms"),
    ]
