"""Logarithmic law, the default: equal displacement for every equal factor in cycles."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import check_training_data, find_log_ratio, outer


class Log:
    """u(N) = c + a ln N by least squares; a jump adds a ln((N + h) / N).

    The increment, not the whole law, is added to the last computed state, and the constant c
    frees a from the origin of u.  Both make the estimate independent of the unit of time:
    in seconds, t = N T, a is the same and c takes up a ln T.

    Do not use it for a bed that ratchets (constant rate) or collapses, nor from a window that
    holds the first few cycles: their bedding-in is steeper than what follows.
    """

    name = "log"
    formula = "c + a ln N"
    parameter_names = ("c", "a")
    parameter_units = ("m", "m")
    minimum_cycles = 2
    first_state = 1

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters c [m] and a [m per e-fold of N], shape (2, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        x = find_log_ratio(cycle[0], cycle)
        x -= x.mean()
        a = np.tensordot(x, displacement, 1) / (x @ x)
        return np.stack([displacement.mean(axis=0) - a * np.log(cycle).mean(), a])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        c, a = parameters
        return np.asarray(c + outer(np.log(cycle), a))

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """a ln(to / start) [m]; see `Law.increment`."""
        return outer(find_log_ratio(start, to), parameters[1])


LAW = Log()
