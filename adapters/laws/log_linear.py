"""Logarithmic and linear law: slowing settlement over a constant rate (ratcheting)."""

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.laws.form import centre, check_training_data, find_log_ratio, normalise, outer


class LogLinear:
    """u(N) = c + a ln N + b N by least squares; a jump adds a ln((N + h) / N) + b h.

    a and b have one sign; where the free least squares gives them opposite ones, the better of
    the two terms stays alone.

    Shenton's law as the paper uses it, with a constant and with its increment: then it does not
    depend on the unit of time (b takes the factor), as eq. 17 does.

    Do not use it to predict far from a short window: over one doubling ln N and N are nearly the
    same curve, noise decides how the slope is shared, and the term b N explodes.
    """

    name = "log-linear"
    formula = "c + a ln N + b N"
    parameter_names = ("c", "a", "b")
    parameter_units = ("m", "m", "m/cycle")
    minimum_cycles = 3
    first_state = 1

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters c, a [m] and b [m/cycle], shape (3, ...); see `Law.fit`.

        Both columns are counted from the first cycle: at a million cycles they differ by 1e-5 of
        themselves only.  Raises `UsageError` also where they cannot be separated.
        """
        cycle, displacement = check_training_data(self, cycle, displacement)
        linear = centre((cycle - cycle[0]) / cycle[0])
        slowing = centre(find_log_ratio(cycle[0], cycle))
        unit, norm = normalise(linear)
        along = float((unit * slowing).sum())
        rest, left = normalise(slowing - along * unit)
        if not left > len(cycle) * np.finfo(float).eps * np.sqrt((slowing**2).sum()):
            raise UsageError(
                f"ln N and N are the same straight line over cycles {cycle[0]:g} to {cycle[-1]:g}",
                where=f"law {self.name}",
                remedy="use the law log",
            )
        y = np.stack([unit, rest]) @ displacement.reshape(len(cycle), -1)
        b, a = choose_one_sign(y, float(norm), along, float(left)).reshape(
            2, *displacement.shape[1:]
        )
        b = b / cycle[0]
        c = displacement.mean(axis=0) - a * np.log(cycle).mean() - b * cycle.mean()
        return np.stack([c, a, b])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        c, a, b = parameters
        return np.asarray(c + outer(np.log(cycle), a) + outer(cycle, b))

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """a ln(to / start) + b (to - start) [m]; see `Law.increment`."""
        _, a, b = parameters
        return outer(find_log_ratio(start, to), a) + outer(np.asarray(to) - start, b)


def choose_one_sign(y: FloatArray, norm: float, along: float, left: float) -> FloatArray:
    """Amplitudes of one sign, shape (2, n), of two columns whose QR factors are q and r.

    ``y`` (2, n) are the projections q' u; r has the rows (``norm``, ``along``) and (0, ``left``).
    Where the best two differ in sign, the constrained minimum has one of them zero: the better
    single one stays alone.
    """
    second = y[1] / left
    first = (y[0] - along * second) / norm
    onto = along * y[0] + left * y[1]
    alone = onto / (along * along + left * left)
    prefer = y[0] * y[0] >= onto * alone
    both = first * second >= 0
    return np.stack(
        [
            np.where(both, first, np.where(prefer, y[0] / norm, 0.0)),
            np.where(both, second, np.where(prefer, 0.0, alone)),
        ]
    )


LAW = LogLinear()
