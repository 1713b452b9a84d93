"""Pictures of deformed bodies as PNG, and of the spheres by which they bear on one another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from qdem_fem.march import State
from qdem_fem.report.figures import round_below, unit_of, write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes


FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

SHOWN = 0.06
"""Greatest displacement in a picture, over the size of the bodies."""
LIGHT = np.array([-0.25, -0.75, 0.6])
"""Direction the light comes from, in the frame right, away from the viewer, up."""
AZIMUTH, ELEVATION = -62.0, 24.0
"""Where the viewer stands [degrees], as in matplotlib's 3-D axes."""
HEIGHT, WIDTHS, BAR_WIDTH = 4.4, (2.9, 7.7), 1.8
"""Of the picture of bodies, least and greatest width, and what its colour bar takes [in]: a tall
body in a wide frame would stand beside an empty half."""
FEATURE = np.cos(np.radians(30))
"""Cosine of the angle between two faces above which their edge is no feature of the shape."""
OUTLINED = 20
"""Most bodies whose undeformed edges are drawn: of a heap they would hide it."""
SERIES_ROOM = 0.05
"""Around all that moves in a series, over its size: for spheres, too."""
CORNERS_OF_A_DISC = 20
"""Of the polygon that a sphere is drawn as."""
DISC_FACE, DISC_EDGE = (0.80, 0.77, 0.72, 0.55), (0.45, 0.42, 0.38, 0.7)
"""Colours of it, red, green, blue and how opaque."""


class Bearing(NamedTuple):
    """Spheres that bear a force now."""

    nodes: IntArray
    """Their vertices in the numbers of all bodies, (s,)."""
    radius: FloatArray
    """[m], (s,)."""


class Extent(NamedTuple):
    """What is drawn in a picture, or in all of a series."""

    greatest: float
    """Stress of a face of the surface [Pa], seen or hidden."""
    low: FloatArray
    """Least place to the right and up that a deformed or undeformed face reaches [m], (2,)."""
    high: FloatArray
    """Greatest one."""


def find_bearing_spheres(run: State, bears: npt.NDArray[np.bool_] | None = None) -> Bearing | None:
    """Which spheres of a simulation bear, on others or on a wall; None in other contact models.

    ``bears`` (n,): of all nodes, where that is known from before; by default as it is now."""
    contacts: Any = run.contacts
    if contacts is None:
        return None
    from qdem_fem.contact import SphereContacts

    if not isinstance(contacts, SphereContacts):
        return None
    if bears is None:
        contacts.refresh()
        some = np.asarray(contacts.kernel.force).any(axis=1)
    else:
        some = bears[contacts.nodes]
    return Bearing(contacts.nodes[some], contacts.kernel.spheres.radius[some])


def draw_deformed(
    path: Path,
    bodies: Sequence[Any],
    *,
    magnification: float | None = None,
    bearing: Bearing | None = None,
    time: float | None = None,
    series: Extent | None = None,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
) -> float:
    """Draw the deformed surfaces of all bodies with their von Mises stress; the magnification.

    ``bodies`` are `qdem_fem.Body`.  By default displacements are magnified by a round factor that
    makes the greatest `SHOWN` of the bodies' size.  The undeformed edges of up to `OUTLINED` bodies
    are drawn thin.  The viewer stands at ``azimuth`` and ``elevation`` [degrees] as in matplotlib's
    3-D axes.  ``time`` [s] is written where given.  ``bearing``: spheres of contact, drawn around
    their vertices as those are now.  Colours reach from zero to the greatest stress; the colour bar
    says whether that is this picture's or, where ``series`` is given, that of all pictures, which
    then have one frame, too.  Faces are sorted from back to front (painter's algorithm): those that
    pierce each other may be drawn in the wrong order.
    """
    if magnification is None:
        magnification = round_magnification(bodies)
    frame = view_frame(azimuth, elevation)
    stress = faces_stress(bodies)
    seen = faces_corners(bodies, magnification) @ frame.T
    spheres = None
    if bearing is not None:
        moved = [body.nodes + magnification * body.displacement for body in bodies]
        spheres = discs(np.concatenate(moved)[bearing.nodes] @ frame.T, bearing.radius)
    extent = series or Extent(float(stress.max()), *_reach(seen))
    across, up = extent.high - extent.low
    wide = float(np.clip(HEIGHT * across / up + BAR_WIDTH, *WIDTHS))
    unit, name = unit_of(extent.greatest, "Pa")
    whose = "this picture" if series is None else "all pictures of the run"
    label = f"von Mises stress ({name})\nup to the greatest in {whose}"
    with write_figure(path, (wide, HEIGHT)) as figure:
        panel = figure.subplots()
        _paint(panel, seen, stress / unit, extent.greatest / unit, label, spheres)
        if len(bodies) <= OUTLINED:
            _outline(panel, bodies, frame)
        _draw_frame(panel, frame)
        title = f"Displacement \N{MULTIPLICATION SIGN} {magnification:g}"
        title += "" if time is None else f" at t = {time:.6g} s"
        title += "\ngrey: spheres that bear" * (bearing is not None and len(bearing.nodes) > 0)
        panel.set(aspect="equal", title=title)
        panel.set_axis_off()
        panel.margins(0.03)
        panel.autoscale_view()
        if series is not None:
            room = SERIES_ROOM * (series.high - series.low).max()
            (left, bottom), (right, top) = series.low - room, series.high + room
            panel.set(xlim=(left, right), ylim=(bottom, top))
        _scale_bar(panel)
    return magnification


def extent_of(bodies: Sequence[Any], magnification: float) -> Extent:
    """Of a picture of these bodies, seen from `AZIMUTH` and `ELEVATION`."""
    frame = view_frame(AZIMUTH, ELEVATION)
    corners = [faces_corners(bodies, times) @ frame.T for times in (0.0, magnification)]
    return Extent(float(faces_stress(bodies).max()), *_reach(np.concatenate(corners)))


def join_extents(extents: Sequence[Extent]) -> Extent:
    """Of a series of pictures."""
    greatest, low, high = zip(*extents, strict=True)
    return Extent(max(greatest), np.min(low, axis=0), np.max(high, axis=0))


def _reach(seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest place to the right and up (2,) of corners in the frame (k, 3, 3) [m]."""
    places = seen.reshape(-1, 3)[:, [0, 2]]
    return places.min(axis=0), places.max(axis=0)


def view_frame(azimuth: float, elevation: float) -> FloatArray:
    """Rows: right, away from the viewer, up; orthonormal (3, 3)."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    away = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.array([right, away, np.cross(right, away)])


def round_magnification(bodies: Sequence[Any]) -> float:
    """1, 2 or 5 times a power of ten, the greatest that keeps displacements below `SHOWN`."""
    nodes = np.concatenate([body.nodes for body in bodies])
    size = float(np.linalg.norm(nodes.max(axis=0) - nodes.min(axis=0)))
    moved = max(float(np.abs(body.displacement).max(initial=0.0)) for body in bodies)
    if not (moved > 0 and np.isfinite(moved)):
        return 1.0
    return max(1.0, round_below(SHOWN * size / moved))


def nodal_average(elements: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Mean of the values (m,) of each node's elements, (count,); zero for unused nodes."""
    total = np.bincount(elements.ravel(), np.repeat(values, elements.shape[1]), count)
    return np.asarray(total / np.maximum(np.bincount(elements.ravel(), minlength=count), 1))


def faces_corners(bodies: Sequence[Any], magnification: float) -> FloatArray:
    """Corners of the deformed surface faces of all bodies [m], (k, 3, 3)."""
    return np.concatenate(
        [(body.nodes + magnification * body.displacement)[body.surface] for body in bodies]
    )


def faces_stress(bodies: Sequence[Any]) -> FloatArray:
    """Von Mises stress of the surface faces of all bodies as it is drawn [Pa], (k,): the mean of
    their nodes'."""
    stress = []
    for body in bodies:
        nodal = nodal_average(body.elements, body.von_mises(), len(body.nodes))
        stress.append(nodal[body.surface].mean(axis=1))
    return np.concatenate(stress)


def _paint(
    panel: Axes, corners: FloatArray, values: FloatArray, top: float, label: str,
    spheres: tuple[FloatArray, FloatArray] | None,
) -> None:  # fmt: skip
    """Faces towards the viewer, shaded, and spheres as `discs` gives them, from back to front;
    ``corners`` (k, 3, 3) in the frame, colours of ``values`` (k,) from zero to ``top``."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1)[:, None]
    seen = np.flatnonzero(normal[:, 1] < 0)
    scale = Normalize(0.0, top or 1.0)
    colour = colormaps["viridis"](scale(values[seen]))
    light = np.clip(normal[seen] @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    colour[:, :3] *= (0.7 + 0.3 * light)[:, None]
    edge, shapes = colour, list(corners[seen][:, :, [0, 2]])
    away = corners[seen, :, 1].mean(axis=1)
    if spheres is not None:
        shapes += list(spheres[0])
        away = np.concatenate([away, spheres[1]])
        colour, edge = (
            np.concatenate([colour, np.tile(one, (len(spheres[1]), 1))])
            for one in (DISC_FACE, DISC_EDGE)
        )
    order = np.argsort(-away, kind="stable")
    drawn = [shapes[i] for i in order]
    panel.add_collection(
        PolyCollection(drawn, facecolors=colour[order], edgecolors=edge[order], linewidths=0.25)
    )
    panel.figure.colorbar(
        ScalarMappable(scale, "viridis"), ax=panel, label=label, shrink=0.7, pad=0.02
    )


def _outline(panel: Axes, bodies: Sequence[Any], frame: FloatArray) -> None:
    """Sharp edges of the undeformed bodies."""
    from matplotlib.collections import LineCollection

    lines = [(body.nodes @ frame.T)[feature_edges(body.nodes, body.surface)] for body in bodies]
    places = np.concatenate(lines)[:, :, [0, 2]]
    panel.add_collection(LineCollection(list(places), colors="#555555", linewidths=0.5))


def feature_edges(nodes: FloatArray, faces: IntArray) -> IntArray:
    """Edges (e, 2) whose two faces meet at a sharp angle, or that have not two faces."""
    normal = np.cross(
        nodes[faces[:, 1]] - nodes[faces[:, 0]], nodes[faces[:, 2]] - nodes[faces[:, 0]]
    )
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    unique, first, count = np.unique(edges, axis=0, return_index=True, return_counts=True)
    second = np.minimum(first + 1, len(owner) - 1)
    cosine = np.einsum("ij,ij->i", normal[owner[first]], normal[owner[second]])
    return np.asarray(unique[(count != 2) | (cosine < FEATURE)])


def _draw_frame(panel: Axes, frame: FloatArray) -> None:
    """The three axes in the lower left corner, away from the bodies."""
    inset = panel.inset_axes((0.0, 0.0, 0.12, 0.2))
    for axis, letter in enumerate("xyz"):
        right, up = frame[0, axis], frame[2, axis]
        inset.annotate(
            "", (right, up), (0, 0), arrowprops={"arrowstyle": "-|>", "lw": 0.9, "color": "#333333"}
        )
        inset.text(1.3 * right, 1.3 * up, letter, ha="center", va="center", fontsize=8)
    inset.set(xlim=(-1.4, 1.4), ylim=(-1.4, 1.4), aspect="equal")
    inset.set_axis_off()


def _scale_bar(panel: Axes) -> None:
    """A bar of a round length of the reference shape."""
    low, high = panel.get_xlim()
    length = round_below((high - low) / 5)
    unit, name = unit_of(length, "m")
    bottom, top = panel.get_ylim()
    y = bottom - 0.04 * (top - bottom)
    panel.plot([high - length, high], [y, y], color="#333333", lw=1.5, clip_on=False)
    panel.text(
        high - length / 2, y - 0.02 * (top - bottom), f"{length / unit:g} {name}",
        ha="center", va="top", fontsize=8,
    )  # fmt: skip


def discs(centre: FloatArray, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Outlines of spheres as the viewer sees them, and where in the row of faces they belong.

    ``centre`` (s, 3) [m] in the frame right, away from the viewer, up; ``radius`` (s,) [m].
    Polygons (s, `CORNERS_OF_A_DISC`, 2) [m], and the distance of the spheres' far sides (s,) [m]:
    drawn by that, a sphere lies behind the faces at its own vertex and before bodies behind it.
    """
    turn = 2 * np.pi * np.arange(CORNERS_OF_A_DISC) / CORNERS_OF_A_DISC
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    return centre[:, None, [0, 2]] + radius[:, None, None] * circle, centre[:, 1] + radius
