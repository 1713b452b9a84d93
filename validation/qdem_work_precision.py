"""Error against cost of QDEM and of what a user would take instead: the runs and their record.

    python -m validation.qdem_work_precision            all runs that the record has not yet
    python -m validation.qdem_work_precision --quick --out quick.jsonl     the small ones
    python -m validation.qdem_work_precision --plot docs/qdem-cost.png

One JSON line a run in ``validation/results/qdem-cost.jsonl``: error, cost and settings.  A run that
was recorded is not made again unless ``--fresh``.  Costs are processor time of one thread, the
median of three for runs of a few seconds, so that a busy machine disturbs them little.

Questions are in `qdem_work_problems`, methods in `qdem_work_methods`, what follows from the record
in `qdem_work_report`.
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
from validation.qdem_work_methods import AMG_NODES, Answer, answer
from validation.qdem_work_problems import QUESTIONS, RESULTS, Question

Row = dict[str, Any]
RECORD = RESULTS / "qdem-cost.jsonl"
LEVELS = ((22, 2, 2), (44, 4, 4), (65, 6, 6), (87, 8, 8), (109, 10, 10), (130, 12, 12))
"""Cells of the linear meshes, five tetrahedra each: 440 to 93,600."""
QUADRATIC = ((11, 1, 1), (22, 2, 2), (33, 3, 3), (44, 4, 4), (65, 6, 6))
"""Cells of the quadratic meshes, six tetrahedra each: 66 to 14,040."""
UNSTRUCTURED = (0.048, 0.032, 0.024)
"""Element sizes of gmsh's meshes [m], for mass scaling: where all elements are alike it is none."""
STEPS = {"bending": (20, 50, 100, 200, 400), "pulse": (10, 20, 40, 80)}
"""Newmark's steps in a first period, or in a pulse."""
REPEATED_S = 10.0
"""Runs that cost less are made three times [s]."""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

Run = tuple[str, str, dict[str, Any]]
"""Question, method, settings."""


def plan(quick: bool) -> list[Run]:
    """All runs, cheap ones first."""
    runs: list[Run] = []
    for name in QUESTIONS:
        for level, cells in enumerate(LEVELS[: 3 if quick else None]):
            mesh = {"cells": list(cells)}
            runs += [(name, "QDEM", mesh), (name, "QDEM", mesh | {"precision": "float32"})]
            runs.append((name, "P1 central difference", mesh))
            if level < 5:
                runs.append((name, "QDEM", mesh | {"strain": "small"}))
            runs += _newmark(name, cells, quick)
        for level, cells in enumerate(QUADRATIC[: 2 if quick else None]):
            chosen = STEPS[name][1:4] if quick else STEPS[name]
            for steps in chosen[1:3] if level == 4 else chosen:
                setting = {"cells": list(cells), "steps_per_unit": steps}
                runs.append((name, "P2 Newmark", setting))
    for h in UNSTRUCTURED[: 1 if quick else None]:
        for slowest in (0.0, 0.05, 0.2, 0.5):
            runs.append(("bending", "QDEM", {"h": h, "slowest": slowest}))
    return runs


def _newmark(name: str, cells: tuple[int, int, int], quick: bool) -> list[Run]:
    nodes = int(np.prod(np.array(cells) + 1))
    # finer steps on the finest meshes cost minutes and gain nothing: the mesh's error is left
    chosen = STEPS[name][:3] if quick or nodes > 10_000 else STEPS[name]
    solvers = ["direct"] * (nodes < AMG_NODES) + ["amg"] * (nodes > 10_000)
    return [
        (name, "P1 Newmark", {"cells": list(cells), "steps_per_unit": steps, "solver": solver})
        for solver in solvers
        for steps in (chosen if solver == "direct" else chosen[:2])
    ]


def row_of(run: Run, results: Path) -> Row:
    """Make a run, three times if it is short, and measure its error; a failure is a row too."""
    name, method, setting = run
    question = QUESTIONS[name]
    wanted, _ = question.reference(results)
    row: Row = {"case": f"qdem-cost-{name}", "method": method, "setting": setting}
    try:
        found = [answer(question, method, setting)]
        while len(found) < 3 and sum(found[0].cost.values()) < REPEATED_S:
            found.append(answer(question, method, setting))
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


def rows_read(path: Path) -> list[Row]:
    """Rows of a record, none if there is no file."""
    if not path.exists():
        return []
    return [json.loads(text) for text in path.read_text(encoding="utf-8").splitlines() if text]


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
    for run in plan(quick=True):
        if run[2].get("cells") in ([22, 2, 2], [11, 1, 1]):
            answer(QUESTIONS["pulse"], run[1], run[2])


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
    from validation.qdem_work_report import plot, summary

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
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
