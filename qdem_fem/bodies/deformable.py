"""A body: its mesh, its material, and its state as the user sees it."""

from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem import element
from qdem_fem.bodies.rigid_mass import RigidMass, compute_rigid_mass
from qdem_fem.files import ConditionError, Floats, Integers, MaterialError, warn_user
from qdem_fem.mesh import TetMesh, find_gradients, find_surface_faces, read_mesh
from trackbed.plausible import describe_implausible

Rigid = bool | Literal["lumped"]
"""Whether a body is rigid, and with which inertia; `Body` says what each means."""


class Body:
    """Linear tetrahedra of one viscoelastic body.

    ``mesh``: a `skfem.MeshTet`, a `meshio.Mesh`, a pair ``(nodes (n, 3) [m], elements (m, 4))``, a
    `qdem_fem.mesh.tetrahedra.TetMesh` or the path of a mesh file.  Left-handed elements are turned
    (``mesh.flipped`` lists them).  Numbers of nodes and elements stay the user's own.
    ``rigid``: the body has six freedoms and no strain; of its material only density and Poisson's
    ratio (in contact) count.  ``"lumped"``: with the inertia of quarter masses at its nodes, which
    a deformable body of this mesh has, instead of the solid's (`qdem_fem.bodies.rigid_mass`).
    Raises `MeshError`, `MaterialError`; warns of a body above 100 m.
    """

    ELEMENT = "linear"
    MASS_SHARES: tuple[float, ...] = (1 / 4,) * 4
    """Of an element's mass, at each of its nodes [-]."""

    def __init__(
        self, mesh: Any, material: element.Material, name: str = "body", *, rigid: Rigid = False
    ) -> None:
        if not isinstance(name, str):
            raise ConditionError(f"{name!r} is no name", where="body", remedy="give a text")
        if not isinstance(material, element.Material):
            raise MaterialError(
                f"a {type(material).__name__} is no material",
                where=name, remedy="give Material(young, poisson, density)",
            )  # fmt: skip
        if rigid not in (False, True, "lumped"):
            raise ConditionError(
                f"rigid is {rigid!r}", where=name, remedy='give True, False or "lumped"'
            )
        self.name, self.rigid = name, rigid
        self.mesh = mesh if isinstance(mesh, TetMesh) else read_mesh(mesh, where=name)
        size = float(np.ptp(self.mesh.nodes, axis=0).max())
        if said := describe_implausible("body", size, f"body {name!r} (its mesh's scale)"):
            warn_user(said)
        self.material = material.broadcast(len(self.mesh.elements))
        self._displacement = np.zeros_like(self.mesh.nodes)
        self._velocity = np.zeros_like(self.mesh.nodes)
        self.mover: Any = None
        """The `qdem_fem.Simulation` that the body is in, which has its fields while it is."""

    @property
    def nodes(self) -> Floats:
        """Reference coordinates X [m], (n, 3)."""
        return self.mesh.nodes

    @property
    def elements(self) -> Integers:
        """Nodes of the right-handed elements, (m, 4)."""
        return self.mesh.elements

    @property
    def element_nodes(self) -> Integers:
        """All nodes of the elements, (m, nodes of an element)."""
        return self.elements

    @cached_property
    def surface(self) -> Integers:
        """Nodes of the outward surface triangles, (k, 3)."""
        return find_surface_faces(self.elements, self.name)

    @cached_property
    def gradients(self) -> tuple[Floats, Floats]:
        """Reference gradients of the shape functions [1/m], (m, 3, 3), and volumes [m^3], (m,)."""
        return find_gradients(self.nodes, self.elements)

    def find_shape_gradients(self, part: slice = slice(None)) -> Floats:
        """grad_X N_a at the points of integration of some elements [1/m], (m, points, nodes, 3)."""
        gradients = self.gradients[0][part]
        first = -gradients.sum(axis=1, keepdims=True)
        return np.concatenate([first, gradients], axis=1)[:, None]

    def find_gradient(self, displacement: Floats) -> Floats:
        """H of the elements [-], (m, 3, 3), of displacements (n, 3) [m]; of several points in an
        element (points, m, 3, 3)."""
        return element.find_displacement_gradient(self.gradients[0], self.elements, displacement)

    @cached_property
    def rigid_mass(self) -> RigidMass:
        """Mass, centre and inertia as a rigid body."""
        mass = np.asarray(self.material.density) * self.gradients[1]
        return compute_rigid_mass(self.nodes, self.elements, mass, lumped=self.rigid == "lumped")

    @property
    def displacement(self) -> Floats:
        """Displacement of the nodes [m], (n, 3), a copy: a part of it that is set changes nothing.

        Set all of it, before or between advances: ``body.displacement = ...``.
        """
        if self.mover is not None:
            return self.mover.field_of(self, "displacement")
        return self._displacement.copy()

    @displacement.setter
    def displacement(self, value: ArrayLike) -> None:
        field = self._check_field(value, "displacement")
        if self.mover is not None:
            self.mover.set_field(self, "displacement", field)
        self._displacement = field

    @property
    def velocity(self) -> Floats:
        """Velocity of the nodes [m/s], (n, 3), at the time of the displacement, a copy."""
        if self.mover is not None:
            return self.mover.field_of(self, "velocity")
        return self._velocity.copy()

    @velocity.setter
    def velocity(self, value: ArrayLike) -> None:
        field = self._check_field(value, "velocity")
        if self.mover is not None:
            self.mover.set_field(self, "velocity", field)
        self._velocity = field

    @property
    def strain(self) -> element.Strain:
        """The strain measure of the simulation the body is in; the paper's outside of one."""
        return self.mover.strain if self.mover is not None else "finger"

    def stress(self) -> Floats:
        """Elastic Cauchy stress of the elements [Pa], (m, 3, 3) (eq. 2); zero of a rigid body."""
        if self.rigid:
            return np.zeros((len(self.elements), 3, 3))
        gradient = self.find_gradient(self.displacement)
        nominal = element.MEASURES[self.strain].compute_nominal_stress(
            gradient, self.material.lame_first, self.material.lame_second
        )
        return element.compute_cauchy_stress(gradient, nominal, self.strain)

    def elastic_energy(self, displacement: Floats, strain: element.Strain) -> Floats:
        """Stored energy of the elements [J], (m,), at a displacement (n, 3) [m]."""
        found: Floats = element.MEASURES[strain].compute_stored_energy(
            self.find_gradient(displacement), self.gradients[1],
            self.material.lame_first, self.material.lame_second,
        )  # fmt: skip
        return found

    def von_mises(self) -> Floats:
        """Von Mises stress of the elements [Pa], (m,)."""
        return element.find_von_mises(self.stress())

    def select_nodes(self, nodes: Any, where: str) -> Integers:
        """Node numbers of a selection: a mask (n,), an index or indices.

        Raises `ConditionError` for a selection that is empty, out of range or of another type.
        """
        count = len(self.nodes)
        try:
            chosen = np.asarray(nodes)
        except ValueError as error:
            raise ConditionError(f"no selection of nodes ({error})", where=where) from None
        if chosen.dtype == bool:
            if chosen.shape != (count,):
                raise ConditionError(
                    f"a mask of shape {chosen.shape} for the {count} nodes of {self.name}",
                    where=where,
                )
            chosen = np.flatnonzero(chosen)
        elif chosen.dtype.kind not in "iu" and chosen.size:
            raise ConditionError(
                f"nodes are named by a mask or by whole numbers, not by {chosen.dtype}", where=where
            )
        elif chosen.shape == (count,) and count > 2 and np.isin(chosen, (0, 1)).all():
            raise ConditionError(
                "these numbers, all 0 or 1, look like a mask", where=where, remedy="make it bool"
            )
        chosen = np.unique(chosen.ravel().astype(np.int64))
        if not chosen.size:
            raise ConditionError(
                f"the selection names no node of {self.name}",
                where=where,
                remedy="check the coordinates it asks for against body.nodes and its tolerance",
            )
        if chosen[0] < -count or chosen[-1] >= count:
            raise ConditionError(
                f"node {chosen[-1] if chosen[-1] >= count else chosen[0]} is not one of the "
                f"{count} nodes of {self.name}",
                where=where,
            )
        chosen = np.unique(chosen % count)
        unused = np.intersect1d(chosen, self.mesh.unused)
        if unused.size == chosen.size:
            raise ConditionError(
                f"the selection names only nodes that no element of {self.name} uses",
                where=where,
                remedy="choose nodes of elements, or remove the unused nodes from the mesh",
            )
        return np.setdiff1d(chosen, unused)

    def _check_field(self, value: ArrayLike, what: str) -> Floats:
        try:
            field = np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise ConditionError(f"a {what} of numbers is needed", where=self.name) from None
        if field.shape != self.nodes.shape:
            raise ConditionError(
                f"a {what} has the shape {self.nodes.shape}; this one has {field.shape}",
                where=self.name,
            )
        if not np.isfinite(field).all():
            node = int(np.flatnonzero(~np.isfinite(field).all(axis=1))[0])
            raise ConditionError(
                f"the {what} of node {node} is {field[node].tolist()}", where=self.name
            )
        return field
