"""The compiled step on a processor: arrays, lanes, layout."""

from qdem_fem.kernel.cpu import lanes, step
from qdem_fem.kernel.cpu.arrays import Constraints, Fields, Loads, Probes
from qdem_fem.kernel.cpu.lanes import count_lane
from qdem_fem.kernel.cpu.layout import Packed, aligned_zeros, build_layout

__all__ = [
    "Constraints", "Fields", "Loads", "Packed", "Probes", "aligned_zeros", "build_layout",
    "count_lane", "lanes", "step",
]  # fmt: skip
