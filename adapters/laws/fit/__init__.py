"""Fitting laws to a series: regime, candidates, band, refusal, prediction."""

from adapters.laws.fit.candidates import CANDIDATES, BoolArray, find_increments, thin_rows
from adapters.laws.fit.outlook import AGREE
from adapters.laws.fit.prediction import (
    UNCLAIMED,
    Prediction,
    describe_formula,
    draw_forecast,
    fit_auto,
    fit_series,
)
from adapters.laws.fit.refusal import refuse_fall
from adapters.laws.fit.regime import (
    EXPONENTS,
    TAIL,
    WHY_NOT,
    WHY_NOT_PISTON,
    Regime,
    find_regime_of_weight,
)
from adapters.laws.fit.residual import FIRST_WINDOW, compare_coordinates, compare_displacements

__all__ = [
    "AGREE", "CANDIDATES", "EXPONENTS", "FIRST_WINDOW", "TAIL", "UNCLAIMED", "WHY_NOT",
    "WHY_NOT_PISTON", "BoolArray", "Prediction", "Regime", "compare_coordinates",
    "compare_displacements", "describe_formula", "draw_forecast", "find_increments",
    "find_regime_of_weight", "fit_auto", "fit_series", "refuse_fall", "thin_rows",
]  # fmt: skip
