"""Pictures of a run: bodies with force chains, histories, a movie of the frames."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.contact import ContactForces
from rigid_lcp.motion import Motion, Scene
from rigid_lcp.shapes import HalfSpace, make_rotation

STONE, EDGE, FIXED = "#e9e4da", "#8a8174", "#c9ced6"
STICK, SLIDE = "#0b5fa5", "#d1495b"
FORCE_LINE_WIDTH = 7.0
"""Line width of the largest normal force [points]."""


def find_window(scene: Scene, positions: list[Floats]) -> tuple[Floats, Floats]:
    """Corners of the box that holds all bodies in all of these states [m], (dim,) each."""
    reach = np.array([min(body.shape.reach, 1e30) for body in scene.bodies])
    shown = np.array([not isinstance(body.shape, HalfSpace) for body in scene.bodies])
    stacked = np.array(positions)[:, shown]
    low = (stacked - reach[shown, None]).min(axis=(0, 1))
    high = (stacked + reach[shown, None]).max(axis=(0, 1))
    return low, high


def draw_chains(
    axes: Any, scene: Scene, motion: Motion, contacts: ContactForces, scale: float,
    plane: tuple[int, int],
) -> None:  # fmt: skip
    """Lines from the bodies' centres to their contacts, as wide as the normal force.

    ``scale`` [N]: force of the widest line, also of contacts that carry more; ``plane``: the two
    axes that are drawn.  Blue sticks, red slides (`draw_chain_legend`).  Floors and walls have no
    centre: there the line ends at the contact.
    """
    from matplotlib.collections import LineCollection

    lines, widths, colours = [], [], []
    place = motion.position[:, plane]
    shown = contacts.normal_force > 1e-3 * scale
    for c in np.flatnonzero(shown):
        point = contacts.point[c, plane]
        for body in (contacts.body_a[c], contacts.body_b[c]):
            if not isinstance(scene.bodies[body].shape, HalfSpace):
                lines.append([place[body], point])
                widths.append(FORCE_LINE_WIDTH * min(contacts.normal_force[c] / scale, 1.0))
                colours.append(SLIDE if contacts.status[c] == "slide" else STICK)
    axes.add_collection(
        LineCollection(lines, linewidths=widths, colors=colours, capstyle="round", alpha=0.85)
    )


def draw_chain_legend(axes: Any, scale: float, unit: str) -> None:
    """What lines of force chains mean: colours, and the widths of ``scale`` and a quarter of it."""
    from matplotlib.lines import Line2D

    most, less = (f"{f:,.0f}" if f >= 100 else f"{f:.3g}" for f in (scale, scale / 4))
    signs = [
        (STICK, FORCE_LINE_WIDTH / 2, "sticks"),
        (SLIDE, FORCE_LINE_WIDTH / 2, "slides"),
        ("#666666", FORCE_LINE_WIDTH, f"{most} {unit} or more"),
        ("#666666", FORCE_LINE_WIDTH / 4, f"{less} {unit}"),
    ]
    axes.legend(
        [Line2D([], [], color=colour, linewidth=width) for colour, width, _ in signs],
        [name for *_, name in signs],
        fontsize=8, loc="upper right", framealpha=0.9, title="normal force", title_fontsize=8,
    )  # fmt: skip


def draw_bodies(axes: Any, scene: Scene, motion: Motion, plane: tuple[int, int]) -> None:
    """All bodies where they are, in space from the side, the nearest drawn last; half-spaces of the
    plane as their faces."""
    from matplotlib.patches import Circle
    from matplotlib.patches import Polygon as Patch
    from scipy.spatial import ConvexHull

    order = range(len(scene.bodies)) if scene.dim == 2 else np.argsort(-motion.position[:, 1])
    for n in order:
        shape, position = scene.bodies[n].shape, motion.position[n]
        look: Any = {"fc": STONE if scene.bodies[n].movable else FIXED, "ec": EDGE, "lw": 0.7}
        if isinstance(shape, HalfSpace):
            if scene.dim == 2:
                face, (x, y) = shape.normal * shape.offset, shape.normal
                axes.axline(tuple(face), (face[0] - y, face[1] + x), color=EDGE, linewidth=1.5)
        elif not hasattr(shape, "vertices"):
            axes.add_patch(Circle(tuple(position[list(plane)]), shape.reach, **look))
        else:
            placed = position + shape.vertices @ make_rotation(np.atleast_1d(motion.angle[n])).T
            seen = placed[:, plane]
            axes.add_patch(Patch(seen[ConvexHull(seen).vertices], closed=True, **look))


def draw_state(
    scene: Scene, motion: Motion, contacts: ContactForces, window: tuple[Floats, Floats],
    scale: float, title: str,
) -> Any:  # fmt: skip
    """A matplotlib figure of one state with its force chains; the caller saves it."""
    from matplotlib.figure import Figure

    plane = (0, 1) if scene.dim == 2 else (0, 2)
    low, high = (corner[list(plane)] for corner in window)
    size = np.maximum(high - low, 1e-12)
    low, high = low - 0.05 * size.max(), high + 0.05 * size.max()
    width = 7.0
    height = float(np.clip(width * (high - low)[1] / (high - low)[0], 2.5, 9.0))
    figure = Figure(figsize=(width, height + 0.4), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    draw_bodies(axes, scene, motion, plane)
    draw_chains(axes, scene, motion, contacts, scale, plane)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_title(title, fontsize=10, loc="left")
    axes.set(xlabel="x [m]", ylabel="y [m]" if scene.dim == 2 else "z [m]")
    draw_chain_legend(axes, scale, "N/m" if scene.dim == 2 else "N")
    return figure


def choose_scale(forces: list[Floats]) -> float:
    """Normal force of the widest line [N] for all these states: in three of four none is larger.

    An impact carries a hundred times what a pile at rest does, and would leave it without lines.
    """
    largest = [float(np.quantile(each[each > 0], 0.995)) for each in forces if (each > 0).any()]
    return float(np.quantile(largest, 0.75)) if largest else 1.0


def draw_history(history: dict[str, Floats]) -> Any:
    """A figure of energy, greatest overlap and number of contacts against time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.6), dpi=110, layout="constrained")
    rows = figure.subplots(3, 1, sharex=True)
    labels = {"energy": "energy [J]", "contacts": "contacts that carry", "overlap": "overlap [m]"}
    for axes, (name, label) in zip(rows, labels.items(), strict=True):
        axes.plot(history["time"], history[name], color=STICK, marker=".", markersize=4)
        axes.set_ylabel(label, fontsize=8)
        axes.grid(alpha=0.3)
    rows[-1].set_xlabel("time [s]")
    return figure


def encode_movie(pictures: Sequence[Path]) -> bytes:
    """PNG pictures of equal size put together as an animated GIF."""
    from PIL import Image

    adaptive = Image.Palette.ADAPTIVE
    first, *others = (Image.open(path).convert("P", palette=adaptive) for path in pictures)
    movie = BytesIO()
    first.save(movie, format="GIF", save_all=True, append_images=others, duration=120, loop=0)
    return movie.getvalue()
