"""One smooth displacement field on the container: few finite elements, penalised least squares."""

from __future__ import annotations

import numpy as np

from adapters.container import Container
from adapters.jump_field import jump_arguments_check, mean_drop, mean_restored
from adapters.laws.law import Law
from adapters.moves.move import Move, block_moves, grain_weights, law_moves
from adapters.state import FloatArray

GRAINS_PER_ELEMENT = 30
"""About so many: their mean has a fifth of the scatter of one grain."""
ELEMENTS_MOST = 4
"""Along each axis: more would follow single bursts, and cost."""
FOLDS = 5
"""Parts of the grains, each predicted from the others, that the penalty is chosen by."""
PENALTIES = tuple(10.0**exponent for exponent in range(-4, 5))
"""Over the ratio of the traces of data and penalty: from hardly any to nothing but affine."""


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """A smooth field fitted to the moves of all grains' own laws [m], shape (n, 3).

    Trilinear elements on the box around the container and the bed; the nodal values c of each
    component minimise sum_i w_i (Delta_i - u(x_i))^2 + lambda E(c), where E is the integral of
    |grad u|^2 less the part of the nearest affine field: compaction and shear are free, all else
    is paid for.  u . n = 0 on floor, mirrors and the flat walls of a box.  lambda is the one by
    which grains are best predicted from others; w_i counts loose grains little
    (`moves.move.grain_weights`).  The mean vertical move is that of the law of the mean path.

    Arguments and errors as `moves.move.Displacement`.  Neighbours move alike in one burst, so
    grains left out are no independent witnesses and the penalty is rather too small.
    """
    jump_arguments_check(position, radius, h)
    place, own = position[-1], law_moves(cycle, position, law, h)
    weight = grain_weights(block_moves(cycle, position, law, h))
    value, node, stiffness = elements(container, place)
    rank = np.argsort(np.argsort(place[:, 2], kind="stable"))
    components = []
    for axis in range(3):
        free, affine = admissible(container, node, axis)
        cost = affine_free(stiffness[np.ix_(free, free)], affine)
        components.append(smooth_fit(value[:, free], weight, own[:, axis], cost, rank % FOLDS))
    return mean_restored(place, np.column_stack(components), mean_drop(cycle, position, law, h))


def elements(container: Container, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shape functions at ``place`` (n, 3) [m], shape (n, N); nodes (N, 3) [m]; stiffness [m].

    The stiffness (N, N) is that of the integral of |grad u|^2.  As many elements along each axis,
    so that one has about `GRAINS_PER_ELEMENT` grains, at most `ELEMENTS_MOST`.
    """
    from skfem import Basis, BilinearForm, ElementHex1, MeshHex
    from skfem.helpers import dot, grad

    low, high = np.minimum(place.min(axis=0), 0.0), place.max(axis=0)
    for axis, length in enumerate((container.size_x, container.size_y)):
        box = container.shape == "box"
        high[axis] = max(length if box else container.radius, high[axis])
        if not (box or "xy"[axis] in container.symmetry):
            low[axis] = min(-container.radius, low[axis])
    high[2] = max(high[2], np.finfo(float).tiny)
    count = round((len(place) / GRAINS_PER_ELEMENT) ** (1 / 3))
    count = min(max(count, 1), ELEMENTS_MOST)
    ticks = [np.linspace(a, b, count + 1) for a, b in zip(low, high, strict=True)]
    mesh = MeshHex.init_tensor(*ticks)
    basis = Basis(mesh, ElementHex1())
    node, value = mesh.p.T, np.ones((len(place), mesh.p.shape[1]))
    for axis, tick in enumerate(ticks):
        away = np.abs(place[:, None, axis] - node[None, :, axis]) / (tick[1] - tick[0])
        value *= np.maximum(1 - away, 0.0)
    form = BilinearForm(lambda u, v, w: dot(grad(u), grad(v)))
    return value, node, form.assemble(basis).toarray()


def admissible(container: Container, node: FloatArray, axis: int) -> tuple[np.ndarray, FloatArray]:
    """Numbers (f,) of the nodes that may move along ``axis``, and affine fields (f, a) on them.

    Nodes on flat walls across the axis stay; of 1, x, y, z the combinations that vanish there.
    """
    walls = container.walls()
    held = np.zeros(len(node), bool)
    for point, normal in zip(walls.plane_point, walls.plane_normal, strict=True):
        if abs(normal[axis]) == 1:
            held |= np.isclose(node[:, axis], point[axis], rtol=1e-9, atol=0.0)
    affine = np.column_stack([np.ones(len(node)), node / np.abs(node).max(axis=0)])
    _, size, across = np.linalg.svd(affine[held], full_matrices=True)
    rank = int((size > 1e-9 * size.max(initial=0.0)).sum())
    return np.flatnonzero(~held), affine[~held] @ across[rank:].T


def affine_free(stiffness: FloatArray, affine: FloatArray) -> FloatArray:
    """S = A - A P (P^T A P)^+ P^T A [m], shape (f, f): the energy without that of affine fields.

    c^T S c = min over a of (c - P a)^T A (c - P a); ``stiffness`` A, ``affine`` P of shape (f, a).
    """
    bound = stiffness @ affine
    return np.asarray(stiffness - bound @ np.linalg.pinv(affine.T @ bound) @ bound.T)


def smooth_fit(
    value: FloatArray, weight: FloatArray, move: FloatArray, cost: FloatArray, fold: np.ndarray
) -> FloatArray:
    """The fitted component at the grains [m], shape (n,), with the penalty that predicts best.

    ``value`` (n, f), ``weight`` (n,), ``move`` (n,) [m], ``cost`` (f, f); ``fold`` (n,) numbers
    the part each grain is in.
    """
    parts = [np.flatnonzero(fold == number) for number in np.unique(fold)]
    weighted = weight[:, None] * value
    normal = np.stack([value[rows].T @ weighted[rows] for rows in parts])
    right = np.stack([weighted[rows].T @ move[rows] for rows in parts])
    scale = np.trace(normal.sum(axis=0)) / max(float(np.trace(cost)), np.finfo(float).tiny)

    def nodes(out: int | None, penalty: float) -> FloatArray:
        """Nodal values from all parts but one; of minimum norm where an element has no grain."""
        left = normal.sum(axis=0), right.sum(axis=0)
        matrix, side = left if out is None else (left[0] - normal[out], left[1] - right[out])
        return np.asarray(np.linalg.pinv(matrix + penalty * scale * cost, hermitian=True) @ side)

    def missed(penalty: float) -> float:
        """Weighted squares of the parts' errors, each predicted by the others, less a constant."""
        found = [nodes(out, penalty) for out in range(len(parts))]
        return sum(
            float(c @ matrix @ c - 2 * c @ side)
            for c, matrix, side in zip(found, normal, right, strict=True)
        )

    choices = PENALTIES if len(parts) > 1 else PENALTIES[-1:]
    return np.asarray(value @ nodes(None, min(choices, key=missed)))


MOVE = Move("smooth-field", displacement)
