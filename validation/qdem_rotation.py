"""Large rotations of QDEM, and the patch test: what must hold to rounding.

A free body spins a hundred turns.  Spinning stretches it by rho omega^2 R^2/E, so it starts from
the shape that is at rest in the turning frame, found by Newton's iterations with the judge's K;
its strain in that frame then stays as it is.  Forces are those between pairs of corners of
elements with symmetric stress, so angular momentum about the centre is conserved to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh import TetMesh
from qdem_fem.mesh_generation import box_mesh, jitter
from qdem_fem.reference_forces import (
    Strain,
    displacement_gradient,
    stress_cauchy,
    stress_finger,
)
from validation import qdem_judge
from validation.case import Check
from validation.qdem_judge import FloatArray
from validation.qdem_problem import below, between, reported
from validation.qdem_record import Outcome

SOFT = Material(young=1e6, poisson=0.25, density=1000.0)
RIM_SHARE = 1e-3
"""Speed of the rim over that of waves: strains of the spin are of the order of its square."""
NEWTON = 6


@dataclass(frozen=True)
class Spin:
    """What changed over a spin."""

    strain: float
    """Strain of the spinning shape, greatest component of (F^T F - I)/2 [-]."""
    strain_change: float
    """Greatest change of it at any sample [-]."""
    momentum_change: float
    """Greatest relative change of the angular momentum."""
    turns: float
    """Turns made, by the angle of the body."""
    steps: int


def block_on_its_axes() -> tuple[TetMesh, FloatArray]:
    """The block with its centre at the origin and its principal axes along x, y, z; masses [kg].

    About any other axis it would tumble.
    """
    block = jitter(box_mesh((1.2, 1.0, 0.6), (2, 2, 2)), 0.2, seed=3)
    mass = qdem_judge.lumped_mass(block.nodes, block.elements, SOFT.density)
    place = block.nodes - mass @ block.nodes / mass.sum()
    _, axes = np.linalg.eigh(place.T @ (mass[:, None] * place))  # largest spread last
    axes = axes[:, ::-1]
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return TetMesh(place @ axes, block.elements), mass


def lagrange_strain(body: Body) -> FloatArray:
    """(F^T F - I)/2 of the elements [-], (m, 3, 3): does not see rotations."""
    gradient = displacement_gradient(body.gradients[0], body.elements, body.displacement)
    turned = np.swapaxes(gradient, -1, -2)
    return np.asarray((gradient + turned + turned @ gradient) / 2)


def angular_momentum(body: Body, mass: FloatArray) -> FloatArray:
    """sum m x cross v [kg m^2/s], (3,)."""
    place = body.nodes + body.displacement
    return np.asarray((mass[:, None] * np.cross(place, body.velocity)).sum(axis=0))


def shape_at_rest(mesh: TetMesh, mass: FloatArray, omega: float, strain: Strain) -> FloatArray:
    """Displacement [m], (n, 3), in balance with the forces of a spin ``omega`` about z [rad/s]."""
    stiffness = qdem_judge.stiffness(mesh.nodes, mesh.elements, SOFT.young, SOFT.poisson)
    outward = np.diag([1.0, 1.0, 0.0]) * omega**2
    # a free body: the pseudo-inverse leaves rigid motions out
    inverse = np.linalg.pinv(stiffness.toarray(), rcond=1e-10, hermitian=True)
    body = Body(mesh, SOFT)
    Simulation([body], strain=strain, threads=1)
    u = np.zeros_like(mesh.nodes)
    for _ in range(NEWTON):
        body.displacement = u
        force = internal_forces(body) + mass[:, None] * (mesh.nodes + u) @ outward
        u = u + (inverse @ force.ravel()).reshape(-1, 3)
    return u


def internal_forces(body: Body) -> FloatArray:
    """Forces of the stress on the nodes [N], (n, 3), from T cof F (eqs. 9 and 10)."""
    gradients, volumes = body.gradients
    gradient = displacement_gradient(gradients, body.elements, body.displacement)
    nominal = stress_finger(gradient, body.material.lame_first, body.material.lame_second)
    pulls = -volumes[:, None, None] * gradients @ np.swapaxes(nominal, -1, -2)
    total = np.zeros_like(body.nodes)
    np.add.at(total, body.elements[:, 1:], pulls)
    np.add.at(total, body.elements[:, 0], -pulls.sum(axis=1))
    return total


def spin(turns: float, rim_share: float = RIM_SHARE, samples: int = 50) -> Spin:
    """A free irregular block of 48 elements spins about z, its axis of greatest inertia."""
    mesh, mass = block_on_its_axes()
    omega = rim_share * float(SOFT.wave_speed) / np.sqrt(0.5)
    body = Body(mesh, SOFT)
    run = Simulation([body], threads=1)
    body.displacement = shape_at_rest(mesh, mass, omega, "finger")
    place = mesh.nodes + body.displacement
    # what keeps a node on its circle at this step is sin(omega dt)/dt, not omega
    rate = np.sin(omega * run.step) / run.step
    body.velocity = rate * np.cross([0.0, 0.0, 1.0], place)
    strain, momentum = lagrange_strain(body), angular_momentum(body, mass)
    stride = round(2 * np.pi * turns / omega / run.step / samples)
    strain_change = momentum_change = 0.0
    for _ in range(samples):
        run.advance(stride * run.step)
        strain_change = max(strain_change, float(np.abs(lagrange_strain(body) - strain).max()))
        change = angular_momentum(body, mass) - momentum
        momentum_change = max(
            momentum_change, float(np.linalg.norm(change) / np.linalg.norm(momentum))
        )
    now = mesh.nodes + body.displacement
    angle = np.angle(((now[:, 0] + 1j * now[:, 1]) * (place[:, 0] - 1j * place[:, 1])).sum())
    whole = omega * run.time / (2 * np.pi)
    made = angle / (2 * np.pi) + round(whole - angle / (2 * np.pi))
    return Spin(float(np.abs(strain).max()), strain_change, momentum_change, made, run.steps_done)


def spin_checks(turns: float) -> list[Check]:
    """Strain as at the start, momentum kept, over so many turns."""
    found = spin(turns)
    name = f"spin of {turns:g} turns"
    return [
        between(f"{name}: turns made", found.turns, turns - 0.01, turns + 0.01),
        reported(f"{name}: strain of the spinning shape", found.strain),
        below(f"{name}: change of strain", found.strain_change, 1e-11),
        below(f"{name}: change of angular momentum", found.momentum_change, 1e-10),
        reported(f"{name}: steps", found.steps),
    ]


# --- patch test -------------------------------------------------------------------------------


def patch(seed: int) -> tuple[float, float]:
    """A uniform gradient with rotation on an irregular mesh: errors of stress and of balance.

    Stress: to T = lam tr(eps) I + 2 mu eps of the gradient itself, relative.  Balance: the
    greatest acceleration of an inner node over that of a surface node; one step from rest.
    """
    generator = np.random.default_rng(seed)
    mesh = jitter(box_mesh((1.0, 0.8, 0.7), (4, 3, 3)), 0.24, seed)
    body = Body(mesh, SOFT)
    # so short a step that a hardly changes within it, and v = a dt
    run = Simulation([body], threads=1, safety=1e-7)
    gradient = 0.1 * generator.standard_normal((3, 3))
    body.displacement = mesh.nodes @ gradient.T + generator.standard_normal(3)
    nominal = stress_finger(gradient[None], SOFT.lame_first, SOFT.lame_second)
    expected = stress_cauchy(gradient[None], nominal, "finger")
    of_stress = float(np.abs(body.stress() - expected).max() / np.abs(expected).max())
    run.advance(run.step)
    acceleration = np.linalg.norm(body.velocity, axis=1)
    surface = np.zeros(len(mesh.nodes), bool)
    surface[body.surface.ravel()] = True
    return of_stress, float(acceleration[~surface].max() / acceleration[surface].max())


def patch_checks(meshes: int) -> list[Check]:
    """The worst of several random meshes and gradients of 10 %."""
    of_stress, of_balance = np.max([patch(seed) for seed in range(meshes)], axis=0)
    return [
        below(f"patch test, {meshes} random meshes: stress", of_stress, 1e-12),
        below(f"patch test, {meshes} random meshes: balance of inner nodes", of_balance, 1e-10),
    ]


def quick_checks() -> list[Check]:
    """Ten turns; 5 meshes."""
    return [*spin_checks(10), *patch_checks(5)]


def full() -> Outcome:
    """A hundred turns; 50 meshes."""
    return Outcome([*spin_checks(100), *patch_checks(50)])
