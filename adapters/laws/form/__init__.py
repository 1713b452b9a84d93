"""What the laws are made of: their contract, and the linear fit inside them."""

from adapters.laws.form.contract import Law, check_training_data, find_log_ratio, outer
from adapters.laws.form.projection import Shape, ShapedLaw, bound_time_shape, centre, normalise

__all__ = [
    "Law", "Shape", "ShapedLaw", "bound_time_shape", "centre", "check_training_data",
    "find_log_ratio", "normalise", "outer",
]  # fmt: skip
