"""Contacts between bodies: where, along which normal, how far apart, and what they carry."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.shapes import vectors

FEATURE_BITS, BODY_BITS = 10, 21
"""Digits of the names of contacts that tell features and bodies."""
LENGTH_TIE = 1e-9
"""Share of the smaller reach of two bodies [-] below which lengths are equal: then the body or the
feature of the smaller number is taken, so that round-off never renames a contact."""


@njit(cache=True)
def pack_key(a: int, b: int, feature_a: int, feature_b: int) -> int:
    """One number for a feature of a on a feature of b."""
    return ((((a << BODY_BITS) | b) << FEATURE_BITS) | feature_a) << FEATURE_BITS | feature_b


@dataclass(frozen=True)
class Contacts:
    """Point contacts of nc pairs of features (eq. 9): a point of body a above body b.

    Bodies are numbered as in the scene, fixed ones included.
    """

    body_a: Ints  # body with the vertex (or the disc, the sphere), (nc,)
    body_b: Ints  # body with the face, (nc,)
    point: Floats  # contact points [m], (nc, dim), on the surface of a
    normal: Floats  # unit normals from b to a, (nc, dim)
    gap: Floats  # distances [m], (nc,), negative for an overlap
    key: Ints
    """Names of the contacts, (nc,): the same two features have the same key at the next step."""
    radius_a: Floats  # radius of curvature of a's feature at the point [m], (nc,): 0 for a vertex
    radius_b: Floats
    """Radius of curvature of b's feature [m], (nc,): inf for a face, 0 for a vertex."""
    friction: Floats  # Coulomb's coefficients [-], (nc,)
    restitution: Floats  # coefficients of restitution [-], (nc,)
    edge_a: Floats
    """Unit directions of a's edge at the contact (nc, dim), zero where it is none; 3D only."""
    edge_b: Floats  # unit directions of b's edge, likewise; 3D only

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def dim(self) -> int:
        """2 or 3."""
        return self.normal.shape[1]

    def __getitem__(self, rows: Bools | Ints) -> Self:
        """The contacts ``rows``, a mask or an array of numbers."""
        return type(self)(**{each.name: getattr(self, each.name)[rows] for each in fields(self)})


@dataclass(frozen=True, kw_only=True)
class ContactForces(Contacts):
    """Contacts with the forces they carried in the last step."""

    normal_force: Floats
    """Normal forces [N], (nc,); impulse over the step's length with time stepping."""
    tangential_force: Floats
    """Tangential forces [N]: (nc,) along (-n_y, n_x) in 2D, (nc, 3) as vectors in 3D; on a."""
    status: NDArray[np.str_]  # ``open``, ``stick`` or ``slide``, (nc,)

    @property
    def force(self) -> Floats:
        """Forces on body a as vectors [N], (nc, dim)."""
        tangential = self.tangential_force
        if self.dim == 2:
            tangential = tangential[:, None] * build_frames(self.normal)[:, 1]
        return self.normal_force[:, None] * self.normal + tangential


@njit(cache=True)
def find_frame(normal: Floats, frame: Floats) -> None:
    """Fill ``frame`` (dim, dim) with the right-handed rows n, t (n, t1, t2) of a normal (dim,).

    2D: t is (-n_y, n_x).  3D: t1 is across n and the axis that n is farthest from.
    """
    frame[0] = normal
    if len(normal) == 2:
        frame[1, 0], frame[1, 1] = -normal[1], normal[0]
        return
    x, y, z = normal
    across = (-y, x, 0.0)
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        across = (0.0, -z, y)
    elif abs(y) <= abs(z):
        across = (z, 0.0, -x)
    across = vectors.divide(across, np.sqrt(vectors.dot(across, across)))
    frame[1], frame[2] = across, vectors.cross(normal, across)


@njit(cache=True)
def build_frames(normal: Floats) -> Floats:
    """Unit vectors n, t (n, t1, t2) of every contact as rows, (nc, dim, dim)."""
    nc, dim = normal.shape
    frames = np.empty((nc, dim, dim))
    for c in range(nc):
        find_frame(normal[c], frames[c])
    return frames


def match_keys(old: Ints, new: Ints) -> tuple[Ints, Bools]:
    """Where each key of ``new`` stands in ``old`` (any row if it does not), and if it does."""
    if len(old) == 0:
        return np.zeros(len(new), dtype=np.int64), np.zeros(len(new), dtype=bool)
    order = np.argsort(old, kind="stable")
    place = np.minimum(np.searchsorted(old, new, sorter=order), len(old) - 1)
    rows = order[place]
    return rows, old[rows] == new
