"""A scene of a line run to its last axle, and what came out of it."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from track_line.arrays import Floats
from track_line.scene.file import LEFT_OUT, SceneFile, build_line
from track_line.settling import Line, Record, State, find_crossings, march_line, start_line
from trackbed.errors import NotConverged
from trackbed.memory import read_arrays
from trackbed.run_files import RESULT, open_unlinked, replace_file
from trackbed.run_files import folder as run_folder

STATE = "state.npz"
KEPT = ("cycle", "settled", "hardened", "score")
"""Of a state; which sleepers bear is found again, to the same bits."""


@dataclass(frozen=True)
class RunPlan:
    """How a run is kept, checked and summed up."""

    apart: float = 10.0  # between states that are written [s]
    checked: int = 10  # lines that are computed again with half the blocks, for the error
    doubtful: float = 0.05
    """Error of the last D1 by its blocks, over itself, from which a run warns [-]."""
    band: tuple[float, float, float] = (0.05, 0.5, 0.95)
    """Shares of all sections of all lines that lie below low, median and high [-]."""
    short: float = 60.0
    """Length of the line that says beforehand which blocks a run will take [m]."""


PLAN = RunPlan()


class RunFolder(run_folder.RunFolder):
    """The folder of one run of a line; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, STATE, "geometry.csv", "report.html",
        "geometry.svg", ".*.partial",
    )  # fmt: skip
    states = STATE
    compared = ("scene", "rolling_speed")
    free = ("scene.title", "scene.line.limit", "scene.line.speed")


def predict_blocks(file: SceneFile) -> Floats:
    """Axles before each block of a run and at its end, about, shape (k + 1,): those of one short
    line of the same beds; which of stability and smoothness decides them is the law's."""
    table, found = file.tables.line, []
    own = table.model_copy(update={"length": PLAN.short, "realisations": 1})
    tables = file.tables.model_copy(update={"line": own, "zone": []})
    line = build_line(replace(file, tables=tables))
    with suppress(NotConverged):  # the run will say so
        found = [state.cycle for state, _ in march_line(line, start_line(line), table.axles)]
    return np.array(found or [0.0, table.axles])


def collect_records(records: Sequence[Record], name: str) -> Floats:
    """A quantity of k records, shape (k, ...)."""
    return np.array([getattr(record, name) for record in records])


def write_state(folder: RunFolder, state: State, records: Sequence[Record]) -> None:
    """Keep a state with the records up to it; raises as `replace_file`."""
    folder.refuse_if_replaced()
    arrays: dict[str, Any] = {name: np.asarray(getattr(state, name)) for name in KEPT}
    arrays |= {f"record_{one.name}": collect_records(records, one.name) for one in fields(Record)}
    with replace_file(folder.path / STATE) as path, open_unlinked(path, "wb") as stream:
        np.savez(stream, **arrays)


def read_state(path: Path, line: Line) -> tuple[State, list[Record]] | None:
    """A state of ``line`` and the records before it; None where there is none or it is damaged."""
    try:
        arrays = read_arrays(path)
        cycle, *beds = (arrays[name] for name in KEPT)
        columns = [arrays[f"record_{one.name}"] for one in fields(Record)]
        records = [Record(*row) for row in zip(*columns, strict=True)]
        fits = all(one.shape == line.beds.level.shape for one in beds)
        sound = all(np.isfinite(one).all() for one in arrays.values())
    except Exception:  # whatever a damaged archive makes numpy raise: the run begins again
        return None
    return (State(float(cycle), *beds), records[:-1]) if fits and sound else None


def run_scene(
    file: SceneFile, folder: RunFolder, *, resume: bool,
    progress: Callable[[float, float, str], None],
) -> tuple[list[Record], float]:  # fmt: skip
    """Records of block after block, from the last state on if ``resume``, and the error of the last
    D1; calls ``progress`` with blocks of all lines so far, in all, and words.  Raises
    `NotConverged`."""
    line, end, ahead = build_line(file), file.tables.line.axles, predict_blocks(file)
    blocks, again = len(ahead) - 1, find_share_checked(file)

    def show(cycle: float, before: int, cost: float, words: str) -> None:
        done = before + cost * float(np.interp(cycle, ahead, np.arange(blocks + 1)))
        progress(done, blocks * (1 + again), f"{cycle:.3g} of {end:.3g} axles, {words}")

    there = read_state(folder.path / STATE, line) if resume else None
    state, records = there or (start_line(line), [])
    written = time.monotonic()
    for now, record in march_line(line, state, end):
        records.append(record)
        show(now.cycle, 0, 1.0, f"{len(records) - 1} blocks")
        if now.cycle >= end or time.monotonic() > written + PLAN.apart:
            write_state(folder, now, records)
            written = time.monotonic()
    return records, estimate_error(
        file, records[-1], lambda cycle: show(cycle, blocks, again, "again by half the blocks")
    )


def find_share_checked(file: SceneFile) -> float:
    """What `estimate_error` costs, over the run itself [-]."""
    return 2 * min(PLAN.checked / file.tables.line.realisations, 1.0)


def estimate_error(file: SceneFile, last: Record, progress: Callable[[float], None]) -> float:
    """Of the last D1, by blocks, over itself [-]: twice the difference to half the blocks, as the
    error is of first order."""
    line, finer = build_line(file, min(PLAN.checked, file.tables.line.realisations)), np.zeros(0)
    for state, record in march_line(line, start_line(line), file.tables.line.axles, finer=2.0):
        finer = record.deviation
        progress(state.cycle)
    same = last.deviation[: len(finer)]
    coarse, fine = (float(np.sqrt((one**2).mean())) for one in (same, finer))
    return 2 * abs(coarse - fine) / fine if fine > 0 else 0.0


def preview_run(file: SceneFile) -> dict[str, Any]:
    """What a run would be, and about what it costs: its first block is computed."""
    line, table = build_line(file), file.tables.line
    blocks, begun = len(predict_blocks(file)) - 1, time.perf_counter()  # and compiles
    next(march := march_line(line, start_line(line), table.axles))
    next(march)
    return {
        "title": file.tables.title, "law": file.tables.law.name, "formula": line.law.formula,
        "source": line.law.source, "validity": line.law.validity,
        "sleepers": len(line.beds.place), "realisations": table.realisations,
        "tonnage_mgt": float(line.find_tonnage(np.array(table.axles))),
        "limit_m": file.limit, "blocks_about": blocks,
        "estimated_s": (time.perf_counter() - begun) / 2 * blocks * (1 + find_share_checked(file)),
        "left_out": "; ".join(LEFT_OUT),
    }  # fmt: skip


def summarise_run(file: SceneFile, records: Sequence[Record], error: float) -> dict[str, Any]:
    """What a run came to, for people and for ``--json``; lengths in m, tonnage in MGT.

    A limit that is not reached has no tonnage: None.
    """
    line, last = build_line(file, 1), records[-1]
    tonnage = line.find_tonnage(collect_records(records, "cycle"))
    crossings = find_crossings(tonnage, collect_records(records, "deviation"), file.limit)
    d1 = np.quantile(last.deviation, PLAN.band)
    tamping = np.quantile(crossings, PLAN.band, method="inverted_cdf")
    summary = {
        "title": file.tables.title, "law": file.tables.law.name, "source": line.law.source,
        "validity": line.law.validity, "length_m": file.tables.line.length,
        "realisations": file.tables.line.realisations, "sections": crossings.size,
        "axles": last.cycle, "tonnage_mgt": float(tonnage[-1]), "blocks": len(tonnage) - 1,
        "settlement_m": float(last.settlement.mean()), "limit_m": file.limit,
        "share_over_limit": float(np.isfinite(crossings).mean()),
        "hanging_over_0.1_mm": float(last.voids[0].mean()),
        "hanging_over_1_mm": float(last.voids[1].mean()),
        "deepest_void_m": float(last.deepest.max()), "error_of_blocks": error,
    }  # fmt: skip
    named = list(zip(("low", "median", "high"), d1.tolist(), tamping.tolist(), strict=True))
    summary |= {f"d1_{name}_m": value for name, value, _ in named}
    summary |= {f"tamping_{name}_mgt": v if np.isfinite(v) else None for name, _, v in named}
    return summary | {"sentence": describe_when(summary)}


def describe_when(summary: dict[str, Any]) -> str:
    """The engineer's sentence: when D1 reaches its limit, in the median section and the band."""
    limit = f"limit of {1e3 * summary['limit_m']:.3g} mm"
    (low, least), (median, middle), (high, most) = (
        (summary[f"tamping_{name}_mgt"], 1e3 * summary[f"d1_{name}_m"])
        for name in ("low", "median", "high")
    )
    if median == 0:
        return f"D1 is above the {limit} before the first axle."
    if median is not None:
        latest = "later than the run" if high is None else f"{high:.3g}"
        return f"D1 reaches the {limit} at {median:.3g} MGT ({low:.3g} ... {latest})."
    found = (
        f"D1 is {middle:.3g} mm ({least:.3g} ... {most:.3g}) at {summary['tonnage_mgt']:.3g} MGT"
    )
    if low is None:
        return f"{found} and stays below the {limit}."
    over = 100 * summary["share_over_limit"]
    return f"{found}; {over:.0f} % of the sections reach the {limit} by then."
