"""Hard scenes in the plane with their answers, by `rigid_lcp` and its peers, judged alike.

A `Trial` is a scene that moves in a known way for a while: most of them must not move at all.  Ours
and every peer start from the same scene and are judged by the same number.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil, isnan, nan, radians, tan

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import RigidError
from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import Polygon
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation import rigid_scenes as scenes
from validation.case import Check
from validation.rigid_scene_peers import PeerScene, peer_run, scene_data

Floats = NDArray[np.float64]
Judge = Callable[[Floats], float]

SLOPE = radians(20)
OURS: tuple[Method, ...] = ("time-stepping", "acceleration")


@dataclass(frozen=True)
class Row:
    """One engine on one hard case."""

    case: str
    answer: str
    method: str
    measure: str
    """What ``value`` is."""
    value: float
    """NaN where there is none; ``why`` says why."""
    bar: str
    ok: bool
    unit: str
    cpu_s: float
    """CPU time of the steps, one thread [s]."""
    steps: int
    why: str = ""
    peer: bool = False

    def check(self) -> Check:
        """The row as a check of ``trackbed validate``."""
        name = f"{self.case}, {self.method}: {self.measure}"
        return Check(name, self.value, self.bar + (f"; {self.why}" if self.why else ""),
                     self.ok, self.unit)  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """A scene with a known answer."""

    case: str
    answer: str
    """In words, with its closed form."""
    build: Callable[[], Simulation]
    seconds: float
    measure: str
    judge: Judge
    """The measure of displacements (n, 3) [m, m, rad] of all bodies."""
    bar: float
    unit: str = "m"
    least: bool = False
    """The bar is a lower one: the scene must move."""
    methods: tuple[Method, ...] = ("time-stepping",)
    peer_seconds: float = nan
    """Shorter time for peers; as ``seconds`` if NaN."""

    @property
    def bar_words(self) -> str:
        return f"{'>=' if self.least else '<='} {self.bar:.3g}"

    def row(self, method: str, value: float, cpu_s: float, steps: int, why: str,
            peer: bool) -> Row:  # fmt: skip
        """A judged run; a value that is NaN passes nothing."""
        ok = not isnan(value) and (value >= self.bar if self.least else value <= self.bar)
        return Row(self.case, self.answer, method, self.measure, value, self.bar_words, ok,
                   self.unit, cpu_s, steps, why, peer)  # fmt: skip


def greatest(moved: Floats) -> float:
    """Greatest change of any coordinate."""
    return float(np.abs(moved).max())


def from_way(way: float, axis: int = 0) -> Judge:
    """How far body 0 is from having moved by ``way`` [m] along an axis, and not across."""
    return lambda moved: float(np.hypot(moved[0, axis] - way, moved[0, 1 - axis]))


def trial_ours(trial: Trial, method: Method) -> Row:
    """A trial by `rigid_lcp`."""
    run = trial.build()
    if method != run.method:
        run = Simulation(run.world.scene, method, step=run.step, loads=run.loads)
    place, angle = run.positions.copy(), run.angles.copy()
    start, why = time.process_time(), ""
    try:
        run.advance(trial.seconds)
        value = trial.judge(np.column_stack([run.positions - place, run.angles - angle]))
    except RigidError as error:
        value, why = nan, f"{type(error).__name__}: {error}"
    return trial.row(method, value, time.process_time() - start, run.steps, why, False)


def trial_peer(trial: Trial, engine: str) -> Row:
    """A trial by a peer with the same step."""
    run = trial.build()
    loads = None if run.loads is None else np.asarray(run.loads(0.0, run.motion)).tolist()
    seconds = trial.seconds if isnan(trial.peer_seconds) else trial.peer_seconds
    steps = ceil(seconds / run.step - 1e-9)
    made: PeerScene = peer_run(engine, scene_data(run.world.scene, loads), run.step, steps)
    if made.why:
        return trial.row(made.engine, nan, nan, 0, made.why, True)
    with np.errstate(invalid="ignore"):
        moved = np.nan_to_num(made.displacement, nan=np.inf)
        value = float(np.nan_to_num(trial.judge(moved), nan=np.inf))
    why = "" if seconds == trial.seconds else f"{seconds:g} s only"
    return trial.row(made.engine, value, made.cpu_s, steps, why, True)


def box_grid(columns: int, rows: int) -> Simulation:
    """Boxes side by side and upon each other: all their edges coincide, four corners meet."""
    scene = Scene(2)
    for k in range(columns * rows):
        place = (k % columns, k // columns + 0.5)
        scene.add(Polygon.rectangle(1, 1), density=scenes.DENSITY, position=place, friction=0.5)
    scene.add(scenes.FLOOR)
    return Simulation(scene)


def needle_pile(needles: int) -> Simulation:
    """Needles of 1 m by 0.1 mm upon each other, and one that stands on its end on the floor."""
    scene = Scene(2)
    for k in range(needles):
        scene.add(
            Polygon.rectangle(1, 1e-4), density=scenes.DENSITY, position=(0, (k + 0.5) * 1e-4),
            friction=0.5,
        )  # fmt: skip
    scene.add(Polygon.rectangle(1e-4, 1), density=scenes.DENSITY, position=(1, 0.5), friction=0.5)
    scene.add(scenes.FLOOR)
    return Simulation(scene)


def incline_trials(quick: bool) -> list[Trial]:
    """A block at Coulomb's threshold."""
    trials, seconds = [], 0.2 if quick else 2.0
    for off in (-1e-9, 0.0, 1e-9):
        mu = (1 + off) * tan(SLOPE)
        way = scenes.block_on_incline_way(SLOPE, mu, seconds) if off else 0.0
        # sliding: a per cent of the way; else what a rounding of gravity alone would move it
        bar = 0.01 * way if way else 1e-12
        words = f"1 {'-' if off < 0 else '+'} 1e-9 times tan 20°" if off else "tan 20°"
        trials.append(Trial(
            f"block at mu = {words}",
            f"slides g (sin a - mu cos a) t²/2 = {way:.3g} m in {seconds:g} s" if way else "rests",
            partial(scenes.block_on_incline, SLOPE, mu), seconds,
            "off its place", from_way(way), bar, methods=OURS,
        ))  # fmt: skip
    return trials


def creep_trials(steps: int) -> list[Trial]:
    """A block that must not creep."""
    return [Trial(
        "block at rest on 20°, mu = 1", "rests", lambda: scenes.block_on_incline(SLOPE, 1.0),
        steps * 1e-3, f"creep in {steps:.0e} steps", greatest, 1e-12,
    )]  # fmt: skip


def pile_trials(quick: bool) -> list[Trial]:
    """Piles that must rest."""
    rest, rests = "greatest move", "rests: nothing moves"
    return [
        Trial("10 boxes, the top one 1e4 times heavier", rests,
              lambda: scenes.stack(10, 1e4), 0.2 if quick else 2.0, rest, greatest, 1e-9,
              methods=OURS),
        Trial("10 equal boxes", rests,
              lambda: scenes.stack(10), 0.2 if quick else 2.0, rest, greatest, 1e-9),
        Trial("light on heavy on light, 1 : 1e6 : 1", rests,
              lambda: scenes.light_on_heavy(1e6), 0.2 if quick else 2.0, rest, greatest, 1e-9,
              methods=OURS),
        Trial("tower of 200 boxes", rests,
              lambda: scenes.stack(200), 0.02 if quick else 2.0, rest, greatest, 1e-9,
              peer_seconds=0.02 if quick else 1.0),
        Trial("coincident edges: 5 by 5 boxes without gaps", rests,
              lambda: box_grid(5, 5), 0.1 if quick else 2.0, rest, greatest, 1e-9,
              peer_seconds=0.1 if quick else 0.3),
        Trial("needles 1e4 times longer than thick", rests + ", not even the one on its end",
              lambda: needle_pile(20), 0.1 if quick else 2.0, rest, greatest, 1e-9,
              peer_seconds=0.1 if quick else 1.0),
    ]  # fmt: skip


def arch_trials(stones: int, quick: bool) -> list[Trial]:
    """Either side of the thinnest arch: 0.1075 for ever more stones, and of this very arch."""
    from validation.rigid_arch_limit import arch_limit

    limit = arch_limit(stones)
    seconds = 0.2 if quick else 1.0
    trials = []
    for thickness in (0.110, 0.105, 1.001 * limit, 0.999 * limit):
        stands = thickness > limit
        # free fall would be g t^2/2; a mechanism just past its limit is driven by a small share
        share = abs(thickness / limit - 1)
        bar = 1e-9 if stands else 0.01 * share * scenes.G * seconds**2 / 2
        trials.append(Trial(
            f"arch of {stones} stones, t/R = {thickness:.6f}",
            f"{'stands' if stands else 'falls'}: limit {limit:.6f} by a linear programme",
            partial(scenes.arch, stones, thickness), seconds,
            "greatest move", greatest, bar, least=not stands,
        ))  # fmt: skip
    return trials


def card_trials() -> list[Trial]:
    """Two cards either side of the friction that lets them stand."""
    phi = radians(20)
    trials = []
    for off in (-1e-3, 1e-3):
        mu = (1 + off) * scenes.card_house_friction(phi)
        bar = 1e-9 if off > 0 else 1e-4 * scenes.G * 0.25**2 / 2
        trials.append(Trial(
            f"card house, mu = (1 {off:+g}) tan(phi)/2", "stands" if off > 0 else "slides apart",
            partial(scenes.card_house, phi, mu), 0.25, "greatest move", greatest, bar,
            least=off < 0,
        ))  # fmt: skip
    return trials


def wedge_trials() -> list[Trial]:
    """A squeezed wedge either side of self-locking."""
    half_angle, force, seconds = radians(20), 1e5, 0.05
    trials = []
    for off in (-1e-2, -1e-6, 0.0, 1e-6, 1e-2):
        mu = (1 + off) * tan(half_angle)
        build = partial(scenes.wedge, half_angle, mu, force)
        drive = scenes.wedge_acceleration(build(), half_angle, mu, force) if off < 0 else 0.0
        rise = drive * seconds**2 / 2
        trials.append(Trial(
            f"wedge, mu = (1 {off:+.0e}) tan a" if off else "wedge, mu = tan a exactly",
            f"driven out by {rise:.3g} m in {seconds:g} s" if rise else "jams",
            build, seconds, "off its place",
            from_way(rise, axis=1),
            0.01 * rise if rise else 1e-9,
        ))  # fmt: skip
    return trials


def trial_rows(trials: Sequence[Trial], peers: Sequence[str]) -> list[Row]:
    """Every trial by ours and the peers asked for."""
    rows = []
    for trial in trials:
        rows += [trial_ours(trial, method) for method in trial.methods]
        rows += [trial_peer(trial, engine) for engine in peers]
    return rows
