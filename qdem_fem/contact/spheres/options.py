"""Contact as in the paper (section 4, Table 1): a sphere at every vertex of a body's surface.

The section has no equation; what it says is "the Voigt model with a frictional slider" without
its dashpot.  Between spheres i and j of different bodies, ``d = x_i - x_j``, ``n = d/|d|``:

    F_i = k_n (r_i + r_j - |d|) n - k_t s,   k_t |s| <= mu F_n,   F_j = -F_i

with the tangential spring ``s`` [m], which grows by the tangential part of the relative way of
the vertices, turns with ``n`` without changing its length, and is cut where the slider slips.

What follows from spheres at vertices, which have no spin (`docs/qdem-contact.md` has figures):

* a body is larger by the radius than its mesh.  Table 1's mean edge of 10 mm and 109 elements a
  grain make a solid of about 29 mm; only with spheres of 24 mm is it the "around 5 cm" of the text;
* ``k_n`` belongs to a pair, not to an area: a finer mesh is a stiffer contact;
* the tangential force acts at both centres, a distance ``|d|`` apart, so angular momentum
  changes by ``d x F_t``: it is conserved without friction only.  For the same reason two bodies
  in contact that turn together as one strain the tangential spring;
* a smooth face is bumpy: vertices slide over each other's spheres.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.files import ConditionError, Floats, is_real

SKIN_OF_SPHERES = 0.1  # thickness of the neighbour list's skin, over the smallest radius [-]
ALONG_SINE = 1e-6  # of the angle to an axis below which a wall is along it [-]
CONTACTS = 3  # of a vertex at once for the time step still to be below the critical one [-]
NEAR: Literal["near"] = "near"  # instead: as many as it may have within the skin now


def find_tangential_stiffness(normal: Any, poisson: Any) -> Any:
    """``k_t = k_n / (2 (1 + nu))`` [N/m]: Table 1 has it to four digits for both its materials."""
    return normal / (2 * (1 + poisson))


def find_pair_stiffness(one: Any, other: Any) -> Any:
    """Stiffness between two spheres [N/m]: ``2 a b/(a + b)``, ``a`` for two of one material.

    Each sphere brings a spring of ``2 a``, in series.  The paper gives springs of two materials
    and none between them; this rule is ours.  A rigid wall leaves ``2 a``, as a mirror would.
    """
    return 2 * one * other / (one + other)


@dataclass(frozen=True)
class ContactPlane:
    """A rigid wall that does not move: spheres stay on the side its normal points to."""

    point: tuple[float, float, float]
    """[m]"""
    normal: tuple[float, float, float]
    friction: float | None = None
    """Coulomb's coefficient; by default that between bodies."""


@dataclass(frozen=True)
class SphereContact:
    """Spheres at the surface vertices of all bodies; what ``[contact]`` of a scene says.

    ``radius`` [m] and ``normal_stiffness`` [N/m] are numbers, or by the name of the body.
    Raises `ConditionError`.
    """

    radius: float | Mapping[str, float]
    """[m]; the paper: 0.012"""
    normal_stiffness: float | Mapping[str, float]
    """k_n of two spheres of the body's material [N/m]; the paper: 1.613e9 and 2.390e9"""
    friction: float
    """Coulomb's coefficient mu; the paper: 0.577 and 1.73"""
    planes: Sequence[ContactPlane] = ()
    skin: float | None = None
    """Of the neighbour list [m], which changes no force; a tenth of the radius by default."""
    contacts: int | Literal["near"] = CONTACTS
    """Contacts of a vertex at once that the time step allows for; or ``"near"``: those within the
    skin when the march begins (`qdem_fem.contact.bounds`), for bodies that lie together.  A march
    that meets more stops."""
    periodic: PeriodicWidth | None = field(default=None, repr=False)
    """Bodies touch across the sides of this width; not at all by default."""

    def __post_init__(self) -> None:
        for name in ("radius", "normal_stiffness"):
            value = getattr(self, name)
            for each in value.values() if isinstance(value, Mapping) else [value]:
                check_contact_number(each, name, above=True)
        if self.skin is not None:
            check_contact_number(self.skin, "skin", above=True)
        check_contact_number(self.friction, "friction", above=False)
        if self.contacts != NEAR and not (is_real(self.contacts) and self.contacts >= 1):
            raise ConditionError(f"{self.contacts!r} contacts of a vertex", where="contact")
        check_contact_planes(self.planes)
        check_planes_along(self.periodic, self.planes)

    def find_value(self, name: str, quantity: str) -> float:
        """``radius`` or ``normal_stiffness`` of a body; `ConditionError` where it has none."""
        return find_body_value(getattr(self, quantity), name, quantity)


def find_body_value(value: float | Mapping[str, float], name: str, quantity: str) -> float:
    """A number of a body: one for all, or by its name; `ConditionError` where it has none."""
    if not isinstance(value, Mapping):
        return float(value)
    if name not in value:
        raise ConditionError(
            f"body {name} has none, only {', '.join(value) or 'nobody'} has",
            where=f"contact, {quantity}",
            remedy="give one number for all bodies, or one for each by its name",
        )
    return float(value[name])


def check_contact_number(value: Any, name: str, *, above: bool) -> None:
    """Raise `ConditionError` for what is no number above zero, or at least zero."""
    if not (is_real(value) and np.isfinite(value) and (value > 0 if above else value >= 0)):
        raise ConditionError(
            f"{value!r} is not {'above' if above else 'at least'} zero", where=f"contact, {name}"
        )


def check_contact_planes(planes: Sequence[ContactPlane]) -> None:
    """Raise `ConditionError` for a wall without a place, a direction or a friction."""
    for number, plane in enumerate(planes):
        name = f"plane.{number}"
        for quantity, given in (("point", plane.point), ("normal", plane.normal)):
            try:
                vector = np.asarray(given, dtype=float)
            except (TypeError, ValueError):
                vector = np.zeros(0)
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise ConditionError(
                    f"{given!r} are not three numbers", where=f"contact, {name}.{quantity}"
                )
            if quantity == "normal" and not vector.any():
                raise ConditionError("it has no direction", where=f"contact, {name}.normal")
        if plane.friction is not None:
            check_contact_number(plane.friction, f"{name}.friction", above=False)


def check_planes_along(periodic: Any, planes: Sequence[ContactPlane]) -> None:
    """Raise `ConditionError` for a wall across a periodic width: images would be behind it."""
    if periodic is None:
        return
    if not isinstance(periodic, PeriodicWidth):
        raise ConditionError(f"{periodic!r} is no PeriodicWidth", where="contact, periodic")
    for number, plane in enumerate(planes):
        normal = np.asarray(plane.normal, dtype=float)
        if abs(normal[periodic.number]) > ALONG_SINE * np.linalg.norm(normal):
            raise ConditionError(
                f"its normal has a part along {periodic.axis}, where the width is periodic",
                where=f"contact, plane.{number}",
                remedy="a wall has to be parallel to the axis of the width",
            )


def pack_planes(planes: Sequence[ContactPlane], friction: float) -> tuple[Floats, Floats, Floats]:
    """Points (w, 3) [m], unit normals (w, 3) and frictions (w,) of walls."""
    across = np.array([plane.normal for plane in planes], dtype=float).reshape(-1, 3)
    own = [friction if plane.friction is None else plane.friction for plane in planes]
    return (
        np.array([plane.point for plane in planes], dtype=float).reshape(-1, 3),
        across / np.linalg.norm(across, axis=1, keepdims=True),
        np.array(own, dtype=float),
    )
