"""The compiled step on a processor: arrays, lanes, layout."""

from qdem_fem.kernel.cpu import lanes, step
from qdem_fem.kernel.cpu.arrays import Constraints, Fields, Loads, Probes, QuadraticLayout
from qdem_fem.kernel.cpu.lanes import count_lane
from qdem_fem.kernel.cpu.layout import Packed, build_layout, make_aligned_zeros
from qdem_fem.kernel.cpu.linear import LAWS, ROWS_ELASTIC, ROWS_VISCOUS
from qdem_fem.kernel.cpu.quadratic import GROUPS, OTHER, OWN, POINTS

__all__ = [
    "GROUPS", "LAWS", "OTHER", "OWN", "POINTS", "ROWS_ELASTIC", "ROWS_VISCOUS", "Constraints",
    "Fields", "Loads", "Packed", "Probes", "QuadraticLayout", "build_layout", "count_lane",
    "lanes", "make_aligned_zeros", "step",
]  # fmt: skip
