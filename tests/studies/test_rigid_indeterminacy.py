"""Forces of indeterminate grains against stiff springs in time.

Reference: section 8 of Schwager and Poeschel 2002; the springs share no code with `rigid_lcp`.
"""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.unique.elastic_limit import find_elastic_limit
from validation.bench.rigid.static_grains import (
    Grains,
    build_beam,
    build_groove,
    build_pyramid,
    build_wedge,
    renumber,
)
from validation.studies.rigid_indeterminacy.liggghts import settle_liggghts
from validation.studies.rigid_indeterminacy.run import count_redundant, count_sliding, try_order
from validation.studies.rigid_indeterminacy.springs import settle_springs

pytestmark = pytest.mark.studies


def apart(grains: Grains, friction: float, force) -> float:
    """Greatest difference of a force from the direct limit over the weight."""
    answer = find_elastic_limit(grains.problem(friction))
    assert answer.solved
    return float(np.abs(np.ravel(force) - answer.r).max()) / grains.weight


@pytest.mark.parametrize(
    "make", [build_beam, build_wedge, lambda: build_pyramid(4, walls=True, seed=11)]
)
def test_springs_end_in_the_limit_as_they_get_stiffer(make):
    """Without friction, on scenes of each kind: a tenth of the error at ten times the stiffness."""
    grains = make()
    errors = []
    for stiffness in (1e3, 1e4, 1e5):
        rest = settle_springs(grains, stiffness * grains.weight, 0.0, tolerance=1e-9)
        assert rest.imbalance <= 1e-9
        errors.append(apart(grains, 0.0, rest.force))
    assert np.log10(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.1)
    assert np.log10(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.1)
    assert errors[2] < 1e-5


@pytest.mark.parametrize("stiffness", [1e2, 1e5])
def test_springs_on_plane_walls_agree_at_any_stiffness(stiffness):
    """A disc keeps its normals as it sinks into plane walls: only round-off is left."""
    grains = build_groove()
    rest = settle_springs(grains, stiffness * grains.weight, 0.0, tolerance=1e-10)
    assert apart(grains, 0.0, rest.force) < 1e-9


@pytest.mark.parametrize(
    ("make", "friction"), [(build_wedge, 5.0), (lambda: build_pyramid(4, True), 0.3)]
)
def test_with_friction_the_load_must_grow_slowly(make, friction):
    """Gravity at once: contacts slide that hold in the end; slowly: a tenth of the error or less
    than half for each longer loading, until the stiffness is the limit."""
    grains = make()
    error = {
        ramp: apart(grains, friction, settle_springs(
            grains, 1e6 * grains.weight, friction, ramp=ramp, tolerance=1e-8).force)
        for ramp in (0, 1_000, 10_000)
    }  # fmt: skip
    assert error[0] > 1e-2
    assert error[10_000] < 0.5 * error[1_000] or error[1_000] < 1e-6
    assert error[10_000] < 1e-3


def test_springs_are_in_balance_and_obey_coulomb():
    """The peer itself: forces at rest solve the rigid problem to the order of 1 / k."""
    grains = build_pyramid(4, walls=True)
    problem = grains.problem(0.3)
    rest = settle_springs(grains, 1e6 * grains.weight, 0.3, ramp=2_000, tolerance=1e-8)
    assert problem.residual(rest.force.ravel()) < 1e-5
    assert (np.abs(rest.force[:, 1]) <= 0.3 * rest.force[:, 0] * (1 + 1e-12)).all()
    coarse = settle_springs(grains, 1e4 * grains.weight, 0.3, ramp=2_000, tolerance=1e-8)
    assert problem.residual(coarse.force.ravel()) > 10 * problem.residual(rest.force.ravel())


def test_springs_loaded_slowly_lead_to_the_state_reached_from_nothing():
    """Springs and sliders of 55 discs, a third of them sliding: relaxed from where the springs rest
    the forces are those of the direct limit, which begins at none.  (Round-off of the order of
    contacts led it to another state, 9e-3 of the weight apart.)"""
    grains = build_pyramid(10, walls=True)
    problem, stiffness = grains.problem(0.3), 1e7 * grains.weight
    rest = settle_springs(grains, stiffness, 0.3, ramp=10_000, tolerance=1e-6)
    first = find_elastic_limit(problem)
    other = find_elastic_limit(problem, begin=stiffness * rest.displacement)
    assert max(first.residual, other.residual) < 1e-12
    assert np.abs(first.r - other.r).max() < 1e-10 * grains.weight
    assert np.abs(rest.force.ravel() - first.r).max() < 2e-3 * grains.weight


@pytest.mark.engine("liggghts")
def test_liggghts_agrees():
    """Discs without friction between walls: the same errors as the springs, to a tenth."""
    grains = build_pyramid(3, walls=True, seed=5)
    for stiffness in (1e3, 1e5):
        force, imbalance, cpu = settle_liggghts(
            grains, stiffness * grains.weight, 0.0, steps=20_000
        )
        ours = settle_springs(grains, stiffness * grains.weight, 0.0, tolerance=1e-9).force
        assert imbalance < 1e-8
        assert cpu > 0
        error = apart(grains, 0.0, force)
        assert error == pytest.approx(apart(grains, 0.0, ours), rel=0.1)
        assert error < 1 / stiffness


def test_redundancy_and_sliding_are_counted():
    """Beam: 3 forces for 2 equations (none acts sideways); wedge without friction: 4 for 3."""
    for grains, friction, spare in (
        (build_beam(), 0.0, 1),
        (build_wedge(), 0.0, 1),
        (build_groove(), 5.0, 1),
    ):
        problem = grains.problem(friction)
        force = find_elastic_limit(problem).r.reshape(-1, 2)
        assert count_redundant(problem, force) == spare
    assert count_sliding(np.array([[1.0, 0.3], [1.0, 0.2], [0.0, 0.0]]), 0.3) == 1


def test_order_of_contacts_and_bodies_is_no_matter():
    """Piles that slide as well, all to 1e-10; renumbered grains are the same grains."""
    for friction in (0.0, 0.3, 5.0):
        row = try_order(5, friction)
        assert row["found"]
        assert row["order"] < 1e-10
    grains = build_pyramid(3)
    same = renumber(grains, np.arange(len(grains.body_a)), np.arange(len(grains.mass)))
    assert (same.centre == grains.centre).all()
    assert (same.body_a == grains.body_a).all()


def test_what_slides_as_the_load_begins_stays():
    """A disc that sticks in a groove: the error falls as one over the steps of loading, at any
    stiffness."""
    grains = build_groove()
    for stiffness in (1e4, 1e6):
        error = [
            apart(grains, 5.0, settle_springs(grains, stiffness * grains.weight, 5.0, ramp=ramp,
                                            tolerance=1e-8).force)
            for ramp in (300, 3_000)
        ]  # fmt: skip
        assert error[0] / error[1] == pytest.approx(10.0, rel=0.1)
        damped = settle_springs(grains, stiffness * grains.weight, 5.0, ramp=300, tolerance=1e-8,
                              damping=1.4)  # fmt: skip
        assert apart(grains, 5.0, damped.force) < max(1e-2 * error[0], 1 / stiffness)
