"""How far linear tetrahedra are from the body that they stand for, estimated from one answer alone.

Their stresses jump from element to element; means at the nodes, by volume, jump less.  Of the
energy W of an answer, and stresses s of elements and s* of nodes (energies in s*, W* by nodes):

    a = 1 - W*/W          b = |s* - s|^2 / W          shortfall = (a + b/(1 + b))/2

Zienkiewicz and Zhu's estimate is b.  Beside quadratic tetrahedra on eleven bodies (errors of 2 to
77 %) the mean of the two was .51 to 1.21 of the truth on ten, and a third of it on a stone of
random tetrahedra.  Not for an error below 1e-3, nor for what a support or a load at one point
does, which has no limit.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from qdem_fem.bodies.deformable import Body
from qdem_fem.bodies.rigid_mass import make_cross_matrix
from qdem_fem.element import MEASURES, Strain, apply_hooke, find_displacement_gradient
from qdem_fem.files import Floats, Integers

LOCKING = 0.49
"""Poisson's ratio above which linear tetrahedra lock, and the estimate was seen to fail [-]."""
MATERIALS = 10
"""Different materials of a body, most, of which each has means of its own: more are a gradient."""


@dataclass(frozen=True)
class Discretisation:
    """Estimated errors of the mesh; none of them is the solver's."""

    displacement: float
    """Shortfall of the displacement under the load, over the true one [-]; under prescribed motion
    the excess of its reaction, over the one found."""
    frequency: float  # excess of the frequency of motion of this shape, over the one found [-]

    @property
    def stress(self) -> float:
        """Of the stress in the energy norm, over that of the true stress [-]: by orthogonality
        ``|s - s_h|^2 = |s|^2 - |s_h|^2``, which under loads is the shortfall of the work."""
        return float(np.sqrt(self.displacement))


def estimate_discretisation(
    bodies: Iterable[tuple[Body, Floats, bool]], strain: Strain
) -> Discretisation | None:
    """`Discretisation` of deformable bodies, each with its displacement (n, 3) [m] and whether
    nothing holds it; None: of bodies without strain, of quadratic elements or of linear ones that
    lock nothing can be said."""
    soft = [each for each in bodies if not each[0].rigid]
    if any(body.ELEMENT != "linear" or is_locking(body) for body, _, _ in soft):
        return None
    parts = [_integrate_means(*each, strain) for each in soft]
    if not parts:
        return None
    energy, of_nodes, apart, lumped, consistent = np.sum(parts, axis=0)
    if not energy > 0:
        return None
    a, b = 1 - of_nodes / energy, apart / energy
    shortfall = max(0.0, (a + b / (1 + b)) / 2)
    ratio = (1 - shortfall) * lumped / consistent if consistent > 0 else 1.0
    return Discretisation(float(shortfall), float(1 - np.sqrt(ratio)))


def is_locking(body: Body) -> bool:
    """Whether a body is so near to incompressible that its elements, linear tetrahedra, lock."""
    soft = body.ELEMENT == "linear" and not body.rigid
    return soft and bool(np.max(body.material.poisson) > LOCKING)


def estimate_bending(body: Body) -> float:
    """Shortfall [-] of a body's deflection if it bends, from its mesh alone.

    Pure bending about the body's principal axes, at the nodes, stores more in linear tetrahedra
    than in the solid: what is more is the error that such bending has at least.  The worst of both
    planes in which the long axis bends.
    """
    mass = body.gradients[1]
    x = body.nodes - mass @ body.nodes[body.elements].mean(axis=1) / mass.sum()
    axes = np.linalg.eigh(_integrate_squares(x, body.elements, mass))[1][:, ::-1]
    x = x @ axes  # the longest extent first
    second = np.diag(_integrate_squares(x, body.elements, mass * body.material.young))
    nu, worst = float(np.mean(body.material.poisson)), 0.0
    for up, side in ((1, 2), (2, 1)):
        bent = np.zeros_like(x)
        bent[:, 0] = x[:, 0] * x[:, up]
        bent[:, up] = -(x[:, 0] ** 2 + nu * (x[:, up] ** 2 - x[:, side] ** 2)) / 2
        bent[:, side] = -nu * x[:, up] * x[:, side]
        stored = 2 * float(body.elastic_energy(bent @ axes.T, "small").sum())
        worst = max(worst, 1 - float(second[up]) / stored)
    return worst


def _integrate_squares(x: Floats, elements: Integers, weight: Floats) -> Floats:
    """``sum of weight/V int x x^T dV`` of linear tetrahedra, (3, 3)."""
    corners = x[elements]
    total = corners.sum(axis=1)
    squares = np.einsum("m,mai,maj->ij", weight, corners, corners)
    return (squares + np.einsum("m,mi,mj->ij", weight, total, total)) / 20


def _integrate_means(body: Body, moved: Floats, free: bool, strain: Strain) -> Floats:
    """W, W* and ``|s* - s|^2`` [2 J], and the square of the motion by masses at nodes and by
    those of the solid [kg m^2], (5,)."""
    gradients, volume = body.gradients
    lame, mu = (np.asarray(one) for one in (body.material.lame_first, body.material.lame_second))
    measure_strain = MEASURES["svk" if MEASURES[strain].OBJECTIVE else "small"].compute_strain
    gradient = find_displacement_gradient(gradients, body.elements, moved)
    rows, columns = np.triu_indices(3)
    six = apply_hooke(measure_strain(gradient), lame, mu)[:, rows, columns]
    place, nodes = _number_nodes(body)
    quarter = np.repeat(volume / 4, 4)
    weight = np.bincount(place.ravel(), quarter, nodes)

    def average(values: Floats) -> Floats:
        return np.bincount(place.ravel(), quarter * np.repeat(values, 4), nodes) / weight

    def measure(six: Floats, lame: Floats, mu: Floats) -> Floats:
        """Twice the energy density of a stress [J/m^3]."""
        square = six**2 @ np.where(rows == columns, 1.0, 2.0)
        trace = six[..., rows == columns].sum(axis=-1)
        return (square - lame / (3 * lame + 2 * mu) * trace**2) / (2 * mu)

    at_nodes = np.stack([average(column) for column in six.T], axis=1)
    apart = at_nodes[place] - six[:, None]
    held = measure(apart, lame[:, None], mu[:, None]).sum(axis=1)
    whole = measure(apart.sum(axis=1), lame, mu)
    if free:  # what shifts and turns as a whole is no part of a mode
        turn = make_cross_matrix(body.nodes - body.nodes.mean(axis=0)).reshape(-1, 3)
        rigid = np.hstack([np.tile(np.eye(3), (len(moved), 1)), turn])
        whole_motion = rigid @ np.linalg.lstsq(rigid, moved.ravel(), rcond=None)[0]
        moved = moved - whole_motion.reshape(-1, 3)
    u = moved[body.elements]
    mass = body.material.density * volume / 20
    square = (u**2).sum(axis=(1, 2))
    return np.array([
        volume @ measure(six, lame, mu),
        weight @ measure(at_nodes, average(lame), average(mu)),
        volume @ (whole + held) / 20,
        5 * mass @ square,
        mass @ ((u.sum(axis=1) ** 2).sum(axis=1) + square),
    ])  # fmt: skip


def _number_nodes(body: Body) -> tuple[Integers, int]:
    """Numbers of the elements' nodes, (m, 4), one for each material that meets there; how many."""
    moduli = np.column_stack([body.material.young, body.material.poisson])
    kinds, kind = np.unique(moduli, axis=0, return_inverse=True)
    if len(kinds) > MATERIALS:
        kind = np.zeros(len(moduli), int)
    numbers = body.elements + len(body.nodes) * kind.reshape(-1, 1)
    used, place = np.unique(numbers, return_inverse=True)
    return place.reshape(numbers.shape), len(used)
