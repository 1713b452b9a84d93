"""docs/rigid-indeterminacy.md from validation/results/rigid-indeterminacy.jsonl, and that record.

python -m validation.rigid_indeterminacy_page --run [--quick]   measure, write both
python -m validation.rigid_indeterminacy_page                   write the page from the record
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any

from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from validation.rigid_indeterminacy import (
    FROM_SPRINGS,
    LIGGGHTS,
    LIMIT,
    RELAXATION,
    SCENES,
    SPRINGS,
    Row,
    order_rows,
    scene_rows,
    warm_up,
)
from validation.rigid_indeterminacy_picture import picture_draw
from validation.rigid_indeterminacy_wear import wear_rows

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "rigid-indeterminacy.jsonl"
PAGE = ROOT / "docs" / "rigid-indeterminacy.md"
Data = dict[str, Any]

HEAD = """# Forces of statically indeterminate grains

Rigid grains with more contact forces than equations of balance have many forces that fit.  Section
8 of Schwager and Poeschel takes those that elastic contacts would choose, by micro-displacements
(eqs 37 to 40): `rigid_lcp.micro_displacements` is that relaxation, `rigid_lcp.elastic_limit`
computes its limit directly.  Here both are put beside molecular dynamics on the same grains:
springs at the contacts integrated in time by a program of its own
(`validation/rigid_indeterminacy_springs.py`: real geometry, turning normals, tangential springs
with memory), and LIGGGHTS (spheres in a plane, `hooke/stiffness` with history) where the grains
are discs.  All contacts have the same stiffness in all directions.

Error: greatest difference of a contact force from the direct limit, over the weight of all grains.
Stiffness: in weights of all grains a metre; discs have a radius of 1 m.  Costs are CPU seconds of
one thread, LIGGGHTS with its start.  `trackbed validate rigid-indeterminacy` measures the same.

![error of the forces](rigid-indeterminacy.png)

Left: springs against the direct limit as they get stiffer.  Middle: error against cost of all four
ways (stars: the direct limit against dense least squares).  Right: where contacts slide, against
the time in which gravity is switched on.
"""

STIFF_TEXT = """## In the stiff limit forces agree

Without friction, and where all contacts stick, the limit is the least elastic energy; "dense" is
the direct limit against a dense least-squares solution of that, over the contacts that carry.
Errors of the springs fall as 1/k until round-off takes over: an overlap of weight / k is a small
difference of large numbers, so springs have a best stiffness and a least error, and the rigid
limit has neither.  With friction the load has to grow slowly (see below); these rows are for
30,000 steps of loading.
"""

COST_TEXT = """## What it costs

CPU milliseconds to an error of 1e-6 of the weight, the cheapest setting of each that reaches it
(a dash: none measured does).  At this error our own springs, a compiled loop that starts from the
touching grains, are the cheapest; they go no further than 1e-8 to 1e-7.  The direct limit has
round-off for its price.  The printed relaxation is the dearest on pyramids: its steps are bound by
the stiffest mode and their number by the softest.
"""

SLIDING_TEXT = """## Where contacts slide, the forces are a matter of history

Springs with memory keep what slid on the way.  Loaded at once, the grains overshoot, contacts
slide that hold in the end, and the forces at rest differ by some per cent of the weight at any
stiffness.  Loaded slowly, the difference falls with the time of loading, as long as the springs
head for the same state.

Springs and sliders can have more than one state at the same load.  The last columns begin the
direct limit at the displacements of the springs: where it leads back to the same forces, "other
state" is zero; where not, the springs have found another solution of eqs 26, 27 and 38, as exact
as the first (residual), and the column says how far it is from the first, and how far the springs
are from it.
"""

ORDER_TEXT = """## Order, numbers, start

Contacts and bodies in random order, and then a random start of a tenth of the final displacements
as well; relative difference of all forces (2-norm).  Masses are random, others for every size;
between walls for friction 0 and 0.3.
"""

UNSTABLE_TEXT = """
Order and numbers do not matter where the limit is found.  The start may, where contacts slide: of
these piles, the one of 465 discs at friction 5 has more than one state.

"Not found": with many sliding contacts the limit may not be a place that the relaxation tends to.
Coulomb's law has no potential: on pyramids of 210 discs that collapse at friction 0.2 and 0.5 the
tangent of springs and sliders along the way has eigenvalues down to -7e-5 and -7e-4 (its largest
are 0.3 and 0.4; at friction 0.05, where the limit is found, none is below -1e-7), so small
differences grow.  Long implicit steps jump between branches and short ones wander: followed with
short steps at friction 0.2, residuals stayed between 1e-5 and 2e-2 for 220 steps before they fell.
The answer says "not converged" then, with its best point.  `solve_friction` has forces for such
piles too, but not unique ones.
"""

WEAR_TEXT = """## Wear and breakage in a run

`Simulation(scene, wear=Wear(k), breakage=Breakage(strength))`, or `[wear]` and `[strength]` in a
scene file: the work of friction takes corners off polygons, corners and edges off polyhedra, by
``V = k W`` (Archard, Reye); grains whose contact forces pull them apart harder than their strength
are split, in 2D by the Brazilian criterion.  Where neither is named nothing of it is computed.
Where a criterion hangs on forces that are not unique, `Breakage(unique=True)` judges by those of
elastic contacts: in the tower below, the time stepping's own forces hold friction that squeezes the
boxes sideways, and its boxes do not break.
"""


def measure(quick: bool) -> None:
    """Run everything and write the record."""
    origin = provenance(["python", "-m", "validation.rigid_indeterminacy_page", "--run"])
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    warm_up()
    lines: list[Data] = []
    for scene in SCENES:
        for row in scene_rows(scene, quick):
            lines.append(_line(row, kept))
            print(row.scene, row.method, row.stiffness, row.ramp, f"{row.error:.1e}", flush=True)
    lines += _order_lines(quick, kept) + _wear_lines(quick, kept)
    write_atomically(RECORD, "\n".join(json.dumps(line) for line in lines) + "\n")


def _line(row: Row, kept: Data) -> Data:
    data = {"case": "rigid-indeterminacy"} | asdict(row)
    return data | {"error": row.error if isfinite(row.error) else None} | kept


def _order_lines(quick: bool, kept: Data) -> list[Data]:
    lines = []
    for row in order_rows((6, 12) if quick else (6, 12, 16, 20, 30)):
        data = {"case": "rigid-indeterminacy", "method": "order"} | asdict(row)
        for name in ("order", "start"):
            data[name] = data[name] if isfinite(data[name]) else None
        lines.append(data | kept)
        print(row, flush=True)
    return lines


def _wear_lines(quick: bool, kept: Data) -> list[Data]:
    return [
        {"case": "rigid-indeterminacy", "method": "wear", "scene": row.name} | asdict(row) | kept
        for row in wear_rows(quick)
    ]


def measure_part(method: str) -> None:
    """Measure ``order``, ``wear`` or the direct limit only; other lines of the record stay."""
    origin = provenance(["python", "-m", "validation.rigid_indeterminacy_page", "--only", method])
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    if method == LIMIT:
        warm_up()
        made = [_line(next(scene_rows(scene, False)), kept) for scene in SCENES]
    else:
        made = (_order_lines if method == "order" else _wear_lines)(False, kept)
    lines = [line for line in record_read() if line["method"] != method] + made
    write_atomically(RECORD, "\n".join(json.dumps(line) for line in lines) + "\n")


def record_read(path: Path = RECORD) -> list[Data]:
    """The lines of a record."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def page(lines: Sequence[Data]) -> str:
    """The page as Markdown."""
    machine = f"Machine: {lines[0]['machine']}; other work ran on it, costs are provisional.\n"
    return "\n".join([
        HEAD, machine, STIFF_TEXT, *_stiff_table(lines), "", COST_TEXT, *_cost_table(lines), "",
        SLIDING_TEXT, *_sliding_table(lines), "", ORDER_TEXT, *_order_table(lines), "",
        UNSTABLE_TEXT, WEAR_TEXT, *_wear_table(lines), "",
    ])  # fmt: skip


def _of(lines: Sequence[Data], scene: str, method: str) -> list[Data]:
    return [line for line in lines if line["scene"] == scene and line["method"] == method]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def _stiff_table(lines: Sequence[Data]) -> list[str]:
    table = [
        "| scene | contacts | redundant | dense | | error at k = 1e2 | 1e4 | 1e6 | 1e8 | 1e10 |",
        "|" + "---|" * 10,
    ]
    for scene in SCENES:
        if scene.mobilised:
            continue
        limit = _of(lines, scene.name, LIMIT)[0]
        for method in (SPRINGS, LIGGGHTS):
            error = {
                line["stiffness"]: line["error"]
                for line in _of(lines, scene.name, method)
                if bool(line["ramp"]) == scene.path_matters
            }
            if error:
                cells = [_number(error.get(k)) for k in (1e2, 1e4, 1e6, 1e8, 1e10)]
                table.append(
                    f"| {scene.name} | {limit['contacts']} | {limit['redundant']} | "
                    f"{_number(limit['error'])} | {method} | {' | '.join(cells)} |"
                )
    return table


def _cost_table(lines: Sequence[Data]) -> list[str]:
    table = ["| scene | direct limit | relaxation | springs | LIGGGHTS |", "|" + "---|" * 5]
    for scene in SCENES:
        if scene.mobilised:
            continue
        cells = [f"{1e3 * _of(lines, scene.name, LIMIT)[0]['cpu_s']:.2g}"]
        for method in (RELAXATION, SPRINGS, LIGGGHTS):
            costs = [
                line["cpu_s"] for line in _of(lines, scene.name, method) if line["error"] <= 1e-6
            ]
            cells.append(f"{1e3 * min(costs):.2g}" if costs else "-")
        table.append(f"| {scene.name} | {' | '.join(cells)} |")
    return table


def _sliding_table(lines: Sequence[Data]) -> list[str]:
    table = [
        "| scene | sliding | loaded in steps | springs | LIGGGHTS | residual of the springs | "
        "other state | springs from it |",
        "|" + "---|" * 8,
    ]
    for scene in SCENES:
        if not scene.mobilised:
            continue
        other = {line["ramp"]: line for line in _of(lines, scene.name, FROM_SPRINGS)}
        peer = {line["ramp"]: line["error"] for line in _of(lines, scene.name, LIGGGHTS)}
        for line in _of(lines, scene.name, SPRINGS):
            ramp = line["ramp"]
            state = other.get(ramp)
            table.append(
                f"| {scene.name} | {line['sliding']} of {line['contacts']} | {ramp or 'at once'} | "
                f"{_number(line['error'])} | {_number(peer.get(ramp))} | "
                f"{_number(line['residual'])} | {_number(state['error'] if state else None)} | "
                f"{_number(state['tolerance'] if state else None)} |"
            )
    return table


def _order_table(lines: Sequence[Data]) -> list[str]:
    table = ["| pile | contacts | sliding | other order | and other start |", "|" + "---|" * 5]
    for line in lines:
        if line["method"] == "order":
            cells = [_number(line[name]) for name in ("order", "start")]
            shown = cells if line["found"] else ["not found", "-"]
            table.append(
                f"| {line['scene']} | {line['contacts']} | {line['sliding']} | "
                f"{' | '.join(shown)} |"
            )
    return table


def _wear_table(lines: Sequence[Data]) -> list[str]:
    table = ["| what | measured | bar |", "|---|---|---|"]
    for line in lines:
        if line["method"] == "wear":
            unit = f" {line['unit']}" if line["unit"] else ""
            table.append(f"| {line['name']} | {line['value']:.2g}{unit} | {line['bar']:g}{unit} |")
    return table


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line; measure if asked to; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--run", action="store_true", help="measure first, and write the record")
    parser.add_argument("--quick", action="store_true", help="fewer settings")
    parser.add_argument("--only", choices=("order", "wear", LIMIT), help="measure this table only")
    arguments = parser.parse_args(words)
    if arguments.run:
        measure(arguments.quick)
    elif arguments.only:
        measure_part(arguments.only)
    lines = record_read()
    write_atomically(PAGE, page(lines))
    picture_draw(lines, PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
