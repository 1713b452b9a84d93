"""Logarithmic and linear law: slowing settlement over a constant rate (ratcheting)."""

from __future__ import annotations

import numpy as np

from adapters.errors import UsageError
from adapters.laws.law import log_ratio, outer, training_data
from adapters.state import FloatArray


class LogLinear:
    """u(N) = c + a ln N + b N by least squares; a jump adds a ln((N + h) / N) + b h.

    Shenton's law as the paper uses it, with a constant and with its increment: then it does not
    depend on the unit of time (b takes the factor), as eq. 17 does.

    Do not use it to predict far from a short window: over one doubling ln N and N are nearly the
    same curve, a and b become large with opposite signs, and the term b N explodes.
    """

    name = "log-linear"
    parameter_names = ("c", "a", "b")
    parameter_units = ("m", "m", "m/cycle")
    minimum_cycles = 3
    first_state = 1

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters c, a [m] and b [m/cycle], shape (3, ...); see `Law.fit`.

        Both columns are centred and scaled before they are made orthogonal: at a million cycles
        they differ by 1e-5 of themselves only.
        """
        cycle, displacement = training_data(self, cycle, displacement)
        columns = np.stack([(cycle - cycle[0]) / cycle[0], log_ratio(cycle[0], cycle)], axis=1)
        columns -= columns.mean(axis=0)
        scale = np.linalg.norm(columns, axis=0)
        orthogonal, triangle = np.linalg.qr(columns / scale)
        if abs(triangle[1, 1]) <= len(cycle) * np.finfo(float).eps:
            raise UsageError(
                f"ln N and N are the same straight line over cycles {cycle[0]:g} to {cycle[-1]:g}",
                where=f"law {self.name}",
                remedy="use the law log",
            )
        pseudo_inverse = np.linalg.solve(triangle, orthogonal.T) / scale[:, None]
        b, a = np.tensordot(pseudo_inverse, displacement, 1)
        b = b / cycle[0]
        c = displacement.mean(axis=0) - a * np.log(cycle).mean() - b * cycle.mean()
        return np.stack([c, a, b])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        c, a, b = parameters
        return np.asarray(c + outer(np.log(cycle), a) + outer(cycle, b))

    def increment(
        self, parameters: FloatArray, start: float, end: float | FloatArray
    ) -> FloatArray:
        """a ln(end / start) + b (end - start) [m]; see `Law.increment`."""
        _, a, b = parameters
        return outer(log_ratio(start, end), a) + outer(np.asarray(end) - start, b)


LAW = LogLinear()
