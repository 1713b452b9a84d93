"""Quadratic tetrahedra beside a twin in NumPy, closed forms and scikit-fem's on the same mesh."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

import qdem_fem as q
from qdem_fem.element import MEASURES, Strain
from qdem_fem.files import ConditionError, Floats
from qdem_fem.mesh import make_box_mesh
from validation.bench.qdem.meshes import jitter_nodes

SOFT = q.Material(young=1e6, poisson=0.25, density=1000.0)
VISCOUS = q.Material(1e6, 0.3, 1000.0, shear_viscosity=40.0, bulk_viscosity=20.0)
MESH = jitter_nodes(make_box_mesh((1.0, 0.8, 0.7), (3, 3, 3)), 0.2, 1)


def find_forces(body: q.QuadraticBody, strain: Strain, displacement: Floats) -> Floats:
    """``f_a = -V/4 sum_q P(q) grad N_a(q)`` [N], (n, 3): the twin of the kernel."""
    nominal = MEASURES[strain].compute_nominal_stress(
        body.find_gradient(displacement), body.material.lame_first, body.material.lame_second
    )
    each = np.einsum(
        "m,pmij,mpaj->mai", -body.gradients[1] / 4, nominal, body.find_shape_gradients()
    )
    total = np.zeros_like(body.nodes)
    np.add.at(total, body.element_nodes, each)
    return total


@pytest.mark.parametrize("strain", ["finger", "svk", "small"])
def test_forces_are_those_of_the_twin(strain: Strain) -> None:
    body = q.QuadraticBody(MESH, SOFT)
    run = q.Simulation([body], threads=1, strain=strain)
    u = 0.01 * np.random.default_rng(2).standard_normal(body.nodes.shape)
    expected = find_forces(body, strain, u)
    found = run.assembly.accelerations_own(u, 0 * u) * run.assembly.mass[:, None]
    assert abs(found - expected).max() < 1e-12 * abs(expected).max()


def test_masses_are_in_proportion_to_the_consistent_diagonal() -> None:
    basis = skfem.Basis(skfem.MeshTet(np.eye(3, 4, 1), np.arange(4)[:, None]), skfem.ElementTetP2())
    diagonal = skfem.BilinearForm(lambda u, v, _: u * v).assemble(basis).diagonal()
    assert pytest.approx(diagonal / diagonal.sum(), rel=1e-12) == q.QuadraticBody.MASS_SHARES


def test_a_uniform_gradient_with_a_large_turn_is_exact() -> None:
    """No inner node is pulled, and a turn alone pulls none: round-off of strains of order one."""
    body = q.QuadraticBody(MESH, SOFT)
    run = q.Simulation([body], threads=1)
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    inner = np.ones(len(body.nodes), bool)
    inner[body.surface] = False
    assert inner.any()
    assert run.assembly.mass.sum() == pytest.approx(560.0, rel=1e-13)
    stretch = turn @ (np.eye(3) + 0.1 * np.random.default_rng(0).standard_normal((3, 3)))
    pulls = []
    for move in (stretch, turn):
        u = body.nodes @ (move - np.eye(3)).T + [1.0, 2.0, 3.0]
        pulls.append(abs(run.assembly.accelerations_own(u, 0 * u)))
    assert pulls[0][inner].max() < 1e-11 * pulls[0].max()
    assert pulls[1].max() < 1e-11 * pulls[0].max()


def test_momenta_are_kept_and_energy_is_accounted_for() -> None:
    body = q.QuadraticBody(make_box_mesh((0.1, 0.1, 0.1), (2, 2, 2)), VISCOUS)
    run = q.Simulation([body], threads=1)
    body.velocity = np.array([1.0, 2.0, 3.0]) + np.cross([3.0, -5.0, 40.0], body.nodes - 0.05)
    mass = run.assembly.mass

    def find_momenta() -> Floats:
        arm, velocity = body.nodes + body.displacement, body.velocity
        return np.concatenate([mass @ velocity, mass @ np.cross(arm, velocity)])

    momenta, before = find_momenta(), run.energy()
    run.advance(0.02)
    after = run.energy()
    assert abs(find_momenta() - momenta).max() < 1e-12 * abs(momenta).max()
    assert after.viscous > 0
    total = after.kinetic + after.elastic + after.viscous
    assert total == pytest.approx(before.kinetic, rel=1e-3)  # what an audit allows


def test_threads_agree_to_the_bit() -> None:
    """Also where one kernel comes from the disk and the other was compiled now."""
    found = []
    for threads in (1, 2):
        body = q.QuadraticBody(make_box_mesh((2.0, 1.0, 1.0), (14, 6, 6)), SOFT)  # four chunks
        run = q.Simulation([body], threads=threads)
        body.displacement = 1e-3 * np.random.default_rng(3).standard_normal(body.nodes.shape)
        run.advance(20 * run.step)
        found.append(body.displacement)
    assert np.array_equal(*found)


def test_a_bent_beam_is_that_of_scikit_fem() -> None:
    """The same elements: apart by the square of the strain, 1e-6, and the solver's tolerance."""
    mesh = skfem.MeshTet.init_tensor(
        *(np.linspace(0, side, n + 1) for side, n in ((2.4, 6), (0.25, 1), (0.22, 1)))
    )
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
    stiffness = linear_elasticity(*lame_parameters(45e9, 0.167)).assemble(basis)
    held, places = basis.get_dofs(lambda x: x[0] == 0).flatten(), basis.doflocs[:, ::3].T
    body = q.QuadraticBody(mesh, q.Material(45e9, 0.167, 2350.0))
    end = np.isclose(body.nodes[:, 0], 2.4)
    force = np.zeros((len(places), 3))
    at_end = np.isclose(places[:, 0], 2.4)
    force[at_end, 2] = -200.0 / at_end.sum()
    whole = np.zeros(force.size)
    numbers = np.concatenate([basis.nodal_dofs.T.ravel(), basis.edge_dofs.T.ravel()])
    assert np.array_equal(numbers, np.arange(force.size))
    whole = skfem.solve(*skfem.condense(stiffness, force.ravel(), D=held))
    run = q.Simulation([body], threads=1, strain="small")
    run.fix(body, body.nodes[:, 0] == 0)
    run.load(body, end, [0.0, 0.0, -200.0])
    answer = run.relax(tolerance=1e-10)
    theirs = whole.reshape(-1, 3)[at_end, 2].mean()
    assert body.displacement[end, 2].mean() == pytest.approx(theirs, rel=1e-6)
    assert theirs == pytest.approx(-92.65e-6, rel=0.02)  # qdem.md: 27,648 elements
    assert answer.discretisation is None  # the estimate is of linear elements


def test_what_can_not_be_computed_is_refused() -> None:
    one, other = q.QuadraticBody(MESH, SOFT, "one"), q.Body(MESH, SOFT, "other")
    with pytest.raises(ConditionError, match="other is of linear elements and one of quadratic"):
        q.Simulation([one, other])
    with pytest.raises(ConditionError, match="which the processor computes"):
        q.Simulation([one], device="cuda")
    with pytest.raises(ConditionError, match="one is rigid, and nothing within it deforms"):
        q.QuadraticBody(MESH, SOFT, "one", rigid=True)
    run = q.Simulation([one])
    with pytest.raises(ConditionError, match="no corner"):
        run.fix(one, len(MESH.nodes))
    assert len(run.fix(one, one.elements[0, :2]).nodes) == 3  # and the node amid them
