"""Pictures of a run as PNG, without a display: deformed bodies, histories, spectra, energies.

matplotlib is loaded when a picture is drawn.  Fields come in SI units and are shown in the
multiple (um, mm; kPa, MPa) that leaves few digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from qdem_fem.spectra import Mode, amplitude_spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Curve = tuple[FloatArray, FloatArray]
"""Times [s] and values."""

OURS, RIVAL = "#0b5fa5", "#e07b00"
COLOURS = (OURS, "#2a9d6f", "#7a4fa3", "#b02020", "#6b6b6b", "#00838f")
SHOWN = 0.06
"""Greatest displacement in a picture, over the size of the bodies."""
LIGHT = np.array([-0.25, -0.75, 0.6])
"""Direction the light comes from, in the frame right, away from the viewer, up."""
HEIGHT, WIDTHS, BAR_WIDTH = 4.4, (2.8, 7.6), 1.6
"""Of the picture of bodies, least and greatest width, and what its colour bar takes [in]: a tall
body in a wide frame would stand beside an empty half."""
FEATURE = np.cos(np.radians(30))
"""Cosine of the angle between two faces above which their edge is no feature of the shape."""
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
STYLE: Any = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.8,
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "savefig.dpi": 170,
    "figure.constrained_layout.use": True,
}


def picture_deformed(
    path: Path,
    bodies: Sequence[Any],
    *,
    magnification: float | None = None,
    azimuth: float = -62.0,
    elevation: float = 24.0,
) -> float:
    """Draw the deformed surfaces of all bodies with their von Mises stress; the magnification.

    ``bodies`` are `qdem_fem.Body`.  By default displacements are magnified by a round factor that
    makes the greatest `SHOWN` of the bodies' size.  The undeformed edges are drawn thin.  The
    viewer stands at ``azimuth`` and ``elevation`` [degrees] as in matplotlib's 3-D axes.
    Faces are sorted from back to front (painter's algorithm): those that pierce each other may
    be drawn in the wrong order.
    """
    if magnification is None:
        magnification = magnification_round(bodies)
    frame = view_frame(azimuth, elevation)
    corners, stress = _faces(bodies, magnification)
    seen = corners @ frame.T
    across, _, up = np.ptp(seen.reshape(-1, 3), axis=0)
    wide = float(np.clip(HEIGHT * across / up + BAR_WIDTH, *WIDTHS))
    unit, name = unit_of(float(stress.max(initial=0.0)), "Pa")
    with _figure(path, (wide, HEIGHT)) as figure:
        panel = figure.subplots()
        _paint(panel, seen, stress / unit, f"von Mises stress ({name})")
        _outline(panel, bodies, frame)
        _frame_draw(panel, frame)
        panel.set(aspect="equal", title=f"Displacement \N{MULTIPLICATION SIGN} {magnification:g}")
        panel.set_axis_off()
        panel.margins(0.03)
        panel.autoscale_view()
        _scale_bar(panel)
    return magnification


def view_frame(azimuth: float, elevation: float) -> FloatArray:
    """Rows: right, away from the viewer, up; orthonormal (3, 3)."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    away = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.array([right, away, np.cross(right, away)])


def magnification_round(bodies: Sequence[Any]) -> float:
    """1, 2 or 5 times a power of ten, the greatest that keeps displacements below `SHOWN`."""
    nodes = np.concatenate([body.nodes for body in bodies])
    size = float(np.linalg.norm(nodes.max(axis=0) - nodes.min(axis=0)))
    moved = max(float(np.abs(body.displacement).max(initial=0.0)) for body in bodies)
    if not (moved > 0 and np.isfinite(moved)):
        return 1.0
    return max(1.0, _round_below(SHOWN * size / moved))


def nodal_average(elements: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Mean of the values (m,) of each node's elements, (count,); zero for unused nodes."""
    total = np.bincount(elements.ravel(), np.repeat(values, elements.shape[1]), count)
    return np.asarray(total / np.maximum(np.bincount(elements.ravel(), minlength=count), 1))


def _faces(bodies: Sequence[Any], magnification: float) -> tuple[FloatArray, FloatArray]:
    """Corners (k, 3, 3) [m] of the deformed surface faces and their stress (k,) [Pa]."""
    corners, stress = [], []
    for body in bodies:
        position = body.nodes + magnification * body.displacement
        corners.append(position[body.surface])
        nodal = nodal_average(body.elements, body.von_mises(), len(body.nodes))
        stress.append(nodal[body.surface].mean(axis=1))
    return np.concatenate(corners), np.concatenate(stress)


def _paint(panel: Axes, corners: FloatArray, values: FloatArray, label: str) -> None:
    """Faces towards the viewer, shaded, from back to front; ``corners`` (k, 3, 3) in the frame."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1)[:, None]
    seen = np.flatnonzero(normal[:, 1] < 0)
    order = seen[np.argsort(-corners[seen, :, 1].mean(axis=1), kind="stable")]
    scale = Normalize(0.0, float(values.max(initial=0.0)) or 1.0)
    colour = colormaps["viridis"](scale(values[order]))
    light = np.clip(normal[order] @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    colour[:, :3] *= (0.7 + 0.3 * light)[:, None]
    faces = PolyCollection(
        list(corners[order][:, :, [0, 2]]), facecolors=colour, edgecolors=colour, linewidths=0.25
    )
    panel.add_collection(faces)
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


def _frame_draw(panel: Axes, frame: FloatArray) -> None:
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
    length = _round_below((high - low) / 5)
    unit, name = unit_of(length, "m")
    bottom, top = panel.get_ylim()
    y = bottom - 0.04 * (top - bottom)
    panel.plot([high - length, high], [y, y], color="#333333", lw=1.5, clip_on=False)
    panel.text(
        high - length / 2, y - 0.02 * (top - bottom), f"{length / unit:g} {name}",
        ha="center", va="top", fontsize=8,
    )  # fmt: skip


def picture_history(
    path: Path,
    curves: Mapping[str, Curve],
    *,
    quantity: str = "displacement",
    unit: str = "m",
    rivals: Mapping[str, Curve] | None = None,
    against: str = "time (s)",
    logarithmic: bool = False,
) -> None:
    """Draw histories by name against time, or spectra; ``rivals`` dashed, on top, to compare with.

    ``against``: what the first of each curve's arrays is; ``logarithmic``: of the values."""
    every = [values for _, values in (*curves.values(), *(rivals or {}).values())]
    scale, name = unit_of(max(float(np.nanmax(np.abs(v), initial=0.0)) for v in every), unit)
    with _figure(path, (7.2, 3.2)) as figure:
        panel = figure.subplots()
        for (label, (time, values)), colour in zip(curves.items(), _colours(), strict=False):
            panel.plot(time, values / scale, color=colour, label=label)
        for label, (time, values) in (rivals or {}).items():
            panel.plot(time, values / scale, color=RIVAL, ls="--", lw=1.1, label=label)
        panel.set(xlabel=against, ylabel=f"{quantity} ({name})")
        if logarithmic:
            panel.set_yscale("log")
        panel.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)


def picture_spectrum(
    path: Path,
    curves: Mapping[str, Curve],
    modes: Iterable[Mode] = (),
    *,
    quantity: str = "displacement",
    unit: str = "m",
) -> None:
    """Draw the amplitude spectra (Hann) of records, and lines at the frequencies of modes."""
    modes = list(modes)
    with _figure(path, (7.2, 3.2)) as figure:
        panel = figure.subplots()
        highest = 0.0
        for (label, (time, values)), colour in zip(curves.items(), _colours(), strict=False):
            frequency, amplitude = amplitude_spectrum(time, values)
            panel.plot(frequency[1:], amplitude[1:], color=colour, label=label)
            highest = max(highest, float(frequency[-1]))
        for mode in modes:
            panel.axvline(mode.frequency, color="#888888", lw=0.8, ls=":")
            panel.text(
                mode.frequency, 1.01, f"{mode.frequency:.4g} Hz", fontsize=8, ha="center",
                va="bottom", rotation=35, transform=panel.get_xaxis_transform(),
            )  # fmt: skip
        shown = max((mode.frequency for mode in modes), default=highest / 4)
        panel.set(xlim=(0, min(2 * shown, highest)), yscale="log")
        top = max(float(np.max(line.get_ydata())) for line in panel.lines[: len(curves)])
        if top > 0:
            panel.set_ylim(1e-7 * top, 3 * top)
        panel.set(xlabel="frequency (Hz)", ylabel=f"amplitude of {quantity} ({unit})")
        panel.legend(loc="upper right")


def picture_energy(path: Path, energy: Mapping[str, FloatArray]) -> None:
    """Draw the energies [J] of a run against ``energy["time"]``."""
    time = energy["time"]
    names = [name for name in energy if name != "time"]
    scale, unit = unit_of(max(float(np.abs(energy[n]).max(initial=0.0)) for n in names), "J")
    with _figure(path, (7.2, 2.8)) as figure:
        panel = figure.subplots()
        for name, colour in zip(names, _colours(), strict=False):
            panel.plot(time, energy[name] / scale, color=colour, label=name)
        total = (energy["kinetic"] + energy["elastic"]) / scale
        panel.plot(time, total, color="#111111", lw=0.9, ls="--", label="kinetic + elastic")
        panel.set(xlabel="time (s)", ylabel=f"energy ({unit})")
        panel.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)


def unit_of(greatest: float, unit: str) -> tuple[float, str]:
    """SI multiple in which a quantity is shown: its size, and its name such as ``kPa``."""
    for size, prefix in PREFIXES:
        if greatest >= size:
            return size, prefix + unit
    return (1.0, unit) if greatest == 0 else (PREFIXES[-1][0], PREFIXES[-1][1] + unit)


def _round_below(value: float) -> float:
    """The greatest of 1, 2, 5 times a power of ten that is not above ``value``."""
    power = 10.0 ** floor(log10(value))
    return float(max(digit for digit in (1, 2, 5) if digit * power <= value * (1 + 1e-9)) * power)


def _colours() -> Iterator[str]:
    while True:
        yield from COLOURS


@contextmanager
def _figure(path: Path, size: tuple[float, float]) -> Iterator[Figure]:
    """A figure that is written to ``path``, atomically, at the end."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size)
        yield figure
        temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
        figure.savefig(temporary, metadata={"Software": None})
    temporary.replace(path)
