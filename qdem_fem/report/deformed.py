"""Pictures of deformed bodies as PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from qdem_fem.files import Floats
from qdem_fem.grains import find_edge_angles, find_surface_edges
from qdem_fem.report.figures import choose_unit, round_below, write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SHOWN = 0.06
"""Greatest displacement in a picture, over the size of the bodies."""
LIGHT = np.array([-0.25, -0.75, 0.6])
"""Direction the light comes from, in the frame right, away from the viewer, up."""
AZIMUTH, ELEVATION = -62.0, 24.0
"""Where the viewer stands [degrees], as in matplotlib's 3-D axes."""
HEIGHT, WIDTHS, BAR_WIDTH = 4.4, (2.9, 7.7), 1.8
"""Of the picture of bodies, least and greatest width, and what its colour bar takes [in]: a tall
body in a wide frame would stand beside an empty half."""
FEATURE = np.radians(30)
"""Angle between two faces below which their edge is no feature of the shape [rad]."""
OUTLINED = 20
"""Most bodies whose undeformed edges are drawn: of a heap they would hide it."""


def draw_deformed(path: Path, bodies: Sequence[Any], magnification: float | None = None) -> float:
    """Draw the deformed surfaces of all bodies with their von Mises stress; the magnification.

    ``bodies`` are `qdem_fem.Body`.  By default displacements are magnified by a round factor that
    makes the greatest `SHOWN` of the bodies' size.  The undeformed edges of up to `OUTLINED` bodies
    are drawn thin.  Faces are sorted from back to front (painter's algorithm): those that pierce
    each other may be drawn in the wrong order.
    """
    if magnification is None:
        magnification = round_magnification(bodies)
    frame = find_view(AZIMUTH, ELEVATION)
    stress = average_stress(bodies)
    corners = [(b.nodes + magnification * b.displacement)[b.surface] for b in bodies]
    seen = np.concatenate(corners) @ frame.T
    across, _, up = np.ptp(seen.reshape(-1, 3), axis=0)
    wide = float(np.clip(HEIGHT * across / up + BAR_WIDTH, *WIDTHS))
    unit, name = choose_unit(float(stress.max()), "Pa")
    with write_figure(path, (wide, HEIGHT)) as figure:
        panel = figure.subplots()
        _paint(panel, seen, stress / unit, f"von Mises stress ({name})")
        if len(bodies) <= OUTLINED:
            _outline(panel, bodies, frame)
        _draw_frame(panel, frame)
        title = f"Displacement \N{MULTIPLICATION SIGN} {magnification:g}"
        panel.set(aspect="equal", title=title)
        panel.set_axis_off()
        panel.margins(0.03)
        panel.autoscale_view()
        _draw_scale_bar(panel)
    return magnification


def find_view(azimuth: float, elevation: float) -> Floats:
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


def average_stress(bodies: Sequence[Any]) -> Floats:
    """Von Mises stress of the surface faces of all bodies as it is drawn [Pa], (k,): the mean of
    their nodes', and of each node that of its elements."""
    stress = []
    for body in bodies:
        node, count = body.element_nodes.ravel(), len(body.nodes)
        each = np.repeat(body.von_mises(), body.element_nodes.shape[1])
        total = np.bincount(node, each, count)
        nodal = total / np.maximum(np.bincount(node, minlength=count), 1)
        stress.append(nodal[body.surface].mean(axis=1))
    return np.concatenate(stress)


def _paint(panel: Axes, corners: Floats, values: Floats, label: str) -> None:
    """Faces towards the viewer, shaded, from back to front; ``corners`` (k, 3, 3) in the frame,
    colours of ``values`` (k,) from zero to the greatest."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1)[:, None]
    seen = np.flatnonzero(normal[:, 1] < 0)
    scale = Normalize(0.0, values.max() or 1.0)
    colour = colormaps["viridis"](scale(values[seen]))
    light = np.clip(normal[seen] @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    colour[:, :3] *= (0.7 + 0.3 * light)[:, None]
    order = np.argsort(-corners[seen, :, 1].mean(axis=1), kind="stable")
    drawn, colour = list(corners[seen[order]][:, :, [0, 2]]), colour[order]
    panel.add_collection(
        PolyCollection(drawn, facecolors=colour, edgecolors=colour, linewidths=0.25)
    )
    panel.figure.colorbar(
        ScalarMappable(scale, "viridis"), ax=panel, label=label, shrink=0.7, pad=0.02
    )


def _outline(panel: Axes, bodies: Sequence[Any], frame: Floats) -> None:
    """Sharp edges of the undeformed bodies."""
    from matplotlib.collections import LineCollection

    lines = []
    for body in bodies:
        edges = find_surface_edges(body.surface)
        _, angle = find_edge_angles(body.nodes, body.surface, edges)
        lines.append((body.nodes @ frame.T)[edges.nodes[np.abs(angle) > FEATURE]])
    places = np.concatenate(lines)[:, :, [0, 2]]
    panel.add_collection(LineCollection(list(places), colors="#555555", linewidths=0.5))


def _draw_frame(panel: Axes, frame: Floats) -> None:
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


def _draw_scale_bar(panel: Axes) -> None:
    """A bar of a round length of the reference shape."""
    low, high = panel.get_xlim()
    length = round_below((high - low) / 5)
    unit, name = choose_unit(length, "m")
    bottom, top = panel.get_ylim()
    y = bottom - 0.04 * (top - bottom)
    panel.plot([high - length, high], [y, y], color="#333333", lw=1.5, clip_on=False)
    panel.text(
        high - length / 2, y - 0.02 * (top - bottom), f"{length / unit:g} {name}",
        ha="center", va="top", fontsize=8,
    )  # fmt: skip
