"""The trials, family by family; MuJoCo runs those that are judged by a displacement."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite, nan, radians, sqrt, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import NoSolution, RigidError
from rigid_lcp.scene.simulation import Method, Simulation
from validation.bench.rigid import hard_scenes as hard
from validation.bench.rigid import scenes
from validation.bench.rigid.rest_limit import find_arch_limit
from validation.studies.rigid_hard_cases.rival import move_in_mujoco

Floats = NDArray[np.float64]
Row = dict[str, Any]
BOTH: tuple[Method, ...] = ("time-stepping", "acceleration")
RIVAL = "MuJoCo"
RESTS = "rests"
SLIDES = 1e-12
"""Speed after one step above which a pair of cards slides [m/s]; exact ones rest at 1e-17."""


def judge(
    case: str, answer: str, measure: str, bar: str, method: str,
    job: Callable[[], tuple[float, int]], unit: str = "",
) -> Row:  # fmt: skip
    """A row: what a job measured [value, steps], in what time, against ``<= bar`` or ``>= bar``."""
    start, value, steps, why = time.process_time(), nan, 0, ""
    try:
        value, steps = job()
    except RigidError as error:
        why = f"{type(error).__name__}: {error}".splitlines()[0]
    sign, bound = bar.split()
    ok = value <= float(bound) if sign == "<=" else value >= float(bound)
    return {
        "case": case, "answer": answer, "measure": measure, "bar": bar, "unit": unit,
        "method": method, "value": float(f"{value:.3g}") if isfinite(value) else None,
        "ok": bool(ok), "cpu_s": float(f"{time.process_time() - start:.3g}"), "steps": steps,
        "why": why, "peer": False,
    }  # fmt: skip


# --- scenes that move in a known way ----------------------------------------------------------


def find_greatest(moved: Floats) -> float:
    """Greatest change of any coordinate."""
    return float(np.abs(moved).max())


def compare_move(way: float, axis: int = 0) -> Callable[[Floats], float]:
    """How far body 0 is from having moved by ``way`` [m] along an axis, and not across."""
    return lambda moved: float(np.hypot(moved[0, axis] - way, moved[0, 1 - axis]))


@dataclass(frozen=True)
class Trial:
    """A scene that must rest, or move in a known way."""

    case: str
    answer: str
    build: Callable[[], Simulation]
    seconds: float
    bar: str
    off: Callable[[Floats], float] = find_greatest
    """What is judged of the displacements (n, 3) [m, m, rad] of all bodies."""
    methods: tuple[Method, ...] = ("time-stepping",)


def try_ours(trial: Trial, method: Method) -> Row:
    """A trial by `rigid_lcp`."""
    run = trial.build()
    if method != run.method:
        run = Simulation(run.world.scene, method, step=run.step, loads=run.loads)

    def run_trial() -> tuple[float, int]:
        place, angle = run.positions.copy(), run.angles.copy()
        run.advance(trial.seconds)
        return trial.off(np.column_stack([run.positions - place, run.angles - angle])), run.steps

    return judge(trial.case, trial.answer, "off", trial.bar, method, run_trial, "m")


def try_rival(trial: Trial) -> Row:
    """A trial by MuJoCo, its cost that of the steps alone."""
    cost = 0.0

    def run_trial() -> tuple[float, int]:
        nonlocal cost
        moved, steps, cost = move_in_mujoco(trial.build(), trial.seconds)
        return trial.off(moved), steps

    row = judge(trial.case, trial.answer, "off", trial.bar, RIVAL, run_trial, "m")
    return row | {"peer": True, "cpu_s": float(f"{cost:.3g}")}


def try_all(trials: Sequence[Trial]) -> Iterator[Row]:
    """Every trial by its methods, and by MuJoCo."""
    for trial in trials:
        yield from (try_ours(trial, method) for method in trial.methods)
        yield try_rival(trial)


def try_inclines() -> Iterator[Row]:
    """A block at Coulomb's threshold, in the plane and in space across both tangents."""
    slope, across = radians(20), 0.9273
    for off in (-1e-9, 0.0, 1e-9):
        mu = (1 + off) * tan(slope)
        words = f"1 {'-' if off < 0 else '+'} 1e-9 times tan 20°" if off else "tan 20°"
        way = scenes.find_slide_distance(slope, mu, 2.0) if off else 0.0
        yield from try_all([Trial(
            f"block at mu = {words}",
            f"slides g (sin - mu cos) t²/2 = {way:.3g} m" if way else RESTS,
            partial(scenes.tilt_block, slope, mu), 2.0, f"<= {0.01 * way or 1e-12:.3g}",
            compare_move(way), BOTH,
        )])  # fmt: skip
        short = scenes.find_slide_distance(slope, mu, 0.2) if off else 0.0

        def slide(mu: float = mu, way: float = short) -> tuple[float, int]:
            run = hard.incline_in_space(slope, across, mu)
            wanted = run.positions[0] + way * np.array([np.cos(across), np.sin(across), 0.0])
            run.advance(0.2)
            return float(np.linalg.norm(run.positions[0] - wanted)), run.steps

        yield judge(f"block in space at mu = {words}, pulled across its tangents",
                    "slides along both tangents" if way else RESTS,
                    "off", f"<= {0.01 * short or 1e-12:.3g}", BOTH[0], slide, "m")  # fmt: skip


def try_creep() -> Iterator[Row]:
    """A block that must not creep in 1e5 steps."""
    build = partial(scenes.tilt_block, radians(20), 1.0)
    return try_all([Trial("block at rest on 20°, mu = 1", RESTS, build, 100.0, "<= 1e-12")])


def try_cards() -> Iterator[Row]:
    """Two cards, and houses of two and three storeys, either side of the least friction."""
    phi, fall = radians(20), 1e-4 * scenes.G * 0.25**2 / 2
    houses: list[tuple[str, float, Callable[[float], Simulation]]] = [
        ("card house", scenes.find_card_friction(phi), partial(scenes.lean_cards, phi))
    ]
    for storeys in (2, 3):
        houses.append((f"card house of {storeys} storeys", hard.find_storeys_friction(storeys, phi),
                       partial(hard.stack_cards, storeys, phi)))  # fmt: skip
    for name, limit, build in houses:
        for off in (-1e-3, 1e-3, 1e-2):
            stands = off > 0
            yield from try_all([Trial(
                f"{name}, mu = (1 {off:+g}) {limit:.6f}", "stands" if stands else "slides apart",
                partial(build, (1 + off) * limit), 0.25,
                "<= 1e-9" if stands else f">= {fall:.3g}",
            )])  # fmt: skip
    for degrees in (5.0, 20.0, 40.0):
        yield judge(f"card house, phi = {degrees:g}°", "stand iff mu >= tan(phi)/2",
                    "threshold off its closed form", "<= 1e-8", BOTH[0],
                    partial(bisect_cards, radians(degrees)))  # fmt: skip


def bisect_cards(phi: float) -> tuple[float, int]:
    """The friction at which two cards stop sliding apart, by bisection, against tan(phi)/2."""
    exact = scenes.find_card_friction(phi)
    low, high, steps = 0.5 * exact, 2.0 * exact, 0
    while high - low > 1e-12 * exact:
        middle = (low + high) / 2
        run = scenes.lean_cards(phi, middle)
        run.advance(run.step)
        steps += 1
        slides = np.abs(run.velocities).max() > SLIDES
        low, high = (middle, high) if slides else (low, middle)
    return abs(high / exact - 1), steps


def try_wedges() -> Iterator[Row]:
    """A squeezed wedge either side of self-locking."""
    half_angle, force, seconds = radians(20), 1e5, 0.05
    for off in (-1e-2, -1e-6, 0.0, 1e-6, 1e-2):
        mu = (1 + off) * tan(half_angle)
        build = partial(scenes.build_wedge, half_angle, mu, force)
        drive = scenes.find_wedge_acceleration(build(), half_angle, mu, force) if off < 0 else 0.0
        rise = drive * seconds**2 / 2
        yield from try_all([Trial(
            f"wedge, mu = (1 {off:+.0e}) tan a" if off else "wedge, mu = tan a exactly",
            "driven out" if rise else "jams", build, seconds,
            f"<= {0.01 * rise or 1e-9:.3g}", compare_move(rise, axis=1),
        )])  # fmt: skip


def try_piles() -> Iterator[Row]:
    """Piles that must rest: mass ratios, towers, needles, other units, a turned frame."""
    heavy = partial(scenes.stack, 10, 1e4)
    millimetres = np.array([1e-3, 1e-3, 1.0])
    piles = [
        Trial("10 boxes, the top one 1e4 times heavier", RESTS, heavy, 2.0, "<= 1e-9",
              methods=BOTH),
        Trial("the stack with a 1e4 heavier top, in mm and g", RESTS,
              lambda: hard.change_units(heavy(), 1e3, 1e3), 1.0, "<= 1e-9",
              lambda moved: find_greatest(moved * millimetres)),
        Trial("the same in metres, all turned by 45°, gravity too", RESTS,
              lambda: hard.turn_scene(heavy(), radians(45)), 1.0, "<= 1e-9"),
        Trial("10 equal boxes", RESTS, partial(scenes.stack, 10), 2.0, "<= 1e-9"),
        Trial("tower of 200 boxes", RESTS, partial(scenes.stack, 200), 2.0, "<= 1e-9"),
        Trial("coincident edges: 5 by 5 boxes without gaps", RESTS,
              partial(hard.jitter_grid, 5, 5, 0.0), 2.0, "<= 1e-9"),
        Trial("5 by 5 boxes, each off its place by up to 1e-12 m", "rests within its gaps",
              partial(hard.jitter_grid, 5, 5, 1e-12), 0.3, "<= 1e-9"),
        Trial("needles 1e4 times longer than thick", RESTS, partial(hard.pile_needles, 20), 2.0,
              "<= 1e-9"),
    ]  # fmt: skip
    for ratio in (1e6, 1e8):
        piles.append(Trial(f"10 boxes, the top one {ratio:.0e} times heavier", RESTS,
                           partial(scenes.stack, 10, ratio), 1.0, "<= 1e-9",
                           methods=BOTH))  # fmt: skip
    for ratio in (1e6, 1e8, 1e10):
        # by round-off alone a light body under a heavy one walks eps ratio g h^2 a step
        walk = 3.0 * float(np.finfo(float).eps) * ratio * scenes.G * 1e-6 * sqrt(1000)
        piles.append(Trial(f"light on heavy on light, 1 : {ratio:.0e} : 1", RESTS,
                           partial(scenes.stack_unequal, ratio), 1.0,
                           f"<= {max(1e-9, walk):.3g}", methods=BOTH))  # fmt: skip
    return try_all(piles)


def try_arches() -> Iterator[Row]:
    """Either side of the thinnest arch: 0.1075 for ever more stones, and of this very arch."""
    for stones in (11, 31):
        limit = find_arch_limit(stones)
        for thickness in (0.110, 0.105, 1.001 * limit, 0.999 * limit):
            stands = thickness > limit
            # a mechanism just past its limit is driven by a small share of gravity
            fall = 0.01 * abs(thickness / limit - 1) * scenes.G / 2
            yield from try_all([Trial(
                f"arch of {stones} stones, t/R = {thickness:.6f}",
                f"{'stands' if stands else 'falls'}: limit {limit:.6f}",
                partial(scenes.build_arch, stones, thickness), 1.0,
                "<= 1e-9" if stands else f">= {fall:.3g}",
            )])  # fmt: skip


# --- scenes judged by forces and energies -----------------------------------------------------


def try_rods() -> Iterator[Row]:
    """Painleve's rod either side of the friction above which no finite force exists."""
    limit = scenes.limit_rod(scenes.slide_rod(1.0, method="acceleration"))
    for below in (1e-1, 1e-3, 1e-6):

        def try_force(below: float = below) -> tuple[float, int]:
            run = scenes.slide_rod((1 - below) * limit, method="acceleration", step=1e-9)
            near = run.world.contacts(run.motion, 1e-9 * run.world.length)
            x = float(near.point[0, 0] - run.positions[0, 0])
            exact = scenes.G / (below * (1 / run.world.mass[0] + x * x / run.world.inertia[0]))
            run.advance(run.step)
            return abs(float(run.contacts.normal_force.sum()) / exact - 1), 1

        yield judge(f"Painleve rod, mu = (1 - {below:g}) limit", "g / (1/m + x²/J - mu |xy|/J)",
                    "force off", f"<= {1e-10 / below:.0e}", "acceleration", try_force)  # fmt: skip
    for above in (1e-6, 1e-1):
        mu = (1 + above) * limit
        name = f"Painleve rod, mu = (1 + {above:g}) limit"

        def try_refusal(mu: float = mu) -> tuple[float, int]:
            try:
                scenes.slide_rod(mu, method="acceleration").advance(1e-3)
            except NoSolution:
                return 1.0, 1
            return 0.0, 1

        yield judge(name, "no finite force exists", "NoSolution raised", ">= 1", "acceleration",
                    try_refusal)  # fmt: skip
        yield from watch(name, "an impulse stops the tip",
                         partial(scenes.slide_rod, mu, method="time-stepping"), 50)  # fmt: skip


def watch(case: str, answer: str, build: Callable[[], Simulation], steps: int) -> Iterator[Row]:
    """A scene in motion: energy that it gained, overlap after any step."""
    run = build()
    first, found = run.energy, {"gained": -1.0, "overlap": 0.0}

    def go() -> tuple[float, int]:
        for _ in range(steps):
            run.advance(run.step)
            found["gained"] = max(found["gained"], run.energy / first - 1)
            found["overlap"] = max(found["overlap"], run.overlap / run.world.length)
        return found["gained"], steps

    yield judge(case, answer, "energy gained over the first", "<= 1e-12", BOTH[0], go)
    yield judge(case, answer, "overlap over the smallest body", "<= 1e-9", BOTH[0],
                lambda: (found["overlap"], steps))  # fmt: skip


def try_motions() -> Iterator[Row]:
    """A tower that is kicked, needles that fall, polygons poured, 1e4 bounces, a long roll."""
    never = "energy never grows, nothing overlaps"
    yield from watch("200 boxes, the lowest kicked", never, lambda: hard.kick_tower(200, 1.0),
                     300)  # fmt: skip
    yield from watch("needles of 1000 : 1 that fall", never, lambda: hard.drop_needles(6, 1e3), 700)
    yield from watch("40 polygons poured", never, lambda: scenes.fill_trough(40, seed=1), 500)
    height, bounces = 0.01, 10_000
    period = 2 * sqrt(2 * height / scenes.G)
    for method in BOTH:

        def drift(method: Method = method) -> tuple[float, int]:
            run = scenes.drop_disc(height, 1.0, method=method, step=period / 7.3)
            floor = run.world.mass[0] * scenes.G * run.world.length
            first = run.energy - floor
            run.advance(bounces * period)
            return abs((run.energy - floor) / first - 1) / bounces, run.steps

        yield judge("disc bouncing, e = 1, 1e4 times", "energy is kept", "change a bounce",
                    "<= 1e-13", method, drift)  # fmt: skip

    def roll() -> tuple[float, int]:
        run = scenes.tilt_disc(radians(20), 0.5)
        worst = 0.0
        for _ in range(10):
            run.advance(2_000 * run.step)
            worst = max(worst, abs(run.positions[0, 1] - 0.5) / 0.5)
        return worst, run.steps

    yield judge("disc rolling down 20°, 2e4 steps", "its gap stays closed", "gap over the radius",
                "<= 1e-12", BOTH[0], roll)  # fmt: skip


FAMILIES: dict[str, Callable[[], Iterator[Row]]] = {
    "incline": try_inclines, "creep": try_creep, "cards": try_cards, "wedge": try_wedges,
    "piles": try_piles, "arch": try_arches, "rod": try_rods, "motion": try_motions,
}  # fmt: skip


def measure(family: str) -> Row:
    """The rows of a family, after a short run so that no cost holds the time of a compiler."""
    scenes.stack(3).advance(2e-3)
    scenes.tilt_block(0.1, 0.5, method="acceleration").advance(2e-3)
    hard.incline_in_space(0.1, 0.9, 0.5).advance(2e-3)
    return {"rows": list(FAMILIES[family]())}


PARTS: dict[str, Callable[[], Row]] = {name: partial(measure, name) for name in FAMILIES}
