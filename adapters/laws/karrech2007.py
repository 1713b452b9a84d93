"""The logarithmic estimation of Karrech et al. (2007) as printed, kept for comparison only."""

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.laws.form import check_training_data, outer


class Karrech2007:
    """u(t) = a ln t + b t, closed form (eqs 20, 21); a jump adds the whole law (eq. 17).

    Two faults, and what the laws `log` and `log-linear` do about them:

    - Eq. 17 adds u(t + (k+h) T), all displacement since the first cycle, to a state that holds
      most of it already.  Meant is the increment u(t + (k+h) T) - u(t + k T).
    - Without a constant the estimate depends on the unit of time: t -> s t turns a ln t into
      a ln t + a ln s, which no a and b can take up.  Here t counts in cycles.

    The estimate also depends on where u is zero.  Do not use it for predictions.
    """

    name = "karrech2007"
    formula = "a ln N + b N"
    parameter_names = ("a", "b")
    parameter_units = ("m", "m/cycle")
    minimum_cycles = 2
    first_state = 1
    as_printed = True

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters a [m] and b [m/cycle], shape (2, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        t, log_t = cycle, np.log(cycle)
        log_log, t_log, t_t = log_t @ log_t, t @ log_t, t @ t
        determinant = log_log * t_t - t_log**2
        if determinant <= len(t) * np.finfo(float).eps * log_log * t_t:
            raise UsageError(
                f"eqs 20, 21 break down: ln t and t are parallel over cycles {cycle[0]:g} to "
                f"{cycle[-1]:g}",
                where=f"law {self.name}",
                remedy="use the law log",
            )
        u_log, u_t = np.tensordot(np.stack([log_t, t]), displacement, 1)
        a = (t_t * u_log - t_log * u_t) / determinant
        b = (log_log * u_t - t_log * u_log) / determinant
        return np.stack([a, b])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """a ln t + b t [m]; see `Law.value`."""
        t = np.asarray(cycle, float)
        return outer(np.log(t), parameters[0]) + outer(t, parameters[1])

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """The whole law at ``to`` [m], whatever ``start`` is: the fault of eq. 17, as printed."""
        return self.value(parameters, to)


LAW = Karrech2007()
