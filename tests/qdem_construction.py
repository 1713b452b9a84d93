"""The construction of QDEM as the paper prints it, step by step (Nishiura et al. 2017, sec. 2).

Four particles sit on the vertices of a tetrahedron.  Their positions give its deformation
gradient (eq. 1), strain and stress (eqs 2-8); twelve triangles inside cut it into four cells of a
quarter of its volume, one for each particle; the stress pulls at the triangles (eq. 9), each cell
sums its triangles (eq. 10), each particle its cells (eq. 11).

This module is for reading and checking: it forms every triangle.  What a simulation uses is the
same force in closed form, f_a = -V0 T cof(F) grad_X N_a (`tests.qdem_reference_forces`): QDEM's
particles are the nodes, its cells the dual cells, of linear finite elements with lumped mass.

Two traps in the printed text.

Sign: eq. 9 takes n "from the triangle surface to the corresponding vertex", into the cell.  But
Cauchy's t = T n is the traction on a body whose *outward* normal is n, so eq. 10 as printed is
minus the force on the particle: a stretched tetrahedron would push its particles further apart.
The functions here use the outward normal.

Count: process 2 announces six triangles with the volume centroid and lists five; the missing one
is <vc, fc_124, fc_134>, between the cells of particles 1 and 4.

A shape ``(..., 4, 3)`` is one tetrahedron (4, 3) or an array of them (m, 4, 3), with vertices in
the order that gives a positive volume; material constants are floats or (m,) arrays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import apply_hooke
from qdem_fem.files import Floats, Integers

INTERFACES = ((0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 2, 0), (2, 3, 0, 1))
"""The cells of vertices i and j meet in the kite <ec_ij, fc_ijk, vc, fc_ijl>.  Each (i, j, k, l)
is an even permutation, so that the normal of the kite run through in this order is towards j."""


# --- stress of a tetrahedron: eqs 1 to 8 -------------------------------------------------------


def edge_vectors(vertices: Floats) -> Floats:
    """Columns: the vectors from vertex 0 to the other three, (..., 4, 3) -> (..., 3, 3).

    Of positions [m] this is dX or dx of eq. 1, of velocities [m/s] it is dv of eq. 5.  The rows
    of dX^-1 are the gradients of the linear shape functions N_1, N_2, N_3 [1/m].
    """
    return np.swapaxes(vertices[..., 1:, :] - vertices[..., :1, :], -1, -2)


def deformation_gradient(reference: Floats, current: Floats) -> Floats:
    """F = dx dX^-1 [-], (..., 3, 3), from positions (..., 4, 3) [m] (eq. 1)."""
    return edge_vectors(current) @ np.linalg.inv(edge_vectors(reference))


def strain_finger(deformation: Floats) -> Floats:
    """eps = (B - I)/2 [-], (..., 3, 3), with B = F F^T (eqs 3, 4): the left Green strain.

    Below strains of 1e-8 the difference B - I loses its digits; `tests.qdem_reference_forces` has
    the form without cancellation.
    """
    return (deformation @ np.swapaxes(deformation, -1, -2) - np.eye(3)) / 2


def velocity_gradient(current: Floats, velocity: Floats) -> Floats:
    """L = dv dx^-1 [1/s], (..., 3, 3), from positions [m] and velocities [m/s] (eq. 5)."""
    return edge_vectors(velocity) @ np.linalg.inv(edge_vectors(current))


def strain_rate(velocity_gradient: Floats) -> Floats:
    """D = (L + L^T)/2 [1/s], (..., 3, 3); the spin W = L - D makes no stress (eq. 6)."""
    return (velocity_gradient + np.swapaxes(velocity_gradient, -1, -2)) / 2


# --- the four cells of a tetrahedron: processes 1 to 3 -----------------------------------------


def volume(vertices: Floats) -> Floats:
    """V = dX_1 . (dX_2 x dX_3)/6 [m^3], (...): positive for a right-handed tetrahedron."""
    first, second, third = np.moveaxis(edge_vectors(vertices), -1, 0)
    return np.asarray(np.sum(first * np.cross(second, third), axis=-1) / 6)


def interior_triangles(vertices: Floats) -> Floats:
    """Corners [m] of the 12 triangles, (..., 6, 2, 3, 3): interface, triangle, corner, x y z.

    The interface of the cells of i and j, `INTERFACES`, is <ec_ij, fc_ijk, fc_ijl> (triangle 0)
    and <vc, fc_ijl, fc_ijk> (triangle 1); the right-hand normal of both is towards vertex j.
    They lie in one plane, since fc_ijk - ec = (x_k - ec)/3 and vc - ec is the mean of
    (x_k - ec)/2 and (x_l - ec)/2.
    """
    x = np.moveaxis(np.asarray(vertices, float), -2, 0)
    volume_centroid = (x[0] + x[1] + x[2] + x[3]) / 4
    pairs = []
    for i, j, k, l in INTERFACES:  # noqa: E741
        edge_centroid = (x[i] + x[j]) / 2
        face_k, face_l = (x[i] + x[j] + x[k]) / 3, (x[i] + x[j] + x[l]) / 3
        outer = np.stack([edge_centroid, face_k, face_l], axis=-2)
        inner = np.stack([volume_centroid, face_l, face_k], axis=-2)
        pairs.append(np.stack([outer, inner], axis=-3))
    return np.stack(pairs, axis=-4)


def area_vector(triangle: Floats) -> Floats:
    """S n = a x b / 2 [m^2], (..., 3), of triangles with corners (..., 3, 3) [m] (eq. 9)."""
    a = triangle[..., 1, :] - triangle[..., 0, :]
    b = triangle[..., 2, :] - triangle[..., 0, :]
    return np.asarray(np.cross(a, b) / 2)


# --- from stress to forces on particles: eqs 9 to 11 --------------------------------------------


def force_on_triangle(stress: Floats, area_vector: Floats) -> Floats:
    """f = T n S = T (a x b)/2 [N], (..., 3) (eq. 9)."""
    return np.einsum("...ij,...j->...i", stress, area_vector)


def cell_forces(vertices: Floats, stress: Floats) -> Floats:
    """f_j: sum of the forces on the triangles of cell j [N], (..., 4, 3) (eq. 10).

    ``vertices`` (..., 4, 3) [m] are the current ones, ``stress`` (..., 3, 3) [Pa] is Cauchy's.
    Normals point out of the cell, which restores.
    """
    triangles = area_vector(interior_triangles(vertices))
    forces = np.zeros(np.shape(vertices))
    for interface, (i, j, _, _) in enumerate(INTERFACES):
        for triangle in range(2):
            f = force_on_triangle(stress, triangles[..., interface, triangle, :])
            forces[..., i, :] += f  # the normal is towards j: out of cell i,
            forces[..., j, :] -= f  # and into cell j
    return forces


def particle_forces(elements: Integers, cell_forces: Floats, count: int) -> Floats:
    """p_i: sum of the forces on all cells of particle i [N], (count, 3) (eq. 11).

    ``elements`` (m, 4) names the particles on the vertices, ``cell_forces`` is (m, 4, 3) [N].
    """
    forces = np.zeros((count, 3))
    np.add.at(forces, elements, cell_forces)
    return forces


def internal_forces_constructed(
    nodes: Floats,
    elements: Integers,
    displacement: Floats,
    velocity: Floats,
    lame: tuple[ArrayLike, ArrayLike],
    viscous: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
) -> Floats:
    """Internal forces on all particles [N], (n, 3): the whole of section 2, eqs 1 to 11.

    ``nodes`` (n, 3) [m] reference positions, ``displacement`` (n, 3) [m], ``velocity`` (n, 3)
    [m/s], ``elements`` (m, 4); ``lame`` = (lambda_E, mu_E) [Pa], ``viscous`` = (lambda_D, mu_D)
    [Pa s], each a float or (m,).
    """
    reference, current = nodes[elements], (nodes + displacement)[elements]
    strain = strain_finger(deformation_gradient(reference, current))
    rate = strain_rate(velocity_gradient(current, velocity[elements]))
    stress = apply_hooke(strain, *lame) + apply_hooke(rate, *viscous)  # eqs 2, 7 and 8
    forces = cell_forces(current, stress)
    return particle_forces(elements, forces, len(nodes))
