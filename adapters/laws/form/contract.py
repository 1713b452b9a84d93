"""What a law of residual displacement is, and the checks that all laws make of their data."""

from typing import Protocol

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError


class Law(Protocol):
    """A trend u(N) of residual displacement with load cycles N, of p parameters.

    A file beside the other laws with an object ``LAW`` of this kind is a law, and is named nowhere
    else.  Displacements may have any shape behind their first axis (grains
    and axes): each column is fitted by itself, all at once.  ``as_printed = True`` says that a law
    is kept with the faults of its paper, for comparison: its increments need not vanish with the
    jump, and may depend on the unit of cycles.
    """

    @property
    def name(self) -> str:
        """The name in scenes and ``--law``: that of the file, dashes for its underscores."""

    @property
    def formula(self) -> str:
        """u(N) in the names of the parameters, such as ``c + a ln N``."""

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the p parameters, such as ``("c", "a")``."""

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Their units for displacements in m, such as ``("m", "m")``."""

    @property
    def minimum_cycles(self) -> int:
        """Fewest states that determine the parameters."""

    @property
    def first_state(self) -> int:
        """First state of a window that a fit takes.

        0: the one before the window (eq. 16 starts there); 1: the one after its first cycle
        (eq. 18 sums from p = 1, and ln N has no value at N = 0).
        """

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters, shape (p, ...), from displacements [m], shape (k, ...), at cycles, (k,).

        Raises `UsageError` for too few cycles, cycles that do not ascend, and numbers that are
        not finite.
        """

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m], shape (...) for one cycle, (m, ...) for m cycles."""

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """Displacement from cycle ``start`` to cycle ``to`` [m], shaped as by `value`.

        What a jump adds to the computed state at ``start``: the estimate is anchored there, and
        the residual of the fit at ``start`` is kept, not undone.
        """


def check_training_data(
    law: Law, cycle: FloatArray, displacement: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cycles, shape (k,), and displacements [m], shape (k, ...), checked for `Law.fit`."""
    cycle, displacement = np.asarray(cycle, float), np.asarray(displacement, float)
    where = f"law {law.name}"
    if cycle.ndim != 1 or displacement.shape[:1] != cycle.shape:
        raise UsageError(
            f"cycles of shape {cycle.shape} do not fit displacements of shape {displacement.shape}",
            where=where,
        )
    if len(cycle) < law.minimum_cycles:
        raise UsageError(
            f"{len(cycle)} cycles do not determine the parameters {', '.join(law.parameter_names)}",
            where=where,
            remedy=f"compute at least {law.minimum_cycles} cycles",
        )
    if not np.isfinite(cycle).all() or not (np.diff(cycle) > 0).all():
        raise UsageError("cycles must be finite and ascend, none twice", where=where)
    if cycle[0] < 0 or (law.first_state and cycle[0] == 0):
        raise UsageError(
            f"cycle {cycle[0]:g} has no logarithm" if law.first_state else "a cycle is negative",
            where=where,
            remedy="fit from the end of cycle 1 on",
        )
    with np.errstate(invalid="ignore", over="ignore"):
        total = displacement.sum()  # one pass without a temporary: nan and inf survive a sum
    if not np.isfinite(total):
        faulty = np.argwhere(~np.isfinite(displacement))
        if len(faulty):
            row, *column = faulty[0].tolist()
            raise UsageError(
                f"{len(faulty)} displacements are not finite, the first at cycle {cycle[row]:g}"
                + (f", grain and axis {column}" if column else ""),
                where=where,
                remedy="the state of this cycle is damaged: compute it again",
            )
    return cycle, displacement


def outer(factor: float | FloatArray, parameter: FloatArray) -> FloatArray:
    """Products, shape of ``factor`` followed by the shape of ``parameter``."""
    return np.asarray(np.multiply.outer(np.asarray(factor, float), parameter))


def find_log_ratio(start: float, end: float | FloatArray) -> FloatArray:
    """ln(end / start), to round-off of the result also where the two nearly agree."""
    return np.asarray(np.log1p((np.asarray(end, float) - start) / start))
