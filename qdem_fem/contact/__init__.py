"""Contact between bodies: its state, its step, and the time step that it allows."""

from qdem_fem.contact.critical_step import CriticalStep, find_critical_step
from qdem_fem.contact.sphere_state import PARTED, SphereContacts
from qdem_fem.contact.state import Contacts
from qdem_fem.contact.surface_state import SurfaceContacts
from qdem_fem.contact.system import Motion, System, choose_assembly
from qdem_fem.contact.window import run_window

__all__ = [
    "PARTED", "Contacts", "CriticalStep", "Motion", "SphereContacts", "SurfaceContacts",
    "System", "choose_assembly", "find_critical_step", "run_window",
]  # fmt: skip
