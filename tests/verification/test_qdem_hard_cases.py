"""Hard cases of QDEM in their smallest forms, and proof that their checks can fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import ElementInverted, StepWarning, Unstable
from tests import qdem_hard_bodies as bodies
from validation.bench.qdem import hard
from validation.bench.qdem.meshes import box_graded, box_with_sliver, longest_edges
from validation.bench.qdem.problem import cantilever
from validation.case import Check


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
    hold(hard.sliver_checks())


def test_graded_box_fills_the_cube_and_turns_no_element() -> None:
    nodes, elements = box_graded(100.0, 6)
    volume = np.linalg.det(nodes[elements[:, 1:]] - nodes[elements[:, :1]]) / 6
    assert (volume > 0).all()
    assert volume.sum() == pytest.approx(1.0, rel=1e-12)
    edges = longest_edges(nodes, elements)
    assert edges.min() == pytest.approx(np.sqrt(3) / 100, rel=1e-12)


# --- materials -------------------------------------------------------------------------------


def test_locking_is_that_of_linear_tetrahedra() -> None:
    """Against K u = f on the same mesh, and against quadratic tetrahedra: Kuhn's cells lock."""
    hold(hard.locking_checks(((12, 2, 2),), (12, 2, 2)))


@pytest.mark.parametrize("where", ["tip half", "core"])
def test_stiffness_jumps_of_a_thousand(where: str) -> None:
    """K u = f, 2/omega and the motion of scikit-fem, where stiff elements lie in soft ones."""
    problem = cantilever((6, 2, 2))
    mesh = problem.mesh
    middle, size = mesh.nodes[mesh.elements].mean(axis=1), mesh.nodes.max(axis=0)
    inside = (np.abs(middle / size - 0.5)[:, 1:] < 0.25).all(axis=1)
    stiff = middle[:, 0] > size[0] / 2 if where == "tip half" else inside
    material = replace(problem.material, young=np.where(stiff, 45e9, 45e6))
    jump = replace(problem, material=material, force=(0.0, 0.0, -2e-3))
    critical = jump.simulation()[1].critical_step
    assert stiff[critical.element]
    hold([
        *hard.static_checks("jump", jump), hard.motion_check("jump", jump),
        hard.critical_check("jump", critical.value, hard.critical_judge(jump)),
    ])  # fmt: skip


# --- steps -----------------------------------------------------------------------------------


@pytest.mark.long
def test_steps_near_the_critical_one() -> None:
    """H <= E <= H/(1 - s^2) at s = 0.99 and at the reported value."""
    hold(hard.near_critical_checks(20_000))


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
    problem = hard.near_critical_problem()
    share = 1.001 / hard.run_share(problem)
    monkeypatch.setattr("qdem_fem.march.steps.UNSTABLE_GROWTH", 1e30)
    energy = hard.energies(problem, share, 600, 100)
    assert energy.max() / energy[0] > 1 / (1 - 0.99**2)


# --- bodies ----------------------------------------------------------------------------------


def test_one_element() -> None:
    hold(bodies.single_element_checks())


def test_inverted_elements_are_named() -> None:
    hold(bodies.inverted_checks(range(8)))


@pytest.mark.parametrize("share", [1.001, 1.3])
def test_an_element_inverted_from_the_start_is_named(share: float) -> None:
    """A state set by the user: one node beyond the opposite face of element 7, and so of 6."""
    nodes, elements = box_with_sliver(1.0)
    corner = nodes[elements[7]]
    normal = np.cross(corner[2] - corner[1], corner[3] - corner[1])
    height = (corner[0] - corner[1]) @ normal / (normal @ normal)
    body = q.Body((nodes, elements), hard.CONCRETE, name="cube")
    run = q.Simulation([body], threads=1)
    field = np.zeros_like(nodes)
    field[elements[7, 0]] = -share * height * normal
    body.displacement = field
    with pytest.raises(ElementInverted) as raised:
        run.advance(run.step)
    assert raised.value.element in (6, 7)
    assert f"element {raised.value.element} of cube" in str(raised.value)


def test_parts_apart_move_as_each_alone() -> None:
    hold(bodies.parts_checks())


def test_nodes_of_no_element() -> None:
    hold(bodies.loose_nodes_checks())


def test_left_handed_elements() -> None:
    hold(bodies.left_handed_checks())


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
