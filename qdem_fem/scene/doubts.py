"""What a scene can be computed with, but hardly means: a warning each, with place and number."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from qdem_fem.bodies import estimate_bending
from qdem_fem.files import SceneWarning
from qdem_fem.scene.summary import sort_by_kind
from qdem_fem.tables import Scene
from trackbed.plausible import Quantity, describe_implausible

BENDING = 0.1
"""Shortfall of a deflection [-] above which a dry run warns of a mesh."""


def warn_of_values(scene: Scene, bodies: dict[str, Any]) -> None:
    """Warn of moduli, densities, coefficients of friction and sizes that are hardly meant."""
    values: list[tuple[Quantity, float, str]] = []
    for body in bodies.values():
        size = float(np.ptp(body.nodes, axis=0).max())
        mass = float(body.material.density @ body.gradients[1])
        values.append(("body", size, f"body {body.name!r} of {mass:.3g} kg"))
        for quantity in ("young", "density"):
            found = np.unique(getattr(body.material, quantity))
            where = f"material.{quantity} of {body.name!r}"
            values += [(quantity, float(one), where) for one in found[[0, -1]]]
    if scene.contact is not None:
        values.append(("friction", scene.contact.friction, "contact.friction"))
        values += [
            ("friction", plane.friction, f"contact.plane.{number}.friction")
            for number, plane in enumerate(scene.contact.plane)
            if plane.friction is not None
        ]
    said = (describe_implausible(*value) for value in values)
    for text in dict.fromkeys(one for one in said if one):
        warnings.warn(text, SceneWarning, stacklevel=2)


def warn_of_bending(bodies: dict[str, Any]) -> None:
    """Warn of meshes too coarse for bending; of bodies that are named alike the first is looked at.

    No load is looked at, and no answer needed: whether a body bends is for the user to know."""
    for alike in sort_by_kind(bodies).values():
        if not alike[0].rigid and (short := estimate_bending(alike[0])) > BENDING:
            warnings.warn(
                f"if {alike[0].name} bends, it bends about {100 * short:.0f} % too little: linear "
                "tetrahedra are too stiff; mesh it finer across",
                SceneWarning,
                stacklevel=2,
            )
