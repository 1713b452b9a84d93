"""The state of a simulation: its system of bodies, their contacts, and the time step."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan
from typing import TYPE_CHECKING

import numpy as np

from qdem_fem.contact import (
    CriticalStep,
    SphereContacts,
    SurfaceContacts,
    System,
    find_critical_step,
)
from qdem_fem.contact.spheres import SphereContact
from qdem_fem.files import ConditionError
from qdem_fem.march.options import Contact

if TYPE_CHECKING:
    from qdem_fem.contact import Contacts
    from qdem_fem.rigid import Acting

STEP_SAFETY = 0.9


@dataclass(eq=False)
class State(System):
    """All that a march reads and writes.  What is costly is made when first asked for."""

    contact: Contact | None = None
    given_step: float | None = None  # time step that the user gave [s]
    safety: float = STEP_SAFETY
    warned: float = nan  # the critical step of which a warning was given [s]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._contacts: Contacts | None = None
        self._critical: CriticalStep | None = None

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * self.step

    @property
    def step(self) -> float:
        """Time step [s]; once steps were done it stays, as time is counted in steps."""
        for step in (self.given_step, self.motion.step):
            if step is not None:
                return step
        step = self.safety * self.critical_step.value
        if not isfinite(step):
            raise ConditionError(
                "every component of every node is held, or rigid: no motion limits the step",
                where="simulation, step", remedy="give step=",
            )  # fmt: skip
        return step

    @property
    def critical_step(self) -> CriticalStep:
        """The largest stable step, for small motions about the reference configuration."""
        elements = self.elements_critical_step
        return elements if self.contacts is None else self.contacts.critical_step(elements)

    @property
    def elements_critical_step(self) -> CriticalStep:
        """The critical step of bodies that touch nothing."""
        if self._critical is None:
            self._critical = find_critical_step(self)
        return self._critical

    @elements_critical_step.setter
    def elements_critical_step(self, found: CriticalStep) -> None:
        self._critical = found

    @property
    def contacts(self) -> Contacts | None:
        """The contacts of the bodies; None where they have none."""
        if self.contact is not None and self._contacts is None:
            self._contacts = make_contacts(self, self.contact)
        return self._contacts

    def find_acting(self) -> Acting:
        """What acts on the rigid bodies now."""
        from qdem_fem.rigid import Acting

        self.pack_lists()
        now = self.time + self.step * np.arange(2.0)
        place, force = np.zeros(0, np.int64), np.zeros((0, 3))
        if self.contacts is not None:
            self.contacts.refresh()
            place, force = self.contacts.place, self.contacts.kernel.force
        return Acting(
            self.motion.behind, self.step, self.conditions.table(now),
            self.gravity_vector, place, force,
        )  # fmt: skip

    def note_conditions_changed(self, ties: bool) -> None:
        """Make again, when next needed, what follows from the conditions."""
        super().note_conditions_changed(ties)
        if ties:
            self._critical = None
            if self._contacts is not None:
                self._contacts.forget_bounds()


def make_contacts(run: System, contact: Contact) -> Contacts:
    """What computes a contact."""
    if not isinstance(contact, SphereContact):
        return SurfaceContacts(run, contact)
    if run.device == "cpu":
        return SphereContacts(run, contact)
    from qdem_fem.contact.cuda import CudaSphereContacts

    return CudaSphereContacts(run, contact)
