"""The contacts of a simulation: their arrays, their place in a march, their energies."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numpy.typing import NDArray

from qdem_fem import kernel
from qdem_fem.contact_kernel import TOO_DEEP, Contact, Planes, Spheres, advance_one
from qdem_fem.contact_search import Pairs, pairs_of, pairs_renew
from qdem_fem.contact_spheres import (
    SKIN,
    SphereContact,
    pair_stiffness,
    tangential_stiffness,
)
from qdem_fem.contact_step import allowed_bound, network_bound, step_with_contact
from qdem_fem.contact_window import contact_window
from qdem_fem.errors import ContactTooDeep, StepWarning

if TYPE_CHECKING:
    from qdem_fem.critical_step import CriticalStep
    from qdem_fem.simulation import Simulation

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

PAIR_ARRAYS = ("first", "second", "touching", "spring", "pull")
CONTACT_ARRAYS = ("start", "position", "force", "slid")
PLANE_ARRAYS = ("spring", "force")
SHORTER = 1 / 3
"""Share of the elements' critical step below which contact is remarked on."""


@dataclass(frozen=True)
class ContactTouching:
    """Pairs that touch now."""

    first: Integers
    """(t,) node of one, in the numbers of all bodies"""
    second: Integers
    """(t,) node of the other"""
    force: Floats
    """(t, 3) on the first [N]"""
    spring: Floats
    """(t, 3) tangential spring [m]"""
    overlap: Floats
    """(t,) [m]"""


class Contacts:
    """Spheres at the surface vertices of all bodies of a simulation, and what they remember.

    Made by `qdem_fem.Simulation` of its ``contact``.  Raises `ConditionError` where single
    precision or a GPU is asked for, and `ContactTooDeep`.
    """

    def __init__(self, run: Simulation, asked: SphereContact) -> None:
        self.run, self.asked = run, asked
        assembly = run.assembly
        parts = list(zip(run.bodies, run.first_node, strict=False))
        local = [np.unique(body.surface) for body, _ in parts]
        self.nodes = np.concatenate([n + s for n, (_, s) in zip(local, parts, strict=True)])
        """(c,) vertices with a sphere, in the numbers of all bodies"""
        counts = [len(nodes) for nodes in local]
        reference = np.concatenate([b.nodes[n] for n, (b, _) in zip(local, parts, strict=True)])

        def by_body(values: list[float]) -> Floats:
            return np.repeat(np.array(values, dtype=float), counts)

        normal = by_body([asked.of_body(b.name, "normal_stiffness") for b in run.bodies])
        radius = by_body([asked.of_body(b.name, "radius") for b in run.bodies])
        poisson = by_body([float(np.mean(b.material.poisson)) for b in run.bodies])
        place = assembly.place[self.nodes]
        self.skin = float(SKIN * radius.min() if asked.skin is None else asked.skin)
        size, walls = len(self.nodes), len(asked.planes)
        frictions = [asked.friction if p.friction is None else p.friction for p in asked.planes]
        across = np.array([p.normal for p in asked.planes], dtype=float).reshape(-1, 3)
        self.kernel = Contact(
            Spheres(
                reference,
                4 * place,
                4 * place + assembly.packed.node_window[place],
                np.repeat(np.arange(len(counts)), counts),
                radius,
                normal,
                tangential_stiffness(normal, poisson),
            ),
            pairs_of(np.zeros(size + 1, np.int64), np.zeros(0, np.int64), bool(walls)),
            Planes(
                np.array([p.point for p in asked.planes], dtype=float).reshape(-1, 3),
                across / np.linalg.norm(across, axis=1, keepdims=True),
                np.array(frictions, dtype=float),
                np.zeros((walls, size, 3)),
                np.zeros((walls, size, 3)),
            ),
            float(asked.friction),
            self.skin / 2,
            np.full((size, 3), np.inf),
            np.zeros((size, 3)),
            np.zeros((size, 3)),
            np.zeros(size),
        )
        inverse = np.asarray(assembly.state.inverse_mass, dtype=float)
        self.inverse_mass: Floats = inverse[place]
        """(c,) [1/kg]"""
        self.renewals = 0
        """Times that pairs were looked for."""
        self.warned = 0.0
        self.stale = True
        """Whether the user moved a body since the contacts were found."""

    @property
    def pairs(self) -> Pairs:
        """The present list of pairs."""
        found: Pairs = self.kernel.pairs
        return found

    # --- in a march ----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Find the contacts of a displacement that the user set: springs begin anew there."""
        if not self.stale:
            return
        self.pairs.touching[:] = 0
        self.kernel.planes.spring[:] = 0.0
        self.kernel.planes.force[:] = 0.0
        self.pairs_find()
        state = self.run.assembly.state
        said = advance_one(self.kernel, state.displacement, state.velocity, 0.0)
        self.stale = False
        self.deep_check(said)

    def pairs_find(self) -> None:
        """Look for pairs anew; those that touch keep their springs."""
        displacement = np.asarray(self.run.assembly.state.displacement)
        at = self.kernel.spheres.place[:, None] + np.arange(3)
        position = self.kernel.spheres.reference + displacement[at]
        if not np.isfinite(position).all():
            return  # what made it so is told by the march
        spheres = self.kernel.spheres
        walls = bool(self.asked.planes)
        pairs = pairs_renew(self.pairs, position, spheres.radius, spheres.body, self.skin, walls)
        self.kernel = self.kernel._replace(pairs=pairs)
        self.kernel.start[:] = position
        self.renewals += 1

    def window(
        self, steps: int, step: float, loads: kernel.Loads, held: kernel.Constraints,
        probes: kernel.Probes, table: Floats, gravity: Floats | None, work: Floats,
    ) -> tuple[int, float]:  # fmt: skip
        """`Assembly.window` with contact; comes back early where pairs have to be looked for."""
        assembly = self.run.assembly
        accelerations = assembly.gravity_packed(gravity)
        before = numba.get_num_threads()
        numba.set_num_threads(assembly.threads)
        try:
            done, bad, said = contact_window(
                True if assembly.threads > 1 else None, assembly.law, assembly.viscous,
                assembly.packed.layout, assembly.state, loads, held, probes, table,
                accelerations, work, assembly.dtype.type(step), steps, self.kernel,
            )  # fmt: skip
        finally:
            numba.set_num_threads(before)
        if said == TOO_DEEP and not bad:
            self.run.motion.steps_done += int(done)
            self.deep_check(said)
        if said:
            self.pairs_find()
        return int(done), float(bad)

    def deep_check(self, said: int) -> None:
        """Raise `ContactTooDeep` with the deepest contact where a step said so."""
        if said != TOO_DEEP:
            return
        touching = self.touching()
        radius = self.kernel.spheres.radius
        worst = "a vertex is in a wall by more than its radius"
        if len(touching.overlap):
            at = int(np.argmax(touching.overlap))
            one, other = (self._named(int(n[at])) for n in (touching.first, touching.second))
            if touching.overlap[at] >= radius.min():
                worst = f"{one} and {other} overlap by {touching.overlap[at]:.3g} m"
        raise ContactTooDeep(
            f"{worst}; spheres of radius {radius.min():.3g} m no longer tell inside from outside",
            where=f"t = {self.run.time:.6g} s, step {self.run.steps_done}",
            remedy="begin with bodies apart by two radii, load more slowly, or take a greater "
            "normal_stiffness",
        )

    def _named(self, node: int) -> str:
        body = int(np.searchsorted(self.run.first_node, node, side="right")) - 1
        return f"node {node - self.run.first_node[body]} of {self.run.bodies[body].name}"

    def step_check(self) -> None:
        """Warn where the contacts there are now make the step too long."""
        bound = self.stiffness_now()
        if bound <= max(self.allowed, self.warned):
            return
        elements = self.run.elements_critical_step.value
        own = step_with_contact(elements, bound, viscous=self.run.viscous)
        if self.run.step > own:
            self.warned = bound
            warnings.warn(
                f"t = {self.run.time:.6g} s: a vertex has more contacts than the step allows for; "
                f"it is {self.run.step:.4g} s, and only {own:.4g} s is sure to be stable; name "
                f"more contacts than {self.asked.contacts}",
                StepWarning,
                stacklevel=5,
            )

    # --- what there is to see ------------------------------------------------------------------

    @cached_property
    def allowed(self) -> float:
        """`allowed_bound` of as many contacts as were asked for [1/s^2]."""
        normal = self.kernel.spheres.normal
        greatest = pair_stiffness(normal, normal.max(initial=0.0))
        return allowed_bound(greatest, self.inverse_mass, self.asked.contacts)

    def critical_step(self, elements: CriticalStep) -> CriticalStep:
        """The critical step of the elements, made shorter by the contacts it allows for."""
        value = step_with_contact(elements.value, self.allowed, viscous=self.run.viscous)
        remark = elements.remark
        if value < elements.value * SHORTER:
            remark = (
                f"{self.asked.contacts} contacts of a vertex make the critical step "
                f"{value / elements.value:.2g} times what the elements alone allow; a smaller "
                "normal_stiffness or a mesh with heavier vertices makes it longer"
            )
        return replace(elements, value=value, remark=remark)

    def stiffness_now(self) -> float:
        """`network_bound` of the contacts there are now [1/s^2]."""
        ends = self._ends()
        normal = self.kernel.spheres.normal
        stiffness = pair_stiffness(normal[ends[:, 0]], normal[ends[:, 1]])
        walls = (self.kernel.planes.force != 0).any(axis=2).sum(axis=0)
        return network_bound(ends, stiffness, 2 * normal * walls, self.inverse_mass)

    def _ends(self) -> Integers:
        touching = np.flatnonzero(self.pairs.touching)
        row = np.repeat(np.arange(len(self.nodes)), np.diff(self.pairs.first))
        return np.column_stack([row[touching], self.pairs.second[touching]])

    def touching(self) -> ContactTouching:
        """Pairs that touch now, by their nodes."""
        ends, held = self._ends(), self.pairs.touching.astype(bool)
        apart = self.kernel.position[ends[:, 0]] - self.kernel.position[ends[:, 1]]
        overlap = self.kernel.spheres.radius[ends].sum(axis=1) - np.linalg.norm(apart, axis=1)
        return ContactTouching(
            self.nodes[ends[:, 0]],
            self.nodes[ends[:, 1]],
            self.pairs.pull[held],
            self.pairs.spring[held],
            overlap,
        )

    def energy(self) -> tuple[float, float]:
        """Energy in the springs, and work that the sliders took since the start [J]."""
        self.refresh()
        spheres, planes = self.kernel.spheres, self.kernel.planes
        ends, touching = self._ends(), self.touching()
        normal, tangential = (
            pair_stiffness(k[ends[:, 0]], k[ends[:, 1]])
            for k in (spheres.normal, spheres.tangential)
        )
        twice = (normal * touching.overlap**2).sum()
        twice += (tangential * (touching.spring**2).sum(axis=1)).sum()
        for w, n in enumerate(planes.normal):
            overlap = (planes.force[w] @ n) / (2 * spheres.normal)
            twice += (2 * spheres.normal * overlap**2).sum()
            twice += (2 * spheres.tangential * (planes.spring[w] ** 2).sum(axis=1)).sum()
        return 0.5 * float(twice), float(self.kernel.slid.sum())

    def plane_force(self, number: int) -> Floats:
        """Force of the bodies on a wall [N], (3,)."""
        self.refresh()
        return -np.asarray(self.kernel.planes.force[number].sum(axis=0))

    def accelerations(self) -> Floats:
        """What the contact forces of now make of the nodes [m/s^2], (n, 3)."""
        self.refresh()
        assembly = self.run.assembly
        flat = np.zeros((assembly.n_nodes, 4))
        at = self.kernel.spheres.place // 4
        np.add.at(flat[:, :3], at, self.kernel.force)
        flat *= np.asarray(assembly.state.inverse_mass, dtype=float)[:, None]
        return flat[assembly.place, :3]

    # --- in a file -----------------------------------------------------------------------------

    def stored(self) -> dict[str, NDArray[Any]]:
        """Everything that the next step reads, to the bit."""
        self.refresh()
        arrays = {f"contact_{name}": getattr(self.pairs, name) for name in PAIR_ARRAYS}
        arrays |= {f"contact_{name}": getattr(self.kernel, name) for name in CONTACT_ARRAYS}
        return arrays | {
            f"contact_plane_{name}": getattr(self.kernel.planes, name) for name in PLANE_ARRAYS
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take what `stored` gave."""
        given = {name: arrays[f"contact_{name}"] for name in PAIR_ARRAYS}
        pairs = pairs_of(given["first"].copy(), given["second"].copy(), bool(self.asked.planes))
        for name in ("touching", "spring", "pull"):
            getattr(pairs, name)[:] = given[name]
        self.kernel = self.kernel._replace(pairs=pairs)
        for name in CONTACT_ARRAYS:
            getattr(self.kernel, name)[:] = arrays[f"contact_{name}"]
        for name in PLANE_ARRAYS:
            getattr(self.kernel.planes, name)[:] = arrays[f"contact_plane_{name}"]
        self.stale = False
