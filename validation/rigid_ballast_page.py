"""docs/rigid-ballast.md and .png from validation/results/rigid-ballast.jsonl.

python -m validation.rigid_ballast_page
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from adapters.run_folder import write_atomically
from validation.rigid_ballast_bed import Bed, bed_scene
from validation.rigid_ballast_judge import (
    WITHIN,
    Limits,
    Summary,
    cheapest,
    cost_ratio,
    gain_most,
    limits_of,
    summaries,
)
from validation.rigid_ballast_md import STEP_SHARE
from validation.rigid_ballast_picture import picture_draw, short_name
from validation.rigid_ballast_push import (
    Push,
    damped_words,
    equal_error_cost,
    long_words,
    push_findings,
    pushes_of,
)
from validation.rigid_ballast_runs import BEDS, PICTURED, RECORD, TOLERANCE, rows_read
from validation.rigid_ballast_tables import (
    duels_table,
    elastic_table,
    energies_table,
    fabric_table,
    laws_table,
    levels_table,
    percent,
    push_duels_table,
    push_table,
    step_cost,
)

PAGE = Path(__file__).parents[1] / "docs" / "rigid-ballast.md"
TEXT = Path(__file__).with_name("rigid_ballast_page.md")
Row = dict[str, Any]


def page(rows: Sequence[Row]) -> str:
    """The page as Markdown: `rigid_ballast_page.md` with its gaps filled."""
    limits = limits_of(rows)
    found = summaries(rows, limits)
    beds = [row for row in rows if row["kind"] == "bed"]
    unused = sum(row["kind"] == "no bed" for row in rows)
    pushes = pushes_of(rows)
    return TEXT.read_text(encoding="utf-8").format(
        beds=len(limits.reference), cycles=len(found[0].curve),
        verdict=verdict(limits, found, pushes),
        levels=levels_table(found), duels=duels_table(found), laws=laws_table(found),
        fabric=fabric_table(found), energies=energies_table(found), elastic=elastic_table(found),
        gain=gains(rows), failures=failures(rows, len(limits.reference)),
        count=len(beds) + unused, planned=BEDS,
        unused="all were used" if not unused else f"{unused} gave no bed",
        turn=turn_words(rows), kept=kept_words(rows), unloaded=unloaded_words(rows),
        long=long_words(rows),
        push_beds=len(pushes[0].errors) if pushes else 0, pushes=push_table(pushes),
        damped=damped_words(rows, PICTURED[0].name), push_words=push_findings(pushes),
        push_duels=push_duels_table(pushes),
        within=" and ".join(f"{100 * most:.0f} %" for most in WITHIN),
        prepared=f"{np.mean([row['cpu_s'] for row in beds]):.2g}",
        machine=beds[0]["machine"], commits=", ".join(sorted({row["commit"] for row in rows})),
        damping=beds[0]["damping"],
    )  # fmt: skip


def verdict(limits: Limits, found: Sequence[Summary], pushes: Sequence[Push]) -> str:
    """The findings in sentences, each number from the record."""
    share = limits.difference / limits.mean
    lines = [
        f"* **The two limits {'can not be told apart' if limits.agree else 'differ'}.** Rigid "
        f"({limits.rigid}) less soft ({limits.soft}) is {1e3 * limits.difference:+.2f} ± "
        f"{1e3 * limits.interval:.2f} mm in the mean of {len(limits.reference)} beds, that is "
        f"{100 * share:+.0f} ± {100 * limits.interval / limits.mean:.0f} % of their mean, "
        f"{1e3 * limits.mean:.2f} mm."
    ]
    for method, words in (("rigid", "rigid grains, by their step"),
                          ("soft", "soft grains, by their stiffness")):  # fmt: skip
        listed = ", ".join(
            f"{1e3 * s.settlement:.1f} ± {1e3 * s.interval:.1f} mm ({short_name(s)})"
            for s in found if s.method == method
        )  # fmt: skip
        lines.append(f"* Mean settlement, {words}: {listed}.")
    paper = next((s for s in found if s.method == "rigid" and s.level["value"] == 1e-3
                  and s.level["extra"] == TOLERANCE), None)  # fmt: skip
    if paper is None:
        return "\n".join(lines)
    soft = [s for s in found if s.method == "soft"]
    steps = [1e6 * step_cost(s) for s in soft]
    lines.append(
        f"* **Steps of 1e-3 s** ({paper.name}) err by {percent(paper)} % and cost "
        f"{paper.cost:.1f} ± {paper.cost_interval:.1f} s a run, {1e6 * step_cost(paper):,.0f} us "
        f"a step; soft steps cost {min(steps):.0f} to {max(steps):.0f} us."
    )
    lines += [claim(paper, other) for other in soft if other.level["extra"] == STEP_SHARE]
    lines.append(section_ten(paper, found))
    lines += [first_push(p, pushes) for p in pushes if p.method == "rigid"
              and p.level["value"] == 1e-3 and not p.is_limit]  # fmt: skip
    return "\n".join(lines)


def first_push(paper: Push, pushes: Sequence[Push]) -> str:
    """The paper's step in the first push, bed by bed."""
    soft = [p for p in pushes if p.method == "soft" and not p.is_limit]
    nearest = min(soft, key=lambda p: p.error)
    ratio, low, high = (f"{x:.2g}" if isfinite(x) else f"more than {soft[-1].cost / paper.cost:.2g}"
                        for x in equal_error_cost(paper, soft))  # fmt: skip
    return (
        f"* **In the first push**, where single beds can be compared, steps of 1e-3 s are "
        f"{1e6 * paper.error:.0f} um from the mean of both finest levels (median of "
        f"{len(paper.errors)} beds) in {paper.cost:.2g} s and {paper.steps:.0f} steps; soft grains "
        f"at that error cost {ratio} ({low} to {high}) times as much; the nearest of them "
        f"({nearest.name}) is {1e6 * nearest.error:.0f} um from it in {nearest.cost:.2g} s and "
        f"{nearest.steps:,.0f} steps."
    )


def section_ten(paper: Summary, found: Sequence[Summary]) -> str:
    """The paper's claim at equal error: that which rigid steps of 1e-3 s are shown to keep."""
    most = abs(paper.error) + paper.error_interval
    shown, open_ = (cheapest(found, "soft", most, well) for well in (True, False))
    words = (
        "* **Section 10 at equal error.** Rigid steps of 1e-3 s err by "
        f"{100 * most:.0f} % at most (95 %). "
    )
    if open_ is None:
        return words + "Every soft level that was run is shown to err by more."
    words += (
        f"The cheapest soft level that is not shown to err by more has {short_name(open_)}, steps "
        f"of {open_.step:.1e} s and {ratio_words(open_, paper)} times the cost"
    )
    if shown is None:
        return words + "; none is shown to err as little."
    return words + (
        f"; the cheapest that is shown to err as little has {short_name(shown)}, steps of "
        f"{shown.step:.1e} s and {ratio_words(shown, paper)} times the cost."
    )


def ratio_words(soft: Summary, rigid: Summary) -> str:
    """Cost of soft over rigid grains with its interval."""
    ratio, low, high = cost_ratio(soft, rigid)
    return f"{ratio:.2g} ({low:.2g} to {high:.2g})"


def claim(paper: Summary, soft: Summary) -> str:
    """The paper's claim against one soft level: its error, its step and its cost beside ours."""
    return (
        f"  * against {short_name(soft)}: errs by {percent(soft)} %, steps {soft.step:.1e} s, "
        f"{paper.step / soft.step:,.0f} times shorter; costs {ratio_words(soft, paper)} times as "
        "much."
    )


def turn_words(rows: Sequence[Row]) -> str:
    """The most that the sleeper turns, by the number of cycles."""
    turns: dict[int, list[float]] = {}
    for row in rows:
        if row["kind"] in ("rigid", "soft", "long") and row["ok"]:
            turns.setdefault(row["cycles"], []).append(abs(row["tilt"]))
    return " and ".join(
        f"{max(found):.1e} rad at most in {cycles} cycles ({len(found)} runs)"
        for cycles, found in sorted(turns.items())
    )


def kept_words(rows: Sequence[Row]) -> str:
    """Rigid runs whose every step has the residual asked for, and the worst step of the others."""
    runs = [row for row in rows if row["kind"] == "rigid" and row["ok"]]
    missed = [
        f"{row['residual'] / row['level']['extra']:.1f} times that ({row['name']}, seed "
        f"{row['bed']['seed']})"
        for row in runs
        if row["residual"] > row["level"]["extra"]
    ]
    if not missed:
        return f"all {len(runs)} runs"
    return (
        f"{len(runs) - len(missed)} of {len(runs)} runs; the worst step of the others leaves "
        f"{', '.join(missed)}"
    )


def unloaded_words(rows: Sequence[Row]) -> str:
    """Stones of the pictures that no contact force acts on."""
    words = []
    for row in (row for row in rows if row["kind"] == "state"):
        bodies = bed_scene(Bed(**row["bed"])).bodies
        force, pair = np.array(row["contacts"]["force"]), np.array(row["contacts"]["bodies"])
        loaded = set(pair[force[:, 0] > 0].ravel().tolist())
        stones = {n for n, body in enumerate(bodies) if body.movable and body.name != "sleeper"}
        words.append(f"{len(stones - loaded)} of {len(stones)} ({row['level']['method']} grains)")
    return ", ".join(words)


def gains(rows: Sequence[Row]) -> str:
    """The most energy gained in a cycle, step by step."""
    ours = [row for row in rows if row["kind"] == "rigid" and row["ok"]]
    steps = sorted({row["level"]["value"] for row in ours}, reverse=True)
    found = []
    for step in steps:
        mine = [row for row in ours if row["level"]["value"] == step]
        joules = max(0.0, -min(min(row["dissipated"]) for row in mine))
        share = max(0.0, gain_most(mine))
        found.append(f"{joules:.1e} J/m at {1e3 * step:g} ms ({share:.1e} of its run's worst loss)")
    return ", ".join(found)


def failures(rows: Sequence[Row], beds: int) -> str:
    """Runs that did not go to their end, and why; beds that are still to be run."""
    lost = [row for row in rows if row["kind"] != "bed" and row.get("why")]
    lines = [f"* {row['kind']}, {row.get('name', 'pouring')}, seed {row['bed']['seed']}: "
             f"{row['why']}" for row in lost]  # fmt: skip
    if beds < BEDS:
        lines.append(f"* {beds} of {BEDS} planned beds are in the record so far.")
    return "\n".join(lines) or "Every run went to its end."


def main() -> None:
    """Write page and picture."""
    rows = rows_read(RECORD)
    write_atomically(PAGE, page(rows))
    picture_draw(rows, summaries(rows, limits_of(rows)), pushes_of(rows), PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
