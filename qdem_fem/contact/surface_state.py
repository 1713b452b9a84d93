"""The contacts of surfaces: their arrays, bounds, energies."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact.spheres import find_pair_stiffness, find_tangential_stiffness, pack_planes
from qdem_fem.contact.state import Contacts
from qdem_fem.contact.surface import (
    DEPTH,
    OVERLAP,
    Near,
    Surface,
    SurfaceContact,
    SurfaceTouch,
    Walls,
    find_overlap,
    find_sharp_edges,
    make_near,
    place_points,
    renew_near,
)
from qdem_fem.contact.system import System
from qdem_fem.files import Floats, Integers, warn_user
from qdem_fem.mesh import find_area_vectors

TOUCH_ARRAYS = ("start", "position", "force", "account")
WALL_ARRAYS = ("weight", "spring", "force")


class SurfaceContacts(Contacts):
    """Points and sharp edges of the surfaces of all bodies, and what they remember."""

    kernel: SurfaceTouch

    def __init__(self, run: System, asked: SurfaceContact) -> None:
        edge = [
            np.linalg.norm(np.diff(body.nodes[body.surface[:, :2]], axis=1), axis=2)
            for body in run.bodies
        ]
        self.depth = float(
            DEPTH * np.median(np.concatenate(edge)) if asked.depth is None else asked.depth
        )
        self.skin = self.deep = self.depth
        self.reach = 2 * (self.depth + self.skin)
        super().__init__(run, asked)
        counts, starts = np.diff(self.first_vertex), self.first_vertex
        share = place_points(int(asked.points))
        parts: list[list[Any]] = [[] for _ in range(8)]
        faces, areas, edges, opposite, edge_areas, points, shares, of_points = parts
        for body, start, count in zip(run.bodies, starts, counts, strict=False):
            own = np.searchsorted(np.unique(body.surface), body.surface)
            nodes, first_face = self.reference[start : start + count], sum(map(len, faces))
            faces.append(own + start)
            areas.append(np.linalg.norm(find_area_vectors(nodes, own), axis=1))
            sharp, across = find_sharp_edges(nodes, own)
            edges.append(sharp + start)
            opposite.append(across + start)
            by_edge = np.zeros(len(sharp))
            for k in range(2):  # a third of each of its two faces
                three = np.column_stack([sharp, across[:, k]])
                by_edge += np.linalg.norm(find_area_vectors(nodes, three), axis=1) / 3
            edge_areas.append(by_edge)
            vertices = np.repeat(start + np.arange(count)[:, None], 3, axis=1)
            points += [np.repeat(own + start, len(share), axis=0), vertices]
            shares += [np.tile(share, (len(own), 1)), np.tile([1.0, 0, 0], (count, 1))]
            inside = np.repeat(first_face + np.arange(len(own)), len(share))
            of_points.append(np.concatenate([inside, np.full(count, -1)]))
        lengths = counts, [len(f) for f in faces], [len(p) for p in of_points], map(len, edges)
        self.firsts = tuple(np.concatenate([[0], np.cumsum(list(each))]) for each in lengths)
        """First vertex, face, point and edge of every body, and the ends."""
        face, area, point_face = (np.concatenate(each) for each in (faces, areas, of_points))
        body_of = [np.repeat(np.arange(len(counts)), np.diff(first)) for first in self.firsts]
        modulus = np.array([asked.find_value(body.name, "modulus") for body in run.bodies])
        poisson = np.array([float(np.mean(body.material.poisson)) for body in run.bodies])
        size, walls, count = len(self.nodes), len(asked.planes), len(point_face)
        fan = np.argsort(face.ravel(), kind="stable")
        nothing = np.zeros(0, np.int64)
        zero = np.zeros((size, 3))
        self.kernel = SurfaceTouch(
            Surface(
                self.reference, 4 * self.place, self.force_at, face, area,
                np.searchsorted(face.ravel()[fan], np.arange(size + 1)), fan // 3,
                np.concatenate(points), np.concatenate(shares), point_face,
                np.where(point_face >= 0, area[point_face] / len(share), 0.0), body_of[2],
                np.concatenate(edges),
                np.concatenate(opposite), np.concatenate(edge_areas), body_of[3],
                modulus, find_tangential_stiffness(modulus, poisson),
            ),
            make_near(nothing, nothing, np.zeros(1, np.int64), nothing, nothing.reshape(0, 2)),
            Walls(
                *pack_planes(asked.planes, asked.friction), np.full((walls, count), -1.0),
                np.zeros((walls, count, 3)), np.zeros((walls, 3)),
            ),
            float(asked.friction), self.skin / 2, self.depth, zero + np.inf, zero.copy(),
            zero.copy(), np.zeros(2), np.arange(size),
        )  # fmt: skip
        covering = np.zeros(size)
        np.add.at(covering, face, np.repeat(area[:, None] / 3, 3, axis=1))
        covering = self.sum_shared(covering)
        self.one = find_pair_stiffness(modulus, modulus.max())[body_of[0]] * covering

    @property
    def near(self) -> Near:
        """The present lists."""
        found: Near = self.kernel.near
        return found

    def forget(self) -> None:
        walls = self.kernel.walls
        for weight in (self.near.weight, self.near.edge_weight, walls.weight):
            weight[:] = -1.0
        for spring in (self.near.spring, self.near.edge_spring, walls.spring):
            spring[:] = 0.0

    def refresh(self) -> None:
        begins = self.stale and not self.run.steps_done
        super().refresh()
        if begins:
            self.name_overlap()

    def name_overlap(self) -> None:
        """Warn of bodies that begin in each other, which what throws them apart does not say."""
        surface, near, x = self.kernel.surface, self.near, self.kernel.position
        depth, point, other = find_overlap(surface, near, x)
        if depth > OVERLAP * self.depth:
            names = self.run.bodies[surface.point_body[point]].name, self.run.bodies[other].name
            warn_user(
                f"{names[0]} begins {depth:.3g} m inside {names[1]}, and the contacts at the start "
                f"hold {self.kernel.account[0]:.3g} J, which throw bodies apart; begin with bodies "
                "that do not overlap"
            )

    def renew_lists(self, position: Floats) -> None:
        reach = self.depth + self.skin
        near = renew_near(self.near, self.kernel.surface, position, self.firsts, reach)
        self.kernel = self.kernel._replace(near=near)
        self.kernel.start[:] = position

    def sum_shared(self, values: Floats) -> Floats:
        """(c,) for every vertex the sum over all that move with its node."""
        total = np.zeros(self.run.assembly.n_nodes)
        np.add.at(total, self.place, values)
        return np.asarray(total[self.place])

    def describe_deepest(self) -> tuple[str, str]:
        return (
            f"a point of a surface is more than {self.depth:.3g} m inside another body",
            "begin with bodies that do not overlap, load more slowly, or take a greater modulus "
            "or depth",
        )

    def bound_present_stiffness(self) -> float:
        """Row sums of the points and edges that touch now, over the masses [1/s^2]."""
        surface, near, walls = self.kernel.surface, self.near, self.kernel.walls
        total = np.zeros(len(self.nodes))
        at = np.flatnonzero(near.weight > 0)
        point, other = near.point[at], near.body[at]
        modulus = find_pair_stiffness(
            surface.modulus[surface.point_body[point]], surface.modulus[other]
        )
        stiffness = 0.5 * near.weight[at] * modulus
        face = surface.point_node[point]
        np.add.at(total, face, 2 * stiffness[:, None] * surface.point_share[point])
        if len(at):  # what lies on a face is borne by its nodes, by no more than all of it each
            below = surface.face[near.face[near.first[at]]]
            np.add.at(total, below, 2 * stiffness[:, None] / 3)
        at = np.flatnonzero(near.edge_weight > 0)
        for k in range(2):
            edge = near.edges[at, k]
            modulus = surface.modulus[surface.edge_body[edge]]
            np.add.at(total, surface.edge[edge], (2 * near.edge_weight[at] * modulus)[:, None])
        held = np.maximum(walls.weight, 0).sum(axis=0)
        stiffness = 2 * held * surface.modulus[surface.point_body]
        np.add.at(total, surface.point_node, stiffness[:, None] * surface.point_share)
        total = self.sum_shared(total)
        bound = total * self.inverse_mass + self.bound_rigid(total)
        return float(bound.max(initial=0.0))

    def energy(self) -> tuple[float, float]:
        self.refresh()
        return float(self.kernel.account[0]), float(self.kernel.account[1])

    def plane_force(self, number: int) -> Floats:
        self.refresh()
        return np.array(self.kernel.walls.force[number])

    def find_touching_bodies(self) -> tuple[Integers, Integers]:
        self.refresh()
        surface, near = self.kernel.surface, self.near
        at = near.weight > 0
        by_points = np.column_stack([surface.point_body[near.point[at]], near.body[at]])
        by_edges = surface.edge_body[near.edges[near.edge_weight > 0]]
        pressed = (self.kernel.walls.weight > 0).any(axis=0)
        return np.concatenate([by_points, by_edges]), surface.point_body[pressed]

    def pack_state(self) -> dict[str, NDArray[Any]]:
        self.refresh()
        kernel, walls = self.kernel, self.kernel.walls
        arrays = {f"contact_near_{name}": getattr(self.near, name) for name in Near._fields}
        arrays |= {f"contact_{name}": getattr(kernel, name) for name in TOUCH_ARRAYS}
        return arrays | {f"contact_wall_{name}": getattr(walls, name) for name in WALL_ARRAYS}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        near = Near(*(arrays[f"contact_near_{name}"].copy() for name in Near._fields))
        self.kernel = self.kernel._replace(near=near)
        for name in TOUCH_ARRAYS:
            getattr(self.kernel, name)[:] = arrays[f"contact_{name}"]
        for name in WALL_ARRAYS:
            getattr(self.kernel.walls, name)[:] = arrays[f"contact_wall_{name}"]
        self.stale = False
