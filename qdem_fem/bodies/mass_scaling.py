"""Mass scaling: heavier small elements for a longer step."""

from collections.abc import Sequence

import numpy as np

from qdem_fem.bodies.deformable import Body
from qdem_fem.files import Floats


def find_element_step(body: Body, part: slice = slice(None)) -> Floats:
    """Critical step of each element of ``part``, taken alone [s], (m,): ``2/omega``.

    ``omega^2`` is the largest eigenvalue of ``M_e^-1 K_e``, with the body's shares of the
    element's mass at its nodes; no assembled mesh is faster than its fastest element.
    """
    every = body.find_shape_gradients(part)
    count, points, nodes, _ = every.shape
    material = body.material
    # K_e = V/p B^T D B with u -> sym grad u; its eigenvalues are those of V/p D^1/2 B B^T D^1/2
    strain = np.zeros((count, points, 6, nodes, 3))
    for row, parts in enumerate(
        (((0, 0),), ((1, 1),), ((2, 2),), ((0, 1), (1, 0)), ((1, 2), (2, 1)), ((0, 2), (2, 0)))
    ):
        for component, along in parts:
            strain[:, :, row, :, component] = every[..., along]
    strain /= np.sqrt(points * np.array(body.MASS_SHARES))[:, None]
    rows = strain.reshape(count, 6 * points, 3 * nodes)
    product = rows @ rows.transpose(0, 2, 1)
    first, second, density = (
        np.asarray(each)[part]
        for each in (material.lame_first, material.lame_second, material.density)
    )
    moduli = np.zeros((len(every), 6, 6))
    moduli[:, :3, :3] = first[:, None, None]
    for k in range(6):
        moduli[:, k, k] += (2 if k < 3 else 1) * second
    root = np.linalg.cholesky(moduli)
    root = np.einsum("pq,mij->mpiqj", np.eye(points), root).reshape(product.shape)
    highest = np.linalg.eigvalsh(root.transpose(0, 2, 1) @ product @ root)[:, -1]
    return np.asarray(2 / np.sqrt(highest / density))


def find_mass_scaling_factor(bodies: Sequence[Body], step: float) -> Floats:
    """Factor on the density of each element, (m,), that makes its own step at least ``step`` [s].

    1 for elements that are slow enough.  What it costs is inertia: report the added mass, and
    do not use it where the small elements' own vibration matters.
    """
    factors = [np.maximum(1.0, (step / find_element_step(body)) ** 2) for body in bodies]
    return np.concatenate(factors)
