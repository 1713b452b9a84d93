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
from validation.commit_words import commit_words
from validation.rigid_indeterminacy import (
    LIMIT,
    SCENES,
    SLOW,
    Row,
    order_rows,
    scene_rows,
    warm_up,
)
from validation.rigid_indeterminacy_picture import picture_draw
from validation.rigid_indeterminacy_tables import (
    cost_table,
    found_words,
    loading_table,
    order_table,
    sliding_table,
    springs_words,
    stiff_table,
    wear_table,
)
from validation.rigid_indeterminacy_wear import wear_rows

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "rigid-indeterminacy.jsonl"
PAGE = ROOT / "docs" / "rigid-indeterminacy.md"
TEXT = Path(__file__).with_suffix(".md")
Data = dict[str, Any]


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
    """Measure ``order``, ``wear``, the direct limit or one scene only; other lines stay."""
    origin = provenance(["python", "-m", "validation.rigid_indeterminacy_page", "--only", method])
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    if method == LIMIT:
        warm_up()
        made = [_line(next(scene_rows(scene, False)), kept) for scene in SCENES]
    elif method in (scene.name for scene in SCENES):
        warm_up()
        scene = next(scene for scene in SCENES if scene.name == method)
        made = [_line(row, kept) for row in scene_rows(scene, False)]
    else:
        made = (_order_lines if method == "order" else _wear_lines)(False, kept)
    lines = [line for line in record_read() if method not in (line["method"], line["scene"])] + made
    write_atomically(RECORD, "\n".join(json.dumps(line) for line in lines) + "\n")


def record_read(path: Path = RECORD) -> list[Data]:
    """The lines of a record."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def page(lines: Sequence[Data]) -> str:
    """The page as Markdown: `rigid_indeterminacy_page.md` with its gaps filled."""
    machine = (
        f"Machine: {lines[0]['machine']}; other work ran on it, costs are provisional.  Lines by "
        f"code: {commit_words(lines)}."
    )
    return TEXT.read_text(encoding="utf-8").format(
        machine=machine, slow=f"{SLOW:,}", stiff=stiff_table(lines), loading=loading_table(lines),
        springs=springs_words(lines), costs=cost_table(lines), sliding=sliding_table(lines),
        order=order_table(lines), found=found_words(lines), wear=wear_table(lines),
    )  # fmt: skip


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line; measure if asked to; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--run", action="store_true", help="measure first, and write the record")
    parser.add_argument("--quick", action="store_true", help="fewer settings")
    choices = ("order", "wear", LIMIT, *(scene.name for scene in SCENES))
    parser.add_argument("--only", choices=choices, help="measure this table or scene only")
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
