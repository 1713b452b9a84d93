"""Values that change with time: constants, tables with linear interpolation, functions."""

from collections.abc import Callable
from math import isfinite
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.files.arrays import Floats
from qdem_fem.files.errors import ConditionError


class Series:
    """A value given at some times, linear between them, constant before and after.

    ``times`` (k,) [s], increasing; ``values`` (k,) or (k, c) in the unit of what they drive.
    Raises `ConditionError` for values that are not finite, times that do not increase, or
    lengths that differ.  The paper feeds its 10 kHz pressure record in this way (section 4).
    """

    def __init__(self, times: ArrayLike, values: ArrayLike) -> None:
        try:
            self.times = np.array(times, dtype=float)
            self.values = np.array(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise ConditionError(f"not a table of numbers: {error}", where="series") from None
        sound = self.times.ndim == 1 and self.values.ndim in (1, 2) and len(self.times) > 0
        if not (sound and len(self.times) == len(self.values)):
            raise ConditionError(
                f"times of shape {self.times.shape} and values of shape {self.values.shape}",
                where="series", remedy="give times (k,) and values (k,) or (k, 3)",
            )  # fmt: skip
        for name, array in (("time", self.times), ("value", self.values)):
            bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(axis=1))
            if bad.size:
                raise ConditionError(
                    f"{name} number {bad[0]} is {array[bad[0]]}: {bad.size} are not finite",
                    where="series", remedy="remove or mend the rows",
                )  # fmt: skip
        back = np.flatnonzero(np.diff(self.times) <= 0)
        if back.size:
            raise ConditionError(
                f"the time does not increase from row {back[0]} to {back[0] + 1} "
                f"({self.times[back[0]]} to {self.times[back[0] + 1]} s)",
                where="series", remedy="sort the rows by time; a jump needs two close times",
            )  # fmt: skip

    def at(self, times: Floats) -> Floats:
        """Values at ``times`` (k,) [s]: (k,) or (k, c)."""
        if self.values.ndim == 1:
            return np.interp(times, self.times, self.values)
        columns = [np.interp(times, self.times, column) for column in self.values.T]
        return np.stack(columns, axis=1)

    def __call__(self, time: float) -> Any:
        """Value at one time [s]."""
        value = self.at(np.array([time]))[0]
        return float(value) if np.ndim(value) == 0 else value


def is_real(value: object) -> bool:
    """True for a finite real number."""
    return isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)


def make_ramp(duration: float, value: ArrayLike) -> Series:
    """From zero to ``value`` in ``duration`` [s], then constant: the paper's loading (3.1)."""
    if not (is_real(duration) and duration > 0):
        raise ConditionError(f"a ramp of {duration} s", where="ramp", remedy="give a time above 0")
    try:
        end = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ConditionError(f"the value is no number: {value!r}", where="ramp") from None
    return Series([0.0, duration], np.stack([np.zeros_like(end), end]))


Value = float | ArrayLike | Series | Callable[[float], Any] | tuple[ArrayLike, ArrayLike]


class Driver:
    """A condition's value with ``components`` columns, constant or not, ready to be sampled."""

    def __init__(self, value: Any, components: int, where: str) -> None:
        self.where, self.components = where, components
        if isinstance(value, tuple) and len(value) == 2 and np.ndim(value[0]) == 1:
            value = Series(*value)
        if hasattr(value, "iloc"):  # pandas; a record of three rows would pass for a vector
            raise ConditionError(
                "a pandas object does not say what its times are",
                where=where,
                remedy="give Series(record.index, record), or a constant vector as a list",
            )
        self.varying: Series | Callable[[float], Any] | None = None
        self.constant = np.zeros(components)
        if isinstance(value, Series) or callable(value):
            self.varying = value
            self.sample(np.zeros(1))  # a fault is found now, not in the run
        else:
            self.constant = self._check_columns(value, 1, None)[0]

    def sample(self, times: Floats) -> Floats:
        """Values (k, components) at ``times`` (k,) [s]."""
        if self.varying is None:
            return np.broadcast_to(self.constant, (len(times), self.components))
        if isinstance(self.varying, Series):
            return self._check_columns(self.varying.at(times), len(times), None)
        rows = []
        for time in map(float, times):
            try:
                value = self.varying(time)
            except Exception as error:
                raise ConditionError(
                    f"the function failed at t = {time:g} s ({type(error).__name__}: {error})",
                    where=self.where, remedy="give a function of one number, the time in s",
                ) from error  # fmt: skip
            rows.append(self._check_columns(value, 1, time))
        return np.concatenate(rows)

    def _check_columns(self, value: Any, rows: int, time: float | None) -> Floats:
        when = "" if time is None else f" at t = {time:g} s"
        try:
            given = np.asarray(value)
        except ValueError:  # rows of different lengths
            given = np.array(None)
        if given.dtype.kind not in "iuf":
            raise ConditionError(
                f"the value{when} is no number: {value!r}",
                where=self.where,
                remedy="give a number or a vector, a function of time, or times and values as "
                "Series(times, values)",
            )
        array = given.astype(float).reshape(rows, -1)
        if array.shape[1] != self.components:
            raise ConditionError(
                f"the value{when} has {array.shape[1]} "
                f"component{'s' * (array.shape[1] != 1)}, not {self.components}",
                where=self.where,
            )
        if not np.isfinite(array).all():
            raise ConditionError(f"the value{when} is not finite: {value!r}", where=self.where)
        return array
