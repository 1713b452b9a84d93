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
    Duel,
    Limits,
    Summary,
    duels,
    gain_most,
    limits_of,
    near,
    summaries,
)
from validation.rigid_ballast_measures import settlement_law
from validation.rigid_ballast_picture import picture_draw, short_name
from validation.rigid_ballast_runs import RECORD, rows_read

PAGE = Path(__file__).parents[1] / "docs" / "rigid-ballast.md"
TEXT = Path(__file__).with_name("rigid_ballast_page.md")
Row = dict[str, Any]


def page(rows: Sequence[Row]) -> str:
    """The page as Markdown: `rigid_ballast_page.md` with its gaps filled."""
    limits = limits_of(rows)
    found = summaries(rows, limits)
    beds = [row for row in rows if row["kind"] == "bed"]
    most = max(s.beds for s in found)
    cycles = max(len(s.curve) for s in found)
    tilted = sum(row["kind"] == "no bed" and "tilted" in row["why"] for row in rows)
    return TEXT.read_text(encoding="utf-8").format(
        beds=most, cycles=cycles, verdict=verdict(limits, found),
        levels=levels_table(found), duels=duels_table(duels(found)), laws=laws_table(found),
        fabric=fabric_table(found), energies=energies_table(found), elastic=elastic_table(found),
        gain=gains(rows), failures=failures(rows), poured=len(beds) + tilted, unused=tilted,
        prepared=f"{np.mean([row['cpu_s'] for row in beds]):.2g}",
        machine=beds[0]["machine"], commits=", ".join(sorted({row["commit"] for row in rows})),
        damping=beds[0]["damping"],
    )  # fmt: skip


def verdict(limits: Limits, found: Sequence[Summary]) -> str:
    """The findings in sentences, each number from the record."""
    wide = limits.interval > 0.5 * limits.mean
    one = "differ" if not limits.agree else "agree"
    if limits.agree and wide:
        one = "are not shown to meet (nor to differ: the interval is wider than half the mean)"
    lines = [
        f"* The two limits {one}: rigid ({limits.rigid}) less soft ({limits.soft}) is "
        f"{1e3 * limits.difference:+.3f} ± {1e3 * limits.interval:.3f} mm in the mean of "
        f"{len(limits.reference)} beds, of a mean rigid settlement of {1e3 * limits.mean:.3f} mm; "
        "the tables have the medians too."
    ]
    if isfinite(limits.soft_limit):
        lines.append(
            f"* Extrapolated from the three stiffest levels (Aitken) the soft mean tends to "
            f"{1e3 * limits.soft_limit:.3f} mm."
        )
    for method, words in (("rigid", "rigid grains, by their step"),
                          ("soft", "soft grains, by their stiffness")):  # fmt: skip
        mine = [s for s in found if s.method == method]
        listed = ", ".join(f"{1e3 * s.median:.3f} mm ({short_name(s)})" for s in mine)
        lines.append(f"* Median settlement, {words}: {listed}.")
    paper = [s for s in found if s.level["value"] == 1e-3]
    rigid = min(paper, key=lambda s: s.level["extra"], default=None)  # the finer forces
    if rigid is None:
        return "\n".join(lines)
    own = 1e6 * _step_cost(rigid)
    soft = [1e6 * _step_cost(s) for s in found if s.method == "soft"]
    lines.append(
        f"* A rigid step ({rigid.name}) costs {own:,.0f} us, a soft one {min(soft):.0f} to "
        f"{max(soft):.0f} us; ten load cycles cost {rigid.cost:.2g} s with it, and "
        + ", ".join(f"{s.cost:.2g} s ({short_name(s)})" for s in found if s.method == "soft")
        + " with soft grains: of the same order for the stiff ones, as the paper says."
    )
    duel = next((d for d in duels(found) if d.rigid is rigid), None)
    if rigid.is_limit:
        lines.append("* Steps of 1e-3 s are the finest that were run: they are the reference.")
    elif duel is None or duel.soft is None:
        lines.append(
            "* No soft level that was run is as near to the reference as rigid steps of 1e-3 s; as "
            "the reference is a rigid one, that is a statement on hard grains only."
        )
    else:
        lines.append(
            f"* At equal error of the median ({100 * near(rigid):.0f} % with rigid steps of 1 ms, "
            f"{100 * near(duel.soft):.0f} % with {duel.soft.name}) soft grains take steps of "
            f"{duel.soft.step:.1e} s, {rigid.step / duel.soft.step:,.0f} times shorter, and cost "
            f"{duel.soft.cost:.2g} s against {rigid.cost:.2g} s: {duel.cost_ratio:.2g} times."
        )
    return "\n".join(lines)


def _step_cost(summary: Summary) -> float:
    """Processor time of a step [s]."""
    return summary.cost * summary.step / _seconds(summary)


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join([_row(head), "|" + "---|" * len(head), *map(_row, rows)])


def levels_table(found: Sequence[Summary]) -> str:
    """Every level: settlement, error, cost."""
    head = ("level", "beds", "settlement after 1 [mm]", "after the last [mm]",
            "median [mm]", "error of the mean [%]", "of the median [%]",
            "CPU s a run", "step [s]", "CPU a step [us]")  # fmt: skip
    return _table(head, [
        (f"{s.method}: {s.name}" + (" (limit)" if s.is_limit else ""), f"{s.beds}",
         f"{1e3 * s.curve[0]:.3f}", f"{1e3 * s.settlement:.3f} ± {1e3 * s.interval:.3f}",
         f"{1e3 * s.median:.3f}", f"{100 * s.bias:+.0f} ± {100 * s.bias_interval:.0f}",
         f"{100 * s.median_bias:+.0f}", f"{s.cost:.2g}", f"{s.step:.1e}",
         f"{1e6 * _step_cost(s):.0f}")
        for s in found
    ])  # fmt: skip


def _seconds(summary: Summary) -> float:
    from validation.rigid_ballast_bed import PERIOD, REST

    return REST + PERIOD * len(summary.curve)


def duels_table(found: Sequence[Duel]) -> str:
    """Cost at equal error."""
    head = ("rigid level", "error [%]", "CPU s", "cheapest soft level that errs no more",
            "error [%]", "CPU s", "cost soft / rigid", "step rigid / soft")  # fmt: skip
    rows = []
    for duel in found:
        mine, other = duel.rigid, duel.soft
        theirs = ("none", "", "", "", "") if other is None else (
            other.name, f"{100 * near(other):.0f}", f"{other.cost:.2g}",
            f"{duel.cost_ratio:.2g}", f"{mine.step / other.step:,.0f}",
        )  # fmt: skip
        rows.append((mine.name, f"{100 * near(mine):.0f}", f"{mine.cost:.2g}", *theirs))
    return _table(head, rows)


def laws_table(found: Sequence[Summary]) -> str:
    """Both laws fitted to the mean curves."""
    head = ("level", "log: a [mm]", "b [mm]", "rms [um]", "linear: a [mm]", "b [mm a cycle]",
            "rms [um]")  # fmt: skip
    rows = []
    for s in found:
        cells = [f"{s.method}: {s.name}"]
        for kind in ("log", "linear"):
            a, b, off = settlement_law(s.curve, kind)
            cells += [f"{1e3 * a:.4f}", f"{1e3 * b:.4f}", f"{1e6 * off:.1f}"]
        rows.append(cells)
    return _table(head, rows)


def fabric_table(found: Sequence[Summary]) -> str:
    """Fabric under the last peak load."""
    head = ("level", "coordination", "contact points", "anisotropy", "of forces", "sliding",
            "largest / mean force", "below the mean")  # fmt: skip
    return _table(head, [
        (f"{s.method}: {s.name}", f"{s.fabric['coordination']:.2f}", f"{s.fabric['contacts']:.0f}",
         f"{s.fabric['anisotropy']:.2f}", f"{s.fabric['force_anisotropy']:.2f}",
         f"{100 * s.fabric['sliding']:.0f} %", f"{s.fabric['force_largest']:.1f}",
         f"{100 * s.fabric['force_below_mean']:.0f} %")
        for s in found
    ])  # fmt: skip


def energies_table(found: Sequence[Summary]) -> str:
    """Energy dissipated a cycle."""
    last = len(found[0].lost)
    shown = [n for n in (1, 2, 5, last) if n <= last]
    head = ("level", *(f"cycle {n} [J/m]" for n in shown))
    return _table(head, [
        (f"{s.method}: {s.name}", *(f"{s.lost[n - 1]:.3g}" for n in shown)) for s in found
    ])  # fmt: skip


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


def elastic_table(found: Sequence[Summary]) -> str:
    """What rigid grains leave out, by stiffness."""
    scene = bed_scene(Bed(1))
    stones = [body for body in scene.bodies if body.movable and body.name != "sleeper"]
    mass = float(np.mean([body.mass for body in stones]))
    size = float(np.mean([2 * body.shape.reach for body in stones]))
    rows = []
    for s in found:
        if s.method == "soft" and s.level["extra"] == 0.05:
            k = s.level["value"]
            rows.append((f"{k:.0e}", f"{1e3 * s.deflection:.4f}", f"{s.step:.1e}",
                         f"{size * (k / mass) ** 0.5:.0f}"))  # fmt: skip
    head = (
        "k [N/m]",
        "elastic recoil of the sleeper [mm]",
        "step [s]",
        "wave speed d √(k/m) [m/s]",
    )
    return _table(head, rows)


def failures(rows: Sequence[Row]) -> str:
    """Runs that did not go to their end, and why."""
    lost = [row for row in rows if row["kind"] in ("rigid", "soft") and not row["ok"]]
    lost += [row for row in rows if row["kind"] == "no bed" and "tilted" not in row["why"]]
    if not lost:
        return "Every run went to its end."
    return "\n".join(f"* {row.get('name', 'pouring')}, seed {row['bed']['seed']}: {row['why']}"
                     for row in lost)  # fmt: skip


def main() -> None:
    """Write page and picture."""
    rows = rows_read(RECORD)
    write_atomically(PAGE, page(rows))
    limits = limits_of(rows)
    picture_draw(rows, summaries(rows, limits), limits, PAGE.with_suffix(".png"))
    print(PAGE)


if __name__ == "__main__":
    main()
