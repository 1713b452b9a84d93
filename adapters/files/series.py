"""A settlement series, one value a cycle, read from a table, a run folder or dumps."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.files.dump import find_cell
from adapters.files.run_folder import EVENTS, RunFolder
from adapters.files.settlement_table import SUFFIXES, Series, read_table_series
from trackbed.plausible import describe_implausible
from trackbed.run_files import MANIFEST, refuse_links
from trackbed.run_verbs import find_kind

THROWN = 10.0
"""Way of a grain over the greatest of all others, above which it is no part of the bed [-]."""


def make_too_few_error(
    count: int, fewest: int, purpose: str, *, where: str, left_out: int = 0, else_do: str = ""
) -> UsageError:
    """The error of a series of ``count`` cycles, where ``purpose`` (to fit ..., to tell ...) needs
    ``fewest``; ``left_out`` rows before them were given but not taken."""
    gone = f", as {left_out} earlier rows are left out" if left_out else ""
    back = ", or leave fewer rows out (--from-cycle, --load-change)" if left_out else ""
    given = "1 cycle is" if count == 1 else f"{count} cycles are"
    return UsageError(
        f"{given} too few {purpose}{gone}", where=where,
        remedy=f"give at least {fewest} computed cycles{back}{else_do}",
    )  # fmt: skip


def read_series(
    paths: Sequence[Path],
    steps_per_cycle: float | None = None,
    columns: Sequence[str] = (),
    unit: str | None = None,
) -> Series:
    """The series of one table, one run folder, or dumps with one frame a cycle end.

    A table is a file named as in `settlement_table.SUFFIXES`, but for dumps of such names;
    ``columns`` are its columns of cycles and settlement, where they have unusual names; ``unit``
    is one of `settlement_table.UNITS`, where the table does not say.

    Dumps may be one file of many frames or many files, taken in natural order of their names
    (``2.dump`` before ``10.dump``); a frame that repeats the time step before it is skipped.
    Settlement is the drop of the mean height of the grains since the first frame.  Frames are
    cycles 0, 1, 2 ...; with ``steps_per_cycle`` their time step counts: give it when the first
    frame is not the start of the loading.

    Raises `UsageError` or `DumpError`, naming file, line and column.
    """
    if not paths:
        raise UsageError("no series was named", remedy="give a CSV file, a run folder or dumps")
    tables = [path for path in paths if path.is_dir() or _is_table(path)]
    if tables and len(paths) > 1:
        raise UsageError(
            "only dumps can be joined to one series", where=str(tables[0]),
            remedy="give one CSV file, or one run folder, or dumps",
        )  # fmt: skip
    path = paths[0]
    if unit not in (None, "m") and (path.is_dir() or not tables):
        whose = "a run's settlement is" if tables else "dumps are"
        raise UsageError(f"{whose} in m, not in {unit}", where=str(path), remedy="leave --unit out")
    if tables:
        table = _find_run_table(path) if path.is_dir() else path
        return replace(read_table_series(table, columns, unit), where=str(table))
    if columns:
        raise UsageError(
            "dumps have no columns of cycles and settlement", where=str(path),
            remedy=f"leave --columns out; tables are named {', '.join(SUFFIXES)}",
        )  # fmt: skip
    return replace(read_dump_series(paths, steps_per_cycle), where=str(path))


def read_dump_series(paths: Sequence[Path], steps_per_cycle: float | None = None) -> Series:
    """Settlement of the same grains in every frame of dumps; see `read_series`."""
    from adapters.files.dump_reader import read_frames

    if steps_per_cycle is not None and not (steps_per_cycle > 0 and isfinite(steps_per_cycle)):
        raise UsageError(f"steps per cycle must be positive, not {steps_per_cycle:g}")
    steps: list[int] = []
    heights: list[float] = []
    grains: FloatArray | None = None
    identifiers = first = before = np.empty(0)
    widest = 0.0
    for path in sorted(paths, key=_make_sort_key):
        for frame in read_frames(path):
            where = f"{path}, time step {frame.time_step}"
            identifiers = frame.column("id")
            if grains is None:
                grains = identifiers
            elif not np.array_equal(grains, identifiers):
                raise UsageError(
                    "the grains are not those of the first frame", where=where,
                    remedy="give dumps of one sample, from the start of its loading on",
                )  # fmt: skip
            if steps and frame.time_step == steps[-1]:
                continue
            if steps and frame.time_step < steps[-1]:
                raise UsageError(
                    f"the time step falls from {steps[-1]}", where=where,
                    remedy="name the files so that their numbers ascend with time",
                )  # fmt: skip
            steps.append(frame.time_step)
            folded = not {"iz", "zu", "zsu"} & set(frame.columns)
            plain = folded and "z" in frame.columns
            height = frame.column("z") if plain else frame.find_centres()[:, 2]
            if folded and len(steps) > 1 and frame.boundary.split()[-1:] == ["pp"]:
                _refuse_folded(
                    identifiers, height - before, find_cell(frame.bounds)[1][2, 2], where
                )
            before = height
            first = height if len(steps) == 1 else first
            heights.append(float(height.mean()))
            if "radius" in frame.columns:
                widest = 2 * float(frame.column("radius").max(initial=0.0))
    if steps_per_cycle is None:
        cycle = np.arange(len(steps), dtype=float)
    else:
        cycle = np.array(steps) / steps_per_cycle
    doubts = (
        describe_implausible("grain", widest, str(paths[0])) if widest else None,
        describe_thrown(identifiers, first - before),
    )
    return Series(cycle, heights[0] - np.array(heights), doubts=tuple(filter(None, doubts)))


def _find_run_table(run: Path) -> Path:
    """The table of a run; refuses one that may not be what it computed: a changed one, or links
    out of it."""
    if (kind := find_kind(run)) and kind.verb != "run":
        raise UsageError(
            f"this is a {kind.verb} run, which has no settlement under load cycles",
            where=str(run), remedy=f"its files are open: {kind.files}",
        )  # fmt: skip
    refuse_links(run)
    if (run / MANIFEST).exists():
        RunFolder(run).manifest()  # raises where there is none in it
    if damaged := [name for name in RunFolder(run).list_damaged() if name != EVENTS]:
        raise UsageError(
            f"not as the run left it: {', '.join(damaged)}", where=str(run),
            remedy=f"trackbed resume {shlex.quote(str(run))}, or give the table that you trust",
        )  # fmt: skip
    table = run / "settlement.csv"
    if not table.exists():
        raise UsageError(
            "can not read the series (No such file or directory)", where=str(table),
            remedy="this folder is no run, or no cycle of it is computed; of other folders "
            "give the files: a table, or dumps",
        )  # fmt: skip
    return table


def describe_thrown(grains: FloatArray, sunk: FloatArray) -> str | None:
    """A sentence on a grain that makes most of what the mean of grains (n,) sank by, (n,) [m]; None
    where none does."""
    if len(sunk) < 3:
        return None
    others = sunk - np.median(sunk)
    most = int(np.argmax(np.abs(others)))
    if abs(others[most]) <= 0.5 * abs(float(sunk.sum())):
        return None
    rest = float(np.abs(np.delete(sunk, most)).max())
    if abs(sunk[most]) <= THROWN * rest:
        return None
    return (
        f"grain {grains[most]:g} alone makes most of this settlement: it sank by {sunk[most]:.3g} "
        f"m, and no other moved by more than {rest:.3g} m; leave it out if it left the bed"
    )


def _refuse_folded(grains: FloatArray, rise: FloatArray, period: float, where: str) -> None:
    """Refuse heights that were folded back into a period: a grain moved by half of it or more."""
    through = np.flatnonzero(np.abs(rise) > 0.5 * period)
    if len(through):
        raise UsageError(
            f"grain {grains[through[0]]:g} passed a periodic side in z, and its height is not "
            "known", where=where, remedy="dump iz or zu beside z",
        )  # fmt: skip


def _is_table(path: Path) -> bool:
    """Whether a file is a table by its name, and not a dump by its first word."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES or not path.is_file():
        return suffix in (SUFFIXES[0], SUFFIXES[-1])
    with path.open("rb") as stream:
        return not stream.read(64).lstrip().startswith(b"ITEM:")


def _make_sort_key(path: Path) -> list[tuple[int, str]]:
    """Sorting key by which 2 comes before 10: digits as numbers, the rest as text."""
    parts = re.findall(r"\d+|\D+", str(path))
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
