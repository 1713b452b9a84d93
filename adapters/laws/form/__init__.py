"""What the laws are made of: their contract, and the linear fit inside them."""

from adapters.laws.form.contract import Law, check_training_data, log_ratio, outer
from adapters.laws.form.projection import Shape, ShapedLaw, bound_time_shape, centred, unit_vectors

__all__ = [
    "Law", "Shape", "ShapedLaw", "bound_time_shape", "centred", "check_training_data",
    "log_ratio", "outer", "unit_vectors",
]  # fmt: skip
