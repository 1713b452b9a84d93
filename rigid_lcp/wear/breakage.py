"""Breakage in a run: grains whose contact forces pull them apart are split, and the run goes on.

Every so many steps each polygon (polyhedron) that moves is judged; what is above its strength is
split (`rigid_lcp.wear.fragmentation`) along the line, or in 3D by a plane through it, that joins
its greatest pair of opposite forces.

Forces are the means over the last step.  In an impact they grow as 1 / h: with breakage, h is the
duration of impacts.  Where forces are not unique they are those that the solver found, and boxes
on each other may carry friction that squeezes them sideways; ``unique`` takes those of elastic
contacts (section 8) instead, for piles at rest or in slow motion.

A disc of diameter D and thickness t pressed by P across a diameter is pulled apart at its centre
by ``2 P / (pi D t)`` (Hertz; the Brazilian test: Carneiro 1943, ISRM 1978, ASTM D3967).  For a
disc under any radial forces in balance, Flamant's solution for each force and a uniform tension
give the stress at the centre,

    S = sum_i P_i [I / (2 pi R t) - 2 n_i n_i^T / (pi R t)] = 2 s - tr(s) I / 2,
    s = 1 / V sum_i f_i l_i^T                   (mean stress of the grain; Weber 1966)

so that the greatest tension is ``(3 s_1 - s_2) / 2`` of the principal mean stresses
``s_1 >= s_2`` (tension positive).  It is used here for polygons too, as the Brazilian strength
of a grain of the same mean stress; that is a criterion, not the stress field of the polygon, and
for tangential forces it is no more than that for discs either.
In 3D: ``F / d^2`` of the greatest pair of opposite forces (Jaeger, Int. J. Rock Mech. Min. Sci. 4
(1967) 219; the usual measure of the strength of ballast stones).
"""

from contextlib import suppress
from dataclasses import dataclass
from sys import float_info

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.motion import Body, Motion, Scene, require_number_in, require_whole_in
from rigid_lcp.shapes import make_rotation
from rigid_lcp.wear.cuts import find_volume
from rigid_lcp.wear.fragmentation import split_body

MOST_PARTS = 100
"""Of a grain of the start, on average [-], beyond which grains break without end: without a size
effect parts under the stress that broke the whole break as well, and their number doubles."""


@dataclass(frozen=True)
class Break:
    """Where a grain shall be split, and why."""

    point: Floats  # a point of the line or plane: in the middle between the two forces, (dim,) [m]
    direction: Floats  # unit vector along the line between the two forces, (dim,)
    tension: float  # [Pa]
    strength: float  # [Pa]


def find_mean_stress(points: Floats, forces: Floats, centre: Floats, volume: float) -> Floats:
    """Mean stress of a grain, symmetric part, (dim, dim) [Pa], tension positive.

    ``points`` (n, dim) [m] and ``forces`` (n, dim) [N] on the grain; ``centre`` of mass (dim,);
    ``volume`` [m^3], in 2D area times thickness.
    """
    stress = forces.T @ (points - centre) / volume
    return np.asarray((stress + stress.T) / 2)


def find_tension(stress: Floats) -> float:
    """Greatest tension [Pa] at the centre of a disc with mean ``stress`` (2, 2), see the module.

    Negative where even that is compression.
    """
    least, most = np.linalg.eigvalsh(stress)
    return float((3 * most - least) / 2)


def find_opposite_pair(points: Floats, forces: Floats) -> tuple[int, int, float] | None:
    """The two contacts that squeeze the grain most between them, and by how much [N].

    The squeeze of a pair is the lesser of the two forces' components along the line that joins
    them, towards each other.  None where no pair squeezes.
    """
    apart = points - points[:, None]  # from i to j
    distance = np.linalg.norm(apart, axis=2)
    towards = np.einsum("id,ijd->ij", forces, apart)
    squeeze = np.minimum(towards, towards.T) / np.where(distance > 0, distance, np.inf)
    if not squeeze.max(initial=0.0) > 0:
        return None
    i, j = divmod(int(squeeze.argmax()), len(points))
    return i, j, float(squeeze[i, j])


def find_splitting_line(
    points: Floats, forces: Floats, centre: Floats, volume: float, strength: float
) -> Break | None:
    """Whether a grain breaks under its contact forces, and along which line; None if it holds.

    ``points`` (n, dim) [m], ``forces`` (n, dim) [N] on the grain, ``centre`` (dim,) [m],
    ``volume`` [m^3] (2D: area times thickness), ``strength`` [Pa]: Brazilian in 2D, point load in
    3D.  The crack runs through the greatest pair of opposite forces; in 3D, where a line does not
    fix a plane, the plane through it is the caller's choice.
    """
    pair = find_opposite_pair(points, forces)
    if pair is None:
        return None
    i, j, squeeze = pair
    apart = points[j] - points[i]
    distance = float(np.linalg.norm(apart))
    if points.shape[1] == 2:
        tension = find_tension(find_mean_stress(points, forces, centre, volume))
    else:
        tension = squeeze / distance**2
    if tension < strength:
        return None
    return Break((points[i] + points[j]) / 2, apart / distance, tension, strength)


@dataclass(frozen=True)
class Breakage:
    """When grains break in a run."""

    strength: float
    """Tension that breaks a grain [Pa] (2D: per metre of depth), Brazilian in 2D, point load in
    3D; with ``modulus`` that of a grain of ``reference_volume``."""
    every: int = 20
    """Steps between judgements."""
    smallest: float = 0.0
    """Volume (2D: area) below which grains do not break [m^3, m^2]; with zero a run ends with a
    `SceneError` where grains have more than `MOST_PARTS`."""
    modulus: float | None = None
    """Weibull's modulus m of the size effect [-], 2 to 4 for ballast; None: none."""
    reference_volume: float | None = None
    """[m^3, m^2]"""
    unique: bool = False
    """Judge by the forces of elastic contacts (`rigid_lcp.unique`), impacts left out."""

    def __post_init__(self) -> None:
        for value, what in (
            (self.strength, "strength"),
            (self.modulus, "modulus"),
            (self.reference_volume, "reference_volume"),
        ):
            if value is not None or what == "strength":
                remedy = f"give a {what} above zero"
                require_number_in(value, 0.0, float_info.max, what, "breakage", remedy, above=True)
        steps, volume = "give 1 or more steps between judgements", "give a volume, or zero"
        require_whole_in(self.every, 1, "every", "breakage", steps)
        require_number_in(self.smallest, 0.0, np.inf, "smallest", "breakage", volume)
        if (self.modulus is None) != (self.reference_volume is None):
            raise ShapeError(
                "a size effect needs both modulus and reference_volume", where="breakage",
                remedy="give both or neither",
            )  # fmt: skip

    def draw_strength(self, volume: float) -> float:
        """Tension [Pa] that 37 % (1 / e) of the grains of ``volume`` [m^3, m^2] survive.

        The chance to survive a tension S in a volume V is ``exp(-(V / V0) (S / S0)^m)`` (Weibull
        1951; for grains McDowell and Bolton, Geotechnique 48 (1998) 667).
        """
        if self.modulus is None or self.reference_volume is None:
            return self.strength
        return float(self.strength * (self.reference_volume / volume) ** (1 / self.modulus))


@dataclass(frozen=True)
class Broken:
    """A grain that broke in a run."""

    time: float  # [s]
    body: int  # number of the whole, and of its first part
    part: int  # number of the second part
    tension: float  # [Pa]
    strength: float  # [Pa]


def gather_forces(contacts: ContactForces, body: int) -> tuple[Floats, Floats]:
    """Points (k, dim) [m] and forces (k, dim) [N] of the contacts of a body that carry."""
    carries = contacts.normal_force > 0
    as_a, as_b = carries & (contacts.body_a == body), carries & (contacts.body_b == body)
    force = contacts.force
    return (
        np.vstack([contacts.point[as_a], contacts.point[as_b]]),
        np.vstack([force[as_a], -force[as_b]]),
    )


def find_breaks(
    scene: Scene, motion: Motion, contacts: ContactForces, breakage: Breakage
) -> list[tuple[int, Break]]:
    """The grains that break under their contact forces, and where, by their number."""
    found = []
    carries = contacts.normal_force > 0
    touched = np.bincount(
        np.concatenate([contacts.body_a[carries], contacts.body_b[carries]]),
        minlength=len(scene.bodies),
    )
    for k in np.flatnonzero(touched >= 2):
        body = scene.bodies[k]
        if not body.movable or not hasattr(body.shape, "vertices"):
            continue
        volume = find_volume(body.shape)
        if volume < breakage.smallest:
            continue
        points, forces = gather_forces(contacts, int(k))
        strength = breakage.draw_strength(volume)
        line = find_splitting_line(points, forces, motion.position[k], volume, strength)
        if line is not None:
            found.append((int(k), line))
    return found


def refuse_dust(breakage: Breakage, movable: int, broken: int, time: float) -> None:
    """Raise `SceneError` where ``broken`` breaks have made ``movable`` grains, too many of each,
    at a ``time`` [s], and no smallest volume will end it."""
    whole = movable - broken
    if breakage.smallest == 0.0 and movable > MOST_PARTS * whole:
        raise SceneError(
            f"{whole} grains have broken into {movable} parts, which go on to break",
            where=f"breakage at {time:.6g} s",
            remedy="give a smallest volume that breaks, or a greater strength",
        )


def break_scene(scene: Scene, motion: Motion, body: int, line: Break) -> Scene | None:
    """The scene at ``motion`` with one grain broken; None where no cut leaves two sound parts.

    A cut that would leave a sliver goes, parallel to itself, through the centre of mass.
    """
    direction = line.direction
    if scene.dim == 3:  # the plane holds the line and, as far as it can, the least inertia's axis
        direction = find_plane_normal(scene.bodies[body], motion.angle[body], direction)
    for point in (line.point, motion.position[body]):
        with suppress(ShapeError):
            return split_body(scene, motion, body, point, direction)
    return None


def find_plane_normal(body: Body, quaternion: Floats, along: Floats) -> Floats:
    """Normal of the plane through the line: across it, along the longest axis left (3D)."""
    arms = body.shape.vertices @ make_rotation(quaternion).T
    across = arms - np.outer(arms @ along, along)
    _, vectors = np.linalg.eigh(across.T @ across)
    normal = vectors[:, -1] - (vectors[:, -1] @ along) * along
    return np.asarray(normal / np.linalg.norm(normal))
