"""Rules for the tangential force: energies of closed loops, and the contact with micro-slip."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.bed import contact_law as law
from adapters.bed.state import FloatArray
from tests.tangential_rules import (
    LOOPS,
    force_incremental,
    force_mindlin_deresiewicz,
    force_rescaled,
    force_secant,
    path,
    work,
)

MODULUS, SHEAR, RADIUS = 25e9, 5.36e9, 1.6e-3
"""E* and G* [Pa] and R* [m] of two grains of Table 1."""

FORWARD, BACKWARD, TOGETHER = LOOPS.values()

low_share = st.floats(0.05, 0.9)
displacements = st.floats(1e-9, 1e-6)


def loop_of(
    corners: FloatArray, low: float, displacement: float, loops: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Overlaps between ``low`` and 1 um, and tangential displacements [m], of repeated loops."""
    one = path([low * 1e-6, 0.0] + corners * [(1 - low) * 1e-6, displacement], 50)
    overlap, slip = np.concatenate([one[:1], *[one[1:]] * loops]).T
    return overlap, slip


@settings(max_examples=30, deadline=None)
@given(low=low_share, displacement=displacements)
def test_energy_of_loops_in_closed_form(low: float, displacement: float) -> None:
    """(k_t1 - k_t0) delta_t^2/2 is lost or created around the loop, by every rule; by hand.

    Eq. 6 takes up k delta_t^2/2 at one stiffness and gives it back at the other: lost one way,
    created the other.  Increments alone: the reverse.  The paper's rule loses it both ways.
    """
    stiffness = law.tangential_stiffness(np.array([low * 1e-6, 1e-6]), SHEAR, RADIUS)
    unit = (stiffness[1] - stiffness[0]) * displacement**2 / 2
    expected = {force_secant: (1, -1), force_incremental: (-1, 1), force_rescaled: (1, 1)}
    for rule, signs in expected.items():
        for corners, sign in zip((FORWARD, BACKWARD), signs, strict=True):
            overlap, slip = loop_of(corners, low, displacement)
            lost = work(rule(law.tangential_stiffness(overlap, SHEAR, RADIUS), slip), slip)
            assert lost == pytest.approx(sign * unit, rel=1e-9)


@settings(max_examples=15, deadline=None)
@given(low=low_share, displacement=displacements)
def test_the_papers_rule_never_creates_energy(low: float, displacement: float) -> None:
    """F_t^2/(2 k_t) falls by every change of k_t, either way, so a loop loses energy.

    Counted with what stays in the spring, over loops repeated until they are steady.
    """
    for corners in LOOPS.values():
        overlap, slip = loop_of(corners, low, displacement, loops=20)
        stiffness = law.tangential_stiffness(overlap, SHEAR, RADIUS)
        force = force_rescaled(stiffness, slip)
        taken = [work(force[: i + 1], slip[: i + 1]) for i in range(0, len(slip), 25)]
        stored = (force**2 / (2 * stiffness))[::25]
        assert np.diff(taken - stored).min() >= -1e-9 * stored.max()


def test_increments_alone_ratchet() -> None:
    """Without a rule the force grows by (k_t1 - k_t0) delta_t a loop: the energy is fictive."""
    overlap, slip = loop_of(FORWARD, 0.4, 1e-7, loops=5)
    stiffness = law.tangential_stiffness(overlap, SHEAR, RADIUS)
    ends = force_incremental(stiffness, slip)[:: (len(slip) - 1) // 5]
    assert np.diff(ends) == pytest.approx((stiffness.max() - stiffness.min()) * 1e-7, rel=1e-9)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_micro_slip_is_cattaneo_and_mindlin(share: float) -> None:
    """Sheared under constant F_n: delta_t = 3 mu F_n/(16 G* a) (1 - (1 - F_t/(mu F_n))^(2/3)).

    Cattaneo (1938), Mindlin (1949); a = sqrt(R* delta_n).  2,000 springs: within 1e-3.
    """
    friction, overlap = 0.5, 1e-6
    normal = float(law.normal_force(overlap, MODULUS, RADIUS))
    reach = 3 * friction * normal / (16 * SHEAR * sqrt(RADIUS * overlap))
    slip = reach * (1 - (1 - share) ** (2 / 3)) * np.linspace(0, 1, 20)
    force = force_mindlin_deresiewicz(np.full(20, overlap), slip, MODULUS, SHEAR, RADIUS, friction)
    assert force[-1] == pytest.approx(share * friction * normal, rel=1e-3)


def test_no_micro_slip_is_the_integral_of_stiffness() -> None:
    """Bonded and loaded together: F_t is the integral of k_t d delta_t, and gives all back.

    Eq. 6 holds more at the top, k_t1 delta_t, but also gives all back.
    """
    overlap, slip = loop_of(TOGETHER, 0.4, 1e-7)
    stiffness = law.tangential_stiffness(overlap, SHEAR, RADIUS)
    real = force_mindlin_deresiewicz(overlap, slip, MODULUS, SHEAR, RADIUS, inf)
    steps = force_incremental(stiffness, slip)
    assert real == pytest.approx(steps, rel=5e-3, abs=5e-3 * steps.max())
    top = int(np.argmax(slip))
    assert force_secant(stiffness, slip)[top] > 1.1 * real[top]
    assert abs(work(real, slip)) < 1e-3 * work(real[: top + 1], slip[: top + 1])


@settings(max_examples=20, deadline=None)
@given(
    corners=st.lists(st.tuples(st.floats(0.05, 1), st.floats(-1, 1)), min_size=1, max_size=6),
    friction=st.sampled_from([0.2, 0.5, inf]),
)
def test_micro_slip_never_creates_energy(
    corners: list[tuple[float, float]], friction: float
) -> None:
    """A contact of springs and friction swallows energy around every closed path."""
    turns = np.array([(0.5, 0.0), *corners, (0.5, 0.0)]) * [1e-6, 2e-7]
    overlap, slip = path(turns, 40).T
    once = np.concatenate([overlap, overlap[1:]]), np.concatenate([slip, slip[1:]])
    force = force_mindlin_deresiewicz(*once, MODULUS, SHEAR, RADIUS, friction, springs=300)
    second = slice(len(slip) - 1, None)
    scale = float(np.abs(force).max()) * 2e-7
    assert work(force[second], once[1][second]) >= -5e-3 * scale
