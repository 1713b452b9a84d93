"""Sato's law: exponential bedding-in over a constant rate."""

from __future__ import annotations

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw, bound_time_shape


class Sato(ShapedLaw):
    """u(N) = c + g (1 - exp(-N / tau)) + b N, g and b of one sign (Sato 1995, alpha = 1 / tau).

    Written for tracks that ratchet after tamping.  Do not use it on a bed that slows down for
    good: what is left of its rate at the end of the data goes on for ever, and the prediction
    grows in proportion to N.
    """

    name = "sato"
    parameter_names = ("c", "g", "b", "tau")
    parameter_units = ("m", "m", "m/cycle", "cycle")
    minimum_cycles = 4
    amplitude_count = 2

    def columns(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """1 - exp(-N / tau) and N."""
        bedding = -np.expm1(-cycle / theta[0])
        return np.stack([bedding, np.broadcast_to(cycle, bedding.shape)])

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """tau."""
        return (bound_time_shape(cycle),)


LAW = Sato()
