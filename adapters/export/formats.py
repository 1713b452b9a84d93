"""A run in the formats of other tools: VTU for ParaView, dumps for OVITO, CSV.

A file holds what the scene names: without friction there is no tangential force, without load
cycles no displacement and no piston.  Cycles inside a jump have no state, only its end has.
"""

from __future__ import annotations

from pathlib import Path

from adapters.errors import UsageError
from adapters.export.instants import ExportedRun
from adapters.export.meshes import export_vtu
from adapters.export.tables import export_csv, export_ovito
from adapters.files import explain_full_disk

FORMATS = {"vtu": export_vtu, "ovito": export_ovito, "csv": export_csv}
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
        into.mkdir(parents=True, exist_ok=True)
        return FORMATS[to](run, into, every)
