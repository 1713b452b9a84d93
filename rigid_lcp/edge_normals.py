"""How normals across edges turn, and what it adds to the gap's acceleration (eq. 17, in space).

The normal of two crossing edges is across both, that of a sphere on an edge across the edge: both
turn with both bodies, and not as a face would.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.contacts import Contacts

Floats = NDArray[np.float64]


def edge_normal_rate(
    contacts: Contacts, spin_a: Floats, spin_b: Floats, velocity: Floats
) -> Floats:
    """``dn/dt`` (nc, 3) [1/s] of contacts whose body b has an edge there.

    ``spin_a``, ``spin_b`` (nc, 3) [rad/s]; ``velocity`` (nc, 3) [m/s]: that of a's carrier (point
    of the edge, centre of the sphere) relative to the point of b's edge nearest to it.

        edge a across edge b:  n || c = e_a x e_b,  dn/dt = (1 - n n^T) dc/dt / (n . c)
        sphere on edge b:      e_b . dn/dt = -n . de_b/dt,  t . dn/dt = t . velocity / distance
    """
    n, e = contacts.normal, contacts.edge_b
    turned_b = np.cross(spin_b, e)
    across = np.cross(contacts.edge_a, e)
    change = np.cross(np.cross(spin_a, contacts.edge_a), e) + np.cross(contacts.edge_a, turned_b)
    signed = _dot(n, across)
    crossing = (change - _dot(n, change)[:, None] * n) / np.where(signed == 0, 1.0, signed)[:, None]
    side = np.cross(e, n)
    distance = contacts.radius_a + contacts.gap
    rolling = _dot(side, velocity) / np.where(distance == 0, 1.0, distance)
    round_edge = -_dot(n, turned_b)[:, None] * e + rolling[:, None] * side
    sharp = np.any(contacts.edge_a != 0, axis=1, keepdims=True)
    return np.where(sharp, crossing, round_edge)


def edge_acceleration(
    contacts: Contacts, spin_a: Floats, spin_b: Floats, velocity: Floats, pull: Floats
) -> Floats:
    """``d2g/dt2`` (nc,) [m/s^2] of contacts with an edge, while no force acts.

    With ``g + R = n . D``, D from a point of b's edge to a's carrier, and D along n now:
    ``n . D'' + 2 n' . D' - |D| |n'|^2``.  ``velocity`` D' and ``pull`` D'' (nc, 3): those of the
    carrier relative to the nearest point of b's edge.
    """
    rate = edge_normal_rate(contacts, spin_a, spin_b, velocity)
    length = contacts.radius_a + contacts.gap
    return _dot(contacts.normal, pull) + 2 * _dot(rate, velocity) - length * _dot(rate, rate)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ci,ci->c", a, b), dtype=float)
