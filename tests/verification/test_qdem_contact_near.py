"""The critical step for contacts that are near: closed forms, what it bounds, stops and leaves."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import qdem_fem as q
from qdem_fem.bodies.rigid_mass import make_cross_matrix
from qdem_fem.files.errors import ConditionError, StepWarning, Unstable
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.tables.contact import ContactTable, find_contact_faults
from tests.qdem_restored import go_on

SIDE, RADIUS, STIFFNESS = 0.03, 0.006, 1e8
JELLY = q.Material(1e3, 0.2, 2700.0)
STONE = q.Material(30e9, 0.2, 2700.0, shear_viscosity=1e4)


def two(gap: float, material: q.Material = JELLY, **options: Any) -> q.Simulation:
    """Two cubes, nine vertices of one opposite nine of the other, ``gap`` [m] from touching."""
    rigid, stiffness = options.pop("rigid", False), options.pop("stiffness", STIFFNESS)
    bodies = [
        q.Body(make_box_mesh((SIDE,) * 3, (2, 2, 2), "kuhn", (0.0, 0.0, z)), material, name=name,
               rigid=rigid)
        for name, z in (("below", 0.0), ("above", SIDE + 2 * RADIUS + gap))
    ]  # fmt: skip
    words = {"contacts": "near"} | options.pop("contact", {})
    touch = q.SphereContact(RADIUS, stiffness, 0.5, **words)
    return q.Simulation(bodies, threads=1, contact=touch, **options)


def test_step_of_pairs_and_of_a_wall_is_the_closed_form() -> None:
    """Elements of no stiffness: ``2/omega``; ``omega^2 = k (1/m1 + 1/m2)``, of a wall ``2 k/m``.

    Lanczos is on the safe side by its residual, 1e-3 of omega^2.
    """
    run = two(1e-5)
    mass = run.assembly.mass.reshape(2, -1)
    low, high = (body.nodes for body in run.bodies)
    top, bottom = low[:, 2] == SIDE, high[:, 2] == high[:, 2].min()
    order = [np.lexsort(nodes[face, :2].T) for nodes, face in ((low, top), (high, bottom))]
    pairs = 1 / mass[0][top][order[0]] + 1 / mass[1][bottom][order[1]]
    expected = 2 / np.sqrt(STIFFNESS * pairs.max())
    assert run.critical_step.value == pytest.approx(expected, rel=1e-3)
    assert run.critical_step.value <= expected * (1 + 1e-9)
    wall = q.ContactPlane((0.0, 0.0, -RADIUS), (0.0, 0.0, 1.0))
    run = two(0.1, contact={"planes": [wall]})
    on = low[:, 2] == 0
    expected = 2 / np.sqrt(2 * STIFFNESS / mass[0][on].min())
    assert run.critical_step.value == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(("kind", "shift"), [(True, 0.0), (True, 2e-3), ("lumped", 2e-3)])
def test_step_of_rigid_bodies_is_that_of_their_twelve_freedoms(kind: Any, shift: float) -> None:
    """``2/omega`` of the highest mode on springs as stiff in all directions is above it.  With
    one of two held, omega^2 is the other's D, which is no more than that mode's: so the sum of both
    that the bound takes is at most twice it."""
    run = two(1e-5, rigid=kind)
    run.bodies[1].displacement = np.tile([shift, 0.0, 0.0], (27, 1))
    mass, every, jacobian = np.zeros((12, 12)), [], []
    for at, sign, body in zip((0, 6), (1, -1), run.bodies, strict=True):
        mass[at : at + 3, at : at + 3] = body.rigid_mass.mass * np.eye(3)
        mass[at + 3 : at + 6, at + 3 : at + 6] = body.rigid_mass.tensor
        nodes = body.nodes + body.displacement
        face = nodes[np.isclose(nodes[:, 2], SIDE if sign == 1 else SIDE + 2 * RADIUS + 1e-5)]
        arm = face - body.rigid_mass.centre - body.displacement[0]
        each = [np.broadcast_to(np.eye(3), (9, 3, 3)), -make_cross_matrix(arm)]
        jacobian.append(sign * np.concatenate(each, axis=2))
        every.append(face)
    apart = np.linalg.norm(every[0][:, None] - every[1], axis=2)
    first, second = np.nonzero(apart < 2 * RADIUS + run.contacts.skin)  # type: ignore[union-attr]
    joins = np.concatenate([jacobian[0][first], jacobian[1][second]], axis=2)
    stiffness = STIFFNESS * np.einsum("pik,pil->kl", joins, joins)
    exact = 2 / np.sqrt(eigh(stiffness, mass, eigvals_only=True)[-1])
    found = run.critical_step.value
    assert exact / np.sqrt(2) <= found <= exact


def test_contacts_that_are_far_leave_the_elements_their_step() -> None:
    run = two(0.1, STONE)
    assert run.critical_step.value == run.elements_critical_step.value
    near, three = (
        two(0.0, STONE, stiffness=1e9, contact={"contacts": n}).critical_step.value
        for n in ("near", 3)
    )
    assert three < near < run.elements_critical_step.value


@pytest.mark.long
@pytest.mark.parametrize(("share", "steps"), [(0.95, 200), (1.05, 19)])
def test_a_march_is_stable_below_the_step_and_not_above(share: float, steps: int) -> None:
    """Nine pairs in equilibrium, pressed by what they bear, and trembling: all bear all the time.

    Along the normals springs are as the bound has them.  Leapfrog's kinetic energy of a mode is at
    most ``1/(1 - share^2)``, 10, times its energy; above the step it grows in each step by
    ``exp(2 arcosh(2 share^2 - 1))``, 3.5; the step is known to 5e-4, that growth then to 7e-3.
    """
    overlap = 1e-4
    step = share * two(-overlap).critical_step.value
    run = two(-overlap, strain="small", step=step, contact={"contacts": 3})
    for body, height, up in zip(
        run.bodies, (SIDE, run.bodies[1].nodes[:, 2].min()), (1, -1), strict=True
    ):
        face = body.nodes[:, 2] == height
        run.load(body, face, [0.0, 0.0, 9 * up * STIFFNESS * overlap])
        body.velocity = 1e-6 * np.random.default_rng(0).normal(size=(27, 3))
    before = run.energy().kinetic
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # that it is too long is why we are here
        run.advance(steps * run.step)
        grown = run.energy().kinetic
        run.advance(run.step)
    if share < 1:
        assert grown < 10 * before
    else:
        growth = np.exp(2 * np.arccosh(2 * share**2 - 1))
        assert run.energy().kinetic / grown == pytest.approx(growth, rel=1e-2)


@pytest.mark.long
def test_a_march_that_meets_nearer_vertices_than_it_began_with_stops() -> None:
    """The elements' step, though stiff vertices come near on the way: found before they touch."""
    run = two(2e-3, STONE, stiffness=1e12)
    run.bodies[1].velocity = np.tile([0.0, 0.0, -10.0], (27, 1))
    with pytest.raises(Unstable, match=r"come near each other.*\n.*number of contacts"):
        run.advance(1e-3)
    assert run.contacts is not None
    assert not run.contacts.kernel.force.any()


@pytest.mark.long
def test_it_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    """Saved where vertices have left the skin, so that the state tells another step than the
    march's."""

    def made() -> q.Simulation:
        run = two(0.0, STONE, stiffness=1e9)
        run.bodies[1].velocity = np.tile([1.0, 0.5, 0.0], (27, 1))
        return run

    step = made().step
    whole, again = go_on(made, tmp_path / "half.npz", 500 * step, 200 * step)
    assert whole.contacts is not None
    assert whole.contacts.renewals > 1
    assert again.step == whole.step


def test_near_is_refused_where_it_tells_nothing() -> None:
    with pytest.raises(ConditionError, match="'near' is not above zero"):
        q.SurfaceContact(1e12, 0.5, contacts="near")  # type: ignore[arg-type]
    with pytest.raises(ConditionError, match="'far' contacts"):
        q.SphereContact(RADIUS, 1e8, 0.5, contacts="far")  # type: ignore[arg-type]
    table = ContactTable(model="surface", friction=0.5, contacts="near", modulus=1e12)
    assert list(find_contact_faults(table, None, [])) == [
        ("contact.contacts", "'near' is for spheres: give a number")
    ]


def test_a_body_that_the_user_moves_away_is_pushed_no_more() -> None:
    """Without walls a vertex that is near nothing is not looked at: its last force is forgotten."""
    run = two(-1e-5)
    assert run.contacts is not None
    assert run.contacts.accelerations().any()
    run.bodies[1].displacement = np.tile([0.0, 0.0, 1.0], (27, 1))
    assert not run.contacts.accelerations().any()
