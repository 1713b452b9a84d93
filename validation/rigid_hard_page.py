"""docs/rigid-hard-cases.md from validation/results/rigid-hard-cases.jsonl, and that record.

    python -m validation.rigid_hard_page --run [--quick] [--only FAMILY ...]    measure, write both
    python -m validation.rigid_hard_page --run --resume        go on with a run that was cut off
    python -m validation.rigid_hard_page                       write the page from the record

A family is one of `validation.cases.rigid_hard_cases.FAMILIES`; lines of others are kept, and each
is in the record as soon as it is done.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from statistics import median
from typing import Any

from adapters.errors import UsageError
from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from validation.rigid_hard_picture import picture_draw
from validation.rigid_hard_trials import Row

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "rigid-hard-cases.jsonl"
PAGE = ROOT / "docs" / "rigid-hard-cases.md"
Data = dict[str, Any]

HEAD = """# Hard cases of rigid grains

Scenes in the plane whose answers are known, by `rigid_lcp` and by three engines on the same scenes.
`trackbed validate rigid-hard-cases` measures ours (`--quick`: shorter runs of the same);
`python -m validation.rigid_hard_page --run` also runs the peers and writes
`validation/results/rigid-hard-cases.jsonl`, from which this page is made.  Every engine is built
from one description of the scene, starts from the same state, takes steps of 1 ms (where no other
is said) and is judged by the same number against the same bar.  Costs are CPU seconds of one
thread, for all steps of the run.

What peers are given: bodies become slabs, held in the plane by joints in MuJoCo and ODE and free in
space in LMGC90.  MuJoCo runs with its most exact settings (elliptic cones, impratio 100, 30
iterations without slip, contacts as stiff as its step allows): its contacts are soft by design, so
it sinks in a little.  ODE is `World.step` (Dantzig) with friction limits from the normal forces of
the iteration and CFM 1e-12.  LMGC90 is `compas_lmgc90` (NLGS, IQS_CLB) with that binding's own
settings.  A peer's miss says what it was not made for, not that it is bad.  **Bold**: misses the
bar.  Peers that did not run on a case are listed below the table with the reason.
"""

PICTURE = """
![error against cost a step](rigid-hard-cases.png)

Every mark is an engine on one scene that must rest or move by a known way; errors below 1e-17 m
are drawn there, the line is the bar of most scenes.  Soft contacts are cheap: at equal steps ours
costs more, and is exact to round-off or its tolerance; that is relative to the largest forces, so
mass ratios of 1e8 and more end it (the marks of ours above the line).  The peers' errors are those
of their models and tolerances.
"""


def record_lines(rows: Sequence[Row], origin: Data, family: str = "") -> list[Data]:
    """Rows as plain data, where they come from included; what is no finite number becomes null."""
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    lines = []
    for row in rows:
        data = {"family": family} | asdict(row) | {"ok": bool(row.ok)}
        for name in ("value", "cpu_s"):
            data[name] = float(data[name]) if isfinite(data[name]) else None
        if row.value == float("inf"):
            data["why"] = data["why"] or "the motion blew up"
        lines.append(data | kept)
    return lines


def record_write(lines: Sequence[Data], path: Path = RECORD) -> None:
    """Write the record, a line each, atomically."""
    write_atomically(path, "\n".join(json.dumps(line) for line in lines) + "\n")


def record_read(path: Path = RECORD) -> list[Data]:
    """The lines of a record."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def page(lines: Sequence[Data]) -> str:
    """The page as Markdown."""
    mine = [line for line in lines if not line["peer"]]
    passed = sum(line["ok"] for line in mine)
    parts = [HEAD, f"{passed} of {len(mine)} rows of ours meet their bars.\n"]
    parts.append(f"Machine: {lines[0]['machine']}; other work ran on it, costs are provisional.\n")
    parts += _engines(lines)
    parts.append(PICTURE)
    parts.append("| case | answer | bar | engine | measured | CPU s | steps |\n|" + "---|" * 7)
    shown = [line for line in lines if not _absent(line)]
    parts += [_row(line, before) for line, before in zip(shown, [None, *shown], strict=False)]
    if reasons := _reasons(lines):
        parts += ["\n## What did not run\n", *reasons]
    failed = [line for line in mine if not line["ok"]]
    if failed:
        parts.append("\n## Where ours misses its bar\n")
        parts += [
            f"* {line['case']}, {line['method']}: {line['measure']} {_value(line)} against "
            f"{line['bar']} {line['unit']}.  {_sentence(line['why'])}".rstrip()
            for line in failed
        ]
    return "\n".join(parts) + "\n"


def _row(line: Data, before: Data | None) -> str:
    again = before is not None and all(
        before[key] == line[key] for key in ("case", "answer", "bar", "measure")
    )
    value = _value(line)
    value = value if line["ok"] or (line["value"] is None and line["peer"]) else f"**{value}**"
    cost = "-" if line["cpu_s"] is None else f"{line['cpu_s']:.2g}"
    bar = f"{line['measure']} {line['bar']} {line['unit']}".rstrip()
    first = ["", "", ""] if again else [line["case"], line["answer"], bar]
    cells = [*first, line["method"], value, cost, str(line["steps"] or "-")]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _value(line: Data) -> str:
    if line["value"] is not None:
        return f"{line['value']:.2g}"
    return "blew up" if line["why"] == "the motion blew up" else "none"


def _sentence(why: str) -> str:
    return " ".join(why.split())


def _engines(lines: Sequence[Data]) -> list[str]:
    """Each engine that ran: how many bars it met, and what a step cost it."""
    parts = ["| engine | rows | bars met | CPU ms a step, median and greatest |\n|" + "---|" * 4]
    ran = [line for line in lines if not _absent(line)]
    for method in dict.fromkeys(line["method"] for line in ran):
        own = [line for line in ran if line["method"] == method]
        long = [line for line in own if line["steps"] > 1 and line["cpu_s"] is not None]
        step = [1e3 * line["cpu_s"] / line["steps"] for line in long]
        cost = f"{median(step):.2g}, {max(step):.2g}" if step else "-"
        parts.append(f"| {method} | {len(own)} | {sum(line['ok'] for line in own)} | {cost} |")
    return parts


def _absent(line: Data) -> bool:
    """A peer that did not run on this case."""
    return line["peer"] and line["steps"] == 0


def _reasons(lines: Sequence[Data]) -> list[str]:
    """Each engine's reasons once, with the number of cases."""
    counts: dict[tuple[str, str], int] = {}
    for line in lines:
        if _absent(line):
            key = (line["method"], _sentence(line["why"]))
            counts[key] = counts.get(key, 0) + 1
    return [
        f"* {method}: {why} ({count} case{'s' if count > 1 else ''})"
        for (method, why), count in counts.items()
    ]


def measure(quick: bool, only: Sequence[str] | None, resume: bool = False) -> None:
    """Run ours and the peers, family after family; each is in the record when it is done.

    ``resume``: families that the record has from the same code and command are left as they are.
    """
    from validation.cases.rigid_hard_cases import FAMILIES, hard_rows
    from validation.rigid_scene_peers import PEERS

    strangers = set(only or ()) - FAMILIES.keys()
    if strangers:
        raise UsageError(
            f"no family {', '.join(sorted(strangers))}", remedy=f"one of {', '.join(FAMILIES)}"
        )
    words = ["python", "-m", "validation.rigid_hard_page", "--run", *["--quick"] * quick]
    for name in only or FAMILIES:
        origin = provenance([*words, "--only", name])
        if resume and is_measured(_known(name), origin):
            continue
        made = record_lines(hard_rows(quick, PEERS, [name])[name], origin, name)
        lines = {each: _known(each) for each in FAMILIES} | {name: made}
        record_write([line for part in lines.values() for line in part])


def _known(family: str) -> list[Data]:
    lines = record_read() if RECORD.is_file() else []
    return [line for line in lines if line["family"] == family]


def is_measured(lines: Sequence[Data], origin: Data) -> bool:
    """Whether lines of a family come from the same code, command and machine."""
    keys = ("commit", "command", "machine")
    return bool(lines) and all(line[key] == origin[key] for line in lines for key in keys)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line; run if asked; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--run", action="store_true", help="measure first, and write the record")
    parser.add_argument("--quick", action="store_true", help="short runs")
    parser.add_argument("--resume", action="store_true", help="leave out what is measured already")
    parser.add_argument("--only", nargs="+", metavar="FAMILY", help="measure these again only")
    arguments = parser.parse_args(words)
    if arguments.run:
        measure(arguments.quick, arguments.only, arguments.resume)
    lines = record_read()
    write_atomically(PAGE, page(lines))
    picture_draw(lines, PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
