"""The eight tests measured on each engine beside what they must give: ``PARTS``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from adapters.bed import contact_law
from adapters.bed.state import FloatArray
from adapters.engines.contract import get_engine
from validation.case import Check
from validation.studies.contact_law.closed_forms import (
    find_contact_time,
    find_law,
    find_mean_overlap,
    find_peak_force,
    find_pull_factor,
    find_rebound_tangent,
    find_sliding_restitution,
    find_sliding_spin,
    find_sliding_start,
    integrate_impulse,
)
from validation.studies.contact_law.impacts import Rebound, find_pair, measure_rebound, run_impacts
from validation.studies.contact_law.settings import (
    NORMAL,
    RESTITUTION,
    STEPS,
    TANGENTIAL,
    TEST_3,
    TEST_5,
    TEST_6,
    TOLERANCE_HERTZ,
    TOLERANCE_SLIDING,
    Setting,
)

BoolArray = npt.NDArray[np.bool_]

Row = dict[str, Any]
Impulses = dict[str, list[float]]
"""Friction impulses over m* V_n that an engine gave, by setting."""

SLIDES_FROM = 1.4
"""Share of `find_sliding_start` from which the sliding limit is asked for: below it the time in
which the spring is first stretched still shows (1.6 % here, falling with the slip)."""

ORDER_STEPS = (100, 200, 400)
ORDER_PHASES = 16
"""Impacts that begin at as many parts of a step; their mean square has a clean order."""
ORDERS = {0.2: 0.9, 1.0: 2.4}
"""Restitution -> least order: damping lags by half a step, first order; without it leapfrog on a
force that begins as delta^(3/2) has order 5/2."""

TANGENTIAL_STEPS = (125, 250, 500, 1000)
TANGENTIAL_ORDER = 0.9
"""Least mean order of friction impulses, by three halvings of the step: sticking or sliding is
decided once a step, which is first order."""

LEVER = {"liggghts": 0.5, "lammps": 0.0, "yade": 1.0}
"""By how many overlaps the lever of a friction force is shorter than R, on a plane."""


def check_max(name: str, error: float, bar: float) -> Check:
    """A relative error against its bar."""
    return Check(name, error, f"<= {bar:g}", error <= bar)


def report(name: str, value: float, why: str) -> Check:
    """A figure without a bar, and why it has none."""
    return Check(name, value, f"none: {why}", ok=True)


# --- tests 1 and 2: force, overlap, time ------------------------------------------------------


def follow_hertz(setting: Setting, engine: str) -> tuple[FloatArray, FloatArray]:
    """Greatest overlap [m], greatest force [N], contact time [s], error of the force-overlap curve.

    Also what Hertz gives for them, shape (4,) each; the last is the greatest distance from
    F = 4/3 E* sqrt(R*) delta^(3/2) over the greatest force.
    """
    pair, speed = find_pair(setting), setting.impacts[0].normal
    motion = run_impacts(setting, engine, every=1)
    height = motion.position[:, -1, 2]
    if setting.partner_radius is None:
        overlap = setting.radius - height
    else:
        overlap = setting.radius + setting.partner_radius - (height - motion.position[:, 0, 2])
    force = motion.force[:, -1, 2]
    touching = np.flatnonzero(overlap > 0)
    ends = [
        motion.time[i] - overlap[i] * (motion.time[j] - motion.time[i]) / (overlap[j] - overlap[i])
        for i, j in ((touching[0], touching[0] - 1), (touching[-1], touching[-1] + 1))
    ]
    curve = contact_law.find_normal_force(overlap, pair.modulus, pair.radius)
    law = (pair.mass, pair.radius, pair.modulus, speed)
    deepest = contact_law.solve_hertz_collision(
        speed, pair.modulus, pair.radius, pair.mass
    ).overlap_max
    distance = float(np.abs(force - curve).max() / force.max())
    found = np.array([overlap.max(), force.max(), ends[1] - ends[0], distance])
    return found, np.array([deepest, find_peak_force(*law), find_contact_time(*law), 0.0])


def check_normal(setting: Setting, engine: str) -> list[Check]:
    """Tests 1 and 2 of one material against Hertz."""
    found, hertz = follow_hertz(setting, engine)
    errors = [*np.abs(found[:3] / hertz[:3] - 1), found[3]]
    names = ("greatest overlap", "greatest force", "contact time", "force-displacement curve")
    return [
        check_max(f"{engine}, {setting.label}: {name}", float(error), TOLERANCE_HERTZ)
        for name, error in zip(names, errors, strict=True)
    ]


# --- test 3: restitution ----------------------------------------------------------------------


def check_restitution(settings: Sequence[Setting], engine: str) -> list[Check]:
    """Test 3: what rebounds over what was asked for, the worst of the settings of a material."""
    errors: dict[str, float] = {}
    for setting in settings:
        found = float(measure_rebound(setting, run_impacts(setting, engine)).restitution[0])
        error = abs(found / setting.restitution - 1)
        errors[setting.label] = max(error, errors.get(setting.label, 0.0))
    return [
        check_max(f"{engine}, {label}: restitution", error, TOLERANCE_HERTZ)
        for label, error in errors.items()
    ]


def check_order(engine: str, restitution: float) -> Check:
    """Least order of the restitution's error in the step, from halving it twice (test 3)."""
    impacts = ORDER_PHASES * TEST_3.impacts
    setting = replace(TEST_3, restitution=restitution, impacts=impacts)
    errors = []
    for steps in ORDER_STEPS:
        found = measure_rebound(setting, run_impacts(setting, engine, steps=steps)).restitution
        errors.append(np.sqrt(np.mean((found / restitution - 1) ** 2)))
    order = float(np.log2(np.divide(errors[:-1], errors[1:])).min())
    name = f"{engine}, test 3, e = {restitution}: order of convergence in the step"
    least = ORDERS[restitution]
    return Check(name, order, f">= {least:g}", order >= least)


def check_tangential_order(engine: str, setting: Setting, law: str) -> Check:
    """Mean order of the friction impulses in the step, from how far each halving moves them."""
    found = [
        measure_rebound(setting, run_impacts(setting, engine, law, steps=steps)).friction_impulse
        for steps in TANGENTIAL_STEPS
    ]
    moves = [float(np.sqrt(np.mean((b - a) ** 2))) for a, b in pairwise(found)]
    order = float(np.log2(moves[0] / moves[-1])) / (len(moves) - 1)
    name = f"{engine}, {setting.label}, {law} law: order of convergence in the step, friction"
    return Check(name, order, f">= {TANGENTIAL_ORDER:g}", order >= TANGENTIAL_ORDER)


def check_tangential_orders(engine: str) -> list[Check]:
    """Elastic impacts, and damped ones under the law that a scene gets."""
    return [
        check_tangential_order(engine, TEST_5, "sliding"),
        check_tangential_order(engine, TEST_6, "scene"),
    ]


# --- tests 4 to 8: friction -------------------------------------------------------------------


def slides(setting: Setting, rebound: Rebound) -> BoolArray:
    """Which impacts must end at the sliding limit."""
    begins = SLIDES_FROM * find_sliding_start(setting.friction, setting.restitution)
    return np.abs(rebound.slip_before) >= begins


def find_farthest(found: FloatArray, limit: FloatArray | float) -> float:
    """The greatest relative error, with its sign."""
    error = found / limit - 1
    return float(error[np.abs(error).argmax()])


def find_impulse_error(setting: Setting, rebound: Rebound) -> float:
    """Error of the friction impulse against mu (1 + e) m* V_n, of the impact farthest off."""
    chosen = slides(setting, rebound)
    limit = setting.friction * (1 + setting.restitution)
    return find_farthest(rebound.friction_impulse[chosen], limit)


def check_sliding(setting: Setting, engine: str, rebound: Rebound) -> list[Check]:
    """Friction impulse, tangential restitution, spin and rebound angle of what slides all the time.

    Spin and angle are those of a lever R.  An engine that takes R - l delta gives, for an elastic
    impact, l times the `find_mean_overlap` over R less: where that is beyond the bar, the row says
    so.
    """
    mu, e = setting.friction, setting.restitution
    name, chosen = f"{engine}, {setting.label}: sliding limit", slides(setting, rebound)
    before, after = rebound.slip_before[chosen], rebound.slip_after[chosen]
    impulse = find_impulse_error(setting, rebound)
    checks = [check_max(f"{name}, impulse", abs(impulse), TOLERANCE_SLIDING)]
    if setting.impacts[0].tangential:
        kept = 1 - rebound.friction_impulse[chosen] / before
        error = find_farthest(kept, find_sliding_restitution(before, mu, e))
        checks.append(check_max(f"{name}, e_t", abs(error), TOLERANCE_SLIDING))
    errors = {
        "spin": find_farthest(rebound.spin_gained[chosen], find_sliding_spin(mu, e)),
        "rebound angle": find_farthest(
            np.arctan(after / e), np.arctan(find_rebound_tangent(before, mu, e))
        ),
    }
    pair, speed = find_pair(setting), max(impact.normal for impact in setting.impacts)
    depth = find_mean_overlap(pair.mass, pair.radius, pair.modulus, speed) / setting.radius
    short = LEVER[engine] * depth
    if setting.partner_radius is not None or e < 1 or short < TOLERANCE_SLIDING:
        return checks + [
            check_max(f"{name}, {what}", abs(error), TOLERANCE_SLIDING)
            for what, error in errors.items()
        ]
    lever = f"R - {LEVER[engine]:g} delta"
    checks += [
        report(f"{name}, {what}", error, f"its lever is {lever}, rigid bodies' is R")
        for what, error in errors.items()
    ]
    error = abs(errors["spin"] + short)
    return [*checks, check_max(f"{name}, spin, lever {lever}", error, TOLERANCE_SLIDING)]


def find_law_error(setting: Setting, rebound: Rebound, engine: str, law: str) -> float:
    """Greatest distance from the engine's own law, sticking and sliding, over mu (1 + e)."""
    pair = find_pair(setting)
    expected = integrate_impulse(
        rebound.slip_before,
        setting.friction,
        setting.restitution,
        6 * pair.shear / pair.modulus,
        find_law(engine, law),
    )
    limit = setting.friction * (1 + setting.restitution)
    return float(np.abs(rebound.friction_impulse - expected).max() / limit)


def judge_sticking(setting: Setting, rebound: Rebound, engine: str) -> float:
    """`find_law_error` without pull and tangential damping: what the spring's rule alone gives."""
    return find_law_error(setting, rebound, engine, "sliding")


def check_tangential(setting: Setting, engine: str, impulses: Impulses) -> list[Check]:
    """Tests 4 to 8 of one material: sliding and sticking limits, spin, momentum; eq. 7's excess."""
    name, bar = f"{engine}, {setting.label}", TOLERANCE_SLIDING
    rebound = measure_rebound(setting, run_impacts(setting, engine, "sliding"))
    impulses[setting.label] = rebound.friction_impulse.tolist()
    checks = [
        *check_sliding(setting, engine, rebound),
        check_max(f"{name}: sticking, its own rule", judge_sticking(setting, rebound, engine), bar),
    ]
    if setting.partner_radius is not None:
        checks.append(check_max(f"{name}: momentum", rebound.momentum_error, 1e-12))
    scene = measure_rebound(setting, run_impacts(setting, engine))
    checks.append(check_scene_law(setting, engine, "scene", scene))
    name = f"{name}: sliding limit, impulse, under the scene law"
    excess = find_impulse_error(setting, scene)
    if setting.restitution > 0.9:
        return [*checks, check_max(name, abs(excess), bar)]
    why = f"eq. 7 pulls, {find_pull_factor(setting.restitution) - 1:.3f}; "
    why += {
        "lammps": "nothing else",
        "liggghts": "viscous force beyond the Coulomb limit",
        "yade": "no pull, but viscous force beyond the Coulomb limit",
    }[engine]
    return [*checks, report(name, excess, why)]


def check_scene_law(setting: Setting, engine: str, law: str, rebound: Rebound) -> Check:
    """All friction impulses against the engine's own law, pull and damping with it, integrated."""
    error = find_law_error(setting, rebound, engine, law)
    name = f"{engine}, {setting.label}: all impulses under the {law} law, integrated"
    return check_max(name, error, TOLERANCE_SLIDING)


def check_closing(engine: str) -> list[Check]:
    """Test 6 without pull, or without tangential damping: what each adds to a sliding impulse.

    With the setting that closes the gap the bar of the sliding limit holds: LIGGGHTS needs both
    (the law ``sliding``), LAMMPS no pull, YADE, which never pulls, no tangential damping.
    """
    closes = {"lammps": "unpulled", "yade": "undamped"}.get(engine)
    checks = []
    for law in ("unpulled", "undamped"):
        rebound = measure_rebound(TEST_6, run_impacts(TEST_6, engine, law))
        checks.append(check_scene_law(TEST_6, engine, law, rebound))
        excess = find_impulse_error(TEST_6, rebound)
        name = f"{engine}, {TEST_6.label}: sliding limit, impulse, under the {law} law"
        if law == closes:
            checks.append(check_max(name, abs(excess), TOLERANCE_SLIDING))
        else:
            checks.append(report(name, excess, "one of two settings, not the one that closes it"))
    return checks


def check_lever(setting: Setting, engine: str) -> Check:
    """A lever shorter than R is no error of the step: what a quarter of it changes in the spin."""
    coarse, fine = (
        measure_rebound(setting, run_impacts(setting, engine, "sliding", steps=steps))
        for steps in (STEPS, 4 * STEPS)
    )
    change = float(np.abs(fine.spin_gained / coarse.spin_gained - 1)[slides(setting, fine)].max())
    return check_max(f"{engine}, {setting.label}: spin at a quarter of the step", change, 1e-4)


def measure_engine(engine: str) -> Row:
    """All tests on one engine: every check, and the friction impulses of tests 4 to 8."""
    impulses: Impulses = {}
    checks = [c for s in NORMAL for c in check_normal(s, engine)]
    checks += check_restitution(RESTITUTION, engine)
    checks += [check_order(engine, restitution) for restitution in ORDERS]
    checks += check_tangential_orders(engine)
    checks += [c for s in TANGENTIAL for c in check_tangential(s, engine, impulses)]
    checks += [*check_closing(engine), check_lever(TANGENTIAL[3], engine)]
    rows = [
        {"name": check.name, "value": check.value, "bar": check.bar, "ok": bool(check.ok)}
        for check in checks
    ]
    return {"checks": rows, "impulses": impulses, "engine": get_engine(engine).version()}


PARTS: dict[str, Callable[[], Row]] = {
    name: partial(measure_engine, name) for name in ("liggghts", "lammps", "yade")
}
