"""A body of quadratic tetrahedra: ten nodes an element, on the user's linear mesh."""

from functools import cached_property
from typing import Any

import numpy as np

from qdem_fem import element
from qdem_fem.bodies.deformable import Body, Rigid
from qdem_fem.files import ConditionError, Floats, Integers
from qdem_fem.kernel.cpu import OTHER, OWN
from qdem_fem.mesh import EDGES, find_middles, split_faces

BARYCENTRIC = OTHER + (OWN - OTHER) * np.eye(4)
"""Of the four points of integration, (points, corners) [-]."""


class QuadraticBody(Body):
    """Quadratic tetrahedra of one viscoelastic body, for bodies that bend.

    Arguments and errors as of `Body`; the mesh is linear, and a node is added amid each edge.
    ``nodes`` are the user's own, then these; ``elements`` (m, 4) stay the user's own.  A condition
    acts on a node amid an edge where it names both ends of the edge, as it is one support then
    whatever the mesh.  Stress is the mean over an element; faces are four flat triangles each.

    Masses are those of Hinton, Rock and Zienkiewicz (1976): in proportion to the diagonal of the
    consistent matrix, 1/36 of an element's at a corner, 4/27 amid an edge.  The critical step is
    a third of that of `Body` on the same mesh.  Not for short waves: `Body` is cheaper there.
    """

    ELEMENT = "quadratic"
    MASS_SHARES = (1 / 36,) * 4 + (4 / 27,) * 6

    def __init__(
        self, mesh: Any, material: element.Material, name: str = "body", *, rigid: Rigid = False
    ) -> None:
        super().__init__(mesh, material, name, rigid=rigid)
        if rigid:
            raise ConditionError(
                f"{name} is rigid, and nothing within it deforms", where="element",
                remedy="leave out element, or rigid",
            )  # fmt: skip
        corners = self.mesh.nodes
        self._corners = len(corners)
        self._edges, self._ten = find_middles(self.elements, self._corners)
        self._nodes = np.concatenate([corners, corners[self._edges].mean(axis=1)])
        self._displacement, self._velocity = np.zeros((2, *self._nodes.shape))

    @property
    def nodes(self) -> Floats:
        """Reference coordinates X [m], (n, 3): the corners, then the nodes amid edges."""
        return self._nodes

    @property
    def element_nodes(self) -> Integers:
        """Corners, then the nodes amid the edges `qdem_fem.mesh.EDGES`, (m, 10)."""
        return self._ten

    @cached_property
    def surface(self) -> Integers:
        """Nodes of the outward surface triangles, four a face, (k, 3)."""
        return split_faces(super().surface, self._edges, self._corners)

    def find_shape_gradients(self, part: slice = slice(None)) -> Floats:
        """grad_X N_a at the four points of integration [1/m], (m, 4, 10, 3).

        ``N_a = (2 L_a - 1) L_a`` at corners, ``4 L_a L_b`` amid edges.
        """
        linear = super().find_shape_gradients(part)
        corners = (4 * BARYCENTRIC - 1)[..., None] * linear
        a, b = EDGES.T
        first, second = BARYCENTRIC[:, a, None], BARYCENTRIC[:, b, None]
        middles = 4 * (first * linear[:, :, b] + second * linear[:, :, a])
        return np.concatenate([corners, middles], axis=2)

    def find_gradient(self, displacement: Floats) -> Floats:
        """H at the four points of the elements [-], (4, m, 3, 3), of displacements (n, 3) [m]."""
        u = displacement[self._ten]
        return np.einsum(
            "mai,mpaj->pmij", u[:, 1:] - u[:, :1], self.find_shape_gradients()[:, :, 1:],
            optimize=True,
        )  # fmt: skip

    def stress(self) -> Floats:
        """Elastic Cauchy stress [Pa], mean over the four points of each element, (m, 3, 3)."""
        return np.asarray(super().stress().mean(axis=0))

    def elastic_energy(self, displacement: Floats, strain: element.Strain) -> Floats:
        """Stored energy of the elements [J], (m,), at a displacement (n, 3) [m]."""
        return np.asarray(super().elastic_energy(displacement, strain).mean(axis=0))

    def select_nodes(self, nodes: Any, where: str) -> Integers:
        """As `Body.select_nodes`; of a condition, a node amid an edge goes with both its ends."""
        chosen = super().select_nodes(nodes, where)
        if where.startswith("probe"):
            return chosen
        named = np.zeros(len(self.nodes), bool)
        named[chosen] = True
        named[self._corners :] = named[self._edges].all(axis=1)
        if not named.any():
            raise ConditionError(
                f"the selection names nodes amid edges of {self.name} and no corner", where=where,
                remedy="a node amid an edge goes with both corners that it lies between: name them",
            )  # fmt: skip
        return np.flatnonzero(named)
