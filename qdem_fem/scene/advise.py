"""Which bodies of a scene may be rigid, and what error that costs: an estimate with its reasons.

A body that touches others through springs of stiffness k is, to them, a spring more in the row.
A force f at one of its surface vertices, balanced by the inertia of the body as a whole, moves the
vertex by ``C f`` more than the rigid body would (inertia relief, `find_compliance`): a contact then
has the compliance ``1/k + C``, and the rigid body leaves

    e = k C/(1 + k C)

of it out.  C goes as 1/E, and so does e for a stiff body.  Approach and force of a resting contact
change by the share e; the duration of an impact, ``pi sqrt(m (1/k + C))``, by e/2.

That holds while the body follows its loads as if at rest.  Its lowest free frequency f1, which is
about one over the double transit time ``2 L/c``, answers a load of frequency f with
``1/(1 - (f/f1)^2)`` of its static share, a load that comes at once with twice.  A load whose
frequency is above f1/2 is too fast for any rigid body.

Errors of two bodies in one contact add: `predict_error`.  The estimate says nothing of where many
contacts slip or open, which may be sensitive to any change, nor of the vibration within a body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import Body, NodalLoad, make_cross_matrix
from qdem_fem.files import ConditionError, Series
from qdem_fem.mesh import lump_mass
from qdem_fem.rigid import find_hold

if TYPE_CHECKING:
    from qdem_fem.march import Simulation

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

VERTICES_TRIED = 12
"""Surface vertices at which a compliance is computed: those farthest from the centre, which are the
softest, and as many evenly between."""
FAST = 0.5
"""Frequency of a load over the body's lowest at which no quasi-static estimate is given."""


@dataclass(frozen=True)
class BodyCompliance:
    """How far a body is from rigid."""

    vertex: float
    """Greatest compliance of a surface vertex under inertia relief, C [m/N]."""
    frequency: float
    """Lowest free frequency of its mesh, f1 [Hz]."""
    transit: float
    """Time of a pressure wave along its longest side, L/c [s]."""


@dataclass(frozen=True)
class Advice:
    """What is said of one body."""

    body: str
    rigid: bool
    """Whether it may be rigid within the tolerance."""
    error: float
    """Predicted share of the compliance of a contact that a rigid body leaves out, e [-]."""
    why: str
    contact: float
    """Stiffness of one contact, k [N/m]; 0 without contact."""
    own: BodyCompliance
    load_frequency: float
    """Of the fastest load on it [Hz]; 0 for a constant one."""
    inertia: float
    """Excess of the mesh's lumped inertia over the solid's, greatest [-]: an error of the
    deformable body, which ``rigid = true`` has not, and ``rigid = "lumped"`` has."""
    elements: int


def assemble_stiffness(body: Body) -> Any:
    """K of linear elasticity [N/m], sparse (3 v, 3 v), of the v nodes of elements, in order."""
    import skfem
    from skfem.models.elasticity import linear_elasticity

    used, elements = np.unique(body.elements, return_inverse=True)
    grid = skfem.MeshTet(body.nodes[used].T.copy(), elements.reshape(-1, 4).T.copy())
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTetP1()), intorder=0)
    first, second = (
        np.asarray(m)[:, None] for m in (body.material.lame_first, body.material.lame_second)
    )
    at = basis.nodal_dofs.T.ravel()
    return linear_elasticity(first, second).assemble(basis).tocsc()[at][:, at]


def find_compliance(body: Body) -> BodyCompliance:
    """Compliance, lowest frequency and transit time of a free body.

    With rigid motions R and lumped masses M, ``P = 1 - M R (R^T M R)^-1 R^T`` takes the resultant
    out of a force; ``C = P^T K^+ P``, with K held at three nodes, which a balanced force does not
    load.  Not for bodies in several parts, or of a million nodes: K is factorised.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    used = np.unique(body.elements)
    stiffness = assemble_stiffness(body)
    arm = body.nodes[used] - body.rigid_mass.centre
    density, volume = np.asarray(body.material.density), body.gradients[1]
    weight = np.repeat(lump_mass(body.elements, volume, density, len(body.nodes))[used], 3)
    motion = np.concatenate([np.tile(np.eye(3), (len(arm), 1, 1)), -make_cross_matrix(arm)], axis=2)
    motion = motion.reshape(-1, 6)
    resultant = np.linalg.inv(motion.T @ (weight[:, None] * motion))
    kept = np.setdiff1d(np.arange(len(weight)), _held_components(arm))
    factor = splu(stiffness[kept][:, kept])

    def answer(force: Floats) -> Floats:
        balanced = force - weight * (motion @ (resultant @ (motion.T @ force)))
        moved = np.zeros(len(weight))
        moved[kept] = factor.solve(balanced[kept])
        return moved - motion @ (resultant @ (motion.T @ (weight * moved)))

    root = np.sqrt(weight)
    operator = LinearOperator((len(weight),) * 2, matvec=lambda x: root * answer(root * x.ravel()))
    start = np.random.default_rng(0).normal(size=len(weight))
    slowest = eigsh(operator, k=1, which="LA", tol=1e-4, v0=start, return_eigenvectors=False)[0]
    softest = 0.0
    for vertex in _vertices_sampled(arm, np.searchsorted(used, np.unique(body.surface))):
        unit = np.zeros((3, len(weight)))
        unit[np.arange(3), 3 * vertex + np.arange(3)] = 1.0
        own = np.array([answer(force)[3 * vertex : 3 * vertex + 3] for force in unit])
        softest = max(softest, float(np.linalg.eigvalsh((own + own.T) / 2)[-1]))
    speed = float(np.max(body.material.wave_speed))
    length = float(np.ptp(body.nodes[used], axis=0).max())
    return BodyCompliance(softest, 1 / sqrt(slowest) / 2 / np.pi, length / speed)


def _held_components(arm: Floats) -> Integers:
    """Six components of three nodes far apart that hold a body and no more."""
    first = int(np.argmax((arm**2).sum(axis=1)))
    second = int(np.argmax(((arm - arm[first]) ** 2).sum(axis=1)))
    along = (arm[second] - arm[first]) / np.linalg.norm(arm[second] - arm[first])
    aside = np.cross(arm - arm[first], along)
    third = int(np.argmax((aside**2).sum(axis=1)))
    axis = int(np.argmax(abs(along)))
    across = [c for c in range(3) if c != axis]
    normal = across[int(np.argmax(abs(aside[third][across])))]
    return np.array([*(3 * first + np.arange(3)), *(3 * second + c for c in across),
                     3 * third + normal])  # fmt: skip


def _vertices_sampled(arm: Floats, vertices: Integers) -> Integers:
    """Some vertices of a surface, the farthest among them."""
    order = vertices[np.argsort(-(arm[vertices] ** 2).sum(axis=1))]
    evenly = order[np.linspace(0, len(order) - 1, VERTICES_TRIED).astype(int)]
    return np.unique(np.concatenate([order[:VERTICES_TRIED], evenly]))


def find_contact_stiffness(run: Simulation) -> list[float]:
    """Stiffness k of the stiffest contact of one vertex of each body [N/m]; 0 without contact.

    To a wall it is twice that of a pair, as a mirror makes it.
    """
    if run.contacts is None:
        return [0.0] * len(run.bodies)
    factor = 2.0 if len(run.contacts.asked.planes) else 1.0
    starts = np.searchsorted(run.contacts.nodes, run.first_node[:-1])
    return [float(k) for k in factor * np.maximum.reduceat(run.contacts.one, starts)]


def find_load_frequency(loads: Sequence[NodalLoad]) -> float:
    """Frequency of the fastest load [Hz]: greatest slope over 2 pi times the greatest value.

    Infinite for a load that a function gives, which is not looked into.  A constant has none.
    """
    fastest = 0.0
    for load in loads:
        varying = load.driver.varying
        if varying is None:
            continue
        if not isinstance(varying, Series):
            return inf
        values = np.asarray(varying.values).reshape(len(varying.times), -1)
        slope = np.linalg.norm(np.diff(values, axis=0), axis=1) / np.diff(varying.times)
        greatest = np.linalg.norm(values, axis=1).max()
        if greatest > 0 and len(slope):
            fastest = max(fastest, float(slope.max() / greatest) / 2 / np.pi)
    return fastest


def advise(run: Simulation, tolerance: float = 0.01) -> list[Advice]:
    """What may be rigid in a simulation of deformable bodies; ``tolerance`` on e [-]."""
    stiffness = find_contact_stiffness(run)
    _, held = run.pack_lists()
    node = run.assembly.packed.node_order[held.node_at // 4]
    found: list[Advice] = []
    for number, body in enumerate(run.bodies):
        start, stop = run.first_node[number : number + 2]
        own = find_compliance(body)
        mine = (node >= start) & (node < stop)
        loads = [c for c in run.conditions.loads if ((c.nodes >= start) & (c.nodes < stop)).any()]
        frequency = find_load_frequency(loads)
        sudden = 2.0 if any(load.driver.varying is None for load in loads) else 1.0
        share = stiffness[number] * own.vertex
        slow = 1 - min((frequency / own.frequency) ** 2, 1.0)
        error = min(1.0, share / (1 + share) * sudden / slow) if slow > 0 else 1.0
        why = _why(body, share, frequency, own, error, tolerance)
        if not why and mine.any():
            arm = body.nodes[node[mine] - start] - body.rigid_mass.centre
            try:
                component, series, weight = (
                    values[mine] for values in (held.node_at % 4, held.series, held.weight)
                )
                find_hold(body.rigid_mass, arm, component, series, weight, body.name)
            except ConditionError as wrong:
                why = wrong.what
        if any(((c.nodes >= start) & (c.nodes < stop)).any() for c in run.conditions.rollers) or (
            (run.master != np.arange(len(run.master)))[start:stop].any()
        ):
            why = "rollers or periodic faces hold it"
        lumped = Body(body.mesh, body.material, rigid="lumped").rigid_mass.inertia
        found.append(
            Advice(
                body.name, not why, error, why or f"within {tolerance:g}", stiffness[number], own,
                frequency, float((lumped / body.rigid_mass.inertia).max() - 1), len(body.elements),
            )
        )  # fmt: skip
    return found


def _why(
    body: Body, share: float, frequency: float, own: BodyCompliance, error: float, tolerance: float
) -> str:
    """Why a body should stay deformable; nothing where it need not."""
    if body.rigid:
        return "it is rigid already"
    if share == 0:
        return "it touches nothing: its own deformation is all there is to compute"
    if frequency > FAST * own.frequency:
        return "a load is as fast as its first mode"
    if error > tolerance:
        return f"it makes {error:.2g} of the compliance of its contacts"
    return ""


def predict_error(advice: Sequence[Advice]) -> float:
    """Predicted error where all that may be rigid are [-]: the two greatest meet in a contact."""
    errors = sorted((one.error for one in advice if one.rigid), reverse=True)
    return min(1.0, sum(errors[:2]))
