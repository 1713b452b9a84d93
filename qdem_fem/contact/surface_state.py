"""The contacts of surfaces: their arrays, bounds, energies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact.outside import find_outsides
from qdem_fem.contact.search import NO_IMAGE
from qdem_fem.contact.spheres import make_plane_arrays, pair_stiffness, tangential_stiffness
from qdem_fem.contact.state import Contacts, Floats, Integers
from qdem_fem.contact.surface import (
    DEPTH,
    Near,
    Overlaps,
    Surface,
    SurfaceContact,
    SurfaceTouch,
    Walls,
    find_sharp_edges,
    make_near,
    make_overlaps,
    place_face_points,
    renew_near,
    renew_overlaps,
)
from qdem_fem.contact.system import System
from qdem_fem.mesh import face_area_vectors

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
        # an image goes on beyond a side for as far as a point may, and then sees faces
        super().__init__(
            run, asked, find_outsides(run, asked.periodic, 2 * (self.depth + self.skin))
        )
        self.reach = 2 * (self.depth + self.skin)
        counts, starts = np.diff(self.first_vertex), self.first_vertex
        self.clipped = asked.faces == "overlaps"
        share = place_face_points(0 if self.clipped else int(asked.points))
        parts: list[list[Any]] = [[] for _ in range(7)]
        faces, areas, edges, opposite, edge_areas, points, shares = parts
        for o, start in zip(self.outside, starts, strict=False):
            own, nodes, bearing = o.face, o.reference, np.flatnonzero(o.own)
            area = np.linalg.norm(face_area_vectors(nodes, own), axis=1)
            sharp, across = find_sharp_edges(nodes, own)
            if o.joined:
                once = o.own[sharp].any(axis=1) & ~o.image[sharp].any(axis=1)
                sharp, across = sharp[once], across[once]
            by_edge = np.zeros(len(sharp))
            for k in range(2):  # a third of each of its two faces
                three = np.column_stack([sharp, across[:, k]])
                by_edge += np.linalg.norm(face_area_vectors(nodes, three), axis=1) / 3
            for kept, new in (
                (faces, own + start), (areas, area), (edges, sharp + start),
                (opposite, across + start), (edge_areas, by_edge),
                (points, np.concatenate([
                    np.repeat(own[: o.own_faces] + start, len(share), axis=0),
                    np.repeat(bearing[:, None] + start, 3, axis=1),
                ])),
                (shares, np.concatenate([
                    np.tile(share, (o.own_faces, 1)), np.tile([1.0, 0, 0], (len(bearing), 1)),
                ])),
            ):  # fmt: skip
                kept.append(new)
        self.firsts = tuple(
            np.concatenate([[0], np.cumsum(number)])
            for number in (
                counts, [len(f) for f in faces], [len(p) for p in points], [len(e) for e in edges],
            )
        )  # fmt: skip
        """First vertex, face, point and edge of every body, and the ends."""
        face, area = np.concatenate(faces), np.concatenate(areas)
        body_of = [np.repeat(np.arange(len(counts)), np.diff(first)) for first in self.firsts]
        modulus = np.array([asked.of_body(body.name, "modulus") for body in run.bodies])
        poisson = np.array([float(np.mean(body.material.poisson)) for body in run.bodies])
        size, walls = len(self.nodes), len(asked.planes)
        count = int(self.firsts[2][-1]) + self.clipped * len(face)
        point_face = np.concatenate([
            np.concatenate([
                np.repeat(begin + np.arange(o.own_faces), len(share)), np.full(o.own.sum(), -1),
            ])
            for begin, o in zip(self.firsts[1], self.outside, strict=False)
        ])  # fmt: skip
        mine = np.concatenate([np.arange(len(o.face)) < o.own_faces for o in self.outside])
        self.stop_face = self.firsts[1][:-1] + [o.own_faces for o in self.outside]
        """Behind the last face of each body that is no image of another."""
        fan = np.argsort(face.ravel(), kind="stable")
        nothing = np.zeros(0, np.int64)
        zero = np.zeros((size, 3))
        self.kernel = SurfaceTouch(
            Surface(
                self.reference, 4 * self.place, self.force_at, face,
                area, np.where(mine, body_of[1], -1),
                np.searchsorted(face.ravel()[fan], np.arange(size + 1)), fan // 3,
                np.concatenate(points), np.concatenate(shares), point_face,
                np.where(point_face >= 0, area[point_face] / max(1, len(share)), 0.0), body_of[2],
                np.concatenate(edges),
                np.concatenate(opposite), np.concatenate(edge_areas), body_of[3],
                modulus, tangential_stiffness(modulus, poisson),
            ),
            make_near(
                nothing, nothing, np.zeros(1, np.int64), nothing, nothing.reshape(0, 2),
                *(NO_IMAGE if asked.periodic is None else np.zeros((0, 3)) for _ in range(2)),
            ),
            make_overlaps(
                nothing.reshape(0, 2),
                NO_IMAGE if asked.periodic is None else np.zeros((0, 3)),
            ),
            self.clipped,
            Walls(
                *make_plane_arrays(asked.planes, asked.friction), np.full((walls, count), -1.0),
                np.zeros((walls, count, 3)), np.zeros((walls, 3)),
            ),
            float(asked.friction), self.skin / 2, self.depth, zero + np.inf, zero.copy(),
            zero.copy(), np.zeros(2), np.arange(size),
        )  # fmt: skip
        covering = np.zeros(size)
        np.add.at(covering, face[mine], np.repeat(area[mine, None] / 3, 3, axis=1))
        covering = self.shared(covering)
        self.one = pair_stiffness(modulus, modulus.max())[body_of[0]] * covering
        self.way = np.zeros(3) if asked.periodic is None else asked.periodic.way

    @property
    def kept(self) -> list[str]:
        """Names of the lists' arrays that a checkpoint keeps."""
        images = ("image", "edge_image") if self.asked.periodic is None else ()
        return [name for name in Near._fields if name not in images]

    @property
    def near(self) -> Near:
        """The present lists."""
        found: Near = self.kernel.near
        return found

    def forget(self) -> None:
        """Let go of all springs."""
        self.near.free[:] = self.near.edge_free[:] = -1.0
        overlaps, walls = self.kernel.overlaps, self.kernel.walls
        overlaps.free[:] = -1.0
        for weight in (self.near.weight, self.near.edge_weight, overlaps.area, walls.weight):
            weight[:] = -1.0
        for spring in (self.near.spring, self.near.edge_spring, overlaps.spring, walls.spring):
            spring[:] = 0.0

    def renew_lists(self, position: Floats) -> None:
        """Look for what is near around vertices at (c, 3) [m]."""
        reach = self.depth + self.skin
        surface = self.kernel.surface
        if self.clipped:
            found = renew_overlaps(
                self.kernel.overlaps, surface, position, self.firsts, reach, self.way,
                self.stop_face,
            )  # fmt: skip
            self.kernel = self.kernel._replace(overlaps=found)
        near = renew_near(
            self.near, surface, position, self.firsts, reach, self.way, self.seams(position)
        )
        self.kernel = self.kernel._replace(near=near)
        self.kernel.start[:] = position

    def seams(self, position: Floats) -> Floats:
        """Where along the width a body begins that is one with its images, (b,) [m]; else NaN."""
        start, side = np.full(len(self.outside), np.nan), self.asked.periodic
        for b, (o, first) in enumerate(zip(self.outside, self.first_vertex, strict=False)):
            if o.joined and side is not None:
                start[b] = position[first + np.flatnonzero(o.own), side.number].min()
        return start

    def shared(self, values: Floats) -> Floats:
        """(c,) for every vertex the sum over all that move with its node."""
        total = np.zeros(self.run.assembly.n_nodes)
        np.add.at(total, self.place, values)
        return np.asarray(total[self.place])

    def describe_deepest(self) -> tuple[str, str]:
        """That a point is too deep, and what to do."""
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
        modulus = pair_stiffness(surface.modulus[surface.point_body[point]], surface.modulus[other])
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
        points = len(surface.point_body)
        stiffness = 2 * held[:points] * surface.modulus[surface.point_body]
        np.add.at(total, surface.point_node, stiffness[:, None] * surface.point_share)
        if self.clipped:
            total += self.overlaps_stiffness(held[points:])
        total = self.shared(total)
        bound = total * self.inverse_mass + self.bound_rigid(total)
        return float(bound.max(initial=0.0))

    def overlaps_stiffness(self, held: Floats) -> Floats:
        """Row sums (c,) [N/m] of the overlaps, and of areas ``held`` (f,) [m^2] by walls."""
        surface, overlaps = self.kernel.surface, self.kernel.overlaps
        total = np.zeros(len(self.nodes))
        at = np.flatnonzero(overlaps.area > 0)
        one, other = surface.modulus[surface.face_body[overlaps.faces[at]]].T
        stiffness = 2 * pair_stiffness(one, other) * overlaps.area[at]
        for side in range(2):
            share = overlaps.share[at, 3 * side : 3 * side + 3]
            np.add.at(total, surface.face[overlaps.faces[at, side]], stiffness[:, None] * share)
        by_wall = 2 * held * surface.modulus[surface.face_body]
        np.add.at(total, surface.face, np.repeat(by_wall[:, None], 3, axis=1))
        return total

    def energy(self) -> tuple[float, float]:
        """Energy in the springs, and work that the sliders took since the start [J]."""
        self.refresh()
        return float(self.kernel.account[0]), float(self.kernel.account[1])

    def plane_force(self, number: int) -> Floats:
        """Force of the bodies on a wall [N], (3,)."""
        self.refresh()
        return np.array(self.kernel.walls.force[number])

    def find_touching_bodies(self) -> tuple[Integers, Integers]:
        """`Contacts.find_touching_bodies`"""
        self.refresh()
        surface, near, overlaps = self.kernel.surface, self.near, self.kernel.overlaps
        at = near.weight > 0
        pairs = [
            np.column_stack([surface.point_body[near.point[at]], near.body[at]]),
            surface.edge_body[near.edges[near.edge_weight > 0]],
            surface.face_body[overlaps.faces[overlaps.area > 0]],
        ]
        owner = np.concatenate([surface.point_body, surface.face_body])
        pressed = (self.kernel.walls.weight > 0).any(axis=0)
        return np.concatenate(pairs), owner[: len(pressed)][pressed]

    def stored(self) -> dict[str, NDArray[Any]]:
        """Everything that the next step reads, to the bit."""
        self.refresh()
        arrays = {f"contact_near_{name}": getattr(self.near, name) for name in self.kept}
        arrays |= {f"contact_{name}": getattr(self.kernel, name) for name in TOUCH_ARRAYS}
        overlaps = self.kernel.overlaps
        arrays |= {f"contact_overlaps_{name}": getattr(overlaps, name) for name in Overlaps._fields}
        return arrays | {
            f"contact_wall_{name}": getattr(self.kernel.walls, name) for name in WALL_ARRAYS
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take what `stored` gave."""
        near = {name: arrays[f"contact_near_{name}"].copy() for name in self.kept}
        overlaps = (arrays[f"contact_overlaps_{name}"].copy() for name in Overlaps._fields)
        self.kernel = self.kernel._replace(
            near=self.near._replace(**near), overlaps=Overlaps(*overlaps)
        )
        for name in TOUCH_ARRAYS:
            getattr(self.kernel, name)[:] = arrays[f"contact_{name}"]
        for name in WALL_ARRAYS:
            getattr(self.kernel.walls, name)[:] = arrays[f"contact_wall_{name}"]
        self.stale = False
