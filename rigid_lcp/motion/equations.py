"""The geometry equations of section 5: relative velocities and accelerations at the contacts.

With the rows of J along n, t (n, t1, t2) of every contact, ``u = J v`` are the relative velocities
(positive when parting), ``A = J M^-1 J^T`` the matrices of eqs 17 and 25 in one, and b their
offset (eqs 17, 24).  Bodies that can not move have no columns.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import Contacts, build_frames
from rigid_lcp.friction.problem import BodySpace
from rigid_lcp.motion.state import Motion


def make_body_space(
    contacts: Contacts, position: Floats, columns: Ints, inverse_mass: sp.csr_array
) -> BodySpace:
    """J and M^-1 of the contacts, ``A = J M^-1 J^T`` (eqs 17, 25).

    ``position`` (n, dim) [m] of all bodies; ``columns`` (n,): the place of each among the movable
    ones, -1 for a fixed one; ``inverse_mass`` of the movable ones.
    """
    size = 3 if contacts.dim == 2 else 6
    movable = inverse_mass.shape[0] // size
    return BodySpace(build_jacobian(contacts, position, columns, movable), inverse_mass, size)


def find_response(bodies: BodySpace, impulse: Floats) -> Floats:
    """``M^-1 J^T p``, (nb, 3) or (nb, 6), of contact impulses p: what they do to the velocities."""
    change = bodies.inverse_mass @ (bodies.jacobian.T @ impulse.ravel())
    return np.asarray(change).reshape(-1, bodies.body_size)


def build_jacobian(
    contacts: Contacts, position: Floats, columns: Ints, movable: int
) -> sp.csr_array:
    """J (nc * dim, movable * 3) in 2D, (nc * dim, movable * 6) in 3D: ``dg/dq`` (eqs 13, 20).

    Row of a direction d: (d, x_a x d) for body a and its negative, with x_b, for body b.
    """
    dim, nc = contacts.dim, len(contacts)
    frames = build_frames(contacts.normal)
    size = 3 if dim == 2 else 6
    values = np.empty((nc, dim, 2, size))
    place = np.empty((nc, 2), dtype=np.int64)
    for side, (bodies, sign) in enumerate(((contacts.body_a, 1.0), (contacts.body_b, -1.0))):
        lever = contacts.point - position[bodies]
        values[:, :, side, :dim] = sign * frames
        values[:, :, side, dim:] = sign * _find_moment(lever[:, None, :], frames)
        place[:, side] = columns[bodies]
    swap = place[:, 0] > place[:, 1]  # columns in ascending order
    values[swap], place[swap] = values[swap][:, :, ::-1], place[swap][:, ::-1]
    there = np.broadcast_to((place >= 0)[:, None, :, None], values.shape)
    column = np.broadcast_to(place[:, None, :, None] * size + np.arange(size), values.shape)
    counts = there.sum(axis=(2, 3)).ravel()
    pointer = np.concatenate([[0], np.cumsum(counts)])
    shape = (nc * dim, movable * size)
    return sp.csr_array((values[there], column[there], pointer), shape=shape)


def _find_moment(lever: Floats, force: Floats) -> Floats:
    """``x x f``: one number (in a last axis of its own) in 2D, a vector in 3D."""
    if lever.shape[-1] == 3:
        return np.cross(lever, force)
    return (lever[..., 0] * force[..., 1] - lever[..., 1] * force[..., 0])[..., None]


def turn_arm(spin: Floats, arm: Floats) -> Floats:
    """``w x r``: (n, 2) of spins (n,) and arms (n, 2), (n, 3) of both (n, 3)."""
    if arm.shape[-1] == 3:
        return np.cross(spin, arm)
    return np.stack([-spin * arm[..., 1], spin * arm[..., 0]], axis=-1)


def _find_point_velocities(motion: Motion, bodies: Ints, point: Floats) -> Floats:
    arm = point - motion.position[bodies]
    return motion.velocity[bodies] + turn_arm(motion.spin[bodies], arm)


def find_relative_velocity(contacts: Contacts, motion: Motion) -> Floats:
    """``u = J v`` with all bodies, moving or driven: (nc, dim) along n, t (n, t1, t2) [m/s]."""
    a = _find_point_velocities(motion, contacts.body_a, contacts.point)
    b = _find_point_velocities(motion, contacts.body_b, contacts.point)
    return np.einsum("cij,cj->ci", build_frames(contacts.normal), a - b)


def find_inertial_acceleration(contacts: Contacts, motion: Motion) -> Floats:
    """The terms ``d2g/dq_k dq_l q'_k q'_l`` of eqs 14, 17 and 24, (nc, dim) [m/s^2].

    Relative acceleration at the contacts while no force or torque acts.  With c the carrier of a
    surface (a vertex, or a centre of curvature at the distance R behind the contact point), and
    ``c' = v + w x x``, ``c'' = w x (w x x)``:

        curved b:  n . (c_a'' - c_b'') + |tangential part of c_a' - c_b'|^2 / |c_a - c_b|
        flat b:    n . (c_a'' - c_b'') + 2 (w_b x n) . (c_a' - c_b')

    where in the second c_b is the point of body b at c_a.  Tangential, as the contact point c goes
    on with ``c' = c_a' - R_a n'`` over both surfaces (a ball rolls) and not with either of them:

        t . (w_a x (c' - v_a) - w_b x (c' - v_b))

    In 3D, at edges, see `_find_edge_terms`; crossing edges that slide along each other are taken to
    slide along b's, which matters to no force: friction then has the velocity's direction.
    """
    a, b, n = contacts.body_a, contacts.body_b, contacts.normal
    flat = np.isinf(contacts.radius_b)
    carrier_a = contacts.point + contacts.radius_a[:, None] * n
    behind = np.where(flat, 0.0, contacts.radius_b)
    face = contacts.point - contacts.gap[:, None] * n
    carrier_b = np.where(flat[:, None], carrier_a, face - behind[:, None] * n)
    carried = _find_point_velocities(motion, a, carrier_a)
    moving = carried - _find_point_velocities(motion, b, carrier_b)
    along = moving - (moving * n).sum(axis=1)[:, None] * n
    apart = contacts.radius_a + behind + contacts.gap
    apart = np.where(flat | (apart <= 0), 1.0, apart)
    turning = turn_arm(motion.spin[b], n)
    pull = _find_centripetal(motion, a, carrier_a) - _find_centripetal(motion, b, carrier_b)
    normal = (n * pull).sum(axis=1)
    curved = (along * along).sum(axis=1) / apart
    normal += np.where(flat, 2 * (turning * moving).sum(axis=1), curved)
    normal_rate = np.where(flat[:, None], turning, along / apart[:, None])
    edges = np.flatnonzero(np.any(contacts.edge_b != 0, axis=1))
    if len(edges):
        normal[edges], normal_rate[edges] = _find_edge_terms(contacts[edges], motion)
    rate = carried - contacts.radius_a[:, None] * normal_rate
    pull = turn_arm(motion.spin[a], rate - motion.velocity[a])
    pull -= turn_arm(motion.spin[b], rate - motion.velocity[b])
    result = np.einsum("cij,cj->ci", build_frames(n), pull)
    result[:, 0] = normal
    return result


def _find_edge_terms(contacts: Contacts, motion: Motion) -> tuple[Floats, Floats]:
    """Normal part (nc,) [m/s^2] and ``n' = dn/dt`` (nc, 3) [1/s] for contacts at an edge of b.

    The normal of two crossing edges is across both, that of a sphere on an edge across the edge:
    both turn with both bodies, and not as a face would.  With ``g + R = n . D``, D from a point of
    b's edge to a's carrier, and D along n now:

        d2g/dt2 = n . D'' + 2 n' . D' - |D| |n'|^2
        edge a across edge b:  n || c = e_a x e_b,  n' = (1 - n n^T) c' / (n . c)
        sphere on edge b:      e_b . n' = -n . e_b',  t . n' = t . D' / distance
    """
    a, b, n = contacts.body_a, contacts.body_b, contacts.normal
    carrier = contacts.point + contacts.radius_a[:, None] * n
    foot = contacts.point - contacts.gap[:, None] * n
    velocity = _find_point_velocities(motion, a, carrier) - _find_point_velocities(motion, b, foot)
    pull = _find_centripetal(motion, a, carrier) - _find_centripetal(motion, b, foot)
    e_a, e_b = contacts.edge_a, contacts.edge_b
    turned_b = np.cross(motion.spin[b], e_b)
    across = np.cross(e_a, e_b)
    change = np.cross(np.cross(motion.spin[a], e_a), e_b) + np.cross(e_a, turned_b)
    signed = _dot(n, across)
    crossing = (change - _dot(n, change)[:, None] * n) / np.where(signed == 0, 1.0, signed)[:, None]
    side = np.cross(e_b, n)
    distance = contacts.radius_a + contacts.gap
    rolling = _dot(side, velocity) / np.where(distance == 0, 1.0, distance)
    round_edge = -_dot(n, turned_b)[:, None] * e_b + rolling[:, None] * side
    sharp = np.any(e_a != 0, axis=1, keepdims=True)
    rate = np.where(sharp, crossing, round_edge)
    return _dot(n, pull) + 2 * _dot(rate, velocity) - distance * _dot(rate, rate), rate


def _find_centripetal(motion: Motion, bodies: Ints, point: Floats) -> Floats:
    spin = motion.spin[bodies]
    return turn_arm(spin, turn_arm(spin, point - motion.position[bodies]))


def find_contact_offset(contacts: Contacts, motion: Motion, free: Motion) -> Floats:
    """b of eqs 17 and 24, (nc * dim,): relative accelerations without contact forces [m/s^2].

    ``free`` has the accelerations that the loads alone would give as its velocities and spins.
    """
    loads = find_relative_velocity(contacts, free)
    return (loads + find_inertial_acceleration(contacts, motion)).ravel()


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ci,ci->c", a, b), dtype=float)
