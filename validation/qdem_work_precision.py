"""Error against cost of QDEM and of what a user would take instead: the runs and their record.

    python -m validation.qdem_work_precision            all runs that the record has not yet
    python -m validation.qdem_work_precision --quick --out quick.jsonl     the small ones
    python -m validation.qdem_work_precision --plot docs/qdem-cost.png

One JSON line a run in ``validation/results/qdem-cost.jsonl``: error, cost and settings.  A run that
was recorded is not made again unless ``--fresh``.  Costs are processor time of one thread, the
median of five runs below two seconds and of three above, so that a busy machine disturbs them
little; all of them are recorded.

Questions are in `qdem_work_problems`, methods in `qdem_work_methods`, what follows from the record
in `qdem_work_report`, and in words in `qdem_work_words`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.provenance import provenance
from validation.qdem_work_methods import Answer, answer
from validation.qdem_work_problems import QUESTIONS, RESULTS, Question
from validation.qdem_work_report import Row, rows_read
from validation.qdem_work_words import summary

RECORD = RESULTS / "qdem-cost.jsonl"
LEVELS = {
    "bending": ((22, 2, 2), (44, 4, 4), (65, 6, 6), (87, 8, 8), (109, 10, 10), (130, 12, 12)),
    "pulse": ((22, 2, 2), (44, 4, 4), (65, 6, 6), (87, 8, 8), (109, 10, 10), (130, 12, 12),
              (174, 16, 16), (218, 20, 20)),
}  # fmt: skip
"""Cells of the linear meshes, five tetrahedra each: 440 to 436,000."""
QUADRATIC = ((11, 1, 1), (22, 2, 2), (33, 3, 3), (44, 4, 4), (55, 5, 5))
"""Cells of the quadratic meshes, six tetrahedra each: 66 to 8,250."""
UNSTRUCTURED, SLOWEST = (0.048, 0.032), (0.0, 0.05, 0.2)
"""Element sizes of gmsh's meshes [m] and shares of their elements that mass scaling makes heavier;
where all elements are alike, as in the other meshes, mass scaling gains nothing."""
STEPS = {"bending": (20, 50, 100, 200), "pulse": (10, 20, 40, 80)}
"""Newmark's steps in a first period, or in a pulse."""
SHORTER = (0.45, 0.225)
"""Steps of QDEM over the critical one, beside 0.9."""
SHORT_S = 2.0
"""Runs that cost less are made five times, others three times [s]."""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

Run = tuple[str, str, dict[str, Any]]
"""Question, method, settings."""


def plan(quick: bool) -> list[Run]:
    """All runs, cheap ones first."""
    runs: list[Run] = []
    for name in QUESTIONS:
        for cells in LEVELS[name][1:3] if quick else LEVELS[name]:
            runs += _linear(name, cells, quick)
        for level, cells in enumerate(QUADRATIC[:2] if quick else QUADRATIC):
            chosen: tuple[int, ...] = STEPS[name][1:3] if quick else STEPS[name]
            if level == 4:  # bending has no error left to lose; a pulse needs short steps there
                chosen = STEPS[name][2:] if name == "pulse" else ()
            for steps in chosen:
                setting = {"cells": list(cells), "steps_per_unit": steps}
                runs.append((name, "P2 Newmark", setting))
    for h in () if quick else UNSTRUCTURED:
        runs += [("bending", "QDEM", {"h": h, "slowest": share}) for share in SLOWEST]
    return runs


def _linear(name: str, cells: tuple[int, int, int], quick: bool) -> list[Run]:
    """Runs on one mesh of linear elements; the dearest are left out, as no sentence needs them."""
    mesh, level = {"cells": list(cells)}, LEVELS[name].index(cells)
    runs: list[Run] = [(name, "QDEM", mesh)]
    if not quick or level == 1:
        runs.append((name, "QDEM", mesh | {"precision": "float32"}))
    if level < (5 if name == "bending" else 7):
        runs.append((name, "P1 central difference", mesh))
    if not quick and level in ((1, 2) if name == "bending" else (1, 3, 5)):
        runs += [(name, "QDEM", mesh | {"safety": safety}) for safety in SHORTER]
    chosen: tuple[int, ...] = STEPS[name]
    if quick:
        chosen = chosen[:2]
    elif name == "bending" and level > 2:
        chosen = chosen[:3] if level < 5 else chosen[1:3]
    elif name == "pulse" and level > 3:
        chosen = chosen[2:3] if level == 4 else ()
    runs += [
        (name, "P1 Newmark", mesh | {"steps_per_unit": steps, "solver": "direct"})
        for steps in chosen
    ]
    if (name, level, quick) == ("bending", 4, False):
        setting = {"steps_per_unit": STEPS[name][1], "solver": "amg"}
        runs.append((name, "P1 Newmark", mesh | setting))
    return runs


def row_of(run: Run, results: Path) -> Row:
    """Make a run, five times or three, and measure its error; a failure is a row too."""
    name, method, setting = run
    question = QUESTIONS[name]
    wanted, _ = question.reference(results)
    row: Row = {"case": f"qdem-cost-{name}", "method": method, "setting": setting}
    try:
        found = [answer(question, method, setting)]
        repeats = 5 if sum(found[0].cost.values()) < SHORT_S else 3
        found += [answer(question, method, setting) for _ in range(repeats - 1)]
    except Exception as error:  # recorded, and the other runs go on
        return row | _failed(question, f"{type(error).__name__}: {error}")
    if not all(np.isfinite(one.displacement).all() for one in found):
        return row | _failed(question, "the motion is not finite")
    return row | _measured(question, found, wanted)


def _measured(question: Question, found: list[Answer], wanted: Any) -> Row:
    first = found[0]
    middle = sorted(found, key=lambda one: sum(one.cost.values()))[len(found) // 2]
    return {
        "error": question.error(first.times, first.displacement, wanted),
        "error_kind": question.kind,
        "cost_s": sum(middle.cost.values()),
        "parts_s": dict(middle.cost),
        "repeats_s": [sum(one.cost.values()) for one in found],
        "work": first.steps,
        "work_unit": "time steps",
        "elements": first.elements,
        "nodes": first.nodes,
        "step_s": first.step,
        **({"notes": first.notes} if first.notes else {}),
        "ok": True,
        "why": "",
    }


def _failed(question: Question, why: str) -> Row:
    """A row without a time: none counts for a motion that is not right."""
    nothing = dict.fromkeys(("error", "cost_s", "work"))
    return {"error_kind": question.kind, **nothing, "work_unit": "time steps",
            "ok": False, "why": why}  # fmt: skip


def reference_row(question: Question, results: Path) -> Row:
    """The reference's own uncertainty."""
    _, uncertainty = question.reference(results)
    return {
        "case": f"qdem-cost-{question.name}", "method": "reference", "setting": {},
        "error": uncertainty, "error_kind": question.kind, "cost_s": None, "work": None,
        "work_unit": "", "ok": True, "why": "its coarser form against its finer",
    }  # fmt: skip


# --- the record -------------------------------------------------------------------------------


def _key(case: str, method: str, setting: dict[str, Any]) -> str:
    return json.dumps([case, method, setting], sort_keys=True)


def record_complete(path: Path, quick: bool, command: Sequence[str]) -> list[Row]:
    """Make the runs that ``path`` does not have, a line each as they end; all rows of the plan."""
    origin = provenance(command)
    told = {key: origin[key] for key in ("commit", "command", "machine", "started")}
    have = {_key(row["case"], row["method"], row["setting"]): row for row in rows_read(path)}
    wanted = []
    for question in QUESTIONS.values():
        row = reference_row(question, RESULTS if RESULTS.is_dir() else path.parent)
        wanted.append(_key(row["case"], "reference", {}))
        have.setdefault(wanted[-1], row | told)
    warmed = False
    for run in plan(quick):
        key = _key(f"qdem-cost-{run[0]}", run[1], run[2])
        wanted.append(key)
        if key in have:
            continue
        if not warmed:
            _compile()
            warmed = True
        have[key] = row_of(run, RESULTS) | told
        _write(path, [have[k] for k in wanted if k in have])
        shown = have[key]
        print(f"{time.strftime('%H:%M:%S')} {key}  error {shown['error']}  {shown['cost_s']} s")
        sys.stdout.flush()
    _write(path, [have[k] for k in wanted])
    return [have[k] for k in wanted]


def _write(path: Path, rows: list[Row]) -> None:
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    temporary.replace(path)


def _compile() -> None:
    """Compile, or load, what is timed later: kernels of every kind, scikit-fem's forms."""
    for question, method, setting in plan(quick=True):
        cells = [11, 1, 1] if method == "P2 Newmark" else [22, 2, 2]
        answer(QUESTIONS[question], method, setting | {"cells": cells})


def record_apart(path: Path, quick: bool) -> list[Row]:
    """`record_complete` in a process whose libraries have one thread each."""
    command = [sys.executable, "-m", "validation.qdem_work_precision", "--out", str(path)]
    root = str(Path(__file__).resolve().parents[1])
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1") | {"PYTHONPATH": root}
    subprocess.run(
        command + ["--quick"] * quick, env=environment, check=True, stdout=subprocess.DEVNULL
    )
    return rows_read(path)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line above."""
    from validation.qdem_work_picture import plot

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small meshes only")
    parser.add_argument("--fresh", action="store_true", help="make all runs again")
    parser.add_argument("--out", type=Path, default=RECORD, help="the record (JSON lines)")
    parser.add_argument("--plot", type=Path, help="draw the record, and make no runs")
    asked = parser.parse_args(arguments)
    if asked.quick and asked.out == RECORD:
        parser.error("--quick needs an --out of its own")
    if asked.plot is not None:
        plot(asked.out, asked.plot)
        print(summary(rows_read(asked.out)))
        return
    if os.environ.get(ONE_THREAD[0]) != "1":
        raise SystemExit(f"set {', '.join(ONE_THREAD)} to 1: costs are those of one thread")
    if asked.fresh:
        asked.out.unlink(missing_ok=True)
    command = ["python", "-m", "validation.qdem_work_precision", *["--quick"] * asked.quick]
    record_complete(asked.out, asked.quick, command)


if __name__ == "__main__":
    main()
