"""The rail as an Euler-Bernoulli beam of Hermite elements, one a bay: exact between the seats."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from skfem import Basis, BilinearForm, ElementLineHermite, LinearForm, MeshLine
from skfem.helpers import dd, ddot

from track_line.arrays import Floats
from trackbed.scene_files import NonNegative, Positive, Real, Table

GRAVITY = 9.81
"""[m/s^2]"""
CUBIC = 3
"""Order of integration that is exact for curvature times curvature and for a load a metre."""


class Track(Table):
    """One rail and its half of every sleeper: a 60E1 rail, concrete sleepers."""

    bending: Positive = 6.3798e6  # E I of the rail [N m^2]
    rail_mass: NonNegative = 60.21  # of one rail [kg/m]
    pad: Positive = 100e6  # stiffness of a rail pad [N/m]
    bed: Positive = 28e6  # mean stiffness of the beds, under half a sleeper [N/m]
    sleeper_mass: NonNegative = 150.0  # of half a sleeper [kg]
    spacing: Annotated[Real, Field(ge=0.2, le=1.2)] = 0.6  # from sleeper to sleeper [m]
    damping: Positive = 55.4e3
    """Of the track under a wheel [N s/m], for unsprung masses; the British one of the P2 force
    (Jenkins et al. 1974), from memory."""


@dataclass(frozen=True)
class Rail:
    """A free rail over n seats as blocks of a symmetric matrix, for deflection [m], positive
    downwards, and slope [-] at each seat."""

    diagonal: Floats  # blocks (w w, w slope, slope slope) of each seat, shape (n, 3) [N/m, N, N m]
    upper: Floats  # blocks to the next seat, row by row, shape (n - 1, 4)
    weight: Floats  # of the rail, consistent with its elements, shape (n, 2) [N, N m]


@BilinearForm
def bend(u, v, w):  # type: ignore[no-untyped-def]
    """Curvature times curvature."""
    return ddot(dd(u), dd(v))


@LinearForm
def press(v, w):  # type: ignore[no-untyped-def]
    """A load of one a metre."""
    return v


def assemble_rail(place: Floats, track: Track) -> Rail:
    """The rail over seats at ``place`` (n,) [m], increasing; its ends are free."""
    basis = Basis(MeshLine(place), ElementLineHermite(), intorder=CUBIC)
    order = basis.nodal_dofs.T  # deflection and slope of each seat
    matrix = (track.bending * bend.assemble(basis)).tocsr()

    def take(first: Floats, second: Floats) -> Floats:
        return np.asarray(matrix[first, second]).ravel()

    w, slope = order.T
    diagonal = np.stack([take(w, w), take(w, slope), take(slope, slope)], axis=1)
    ways = [(w, w), (w, slope), (slope, w), (slope, slope)]
    upper = np.stack([take(a[:-1], b[1:]) for a, b in ways], axis=1)
    weight = track.rail_mass * GRAVITY * press.assemble(basis)
    return Rail(diagonal, upper, weight[order])
