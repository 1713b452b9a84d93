"""The account of energies of a run: what is stored, taken and put in, and what is missing."""

from collections.abc import Mapping

import numpy as np

from qdem_fem.files import Floats

STORED = ("kinetic", "elastic", "contact", "friction", "viscous")
"""Stored in the bodies or taken from them, where a run has it."""


class EnergyAccount:
    """Energies of a run, taken row by row or many at a time: what is missing, and over what.

    Missing is external work less what all others gained.  It is divided by the greatest energy that
    was put in, or went from one form to another, or was in motion.  What a scene begins with,
    overlap or motion, is no work of its loads.
    """

    def __init__(self) -> None:
        self.first: dict[str, float] = {}
        """The first row [J]."""
        self.last: dict[str, float] = {}
        """The last one [J]."""
        self.missing = 0.0
        """The most that was ever missing [J]."""
        self.greatest = 0.0
        """The greatest energy so far [J]."""

    def add_rows(self, energy: Mapping[str, Floats]) -> None:
        """Take rows more: columns (k,) [J] by name; others than energies are passed by."""
        names = [name for name in STORED if name in energy]
        if not self.first:
            self.first = {name: float(energy[name][0]) for name in names}
        gained = [energy[name] - self.first[name] for name in names]
        stored, external = np.sum(gained, axis=0), energy["external"]
        self.missing = max(self.missing, float(np.abs(external - stored).max()))
        seen = [*(np.abs(one) for one in gained), energy["kinetic"], np.abs(external), stored]
        self.greatest = max(self.greatest, *(float(one.max()) for one in seen))
        self.last = {name: float(energy[name][-1]) for name in [*names, "external"]}

    @property
    def relative(self) -> float:
        """The most that was missing over the greatest energy [-]."""
        return self.missing / self.greatest if self.greatest > 0 else 0.0


def list_energy_facts(energy: Mapping[str, Floats]) -> dict[str, float]:
    """Energies at the end [J], and what `EnergyAccount` says of all rows."""
    account = EnergyAccount()
    account.add_rows(energy)
    return {
        **account.last,
        "greatest_imbalance": account.missing,
        "relative_imbalance": account.relative,
    }
