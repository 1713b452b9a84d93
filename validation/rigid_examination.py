"""Examine `solve_friction` on problems that it has not seen: another seed, other problems.

    python -m validation.rigid_examination --seed 7                       all families, own record
    python -m validation.rigid_examination --seed 7 --families "beds kicked" --count 200
    python -m validation.rigid_examination --seed 7 --rival               Clarabel + Newton as well
    python -m validation.rigid_examination --seed 7 --failed-only         what was not solved in 1 s
    python -m validation.rigid_examination --seed 7 --close               0.5 to 2 s: median of five

Families and what each is for: `validation.rigid_examination_families`.  A problem follows from its
family, the seed and its number alone.  Default settings, one thread; one JSON line a problem in
the record, judged by `validation.rigid_examination_judge`; what is recorded already is not run
again, so the same command goes on where it was stopped.  A solve that takes more than 60 processor
seconds is ended, and is a line that says so.  TRACKBED_DATA and TRACKBED_SICONOS name the folders
of the stored problems and of Siconos's test suite; their families are left out without them.

``--save-failed FOLDER`` writes each problem that was not solved in a second for
`rigid_lcp.read_problem`.  ``--hold FILE``: nothing is begun while that file exists.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from adapters.provenance import provenance
from validation.rigid_cone_programs import library_missing
from validation.rigid_examination_families import FAMILIES, Family
from validation.rigid_examination_worker import Worker
from validation.rigid_peers import ONE_THREAD
from validation.rigid_runs import ORIGIN, rows_read, rows_write

Row = dict[str, Any]
RECORD = Path(__file__).parent / "results" / "rigid-examination.jsonl"
SEED = 2026
"""Of the committed record."""
OTHER_SEEDS = RECORD.with_stem("rigid-examination-others")
"""Record of some families of other seeds, by the code of several commits, one after the other."""
BAR_S = 1.0
"""Processor seconds that a solve may take."""
CLOSE_S, REPEATS = (0.5, 2.0), 5
"""Costs so close to the bar that other programs could decide are measured again, so often."""
QUIET_LOAD = 1.6
"""Load average up to which they are, unless told otherwise: little beside this, on two cores."""
WAIT_S = 5.0

Wait = Callable[[], None]


def tasks(
    seed: int, words: str = "", count: int | None = None, families: Sequence[Family] = FAMILIES
) -> Iterator[tuple[Family, int, int]]:
    """Family, seed and number of every problem, the families by turns.

    ``words``, with commas: those families whose names hold one of them; ``count``: so many of each.
    """
    asked = [word.strip() for word in words.split(",") if word.strip()]
    chosen = [
        family for family in families
        if (not asked or any(word in family.name for word in asked))
        and (not family.needs or os.environ.get(family.needs))
    ]  # fmt: skip
    counts = [family.count if count is None else count for family in chosen]
    for index in range(max(counts, default=0)):
        for family, most in zip(chosen, counts, strict=True):
            if index < most:
                yield family, seed, index


def key(row: Row) -> tuple[str, int, int]:
    """What names a problem."""
    return row["family"], row["seed"], row["index"]


def passed(row: Row) -> bool:
    """Solved within `BAR_S`."""
    return bool(row["ok"]) and row["cpu_s"] <= BAR_S


def examined(worker: Worker, family: Family, seed: int, index: int) -> Row:
    """Make and solve a problem."""
    row: Row = {
        "case": "rigid-examination", "family": family.name, "belongs": family.belongs,
        "seed": seed, "index": index, "ok": False, "claims": False, "cpu_s": None,
        "residual": None, "load": os.getloadavg()[0],
    }  # fmt: skip
    return row | worker.ask("solve", family.name, seed, index)


def rivalled(worker: Worker, row: Row) -> Row:
    """Give the same problem to Clarabel + Newton."""
    said = worker.ask("rival", *key(row))
    if "rival_ok" not in said:
        said = {"rival_ok": False, "rival_s": None, "rival_why": said["status"]}
    return row | {name: value for name, value in said.items() if name.startswith("rival")}


def repeated(worker: Worker, row: Row) -> Row:
    """Solve it five times more; the cost is the median."""
    load = os.getloadavg()[0]
    said = worker.ask("repeat", *key(row), REPEATS)
    if "repeats_s" not in said:
        return row
    return row | {"cpu_s": said["cpu_s"], "repeats_s": said["repeats_s"], "load": load}


def is_close(row: Row) -> bool:
    """The cost is near the bar and was measured once."""
    return row["cpu_s"] is not None and CLOSE_S[0] <= row["cpu_s"] <= CLOSE_S[1] and (
        "repeats_s" not in row
    )  # fmt: skip


def examine(
    path: Path, posed: Sequence[tuple[Family, int, int]], origin: Row, *, rival: bool = False,
    failed_only: bool = False, close: bool = False, save: Path | None = None,
    load: float = QUIET_LOAD, wait: Wait = lambda: None,
) -> list[Row]:  # fmt: skip
    """Make the lines that the record at ``path`` has not, as `main` says; all its rows."""
    rows = {key(row): row for row in rows_read(path)}
    worker = Worker()
    try:
        for family, seed, index in posed:
            row = rows.get((family.name, seed, index))
            again = row is not None and failed_only and not passed(row)
            if row is None and (failed_only or close):
                continue
            before = row
            if row is None or again:
                wait()
                row = examined(worker, family, seed, index) | origin
            if save is not None and not passed(row) and row is not before:
                name = f"{family.name.replace(' ', '_').replace(',', '')}-{seed}-{index}.npz"
                worker.ask("save", family.name, seed, index, str(save / name))
            if rival and "rival_ok" not in row:
                wait()
                row = rivalled(worker, row)
            if close and is_close(row) and os.getloadavg()[0] <= load:
                wait()
                row = repeated(worker, row)
            if row is not before:
                rows[key(row)] = row
                rows_write(path, list(rows.values()))
                print(told(row), flush=True)
    finally:
        worker.end()
    return list(rows.values())


def told(row: Row) -> str:
    """A line for who watches."""
    cost = "-" if row["cpu_s"] is None else f"{row['cpu_s']:.3f} s"
    error = "-" if row["residual"] is None else f"{row['residual']:.1e}"
    mark = "ok" if passed(row) else "SLOW" if row["ok"] else "NOT SOLVED"
    return (
        f"{time.strftime('%H:%M:%S')} {mark} {row['family']} {row['index']}: {error} @ {cost}, "
        f"{row['status']} ({row.get('recipe', '')}; {row.get('contacts', '?')} contacts)"
    )


def holding(hold: Path | None) -> Wait:
    """Wait while the file is there."""

    def wait() -> None:
        while hold is not None and hold.exists():
            time.sleep(WAIT_S)

    return wait


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--families", default="", help="words in their names, with commas")
    parser.add_argument("--count", type=int, help="problems of each (default: as listed)")
    parser.add_argument(
        "--record", type=Path,
        help=f"JSON lines (default: the committed one for seed {SEED}, else one in this folder)",
    )  # fmt: skip
    parser.add_argument("--rival", action="store_true", help="Clarabel + Newton as well")
    parser.add_argument("--failed-only", action="store_true", help="what did not pass, again")
    parser.add_argument("--close", action="store_true", help="costs near the bar, five times more")
    parser.add_argument(
        "--load", type=float, default=QUIET_LOAD, help="load average up to which --close measures"
    )
    parser.add_argument("--save-failed", type=Path, help="folder for problems that did not pass")
    parser.add_argument("--hold", type=Path, help="nothing is begun while this file exists")
    asked = parser.parse_args(arguments)
    if any(os.environ.get(name) != "1" for name in ONE_THREAD):
        raise SystemExit(f"set {', '.join(ONE_THREAD)} to 1: costs are of one thread")
    if asked.rival and library_missing("clarabel"):
        raise SystemExit("--rival needs the Python package clarabel: pip install clarabel")
    for family in FAMILIES:
        if family.needs and not os.environ.get(family.needs):
            print(f"left out: {family.name}, as {family.needs} names no folder", flush=True)
    record = asked.record or (
        RECORD if asked.seed == SEED else Path(f"rigid-examination-{asked.seed}.jsonl")
    )
    command = ["python", "-m", "validation.rigid_examination", "--seed", str(asked.seed)]
    origin = {name: value for name, value in provenance(command).items() if name in ORIGIN}
    rows = examine(
        record, list(tasks(asked.seed, asked.families, asked.count)), origin, rival=asked.rival,
        failed_only=asked.failed_only, close=asked.close, save=asked.save_failed,
        load=asked.load, wait=holding(asked.hold),
    )  # fmt: skip
    mine = [row for row in rows if row["seed"] == asked.seed]
    print(f"{record}: {sum(map(passed, mine))} of {len(mine)} solved within {BAR_S:g} s")


if __name__ == "__main__":
    main()
