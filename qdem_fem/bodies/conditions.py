"""Boundary conditions and loads: what the user asked for, and the lists the kernel walks."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from qdem_fem.files import ConditionError, Driver, Floats, Integers
from qdem_fem.kernel.cpu import Constraints, Loads, Packed

COMPONENTS = "xyz"
PARALLEL = 1e-9
"""A direction of a normal smaller than this is none."""


@dataclass(eq=False)
class NodalLoad:
    """Forces ``weights[i, c] x driver[s]`` on the nodes, with ``s = c`` or 0 for one column."""

    nodes: Integers  # numbers in the simulation, (k,)
    weights: Floats  # (k, 3): shares of a total force [-], or areas under a pressure [m^2]
    driver: Driver


@dataclass(eq=False)
class Held:
    """Components of nodes whose displacement is given; no driver: zero."""

    nodes: Integers
    components: tuple[int, ...]
    driver: Driver | None = None
    factor: Floats | None = None  # of the driver, by node, (k,); None: 1


@dataclass(eq=False)
class Roller:
    """Nodes that stay in a plane of unit normal ``normal`` (3,)."""

    nodes: Integers
    normal: Floats


@dataclass
class Conditions:
    """All conditions of a simulation, in the order in which they were given."""

    loads: list[NodalLoad] = field(default_factory=list)
    held: list[Held] = field(default_factory=list)
    rollers: list[Roller] = field(default_factory=list)

    def drivers(self) -> list[Driver]:
        """What changes with time, each once, loads first."""
        return [load.driver for load in self.loads] + [
            held.driver for held in self.held if held.driver is not None
        ]

    def table(self, times: Floats) -> Floats:
        """Amplitudes (k, series) at ``times`` (k,); column 0 is one, for what is constant."""
        columns = [np.ones((len(times), 1))]
        columns += [driver.sample(times) for driver in self.drivers()]
        return np.ascontiguousarray(np.concatenate(columns, axis=1))  # kernels compile once

    def pack_loads(self, packed: Packed, place: Integers) -> Loads:
        """The kernel's list of forces; ``place`` (n,) is the kernel's number of a node."""
        at, series, weight, column = [], [], [], 1
        for load in self.loads:
            several = load.driver.components > 1
            for c in range(3):
                acting = load.weights[:, c] != 0
                at.append(4 * place[load.nodes[acting]] + c)
                weight.append(load.weights[acting, c])
                series.append(np.full(acting.sum(), column + c * several))
            column += load.driver.components
        node_at, all_series, weights = _join(at), _join(series), _join(weight)
        return Loads(
            force_at=node_at + packed.node_window[node_at // 4],
            node_at=node_at,
            series=all_series,
            weight=weights.astype(float),
        )

    def pack_constraints(self, place: Integers) -> Constraints:
        """The kernel's list of given displacements; of two for one component the later counts."""
        column = 1 + sum(load.driver.components for load in self.loads)
        given: dict[int, tuple[int, float]] = {}
        for held in self.held:
            series = 0 if held.driver is None else column
            weights = np.full(len(held.nodes), float(held.driver is not None))
            if held.factor is not None:
                weights = held.factor
            for c in held.components:
                at = (4 * place[held.nodes] + c).tolist()
                given.update({k: (series, w) for k, w in zip(at, weights.tolist(), strict=True)})
            column += held.driver is not None
        order = np.array(sorted(given), dtype=np.int64)
        values = [given[key] for key in order.tolist()]
        nodes, normals = self._roller_normals(place, given)
        return Constraints(
            node_at=order,
            series=np.array([series for series, _ in values], dtype=np.int64),
            weight=np.array([weight for _, weight in values], dtype=float),
            previous=np.zeros(len(order)),
            roller_at=4 * nodes,
            roller_normal=normals,
        )

    def _roller_normals(
        self, place: Integers, given: dict[int, tuple[int, float]]
    ) -> tuple[Integers, Floats]:
        """Nodes (R,) and normals (R, 3) of all rollers, by kernel number.

        Normals of one node are made orthogonal to each other and to its held components, so that
        to take out one after the other is to stay in all planes.
        """
        by_node: dict[int, list[Floats]] = {}
        for roller in self.rollers:
            for node in np.unique(place[roller.nodes]).tolist():
                by_node.setdefault(node, []).append(roller.normal)
        nodes, normals = [], []
        for node, planes in by_node.items():
            held = [c for c in range(3) if 4 * node + c in given]
            kept = [np.eye(3)[c] for c in held]
            for normal in planes:
                moved = [c for c in held if given[4 * node + c][1] and abs(normal[c]) > PARALLEL]
                if moved:
                    raise ConditionError(
                        f"a node is moved along {COMPONENTS[moved[0]]} out of its plane of normal "
                        f"{normal.tolist()}",
                        where="roller",
                        remedy="take the node out of the roller or of the prescribed motion",
                    )
                left = normal - sum(((normal @ other) * other for other in kept), np.zeros(3))
                if (length := np.linalg.norm(left)) > PARALLEL:
                    kept.append(left / length)
                    nodes.append(node)
                    normals.append(kept[-1])
        return np.array(nodes, dtype=np.int64), np.array(normals).reshape(-1, 3)


def remove_held(flat: Floats, held: Constraints) -> Floats:
    """A field in the kernel's order, in place without its parts along held components and normals.

    A node of several rollers is there several times; its normals are orthogonal.
    """
    at = held.roller_at[:, None] + np.arange(3)
    across = np.einsum("rc,rc->r", flat[at], held.roller_normal)
    np.subtract.at(flat, at, across[:, None] * held.roller_normal)
    flat[held.node_at] = 0.0
    return flat


def _join(parts: Sequence[NDArray[np.generic]]) -> NDArray[np.int64]:
    return np.concatenate([*parts, np.zeros(0, np.int64)])
