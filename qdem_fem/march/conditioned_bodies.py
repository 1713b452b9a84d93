"""Bodies and the conditions that a user gives them."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.bodies import COMPONENTS, Body, Held, NodalLoad, Roller
from qdem_fem.contact.search import find_partners
from qdem_fem.files import ConditionError, Driver, Floats, Integers, Value
from qdem_fem.march.leapfrog import level_velocities
from qdem_fem.march.state import State
from qdem_fem.mesh import find_faces_within, find_pressure_forces

C = TypeVar("C", NodalLoad, Held, Roller)


class ConditionedBodies(State):
    """The words that give bodies conditions: what holds, moves and loads them.

    Base of `qdem_fem.Simulation`.  A selection of nodes is a mask (n,), an index or indices.
    """

    def fix(self, body: Body, nodes: Any, components: str = "xyz") -> Held:
        """Hold components of nodes where they are in the reference configuration."""
        chosen = self._components(components, "fix")
        return self._add(self.conditions.held, Held(self._nodes(body, nodes, "fix"), chosen))

    def prescribe(
        self, body: Body, nodes: Any, component: str, displacement: Value,
        profile: ArrayLike | None = None,
    ) -> Held:  # fmt: skip
        """Give one component of the displacement [m], constant or changing with time.

        ``profile`` (n,) [-], one number for every node of the body, multiplies it.
        """
        chosen = self._components(component, "prescribe")
        driver = Driver(displacement, 1, "prescribe")
        here = self._nodes(body, nodes, "prescribe")
        factor = self._profile(body, here, profile, 1.0, "prescribe")
        return self._add(self.conditions.held, Held(here, chosen, driver, factor))

    def roller(self, body: Body, nodes: Any, normal: ArrayLike) -> Roller:
        """Keep nodes in the plane through them with this normal, free within it."""
        try:
            direction = np.asarray(normal, dtype=float)
        except (TypeError, ValueError):
            direction = np.zeros(3)
        length = float(np.linalg.norm(direction)) if direction.shape == (3,) else 0.0
        if not (np.isfinite(length) and length > 0):
            raise ConditionError(
                f"{normal!r} is no direction", where="roller", remedy="give three components"
            )
        self._check_deformable(body, "roller", "fix components of its nodes")
        roller = Roller(self._nodes(body, nodes, "roller"), direction / length)
        return self._add(self.conditions.rollers, roller)

    def load(
        self, body: Body, nodes: Any, force: Value, profile: ArrayLike | None = None
    ) -> NodalLoad:
        """A total ``force`` [N], three components, shared equally by the nodes (section 3.1).

        With ``profile`` (n,) [-], one number for every node of the body, a node bears that share.
        """
        chosen = self._nodes(body, nodes, "load")
        share = self._profile(body, chosen, profile, 1 / len(chosen), "load")
        weights = np.repeat(share[:, None], 3, axis=1)
        return self._add(
            self.conditions.loads, NodalLoad(chosen, weights, Driver(force, 3, "load"))
        )

    def pressure(self, body: Body, nodes: Any, pressure: Value) -> NodalLoad:
        """A ``pressure`` [Pa] along the inward reference normal of the faces within ``nodes``."""
        chosen = self._nodes(body, nodes, "pressure")
        local = chosen - self._offset(body)
        mask = np.zeros(len(body.nodes), dtype=bool)
        mask[local] = True
        faces = find_faces_within(body.surface, mask)
        if not len(faces):
            raise ConditionError(
                f"no surface face of {body.name} has all three nodes in the selection",
                where="pressure",
            )
        areas = find_pressure_forces(body.nodes, faces, len(body.nodes))[local]
        driver = Driver(pressure, 1, "pressure")
        return self._add(self.conditions.loads, NodalLoad(chosen, areas, driver))

    def periodic(self, body: Body, nodes_a: Any, nodes_b: Any, tolerance: float = 1e-6) -> None:
        """Join opposite faces: every node of ``nodes_b`` moves as its partner of ``nodes_a``.

        The faces differ by one shift along an axis; partners are found by the other two
        coordinates within ``tolerance`` of the body's size.  Before the first advance only.
        """
        if self.begun:
            raise ConditionError(
                "the simulation has begun",
                where="periodic",
                remedy="join faces before the first advance and before asking for its step",
            )
        self._check_deformable(body, "periodic", "leave it deformable")
        a, b = (body.select_nodes(nodes, "periodic") for nodes in (nodes_a, nodes_b))
        first = self._offset(body)
        one, other = find_partners(body.nodes, a, b, tolerance, body.name)
        for i, j in zip(one + first, other + first, strict=True):
            i, j = self.master[i], self.master[j]
            self.master[self.master == max(i, j)] = min(i, j)

    def remove(self, condition: NodalLoad | Held | Roller) -> None:
        """Take back a condition that `fix`, `load` and the like returned."""
        every = self.conditions
        lists: tuple[list[Any], ...] = every.loads, every.held, every.rollers
        for conditions in lists:
            if condition in conditions:
                level_velocities(self)
                conditions.remove(condition)
                self.note_conditions_changed(ties=not isinstance(condition, NodalLoad))
                return
        raise ConditionError("it is none of the simulation's conditions", where="remove")

    def _offset(self, body: Body) -> int:
        start = self.starts.get(id(body))
        if start is None:
            name = body.name if isinstance(body, Body) else f"a {type(body).__name__}"
            raise ConditionError(
                f"{name} is not a body of this simulation",
                where="body", remedy="the first argument is one of the bodies it was made of",
            )  # fmt: skip
        return start

    def _nodes(self, body: Body, nodes: Any, where: str) -> Integers:
        start = self._offset(body)
        return body.select_nodes(nodes, where) + start

    def _probe(self, name: str, probe: Any) -> Integers:
        if isinstance(probe, tuple) and len(probe) == 2 and isinstance(probe[0], Body):
            return self._nodes(probe[0], probe[1], f"probe {name}")
        if len(self.bodies) > 1:
            raise ConditionError(
                "with several bodies a probe is a pair (body, nodes)", where=f"probe {name}"
            )
        return self._nodes(self.bodies[0], probe, f"probe {name}")

    @staticmethod
    def _components(components: str, where: str) -> tuple[int, ...]:
        if not isinstance(components, str) or not components or set(components) - set(COMPONENTS):
            raise ConditionError(f"components are of 'xyz', not {components!r}", where=where)
        return tuple(sorted({COMPONENTS.index(c) for c in components}))

    def _profile(
        self, body: Body, nodes: Integers, profile: ArrayLike | None, default: float, where: str
    ) -> Floats:
        """Factors of the chosen nodes, (k,)."""
        if profile is None:
            return np.full(len(nodes), default)
        try:
            every = np.asarray(profile, dtype=float)
        except (TypeError, ValueError):
            every = np.zeros(0)
        if every.shape != (len(body.nodes),) or not np.isfinite(every).all():
            raise ConditionError(
                f"a profile has one finite number for each of the {len(body.nodes)} nodes of "
                f"{body.name}",
                where=where,
            )
        return every[nodes - self._offset(body)]

    def _add(self, conditions: list[C], condition: C) -> C:
        level_velocities(self)
        conditions.append(condition)
        self.note_conditions_changed(ties=not isinstance(condition, NodalLoad))
        return condition

    @staticmethod
    def _check_deformable(body: Body, where: str, remedy: str) -> None:
        if body.rigid:
            raise ConditionError(f"{body.name} is rigid", where=where, remedy=remedy)
