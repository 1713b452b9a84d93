"""Linear law: every cycle to come moves as the mean cycle of the window did."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import check_training_data, outer


class Linear:
    """u(N) = c + b N with b = (u_k - u_0) / (N_k - N_0), through the last state (eq. 16).

    The mean increment of eq. 16 telescopes: only the first and last state count, and the
    residuals of the states between are no least-squares residuals.

    Do not use it to predict far: settlement slows down, and a mean over the window is the rate
    of its middle.  On full runs it overshoots a jump of one doubling by half.
    """

    name = "linear"
    formula = "c + b N"
    parameter_names = ("c", "b")
    parameter_units = ("m", "m/cycle")
    minimum_cycles = 2
    first_state = 0

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters c [m] and b [m/cycle], shape (2, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        b = (displacement[-1] - displacement[0]) / (cycle[-1] - cycle[0])
        return np.stack([displacement[-1] - b * cycle[-1], b])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        c, b = parameters
        return np.asarray(c + outer(cycle, b))

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """b (to - start) [m]; see `Law.increment`."""
        return outer(np.asarray(to) - start, parameters[1])


LAW = Linear()
