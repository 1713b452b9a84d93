"""Hard cases that ask for limits: storeys, mass ratios, units, turned frames, kicks, needles.

Some are beyond what double precision or the tolerance allows; they show where it breaks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import nan, radians, tan

import numpy as np

from rigid_lcp.errors import RigidError
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation import rigid_hard_scenes as further
from validation import rigid_scenes as scenes
from validation.rigid_hard_equilibrium import rest_residual
from validation.rigid_hard_trials import OURS, Floats, Row, Trial, greatest, trial_rows

RESTS = "rests: nothing moves"


def space_incline_rows(quick: bool) -> list[Row]:
    """A block in space at Coulomb's threshold, pulled down the slope across both its tangents.

    ``g (sin - mu cos) t^2 / 2`` is what it slides; its four contacts must agree on the direction.
    """
    slope, across, seconds, rows = radians(20), 0.9273, 0.05 if quick else 0.2, list[Row]()
    for off in (-1e-9, 0.0, 1e-9):
        mu = (1 + off) * tan(slope)
        run = further.block_in_space(slope, across, mu)
        place = run.positions[0].copy()
        way = scenes.block_on_incline_way(slope, mu, seconds) if off else 0.0
        start, error, why = time.process_time(), nan, ""
        try:
            run.advance(seconds)
            down = np.array([np.cos(across), np.sin(across), 0.0])
            error = float(np.linalg.norm(run.positions[0] - place - way * down))
        except RigidError as failure:
            why = f"{type(failure).__name__}: {failure}"
        bar = 0.01 * way if way else 1e-12
        words = f"1 {'-' if off < 0 else '+'} 1e-9 times tan 20°" if off else "tan 20°"
        rows.append(Row(
            f"block in space at mu = {words}, pulled across its tangents",
            f"slides {way:.3g} m in {seconds:g} s" if way else "rests", run.method,
            "off its place", error, f"<= {bar:.3g}", error <= bar, "m",
            time.process_time() - start, run.steps, why,
        ))  # fmt: skip
    return rows


def storey_rows(peers: Sequence[str]) -> list[Row]:
    """Card houses of two and three storeys either side of the friction at which forces exist.

    A miss of ours, above it, is looked into: rest and a motion can both solve Coulomb's problem.
    """
    phi, seconds, rows = radians(20), 0.25, list[Row]()
    for storeys in (2, 3):
        limit = further.card_storeys_friction(storeys, phi)
        for off in (-1e-3, 1e-3, 1e-2):
            stands, mu = off > 0, (1 + off) * limit
            build = partial(further.card_storeys, storeys, phi, mu)
            made = trial_rows([Trial(
                f"card house of {storeys} storeys, mu = (1 {off:+g}) {limit:.6f}",
                "forces at rest exist" if stands else "no forces at rest: falls", build, seconds,
                "greatest move", greatest, 1e-9 if stands else 1e-4 * scenes.G * seconds**2 / 2,
                least=not stands,
            )], peers)  # fmt: skip
            if stands and not made[0].ok and not made[0].why:
                run = build()
                rest = rest_residual(run, mu)
                run.advance(run.step)
                why = (
                    f"Its first step has two solutions: rest, with a residual of {rest:.1g}, and "
                    f"the motion that is found, of {run.worst_residual:.1g}."
                )
                made[0] = replace(made[0], why=why)
            rows += made
    return rows


def ratio_trials(quick: bool) -> list[Trial]:
    """Mass ratios until the answer is lost."""
    seconds = 0.1 if quick else 1.0
    trials = []
    for ratio in (1e6, 1e8):
        trials.append(Trial(
            f"10 boxes, the top one {ratio:.0e} times heavier", RESTS,
            partial(scenes.stack, 10, ratio), seconds, "greatest move", greatest, 1e-9,
            methods=OURS,
        ))  # fmt: skip
    for ratio in (1e8, 1e10):
        trials.append(Trial(
            f"light on heavy on light, 1 : {ratio:.0e} : 1", RESTS,
            partial(scenes.light_on_heavy, ratio), seconds, "greatest move", greatest,
            max(1e-9, 3.0 * round_off_walk(ratio, 1e-3, seconds)), methods=OURS,
        ))  # fmt: skip
    return trials


def round_off_walk(ratio: float, step: float, seconds: float) -> float:
    """How far a light body walks [m] under one ``ratio`` times as heavy, by round-off alone.

    A step's impulse of the heavy body is right to eps, which gives the light one a velocity of
    ``eps ratio g h`` and a way of h times that, to either side: a random walk of ``seconds / h``
    steps.
    """
    return float(np.finfo(float).eps * ratio * 9.81 * step**2 * np.sqrt(seconds / step))


def in_metres(moved: Floats) -> float:
    """Greatest change of any coordinate of a scene in millimetres, in metres and radians."""
    return greatest(moved * (1e-3, 1e-3, 1.0))


def frame_trials(quick: bool) -> list[Trial]:
    """The heavy stack in other units and in a turned frame; edges that coincide, but for 1e-12."""
    heavy = partial(scenes.stack, 10, 1e4)
    seconds = 0.1 if quick else 1.0
    return [
        Trial("the stack with a 1e4 heavier top, in mm and g", RESTS,
              lambda: further.in_units(heavy(), 1e3, 1e3), seconds, "greatest move", in_metres,
              1e-9),
        Trial("the same in metres, all turned by 45°, gravity too", RESTS,
              lambda: further.turned(heavy(), radians(45)), seconds, "greatest move", greatest,
              1e-9),
        Trial("5 by 5 boxes, each off its place by up to 1e-12 m", "rests within its gaps",
              lambda: further.jittered_grid(5, 5, 1e-12), 0.1 if quick else 0.3, "greatest move",
              greatest, 1e-9),
    ]  # fmt: skip


def watched_rows(
    case: str, answer: str, build: Callable[[], Simulation], steps: int
) -> list[Row]:  # fmt: skip
    """A scene in motion: energy that it gained, overlap after any step."""
    run = build()
    first, start, why = run.energy, time.process_time(), ""
    gained, overlap = -1.0, 0.0
    try:
        for _ in range(steps):
            run.advance(run.step)
            gained = max(gained, run.energy / first - 1)
            overlap = max(overlap, run.overlap / run.world.length)
    except RigidError as error:
        gained, overlap, why = nan, nan, f"{type(error).__name__}: {error}"
    cost = time.process_time() - start
    return [
        Row(case, answer, run.method, measure, value, f"<= {bar:.0e}", value <= bar, "", cost,
            run.steps, why)
        for measure, value, bar in (
            ("energy gained over the first", gained, 1e-12),
            ("overlap over the smallest body", overlap, 1e-9),
        )
    ]  # fmt: skip


def motion_rows(quick: bool) -> list[Row]:
    """A tower that is kicked, needles that fall, a disc that rolls for long."""
    rows = watched_rows(
        "200 boxes, the lowest kicked by 1 m/s", "energy never grows, nothing overlaps",
        lambda: further.kicked_tower(200, 1.0), 30 if quick else 300,
    )  # fmt: skip
    rows += watched_rows(
        "needles of 1000 : 1 fall upon each other", "energy never grows, nothing overlaps",
        lambda: further.needle_heap(6, 1e3), 700,
    )  # fmt: skip
    rows += watched_rows(
        "40 irregular polygons poured", "energy never grows, nothing overlaps",
        lambda: scenes.poured(40, seed=1), 100 if quick else 500,
    )  # fmt: skip
    return [*rows, _rolling_row(1_000 if quick else 20_000)]


def _rolling_row(steps: int) -> Row:
    """Drift of the gap of a contact that never opens, of a disc that rolls down a slope."""
    run = scenes.disc_on_incline(radians(20), 0.5)
    start, worst, why = time.process_time(), 0.0, ""
    try:
        for _ in range(10):
            run.advance(steps / 10 * run.step)
            worst = max(worst, abs(run.positions[0, 1] - 0.5) / 0.5)
    except RigidError as error:
        worst, why = nan, f"{type(error).__name__}: {error}"
    return Row(
        "disc rolling down 20°", "its gap stays closed", run.method,
        f"gap over the radius in {steps:.0e} steps", worst, "<= 1e-12", worst <= 1e-12, "",
        time.process_time() - start, run.steps, why,
    )  # fmt: skip


def rocking_rows() -> list[Row]:
    """Housner's rocking block: what four impacts leave of its energy."""
    width, height, impacts = 0.2, 1.0, 4
    lean = 0.5 * float(np.arctan2(width, height))
    times, share = scenes.rocking_block_answer(width, height, lean, impacts + 1)
    rows = []
    # a step of time stepping meets an impact up to a step late: first order
    cases: tuple[tuple[Method, float, float], ...] = (
        ("acceleration", 0.02, 1e-6), ("time-stepping", 1e-3, 5e-2),
    )  # fmt: skip
    for method, step, bar in cases:
        run = scenes.rocking_block(width, height, lean, method=method, step=step)
        flat = run.world.mass[0] * scenes.G * height
        first, start, off, why = run.energy - flat, time.process_time(), nan, ""
        try:
            run.advance(float(times[-2:].mean()))
            off = abs((run.energy - flat) / (first * share**impacts) - 1)
        except RigidError as error:
            why = f"{type(error).__name__}: {error}"
        rows.append(Row(
            "rocking block", f"each impact leaves {share:.4f} of its energy (Housner)", method,
            f"energy off it after {impacts} impacts", off, f"<= {bar:.0e}", off <= bar, "",
            time.process_time() - start, run.steps, why,
        ))  # fmt: skip
    return rows
