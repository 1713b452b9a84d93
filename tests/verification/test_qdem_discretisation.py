"""Errors of the mesh, estimated from one answer, beside quadratic tetrahedra: eleven bodies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg
import skfem
from scipy.spatial import Delaunay
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import qdem_fem as q
from qdem_fem.bodies import estimate_bending, estimate_discretisation
from qdem_fem.files import Floats

YOUNG, DENSITY = 30e9, 2400.0
Place = Callable[[Floats], Floats]


def box(size: tuple[float, ...], cells: tuple[int, ...], bend: Any = None) -> skfem.MeshTet:
    """A box of six tetrahedra a cell, its points (3, n) moved by ``bend``."""
    mesh = skfem.MeshTet.init_tensor(
        *(np.linspace(0, side, n + 1) for side, n in zip(size, cells, strict=True))
    )
    return mesh if bend is None else skfem.MeshTet(bend(mesh.p), mesh.t)


def taper(p: Floats) -> Floats:
    return np.stack([p[0], *((p[1:] - 0.1) * (1 - 0.6 * p[0]))])


def arch(p: Floats) -> Floats:
    radius, angle = 0.5 + p[2], p[0] * np.pi / 2
    return np.stack([radius * np.cos(angle), p[1], radius * np.sin(angle)])


def waist(p: Floats) -> Floats:
    return np.stack([p[0], *((p[1:] - 0.1) * (1 - 0.6 * np.sin(np.pi * p[0] / 0.8)))])


def twist(p: Floats) -> Floats:
    c, s, y, z = np.cos(2.5 * p[0]), np.sin(2.5 * p[0]), p[1] - 0.05, p[2] - 0.02
    return np.stack([p[0], c * y - s * z, s * y + c * z])


def shear(p: Floats) -> Floats:
    return np.stack([p[0] + 0.5 * p[2], p[1], p[2]])


def ell() -> skfem.MeshTet:
    mesh = box((0.6, 0.2, 0.6), (6, 2, 6))
    centre = mesh.p[:, mesh.t].mean(axis=1)
    return mesh.restrict(np.flatnonzero((centre[0] < 0.2) | (centre[2] < 0.2)))


def jitter() -> skfem.MeshTet:
    mesh = box((1.0, 0.2, 0.2), (15, 3, 3))
    p, inner = mesh.p.copy(), np.setdiff1d(np.arange(mesh.p.shape[1]), mesh.boundary_nodes())
    p[:, inner] += 0.012 * np.random.default_rng(1).uniform(-1, 1, (3, len(inner)))
    return skfem.MeshTet(p, mesh.t)


def stone() -> skfem.MeshTet:
    grid = np.array(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3)).reshape(3, -1).T
    grid = grid + np.random.default_rng(4).uniform(-0.06, 0.06, grid.shape)
    grid = 0.03 * grid[np.linalg.norm(grid * [1, 1.2, 1.5], axis=1) < 1]
    cells = Delaunay(grid).simplices
    corners = grid[cells]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    return skfem.MeshTet(grid.T.copy(), cells[volume > 1e-10].T.copy())


def at(axis: int, value: float) -> Place:
    return lambda x: np.isclose(x[axis], value)


CASES: dict[str, tuple[Callable[[], skfem.MeshTet], Place, Place, list[float], float]] = {
    "taper": (
        lambda: box((1.0, 0.2, 0.2), (12, 2, 2), taper), at(0, 0), at(0, 1), [0, 0, -1], 0.2),
    "arch": (
        lambda: box((1.0, 0.1, 0.12), (14, 2, 3), arch), at(2, 0), at(0, 0), [0, 0, -1], 0.3),
    "twisted": (
        lambda: box((1.0, 0.1, 0.04), (16, 4, 2), twist), at(0, 0), at(0, 1), [0, 1, -1], 0.25),
    "waist": (
        lambda: box((0.8, 0.2, 0.2), (10, 3, 3), waist), at(0, 0), at(0, 0.8), [1, 0, 0], 0.3),
    "L": (ell, at(2, 0.6), at(0, 0.6), [0, 0, -1], 0.167),
    "wall": (lambda: box((1.0, 0.1, 0.8), (5, 1, 4)), at(2, 0), at(2, 0.8), [1, 0, 0], 0.2),
    "strip": (lambda: box((1.0, 0.5, 0.05), (12, 5, 2)), at(0, 0), at(0, 1), [0, 0, -1], 0.3),
    "skewed": (
        lambda: box((0.3,) * 3, (4,) * 3, shear), at(2, 0), at(2, 0.3), [0, 0.3, -1], 0.4),
    "jittered": (jitter, at(0, 0), at(0, 1), [0, 0.5, -1], 0.2),
    "both ends": (
        lambda: box((1.2, 0.2, 0.15), (12, 2, 3)), lambda x: at(0, 0)(x) | at(0, 1.2)(x),
        lambda x: at(2, 0.15)(x) & (abs(x[0] - 0.6) < 0.15), [0, 0, -1], 0.2),
    "stone": (stone, lambda x: x[2] < -0.008, lambda x: x[2] > 0.008, [0.2, 0, -1], 0.2),
}  # fmt: skip


def solve(
    mesh: skfem.MeshTet, element: Any, case: tuple[Any, ...], lumped: bool
) -> tuple[float, float, Floats, Floats]:
    """Work of the load, lowest angular frequency; displacement and mode at the vertices (n, 3)."""
    _, fixed, loaded, pull, poisson = case
    basis = skfem.Basis(mesh, skfem.ElementVector(element()))
    stiffness = linear_elasticity(*lame_parameters(YOUNG, poisson)).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, w: DENSITY * dot(u, v)).assemble(basis)
    if lumped:
        mass = sparse.diags(np.asarray(mass.sum(axis=1)).ravel()).tocsr()
    ends = [mesh.facets_satisfying(where, boundaries_only=True) for where in (loaded, fixed)]
    traction = np.array(pull, float)[:, None, None]
    work = skfem.LinearForm(lambda v, w: dot(np.broadcast_to(traction, v.shape), v))
    load = work.assemble(basis.boundary(ends[0]))
    free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(ends[1]).flatten())
    stiffness, mass = stiffness[free][:, free], mass[free][:, free]
    factor = linalg.splu(stiffness.tocsc())
    u, mode = np.zeros((2, basis.N))
    u[free] = factor.solve(load[free])
    inverse = linalg.LinearOperator(stiffness.shape, matvec=factor.solve)
    square, vectors = linalg.eigsh(stiffness, k=1, M=mass, sigma=0, OPinv=inverse)
    mode[free] = vectors[:, 0]
    vertices = basis.nodal_dofs.T
    return float(load @ u), float(np.sqrt(square[0])), u[vertices], mode[vertices]


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_estimates_are_within_a_factor_of_two_of_the_truth(name: str) -> None:
    """Of work, stress in the energy norm and first frequency; a random stone within three."""
    case = CASES[name]
    mesh = case[0]()
    work, omega, moved, mode = solve(mesh, skfem.ElementTetP1, case, lumped=True)
    true_work, true_omega, _, _ = solve(mesh, skfem.ElementTetP2, case, lumped=False)
    body = q.Body(mesh, q.Material(YOUNG, case[-1], DENSITY))
    static, motion = (
        estimate_discretisation([(body, field, False)], "small") for field in (moved, mode)
    )
    assert static is not None
    assert motion is not None
    short = 1 - work / true_work
    least = 0.3 if name == "stone" else 0.5
    assert least < static.displacement / short < 2
    assert 0.5 < static.stress / np.sqrt(short) < 2  # |s - s_h|^2 = |s|^2 - |s_h|^2
    assert 0.5 < motion.frequency / (1 - true_omega / omega) < 2


def test_what_is_exact_has_no_error() -> None:
    """Uniform strain of two materials side by side, which share no mean; nothing without strain."""
    mesh = box((2.0, 1.0, 1.0), (4, 2, 2))
    left = mesh.p[:, mesh.t].mean(axis=1)[0] < 1
    body = q.Body(mesh, q.Material(np.where(left, YOUNG, 2 * YOUNG), 0.0, DENSITY))
    x = body.nodes[:, 0]
    moved = np.zeros_like(body.nodes)
    moved[:, 0] = 1e-6 * np.where(x < 1, x, 1 + (x - 1) / 2)
    found = estimate_discretisation([(body, moved, False)], "small")
    assert found is not None
    assert found.displacement < 1e-12
    # masses at nodes are the trapezoidal rule: int u^2, 23/12, and (b - a) h^2/6 u'^2 of each half
    assert found.frequency == pytest.approx(1 - np.sqrt(1 + 1.25 / 24 / (23 / 12)), rel=1e-9)
    assert estimate_discretisation([(body, 0 * moved, False)], "small") is None


def test_a_free_body_may_turn_and_travel() -> None:
    """A finite turn strains no objective measure, and a journey is no part of a mode."""
    body = q.Body(box((1.0, 0.2, 0.2), (10, 2, 2)), q.Material(YOUNG, 0.2, DENSITY))
    bent = np.zeros_like(body.nodes)
    bent[:, 2] = 1e-6 * (body.nodes[:, 0] - 0.5) ** 2
    away = bent + [5e-6, 1e-6, 0] + 1e-6 * np.cross([0, 1, 0.5], body.nodes)
    one, other = (estimate_discretisation([(body, u, True)], "finger") for u in (bent, away))
    assert one is not None
    assert other is not None
    assert other.displacement == pytest.approx(one.displacement, rel=1e-4)
    assert other.frequency == pytest.approx(one.frequency, rel=1e-4)


@pytest.mark.parametrize(("cells", "true"), [((24, 3, 3), 0.33), ((48, 6, 6), 0.11)])
def test_bending_is_told_without_an_answer(cells: tuple[int, ...], true: float) -> None:
    """The paper's cantilever: what its mesh takes from the deflection (quadratic elements)."""
    body = q.Body(box((2.4, 0.25, 0.22), cells), q.Material(45e9, 0.167, 2350.0))
    assert estimate_bending(body) == pytest.approx(true, abs=0.02)


def test_relax_tells_the_error_of_the_mesh_beside_that_of_the_solver() -> None:
    """README's example: 33 % of the mesh, which the answer over what is left mends to 1 %."""
    beam = q.Body(box((2.4, 0.25, 0.22), (24, 3, 3)), q.Material(45e9, 0.167, 2350.0))
    end = np.isclose(beam.nodes[:, 0], 2.4)
    run = q.Simulation([beam], threads=1)
    run.fix(beam, beam.nodes[:, 0] == 0)
    run.load(beam, end, [0, 0, -200.0])
    answer = run.relax()
    assert answer.solver_bound < 1e-5
    assert answer.discretisation is not None
    assert answer.discretisation.displacement == pytest.approx(0.332, abs=0.01)
    tip = beam.displacement[end, 2].mean() / (1 - answer.discretisation.displacement)
    bending = 200 * 2.4**3 / (3 * 45e9 * 0.25 * 0.22**3 / 12)
    assert tip == pytest.approx(-bending, rel=0.02)  # beam theory; shear adds .5 %
