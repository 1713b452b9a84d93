"""What a scene can be computed with, but hardly means: a warning each, with place and number."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from qdem_fem.bodies import LOCKING, estimate_bending, is_locking
from qdem_fem.element import MEASURES
from qdem_fem.files import Floats, Series, warn_user
from qdem_fem.march import split_motion
from qdem_fem.tables import Prepared, Scene
from trackbed.plausible import Quantity, describe_implausible


@dataclass(frozen=True)
class DoubtNumbers:
    """From where on the user is warned."""

    bending: float = 0.1  # shortfall of a deflection, of which a dry run warns [-]
    turned: float = 0.05  # share of a small strain that may be due to turning [-]
    single: float = 2e-6
    """Strain that rounding leaves in turning bodies in single precision, measured 1 to 2e-6 [-]."""


DOUBT = DoubtNumbers()
TIMED = "duration step safety sampling energy_interval vtu_interval checkpoint_interval audit modes"
"""Keys of ``[simulation]`` and ``[output]`` that a static answer does not use."""


def warn_of_values(scene: Scene, bodies: dict[str, Any]) -> None:
    """Warn of moduli, densities and coefficients of friction that are hardly meant."""
    values: list[tuple[Quantity, float, str]] = []
    for body in bodies.values():
        given: tuple[Quantity, ...] = ("density",) if body.rigid else ("density", "young")
        for quantity in given:
            found = np.unique(getattr(body.material, quantity))
            where = f"material.{quantity} of {body.name!r}"
            values += [(quantity, float(one), where) for one in found[[0, -1]]]
    if scene.contact is not None:
        values.append(("friction", scene.contact.friction, "contact.friction"))
        for number, plane in enumerate(scene.contact.plane):
            values.append(("friction", plane.friction or 0.0, f"contact.plane.{number}.friction"))
    said = (describe_implausible(*value) for value in values)
    for text in dict.fromkeys(one for one in said if one):
        warn_user(text)
    if locking := next(filter(is_locking, bodies.values()), None):
        warn_user(
            f"linear tetrahedra lock at a Poisson's ratio above {LOCKING:g}, as that of "
            f"{locking.name}: displacements may be many times too small, and no error of the mesh "
            f"is estimated; take {LOCKING:g}, or compare with a far finer mesh"
        )


def warn_of_unused(prepared: Prepared) -> None:
    """Warn of keys, given other than by default, and of series that the run does not use."""
    table, given = prepared.scene.simulation, prepared.scene.model_dump(exclude_defaults=True)
    unused = {"dynamic": "tolerance safety" if table.step else "tolerance", "static": TIMED}
    rows = (f"{of}.{key}" for of in ("simulation", "output") for key in given.get(of, {}))
    if keys := [row for row in rows if row.partition(".")[2] in unused[table.method].split()]:
        beside = " of a given step" * (table.method == "dynamic" and "safety" in keys[-1])
        warn_user(f"a {table.method} run{beside} does not use {', '.join(keys)}")
    for step in prepared.conditions if table.method == "dynamic" else ():
        for series in (one for one in step.arguments if isinstance(one, Series)):
            if len(series.times) > 1 and (late := series.times[0]) >= table.duration:
                text = f"{step.key} begins to change at {late:g} s, after the run has ended"
                warn_user(f"{text}: it keeps its first value throughout")


def sort_by_kind(bodies: dict[str, Any]) -> dict[str, list[Any]]:
    """Bodies that are named alike but for a number behind a dash, by what is before it."""
    kinds: dict[str, list[Any]] = {}
    for name, body in bodies.items():
        stem, _, number = name.rpartition("-")
        kinds.setdefault(stem if number.isdecimal() else name, []).append(body)
    return kinds


def warn_of_bending(bodies: dict[str, Any], *, others: bool) -> None:
    """Warn of meshes too coarse for bending; of bodies that are named alike the first is looked at.

    No load is looked at, and no answer needed: whether a body bends is for the user to know.
    ``others``: the scene can have other elements."""
    remedy = "mesh it finer across" + ', or take element = "quadratic"' * others
    for alike in sort_by_kind(bodies).values():
        judged = not alike[0].rigid and not is_locking(alike[0])
        if judged and (short := estimate_bending(alike[0])) > DOUBT.bending:
            warn_user(
                f"if {alike[0].name} bends, it bends about {100 * short:.0f} % too little: linear "
                f"tetrahedra are too stiff; {remedy}"
            )


def warn_of_strain(run: Any, moved: Floats) -> None:
    """Warn of turns that small strain takes for strain, and of strains that float32 can not hold.

    ``moved``: displacement (n, 3) [m] of all bodies.
    """
    for body, u, free in split_motion(run, moved):
        if body.rigid:
            continue
        gradient = body.find_gradient(u)
        small, true = (MEASURES[name].compute_strain(gradient) for name in ("small", "svk"))
        volume = body.gradients[1]
        squares = ((one**2).sum(axis=(-2, -1)) for one in (small - true, true))
        wrong, whole = (float(np.sum(square @ volume)) for square in squares)
        if not MEASURES[run.strain].OBJECTIVE and wrong > DOUBT.turned**2 * whole:
            warn_user(
                f"{body.name} turns, and strain = {run.strain!r} takes a turn for strain: of it "
                f'{100 * np.sqrt(wrong / whole):.0f} % is wrong; take "finger"'
            )
        greatest = float(np.sqrt((true**2).sum(axis=(-2, -1)).max()))
        if run.precision == "float32" and free and greatest < DOUBT.single:
            warn_user(
                f"the strain of {body.name}, {greatest:.2g} at most, is below what single "
                f"precision holds of a body that turns, {DOUBT.single:g}, or "
                f'{DOUBT.single * float(np.max(body.material.young)):.2g} Pa: precision = "float64"'
            )
