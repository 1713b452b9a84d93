"""Fitting laws to a series: regime, candidates, band, refusal, prediction."""

from adapters.laws.fit.candidates import ROWS_FEWEST, BoolArray, increments, thinned
from adapters.laws.fit.outlook import AGREE
from adapters.laws.fit.prediction import count_cycles_needed, fit_auto, fit_series, read_series
from adapters.laws.fit.regime import (
    EXPONENTS,
    PRIOR,
    WHY_NOT,
    WHY_NOT_PISTON,
    Regime,
    find_regime_of_weight,
)
from adapters.laws.fit.residual import (
    FIRST_WINDOW,
    bound_cycles_for_error,
    measure_coordinates_error,
    measure_displacement_error,
)

__all__ = [
    "AGREE", "EXPONENTS", "FIRST_WINDOW", "PRIOR", "ROWS_FEWEST", "WHY_NOT", "WHY_NOT_PISTON",
    "BoolArray", "Regime", "bound_cycles_for_error", "count_cycles_needed", "find_regime_of_weight",
    "fit_auto", "fit_series", "increments", "measure_coordinates_error",
    "measure_displacement_error", "read_series", "thinned",
]  # fmt: skip
