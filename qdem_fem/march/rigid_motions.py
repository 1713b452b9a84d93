"""Whether every part of every body is held against all six rigid motions."""

import numpy as np
from numpy.typing import NDArray

from qdem_fem.files import ConditionError, Floats
from qdem_fem.march.state import State

HELD_SHARE = 1e-9
"""A rigid motion held by less than this share of a body's nodes' mean motion is called free."""


def check_held(simulation: State) -> None:
    """Raise `ConditionError` naming a part that can move as a rigid body."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    assembly, conditions = simulation.assembly, simulation.conditions
    n, elements, master = assembly.n_nodes, assembly.elements, simulation.master
    pairs = np.concatenate(
        [elements[:, [0, k]] for k in range(1, elements.shape[1])]
        + [np.stack([np.arange(n), master], 1)]
    )
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, part = connected_components(graph, directed=False)
    x = np.concatenate([body.nodes for body in simulation.bodies])
    used = np.zeros(n, dtype=bool)
    used[elements] = True

    rows: list[tuple[NDArray[np.int64], Floats]] = []
    for held in conditions.held:
        rows += [(held.nodes, np.tile(np.eye(3)[c], (len(held.nodes), 1))) for c in held.components]
    rows += [
        (roller.nodes, np.tile(roller.normal, (len(roller.nodes), 1)))
        for roller in conditions.rollers
    ]
    followers = np.flatnonzero(master != np.arange(n))
    for one in range(count):
        mine = part == one
        if not (used & mine).any():
            continue
        centre, size = x[mine].mean(axis=0), max(float(np.ptp(x[mine], axis=0).max()), 1e-300)
        gram = np.zeros((6, 6))
        for nodes, normals in rows:
            chosen = mine[nodes]
            arm = np.cross((x[nodes[chosen]] - centre) / size, normals[chosen])
            motion = np.concatenate([normals[chosen], arm], axis=1)
            gram += motion.T @ motion
        apart = (x[followers] - x[master[followers]])[mine[followers]] / size
        for normal in np.eye(3):  # partners move alike: what turns them apart is held
            motion = np.concatenate([np.zeros_like(apart), np.cross(apart, normal)], axis=1)
            gram += motion.T @ motion
        values = np.linalg.eigvalsh(gram)
        free = int((values <= HELD_SHARE * max(values[-1], 1.0)).sum())
        if free:
            first = int(np.flatnonzero(mine & used)[0])
            number = int(np.searchsorted(simulation.first_node, first, side="right")) - 1
            body = simulation.bodies[number]
            raise ConditionError(
                f"{body.name} has no static answer: {free} of the 6 rigid motions of the part "
                f"with node {first - simulation.first_node[number]} are not held",
                where="relax", remedy="fix nodes or components until it can neither shift nor turn",
            )  # fmt: skip
