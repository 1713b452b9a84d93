"""Forces of quadratic tetrahedra of ten nodes, straight in the reference configuration.

Four points of integration, one near each corner v.  With reference gradients g of the linear shape
functions, and nodes m_vw amid the edges, the displacement gradient at the corners and points is

    H_v = sum_w (4 m_vw - u_w) (x) g_w,   m_vv = u_v,
    H(v) = (A - B) H_v + B sum_w H_w,   A, B = (5 + 3 sqrt 5)/20, (5 - sqrt 5)/20.

Forces are the transpose of both, of the nominal stresses P(q) times V/4.
"""

from functools import partial
from math import sqrt
from typing import Any

import numpy as np
from numba import njit

from qdem_fem.kernel.cpu import linear
from qdem_fem.kernel.cpu.lanes import (
    align_stack,
    gather_edges,
    load_lanes,
    make_zero_lanes,
    mark_not_positive,
    scatter_pulls,
    sum_lanes,
)
from qdem_fem.kernel.cpu.linear import (
    INLINED,
    choose_stress,
    count_block_rows,
    count_lanes_of,
    load_gradients,
)

ORDERED: Any = INLINED | {"fastmath": {"contract", "nsz", "arcp"}}
"""Sums in the order they are written in: LLVM reassociates ones as long as these again each time
that it links a function, so that bits would hang on threads and on what the disk holds."""
inlined: Any = partial(njit, **ORDERED)
add, compute_element_gradient, compute_element_pulls, find_matrix_product = (
    inlined(one.py_func)
    for one in (
        linear.add, linear.compute_element_gradient, linear.compute_element_pulls,
        linear.find_matrix_product,
    )
)  # fmt: skip
find_elastic_stress, find_viscous_stress = choose_stress(ORDERED)

GROUPS = np.array([0, 1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9])
"""Nodes as the kernel reads them: corner 0 before each three others, which are taken less it."""
OWN, OTHER = (5 + 3 * sqrt(5)) / 20, (5 - sqrt(5)) / 20
"""Barycentric coordinates A, B of a point: that of its own corner, and of the others [-]."""
SPREAD = OWN - OTHER
POINTS = 4  # of integration, of weight V/4 each [-]


@inlined()
def combine(a: Any, x: Any, b: Any, y: Any) -> Any:
    """``a x + b y`` of nine numbers each."""
    return (
        a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2], a * x[3] + b * y[3],
        a * x[4] + b * y[4], a * x[5] + b * y[5], a * x[6] + b * y[6], a * x[7] + b * y[7],
        a * x[8] + b * y[8],
    )  # fmt: skip


@inlined()
def spread_points(h: Any) -> Any:
    """Of four matrices ``(A - B) H_v + B sum_w H_w``: from corners to points, and its transpose."""
    total = add(add(h[0], h[1]), add(h[2], h[3]))
    return (
        combine(SPREAD, h[0], OTHER, total), combine(SPREAD, h[1], OTHER, total),
        combine(SPREAD, h[2], OTHER, total), combine(SPREAD, h[3], OTHER, total),
    )  # fmt: skip


@inlined()
def compute_point_gradients(e: Any, n: Any, f: Any, g: Any) -> Any:
    """H at the four points, from a nodal field less that of corner 0.

    ``e``: at corners 1, 2, 3; ``n``: at nodes 01, 02, 03; ``f``: at nodes 12, 13, 23, three
    components each; ``g``: reference gradients of corners 1, 2, 3.
    """
    n1, n2, n3 = n[0:3], n[3:6], n[6:9]
    rows1, rows2, rows3 = e[0:3] + f[0:6], f[0:3] + e[3:6] + f[6:9], f[3:9] + e[6:9]
    return spread_points((
        compute_element_gradient(combine(4.0, n, -1.0, e), g),
        compute_element_gradient(combine(4.0, rows1, -1.0, combine(4.0, n1 + n1 + n1, 1.0, e)), g),
        compute_element_gradient(combine(4.0, rows2, -1.0, combine(4.0, n2 + n2 + n2, 1.0, e)), g),
        compute_element_gradient(combine(4.0, rows3, -1.0, combine(4.0, n3 + n3 + n3, 1.0, e)), g),
    ))  # fmt: skip


@inlined()
def compute_point_pulls(p: Any, g: Any) -> Any:
    """Pulls on corners 1, 2, 3, on nodes 01, 02, 03 and on nodes 12, 13, 23 [N].

    The transpose of `compute_point_gradients`; ``p``: nominal stresses of the points times V/4.
    """
    p0, p1, p2, p3 = spread_points(p)
    t0, t1 = compute_element_pulls(p0, g), compute_element_pulls(p1, g)
    t2, t3 = compute_element_pulls(p2, g), compute_element_pulls(p3, g)
    of_corner = add_thirds(t1) + add_thirds(t2) + add_thirds(t3)
    return (
        combine(4.0, t1[0:3] + t2[3:6] + t3[6:9], -1.0, add(add(t0, t1), add(t2, t3))),
        combine(4.0, t0, -4.0, of_corner),
        combine(4.0, t1[3:9] + t2[6:9], 4.0, t2[0:3] + t3[0:6]),
    )


@inlined()
def add_thirds(t: Any) -> Any:
    """Sum of three vectors."""
    return t[0] + t[3] + t[6], t[1] + t[4] + t[7], t[2] + t[5] + t[8]


@inlined()
def gather_groups(field: Any, corners: Any, block: int) -> Any:
    """Three times nine lanes as `compute_point_gradients` takes them."""
    first = 3 * block
    return (
        gather_edges(field, corners, first), gather_edges(field, corners, first + 1),
        gather_edges(field, corners, first + 2),
    )  # fmt: skip


@inlined()
def find_point_stress(law: Any, h: Any, rate: Any, moduli: Any, viscosities: Any) -> Any:
    """``(P V/4, J, power)`` of a point with viscosity."""
    p, jacobian = find_elastic_stress(law, h, moduli[0], moduli[1])
    q = find_viscous_stress(law, h, rate, viscosities[0], viscosities[1])
    return add(p, q), jacobian, find_matrix_product(q, rate)


@inlined()
def add_quadratic_forces(
    law: Any, viscous: Any, corners: Any, rows: Any, first_block: int, stop_block: int,
    displacement: Any, velocity: Any, forces: Any, shift: int,
) -> tuple[float, float]:  # fmt: skip
    """As `qdem_fem.kernel.cpu.linear.add_chunk_forces`; moduli are times V/4."""
    align_stack()
    width = count_lanes_of(rows)
    bad: Any = make_zero_lanes(rows)
    taken: Any = make_zero_lanes(rows)
    for block in range(first_block, stop_block):
        at = block * count_block_rows(viscous) * width
        g = load_gradients(rows, at, width)
        moduli = load_lanes(rows, at + 9 * width), load_lanes(rows, at + 10 * width)
        e, n, f = gather_groups(displacement, corners, block)
        h0, h1, h2, h3 = compute_point_gradients(e, n, f, g)
        if viscous is None:
            p0, j0 = find_elastic_stress(law, h0, *moduli)
            p1, j1 = find_elastic_stress(law, h1, *moduli)
            p2, j2 = find_elastic_stress(law, h2, *moduli)
            p3, j3 = find_elastic_stress(law, h3, *moduli)
        else:
            other = load_lanes(rows, at + 11 * width), load_lanes(rows, at + 12 * width)
            e, n, f = gather_groups(velocity, corners, block)
            d0, d1, d2, d3 = compute_point_gradients(e, n, f, g)
            p0, j0, w0 = find_point_stress(law, h0, d0, moduli, other)
            p1, j1, w1 = find_point_stress(law, h1, d1, moduli, other)
            p2, j2, w2 = find_point_stress(law, h2, d2, moduli, other)
            p3, j3, w3 = find_point_stress(law, h3, d3, moduli, other)
            taken = taken + (w0 + w1 + w2 + w3)
        e, n, f = compute_point_pulls((p0, p1, p2, p3), g)
        scatter_pulls(forces, corners, 3 * block, shift, e, viscous)
        scatter_pulls(forces, corners, 3 * block + 1, shift, n, viscous)
        scatter_pulls(forces, corners, 3 * block + 2, shift, f, viscous)
        bad = bad + mark_not_positive(j0) + mark_not_positive(j1)
        bad = bad + mark_not_positive(j2) + mark_not_positive(j3)
    return sum_lanes(bad), sum_lanes(taken)
