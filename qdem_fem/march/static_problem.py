"""What a static answer has to satisfy: forces, constraints and fictitious masses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import NO_CONSTRAINTS, NO_LOADS, NO_PROBES, Assembly
from qdem_fem.kernel.cpu import Constraints
from qdem_fem.march.state import State

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FREE_SHARE = 1e-9
"""A direction that the normals of a node's rollers hold by less than this is free."""


class StaticProblem:
    """Forces, constraints and fictitious masses in the kernel's order, four numbers a node."""

    def __init__(self, simulation: State) -> None:
        own = simulation.assembly
        conditions, now = simulation.conditions, np.full(1, simulation.time)
        self.assembly = own
        if own.dtype != np.float64 or type(own) is not Assembly:  # single precision, or a GPU
            self.assembly = Assembly(
                simulation.bodies, simulation.master, simulation.strain, "float64",
                simulation.threads,
            )  # fmt: skip
        assembly, place = self.assembly, self.assembly.place
        loads, held = assembly.lists(conditions, gravity=False)
        row = conditions.table(now)[0]
        self.external = np.zeros(4 * assembly.n_nodes)
        np.add.at(self.external, loads.node_at, loads.weight * row[loads.series])
        gravity = simulation.gravity_at(now)
        if gravity is not None:
            # the masses of the simulation itself, with what mass scaling added
            weight = np.zeros((assembly.n_nodes, 4))
            weight[place, :3] = own.mass[:, None] * gravity[0]
            used = own.mass > 0
            self.external.reshape(-1, 4)[place[used]] += weight[place[used]]
        self.held_at, self.target = held.node_at, held.weight * row[held.series]
        self.turned_at, self.turned = project_rollers(held)
        self.state = assembly._state(np.ones(assembly.n_nodes))
        self.inverse_mass = find_inverse_stiffness(simulation, assembly)
        self.initial = simulation.assembly.field("displacement")
        self.steps = 0

    def start(self) -> Floats:
        """The present displacement with given components at their values."""
        u = np.zeros(4 * self.assembly.n_nodes)
        u.reshape(-1, 4)[self.assembly.place, :3] = self.initial
        u = self.project(u)
        u[self.held_at] = self.target
        return u

    def finish(self, simulation: State, u: Floats) -> None:
        """Leave the bodies of the simulation at rest at ``u``."""
        moved = u.reshape(-1, 4)[self.assembly.place, :3]
        simulation.assembly.set_field("displacement", moved)
        simulation.assembly.set_field("velocity", np.zeros_like(moved))
        simulation.pack_lists()[1].previous[:] = 0.0
        simulation.motion.behind = False

    def project(self, field: Floats) -> Floats:
        """``field`` without what is held: given components and normals of rollers."""
        field = field.copy()
        field[self.turned_at] = np.einsum("nij,nj->ni", self.turned, field[self.turned_at])
        field[self.held_at] = 0.0
        return field

    def forces(self, u: Floats) -> tuple[Floats, bool]:
        """``f_int + f_ext`` [N], reactions included, and whether all elements are sound.

        The kernel's own step of one second with masses of one kilogram, from rest.
        """
        self.steps += 1
        self.state.displacement[:] = u
        self.state.velocity[:] = 0.0
        _, bad = self.assembly.run_kernel(
            self.state, 1, 1.0, NO_LOADS, NO_CONSTRAINTS, NO_PROBES, np.ones((2, 1)), None,
            np.zeros(3),
        )  # fmt: skip
        self.state.forces[:] = 0.0
        return self.state.velocity + self.external, bad == 0 and bool(
            np.isfinite(self.state.velocity).all()
        )

    def force_scale(self, total: Floats, r: Floats) -> float:
        """What a residual is measured by [N]: the loads, or the reactions where they are larger."""
        reactions = np.linalg.norm(total - r)
        return float(max(np.linalg.norm(self.project(self.external)), reactions))


def project_rollers(held: Constraints) -> tuple[Integers, Floats]:
    """Components of the nodes with rollers, (k, 3), and what keeps a vector in their planes.

    (k, 3, 3): orthogonal projections onto what all rollers and held components of a node leave
    free; planes of two rollers need not be at right angles.
    """
    nodes, place = np.unique(held.roller_at, return_inverse=True)
    across = np.zeros((len(nodes), 3, 3))
    np.add.at(across, place, np.einsum("ri,rj->rij", held.roller_normal, held.roller_normal))
    for c in range(3):
        across[np.isin(nodes + c, held.node_at), c, c] += 1.0
    values, vectors = np.linalg.eigh(across)
    vectors = vectors * (values < FREE_SHARE)[:, None, :]
    return nodes[:, None] + np.arange(3), vectors @ vectors.transpose(0, 2, 1)


def find_inverse_stiffness(simulation: State, assembly: Assembly) -> Floats:
    """``1/M`` with fictitious masses M: a third of the trace of ``K_aa`` at every node [N/m].

    ``tr K_aa = sum_e V (lambda + 4 mu) |grad N_a|^2``.
    """
    shares = []
    for body in simulation.bodies:
        gradients, volumes = body.gradients
        every = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
        modulus = np.asarray(body.material.lame_first) + 4 * np.asarray(body.material.lame_second)
        shares.append((modulus * volumes)[:, None] * (every**2).sum(axis=2) / 3)
    at = assembly.place[assembly.elements]
    trace = np.bincount(at.ravel(), np.concatenate(shares).ravel(), assembly.n_nodes)
    inverse = np.divide(1.0, trace, out=np.zeros_like(trace), where=trace > 0)
    return np.repeat(inverse, 4)
