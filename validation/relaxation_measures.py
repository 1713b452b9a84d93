"""What a relaxation left of a bed: overlaps, contacts, heights, and the way of its grains."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.overlaps import Neighbours, bed_measure
from adapters.state import FloatArray, IntArray
from validation.relaxation_jumps import Jumped


def pair_keys(rows: Neighbours) -> IntArray:
    """One number for each row, a wall's among them: the same for the same contact."""
    return np.asarray((rows.first << 32) + (rows.second & 0xFFFFFFFF))


def measured(jump: Jumped, position: FloatArray) -> dict[str, Any]:
    """Figures of relaxed centres ``position`` [m], (n, 3), of a jump; SI units.

    ``kept`` is the share of the contacts before the jump, walls included, that are contacts now:
    only these can keep a tangential spring.  ``height`` is the mean height less the estimate's.
    """
    carried = jump.around_before.search(jump.before.position, 0.0)
    before = bed_measure(jump.before.position, carried)
    touching = jump.around.search(position, 0.0)
    now = bed_measure(position, touching)
    move = np.linalg.norm(position - jump.estimate, axis=1)
    same = np.isin(pair_keys(carried), pair_keys(touching))
    return {
        "overlap": now.max_penetration,
        "overlap_mean": now.mean_penetration,
        "coordination": now.coordination_with_walls,
        "coordination_error": now.coordination_with_walls / before.coordination_with_walls - 1,
        "kept": float(same.mean()),
        "height": now.mean_height - float(jump.estimate[:, 2].mean()),
        "move_median": float(np.median(move)),
        "move_rms": float(np.sqrt(np.mean(move**2))),
        "move_greatest": float(move.max()),
    }


def figures_before(jump: Jumped) -> dict[str, Any]:
    """The same of the bed before the jump, with the settlement that the jump is to make [m]."""
    carried = jump.around_before.search(jump.before.position, 0.0)
    before = bed_measure(jump.before.position, carried)
    drop = float(np.mean(jump.before.position[:, 2] - jump.estimate[:, 2]))
    return {
        "overlap": before.max_penetration,
        "overlap_mean": before.mean_penetration,
        "coordination": before.coordination_with_walls,
        "settlement": drop,
    }
