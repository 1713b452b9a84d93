"""Tables of docs/rigid-ballast.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.rigid_ballast_bed import PERIOD, REST, Bed, bed_scene
from validation.rigid_ballast_judge import WITHIN, Summary, cheapest, cost_ratio
from validation.rigid_ballast_md import STEP_SHARE
from validation.rigid_ballast_measures import settlement_law
from validation.rigid_ballast_picture import short_name
from validation.rigid_ballast_push import Push, equal_error_cost

Row = dict[str, Any]


def table_of(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def percent(summary: Summary) -> str:
    """Error of a level and its interval [%]."""
    return f"{100 * summary.error:+.0f} ± {100 * summary.error_interval:.0f}"


def step_cost(summary: Summary) -> float:
    """Processor time of a step [s]."""
    return summary.cost * summary.step / (REST + PERIOD * len(summary.curve))


def levels_table(found: Sequence[Summary]) -> str:
    """Every level: settlement, error, cost."""
    head = ("level", "beds", "settlement after 1 [mm]", "after the last [mm]", "median [mm]",
            "error [%]", "CPU s a run", "step [s]", "CPU a step [us]")  # fmt: skip
    return table_of(head, [
        (f"{s.method}: {s.name}" + (" (limit)" if s.is_limit else ""), f"{s.beds}",
         f"{1e3 * s.curve[0]:.2f}", f"{1e3 * s.settlement:.2f} ± {1e3 * s.interval:.2f}",
         f"{1e3 * s.median:.2f}", percent(s), f"{s.cost:.2g} ± {s.cost_interval:.1g}",
         f"{s.step:.1e}", f"{1e6 * step_cost(s):,.0f}")
        for s in found
    ])  # fmt: skip


def duels_table(found: Sequence[Summary]) -> str:
    """Cost at equal error."""
    head = ("error at most", "", "rigid level", "CPU s", "soft level", "CPU s",
            "cost soft / rigid (95 %)", "step rigid / soft")  # fmt: skip
    rows = []
    for most in WITHIN:
        for shown in (True, False):
            ours, theirs = (cheapest(found, m, most, shown) for m in ("rigid", "soft"))
            cells = [f"{100 * most:.0f} %", "shown" if shown else "not excluded"]
            for s in (ours, theirs):
                cells += ["none", ""] if s is None else [f"{short_name(s)} ({percent(s)} %)",
                                                         f"{s.cost:.2g}"]  # fmt: skip
            if ours is None or theirs is None:
                rows.append([*cells, "", ""])
                continue
            ratio, low, high = cost_ratio(theirs, ours)
            rows.append([*cells, f"{ratio:.2g} ({low:.2g} to {high:.2g})",
                         f"{ours.step / theirs.step:,.0f}"])  # fmt: skip
    return table_of(head, rows)


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
    return table_of(head, rows)


def fabric_table(found: Sequence[Summary]) -> str:
    """Fabric under the last peak load."""
    head = ("level", "coordination", "contact points", "anisotropy", "of forces", "sliding",
            "largest / mean force", "below the mean")  # fmt: skip
    return table_of(head, [
        (f"{s.method}: {s.name}", f"{s.fabric['coordination']:.2f}", f"{s.fabric['contacts']:.0f}",
         f"{s.fabric['anisotropy']:.2f}", f"{s.fabric['force_anisotropy']:.2f}",
         f"{100 * s.fabric['sliding']:.0f} %", f"{s.fabric['force_largest']:.1f}",
         f"{100 * s.fabric['force_below_mean']:.0f} %")
        for s in found
    ])  # fmt: skip


def energies_table(found: Sequence[Summary]) -> str:
    """Energy dissipated a cycle."""
    last = len(found[0].lost)
    shown = sorted({n for n in (1, 2, 5, last) if n <= last})
    head = ("level", *(f"cycle {n} [J/m]" for n in shown))
    return table_of(head, [
        (f"{s.method}: {s.name}", *(f"{s.lost[n - 1]:.3g}" for n in shown)) for s in found
    ])  # fmt: skip


def elastic_table(found: Sequence[Summary]) -> str:
    """What rigid grains leave out, by stiffness."""
    scene = bed_scene(Bed(1))
    stones = [body for body in scene.bodies if body.movable and body.name != "sleeper"]
    mass = float(np.mean([body.mass for body in stones]))
    size = float(np.mean([2 * body.shape.reach for body in stones]))
    rows = []
    for s in found:
        if s.method == "soft" and s.level["extra"] == STEP_SHARE:
            k = s.level["value"]
            rows.append((f"{k:.0e}", f"{1e3 * s.deflection:.4f}", f"{s.step:.1e}",
                         f"{size * (k / mass) ** 0.5:.0f}"))  # fmt: skip
    head = (
        "k [N/m]",
        "elastic recoil of the sleeper [mm]",
        "step [s]",
        "wave speed d √(k/m) [m/s]",
    )
    return table_of(head, rows)


def push_table(pushes: Sequence[Push]) -> str:
    """The first push, level by level."""
    head = ("level", "sunk at the peak [mm]", "error on the way: median [um]", "largest [um]",
            "dissipated [J/m]", "CPU s", "steps")  # fmt: skip
    return table_of(head, [
        (f"{p.method}: {p.name}" + (" (limit)" if p.is_limit else ""), f"{1e3 * p.sunk:.3f}",
         f"{1e6 * p.error:.3g}", f"{1e6 * max(p.errors.values()):.3g}", f"{p.dissipated:.2f}",
         f"{p.cost:.2g}", f"{p.steps:,.0f}")
        for p in pushes
    ])  # fmt: skip


def push_duels_table(pushes: Sequence[Push]) -> str:
    """Cost of soft grains at the error that rigid steps have in the first push."""
    soft = [p for p in pushes if p.method == "soft" and not p.is_limit]
    rows = []
    for p in pushes:
        if p.method == "rigid" and not p.is_limit:
            most = f"more than {soft[-1].cost / p.cost:.2g}" if soft else "unknown"
            ratio, low, high = (f"{x:.2g}" if np.isfinite(x) else most
                                for x in equal_error_cost(p, soft))  # fmt: skip
            rows.append((p.name, f"{1e6 * p.error:.3g}", f"{p.cost:.2g}",
                         f"{ratio} ({low} to {high})"))  # fmt: skip
    head = ("rigid level", "median error [um]", "CPU s", "cost soft / rigid at that error (95 %)")
    return table_of(head, rows)
