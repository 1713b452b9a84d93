"""Grains and contacts as VTU series: what ParaView opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.export.fields import Array, gather_contacts, gather_grains, list_contacts
from adapters.export.instants import ExportedRun
from trackbed.run_files import replace_file, write_pvd


def export_vtu(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``grains.pvd`` and ``contacts.pvd``, series over the cycles, and their files in ``vtu/``.

    Grains are points with `gather_grains`; contacts are lines from centre to centre with
    `gather_contacts`.
    """
    (into / "vtu").mkdir(exist_ok=True)
    grains, contacts = [], []
    for instant in run.instants(every):
        grains.append((instant.cycle, f"vtu/grains_{instant.cycle:06d}.vtu"))
        contacts.append((instant.cycle, f"vtu/contacts_{instant.cycle:06d}.vtu"))
        centres = instant.state.position
        points = np.arange(len(centres))[:, None]
        of_grains = gather_grains(run, instant)
        write_mesh(into / grains[-1][1], centres, "vertex", points, point_data=of_grains)
        of_contacts = gather_contacts(run, instant)
        lines = list_contacts(instant)
        write_mesh(into / contacts[-1][1], centres, "line", lines, cell_data=of_contacts)
    write_pvd(into / "grains.pvd", grains)
    write_pvd(into / "contacts.pvd", contacts)
    files = [into / name for _, name in (*grains, *contacts)]
    return [into / "grains.pvd", into / "contacts.pvd", *files]


def write_mesh(
    path: Path, points: FloatArray, kind: str, cells: IntArray,
    point_data: Mapping[str, Array] | None = None, cell_data: Mapping[str, Array] | None = None,
) -> None:  # fmt: skip
    """Write points [m], shape (n, 3), and cells of one kind by meshio, binary and not packed."""
    import meshio

    of_cells = {name: [values] for name, values in (cell_data or {}).items()}
    mesh = meshio.Mesh(points, [(kind, cells)], dict(point_data or {}), of_cells)
    with replace_file(path) as temporary:
        mesh.write(temporary, file_format="vtu", compression=None)
