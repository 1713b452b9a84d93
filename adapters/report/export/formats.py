"""A run in the formats of other tools: VTU for ParaView, dumps for OVITO, ON-DEM's VTKHDF, CSV.

A file holds what the scene names: without friction there is no tangential force, without load
cycles no displacement and no piston.  Cycles inside a jump have no state, only its end has.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.engines import bound_section
from adapters.errors import UsageError
from adapters.files import Frame, Kind, explain_full_disk, write_dump
from adapters.files.ondem import write_bodies
from adapters.report.export import fields
from adapters.report.export.fields import Array
from adapters.report.export.instants import ExportedRun, Instant
from adapters.scene import list_stages
from trackbed.run_files import refuse_writing, replace_file, write_pvd

Gather = Callable[[ExportedRun, Instant], dict[str, Array]]
ENGINE_NAME = {"velocity": "v"}
"""Field -> its name in a dump, where engines and OVITO have a shorter one."""


def export_vtu(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``grains.pvd`` and ``contacts.pvd``, series over the cycles, and their files in ``vtu/``.

    Grains are points with `gather_grains`; contacts are lines from centre to centre with
    `gather_contacts`.
    """
    grains, contacts = [], []
    for instant in run.instants(every):
        grains.append((instant.cycle, f"vtu/grains_{instant.cycle:06d}.vtu"))
        centres = instant.state.position
        points = np.arange(len(centres))[:, None]
        of_grains = fields.gather_grains(run, instant)
        write_mesh(into / grains[-1][1], centres, "vertex", points, point_data=of_grains)
        if run.own:
            contacts.append((instant.cycle, f"vtu/contacts_{instant.cycle:06d}.vtu"))
            of_contacts, lines = fields.gather_contacts(run, instant), fields.list_contacts(instant)
            write_mesh(into / contacts[-1][1], centres, "line", lines, cell_data=of_contacts)
    series = {"grains": grains} | ({"contacts": contacts} if run.own else {})
    for name, files in series.items():
        write_pvd(into / f"{name}.pvd", files)
    written = [into / name for _, name in (*grains, *contacts)]
    return [*(into / f"{name}.pvd" for name in series), *written]


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


def export_ovito(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``grains.dump`` and ``contacts.dump``: text dumps whose time step is the number of cycles.

    OVITO knows every column of the grains by its name.  Its modifier "Load trajectory" takes the
    contacts for bonds when it is set that the first two columns are "Particle Identifiers"; the
    forces are magnitudes there, as a bond's colour and width ask for.
    """
    box = _find_box(run)

    def make_frames(gather: Gather, kind: Kind) -> Iterator[Frame]:
        for instant in run.instants(every):
            found = gather(run, instant)
            if "tangential_force" in found:
                found["tangential_force"] = np.linalg.norm(found["tangential_force"], axis=1)
            named = {ENGINE_NAME.get(name, name): values for name, values in found.items()}
            columns = dict(fields.split_columns(named, ""))
            values = np.column_stack([*columns.values()]).astype(float)
            yield Frame(instant.cycle, tuple(columns), values, box, kind)

    write_dump(into / "grains.dump", make_frames(fields.gather_placed_grains, "atoms"))
    if not run.own:
        return [into / "grains.dump"]
    write_dump(into / "contacts.dump", make_frames(fields.gather_named_contacts, "entries"))
    return [into / "grains.dump", into / "contacts.dump"]


def _find_box(run: ExportedRun) -> FloatArray:
    """Low and high of the container, up to the settled bed's top [m], shape (3, 2); of a deck those
    of the grains."""
    start = run.track.start()
    if not run.own:
        reach = start.radius[:, None]
        low, high = (start.position - reach).min(axis=0), (start.position + reach).max(axis=0)
        return np.column_stack([low, high])
    low, high = bound_section(run.scene.container)
    top = float((start.position[:, 2] + start.radius).max())
    return np.array([*zip(low, high, strict=True), (0.0, top)])


def export_csv(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``grains.csv``, ``contacts.csv`` and ``piston.csv``: long tables, a column ``cycle`` first.

    SI units; every number is written so that it reads back the same.  ``settlement.csv`` of the
    run folder has a row a cycle already.  The piston's table holds all its samples.
    """

    def list_columns(gather: Gather) -> Iterator[dict[str, Array]]:
        for instant in run.instants(every):
            columns = dict(fields.split_columns(gather(run, instant), "_"))
            length = len(next(iter(columns.values())))
            yield {"cycle": np.full(length, instant.cycle), **columns}

    tables = {"grains": list_columns(fields.gather_placed_grains)}
    if run.own:
        tables["contacts"] = list_columns(fields.gather_named_contacts)
    if run.own and run.loaded:
        tables["piston"] = run.piston_samples()
    for name, parts in tables.items():
        write_csv_rows(into / f"{name}.csv", parts)
    return [into / f"{name}.csv" for name in tables]


def write_csv_rows(path: Path, parts: Iterable[Mapping[str, Array]]) -> None:
    """Write tables of the same columns one below the other."""
    with replace_file(path) as temporary, temporary.open("w", encoding="ascii") as stream:
        for number, columns in enumerate(parts):
            if number == 0:
                stream.write(",".join(columns) + "\n")
            rows = zip(*(column.tolist() for column in columns.values()), strict=True)
            stream.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def export_vtkhdf(run: ExportedRun, into: Path, every: int) -> list[Path]:
    """``vtkhdf/grains_000000.vtkhdf`` and on: an instant a file by `write_bodies`; its iteration is
    the cycle, its time that under load, jumped cycles too.  Of a deck only its bodies are known."""
    material, written = run.scene.material.grain.model_dump() if run.own else {}, []
    for instant in run.instants(every):
        scene = {"iteration": instant.cycle} | (_find_time(run, instant) if run.own else {})
        contacts = _gather_signed_contacts(run, instant) if run.own else {}
        written.append(into / f"vtkhdf/grains_{instant.cycle:06d}.vtkhdf")
        write_bodies(written[-1], instant.state, scene, material, contacts)
    return written


def _find_time(run: ExportedRun, instant: Instant) -> dict[str, float]:
    """Time under load and time step [s], in each stage of the load its own."""
    time, step = 0.0, run.scene.time_step
    for begin, stage in list_stages(run.scene):
        if stage.loading and stage.procedure and instant.cycle > begin:
            done = min(instant.cycle, stage.procedure.total_cycles) - begin
            time, step = time + done * stage.loading.period, stage.time_step
    return {"time": time, "timestep": step}


def _gather_signed_contacts(run: ExportedRun, instant: Instant) -> dict[str, Array]:
    """Contacts as ON-DEM has them: traction is positive, a tangential force acts on grain 2."""
    touching, (first, second) = instant.state.contacts, fields.list_contacts(instant).T
    apart = instant.state.position[second] - instant.state.position[first]
    return {
        "id1": touching.pair[:, 0], "id2": touching.pair[:, 1], "overlap": touching.overlap,
        "normal": apart / np.linalg.norm(apart, axis=1)[:, None],
        "normal_force": -fields.gather_contacts(run, instant)["normal_force"],
        "shear_force": -touching.tangential_force,
    }  # fmt: skip


FORMATS = {"vtu": export_vtu, "ovito": export_ovito, "csv": export_csv, "vtkhdf": export_vtkhdf}
"""Name of a format -> function of the run, a folder and the cycles between two instants."""


def export_run(run: ExportedRun, to: str, into: Path, every: int = 1) -> list[Path]:
    """Write a run to the folder ``into`` in the format ``to``, one of `FORMATS`.

    ``every``: cycles between two instants; the first and the last one are always among them.
    Files of an earlier export are replaced; none is ever half-written.  Returns what to open
    first, then the rest.  Raises `UsageError`, and `EngineFailed` on a full disk.
    """
    if every < 1:
        raise UsageError(f"every {every} cycles is no step", remedy="give a whole number from 1 on")
    with explain_full_disk(into):
        with refuse_writing(into):
            (into / to if to in ("vtu", "vtkhdf") else into).mkdir(parents=True, exist_ok=True)
        return FORMATS[to](run, into, every)
