"""Grains that change places: room in jammed beds, where no smallest move has any.

The beds are those of the reference ensemble (150 grains, 10^9 Pa) after 10,000 computed cycles, the
load at its trough; nothing here was tuned on them.  Asked is a settlement of 120 um by an even
strain, 4 % of a mean radius.
"""

from __future__ import annotations

import numpy as np
import pytest

from adapters.contact_law import HertzStiffness
from adapters.container import Container, Walls
from adapters.errors import UsageError
from adapters.relaxation import RelaxationNotConverged, relax
from adapters.relaxation_rearranged import ENOUGH, HOPS_MAX, OVERLAP_MAX, rearrange
from adapters.state import FloatArray, State
from validation.cases.relaxation import STIFFNESS, state_at_rest
from validation.settlement_ensemble import COARSE
from validation.settlement_ensemble_record import RECORD

GAIN = 120e-6
JAMMED = ((3, 0), (3, 1), (5, 1))
"""Packing and member."""


def bed_of(packing: int, member: int, scale: float = 1.0) -> tuple[State, Container]:
    """The bed after 10,000 cycles, all lengths times ``scale``."""
    with np.load(RECORD / f"coarse-{packing}-{member}.states.npz") as kept:
        state = state_at_rest(scale * kept["position_10000"], scale * kept["radius"])
    container = COARSE.scene(packing).container
    assert container.radius is not None
    return state, Container("cylinder", container.symmetry, radius=scale * container.radius)


def strained(
    state: State, container: Container, gain: float
) -> tuple[FloatArray, Walls, Walls, Walls]:
    """Estimate (n, 3) [m], walls before, and after with the piston lowered, and where it was."""
    height = state.position[:, 2] - state.position[:, 2].min()
    target = state.position.copy()
    target[:, 2] -= gain * height / height.mean()
    top = float((state.position[:, 2] + state.radius).max())
    lowered = top - gain * (top - float(state.position[:, 2].min())) / float(height.mean())
    return target, container.walls(top), container.walls(lowered), container.walls(top)


def stiffness_of(packing: int) -> HertzStiffness:
    return COARSE.scene(packing).stiffness


def settled(before: State, position: FloatArray) -> float:
    return float((before.position - position)[:, 2].mean())


def test_room_where_a_smallest_move_finds_none() -> None:
    """Neither under the lowered piston nor below the old one does a smallest move fit.  Grains that
    change places settle by more than half of what is asked in the mean, and whatever they find has
    no overlap beyond those of before, lies below the piston and inside of the container."""
    got = []
    for packing, member in JAMMED:
        before, container = bed_of(packing, member)
        target, walls, lowered, still = strained(before, container, GAIN)
        for after in (lowered, still):
            with pytest.raises(RelaxationNotConverged):
                relax(target, before, walls, stiffness_of(packing), walls_after=after)
        for seed in range(2):
            generator = np.random.default_rng(seed)
            try:
                found, hops = rearrange(
                    target, before, walls, lowered, stiffness_of(packing), generator
                )
            except RelaxationNotConverged:
                got.append(0.0)
                continue
            assert (found.method, found.converged) == ("rearranged", True)
            assert 0 <= hops <= HOPS_MAX
            x, deep = found.position, OVERLAP_MAX * found.before.max_penetration
            assert found.relaxed.max_penetration <= deep
            assert (x[:, 2] + before.radius).max() <= lowered.plane_point[-1, 2] + deep
            assert (x[:, 2] - before.radius).min() >= -deep
            from_axis = np.hypot(x[:, 0], x[:, 1]) + before.radius
            assert from_axis.max() <= container.radius + deep
            got.append(settled(before, x))
            assert got[-1] > 0
    assert np.mean(got) > GAIN / 2
    assert max(got) >= ENOUGH * GAIN


def test_grains_move_as_far_as_in_a_full_run() -> None:
    """No bed is made anew: the root mean square of the grains' moves stays below a radius, where
    full runs have 0.3 to 0.4 while the cycles double, and the greatest below three diameters."""
    before, container = bed_of(5, 1)
    target, walls, lowered, _ = strained(before, container, GAIN)
    found, _ = rearrange(target, before, walls, lowered, stiffness_of(5), np.random.default_rng(0))
    moves = np.linalg.norm(found.position - before.position, axis=1) / before.radius.mean()
    assert np.sqrt(np.mean(moves**2)) < 1
    assert moves.max() < 6


def test_same_generator_same_bed_another_one_another() -> None:
    before, container = bed_of(3, 1)
    target, walls, lowered, _ = strained(before, container, GAIN)
    beds = [
        rearrange(target, before, walls, lowered, stiffness_of(3), np.random.default_rng(seed))[0]
        for seed in (7, 7, 8)
    ]
    np.testing.assert_array_equal(beds[0].position, beds[1].position)
    assert np.abs(beds[0].position - beds[2].position).max() > 1e-6


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_room_does_not_depend_on_the_unit_of_length(scale: float) -> None:
    """Lengths times c, and gravity over c: weights go as c^2, as Hertz's forces do, so overlaps go
    as c, and the bed is the same bed.  Rounding parts the paths, not what they find."""
    before, container = bed_of(5, 0, scale)
    target, walls, lowered, _ = strained(before, container, scale * GAIN)
    got = []
    for seed in range(3):
        generator = np.random.default_rng(seed)
        found, _ = rearrange(
            target, before, walls, lowered, stiffness_of(5), generator, gravity=9.81 / scale
        )
        assert found.relaxed.max_penetration <= OVERLAP_MAX * found.before.max_penetration
        got.append(settled(before, found.position) / scale)
    assert max(got) >= ENOUGH * GAIN
    assert max(got) < 5 * GAIN


def test_no_room_at_all_is_said() -> None:
    """One grain on the floor under a piston that is to press it by a radius: nothing to hop to, and
    the message names the overlap and what to ask for instead."""
    state = state_at_rest(np.array([[0.05, 0.05, 3e-3]]), np.array([3e-3]))
    box = Container("box", size_x=0.1, size_y=0.1)
    target = state.position - [0.0, 0.0, 1e-3]
    with pytest.raises(RelaxationNotConverged, match="without overlaps in 30 hops") as caught:
        rearrange(
            target, state, box.walls(6e-3), box.walls(3e-3), STIFFNESS, np.random.default_rng(0)
        )
    assert caught.value.remedy is not None
    assert not caught.value.best.converged
    assert np.isfinite(caught.value.best.position).all()


def test_no_bed_is_refused() -> None:
    state = state_at_rest(np.array([[0.05, 0.05, 3e-3]]), np.array([3e-3]))
    walls = Container("box", size_x=0.1, size_y=0.1).walls(6e-3)
    with pytest.raises(UsageError):
        rearrange(np.full((1, 3), np.nan), state, walls, walls, STIFFNESS, np.random.default_rng(0))
