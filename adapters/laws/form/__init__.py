"""What the laws are made of: their contract, and the linear fit inside them."""

from adapters.laws.form.contract import Law, check_training_data, log_ratio, outer
from adapters.laws.form.projection import (
    Shape,
    bound_time_shape,
    centred,
    fit_two_terms,
    orthonormal,
)
from adapters.laws.form.shaped import ShapedLaw

__all__ = [
    "Law", "Shape", "ShapedLaw", "bound_time_shape", "centred", "check_training_data",
    "fit_two_terms", "log_ratio", "orthonormal", "outer",
]  # fmt: skip
