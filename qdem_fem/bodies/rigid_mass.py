"""Mass, centre and inertia of a rigid body from its tetrahedra, and which motions are rigid."""

from dataclasses import dataclass

import numpy as np

from qdem_fem.files import ConditionError, Floats, Integers

RIGID_TOLERANCE = 1e-9
"""Greatest departure from a rigid motion, over its size, of a field that a user gives."""


@dataclass(frozen=True)
class RigidMass:
    """What a rigid body is to Newton and Euler, in the reference configuration."""

    mass: float  # M [kg]
    centre: Floats  # c (3,) [m]
    inertia: Floats  # principal moments about the centre, growing, (3,) [kg m^2]
    axes: Floats  # (3, 3): row i is the unit vector of moment i; right-handed

    @property
    def tensor(self) -> Floats:
        """Inertia about the centre, (3, 3) [kg m^2]."""
        return np.asarray((self.axes.T * self.inertia) @ self.axes)


def compute_rigid_mass(
    nodes: Floats, elements: Integers, element_mass: Floats, *, lumped: bool = False
) -> RigidMass:
    """Mass properties of tetrahedra of uniform density each.

    ``nodes`` (n, 3) [m], ``elements`` (m, 4), ``element_mass`` (m,) [kg].  With s the sum of an
    element's corners, exactly ``integral of x x^T dm = m_e/20 (sum_a x_a x_a^T + s s^T)``.

    ``lumped``: of quarter masses at the corners, ``m_e/4 sum_a x_a x_a^T``, as a deformable body
    has them.  Their inertia is the greater one, by the second moment that each element has about
    its own corners (of second order in the mesh size): it is what a deformable body *of this
    mesh* tends to when its stiffness grows, and not what the solid has.
    """
    corners = nodes[elements]
    mass = float(element_mass.sum())
    centre = element_mass @ corners.mean(axis=1) / mass
    arm = corners - centre
    squares = np.einsum("m,mai,maj->ij", element_mass, arm, arm)
    total = arm.sum(axis=1)
    second = (
        squares / 4
        if lumped
        else (squares + np.einsum("m,mi,mj->ij", element_mass, total, total)) / 20
    )
    moments, axes = np.linalg.eigh(np.trace(second) * np.eye(3) - second)
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1
    return RigidMass(mass, centre, moments, np.ascontiguousarray(axes.T))


def make_cross_matrix(vector: Floats) -> Floats:
    """``[a]`` with ``[a] b = a x b``, (..., 3, 3)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return rows.reshape(*vector.shape[:-1], 3, 3)


def make_stiffness_six(body: Integers, arm: Floats, stiffness: Floats, count: int) -> Floats:
    """``K = sum k J^T J`` of springs on rigid bodies, ``J = (1, -[r])``, (count, 6, 6).

    ``body`` (v,), ``arm`` (v, 3) [m]: of each spring, from its body's centre; ``stiffness`` (v,)
    [N/m]: in all directions.
    """

    def sum_by_body(each: Floats) -> Floats:
        return np.asarray(np.bincount(body, each, count), dtype=float)

    total, pulls = sum_by_body(stiffness), stiffness * arm.T
    first = np.stack([sum_by_body(pull) for pull in pulls], axis=-1)
    second = np.empty((count, 3, 3))
    for i, j in np.ndindex(3, 3):  # bincount is ten times as fast as np.add.at on rows
        second[:, i, j] = sum_by_body(pulls[i] * arm[:, j])
    spring = np.zeros((count, 6, 6))
    spring[:, :3, :3] = total[:, None, None] * np.eye(3)
    spring[:, 3:, :3] = make_cross_matrix(first)
    spring[:, :3, 3:] = -make_cross_matrix(first)
    spring[:, 3:, 3:] = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return spring


def make_turn_matrix(turn: Floats) -> Floats:
    """``R - 1`` of unit quaternions (..., 4), scalar first, without cancellation, (..., 3, 3)."""
    across = make_cross_matrix(turn[..., 1:])
    return np.asarray(2 * (turn[..., :1, None] * across + across @ across))


def fit_rigid_displacement(
    nodes: Floats, centre: Floats, displacement: Floats, where: str
) -> tuple[Floats, Floats]:
    """Shift of the centre (3,) [m] and unit quaternion (4,) of a displacement (n, 3) [m].

    By the polar decomposition of ``sum x (X - X_mean)^T``.  Raises `ConditionError` for a
    displacement that strains the body.
    """
    from scipy.spatial.transform import Rotation

    if not displacement.any():
        return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    arm = nodes - nodes.mean(axis=0)
    mean = displacement.mean(axis=0)
    left, _, right = np.linalg.svd((arm + displacement - mean).T @ arm)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    x, y, z, w = Rotation.from_matrix(left @ right).as_quat(canonical=True)
    turn = np.array([w, x, y, z])
    shift = mean + make_turn_matrix(turn) @ (centre - nodes.mean(axis=0))
    rigid = shift + (nodes - centre) @ make_turn_matrix(turn).T
    size = max(float(np.ptp(nodes, axis=0).max()), float(abs(displacement).max()))
    _check_rigid(displacement - rigid, size, f"{where}, displacement")
    return shift, turn


def fit_rigid_velocity(arm: Floats, velocity: Floats, where: str) -> tuple[Floats, Floats]:
    """Velocity of the centre [m/s] and angular velocity [1/s], (3,) each, of a field (n, 3).

    ``arm`` (n, 3) [m]: from the centre to the nodes as they are now; least squares.  Raises
    `ConditionError` for a velocity that strains the body.
    """
    if not velocity.any():
        return np.zeros(3), np.zeros(3)
    size = float(abs(arm).max())
    motion = np.concatenate(
        [np.tile(np.eye(3), (len(arm), 1, 1)), -make_cross_matrix(arm / size)], 2
    )
    answer = np.linalg.lstsq(motion.reshape(-1, 6), velocity.ravel(), rcond=None)[0]
    _check_rigid(velocity - motion @ answer, float(abs(velocity).max()), f"{where}, velocity")
    return answer[:3], answer[3:] / size


def _check_rigid(rest: Floats, size: float, where: str) -> None:
    worst = float(abs(rest).max())
    if worst > RIGID_TOLERANCE * size:
        node = int(np.unravel_index(np.argmax(abs(rest)), rest.shape)[0])
        raise ConditionError(
            f"a rigid body can not move so: node {node} departs by {worst / size:.2g} of the "
            "motion from a shift and a turn",
            where=where,
            remedy="give v + w x r (r from where the nodes are now), or leave the body deformable",
        )
