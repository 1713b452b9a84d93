"""The compiled step on a processor: arrays, lanes, layout."""

from qdem_fem.kernel.cpu import lanes, step
from qdem_fem.kernel.cpu.arrays import Constraints, Fields, Loads, Probes
from qdem_fem.kernel.cpu.lanes import count_lane
from qdem_fem.kernel.cpu.layout import Packed, build_layout, make_aligned_zeros
from qdem_fem.kernel.cpu.linear import LAWS
from qdem_fem.kernel.cpu.quadratic import GROUPS, OTHER, OWN, POINTS, Quadratic

__all__ = [
    "GROUPS", "LAWS", "OTHER", "OWN", "POINTS", "Constraints", "Fields", "Loads", "Packed",
    "Probes", "Quadratic", "build_layout", "count_lane", "lanes", "make_aligned_zeros", "step",
]  # fmt: skip
