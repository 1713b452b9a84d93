"""Forces of linear tetrahedra (eqs 1-10), one strain measure by the type of ``law``."""

from functools import partial
from typing import Any

from numba import njit
from numba.extending import overload

from qdem_fem.element import MEASURES, stress
from qdem_fem.kernel.cpu.lanes import (
    align_stack,
    count_lane,
    gather_edges,
    load_lanes,
    make_zero_lanes,
    mark_not_positive,
    scatter_pulls,
    sum_lanes,
)

MATHEMATICS: Any = {"error_model": "numpy", "fastmath": {"contract", "nsz", "arcp", "reassoc"}}
"""Fused multiply-add and reassociation are allowed; NaN and infinity keep their meaning."""
INLINED: Any = {"forceinline": True, **MATHEMATICS}
compiled: Any = partial(njit, **MATHEMATICS)
inlined: Any = partial(njit, **INLINED)

ROWS_ELASTIC, ROWS_VISCOUS = 11, 13
"""Numbers an element brings: nine gradients, lambda V, mu V; with viscosity also those of it."""


LAWS: dict[str, type] = {name: measure.MEASURE for name, measure in MEASURES.items()}
BY_LAW = {measure.MEASURE: measure for measure in MEASURES.values()}
compute_element_gradient = inlined(stress.compute_element_gradient)
compute_element_pulls = inlined(stress.compute_element_pulls)
find_matrix_product = inlined(stress.find_matrix_product)


def choose_stress(options: Any) -> tuple[Any, Any]:
    """Two functions, ``(P V, J)`` of elasticity and ``P V`` of viscosity at a ``rate`` of the
    displacement gradient [1/s], of the strain measure that the type of ``law`` names."""

    def find_elastic_stress(law: Any, h: Any, lame_first: Any, lame_second: Any) -> Any:
        return BY_LAW[type(law)].find_stress_numbers(h, lame_first, lame_second, law.half)

    def find_viscous_stress(law: Any, h: Any, rate: Any, first: Any, second: Any) -> Any:
        return BY_LAW[type(law)].find_viscous_numbers(h, rate, first, second, law.half)

    @overload(find_elastic_stress, strict=False, jit_options=options)
    def _choose_elastic(law: Any, h: Any, lame_first: Any, lame_second: Any) -> Any:
        chosen = njit(**options)(BY_LAW[law.instance_class].find_stress_numbers)
        return lambda law, h, lame_first, lame_second: chosen(h, lame_first, lame_second, law.half)

    @overload(find_viscous_stress, strict=False, jit_options=options)
    def _choose_viscous(law: Any, h: Any, rate: Any, first: Any, second: Any) -> Any:
        chosen = njit(**options)(BY_LAW[law.instance_class].find_viscous_numbers)
        return lambda law, h, rate, first, second: chosen(h, rate, first, second, law.half)

    return find_elastic_stress, find_viscous_stress


find_elastic_stress, find_viscous_stress = choose_stress(INLINED)


def compute_viscous_pulls(
    law: Any, h: Any, w: Any, g: Any, lame_first: Any, lame_second: Any, first: Any, second: Any
) -> Any:
    """``(pulls, J, power)`` with viscosity, linear beside ``small``, else current (eq. 7).

    The power is what viscosity takes of the motion [W].
    """
    measure = BY_LAW[type(law)]
    if hasattr(measure, "find_fused_pulls"):
        return measure.find_fused_pulls(h, w, g, lame_first, lame_second, first, second, law.half)
    p, jacobian = find_elastic_stress(law, h, lame_first, lame_second)
    rate = stress.compute_element_gradient(w, g)
    q = find_viscous_stress(law, h, rate, first, second)
    pulls = stress.compute_element_pulls(tuple(a + b for a, b in zip(p, q, strict=True)), g)
    return pulls, jacobian, stress.find_matrix_product(q, rate)


@overload(compute_viscous_pulls, strict=False, jit_options=INLINED)
def _choose_viscous_pulls(
    law: Any, h: Any, w: Any, g: Any, lame_first: Any, lame_second: Any, first: Any, second: Any
) -> Any:
    measure = BY_LAW[law.instance_class]
    if hasattr(measure, "find_fused_pulls"):
        fused = inlined(measure.find_fused_pulls)
        return lambda law, h, w, g, lame_first, lame_second, first, second: fused(
            h, w, g, lame_first, lame_second, first, second, law.half
        )

    def compose_pulls(
        law: Any, h: Any, w: Any, g: Any, lame_first: Any, lame_second: Any, first: Any,
        second: Any,
    ) -> Any:  # fmt: skip
        p, jacobian = find_elastic_stress(law, h, lame_first, lame_second)
        rate = compute_element_gradient(w, g)
        q = find_viscous_stress(law, h, rate, first, second)
        return compute_element_pulls(add(p, q), g), jacobian, find_matrix_product(q, rate)

    return compose_pulls


@inlined()
def add(p: Any, q: Any) -> Any:
    """Sum of two matrices in rows."""
    return (
        p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3], p[4] + q[4], p[5] + q[5],
        p[6] + q[6], p[7] + q[7], p[8] + q[8],
    )  # fmt: skip


@inlined()
def load_gradients(rows: Any, at: int, width: int) -> Any:
    """Gradients of a block, nine lanes."""
    return (
        load_lanes(rows, at), load_lanes(rows, at + width), load_lanes(rows, at + 2 * width),
        load_lanes(rows, at + 3 * width), load_lanes(rows, at + 4 * width),
        load_lanes(rows, at + 5 * width), load_lanes(rows, at + 6 * width),
        load_lanes(rows, at + 7 * width), load_lanes(rows, at + 8 * width),
    )  # fmt: skip


@compiled()
def add_chunk_forces(
    law: Any, viscous: Any, corners: Any, rows: Any, first_block: int, stop_block: int,
    displacement: Any, velocity: Any, forces: Any, shift: int,
) -> tuple[float, float]:  # fmt: skip
    """Forces of the blocks of elements of one chunk (eqs 1-10), added to its window.

    ``displacement`` [m], ``velocity`` [m/s], ``forces`` [N]: flat, four numbers a node.
    Returns how many of its elements are inverted or not finite, and the power that viscosity
    takes [W].
    """
    align_stack()
    width = count_lanes_of(rows)
    bad: Any = make_zero_lanes(rows)
    taken: Any = make_zero_lanes(rows)
    for block in range(first_block, stop_block):
        at = block * count_block_rows(viscous) * width
        g = load_gradients(rows, at, width)
        h = compute_element_gradient(gather_edges(displacement, corners, block), g)
        first, second = load_lanes(rows, at + 9 * width), load_lanes(rows, at + 10 * width)
        if viscous is None:
            p, jacobian = find_elastic_stress(law, h, first, second)
            pulls = compute_element_pulls(p, g)
        else:
            rate = gather_edges(velocity, corners, block)
            pulls, jacobian, power = compute_viscous_pulls(
                law, h, rate, g, first, second, load_lanes(rows, at + 11 * width),
                load_lanes(rows, at + 12 * width),
            )  # fmt: skip
            taken = taken + power
        bad = bad + mark_not_positive(jacobian)
        scatter_pulls(forces, corners, block, shift, pulls, viscous)
    return sum_lanes(bad), sum_lanes(taken)


def count_lanes_of(rows: Any) -> int:
    """Lanes of a block of this array."""
    return count_lane(rows.dtype)


@overload(count_lanes_of, strict=False)
def _find_lane_count(rows: Any) -> Any:
    width = count_lane(rows.dtype)
    return lambda rows: width


@inlined()
def count_block_rows(viscous: Any) -> int:
    """Rows of a block."""
    return ROWS_ELASTIC if viscous is None else ROWS_VISCOUS
