"""Which contact a simulation may have, and what computes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from qdem_fem.contact import System
from qdem_fem.contact.spheres import SphereContact
from qdem_fem.contact.surface import SurfaceContact
from qdem_fem.files import ConditionError

if TYPE_CHECKING:
    from qdem_fem.contact import Contacts

Contact = SphereContact | SurfaceContact


def check_contact_options(contact: Any, precision: str, device: str) -> None:
    """Raise `ConditionError` for a contact that this simulation can not have."""
    if contact is None:
        return
    if not isinstance(contact, Contact):
        raise ConditionError(
            f"a {type(contact).__name__} is no contact",
            where="simulation, contact",
            remedy="give a SphereContact or a SurfaceContact",
        )
    if precision != "float64":
        raise ConditionError(
            "contact is computed in double precision",
            where="simulation, contact",
            remedy='take precision="float64"',
        )
    if device != "cpu" and not isinstance(contact, SphereContact):
        raise ConditionError(
            "contact of surfaces is computed on the processor",
            where="simulation, contact",
            remedy='take device="cpu", or a SphereContact',
        )


def contacts_of(run: System, contact: Contact) -> Contacts:
    """What computes a contact; its kernels are loaded when a simulation first needs them."""
    if isinstance(contact, SphereContact):
        if run.device != "cpu":
            from qdem_fem.contact.cuda import CudaSphereContacts

            return CudaSphereContacts(run, contact)
        from qdem_fem.contact import SphereContacts

        return SphereContacts(run, contact)
    from qdem_fem.contact import SurfaceContacts

    return SurfaceContacts(run, contact)
