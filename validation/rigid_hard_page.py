"""docs/rigid-hard-cases.md from validation/results/rigid-hard-cases.jsonl, and that record.

    python -m validation.rigid_hard_page --run [--quick] [--only FAMILY ...]    measure, write both
    python -m validation.rigid_hard_page --run --ours          ours only; rows of peers are kept
    python -m validation.rigid_hard_page --run --theirs        rows of peers are new, ours are kept
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
from math import inf, isfinite
from pathlib import Path
from statistics import median
from typing import Any

from adapters.errors import UsageError
from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from validation.commit_words import commit_words
from validation.rigid_hard_picture import picture_draw
from validation.rigid_hard_trials import Row

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "rigid-hard-cases.jsonl"
PAGE = ROOT / "docs" / "rigid-hard-cases.md"
Data = dict[str, Any]

NAMED = (
    ("10-box stack, the top 1e4 heavier: 1e-9 m in 2 s", "10 boxes, the top one 1e4 times"),
    ("block at mu = tan(alpha) and (1 ± 1e-9) of it", "block at mu", "block in space at mu"),
    ("block at rest: creep of 1e-12 m in 1e5 steps", "block at rest"),
    ("card house", "card house"),
    ("wedge", "wedge"),
    ("semicircular arch at its minimum thickness", "arch of"),
    ("Painlevé rod either side of its limit", "Painleve rod"),
    ("e = 1 for 1e4 bounces: 1e-13 of the energy a bounce", "disc bouncing"),
    ("needle grains", "needles"),
    ("coincident edges", "coincident edges", "5 by 5 boxes"),
    ("tower of 200 boxes", "tower of 200", "200 boxes"),
    ("a jammed hopper", "jammed hopper"),
    ("light on heavy on light", "light on heavy on light"),
)
"""Cases that a rigid-body code is asked for, and how the names of their rows begin."""

HEAD = """# Hard cases of rigid grains

Scenes whose answers are known, in the plane but for one block in space, by `rigid_lcp` and by three
engines on the same scenes.
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
settings.  Restitution 1 is ContactBounce of 1 in ODE, contacts of stiffness without damping in
MuJoCo (solref of a negative stiffness, zero damping; it has no coefficient of restitution), RST_CLB
in LMGC90.  A peer's force on the rod is what one step of 1 µs does to its velocity: ODE bounds
friction by the normal force there would be without it, one turn of what should go on to the limit;
MuJoCo's convex friction lifts what slides, by a force that goes up as 1/h.  None of them works at
acceleration level, so none can say that there is no force.  A peer's miss says what it was not made
for, not that it is bad.  **Bold**: misses the bar.  Peers that did not run on a case are listed
below the table with the reason.
"""

PICTURE = """
![error against cost a step](rigid-hard-cases.png)

Every mark is an engine on one scene that must rest or move by a known way; errors below 1e-17 m
are drawn there, the line is the bar of most scenes.  Soft contacts are cheap: at equal steps ours
costs more, and is exact to round-off.  The peers' errors are those of their models and tolerances.

Where double precision ends: a force F between two bodies is known to 1e-16 F, and leaves a light
one of mass m a velocity of 1e-16 F h / m after a step.  With a weight of 1e8 m above that is
1e-10 m/s at h = 1 ms, with 1e10 m it is 1e-8 m/s; gaps hold it back across the contacts, so what
is left of it is a walk of 1e-11 m a step at most.  Proximal steps alone end far above that, as
their shift is greater than the eigenvalue of W that moves the heavy body; `rigid_lcp.refinement`
takes the shift out.

"Energy never grows" is of these scenes and bars.  In general time stepping without friction adds
no energy to the second order in the step, as midpoint geometry is exact to that order only where
bodies turn: eight needles of 3000 : 1 that fall upon each other without friction (0.5 s, steps of
1 ms) gain 7.8e-8 J of 13 J in all, 1.6e-9 J at most in a step.  With friction 0.4 they gain 6.3e-7
J, 4.6e-7 J of it in one step, where a body that comes to rest may gain up to `m (g h)^2 / 8` =
4.0e-6 J.

Above the least friction that holds, a slow slide can solve a step of a card house exactly, beside
rest.  A scene at rest whose forces of the step before still solve its step stays at rest: two cards
at 12 degrees, one 1.7 times denser, move by less than 1e-9 m in 0.3 s from 7e-5 above their limit
of 0.749045 on.  The first step has no step before: nearer to the limit (5e-6 above it) the solver
may find the slide there, and the house moves by 4e-7 m in 0.3 s.
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
    parts.append(
        f"Machine: {lines[0]['machine']}; other work ran on it, costs are provisional.  Rows by "
        f"code: {commit_words(lines)}.  Changed files: the record does not hold which; after the "
        "first family the record itself is one, as it is written family by family.\n"
    )
    parts += [*_engines(lines), *_named(mine), PICTURE]
    parts.append("| case | answer | bar | engine | measured | CPU s | steps |\n|" + "---|" * 7)
    shown = [line for line in lines if not _absent(line)]
    parts += [_row(line, before) for line, before in zip(shown, [None, *shown], strict=False)]
    if reasons := [*_reasons(lines), *_unasked(lines)]:
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


def _named(mine: Sequence[Data]) -> list[str]:
    """The named cases: rows of ours, how many meet their bars, and the one nearest to its bar."""
    parts = []
    for words, *beginnings in NAMED:
        rows = [line for line in mine if line["case"].startswith(tuple(beginnings))]
        if rows:
            near = max(rows, key=_share_of_bar)
            met = f"{sum(line['ok'] for line in rows)} of {len(rows)}"
            first = f"{near['case']}, {near['method']}: {_value(near)}"
            bar = f"{near['measure']} {near['bar']} {near['unit']}".rstrip()
            parts.append(f"| {words} | {met} | {first} | {bar} |")
    head = "\n## The named cases\n\n| case | rows met | nearest to its bar | bar |\n|" + "---|" * 4
    return [head, *parts] if parts else []


def _share_of_bar(line: Data) -> float:
    """How near a row is to its bar: 1 at it, more beyond."""
    sign, bar = line["bar"].split()
    if line["value"] is None:
        return inf
    share = line["value"] / float(bar)
    return share if sign == "<=" else 1.0 / max(share, 1e-300)


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


def _unasked(lines: Sequence[Data]) -> list[str]:
    """The cases that no peer was given."""
    given = {line["case"] for line in lines if line["peer"]}
    alone = dict.fromkeys(line["case"] for line in lines if line["case"] not in given)
    return [f"* no peer was given: {'; '.join(alone)}"] if alone else []


def measure(
    quick: bool, only: Sequence[str] | None, resume: bool = False, ours: bool = False,
    theirs: bool = False,
) -> None:  # fmt: skip
    """Run ours and the peers, family after family; each is in the record when it is done.

    ``resume``: families that the record has from the same code and command are left as they are.
    ``ours``: peers do not run, their rows of the same cases are kept; ``theirs``: ours are kept.
    """
    from validation.cases.rigid_hard_cases import FAMILIES, hard_rows
    from validation.rigid_scene_peers import PEERS

    strangers = set(only or ()) - FAMILIES.keys()
    if strangers:
        raise UsageError(
            f"no family {', '.join(sorted(strangers))}", remedy=f"one of {', '.join(FAMILIES)}"
        )
    words = ["python", "-m", "validation.rigid_hard_page", "--run"]
    words += ["--quick"] * quick + ["--ours"] * ours + ["--theirs"] * theirs
    for name in only or FAMILIES:
        origin = provenance([*words, "--only", name])
        if resume and is_measured(_known(name), origin):
            continue
        rows = hard_rows(quick, () if ours else PEERS, [name])[name]
        made = record_lines(rows, origin, name)
        if ours or theirs:
            made = with_known(made, _known(name), peers=ours)
        lines = {each: _known(each) for each in FAMILIES} | {name: made}
        record_write([line for part in lines.values() for line in part])


def with_known(made: Sequence[Data], known: Sequence[Data], *, peers: bool) -> list[Data]:
    """Lines of ours, and after those of each case the peers' lines.

    ``peers``: theirs are the known lines, ours those just made; else the other way round.
    """
    keys = ("case", "measure")
    lines = []
    for case in dict.fromkeys(tuple(line[key] for key in keys) for line in made):
        for group, peer in ((made if peers else known, False), (known if peers else made, True)):
            lines += [
                line
                for line in group
                if line["peer"] == peer and tuple(line[key] for key in keys) == case
            ]
    return lines


def _known(family: str) -> list[Data]:
    lines = record_read() if RECORD.is_file() else []
    return [line for line in lines if line["family"] == family]


def is_measured(lines: Sequence[Data], origin: Data) -> bool:
    """Whether our lines of a family come from the same code, command and machine."""
    keys = ("commit", "command", "machine")
    mine = [line for line in lines if not line["peer"]]
    return bool(mine) and all(line[key] == origin[key] for line in mine for key in keys)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line; run if asked; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--run", action="store_true", help="measure first, and write the record")
    parser.add_argument("--quick", action="store_true", help="short runs")
    parser.add_argument("--ours", action="store_true", help="leave the rows of peers as they are")
    parser.add_argument("--theirs", action="store_true", help="leave our rows as they are")
    parser.add_argument("--resume", action="store_true", help="leave out what is measured already")
    parser.add_argument("--only", nargs="+", metavar="FAMILY", help="measure these again only")
    arguments = parser.parse_args(words)
    if arguments.run:
        measure(arguments.quick, arguments.only, arguments.resume, arguments.ours, arguments.theirs)
    lines = record_read()
    write_atomically(PAGE, page(lines))
    picture_draw(lines, PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
