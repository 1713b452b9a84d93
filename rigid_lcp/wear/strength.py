"""When a grain breaks: tensile stress of a grain from the forces at its contacts.

A disc of diameter D and thickness t pressed by P across a diameter is pulled apart at its centre
by ``2 P / (pi D t)`` (Hertz; the Brazilian test: Carneiro 1943, ISRM 1978, ASTM D3967).  For a
disc under any radial forces in balance, Flamant's solution for each force and a uniform tension
give the stress at the centre,

    S = sum_i P_i [I / (2 pi R t) - 2 n_i n_i^T / (pi R t)] = 2 s - tr(s) I / 2,
    s = 1 / V sum_i f_i l_i^T                   (mean stress of the grain; Weber 1966)

so that the greatest tension is ``(3 s_1 - s_2) / 2`` of the principal mean stresses
``s_1 >= s_2`` (tension positive).  It is used here for polygons too, as the Brazilian strength
of a grain of the same mean stress; that is a criterion, not the stress field of the polygon, and
for tangential forces it is no more than that for discs either.
In 3D: ``F / d^2`` of the greatest pair of opposite forces (Jaeger, Int. J. Rock Mech. Min. Sci. 4
(1967) 219; the usual measure of the strength of ballast stones).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats


@dataclass(frozen=True)
class Break:
    """Where a grain shall be split, and why."""

    point: Floats
    """A point of the line or plane: in the middle between the two forces, (dim,) [m]."""
    direction: Floats
    """Unit vector along the line between the two forces, (dim,)."""
    tension: float
    """[Pa]"""
    strength: float
    """[Pa]"""


def mean_stress(points: Floats, forces: Floats, centre: Floats, volume: float) -> Floats:
    """Mean stress of a grain, symmetric part, (dim, dim) [Pa], tension positive.

    ``points`` (n, dim) [m] and ``forces`` (n, dim) [N] on the grain; ``centre`` of mass (dim,);
    ``volume`` [m^3], in 2D area times thickness.
    """
    stress = forces.T @ (points - centre) / volume
    return np.asarray((stress + stress.T) / 2)


def brazilian_tension(stress: Floats) -> float:
    """Greatest tension [Pa] at the centre of a disc with mean ``stress`` (2, 2), see the module.

    Negative where even that is compression.
    """
    least, most = np.linalg.eigvalsh(stress)
    return float((3 * most - least) / 2)


def find_opposite_pair(points: Floats, forces: Floats) -> tuple[int, int, float] | None:
    """The two contacts that squeeze the grain most between them, and by how much [N].

    The squeeze of a pair is the lesser of the two forces' components along the line that joins
    them, towards each other.  None where no pair squeezes.
    """
    best: tuple[int, int, float] | None = None
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            apart = points[j] - points[i]
            distance = float(np.linalg.norm(apart))
            if distance == 0:
                continue
            squeeze = min(float(forces[i] @ apart), -float(forces[j] @ apart)) / distance
            if squeeze > (best[2] if best else 0.0):
                best = (i, j, squeeze)
    return best


def find_splitting_line(
    points: Floats, forces: Floats, centre: Floats, volume: float, strength: float
) -> Break | None:
    """Whether a grain breaks under its contact forces, and along which line; None if it holds.

    ``points`` (n, dim) [m], ``forces`` (n, dim) [N] on the grain, ``centre`` (dim,) [m],
    ``volume`` [m^3] (2D: area times thickness), ``strength`` [Pa]: Brazilian in 2D, point load in
    3D.  The crack runs through the greatest pair of opposite forces; in 3D, where a line does not
    fix a plane, the plane through it is the caller's choice.
    """
    pair = find_opposite_pair(points, forces)
    if pair is None:
        return None
    i, j, squeeze = pair
    apart = points[j] - points[i]
    distance = float(np.linalg.norm(apart))
    if points.shape[1] == 2:
        tension = brazilian_tension(mean_stress(points, forces, centre, volume))
    else:
        tension = squeeze / distance**2
    if tension < strength:
        return None
    return Break((points[i] + points[j]) / 2, apart / distance, tension, strength)
