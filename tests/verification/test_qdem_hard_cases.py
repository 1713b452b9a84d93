"""Hard cases of QDEM in their smallest forms, and proof that their checks can fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.errors import ElementInverted, StepWarning, Unstable
from qdem_fem.mesh import mesh_read
from validation import qdem_hard_bodies, qdem_hard_materials, qdem_hard_shapes, qdem_hard_steps
from validation.case import Check
from validation.qdem_hard_meshes import box_graded, box_with_sliver, longest_edges
from validation.qdem_hard_size import large_body_checks
from validation.qdem_problem import cantilever

JUMPS = [(name, where) for name in ("young", "density") for where in ("tip half", "core", "random")]


def hold(checks: list[Check]) -> None:
    """All of them, or say which do not."""
    failing = [f"{check.name}: {check.value:.4g}, bar {check.bar}" for check in checks]
    assert all(check.holds for check in checks), "\n".join(failing)


def failing(checks: list[Check]) -> list[str]:
    """Names of the checks that do not hold."""
    return [check.name for check in checks if not check.holds]


# --- shapes ----------------------------------------------------------------------------------


def test_a_sliver_changes_nothing_but_the_step() -> None:
    """Altitude 0.004 of the longest edge: K u = f, 2/omega, the motion; named and warned of."""
    hold(qdem_hard_shapes.sliver_checks())


def test_sizes_from_1_to_1000() -> None:
    """K u = f and 2/omega; the small elements can be made 20,000 times heavier for nothing."""
    checks = qdem_hard_shapes.graded_checks(cells=9)
    hold(checks)
    added = [check.value for check in checks if "mass added" in check.name]
    assert 0 < max(added) < 0.01


def test_graded_box_fills_the_cube_and_turns_no_element() -> None:
    nodes, elements = box_graded(100.0, 6)
    volume = np.linalg.det(nodes[elements[:, 1:]] - nodes[elements[:, :1]]) / 6
    assert (volume > 0).all()
    assert volume.sum() == pytest.approx(1.0, rel=1e-12)
    edges = longest_edges(nodes, elements)
    assert edges.min() == pytest.approx(np.sqrt(3) / 100, rel=1e-12)


def test_static_check_sees_another_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """One node moved by a hundredth of a cell: not the same mesh, and the check says so."""
    right = qdem_hard_shapes.relaxed

    def relaxed(problem: Any, tolerance: float) -> Any:
        nodes = problem.mesh.nodes.copy()
        nodes[len(nodes) // 2] += 0.0025
        other = replace(problem, mesh=mesh_read((nodes, problem.mesh.elements)))
        return replace(right(other, tolerance), problem=problem)

    monkeypatch.setattr(qdem_hard_shapes, "relaxed", relaxed)
    problem = qdem_hard_shapes.sliver_problem(1.0)
    assert len(failing(qdem_hard_shapes.static_checks("moved", problem))) == 2


# --- materials -------------------------------------------------------------------------------


def test_locking_is_that_of_linear_tetrahedra() -> None:
    """Against K u = f on the same mesh, and against quadratic tetrahedra: Kuhn's cells lock."""
    hold(qdem_hard_materials.locking_checks(((12, 2, 2),), (12, 2, 2)))


@pytest.mark.parametrize(("name", "where"), JUMPS)
def test_jumps_of_a_thousand(name: Any, where: Any) -> None:
    """K u = f, 2/omega, the motion, and 0.99 of the critical step."""
    hold(qdem_hard_materials.jump_checks(name, where, (6, 2, 2), 4000))


# --- steps -----------------------------------------------------------------------------------


@pytest.mark.long
def test_steps_near_the_critical_one() -> None:
    """H <= E <= H/(1 - s^2) at s = 0.99 and at the reported value; 1.01 is stopped."""
    hold(qdem_hard_steps.near_critical_checks(20_000))


def test_a_step_above_the_critical_one_is_named_with_its_element() -> None:
    """Far above, under a load, from rest: the message gives ratio, steps, element and remedy."""
    problem = cantilever((12, 2, 2))
    critical = problem.simulation()[1].critical_step
    body, run = problem.simulation(amplitude=1.0, step=1.05 * critical.value)
    named = f"element {critical.element} of {body.name}"
    with pytest.warns(StepWarning, match=named), pytest.raises(Unstable, match=named) as raised:
        run.advance(5000 * run.step)
    text = str(raised.value)
    assert "1.050 times the critical one" in text
    assert "safety 0.9" in text
    assert raised.value.exit_code == 6


def test_the_bound_on_the_energy_is_broken_above_the_critical_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At 1.001 of the judge's step energy grows by 1.09 each step: the check fails, not the run."""
    problem = qdem_hard_steps.near_critical_problem()
    share = 1.001 / qdem_hard_steps.run_share(problem)
    monkeypatch.setattr("qdem_fem.march.GROWTH", 1e30)
    energy = qdem_hard_steps.energies(problem, share, 600, 100)
    assert energy.max() / energy[0] > 1 / (1 - 0.99**2)


# --- bodies ----------------------------------------------------------------------------------


def test_one_element() -> None:
    hold(qdem_hard_bodies.single_element_checks())


def test_inverted_elements_are_named() -> None:
    hold(qdem_hard_bodies.inverted_checks(range(8)))


@pytest.mark.parametrize("share", [1.001, 1.3])
def test_an_element_inverted_from_the_start_is_named(share: float) -> None:
    """A state set by the user: one node beyond the opposite face of element 7, and so of 6."""
    nodes, elements = box_with_sliver(1.0)
    corner = nodes[elements[7]]
    normal = np.cross(corner[2] - corner[1], corner[3] - corner[1])
    height = (corner[0] - corner[1]) @ normal / (normal @ normal)
    body = q.Body((nodes, elements), qdem_hard_shapes.CONCRETE, name="cube")
    run = q.Simulation([body], threads=1)
    field = np.zeros_like(nodes)
    field[elements[7, 0]] = -share * height * normal
    body.displacement = field
    with pytest.raises(ElementInverted) as raised:
        run.advance(run.step)
    assert raised.value.element in (6, 7)
    assert f"element {raised.value.element} of cube" in str(raised.value)


def test_parts_apart_move_as_each_alone() -> None:
    hold(qdem_hard_bodies.parts_checks())


def test_nodes_of_no_element() -> None:
    hold(qdem_hard_bodies.loose_nodes_checks())


def test_left_handed_elements() -> None:
    hold(qdem_hard_bodies.left_handed_checks())


@pytest.mark.parametrize("shared", [1, 2])
def test_hinges(shared: int) -> None:
    """Two elements that share a node or an edge only: a mesh like any other, free in flight."""
    one = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    # turned by half a turn about the x axis, and for a single node pushed beyond it
    other = one[shared:] * [1 if shared == 2 else -1, -1, -1]
    nodes = np.vstack([one, other])
    second = [*range(shared), *range(4, 8 - shared)]
    body = q.Body((nodes, [[0, 1, 2, 3], second]), q.Material(1e6, 0.3, 1000.0))
    run = q.Simulation([body], threads=1)
    velocity = np.tile([1.0, 2.0, 3.0], (len(nodes), 1))
    body.velocity = velocity
    run.advance(500 * run.step)
    np.testing.assert_allclose(body.displacement, velocity * run.time, rtol=1e-12)


# --- size ------------------------------------------------------------------------------------


@pytest.mark.long
def test_large_body_in_its_own_process() -> None:
    """The measurement itself, on 40,000 elements."""
    checks = large_body_checks(20)
    hold(checks)
    assert sum("peak memory" in check.name for check in checks) == 10
