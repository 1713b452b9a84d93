"""Motions with a closed form: a disc that skids and rolls, a rod over an edge, a rocking block."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rigid_lcp import Simulation
from rigid_lcp.scene.simulation import Method
from tests import rigid_motions as motions


def coordinates(run: Simulation) -> NDArray[np.float64]:
    """Place [m] and angle [rad] of body 0."""
    return np.append(run.positions[0], run.angles[0])


def test_disc_skids_and_rolls() -> None:
    """Constant accelerations, and the change from one to the other is met: exact at any step."""
    run = motions.skidding_disc("acceleration", 0.05)
    run.advance(0.5)
    assert coordinates(run) == pytest.approx(motions.skidding_disc_answer(0.5), abs=1e-13)
    assert run.contacts.status.tolist() == ["stick"]


@pytest.mark.parametrize(("method", "step"), [("acceleration", 0.0125), ("time-stepping", 4e-3)])
def test_rod_tips_over_the_edge_and_slides(method: Method, step: float) -> None:
    """Sticks, then slides: both methods come to what two equations of motion say."""
    run = motions.rod_over_edge(method, step)
    run.advance(0.3)
    assert run.contacts.status.tolist() == ["slide"]
    # where it starts to slide is not met: the step that holds it is of second order
    assert coordinates(run) == pytest.approx(motions.rod_over_edge_answer(0.3), abs=2e-5)


@pytest.mark.parametrize("friction", [0.0, motions.ORBIT_FRICTION])
def test_a_disc_goes_round_another_at_one_speed(friction: float) -> None:
    """Sliding without friction or rolling, a tenth of a round at 1 m/s: gap and speed are kept."""
    run = motions.orbiting_disc("acceleration", 0.02, friction)
    run.advance(0.1 * 2 * np.pi * sum(motions.ORBIT_RADII))
    distance = float(np.linalg.norm(run.positions[0]))
    assert distance == pytest.approx(sum(motions.ORBIT_RADII), abs=1e-13)
    # the fourth power of the step
    assert float(np.linalg.norm(run.velocities[0])) == pytest.approx(1.0, abs=1e-6)
