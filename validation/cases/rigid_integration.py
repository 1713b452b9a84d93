"""Orders of both methods, step control, drift of gaps, collisions and bounces without end.

    trackbed validate rigid-integration            some minutes
    trackbed validate rigid-integration --quick    fewer and shorter runs

Ours only; `python -m validation.rigid_integration_page --run` runs MuJoCo, ODE and LMGC90 on the
same scenes too and writes ``docs/rigid-integration.md``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain, pairwise

from rigid_lcp.runge_kutta import CLEAN_STEPS
from validation.case import Check
from validation.rigid_integration_collisions import closed_form_rows, energy_rows
from validation.rigid_integration_impacts import impact_rows, impacts
from validation.rigid_integration_order import (
    METHODS,
    PROBLEMS,
    OrderRow,
    order_fitted,
    order_rows,
)
from validation.rigid_integration_steps import Drift, Trace, drifts, traces
from validation.rigid_integration_zeno import Zeno, cut_off, zeno_rows

ORDERS = {
    ("stone in free flight", "acceleration"): 3.7,
    ("stone in free flight", "time-stepping"): 1.8,
    ("prism slides and turns", "acceleration"): 3.7,
    ("prism slides and turns", "time-stepping"): 0.8,
}
"""Least order of smooth motions: four of Runge-Kutta, two of time stepping, but one where the
direction of friction turns, as it is that of the end of the step."""
GREATEST = {
    ("disc skids, then rolls", "acceleration"): 1e-12,
    ("disc skids, then rolls", "time-stepping"): 2e-4,
    ("rod tips over an edge", "acceleration"): 1e-4,
    ("rod tips over an edge", "time-stepping"): 1e-4,
    ("block rocks, two impacts", "acceleration"): 1e-7,
    ("block rocks, two impacts", "time-stepping"): 2e-2,
    ("box falls on its corner", "acceleration"): 1e-9,
    ("box falls on its corner", "time-stepping"): 2e-2,
}
"""Greatest error of any step where events decide it: of the order of the longest step's way."""


def run(quick: bool) -> list[Check]:
    """All checks."""
    return [
        *order_checks(list(order_rows(quick, peers=False))),
        *chain.from_iterable(trace_checks(each) for each in traces(0.05 if quick else 0.3)),
        *(drift_check(each) for each in drifts(quick)),
        *(row.check() for row in closed_form_rows()),
        *(row.check() for row in energy_rows(5 if quick else 100)),
        *(row.check() for each in impacts(quick) for row in impact_rows(each, peers=False)),
        *zeno_checks(zeno_rows(quick, peers=False)),
    ]


def below(name: str, value: float, bar: float) -> Check:
    """A value that may not be above its bar."""
    return Check(name, value, f"<= {bar:g}", value <= bar)


def order_checks(rows: Sequence[OrderRow]) -> list[Check]:
    """Orders where motions are smooth, else errors; both methods end at one place."""
    checks = []
    for problem in PROBLEMS:
        for method in METHODS:
            mine = [row for row in rows if (row.problem, row.method) == (problem.name, method)]
            name, key = f"{problem.name}, {method}", (problem.name, method)
            if least := ORDERS.get(key):
                order = order_fitted(mine)
                checks.append(Check(f"{name}: order", order, f">= {least:g}", order >= least))
            else:
                worst = max(row.error for row in mine)
                checks.append(below(f"{name}: greatest error", worst, GREATEST[key]))
                if method == "time-stepping":
                    fall = mine[-1].error / mine[0].error
                    checks.append(below(f"{name}: shortest step's error over longest's", fall, 0.7))
    return checks


def trace_checks(trace: Trace) -> list[Check]:
    """No overlap is left; steps grow by doubling only, after three clean steps."""
    kept = [length for _, length, was_kept in trace.steps if was_kept]
    growth = max((b / a for a, b in pairwise(kept)), default=1.0)
    name = f"{trace.scene}, {trace.way}"
    checks = [
        below(f"{name}: overlap over the smallest body", trace.overlap, 1e-11),
        Check(f"{name}: collisions", trace.collisions, "reported", True),
        Check(f"{name}: steps tried", len(trace.steps), "reported", True),
    ]
    if "halving" in trace.way:
        checks.append(Check(f"{name}: greatest growth of a step", growth, "reported", True))
        checks.append(below(f"{name}: doublings too soon", _too_soon(trace), 0))
    return checks


def _too_soon(trace: Trace) -> int:
    """Steps that are twice those before, of which fewer than `CLEAN_STEPS` were clean."""
    count, clean, before = 0, 0, trace.longest
    for _, length, kept in trace.steps:
        if kept and length > 1.5 * before:
            count += clean < CLEAN_STEPS
            clean = 0
        clean = clean + 1 if kept else 0
        before = length
    return count


def drift_check(drift: Drift) -> Check:
    """A gap that is kept closed ends at round-off, or at what time stepping's law leaves."""
    name = f"{drift.scene}, {drift.method}, control {'on' if drift.control else 'off'}"
    if not drift.control:
        return Check(f"{name}: gap over the radius", drift.gap[-1], "reported", True)
    bar = 1e-12 if drift.method == "acceleration" else 1e-6
    return below(f"{name}: gap over the radius", drift.gap[-1], bar)


def zeno_checks(rows: Iterable[Zeno]) -> list[Check]:
    """Rest comes when the closed form says: to the cut-off, or to the step."""
    checks = []
    for row in rows:
        bar = cut_off(0.1, row.restitution) if row.method == "acceleration" else 0.1
        name = f"bounces, e = {row.restitution:g}, {row.method} at {row.step:g} s"
        checks.append(below(f"{name}: error of the time to rest", row.error, bar))
    return checks
