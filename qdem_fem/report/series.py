"""The pictures of a run, one beside each VTU file, drawn from these files on one colour scale.

While a run goes on each picture has a scale of its own, as nobody knows yet what is to come; at
the run's end all are drawn again.  So they can be compared, and are the same however often the run
was interrupted.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.files import MeshError, write_bodies_vtu
from qdem_fem.report.deformed import draw_deformed, extent_of, find_bearing_spheres, join_extents
from trackbed.mesh_file import read_mesh_file

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Shown:
    """What a picture asks of a `qdem_fem.Body`, as it was when a file was written."""

    nodes: FloatArray
    """[m], (n, 3)"""
    elements: IntArray
    """(m, 4)"""
    surface: IntArray
    """(k, 3)"""
    displacement: FloatArray
    """[m], (n, 3)"""
    stress: FloatArray
    """[Pa], (m,)"""

    def von_mises(self) -> FloatArray:
        """Of the elements [Pa], (m,)."""
        return self.stress


def draw_fields(
    path: Path, run: Any, bodies: Sequence[Any], magnification: float, time: float
) -> None:
    """Write the VTU file ``path`` of a simulation's bodies at ``time`` [s], with what its picture
    needs beside their fields, and draw that, on a scale of its own."""
    bearing = find_bearing_spheres(run)
    write_bodies_vtu(path, bodies, None if bearing is None else bearing.nodes)
    shown = [
        Shown(body.nodes, body.elements, body.surface, body.displacement, body.von_mises())
        for body in bodies
    ]
    draw_deformed(
        place_picture_beside(path), inside(shown, width_of(run)), magnification=magnification,
        bearing=bearing, time=time,
    )  # fmt: skip


def draw_series(
    run: Any, bodies: Sequence[Any], files: Sequence[tuple[float, Path]], magnification: float
) -> list[Path]:
    """Draw the picture of each VTU file (time [s], path), all on one colour scale; their paths.

    It reaches from zero to the greatest stress that is drawn in any of them, and all have one
    frame, so that what does not move stays where it is.  ``bodies`` of the simulation ``run`` have
    the meshes, files what moves.  A file that is not there any more, or not whole, gets no picture
    and a warning: a run is not lost for it.
    """
    width, whole, extents = width_of(run), [], []
    for when, path in files:
        try:
            extents.append(extent_of(inside(_shown(path, bodies)[0], width), magnification))
            whole.append((when, path))
        except MeshError as error:
            warnings.warn(f"{error.where}: {error.what}; it gets none", stacklevel=2)
    if not whole:
        return []
    series, drawn = join_extents(extents), []
    for when, path in whole:
        shown, bears = _shown(path, bodies)
        drawn.append(place_picture_beside(path))
        draw_deformed(
            drawn[-1], inside(shown, width), magnification=magnification,
            bearing=find_bearing_spheres(run, bears), time=when, series=series,
        )  # fmt: skip
    return drawn


def width_of(run: Any) -> PeriodicWidth | None:
    """Across whose sides bodies of a simulation touch; None where it has none."""
    return None if run.contacts is None else run.contacts.asked.periodic


def inside(bodies: Sequence[Shown], width: PeriodicWidth | None) -> list[Shown]:
    """Bodies as their images within half a periodic width of where the median of all began."""
    if width is None:
        return list(bodies)
    began = np.array([body.nodes.mean(axis=0) for body in bodies])
    moved = np.array([body.displacement.mean(axis=0) for body in bodies])
    away = (began + moved - np.median(began, axis=0))[:, width.number] / width.width
    return [
        replace(body, nodes=body.nodes - images * width.way)
        for body, images in zip(bodies, np.round(away), strict=True)
    ]


def place_picture_beside(path: Path) -> Path:
    """The picture that belongs to a VTU file."""
    return path.with_name(f"picture-{path.stem}.png")


def _shown(path: Path, bodies: Sequence[Any]) -> tuple[list[Shown], npt.NDArray[np.bool_]]:
    """Bodies as a VTU file holds them, and which of all their nodes bore (n,)."""
    mesh = read_mesh_file(path, f"{path}, of which a picture is drawn")
    moved, stress = mesh.point_data["displacement"], mesh.cell_data["von_mises"][0]
    node = np.cumsum([0, *(len(body.nodes) for body in bodies)])
    element = np.cumsum([0, *(len(body.elements) for body in bodies)])
    shown = [
        Shown(
            body.nodes, body.elements, body.surface,
            moved[node[i] : node[i + 1]], stress[element[i] : element[i + 1]],
        )
        for i, body in enumerate(bodies)
    ]  # fmt: skip
    bears = mesh.point_data.get("bears", np.zeros(len(moved)))
    return shown, np.asarray(bears, bool)
