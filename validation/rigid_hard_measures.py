"""Hard cases that are judged by more than a displacement: thresholds, forces, bounces, a jam.

Ours only where no peers are asked for; each function gives the rows of one case.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import nan, radians, sqrt

import numpy as np

from rigid_lcp.errors import NoSolution, RigidError
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation import rigid_scenes as scenes
from validation.rigid_hard_peers import bounce_peer, rod_force_peer, rod_stepped_peer
from validation.rigid_hard_trials import Row, Trial, greatest, trial_ours, trial_peer
from validation.rigid_hopper import first_jam

SLIDES = 1e-12
"""Speed after one step above which a pair of cards slides [m/s]; exact ones rest at 1e-17."""


def card_threshold_rows() -> list[Row]:
    """The friction at which two cards stop sliding apart, by bisection, against its closed form."""
    rows = []
    for degrees in (5.0, 20.0, 40.0):
        phi = radians(degrees)
        exact = scenes.card_house_friction(phi)
        low, high, steps, start = 0.5 * exact, 2.0 * exact, 0, time.process_time()
        while high - low > 1e-12 * exact:
            middle = (low + high) / 2
            run = scenes.card_house(phi, middle)
            run.advance(run.step)
            steps += 1
            if np.abs(run.velocities).max() > SLIDES:
                low = middle
            else:
                high = middle
        off = abs(high / exact - 1)
        rows.append(Row(
            f"card house, phi = {degrees:g}°", "stands iff mu >= tan(phi)/2", "time-stepping",
            "threshold off its closed form", off, "<= 1e-08", off <= 1e-8, "",
            time.process_time() - start, steps,
        ))  # fmt: skip
    return rows


def light_on_heavy_rows() -> list[Row]:
    """Forces under and over the heavy box: what the weights say."""
    ratio = 1e6
    run = scenes.light_on_heavy(ratio)
    weight = scenes.DENSITY * scenes.G
    start = time.process_time()
    run.advance(10 * run.step)
    cost = time.process_time() - start
    found = run.contacts
    pairs = {frozenset(pair) for pair in zip(found.body_a, found.body_b, strict=True)}
    exact = {
        frozenset((1, 2)): weight, frozenset((0, 1)): (1 + ratio) * weight,
        frozenset((0, 3)): (2 + ratio) * weight,
    }  # fmt: skip
    worst = 0.0
    for pair in pairs & exact.keys():
        mine = [frozenset(p) == pair for p in zip(found.body_a, found.body_b, strict=True)]
        worst = max(worst, abs(found.normal_force[mine].sum() / exact[pair] - 1))
    worst = worst if pairs == exact.keys() else nan
    return [Row(
        "light on heavy on light, 1 : 1e6 : 1", "forces are the weights above", "time-stepping",
        "forces off the weights", worst, "<= 1e-06", worst <= 1e-6, "", cost, run.steps,
    )]  # fmt: skip


def rod_rows(peers: Sequence[str] = ()) -> list[Row]:
    """Painleve's rod either side of the friction above which no finite force exists."""
    rows = []
    limit = scenes.sliding_rod_limit(scenes.sliding_rod(1.0, method="acceleration"))
    for below in (1e-1, 1e-3, 1e-6):
        run = scenes.sliding_rod((1 - below) * limit, method="acceleration", step=1e-9)
        mass, inertia = run.world.mass[0], run.world.inertia[0]
        centre = run.positions[0, 0]
        start, off, why = time.process_time(), nan, ""
        x = float(run.world.contacts(run.motion, 1e-9 * run.world.length).point[0, 0]) - centre
        exact = scenes.G / (below * (1 / mass + x * x / inertia))
        try:
            run.advance(run.step)
            off = abs(float(run.contacts.normal_force.sum()) / exact - 1)
        except RigidError as error:
            why = f"{type(error).__name__}: {error}"
        bar = 1e-10 / below  # the difference 1 - below of mu is known to round-off only
        rows.append(Row(
            f"Painleve rod, mu = (1 - {below:g}) limit", "force g / (1/m + x²/J - mu |xy|/J)",
            "acceleration", "force off it", off, f"<= {bar:.0e}", off <= bar, "",
            time.process_time() - start, 1, why,
        ))  # fmt: skip
        ours = rows[-1]
        rows += [rod_force_peer(ours, (1 - below) * limit, exact, peer) for peer in peers]
    for above in (1e-6, 1e-1):
        mu = (1 + above) * limit
        start, refused, why = time.process_time(), 0.0, ""
        try:
            scenes.sliding_rod(mu, method="acceleration").advance(1e-3)
        except NoSolution:
            refused = 1.0
        except RigidError as error:
            why = f"{type(error).__name__}: {error}"
        rows.append(Row(
            f"Painleve rod, mu = (1 + {above:g}) limit", "no finite force exists", "acceleration",
            "NoSolution raised", refused, ">= 1", refused == 1.0, "",
            time.process_time() - start, 1, why,
        ))  # fmt: skip
        stepped = _rod_stepped(mu, f"Painleve rod, mu = (1 + {above:g}) limit")
        theirs = [rod_stepped_peer(stepped, mu, peer) for peer in peers]
        for k, row in enumerate(stepped):
            rows += [row, *(measured[k] for measured in theirs)]
    return rows


def _rod_stepped(mu: float, case: str) -> list[Row]:
    """What impulses do where there are no forces: the tip stops, the rod goes on."""
    run = scenes.sliding_rod(mu, method="time-stepping")
    start, first, length = time.process_time(), run.energy, run.world.length
    grown, overlap, why = -1.0, 0.0, ""
    try:
        for _ in range(50):
            run.advance(run.step)
            grown = max(grown, run.energy / first - 1)
            overlap = max(overlap, run.overlap / length)
    except RigidError as error:
        grown, overlap, why = nan, nan, f"{type(error).__name__}: {error}"
    cost = time.process_time() - start
    answer = "an impulse stops the tip; goes on"
    return [
        Row(case, answer, "time-stepping", measure, value, f"<= {bar:.0e}", value <= bar, "", cost,
            run.steps, why)
        for measure, value, bar in (
            ("energy gained over the first", grown, 1e-12),
            ("overlap over half the length", overlap, 1e-8),
        )
    ]  # fmt: skip


def bounce_rows(bounces: int, peers: Sequence[str] = ()) -> list[Row]:
    """A disc that bounces with restitution 1: its energy a bounce."""
    height = 0.01
    period = 2 * sqrt(2 * height / scenes.G)
    rows = []
    methods: tuple[Method, ...] = ("time-stepping", "acceleration")
    for method in methods:
        run = scenes.bouncing_disc(height, 1.0, method=method, step=period / 7.3)
        mass, radius = run.world.mass[0], run.world.length
        floor = mass * scenes.G * radius
        first = run.energy - floor
        start, why = time.process_time(), ""
        try:
            run.advance(bounces * period)
        except RigidError as error:
            why = f"{type(error).__name__}: {error}"
        drift = abs((run.energy - floor) / first - 1) / bounces if not why else nan
        rows.append(Row(
            "disc bouncing, e = 1", "energy is kept", method,
            f"energy lost or gained a bounce, {bounces:.0e} bounces", drift, "<= 1e-13",
            drift <= 1e-13, "", time.process_time() - start, run.steps, why,
        ))  # fmt: skip
    return rows + [bounce_peer(rows[0], bounces, height, period, peer) for peer in peers]


def hopper_rows(quick: bool, peers: Sequence[str]) -> list[Row]:
    """A jammed hopper: the arch that pouring made stays."""
    start = time.process_time()
    held, seed, poured = first_jam(30, range(10))
    cost = time.process_time() - start
    discs = len(held.world.scene.bodies) - 4
    steps = 500 if quick else 10_000
    trial = Trial(
        f"jammed hopper, {discs} discs",
        f"stays (poured {poured:.2f} s, {cost:.0f} s CPU, seed {seed})",
        lambda: Simulation(held.world.scene, step=held.step), steps * held.step,
        f"greatest move in {steps:.0e} steps", greatest, 1e-9,
        peer_seconds=min(steps, 1000) * held.step,
    )  # fmt: skip
    return [trial_ours(trial, "time-stepping"), *(trial_peer(trial, peer) for peer in peers)]
