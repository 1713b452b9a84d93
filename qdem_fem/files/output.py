"""Files of a run: VTU fields and their PVD series, and tables that are appended to.

Nothing is ever half-written: whole files go to a temporary name first, and a table that a killed
writer cut short is cut back to its last sound row (`Table.cut`).
"""

import hashlib
import itertools
from collections.abc import Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from qdem_fem.files.arrays import Floats
from qdem_fem.files.errors import UsageError
from trackbed.run_files import append_text, refuse_writing, replace_file, seal_file, write_whole

CELLS = {4: ("tetra", [0, 1, 2, 3]), 10: ("tetra10", [0, 1, 2, 3, 4, 7, 5, 6, 8, 9])}
"""VTK's name and order of the nodes of an element, by their number."""


def write_bodies_vtu(path: Path, bodies: Sequence[Any]) -> None:
    """Write all bodies of a simulation into one VTU file, atomically.

    Nodes are at their reference places; ParaView's filter "Warp By Vector" deforms the mesh by the
    displacement.  Fields: displacement [m] and velocity [m/s] of nodes, von_mises [Pa] and body
    (its number from 0) of elements.  ``bodies`` are `qdem_fem.Body`.
    """
    import meshio

    counts = [len(body.nodes) for body in bodies]
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    run = bodies[0].mover  # finds the velocities of all its bodies at once
    velocity = [body.velocity for body in bodies] if run is None else [run.velocities(bodies)]
    cells, stress, number = [], [], []  # of one kind of element after the other
    counted = range(len(bodies))
    for size, alike in itertools.groupby(counted, lambda i: bodies[i].element_nodes.shape[1]):
        these, (name, order) = list(alike), CELLS[size]
        cells.append(
            (name, np.concatenate([bodies[i].element_nodes[:, order] + first[i] for i in these]))
        )
        stress.append(np.concatenate([bodies[i].von_mises() for i in these]))
        number.append(np.repeat(these, [len(bodies[i].elements) for i in these]))
    mesh = meshio.Mesh(
        np.concatenate([body.nodes for body in bodies]), cells,
        {
            "displacement": np.concatenate([body.displacement for body in bodies]),
            "velocity": np.concatenate(velocity),
        },
        {"von_mises": stress, "body": number},
    )  # fmt: skip
    with replace_file(path) as temporary:
        mesh.write(temporary, file_format="vtu", compression=None)


NOTHING = hashlib.sha256().hexdigest()
"""Of a file before its first byte: the seal of tables of older versions."""


class Table:
    """A CSV file that grows: a header, then rows of numbers, the first one the time [s]."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path, self.columns = path, tuple(columns)

    def begin(self) -> None:
        """Write the header alone."""
        write_whole(self.path, ",".join(self.columns) + "\n")

    def append(self, rows: npt.NDArray[Any]) -> None:
        """Append rows (k, columns); digits enough to read the same numbers back."""
        text = "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist())
        with refuse_writing(self.path):
            append_text(self.path, text)

    def seal(self) -> tuple[int, str]:
        """Length of the file so far [bytes], all of it on the disk, and its SHA-256."""
        return self.path.stat().st_size, seal_file(self.path)

    def cut(self, time: float, counts: Set[int], seal: tuple[int, str] = (0, NOTHING)) -> None:
        """Keep the sound rows up to ``time`` [s], as they were when the run had come there.

        Raises `UsageError` when the file has other columns, is not there, was changed since it had
        this ``seal``, or has none of the ``counts`` of rows written by then; it is left as it is.
        """
        header = (",".join(self.columns) + "\n").encode()
        kept, rows = len(header), 0
        try:
            with self.path.open("rb+") as stream:
                if stream.readline() != header:
                    raise self._refuse("this table has other columns")
                for line in stream:
                    if not line.endswith(b"\n") or float(line.partition(b",")[0]) > time:
                        break
                    kept, rows = kept + len(line), rows + 1
                if rows not in counts:
                    what = f"{max(counts)} rows up to {time:.6g} s were written, {rows} are there"
                    raise self._refuse(what)
                stream.seek(0)
                if hashlib.sha256(stream.read(seal[0])).hexdigest() != seal[1]:
                    raise self._refuse("this table was changed since it was written")
                stream.truncate(kept)
        except (OSError, ValueError) as error:
            raise self._refuse(f"can not read the rows so far ({error})") from error

    def _refuse(self, what: str) -> UsageError:
        return UsageError(what, where=str(self.path), remedy="start again: --force")


def read_table(path: Path) -> dict[str, Floats]:
    """Columns of a CSV table of numbers by name; empty arrays when it has no rows.

    Raises `UsageError` when it is not such a table.
    """
    try:
        with path.open(encoding="utf-8-sig") as stream:
            names = [name.strip() for name in stream.readline().rstrip("\n").split(",")]
            rows = [line.split(",") for line in stream if line.strip()]
        values = np.array(rows, float).reshape(len(rows), len(names))
    except (OSError, ValueError) as error:
        raise UsageError(f"no table of numbers ({error})", where=str(path)) from error
    return {name: values[:, place].copy() for place, name in enumerate(names)}
