"""References of the work-precision report: spectral elements on a box, not on QDEM's meshes.

A quarter of the bar is computed, by symmetry in y and z.  Shape functions of order p on
Gauss-Lobatto points make the mass diagonal and every matrix a sum of Kronecker products of those
of one dimension.  Each question is answered twice, coarse and fine; how far the two are apart is
the uncertainty of the reference.

Source of the elements: Komatitsch and Tromp, Geophysical Journal International 139 (1999) 806.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

import numpy as np
import scipy.sparse as sparse
from numpy.polynomial import Legendre
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import eigsh

from validation.qdem_closed_forms import Beam
from validation.qdem_judge import factorised, lame

FloatArray = NDArray[np.float64]
MODES = 16
"""Bending modes with inertia; the others follow the load at once (static correction)."""


@dataclass(frozen=True)
class Line:
    """Assembled matrices of one direction, (n, n), without material."""

    points: FloatArray
    """[m], (n,)."""
    mass: sparse.csr_matrix
    """Integral of v u, diagonal by Gauss-Lobatto quadrature [m]."""
    slope: sparse.csr_matrix
    """Integral of v du/dx."""
    stiffness: sparse.csr_matrix
    """Integral of dv/dx du/dx [1/m]."""


@dataclass(frozen=True)
class Box:
    """A box's matrices on its free degrees of freedom."""

    stiffness: sparse.csr_matrix
    """K [N/m]."""
    mass: FloatArray
    """Diagonal of M [kg]."""
    load: FloatArray
    """Uniform traction of 1 Pa on the loaded end [N/Pa]."""
    probe: int
    """Degree of freedom that is recorded."""


def lobatto(order: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gauss-Lobatto points in [-1, 1], weights, and derivatives [i, j] of function j at point i."""
    legendre = Legendre.basis(order)
    points = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2 / (order * (order + 1) * legendre(points) ** 2)
    value = legendre(points)
    apart = points[:, None] - points + np.eye(order + 1)
    derivative = value[:, None] / value / apart * (1 - np.eye(order + 1))
    derivative -= np.diag(derivative.sum(axis=1))
    return points, weights, derivative


def line(breaks: FloatArray, order: int) -> Line:
    """One direction, cut at ``breaks`` [m] into elements of one order."""
    local, weights, derivative = lobatto(order)
    count = order * (len(breaks) - 1) + 1
    points = np.zeros(count)
    mass, slope, stiffness = (np.zeros((count, count)) for _ in range(3))
    for k, (left, right) in enumerate(pairwise(breaks)):
        part, half = slice(order * k, order * (k + 1) + 1), (right - left) / 2
        points[part] = left + half * (1 + local)
        mass[part, part] += half * np.diag(weights)
        slope[part, part] += weights[:, None] * derivative
        stiffness[part, part] += derivative.T @ (weights[:, None] * derivative) / half
    return Line(points, *(sparse.csr_matrix(m) for m in (mass, slope, stiffness)))


def quarter_box(beam: Beam, lines: tuple[Line, Line, Line], bending: bool) -> Box:
    """Quarter y, z >= 0 of a bar around the x-axis.

    ``bending``: clamped at x = 0, traction along z at the other end, odd in z, its middle
    recorded.  Otherwise free, traction along x at x = 0, even in z, the far end's middle recorded.
    """
    lam, mu = (float(value) for value in lame(beam.young, beam.poisson))

    def integral(test: int, trial: int) -> sparse.csr_matrix:
        """Of d v/d test times d u/d trial."""
        factors = []
        for axis, one in enumerate(lines):
            if axis == test == trial:
                factors.append(one.stiffness)
            elif axis == test:
                factors.append(one.slope.T)
            else:
                factors.append(one.slope if axis == trial else one.mass)
        return reduce(sparse.kron, factors)

    plain = mu * (integral(0, 0) + integral(1, 1) + integral(2, 2))
    blocks = [
        [
            lam * integral(i, j) + mu * integral(j, i) + (plain if i == j else 0 * plain)
            for j in range(3)
        ]
        for i in range(3)
    ]
    x, y, z = (one.points for one in lines)
    place = np.stack(np.meshgrid(x, y, z, indexing="ij")).reshape(3, -1)
    volume = reduce(sparse.kron, [one.mass for one in lines]).diagonal()
    free = np.ones((3, place.shape[1]), bool)
    free[1, place[1] == 0] = False
    if bending:
        free[:2, place[2] == 0] = False
        free[:, place[0] == 0] = False
    else:
        free[2, place[2] == 0] = False
    end = place[0] == (beam.length if bending else 0.0)
    area = np.kron(lines[1].mass.diagonal(), lines[2].mass.diagonal())
    load = np.zeros_like(place)
    direction = 2 if bending else 0
    load[direction, end] = area
    middle = np.flatnonzero((place[0] == x[-1]) & (place[1] == 0) & (place[2] == 0))[0]
    dof = np.flatnonzero(free.ravel())
    number = direction * place.shape[1] + middle
    stiffness = sparse.bmat(blocks).tocsr()[dof][:, dof]
    mass = beam.density * np.tile(volume, 3)[dof]
    return Box(stiffness, mass, load.ravel()[dof], int(np.searchsorted(dof, number)))


def bending_reference(
    beam: Beam, load: float, rise: float, times: FloatArray, order: int
) -> FloatArray:
    """Deflection of the end's middle [m] under ``load`` [N], raised by sin^2 in ``rise`` [s].

    Modal superposition, each mode exact in time; elements of ``order`` along the bar, of two
    less across, are graded towards the clamp.
    """
    graded = beam.height * np.array([0.0, 0.02, 0.08, 0.25, 0.6, 1.2])
    lines = (
        line(np.concatenate([graded, np.linspace(2.0 * beam.height, beam.length, 5)]), order),
        line(beam.width / 2 * np.array([0.0, 0.7, 0.93, 1.0]), order - 2),
        line(beam.height / 2 * np.array([0.0, 0.7, 0.93, 1.0]), order - 2),
    )
    box = quarter_box(beam, lines, bending=True)
    force = load / beam.area * box.load
    static = float(factorised(box.stiffness)(force)[box.probe])
    root = np.sqrt(box.mass)
    scaled = sparse.diags(1 / root) @ box.stiffness @ sparse.diags(1 / root)
    value, vector = eigsh(scaled.tocsc(), k=MODES, sigma=0.0)
    shape = vector / root[:, None]
    omega, share = np.sqrt(value), shape[box.probe] * (force @ shape)
    dynamic = np.sum(share * mode_response(times[:, None], omega, rise), axis=1)
    return dynamic + (static - np.sum(share / value)) * raised(times, rise)


def raised(times: FloatArray, rise: float) -> FloatArray:
    """sin^2 from 0 to 1 in ``rise`` [s], then 1."""
    return np.where(times < rise, np.sin(np.pi * times / rise / 2) ** 2, 1.0)


def mode_response(t: FloatArray, omega: FloatArray, rise: float) -> FloatArray:
    """q of q'' + omega^2 q = `raised`, from rest."""
    a = np.pi / rise

    def while_rising(t: FloatArray | float) -> FloatArray:
        q = (1 - np.cos(omega * t)) / omega**2
        return (q - (np.cos(a * t) - np.cos(omega * t)) / (omega**2 - a**2)) / 2

    speed = np.sin(omega * rise) / omega - omega * np.sin(omega * rise) / (omega**2 - a**2)
    speed = speed / 2
    after, since = while_rising(rise) - 1 / omega**2, np.maximum(t - rise, 0.0)
    later = 1 / omega**2 + after * np.cos(omega * since) + speed / omega * np.sin(omega * since)
    return np.where(t < rise, while_rising(t), later)


def pulse_reference(
    beam: Beam, pressure: float, length: float, times: FloatArray, order: int, count: int
) -> FloatArray:
    """Velocity of the far end's middle [m/s] after a sin^2 pulse of ``pressure`` [Pa] at the other.

    ``length`` [s] of the pulse; ``count`` elements along the bar.  Central differences, the leading
    error in time removed by a second run with half the step (Richardson).
    """
    lines = (
        line(np.linspace(0, beam.length, count + 1), order),
        line(np.linspace(0, beam.width / 2, 3), order),
        line(np.linspace(0, beam.height / 2, 3), order),
    )
    box = quarter_box(beam, lines, bending=False)
    rate = sparse.diags(-1 / box.mass) @ box.stiffness
    push = pressure * box.load / box.mass
    highest = float(eigsh(
        sparse.diags(box.mass**-0.5) @ box.stiffness @ sparse.diags(box.mass**-0.5),
        k=1, tol=1e-2, return_eigenvectors=False)[0])  # fmt: skip
    steps = int(np.ceil(times[-1] / (0.9 * 2 / np.sqrt(highest))))
    once, twice = (_march(rate, push, box.probe, length, times, steps * many) for many in (1, 2))
    return (4 * twice - once) / 3


def _march(
    rate: sparse.csr_matrix, push: FloatArray, probe: int, length: float, times: FloatArray,
    steps: int,
) -> FloatArray:  # fmt: skip
    step = times[-1] / steps
    u, v = np.zeros((2, len(push)))
    recorded = np.zeros(steps + 1)
    loaded = np.flatnonzero(push)
    for k in range(steps):
        acceleration = rate @ u
        if k * step < length:
            acceleration[loaded] += push[loaded] * np.sin(np.pi * k * step / length) ** 2
        v += (step if k else step / 2) * acceleration
        u += step * v
        recorded[k + 1] = u[probe]
    spline = CubicSpline(np.linspace(0, times[-1], steps + 1), recorded)
    return np.asarray(spline(times, 1))
