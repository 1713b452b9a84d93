"""The record of the ensemble: one table and one checkpoint a run, from which any machine goes on.

In ``validation/results/settlement-ensemble``, for a run such as ``confined-2-1``:

``confined-2-1.csv``                a line of JSON behind ``#``, then a row for each cycle
``confined-2-1.000120.restart.xz``  the engine's restart file after the last row's cycle
``confined-2-1.states.npz``         radii, and positions at a few cycles

The table is the root: it names the checkpoint and the states with their SHA-256, and holds that of
its own rows.  It is replaced last and at once, so a killed writer leaves the old table with the old
checkpoint, or the new one with the new.  What no table names is removed by the next call.
"""

from __future__ import annotations

import json
import lzma
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from adapters.errors import UsageError
from adapters.run_folder import write_atomically
from adapters.state import FloatArray

RECORD = Path(__file__).parent / "results" / "settlement-ensemble"

COLUMNS = {
    "cycle": "d",
    "settlement": ".7g",
    "piston_height": ".9g",
    "coordination_number": ".7g",
    "relative_density": ".7g",
    "elastic_deflection": ".5g",
    "piston_stiffness": ".5g",
    "kinetic_translational": ".4g",
    "kinetic_rotational": ".4g",
    "force_error": ".4g",
    "maximum_overlap": ".4g",
    "cpu_s": ".3g",
}
"""Columns of a table and how they are written: SI units; ``cpu_s`` is the engine's, mean of a
window.  Settlement is that of the grains' mean height since the rain."""

COMPRESSION = [{"id": lzma.FILTER_LZMA2, "preset": 9, "dict_size": 2**20}]
"""Of a restart file: a dictionary as long as the longest one; that of the preset takes 700 MB."""

REMEDY = "fetch the record's files again from the repository; nothing was changed"


@dataclass(frozen=True)
class Checkpoint:
    """A state of the engine from which it goes on exactly."""

    file: str
    """Name of the compressed restart file."""
    sha256: str
    """Of the file as it lies there."""
    time_step: int
    """The engine's step count."""
    piston_height: float
    """Height of the piston's face [m]; before the first cycle that of the highest grain."""


@dataclass(frozen=True)
class Kept:
    """What the record keeps of a run."""

    cycle: int
    """Cycles done."""
    checkpoint: Checkpoint
    mean_height: float
    """Of the grains' centres after the rain, from which settlement is counted [m]."""
    density_height: float
    """Height below which the relative density is taken [m]."""
    scene_sha256: str
    """Of all parameters of the scene."""
    engine: str
    """Name and version."""
    states: dict[str, str] = field(default_factory=dict)
    """Cycle -> SHA-256 of the positions kept of it."""
    preparation: dict[str, Any] = field(default_factory=dict)
    """Figures of the rain and the engine's CPU time [s]; empty in a member."""
    parts: tuple[dict[str, Any], ...] = ()
    """Who computed which cycles: commit, decks, machine, time."""
    failed: str = ""
    """Why a window could not be computed; the run ends there."""
    rows: tuple[str, ...] = ()
    """Rows of the table as text."""


def rows_text(table: Mapping[str, Sequence[float]]) -> tuple[str, ...]:
    """Rows of a table of `COLUMNS`, all of one length."""
    values = zip(*(table[name] for name in COLUMNS), strict=True)
    return tuple(
        ",".join(format(value, kind) for value, kind in zip(row, COLUMNS.values(), strict=True))
        for row in values
    )


def digest(content: bytes) -> str:
    """SHA-256 as 64 hexadecimal digits."""
    return sha256(content).hexdigest()


def bytes_write(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path``; a killed writer leaves the old file or the new."""
    temporary = path.with_name(f".{path.name}.partial")
    with temporary.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    temporary.replace(path)


class EnsembleRecord:
    """Tables, checkpoints and states under ``path``."""

    def __init__(self, path: Path = RECORD) -> None:
        self.path = path

    def kept(self, name: str) -> Kept | None:
        """What is kept of a run, None where nothing is.

        Raises `UsageError` when the table is not as it was left.
        """
        path = self.path / f"{name}.csv"
        if not path.exists():
            return None
        try:
            head, _columns, *rows = path.read_text(encoding="utf-8").splitlines()
            content = json.loads(head.removeprefix("# "))
            whole = content.pop("rows_sha256") == digest("\n".join(rows).encode())
            checkpoint = Checkpoint(**content.pop("checkpoint"))
            parts = tuple(content.pop("parts"))
            kept = Kept(checkpoint=checkpoint, parts=parts, rows=tuple(rows), **content)
        except (ValueError, KeyError, TypeError) as error:
            raise UsageError(
                f"this is no table of the ensemble ({error})", where=str(path), remedy=REMEDY
            ) from error
        if not whole:
            raise UsageError(
                "the rows are not those that were written", where=str(path), remedy=REMEDY
            )
        return kept

    def table(self, name: str) -> dict[str, FloatArray]:
        """Columns of a run's table as arrays, shape (rows,); empty ones where nothing is kept."""
        kept = self.kept(name)
        rows = [] if kept is None else [row.split(",") for row in kept.rows]
        values = np.array(rows, float).reshape(len(rows), len(COLUMNS))
        return dict(zip(COLUMNS, values.T, strict=True))

    def since_rain(self, packing: str, member: str) -> dict[str, FloatArray]:
        """Columns of a packing's table with those of a member behind."""
        before, behind = self.table(packing), self.table(member)
        return {name: np.append(before[name], behind[name]) for name in before}

    def restart(self, kept: Kept) -> bytes:
        """The engine's restart file; raises `UsageError` when it is not the table's."""
        path = self.path / kept.checkpoint.file
        content = path.read_bytes() if path.exists() else b""
        if digest(content) != kept.checkpoint.sha256:
            raise UsageError(
                f"the checkpoint is not that of the table (cycle {kept.cycle})",
                where=str(path),
                remedy=REMEDY,
            )
        return lzma.decompress(content)

    def states(self, name: str) -> tuple[FloatArray, dict[int, FloatArray]]:
        """Radii (n,) and positions (n, 3) [m] by cycle; raises `UsageError` for other ones."""
        path, kept = self.path / f"{name}.states.npz", self.kept(name)
        if kept is None or not kept.states:
            return np.empty(0), {}
        try:
            with np.load(path, allow_pickle=False) as data:
                radius = data["radius"]
                found = {int(cycle): data[f"position_{cycle}"] for cycle in kept.states}
        except Exception as error:  # numpy raises many kinds for a file that is not a whole npz
            raise UsageError(
                f"these are not the states of the table ({error})", where=str(path), remedy=REMEDY
            ) from error
        if any(
            digest(found[int(cycle)].tobytes()) != wanted for cycle, wanted in kept.states.items()
        ):
            raise UsageError(
                "these are not the states of the table", where=str(path), remedy=REMEDY
            )
        return radius, found

    def bank(
        self,
        name: str,
        kept: Kept,
        restart: bytes,
        radius: FloatArray,
        positions: Mapping[int, FloatArray],
    ) -> Kept:
        """Keep a run as it stands after a window; returns it with the names of its new files.

        ``kept`` with all rows so far; new ``positions`` (n, 3) [m] by cycle, of grains of
        ``radius`` (n,) [m].
        """
        self.path.mkdir(parents=True, exist_ok=True)
        states = dict(kept.states)
        if positions:
            _, before = self.states(name)
            arrays: dict[str, Any] = {"radius": radius}
            arrays |= {f"position_{cycle}": x for cycle, x in (before | dict(positions)).items()}
            path = self.path / f"{name}.states.npz"
            temporary = path.with_name(f".{path.name}.partial")
            with temporary.open("wb") as stream:
                np.savez_compressed(stream, **arrays)
            temporary.replace(path)
            states |= {str(cycle): digest(x.tobytes()) for cycle, x in positions.items()}
        content = lzma.compress(restart, filters=COMPRESSION)
        file = f"{name}.{kept.cycle:06d}.restart.xz"
        bytes_write(self.path / file, content)
        checkpoint = replace(kept.checkpoint, file=file, sha256=digest(content))
        kept = replace(kept, checkpoint=checkpoint, states=states)
        self.table_write(name, kept)
        self._checkpoints_remove_but(name, file)
        return kept

    def tidy(self) -> None:
        """Remove what a killed writer left: parts of files, checkpoints that no table names."""
        for leftover in self.path.glob(".*.partial"):
            leftover.unlink()
        for path in self.path.glob("*.csv"):
            kept = self.kept(path.stem)
            assert kept is not None
            self._checkpoints_remove_but(path.stem, kept.checkpoint.file)

    def _checkpoints_remove_but(self, name: str, file: str) -> None:
        for other in self.path.glob(f"{name}.*.restart.xz"):
            if other.name != file:
                other.unlink()

    def table_write(self, name: str, kept: Kept) -> None:
        """Replace a run's table at once."""
        head = asdict(kept)
        rows = head.pop("rows")
        head["rows_sha256"] = digest("\n".join(rows).encode())
        lines = [f"# {json.dumps(head)}", ",".join(COLUMNS), *rows]
        write_atomically(self.path / f"{name}.csv", "\n".join(lines) + "\n")


def parts_joined(
    parts: tuple[dict[str, Any], ...], part: dict[str, Any]
) -> tuple[dict[str, Any], ...]:
    """Parts with one more; it lengthens the last one where only cycles and time differ."""
    if parts:
        *before, last = parts
        same = {key: value for key, value in part.items() if key not in ("cycles", "ended")}
        if same.items() <= last.items():
            cycles = [last["cycles"][0], part["cycles"][1]]
            return (*before, last | {"cycles": cycles, "ended": part["ended"]})
    return (*parts, part)
