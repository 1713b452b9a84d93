"""The contacts of spheres at surface vertices: their arrays, bounds, energies."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact import search
from qdem_fem.contact.bounds import bound_spring_network
from qdem_fem.contact.spheres import (
    NEAR,
    SKIN_OF_SPHERES,
    Contact,
    Planes,
    SphereContact,
    Spheres,
    find_pair_stiffness,
    find_tangential_stiffness,
    pack_planes,
)
from qdem_fem.contact.state import Contacts, ContactTouching
from qdem_fem.contact.system import System
from qdem_fem.files import Floats, Integers

PARTED = 1 + 1e-9
"""By how much a list reaches farther than what has parted, for round-off."""
PAIR_ARRAYS = ("first", "second", "touching", "spring", "pull")
CONTACT_ARRAYS = ("start", "position", "force", "slid")
PLANE_ARRAYS = ("spring", "force")


class SphereContacts(Contacts):
    """Spheres at the surface vertices of all bodies of a simulation, and what they remember."""

    kernel: Contact
    room: float = np.inf
    """By how much a pair's reach may be more for no body to meet its image across the width [m]."""

    def __init__(self, run: System, asked: SphereContact) -> None:
        super().__init__(run, asked)
        counts = np.diff(self.first_vertex)

        def repeat_by_body(values: list[float]) -> Floats:
            return np.repeat(np.array(values, dtype=float), counts)

        normal = repeat_by_body([asked.find_value(b.name, "normal_stiffness") for b in run.bodies])
        radius = repeat_by_body([asked.find_value(b.name, "radius") for b in run.bodies])
        poisson = repeat_by_body([float(np.mean(b.material.poisson)) for b in run.bodies])
        self.one = find_pair_stiffness(normal, normal.max(initial=0.0))
        self.skin = float(SKIN_OF_SPHERES * radius.min() if asked.skin is None else asked.skin)
        free = asked.skin is None and asked.contacts != NEAR
        self.skins = (self.skin, float(radius.min()) if free else self.skin)
        """Least and greatest skin [m]."""
        self.deep = float(radius.max())
        self.reach = 2 * self.deep + self.skin
        size, walls = len(self.nodes), len(asked.planes)
        zero = np.zeros((size, 3))
        self.kernel = Contact(
            Spheres(
                self.reference, 4 * self.place, self.force_at,
                np.repeat(np.arange(len(counts)), counts), radius, normal,
                find_tangential_stiffness(normal, poisson),
            ),
            search.make_pairs(
                np.zeros(size + 1, np.int64), np.zeros(0, np.int64), np.zeros((size, 0), bool),
                search.NO_IMAGE if asked.periodic is None else np.zeros((0, 3)),
            ),
            Planes(
                *pack_planes(asked.planes, asked.friction),
                np.zeros((walls, size, 3)), np.zeros((walls, size, 3)),
            ),
            float(asked.friction), self.skin / 2, zero + np.inf, zero.copy(), zero.copy(),
            np.zeros(size),
        )  # fmt: skip

    @property
    def pairs(self) -> search.Pairs:
        """The present list of pairs."""
        found: search.Pairs = self.kernel.pairs
        return found

    def forget(self) -> None:
        self.pairs.touching[:] = 0
        self.kernel.force[:] = 0.0
        self.kernel.planes.spring[:] = 0.0
        self.kernel.planes.force[:] = 0.0

    def renew_lists(self, position: Floats) -> None:
        """Look for pairs around vertices at (c, 3) [m]; the skin follows how fast they move."""
        self.check_images(position)
        least, most = self.skins
        room = least + self.room / 2
        self.skin = search.choose_skin(
            self.skin, self.lasted, self.count_idle_pairs(), len(self.nodes), least, min(most, room)
        )  # fmt: skip
        self.look_for_pairs(
            position, max(self.skin, min(self.measure_gap(position), self.deep, room))
        )

    def extents(self, position: Floats, side: search.PeriodicWidth) -> Floats:
        """Extent of each body along the axis of a width [m], (bodies,)."""
        return search.find_extents(position[:, side.number], self.first_vertex)

    def check_images(self, position: Floats) -> None:
        """Raise `ConditionError` for a body that would touch its own image across the width."""
        if (side := self.asked.periodic) is None:
            return
        run = self.run
        fixed = np.flatnonzero(run.master != np.arange(len(run.master)))
        for b in np.unique(np.searchsorted(run.first_node, fixed, side="right") - 1):
            nodes = slice(*run.first_node[b : b + 2])
            master = run.master[nodes] - run.first_node[b]
            search.check_joined(run.bodies[b], master, side, self.where)
        size = self.extents(position, side)
        self.room = search.check_extents(run.bodies, size, self.reach, side, self.where)

    def count_idle_pairs(self) -> int:
        """Pairs of the list that do not touch."""
        return len(self.pairs.second) - int(self.pairs.touching.sum())

    def look_for_pairs(self, position: Floats, skin: float) -> None:
        """List the pairs within ``skin`` [m] of each other at (c, 3) [m]."""
        spheres = self.kernel.spheres
        pairs = search.renew_pairs(
            self.pairs, position, spheres.radius, spheres.body, skin,
            self.walls(position, skin), self.asked.periodic,
        )  # fmt: skip
        self.kernel = self.kernel._replace(pairs=pairs, half_skin=self.skin / 2)
        self.kernel.start[:] = position

    def measure_gap(self, position: Floats) -> float:
        """By how much what touched in the last step is apart at (c, 3) [m].

        A list has to hold it for one step more, in which its spring is let go.
        """
        radius, planes, ends = self.kernel.spheres.radius, self.kernel.planes, self._ends()
        between = position[ends[:, 0]] - position[ends[:, 1]]
        if self.asked.periodic is not None:
            between -= self.pairs.image[self.pairs.touching.astype(bool)]
        gaps = [np.linalg.norm(between, axis=1) - radius[ends].sum(axis=1)]
        for point, normal, force in zip(planes.point, planes.normal, planes.force, strict=True):
            held = force.any(axis=1)
            along = np.einsum("ck,k->c", position[held] - point, normal)
            gaps.append(along - radius[held])
        return PARTED * float(np.concatenate(gaps).max(initial=0.0))

    def walls(self, position: Floats, skin: float) -> NDArray[np.bool_]:
        """Which vertices at (c, 3) [m] touch which walls, or may on a way of ``skin`` [m]."""
        radius, planes = self.kernel.spheres.radius, self.kernel.planes
        return search.find_near_walls(position, radius, planes.point, planes.normal, skin)

    def describe_deepest(self) -> tuple[str, str]:
        touching, radius = self.touching(), self.kernel.spheres.radius
        worst = "a vertex is in a wall by more than its radius"
        if len(touching.overlap):
            at = int(np.argmax(touching.overlap))
            one, other = (self.name_node(int(n[at])) for n in (touching.first, touching.second))
            if touching.overlap[at] >= radius.min():
                worst = f"{one} and {other} overlap by {touching.overlap[at]:.3g} m"
        return (
            f"{worst}; spheres of radius {radius.min():.3g} m no longer tell inside from outside",
            "begin with bodies apart by two radii, load more slowly, or take a greater "
            "normal_stiffness",
        )

    def bound_present_stiffness(self) -> float:
        """`bound_spring_network` of the contacts there are now [1/s^2]."""
        walls = (self.kernel.planes.force != 0).any(axis=2).sum(axis=0)
        springs = self._springs(self._ends(), walls)
        return bound_spring_network(*springs, self.inverse_mass, self.bound_rigid)

    def find_near_springs(self) -> tuple[Integers, Floats, Floats]:
        self.refresh()
        return self._springs(self._ends(every=True), np.diff(self.pairs.wall_first))

    def _springs(self, ends: Integers, walls: Integers) -> tuple[Integers, Floats, Floats]:
        """k_n of pairs (p, 2), and of so many walls (c,) of each vertex [N/m], behind the pairs."""
        normal = self.kernel.spheres.normal
        stiffness = find_pair_stiffness(normal[ends[:, 0]], normal[ends[:, 1]])
        return ends, stiffness, 2 * normal * walls

    def _ends(self, *, every: bool = False) -> Integers:
        """Vertices (p, 2) of the pairs that touch, or of all in the list."""
        first, second = self.pairs.first, self.pairs.second
        at = np.arange(len(second)) if every else np.flatnonzero(self.pairs.touching)
        return np.column_stack([np.searchsorted(first, at, side="right") - 1, second[at]])

    def touching(self) -> ContactTouching:
        """Pairs that touch now, by their nodes."""
        ends, held = self._ends(), self.pairs.touching.astype(bool)
        apart = self.kernel.position[ends[:, 0]] - self.kernel.position[ends[:, 1]]
        if self.asked.periodic is not None:
            apart -= self.pairs.image[held]
        overlap = self.kernel.spheres.radius[ends].sum(axis=1) - np.linalg.norm(apart, axis=1)
        return ContactTouching(
            self.nodes[ends[:, 0]],
            self.nodes[ends[:, 1]],
            self.pairs.pull[held],
            self.pairs.spring[held],
            overlap,
        )

    def energy(self) -> tuple[float, float]:
        self.refresh()
        spheres, planes = self.kernel.spheres, self.kernel.planes
        ends, touching = self._ends(), self.touching()
        normal, tangential = (
            find_pair_stiffness(k[ends[:, 0]], k[ends[:, 1]])
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
        self.refresh()
        return -np.asarray(self.kernel.planes.force[number].sum(axis=0))

    def find_touching_bodies(self) -> tuple[Integers, Integers]:
        self.refresh()
        body = self.kernel.spheres.body
        pressed = (self.kernel.planes.force != 0).any(axis=(0, 2))
        return body[self._ends()], body[pressed]

    def pack_state(self) -> dict[str, NDArray[Any]]:
        self.refresh()
        arrays = {f"contact_{name}": getattr(self.pairs, name) for name in PAIR_ARRAYS}
        if self.asked.periodic is not None:
            arrays["contact_image"] = self.pairs.image
        arrays |= {f"contact_{name}": getattr(self.kernel, name) for name in CONTACT_ARRAYS}
        return arrays | {
            f"contact_plane_{name}": getattr(self.kernel.planes, name) for name in PLANE_ARRAYS
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        given = {name: arrays[f"contact_{name}"].copy() for name in PAIR_ARRAYS + CONTACT_ARRAYS}
        walls = self.walls(given["start"], self.skin)
        image = search.NO_IMAGE if self.asked.periodic is None else arrays["contact_image"].copy()
        pairs = search.make_pairs(given["first"], given["second"], walls, image)
        held = {name: arrays[f"contact_plane_{name}"].copy() for name in PLANE_ARRAYS}
        self.kernel = self.kernel._replace(
            pairs=pairs._replace(**{name: given[name] for name in PAIR_ARRAYS}),
            planes=self.kernel.planes._replace(**held),
            **{name: given[name] for name in CONTACT_ARRAYS},
        )
        self.stale, self._near = False, None
