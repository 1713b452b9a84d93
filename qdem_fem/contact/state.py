"""The contacts of a simulation, whatever their model: their place in a march."""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import Given
from qdem_fem.contact.bounds import bound_contacts, find_near_step, shorten_step_by_contact
from qdem_fem.contact.critical_step import CriticalStep
from qdem_fem.contact.spheres import LOOK_AGAIN, NEAR, TOO_DEEP, SphereContact
from qdem_fem.contact.surface import SurfaceContact, check_inside
from qdem_fem.contact.system import System
from qdem_fem.contact.window import advance_contact, run_window
from qdem_fem.files import ContactTooDeep, Floats, Integers, StepWarning, Unstable

CHECKED = 64
"""Steps between two looks at whether the contacts there are allow the step: a look costs two."""
SHORTER = 1 / 3
"""Share of the elements' critical step below which contact is remarked on."""


@dataclass(frozen=True)
class ContactTouching:
    """Pairs of spheres that touch now."""

    first: Integers  # (t,) node of one, in the numbers of all bodies
    second: Integers  # (t,) node of the other
    force: Floats  # (t, 3) on the first [N]
    spring: Floats  # (t, 3) tangential spring [m]
    overlap: Floats  # (t,) [m]


class Contacts(ABC):
    """Contact at the surface vertices of all bodies of a simulation, and what it remembers.

    A model sets ``kernel``, the arrays that a step of it reads and writes, ``skin``, ``reach`` and
    ``deep``.
    """

    kernel: Any
    asked: SphereContact | SurfaceContact
    skin: float
    one: Floats  # (c,) stiffness of one contact of each vertex [N/m]
    deep: float  # depth in another body beyond which a point of this one is not seen [m]
    reach: float  # way within which two vertices may be looked at as touching [m]

    def __init__(self, run: System, asked: SphereContact | SurfaceContact) -> None:
        outer = [np.unique(body.surface) for body in run.bodies]
        self.run, self.asked, self.contacts = run, asked, asked.contacts
        starts = run.first_node[:-1]
        self.nodes = np.concatenate([own + start for own, start in zip(outer, starts, strict=True)])
        """(c,) vertices, in the numbers of all bodies"""
        self.first_vertex = np.concatenate([[0], np.cumsum([len(own) for own in outer])])
        """First vertex of every body, and the end, (bodies + 1,)."""
        self.reference = np.concatenate([body.nodes for body in run.bodies])[self.nodes]
        self.place = run.assembly.place[self.nodes]
        self.force_at = 4 * self.place + run.assembly.packed.node_window[self.place]
        inverse = np.asarray(run.assembly.state.inverse_mass, dtype=float)
        self.inverse_mass: Floats = inverse[self.place]
        """(c,) [1/kg]"""
        self._allowed: float | None = None
        self._near: float | None = None
        self.renewals = 0
        """Times that pairs were looked for."""
        self.lasted = 0
        """Steps since then."""
        self.warned = 0.0
        self.checked = -CHECKED
        """Step at which the springs there were last made the step be looked at."""
        self.stale = True
        """Whether the user moved a body since the contacts were found."""

    # --- what a model is -----------------------------------------------------------------------

    @abstractmethod
    def forget(self) -> None:
        """Let go of all springs."""

    @abstractmethod
    def renew_lists(self, position: Floats) -> None:
        """Look for what may touch around vertices at (c, 3) [m], where ways begin again; what
        touches keeps its springs."""

    @abstractmethod
    def bound_present_stiffness(self) -> float:
        """Bound on omega^2 of the contacts there are now [1/s^2]."""

    def find_near_springs(self) -> tuple[Integers, Floats, Floats]:
        """Ends (p, 2), k_n (p,) and k_n to walls (c,) [N/m] of all contacts there can be before
        pairs are looked for again: no vertex then is half a skin from where it was."""
        raise NotImplementedError("only spheres know what is near")

    @abstractmethod
    def describe_deepest(self) -> tuple[str, str]:
        """What is too deep, and what to do, in words."""

    @abstractmethod
    def energy(self) -> tuple[float, float]:
        """Energy in the springs, and work that the sliders took since the start [J]."""

    @abstractmethod
    def plane_force(self, number: int) -> Floats:
        """Force of the bodies on a wall [N], (3,)."""

    @abstractmethod
    def find_touching_bodies(self) -> tuple[Integers, Integers]:
        """Numbers of the bodies that touch each other (t, 2), and of those on a wall (w,)."""

    @abstractmethod
    def pack_state(self) -> dict[str, NDArray[Any]]:
        """Everything that the next step reads, to the bit."""

    @abstractmethod
    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take what `pack_state` gave."""

    # --- for the time step ---------------------------------------------------------------------

    @property
    def allowed(self) -> float:
        """Bound on omega^2 of the contacts that the time step allows for [1/s^2]."""
        if self._allowed is None:
            assert self.contacts != NEAR
            self._allowed = bound_contacts(
                self.one, self.inverse_mass, self.contacts, self.bound_rigid
            )
        return self._allowed

    def bound_rigid(self, stiffness: Floats) -> Floats:
        """`RigidBodies.frequency_bound` of springs (c,) [N/m] at the vertices."""
        if self.run.rigid is None:
            return np.zeros_like(stiffness)
        return self.run.rigid.frequency_bound(self.nodes, stiffness)

    def forget_bounds(self) -> None:
        """What is held has changed: find the bounds on the step again when they are needed."""
        self._allowed = self._near = None

    def find_near_step(self, elements: float) -> float:
        """`qdem_fem.contact.bounds.find_near_step` of the present list of pairs [s].

        ``elements``: critical step of bodies that touch nothing [s].
        """
        self.refresh()
        if self._near is None:
            self._near = find_near_step(
                self.run, self.find_near_springs(), self.nodes, self.inverse_mass, self.bound_rigid,
                elements,
            )  # fmt: skip
        return self._near

    # --- in a march ----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Find the contacts of a displacement that the user set: springs begin again there."""
        if not self.stale:
            return
        self.forget()
        self.find_pairs()
        said = self.step_contact(0.0)
        self.stale = False
        self.check_deep(said)
        moved = self.run.assembly.field("displacement")
        if np.isfinite(moved).all():
            check_inside(self.run.bodies, moved, self.deep, self.asked.periodic, self.when)

    def find_pairs(self) -> None:
        """Look for pairs again; those that touch keep their springs."""
        position = self.positions()
        if position is None:
            return  # the march says what made it so
        self.renew_lists(position)
        self._near = None
        self.renewals += 1
        self.lasted = 0

    def positions(self) -> Floats | None:
        """Where the vertices are, (c, 3) [m]; None where one is not a number."""
        displacement = np.asarray(self.run.assembly.state.displacement)
        position = self.reference + displacement[4 * self.place[:, None] + np.arange(3)]
        return position if np.isfinite(position).all() else None

    @property
    def where(self) -> str:
        """The time, or before the first step the key, for messages on the width."""
        return self.when if self.run.steps_done else "contact.periodic.width"

    def advance_window(
        self, steps: int, step: float, given: Given, work: Floats
    ) -> tuple[int, float]:
        """`Assembly.window` with contact; comes back early where pairs have to be looked for."""
        done, bad, said = self.march(steps, step, given, work)
        self.lasted += done
        if said == LOOK_AGAIN:
            self.find_pairs()
            said = self.step_contact(step)
        if said == TOO_DEEP and not bad:
            self.run.motion.steps_done += done
            self.check_deep(said)
        return done, bad

    def march(self, steps: int, step: float, given: Given, work: Floats) -> tuple[int, float, int]:
        """`qdem_fem.contact.run_window` of these contacts."""
        return run_window(self.run, self.kernel, steps, step, given, work)

    def step_contact(self, step: float) -> int:
        """Contact at the displacement as it is, to which a ``step`` [s] led; what it says."""
        state = self.run.assembly.state
        moved, velocity = np.asarray(state.displacement), np.asarray(state.velocity)
        return advance_contact(self.kernel, None, moved, velocity, step)

    @property
    def when(self) -> str:
        """The time, for messages; at the start without the step, which may ask for the contacts."""
        return f"t = {self.run.motion.time:.6g} s, step {self.run.steps_done}"

    def check_deep(self, said: int) -> None:
        """Raise `ContactTooDeep` with the deepest contact where a step said so."""
        if said == TOO_DEEP:
            what, remedy = self.describe_deepest()
            raise ContactTooDeep(what, where=self.when, remedy=remedy)

    def name_node(self, node: int) -> str:
        """A node of all bodies by its number in its own."""
        body = int(np.searchsorted(self.run.first_node, node, side="right")) - 1
        return f"node {node - self.run.first_node[body]} of {self.run.bodies[body].name}"

    def check_step(self, step: float, elements: float, last: bool) -> None:
        """Warn where the contacts there are now make a ``step`` [s] too long.

        ``elements``: critical step of bodies that touch nothing [s]; ``last``: step of a march.
        Raises `Unstable` where those near now would, if the step was made for those near once.
        """
        if self.contacts == NEAR:
            if step > (near := self.find_near_step(elements)):
                raise Unstable(
                    "vertices have come near each other whose contacts make the critical step "
                    f"{near:.4g} s; the step is {step:.4g} s, for those that were near when the "
                    "march began",
                    where=self.where,
                    remedy='begin again with a number of contacts in place of "near", or with a '
                    "lower safety",
                )
            return
        if not last and self.run.steps_done < self.checked + CHECKED:
            return
        self.checked = self.run.steps_done
        bound = self.bound_present_stiffness()
        if bound <= max(self.allowed, self.warned):
            return
        own = shorten_step_by_contact(elements, bound, viscous=self.run.viscous)
        if step > own:
            self.warned = bound
            warnings.warn(
                f"t = {self.run.motion.time:.6g} s: a vertex has more contacts than the step "
                f"allows for; it is {step:.4g} s, and only {own:.4g} s is sure to be stable; name "
                f"more contacts than {self.contacts:g}",
                StepWarning,
                stacklevel=5,
            )

    def critical_step(self, elements: CriticalStep) -> CriticalStep:
        """The critical step of the elements, made shorter by the contacts it allows for."""
        if self.contacts == NEAR:
            return replace(elements, value=min(elements.value, self.find_near_step(elements.value)))
        value = shorten_step_by_contact(elements.value, self.allowed, viscous=self.run.viscous)
        remark = elements.remark
        if isfinite(elements.value) and value < elements.value * SHORTER:
            remark = (
                f"{self.contacts:g} contacts of a vertex make the critical step "
                f"{value / elements.value:.2g} times what the elements alone allow; a softer "
                "contact or a mesh with heavier vertices makes it longer"
            )
        return replace(elements, value=value, remark=remark)

    def accelerations(self) -> Floats:
        """What the contact forces of now make of the nodes [m/s^2], (n, 3)."""
        self.refresh()
        assembly = self.run.assembly
        flat = np.zeros((assembly.n_nodes, 4))
        np.add.at(flat[:, :3], self.place, self.kernel.force)
        flat *= np.asarray(assembly.state.inverse_mass, dtype=float)[:, None]
        return flat[assembly.place, :3]
