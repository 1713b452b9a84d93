"""Tables of the solver page beside the race: costs at equal residual, large beds, Dantzig."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from validation import rigid_report as report
from validation.commit_words import commit_short
from validation.rigid_report import Row
from validation.rigid_runs import LADDER, LARGE

PARTS = {
    "rigid-solvers": "race", "rigid-scale": "large packings", "rigid-motion": "bed in motion",
    "rigid-dantzig": "Dantzig's algorithm", "rigid-dantzig-trace": "Dantzig's algorithm",
}  # fmt: skip
"""What the cases of the record are called on the page."""
FEW_METHODS = 4
"""So many methods of the race are named one by one."""


def codes_words(rows: Sequence[Row]) -> str:
    """A line for each code: what it ran, and how many runs that were."""
    made: dict[str, Counter[str]] = {}
    methods: dict[str, set[str]] = {}
    for row in rows:
        code = commit_short(row["commit"])
        made.setdefault(code, Counter())[PARTS[row["case"]]] += 1
        if row["case"] == "rigid-solvers":
            methods.setdefault(code, set()).add(row["method"])
    lines = []
    for code, counted in sorted(made.items(), key=lambda each: -each[1].total()):
        ran = methods.get(code, set())
        named = f" ({', '.join(sorted(ran))})" if 0 < len(ran) <= FEW_METHODS else ""
        parts = [f"{part} {n:,}{named * (part == 'race')}" for part, n in counted.items()]
        lines.append(f"- {code}: {', '.join(parts)}")
    return "\n".join(lines)


def ladder_table(rows: Sequence[Row]) -> str:
    """Costs at equal residual on packings of `LARGE` to 5,000 contacts, beside Siconos."""
    found = {
        name: each for name, each in report.packings_between(rows, LARGE, 5000).items()
        if report.starting(each, "Siconos")
    }  # fmt: skip
    if not found:
        return ""
    lines = [
        "## Packings beside Siconos, at equal residual",
        "",
        "Cell: cost of `solve_friction`, of the best solver of Siconos, and the latter over the "
        "former; -: not reached in the time it had. Last column: the same at the least residual of "
        "any of Siconos's runs, for which `solve_friction` was asked where it is above 1e-12.",
        "",
        f"| packing | contacts | {' | '.join(powers([level]) for level in LADDER)} | least |",
        f"|---|---|{'---|' * (len(LADDER) + 1)}",
    ]
    for name, each in found.items():
        cells = []
        for _, ours, theirs in report.ladder(each, LADDER):
            words = [seconds(cost) if np.isfinite(cost) else "-" for cost in (ours, theirs)]
            if np.isfinite(ours) and np.isfinite(theirs):
                words.append(f"{theirs / ours:.2g} x")
            cells.append(", ".join(words))
        error, lead = report.siconos_lead(each)
        cells.append(f"{error:.1e}, {lead:.2g} x")
        lines.append(f"| {name} | {each[0]['contacts']:,} | {' | '.join(cells)} |")
    return "\n".join(lines)


def scale_table(rows: Sequence[Row]) -> str:
    """Large packings, where they are recorded."""
    made = [row for row in rows if row["case"] == "rigid-scale"]
    if not made:
        return ""
    lines = [
        "## Large packings",
        "",
        "Warm: from the impulses of the time step before, whose residual is given.",
        "",
        "| packing | contacts | residual at the start | residual | cost | bar | by |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in made:
        begun = f"{row['start_error']:.1e}" if row["setting"]["warm"] else "(zero forces)"
        lines.append(
            f"| {row['problem']} | {row['contacts']:,} | {begun} | {row['error']:.1e} | "
            f"{seconds(row['cost_s'])} | {row['bar_s']:g} s | {row['by']} |"
        )
    return "\n".join(lines)


def motion_table(rows: Sequence[Row]) -> str:
    """Steps of a large bed in motion, where they are recorded."""
    made = [row for row in rows if row["case"] == "rigid-motion"]
    if not made:
        return ""
    lines = [
        "## A large bed in motion",
        "",
        "Whole time steps (contacts found, forces solved, overlaps removed), each from the forces"
        " of the one before; `validation/rigid_motion_runs.py` says what moves.",
        "",
        "| bed | contacts | residual asked for | median | worst | steps above it | median step |"
        " 99 % | worst | bar |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in made:
        lines.append(
            f"| {row['problem']} | {row['contacts']:,} | {row['setting']['tolerance']:.0e} | "
            f"{row['error_median']:.1e} | {row['error']:.1e} | {row['steps_above']} of "
            f"{row['setting']['steps']} | {seconds(row['cost_s'])} | "
            f"{seconds(row['cost_99_s'])} | {seconds(row['cost_worst_s'])} | {row['bar_s']:g} s |"
        )
    return "\n".join(lines)


def dantzig_table(rows: Sequence[Row]) -> str:
    beds = report.dantzig_beds(rows)
    if not beds:
        return ""
    lines = [
        "| packing | contacts | friction | slide | as in the paper | with reversal of the driven "
        "force |",
        "|---|---|---|---|---|---|",
    ]
    for bed, contacts in beds.items():
        monotone, reversal = (
            report.dantzig_success(rows, method, bed) for method in ("dantzig", "dantzig, reversal")
        )
        sliding = report.dantzig_sliding(rows, bed)
        for friction, (solved, orders) in monotone.items():
            other = reversal.get(friction, (0, 0))
            lines.append(
                f"| {bed} | {contacts} | {friction:g} | {sliding[friction] if friction else '-'} | "
                f"{solved} of {orders} | "
                f"{other[0]} of {other[1]} |"
            )
    ends = report.dantzig_ends(rows)
    if ends:
        told = "; ".join(
            f"{method}: {end}, {how} ({n})" for (method, end, how), n in sorted(ends.items())
        )
        lines += ["", f"How the others ended: {told}.  {DANTZIG_WORDS}", "", _by_bed(rows)]
    shown = report.trace(rows)
    if shown is not None:
        steps = [event[5] for event in shown["events"]]
        still = next((k for k, step in enumerate(reversed(steps)) if step > 0), len(steps))
        _, _, contact, origin, target, *_ = shown["events"][-1]
        lines += [
            "",
            f"The run in the picture ({shown['bed']}, friction "
            f"{shown['setting']['friction']:g}, order {shown['seed']}) ends after "
            f"{shown['work']} changes of lists with {still} of length "
            f"zero: contact {contact} goes from {target} to {origin} and back.",
        ]
    return "\n".join(lines)


DANTZIG_WORDS = (
    "With reversal the driven force may fall after an event (Keller's path); back at zero, nothing "
    "is left of the drive, and the contact is as inconsistent as it was."
)


def _by_bed(rows: Sequence[Row]) -> str:
    """Orders that were solved with friction, bed by bed, all frictions together."""
    told = []
    for bed in report.dantzig_beds(rows):
        both = [
            [each for friction, each in report.dantzig_success(rows, method, bed).items()
             if friction > 0]
            for method in ("dantzig", "dantzig, reversal")
        ]  # fmt: skip
        solved = " and ".join(str(sum(count for count, _ in each)) for each in both)
        told.append(f"{bed} {solved} of {sum(orders for _, orders in both[0])}")
    return (
        f"All frictions but zero together, as in the paper and with reversal: {'; '.join(told)}.  "
        "More discs settled by the same code do not fare better than few, so it is not the size.  "
        "discs_125 was settled by other code, and more of its contacts slide."
    )


def powers(levels: Sequence[float]) -> str:
    return ", ".join(f"{level:.0e}".replace("e-0", "e-") for level in levels)


def seconds(cost: float) -> str:
    return f"{cost:.1g} s" if cost < 0.01 else f"{cost:.2g} s"
