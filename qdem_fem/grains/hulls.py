"""Random grains: a hull of corners, its edges bent outward, stretched along three axes.

The corners lie on the unit sphere, far from one another; each edge of their hull has a node in the
middle, which is lifted from the flat faces (lift 0: a polyhedron of flat faces) towards the sphere
(lift 1).  Lifts set the roundness, the stretch sets the sphericity, and both are solved for.
A stretch is affine and moves no node across a plane of others: what is convex stays convex.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.spatial import ConvexHull

from qdem_fem.files import Floats, Integers, MeshError
from qdem_fem.grains import measures
from qdem_fem.grains.meshing import find_radius_ratios, make_grain_elements, place_apex_and_spokes


@dataclass(frozen=True)
class HullNumbers:
    """Search for a grain of the asked shape."""

    candidates: int = 10  # random points; the farthest from the corners becomes one [-]
    greatest_lift: float = 1.05  # from flat faces, 0, towards the sphere, 1 [-]
    lifts: int = 6  # tried, evenly, before a bracket is halved [-]
    halvings: int = 8  # of the bracket, at most [-]
    greatest_stretch: float = 1.2  # greatest logarithmic one of the longest axis [-]
    roundness_within: float = 0.01  # of the asked one is met [-]: it jumps where a ridge ends
    bent_inward: float = 1e-9  # angle between normals that an edge may be bent inward [rad]
    lowering: float = 0.9  # factor on the lift of a node beside an edge bent inward [-]
    draws: int = 60  # sets of corners for one grain, before its wish is out of reach [-]
    ratio: float = 0.2  # least radius ratio of a tetrahedron [-]: flatter ones are drawn again


HULLS = HullNumbers()


@dataclass(frozen=True)
class GrainRecipe:
    """What random grains are to be like.

    Raises `MeshError` for values that no grain of this kind can have.
    """

    sphericity: float = 0.82  # psi, `find_sphericity` [-]
    sphericity_scatter: float = 0.03
    """Half the width of the uniform distribution of psi over the grains [-]."""
    roundness: float = 0.68  # `find_roundness` [-], about 0.62 to 0.85 at this mesh size
    roundness_scatter: float = 0.03
    corners: tuple[int, int] = (8, 9)
    """Fewest and most corners M; a grain has 8 (2 M - 4) tetrahedra and 5 M - 5 nodes."""

    def __post_init__(self) -> None:
        wrong = [
            f"{name} {mean} +- {spread}"
            for name, mean, spread, least, most in (
                ("sphericity", self.sphericity, self.sphericity_scatter, 0.4, 0.97),
                ("roundness", self.roundness, self.roundness_scatter, 0.3, 1.0),
            )
            if not (spread >= 0 and mean - spread >= least and mean + spread <= most)
        ]
        if not 6 <= self.corners[0] <= self.corners[1] <= 40:
            wrong.append(f"corners {self.corners}")
        if wrong:
            raise MeshError(
                f"no grain has {wrong[0]}", where="grain recipe",
                remedy="use sphericity 0.4 to 0.97, roundness 0.3 to 1, scatters of 0 or more "
                "within them, 6 to 40 corners",
            )  # fmt: skip


@dataclass(frozen=True)
class GrainForm:
    """A grain of no particular size."""

    corner_faces: Integers  # triangles of the hull of the M corners, (2 M - 4, 3), outward
    nodes: Floats
    """M corners, the middle of every edge of `find_surface_edges` of ``corner_faces``, and the
    inner nodes of `place_apex_and_spokes`; centroid at zero, (5 M - 5, 3)."""
    sphericity: float
    roundness: float


def place_corners_apart(generator: np.random.Generator, count: int) -> Floats:
    """Points on the unit sphere (count, 3), each the best of some random ones (Mitchell 1991)."""
    chosen = np.empty((0, 3))
    while len(chosen) < count:
        tries = generator.standard_normal((HULLS.candidates, 3))
        tries /= np.linalg.norm(tries, axis=1)[:, None]
        nearest = (tries @ chosen.T).max(axis=1, initial=-1.0)
        chosen = np.vstack([chosen, tries[np.argmin(nearest)]])
    return chosen


def find_hull_faces(points: Floats) -> Integers:
    """Outward triangles (2 n - 4, 3) of the convex hull of points (n, 3) on a sphere about 0."""
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = points[faces].transpose(1, 0, 2)
    inward = np.einsum("fi,fi->f", a, np.cross(b, c)) < 0
    faces[inward, 1:] = faces[inward, :0:-1]
    return faces


def draw_grain(generator: np.random.Generator, recipe: GrainRecipe) -> GrainForm:
    """One random grain; the same for the same state of ``generator``.

    Corners are drawn again, up to `HULLS.draws` times, where those drawn can not be given the
    sphericity and roundness that were drawn first, or leave a sliver.  Raises `MeshError` if none
    will do.
    """
    psi = recipe.sphericity + recipe.sphericity_scatter * generator.uniform(-1, 1)
    roundness = recipe.roundness + recipe.roundness_scatter * generator.uniform(-1, 1)
    reached: list[float] = []
    for _ in range(HULLS.draws):
        count = int(generator.integers(recipe.corners[0], recipe.corners[1] + 1))
        drawn = _Drawn(generator, count)
        form = drawn.solve(psi, roundness, reached)
        if form is not None:
            return form
    got = f"roundness {min(reached):.2f} to {max(reached):.2f}" if reached else "less sphericity"
    raise MeshError(
        f"none of {HULLS.draws} random grains has sphericity {psi:.3f} and roundness "
        f"{roundness:.3f} without a sliver; reached was {got}", where="grain recipe",
        remedy="ask for a roundness well within that range, more sphericity, or other corners",
    )  # fmt: skip


def make_flat_form(points: Floats) -> GrainForm:
    """The grain of flat faces that is the hull of ``points`` (M, 3), the origin inside it.

    Raises `MeshError` where a point is no corner of the hull, or the mesh would have a sliver.
    """
    corner_faces, count = find_hull_faces(points), len(points)
    if len(corner_faces) != 2 * count - 4 or len(np.unique(corner_faces)) != count:
        raise MeshError(
            f"not each of the {count} points is a corner of their hull", where="grain shape",
            remedy="leave out those inside it, on its edges and on its faces",
        )  # fmt: skip
    edges = measures.find_surface_edges(corner_faces)
    surface = np.vstack([points, points[edges.nodes].mean(axis=1)])
    faces = measures.quarter_faces(corner_faces, edges)
    inner = place_apex_and_spokes(surface, faces, count)
    nodes = np.vstack([surface, inner]) - inner[0]
    worst = find_radius_ratios(nodes, make_grain_elements(nodes, corner_faces)).min()
    if worst < HULLS.ratio:
        raise MeshError(
            f"its flattest tetrahedron has a radius ratio of {worst:.2g}", where="grain shape",
            remedy=f"keep the corners farther apart: {HULLS.ratio:g} is the least",
        )  # fmt: skip
    volume, _ = measures.integrate_polyhedron(nodes, faces)
    psi = measures.find_sphericity(volume, measures.find_surface_area(nodes, faces))
    return GrainForm(corner_faces, nodes, psi, measures.find_roundness(surface, faces))


class _Drawn:
    """Random corners, direction and kind of stretch of one grain; lift and stretch open."""

    def __init__(self, generator: np.random.Generator, count: int) -> None:
        points = place_corners_apart(generator, count)
        self.corner_faces = find_hull_faces(points)
        edges = measures.find_surface_edges(self.corner_faces)
        middles = points[edges.nodes].mean(axis=1)
        self.count = count
        generator.random(len(middles))  # of no use without dents; seeds keep their grains
        self.flat = np.vstack([points, middles])
        self.outward = middles / np.linalg.norm(middles, axis=1)[:, None] - middles
        self.faces = measures.quarter_faces(self.corner_faces, edges)
        self.edges = measures.find_surface_edges(self.faces)
        kind = generator.uniform(-0.5, 1)  # -1/2: a rod, 1: a disc (Zingg 1935)
        self.axes = np.array([1.0, kind, -1.0 - kind])
        self.turn = np.linalg.qr(generator.standard_normal((3, 3)))[0]
        self.turn *= np.sign(np.linalg.det(self.turn))

    def lift_nodes(self, lift: float) -> Floats:
        """Nodes within the unit sphere (n, 3); lifts are lowered until the grain is convex."""
        lifts = np.full(len(self.outward), lift)
        for _ in range(1000):
            nodes = self.flat.copy()
            nodes[self.count :] += lifts[:, None] * self.outward
            _, angle = measures.find_edge_angles(nodes, self.faces, self.edges)
            inward = np.unique(self.edges.opposite[angle < -HULLS.bent_inward])
            inward = inward[inward >= self.count] - self.count
            if not len(inward):
                break
            lifts[inward] *= HULLS.lowering
        return nodes

    def stretch_nodes(self, nodes: Floats, psi: float) -> Floats | None:
        """Nodes of sphericity ``psi``, or None where they have less without any stretch.

        Stretches keep the volume.
        """
        volume, _ = measures.integrate_polyhedron(nodes, self.faces)

        def find_excess(size: float) -> float:
            area = measures.find_surface_area(nodes * np.exp(size * self.axes), self.faces)
            return measures.find_sphericity(volume, area) - psi

        if find_excess(0.0) < 0 or find_excess(HULLS.greatest_stretch) > 0:
            return None
        size = brentq(find_excess, 0.0, HULLS.greatest_stretch, xtol=1e-12)
        return nodes * np.exp(size * self.axes)

    def solve(self, psi: float, roundness: float, reached: list[float]) -> GrainForm | None:
        """The grain of this sphericity and roundness, None if these corners can not have both.

        Lifts are raised until one is too round where the last was too angular, then the two are
        halved.  What roundness was had on the way is noted in ``reached``.
        """

        def try_lift(lift: float) -> tuple[float, Floats]:
            nodes = self.stretch_nodes(self.lift_nodes(lift), psi)
            if nodes is None:
                return np.nan, self.flat
            reached.append(measures.find_roundness(nodes, self.faces, self.edges))
            return reached[-1] - roundness, nodes

        below = np.nan
        for above in np.linspace(0.0, HULLS.greatest_lift, HULLS.lifts).tolist():
            excess, surface = try_lift(above)
            if abs(excess) <= HULLS.roundness_within or (excess > 0 and below >= 0):
                break
            below = above if excess < 0 else np.nan
        else:
            return None
        for _ in range(HULLS.halvings):
            if not abs(excess) > HULLS.roundness_within:  # near enough, or nan
                break
            middle = (below + above) / 2
            excess, surface = try_lift(middle)
            below, above = (middle, above) if excess < 0 else (below, middle)
        if not abs(excess) <= HULLS.roundness_within:
            return None
        turned = surface @ self.turn.T
        inner = place_apex_and_spokes(turned, self.faces, self.count)
        nodes = np.vstack([turned, inner]) - inner[0]
        worst = find_radius_ratios(nodes, make_grain_elements(nodes, self.corner_faces)).min()
        sound = worst >= HULLS.ratio
        return GrainForm(self.corner_faces, nodes, psi, reached[-1]) if sound else None


SHAPE = draw_grain
