"""The judge of QDEM: scikit-fem's linear tetrahedra on the same mesh, solved to the last digits.

Independent of ``qdem_fem``'s kernels: small strain, assembled matrices.  Degrees of freedom are
node-major, 3*i + c for component c of node i, so a field is an array (n, 3) or its ravel.

    K = stiffness(nodes, elements, young=45e9, poisson=0.167)
    answer = static_solve(K, nodes[:, 0] > 0, load, nodes)        answer.displacement (n, 3) m

Modes are in `find_modes`, problems in `problem`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import splu

from qdem_fem.files.errors import LibraryMissing, NotConverged, UsageError
from validation.bench.qdem.closed_forms import CONCRETE_BEAM, Beam

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

BATCH = 60_000
"""Elements assembled at once: all 488,400 together take 3.5 GB."""
PASS_TOLERANCE = 1e-6
"""Relative residual of one pass of conjugate gradients; rounding stalls them from 1e-9 on."""
PASSES_MAX = 12


@dataclass(frozen=True)
class Static:
    """A static answer, and how far it can be off."""

    displacement: FloatArray
    """u [m], (n, 3)."""
    correction: float
    """|last correction| / |u|: an estimate of the relative error left in the solution."""
    residual: float
    """|f - K u| / |f| on the free degrees of freedom, with sums in extended precision."""


# --- matrices ---------------------------------------------------------------------------------


def find_lame(young: ArrayLike, poisson: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Lame's lam and mu [Pa] of E [Pa] and nu, below eq. 2."""
    young, poisson = np.asarray(young, float), np.asarray(poisson, float)
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / 2 / (1 + poisson)


def build_stiffness(
    nodes: FloatArray, elements: IntArray, young: ArrayLike, poisson: ArrayLike
) -> sparse.csr_matrix:
    """K [N/m], (3n, 3n), of linear tetrahedra; E [Pa] and nu are numbers or arrays (m,)."""
    return build_from_lame(nodes, elements, *find_lame(young, poisson))


def build_from_lame(
    nodes: FloatArray, elements: IntArray, lam: ArrayLike, mu: ArrayLike
) -> sparse.csr_matrix:
    """The same from Lame's moduli [Pa], numbers or arrays (m,).

    With lam_D = bulk viscosity - 2/3 mu_D and mu_D [Pa s] it is the viscous matrix C [N s/m] of
    eq. 7.  Assembled batch by batch, see `BATCH`.
    """
    from skfem import asm
    from skfem.models.elasticity import linear_elasticity

    count, size = len(elements), 3 * len(nodes)
    moduli = [np.broadcast_to(np.asarray(value, float), count) for value in (lam, mu)]
    total = sparse.csr_matrix((size, size))
    for first in range(0, count, BATCH):
        part = slice(first, first + BATCH)
        basis, used = _build_basis(nodes, elements[part])
        # scikit-fem wants coefficients per element and quadrature point
        form = linear_elasticity(*(value[part, None] for value in moduli))
        block = asm(form, basis).tocoo()
        dof = (3 * used[:, None] + np.arange(3)).ravel()
        total = total + sparse.csr_matrix(
            (block.data, (dof[block.row], dof[block.col])), shape=(size, size)
        )
    return total


def _build_basis(nodes: FloatArray, elements: IntArray) -> tuple[Any, IntArray]:
    """scikit-fem's basis on some elements, one quadrature point each, and the nodes they use."""
    import skfem

    used, local = np.unique(elements, return_inverse=True)
    mesh = skfem.MeshTet(nodes[used].T.copy(), local.reshape(-1, 4).T.copy())
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP1()), intorder=0)
    if not np.array_equal(basis.nodal_dofs.T.ravel(), np.arange(3 * len(used))):
        raise UsageError(
            "this scikit-fem numbers the degrees of freedom of vectors in another order",
            where="validation.bench.qdem.judge",
            remedy="use scikit-fem 9 to 12",
        )
    return basis, used


def lump_mass(nodes: FloatArray, elements: IntArray, density: ArrayLike) -> FloatArray:
    """Mass of every node [kg], (n,): rho V / 4 to each vertex, eq. 11; rho a number or (m,)."""
    edge = nodes[elements[:, 1:]] - nodes[elements[:, :1]]
    volume = np.abs(np.linalg.det(edge)) / 6
    share = np.broadcast_to(np.asarray(density, float), len(elements)) * volume / 4
    return np.asarray(np.bincount(elements.ravel(), np.repeat(share, 4), len(nodes)), float)


def list_free(free: ArrayLike, size: int) -> IntArray:
    """Numbers of the free degrees of freedom from a mask of nodes (n,), or of components (n, 3)."""
    mask = np.asarray(free)
    if mask.dtype != bool or mask.size not in (size // 3, size):
        raise UsageError(
            f"free is a mask of shape {mask.shape} and type {mask.dtype}",
            remedy=f"give booleans for {size // 3} nodes, or for their 3 components",
        )
    return np.flatnonzero(np.repeat(mask, 3) if mask.size == size // 3 else mask.ravel())


# --- statics ----------------------------------------------------------------------------------


def make_rigid_motions(nodes: FloatArray) -> FloatArray:
    """Three translations and three small rotations, (3n, 6), about the centre of the nodes."""
    x = nodes - nodes.mean(axis=0)
    modes = np.zeros((len(nodes), 3, 6))
    modes[:, :, :3] = np.eye(3)
    for axis in range(3):
        modes[:, :, 3 + axis] = np.cross(np.eye(3)[axis], x)
    return modes.reshape(-1, 6)


def build_multigrid(matrix: sparse.csr_matrix, near_kernel: FloatArray) -> Any:
    """pyamg's smoothed aggregation of an elastic matrix; ``near_kernel`` its rigid motions.

    Raises `LibraryMissing` without pyamg.
    """
    try:
        import pyamg
    except ImportError:
        raise LibraryMissing(
            "pyamg is not installed",
            where="the multigrid solution of the judge",
            remedy='pip install pyamg, or choose method="direct" for a small mesh',
        ) from None
    return pyamg.smoothed_aggregation_solver(
        matrix, B=near_kernel, strength=("symmetric", {"theta": 0.0}), max_coarse=300
    )


def factorise(matrix: Any) -> Callable[[FloatArray], FloatArray]:
    """Solution operator of a symmetric positive definite matrix by SuperLU; to 60,000 unknowns."""
    return splu(
        sparse.csc_matrix(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).solve


def solve_static(
    matrix: sparse.csr_matrix,
    free: ArrayLike,
    load: FloatArray,
    nodes: FloatArray | None = None,
    method: Literal["amg", "direct"] = "amg",
    tolerance: float = 1e-10,
) -> Static:
    """Solve K u = f, ``load`` f [N] (n, 3), u = 0 where not ``free`` (mask of nodes or components).

    ``amg``: conjugate gradients with smoothed aggregation, which needs ``nodes`` (n, 3) [m] for
    the rigid motions; ``direct``: SuperLU, for meshes below 20,000 nodes.  Both are refined: the
    residual is summed in extended precision and the equation solved again for it, until a
    correction is below ``tolerance`` of the solution.  That is far beyond what conjugate gradients
    reach in one pass, where rounding of K u alone leaves a relative residual of 1e-10.

    Raises `UsageError` for arguments that do not fit, `NotConverged` when corrections stay large
    (a body that is not held), `LibraryMissing` without pyamg.
    """
    size = matrix.shape[0]
    dof = list_free(free, size)
    if method == "amg" and nodes is None:
        raise UsageError('method="amg" needs the nodes', remedy='pass nodes, or method="direct"')
    inner = matrix[dof][:, dof].tocsr()
    solve: Callable[[FloatArray], FloatArray]
    if nodes is not None and method == "amg":
        hierarchy = build_multigrid(inner, make_rigid_motions(nodes)[dof])
        solve = partial(hierarchy.solve, tol=PASS_TOLERANCE, maxiter=60, accel="cg")
    else:
        solve = factorise(inner)
    force = load.reshape(-1)[dof].astype(np.longdouble)
    extended = inner.astype(np.longdouble)
    u = np.zeros(len(dof), np.longdouble)
    residual, correction = force, np.inf
    for _ in range(PASSES_MAX):
        scale = float(np.abs(residual).max())
        if scale == 0:
            correction = 0.0
            break
        # scaled to 1, so that no tolerance of the solver is taken as absolute
        change = scale * solve(np.asarray(residual / scale, float))
        u = u + change
        residual = force - extended @ u
        correction = float(np.linalg.norm(change) / np.linalg.norm(np.asarray(u, float)))
        if not correction > tolerance:
            break
    if not correction <= tolerance:
        raise NotConverged(
            f"the last correction is {correction:.1e} of the solution, {tolerance:.0e} was asked",
            where="static_solve",
            remedy="hold the body against all six rigid motions, or ask for less",
        )
    field = np.zeros(size)
    field[dof] = u
    share = float(np.linalg.norm(np.asarray(residual, float)) / (np.linalg.norm(load) or 1.0))
    return Static(field.reshape(-1, 3), correction, share)


def find_von_mises(
    nodes: FloatArray,
    elements: IntArray,
    young: ArrayLike,
    poisson: ArrayLike,
    displacement: FloatArray,
) -> FloatArray:
    """Von Mises stress [Pa] of every element, (m,), small strain; ``displacement`` (n, 3) [m].

    sqrt(3/2 s:s) of the deviator s of lam tr(eps) I + 2 mu eps.  Figure 3 of the paper.
    """
    mu = np.broadcast_to(find_lame(young, poisson)[1], len(elements))
    answer = np.empty(len(elements))
    for first in range(0, len(elements), BATCH):
        part = slice(first, first + BATCH)
        basis, used = _build_basis(nodes, elements[part])
        gradient = basis.interpolate(displacement[used].ravel()).grad[..., 0]
        strain = (gradient + gradient.transpose(1, 0, 2)) / 2
        deviator = 2 * mu[part] * (strain - np.eye(3)[:, :, None] * np.trace(strain) / 3)
        answer[part] = np.sqrt(1.5 * np.sum(deviator**2, axis=(0, 1)))
    return answer


# --- the reference of second order ------------------------------------------------------------


def find_tip_p2(
    cells: tuple[int, int, int] = (48, 6, 6),
    load: float = 200.0,
    beam: Beam = CONCRETE_BEAM,
    method: Literal["amg", "direct"] = "amg",
) -> float:
    """Tip displacement [m] along ``load`` with quadratic tetrahedra: 92.645 um by default.

    ``cells`` of six tetrahedra along x, y, z, even numbers for a node at the tip.  The end load
    [N] is a uniform traction; equal shares on the end's nodes, as in the paper, give the same to
    1e-6.  The limit is near 92.66 um: what linear tetrahedra miss is measured from there, while
    QDEM must give the linear answer of its own mesh.
    """
    import skfem
    from skfem.models.elasticity import linear_elasticity

    sides = zip((beam.length, beam.width, beam.height), cells, strict=True)
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, side, n + 1) for side, n in sides))
    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, element, intorder=2)
    moduli = (float(value) for value in find_lame(beam.young, beam.poisson))
    matrix = skfem.asm(linear_elasticity(*moduli), basis).tocsr()
    end = mesh.facets_satisfying(lambda x: np.isclose(x[0], beam.length))
    traction = skfem.LinearForm(lambda v, w: load / beam.area * v[2])
    force = skfem.asm(traction, skfem.FacetBasis(mesh, element, facets=end))
    # scikit-fem puts the edges' middles after the nodes, three numbers each: again 3*i + c
    places = basis.doflocs[:, ::3].T
    held = places[:, 0] < 1e-9 * beam.length
    answer = solve_static(matrix, ~held, force, places, method, tolerance=1e-8)
    middle = [beam.length, beam.width / 2, beam.height / 2]
    tip = np.argmin(np.linalg.norm(places - middle, axis=1))
    return float(answer.displacement[tip, 2])
