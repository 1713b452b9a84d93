"""Errors of settlement runs: those of every story (`trackbed.errors`), and their own."""

from trackbed.errors import (
    Interrupted,
    NotConverged,
    NotCredible,
    SceneError,
    TrackbedError,
    UsageError,
)

__all__ = [
    "DumpError", "EngineFailed", "EngineMissing", "Interrupted", "JumpRefused", "NotConverged",
    "NotCredible", "SceneError", "SweepIncomplete", "TrackbedError", "UsageError",
]  # fmt: skip


class EngineMissing(TrackbedError):
    """The engine that a scene names is not installed, or not the version we know."""

    exit_code = 4


class EngineFailed(TrackbedError):
    """The engine stopped, was killed, or left its results incomplete."""

    exit_code = 5
    from_outside = False
    """True when a signal or a full disk ended it: trying another jump would not help."""


class DumpError(NotCredible):
    """A dump file is malformed; the text names file, line, time step and lost grains."""


class JumpRefused(NotCredible):
    """Nothing credible can be said of what comes after a series of settlements.

    ``trackbed fit`` ends with it and exit code 6: with ``--law auto`` for every regime below, with
    a law that is named only for ``--fail-at``.  So do ``trackbed run`` and ``trackbed resume``
    where jumps choose themselves (``--tolerance``), for ``ratcheting`` and ``collapse``, unless
    ``--cycle-by-cycle`` is given.

    - ``what``, ``where``, ``remedy``: as in `TrackbedError`; cycles as the user counts them,
      settlements in the unit of the series;
    - ``law``: the law named, or ``auto``, also of jumps;
    - ``regime``: ``ratcheting`` (the rate hardly falls), ``collapse`` (it grows, or the series or
      its prediction reaches ``--fail-at``) or ``uncertain`` (the laws differ too much, or
      the settlement falls);
    - ``parameters``: of ``auto`` ``exponent`` beta, without unit, and, from ``fit``,
      ``exponent_deviation``; of a law that is named its own: lengths in the unit of the series,
      rates in that per cycle, counted from a load change where there is one.  Only finite ones;
    - ``laws``: by name, what each slow law says all the same: fields of `fit.outlook.LawSaid`,
      ``prediction`` in the unit of the series; empty for a law that is named, and for jumps.
    """

    def __init__(
        self, what: str, *, law: str = "auto", regime: str = "",
        parameters: dict[str, float] | None = None,
        laws: dict[str, dict[str, object]] | None = None, **place: str,
    ) -> None:  # fmt: skip
        self.law, self.regime = law, regime
        self.parameters, self.laws = parameters or {}, laws or {}
        super().__init__(what, **place)

    def to_json(self, unit: str) -> dict[str, object]:
        """The keys of ``trackbed fit --json``, without a prediction; ``unit`` of the series."""
        return {
            "law": self.law, "parameters": self.parameters, "prediction": None, "band": None,
            "unit": unit, "regime": self.regime, "laws": self.laws,
        }  # fmt: skip


class SweepIncomplete(TrackbedError):
    """Members of a sweep failed; the text names each, and all others are finished."""

    exit_code = 8
