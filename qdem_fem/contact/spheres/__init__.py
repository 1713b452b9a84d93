"""Contact by spheres at surface vertices (section 4 of the paper)."""

from qdem_fem.contact.spheres import law
from qdem_fem.contact.spheres.law import (
    DEEPEST,
    GO_ON,
    LOOK_AGAIN,
    TOO_DEEP,
    Contact,
    Planes,
    Spheres,
    add_in_series,
    advance_one,
    advance_threads,
    slide_spring,
    subtract_rows,
    write_row,
)
from qdem_fem.contact.spheres.options import (
    NEAR,
    SKIN_OF_SPHERES,
    ContactPlane,
    SphereContact,
    check_contact_number,
    check_contact_planes,
    check_planes_along,
    find_body_value,
    find_pair_stiffness,
    find_tangential_stiffness,
    pack_planes,
)

__all__ = [
    "DEEPEST", "GO_ON", "LOOK_AGAIN", "NEAR", "SKIN_OF_SPHERES", "TOO_DEEP", "Contact",
    "ContactPlane", "Planes", "SphereContact", "Spheres", "add_in_series", "advance_one",
    "advance_threads", "check_contact_number", "check_contact_planes", "check_planes_along",
    "find_body_value", "find_pair_stiffness", "find_tangential_stiffness", "law", "pack_planes",
    "slide_spring", "subtract_rows", "write_row",
]  # fmt: skip
