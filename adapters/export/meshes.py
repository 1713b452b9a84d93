"""Grains and contacts as VTU series, walls and piston as STL: what ParaView opens."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.export.fields import Array, contact_rows, gather_contact_fields, gather_grain_fields
from adapters.export.instants import ExportedRun, Instant
from adapters.export.walls import triangulate_container, triangulate_piston
from trackbed.run_files import write_whole


def export_vtu(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``grains.pvd`` and ``contacts.pvd``, series over the cycles, and their files in ``vtu/``.

    Grains are points with `gather_grain_fields`; contacts are lines from centre to centre with
    `gather_contact_fields`.
    """
    folder = into / "vtu"
    folder.mkdir(exist_ok=True)
    grains, contacts = [], []
    for instant in run.instants(every):
        grains.append((instant.cycle, folder / f"grains_{instant.cycle:06d}.vtu"))
        contacts.append((instant.cycle, folder / f"contacts_{instant.cycle:06d}.vtu"))
        write_vtu_grains(run, instant, grains[-1][1])
        write_vtu_contacts(run, instant, contacts[-1][1])
    write_pvd(into / "grains.pvd", grains)
    write_pvd(into / "contacts.pvd", contacts)
    files = [path for _, path in (*grains, *contacts)]
    return [into / "grains.pvd", into / "contacts.pvd", *files]


def write_vtu_grains(run: ExportedRun, instant: Instant, path: Path) -> None:
    """Grains of one instant as points."""
    points = instant.state.position
    cells = np.arange(len(points))[:, None]
    write_mesh(path, points, "vertex", cells, point_data=gather_grain_fields(run, instant))


def write_vtu_contacts(run: ExportedRun, instant: Instant, path: Path) -> None:
    """Contacts of one instant as lines between the centres of grains."""
    points, cells = instant.state.position, contact_rows(instant)
    write_mesh(path, points, "line", cells, cell_data=gather_contact_fields(run, instant))


def write_mesh(
    path: Path,
    points: FloatArray,
    kind: str,
    cells: IntArray,
    point_data: Mapping[str, Array] | None = None,
    cell_data: Mapping[str, Array] | None = None,
) -> None:
    """Write points [m], shape (n, 3), and cells of one kind by meshio, binary and not packed."""
    import meshio

    of_cells = {name: [values] for name, values in (cell_data or {}).items()}
    mesh = meshio.Mesh(points, [(kind, cells)], dict(point_data or {}), of_cells)
    with whole_file(path) as temporary:
        mesh.write(temporary, file_format="vtu", compression=None)


def write_pvd(path: Path, members: Sequence[tuple[int, Path]]) -> None:
    """Write a series for ParaView; its time is the number of load cycles."""
    lines = [
        f'<DataSet timestep="{cycle}" file={quoteattr(str(file.relative_to(path.parent)))}/>'
        for cycle, file in members
    ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
    write_whole(path, head + "\n".join(lines) + "\n</Collection>\n</VTKFile>\n")


def export_stl(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``container.stl``, and the piston's face at every instant: ``stl/piston_000000.stl``, ...

    The container reaches up to the settled bed's top, or to the piston where that is higher.
    """
    scene, size = run.scene, run.scene.sample.grain_radius.mean
    start = run.track.start()
    top = float((start.position[:, 2] + start.radius).max())
    files = []
    if run.loaded:
        folder = into / "stl"
        folder.mkdir(exist_ok=True)
        face = triangulate_piston(scene.container, scene.piston_reach, size)
        for cycle, height in run.piston_heights(every):
            top = max(top, height)
            files.append(folder / f"piston_{cycle:06d}.stl")
            write_stl(files[-1], face + np.array([0.0, 0.0, height]))
    write_stl(into / "container.stl", triangulate_container(scene.container, top, size))
    return [into / "container.stl", *files]


def write_stl(path: Path, triangles: FloatArray) -> None:
    """Write triangles [m], shape (t, 3, 3), as binary STL; normals by the right hand.

    Not by meshio, whose writer (5.3) says nothing on a full disk and leaves a part of the file.
    """
    kind = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    facets = np.zeros(len(triangles), kind)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    facets["normal"] = normal / np.linalg.norm(normal, axis=1)[:, None]
    facets["corners"] = triangles
    head = b"trackbed".ljust(80) + len(facets).to_bytes(4, "little")
    with whole_file(path) as temporary:
        temporary.write_bytes(head + facets.tobytes())


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A name to write to that becomes ``path`` when the block ends well, and else is removed."""
    temporary = path.with_name(path.name + ".partial")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
