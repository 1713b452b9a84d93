"""The geometry equations of section 5: relative velocities and accelerations at the contacts.

With the rows of J along n, t (n, t1, t2) of every contact, ``u = J v`` are the relative velocities
(positive when parting), ``A = J M^-1 J^T`` the matrices of eqs 17 and 25 in one, and b their
offset (eqs 17, 24).  Bodies that can not move have no columns.
"""

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import Contacts, find_frame
from rigid_lcp.friction.problem import BodySpace
from rigid_lcp.motion.state import Motion
from rigid_lcp.shapes import vectors
from rigid_lcp.sparse import multiply_csr, split_csr

Indices = NDArray[np.int32]


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
    change: Floats = _multiply_spread(
        *split_csr(bodies.jacobian), *split_csr(bodies.inverse_mass), impulse.ravel()
    )
    return change.reshape(-1, bodies.body_size)


@njit(cache=True)
def _multiply_spread(
    start: Indices, index: Indices, value: Floats, mass_start: Indices, mass_index: Indices,
    inverse_mass: Floats, impulse: Floats,
) -> Floats:  # fmt: skip
    """``M^-1 J^T p``, both matrices by rows."""
    push = np.zeros(len(mass_start) - 1)
    for i in range(len(impulse)):
        for k in range(start[i], start[i + 1]):
            push[index[k]] += value[k] * impulse[i]
    return multiply_csr(mass_start, mass_index, inverse_mass, push)


def build_jacobian(
    contacts: Contacts, position: Floats, columns: Ints, movable: int
) -> sp.csr_array:
    """J (nc * dim, movable * 3) in 2D, (nc * dim, movable * 6) in 3D: ``dg/dq`` (eqs 13, 20).

    Row of a direction d: (d, x_a x d) for body a and its negative, with x_b, for body b.
    """
    size = 3 if contacts.dim == 2 else 6
    made = _list_jacobian(
        contacts.body_a, contacts.body_b, contacts.point, contacts.normal, position, columns
    )
    return sp.csr_array(made, shape=(len(contacts) * contacts.dim, movable * size))


@njit(cache=True)
def _list_jacobian(
    body_a: Ints, body_b: Ints, point: Floats, normal: Floats, position: Floats, columns: Ints
) -> tuple[Floats, Indices, Indices]:
    """Values of J by rows, their columns, and where each row begins."""
    nc, dim = point.shape
    size = 3 * (dim - 1)
    value, column = np.empty(nc * dim * 2 * size), np.empty(nc * dim * 2 * size, np.int32)
    start, frame = np.zeros(nc * dim + 1, np.int32), np.empty((dim, dim))
    k = 0
    for c in range(nc):
        find_frame(normal[c], frame)
        x = vectors.read(point, c)
        sign, first, second = 1.0, body_a[c], body_b[c]
        if columns[first] > columns[second]:  # columns in ascending order
            sign, first, second = -1.0, second, first
        for i in range(dim):
            d = vectors.read(frame, i)
            for body, side in ((first, sign), (second, -sign)):
                if columns[body] < 0:
                    continue
                moment = vectors.cross(vectors.subtract(x, vectors.read(position, body)), d)
                for axis in range(dim):
                    value[k + axis] = side * d[axis]
                for axis in range(dim, size):
                    value[k + axis] = side * moment[axis - dim if dim == 3 else 2]
                for axis in range(size):
                    column[k + axis] = columns[body] * size + axis
                k += size
            start[c * dim + i + 1] = k
    return value[:k], column[:k], start


def turn_arm(spin: Floats, arm: Floats) -> Floats:
    """``w x r``: (n, 2) of spins (n,) and arms (n, 2), (n, 3) of both (n, 3)."""
    if arm.shape[-1] == 3:
        return np.cross(spin, arm)
    return np.stack([-spin * arm[..., 1], spin * arm[..., 0]], axis=-1)


@njit(cache=True)
def _find_relative_motion(
    position: Floats, rates: Floats, a: int, x: vectors.Vector, b: int, y: vectors.Vector
) -> tuple[vectors.Vector, vectors.Vector, vectors.Vector]:
    """Velocity of a's point x, and it and ``w x (w x r)`` less those of b's point y."""
    (v_a, spin_a), (v_b, spin_b) = vectors.read_rates(rates, a), vectors.read_rates(rates, b)
    turn_a = vectors.cross(spin_a, vectors.subtract(x, vectors.read(position, a)))
    turn_b = vectors.cross(spin_b, vectors.subtract(y, vectors.read(position, b)))
    carried = vectors.add(v_a, 1.0, turn_a)
    moving = vectors.subtract(carried, vectors.add(v_b, 1.0, turn_b))
    pull = vectors.subtract(vectors.cross(spin_a, turn_a), vectors.cross(spin_b, turn_b))
    return carried, moving, pull


def find_relative_velocity(contacts: Contacts, motion: Motion) -> Floats:
    """``u = J v`` with all bodies, moving or driven: (nc, dim) along n, t (n, t1, t2) [m/s]."""
    found: Floats = _list_relative_velocities(
        contacts.body_a, contacts.body_b, contacts.point, contacts.normal, motion.position,
        motion.rates,
    )  # fmt: skip
    return found


@njit(cache=True)
def _list_relative_velocities(
    body_a: Ints, body_b: Ints, point: Floats, normal: Floats, position: Floats, rates: Floats
) -> Floats:
    nc, dim = point.shape
    found, frame = np.empty((nc, dim)), np.empty((dim, dim))
    for c in range(nc):
        x = vectors.read(point, c)
        apart = _find_relative_motion(position, rates, body_a[c], x, body_b[c], x)[1]
        find_frame(normal[c], frame)
        for i in range(dim):
            found[c, i] = vectors.project(vectors.read(frame, i), apart)
    return found


def find_inertial_acceleration(
    contacts: Contacts, motion: Motion, corners_round: bool = True
) -> Floats:
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

    The distance of two points (a corner on a corner or an edge) has a curvature of 1 over itself:
    it tells how the gap grows only for times far below a step.  With ``corners_round`` False the
    plane across the normal takes the place of b there: it parts the two bodies, so it is safe, and
    at most the way of a step too careful with bodies that would just pass.
    """
    c = contacts
    found: Floats = _list_inertial_accelerations(
        c.body_a, c.body_b, c.point, c.normal, c.gap, c.radius_a, c.radius_b, c.edge_a, c.edge_b,
        motion.position, motion.rates, corners_round,
    )  # fmt: skip
    return found


@njit(cache=True)
def _list_inertial_accelerations(
    body_a: Ints, body_b: Ints, point: Floats, normals: Floats, gaps: Floats, radius_a: Floats,
    radius_b: Floats, edges_a: Floats, edges_b: Floats, position: Floats, rates: Floats,
    corners_round: bool,
) -> Floats:  # fmt: skip
    nc, dim = point.shape
    found, frame = np.empty((nc, dim)), np.empty((dim, dim))
    for c in range(nc):
        a, b, n, gap = body_a[c], body_b[c], vectors.read(normals, c), gaps[c]
        x, e_a, e_b = vectors.read(point, c), vectors.read(edges_a, c), vectors.read(edges_b, c)
        plane = not corners_round and radius_a[c] == 0.0 and radius_b[c] == 0.0
        flat = plane or np.isinf(radius_b[c])
        behind = 0.0 if flat else radius_b[c]
        carrier, foot = vectors.add(x, radius_a[c], n), vectors.add(x, -gap, n)
        carrier_b = carrier if flat else vectors.add(foot, -behind, n)
        carried, moving, pull = _find_relative_motion(position, rates, a, carrier, b, carrier_b)
        (v_a, spin_a), (v_b, spin_b) = vectors.read_rates(rates, a), vectors.read_rates(rates, b)
        if vectors.dot(e_b, e_b) > 0.0 and not plane:
            distance = radius_a[c] + gap
            motion = _find_relative_motion(position, rates, a, carrier, b, foot)
            normal, rate = _find_edge_terms(
                spin_a, spin_b, motion[1], motion[2], n, distance, e_a, e_b
            )
        elif flat:
            rate = vectors.cross(spin_b, n)
            normal = vectors.dot(n, pull) + 2 * vectors.dot(rate, moving)
        else:
            along = vectors.add(moving, -vectors.dot(moving, n), n)
            apart = radius_a[c] + behind + gap
            apart = apart if apart > 0.0 else 1.0
            rate = vectors.divide(along, apart)
            normal = vectors.dot(n, pull) + vectors.dot(along, along) / apart
        way = vectors.add(carried, -radius_a[c], rate)
        turn_a = vectors.cross(spin_a, vectors.subtract(way, v_a))
        pull = vectors.subtract(turn_a, vectors.cross(spin_b, vectors.subtract(way, v_b)))
        find_frame(normals[c], frame)
        found[c, 0] = normal
        for i in range(1, dim):
            found[c, i] = vectors.project(vectors.read(frame, i), pull)
    return found


@njit(cache=True)
def _find_edge_terms(
    spin_a: vectors.Vector, spin_b: vectors.Vector, velocity: vectors.Vector, pull: vectors.Vector,
    n: vectors.Vector, distance: float, e_a: vectors.Vector, e_b: vectors.Vector,
) -> tuple[float, vectors.Vector]:  # fmt: skip
    """Normal part [m/s^2] and ``n' = dn/dt`` [1/s] for a contact at an edge of b.

    The normal of two crossing edges is across both, that of a sphere on an edge across the edge:
    both turn with both bodies, and not as a face would.  With ``g + R = n . D``, D from a point of
    b's edge to a's carrier, and D along n now:

        d2g/dt2 = n . D'' + 2 n' . D' - |D| |n'|^2
        edge a across edge b:  n || c = e_a x e_b,  n' = (1 - n n^T) c' / (n . c)
        sphere on edge b:      e_b . n' = -n . e_b',  t . n' = t . D' / distance
    """
    turned_b = vectors.cross(spin_b, e_b)
    if vectors.dot(e_a, e_a) > 0.0:
        signed = vectors.project(n, vectors.cross(e_a, e_b))
        turned_a = vectors.cross(vectors.cross(spin_a, e_a), e_b)
        change = vectors.add(turned_a, 1.0, vectors.cross(e_a, turned_b))
        rate = vectors.add(change, -vectors.project(n, change), n)
        rate = vectors.divide(rate, signed if signed != 0.0 else 1.0)
    else:
        side, about = vectors.cross(e_b, n), -vectors.project(n, turned_b)
        rolling = vectors.project(side, velocity) / (distance if distance != 0.0 else 1.0)
        rate = vectors.add((about * e_b[0], about * e_b[1], about * e_b[2]), rolling, side)
    normal = vectors.project(n, pull) + 2 * vectors.project(rate, velocity)
    return normal - distance * vectors.project(rate, rate), rate


def find_contact_offset(contacts: Contacts, motion: Motion, free: Motion) -> Floats:
    """b of eqs 17 and 24, (nc * dim,): relative accelerations without contact forces [m/s^2].

    ``free`` has the accelerations that the loads alone would give as its velocities and spins.
    """
    loads = find_relative_velocity(contacts, free)
    return (loads + find_inertial_acceleration(contacts, motion)).ravel()
