"""Natural modes of a free body, and what kind of motion of a beam each of them is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from qdem_fem.element import Material
from qdem_fem.files import NotConverged
from qdem_fem.mesh import FloatArray, TetMesh, element_gradients, lumped_mass

Kind = Literal["vertical", "lateral", "torsion", "axial"]
SHIFT = -1.0
"""Where K - sigma M is inverted, over (2 pi)^2 f^2 of a wave along the body."""
GAP = 1e-4
"""A motion with less than this share of the highest frequency sought has no strain."""
SECTIONS = 24
"""Slices of a beam by which a mode is told."""


@dataclass(frozen=True)
class FreeModes:
    """Lowest modes with strain of a body that nothing holds."""

    frequency: FloatArray
    """[Hz], (count,), ascending."""
    shape: FloatArray
    """Displacement of the nodes of the mesh, largest component 1, (count, n, 3)."""
    kind: tuple[Kind, ...]


def find_free_modes(
    mesh: TetMesh, material: Material, count: int = 8, quadratic: bool = False
) -> FreeModes:
    """Modes of K phi = (2 pi f)^2 M phi, without those of a rigid body.

    Linear tetrahedra with QDEM's lumped mass: the frequencies of QDEM on this mesh, for small
    steps.  ``quadratic``: ten-node tetrahedra with their consistent mass on the same mesh, near
    those of the shape.  x is the long axis, z up.  One material for the whole body.  K - sigma M
    with sigma < 0 is factorised, by SuperLU: for up to about 20,000 nodes, of either kind.

    Raises `NotConverged` if there are motions without strain besides the six of a rigid body.
    """
    import skfem
    from skfem.models.elasticity import linear_elasticity

    grid = skfem.MeshTet(mesh.nodes.T.copy(), mesh.elements.T.copy())
    element = skfem.ElementTetP2() if quadratic else skfem.ElementTetP1()
    basis = skfem.Basis(grid, skfem.ElementVector(element), intorder=2 if quadratic else 0)
    stiffness = linear_elasticity(material.lame_first, material.lame_second).assemble(basis)
    dofs = basis.nodal_dofs
    if quadratic:
        from skfem.helpers import dot

        exact = skfem.Basis(grid, skfem.ElementVector(element), intorder=4)
        form = skfem.BilinearForm(lambda u, v, w: dot(u, v))
        mass = material.density * form.assemble(exact)
    else:
        _, volumes = element_gradients(mesh.nodes, mesh.elements)
        nodal = lumped_mass(mesh.elements, volumes, material.density, len(mesh.nodes))
        own = np.empty(stiffness.shape[0])
        own[dofs] = nodal
        mass = diags(own)
    wave = float(np.max(material.wave_speed)) / float(np.ptp(mesh.nodes[:, 0]))
    value, vector = _modes_with_strain(
        csc_matrix(stiffness), csc_matrix(mass), _rigid_motions(basis), SHIFT * wave**2, count
    )
    if not value[0] > GAP**2 * value[-1]:
        raise NotConverged(
            f"squares of the first frequencies {value.tolist()}: more than six motions are without "
            "strain",
            where="free_modes",
            remedy="check that the mesh is one connected body",
        )
    shape = vector.T[:, dofs].transpose(0, 2, 1)
    shape = shape / np.abs(shape).max(axis=(1, 2), keepdims=True)
    frequency = np.sqrt(value) / 2 / np.pi
    return FreeModes(frequency, shape, tuple(mode_kind(mesh.nodes, one) for one in shape))


def _rigid_motions(basis: Any) -> FloatArray:
    """The six motions of a rigid body, by the freedoms of skfem's ``basis``, (freedoms, 6)."""
    axis = np.empty(basis.N, dtype=int)
    for of_places in (basis.nodal_dofs, basis.edge_dofs):
        axis[of_places] = np.arange(len(of_places))[:, None]
    arm = basis.doflocs.T - basis.doflocs.mean(axis=1)
    size = np.abs(arm).max()
    turns = [np.cross(about, arm / size)[np.arange(basis.N), axis] for about in np.eye(3)]
    return np.stack([*(axis == np.arange(3)[:, None]), *turns], axis=1)


def _modes_with_strain(
    stiffness: csc_matrix, mass: csc_matrix, rigid: FloatArray, shift: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """(2 pi f)^2 [1/s^2], (count,), ascending, and vectors, without the ``rigid`` motions (n, 6).

    Those are known, and one value six times over: Lanczos' method, which sees of equal values
    what rounding shows it, now and then found five.  So they are taken out of every vector.
    """
    unit = np.linalg.solve(np.linalg.cholesky(rigid.T @ (mass @ rigid)), rigid.T)
    factors = splu(csc_matrix(stiffness - shift * mass))

    def strained(x: FloatArray) -> FloatArray:
        return np.asarray(x - unit.T @ (unit @ (mass @ x)))

    inverse = LinearOperator(mass.shape, matvec=lambda b: strained(factors.solve(b)), dtype=float)
    start = strained(np.random.default_rng(0).normal(size=mass.shape[0]))
    value, vector = eigsh(stiffness, k=count, M=mass, sigma=shift, OPinv=inverse, v0=start)
    order = np.argsort(value)
    return value[order], vector[:, order]


def mode_kind(nodes: FloatArray, shape: FloatArray) -> Kind:
    """The motion of the sections of a beam along x that has most of the mode's square.

    ``nodes`` (n, 3) [m], ``shape`` (n, 3).  In every slice along x the mean of u_z, u_y, u_x over
    its nodes, and the rotation about x through their middle times its radius of gyration.
    """
    edges = np.linspace(nodes[:, 0].min(), nodes[:, 0].max(), SECTIONS + 1)
    at = np.clip(np.searchsorted(edges, nodes[:, 0], side="right") - 1, 0, SECTIONS - 1)
    share: dict[Kind, float] = {"vertical": 0.0, "lateral": 0.0, "torsion": 0.0, "axial": 0.0}
    for one in range(SECTIONS):
        x, u = nodes[at == one], shape[at == one]
        if len(x) < 2:  # no section: it neither turns nor weighs much
            continue
        mean = u.mean(axis=0)
        y, z = (x - x.mean(axis=0)).T[1:]
        gyration = (y**2 + z**2).sum()
        turn = (y * u[:, 2] - z * u[:, 1]).sum() / gyration
        share["axial"] += len(x) * mean[0] ** 2
        share["lateral"] += len(x) * mean[1] ** 2
        share["vertical"] += len(x) * mean[2] ** 2
        share["torsion"] += turn**2 * gyration
    return max(share, key=lambda kind: share[kind])
