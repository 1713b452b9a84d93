"""Rates of D1 beside published ones, where they are greatest, error against cost: ``PARTS``."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from track_line.beam import roll_axle
from track_line.laws import BedLoad, get_law
from track_line.scene.file import build_line, load_scene
from track_line.settling.level import BANDS, smooth_level
from track_line.settling.line import Line
from track_line.settling.march import Record, State, march_line, start_line
from trackbed.scenes import find_scene_file
from validation.studies.track_geometry.grading import GRADINGS, measure_grading

Row = dict[str, Any]
EARLY, AXLES = 20.0, 5e6
"""From where on a rate is taken [MGT], and to how many axles."""
VARIED = ("scatter.stiffness=0.0", "scatter.settlement=0.2")
LONG = "scatter.length=3.0"
RATES = {
    "variation 0.2": VARIED,
    "variation 0.05": (VARIED[0], "scatter.settlement=0.05"),
    "variation 0.2, alike over 3 m": (*VARIED, LONG),
    "variation 0.2, forgotten in 5 mm": (*VARIED, "scatter.memory=5e-3"),
    "variation 0.2, no linear term": (*VARIED, "law.parameters={linear=0.0}"),
    "variation 0.2, law of Varandas": (*VARIED, 'law={name="varandas"}'),
    "variation 0.2, power law": (*VARIED, 'law={name="power"}'),
    "stiffness alone: 0.3 over 3 m": ("scatter.stiffness=0.3", "scatter.settlement=0.0", LONG),
    "sleeper pads: beds of 14 MN/m": (*VARIED, "track.bed=14e6"),
    "axles of 25 t": (*VARIED, "axle.0.load=250e3"),
    "sleepers 0.75 m apart": (*VARIED, "track.spacing=0.75"),
    "rail pads of 50 MN/m": (*VARIED, "track.pad=50e6"),
}
"""Changes of the shipped scene: beds, law, track."""
WINDOW = 42
"""Sleepers of 25 m, the longest wave of D1."""
NEAR = 5
"""Sleepers of 3 m, over which stiffness is averaged."""
UNSPRUNG, SPEED = 800.0, 40.0
"""Mass of a wheel and its half axle [kg], and how fast it rolls [m/s]."""
COMBS = (8, 12, 16, 20, 26, 40)
"""Seats between wheels of one solution."""


def build(lines: int, *overrides: str) -> Line:
    """The shipped scene with the law of Shenton as it is, and changes."""
    own = (f"line.axles={AXLES}", 'law={name="shenton"}')
    return build_line(load_scene(find_scene_file("line"), [*own, *overrides]), lines)


def march(line: Line, axles: float, finer: float = 1.0) -> list[tuple[State, Record]]:
    """All states and records of a run."""
    return list(march_line(line, start_line(line), axles, finer=finer))


def measure_rate(overrides: tuple[str, ...]) -> Row:
    """D1 of the median section [m] and its rate behind `EARLY` [m/MGT], settlement [m], share of
    sleepers that hang, and what the unsprung mass adds to a wheel's load [-]."""
    line = build(30, *overrides)
    records = [record for _, record in march(line, AXLES * 200e3 / line.axles[0].load)]
    tonnage = line.find_tonnage(np.array([one.cycle for one in records]))
    median = np.array([np.median(one.deviation) for one in records])
    early, last = float(np.interp(EARLY, tonnage, median)), float(median[-1])
    wave = 2 * np.pi / np.sqrt(BANDS[1:] * BANDS[:-1])
    bent = float(np.sqrt(((wave**2 * records[-1].spectrum) ** 2).sum()))  # rms of the curvature
    return {
        "early": early, "d1": last, "rate": (last - early) / float(tonnage[-1] - EARLY),
        "settlement": float(records[-1].settlement.mean()),
        "hanging": float(records[-1].voids[0].mean()),
        "added": UNSPRUNG * SPEED**2 * bent / line.axles[0].wheel,
    }  # fmt: skip


def find_level(line: Line, state: State) -> np.ndarray:
    """D1 of the loaded lines (b, n), without their margins [m]."""
    wheel = line.axles[0].wheel
    level = roll_axle(line.rail, line.support, state.settled, wheel).level
    return smooth_level(level, line.track.spacing)[:, line.inside]


def measure_soft_ground(law: str) -> Row:
    """On beds that differ by stiffness alone, 0.3 over 10 m: of the 5 % of windows whose D1 grows
    most in the latter half of the blocks, the share that is softer than the median and has a
    greater gradient over its stiffness than the median; and that share of all windows."""
    changes = ("scatter.stiffness=0.3", "scatter.settlement=0.0", "scatter.length=10.0")
    line = build(30, *changes, f'law={{name="{law}"}}')
    states = [state for state, _ in march(line, AXLES)]
    grown = find_level(line, states[-1]) - find_level(line, states[len(states) // 2])
    count = grown.shape[1] // WINDOW * WINDOW
    growth = np.sqrt((grown[:, :count].reshape(-1, WINDOW) ** 2).mean(axis=1))
    beds = line.beds.stiffness[:, line.inside][:, :count].reshape(-1, WINDOW)
    smooth = np.lib.stride_tricks.sliding_window_view(beds, NEAR, axis=1).mean(axis=2)
    steep = abs(smooth[:, NEAR:] - smooth[:, :-NEAR]).max(axis=1) / beds.mean(axis=1)
    soft = beds.mean(axis=1) < np.median(beds.mean(axis=1))
    poor = soft & (steep > np.median(steep))
    worst = growth >= np.quantile(growth, 0.95)
    return {
        "law": law, "worst_poor": float(poor[worst].mean()), "poor": float(poor.mean()),
        "with_stiffness": float(np.corrcoef(np.log(growth), np.log(beds.mean(axis=1)))[0, 1]),
        "with_gradient": float(np.corrcoef(np.log(growth), np.log(steep))[0, 1]),
    }  # fmt: skip


def compare(line: Line, finer: float = 1.0) -> tuple[np.ndarray, float]:
    """D1 of all sections [m] at the end, and the processor time [s]."""
    begun = time.process_time()
    return march(line, AXLES, finer)[-1][1].deviation, time.process_time() - begun


def measure_cost(law: str) -> Row:
    """Error of D1 (root mean square over sections, over itself) and time a line [s], by blocks
    beside stability's and by seats between wheels; the last of each is the reference."""
    line = build(10, *VARIED, f'law={{name="{law}"}}')
    compare(build(1))  # compiles
    ways: dict[str, list[tuple[float, np.ndarray, float]]] = {
        "blocks": [(one, *compare(line, one)) for one in (0.5, 1.0, 2.0, 8.0)],
        "comb": [(one, *compare(replace(line, support=replace(line.support, period=one))))
                 for one in COMBS],
    }  # fmt: skip
    row: Row = {"law": law, "lines": 10}
    for name, runs in ways.items():
        best = runs[-1][1]
        row[name] = [
            [way, seconds / 10, float(np.sqrt(((d1 - best) ** 2).mean() / (best**2).mean()))]
            for way, d1, seconds in runs[:-1]
        ]
    return row


def measure_lines() -> Row:
    """Scatter of the median section's D1 among groups of so many lines, over its mean, and time of
    a group [s]."""
    line = build(200, *VARIED)
    deviation, seconds = compare(line)
    groups = []
    for count in (2, 5, 10, 20):
        medians = np.median(deviation.reshape(-1, count * deviation.shape[1]), axis=1)
        groups.append([count, seconds * count / 200, float(medians.std(ddof=1) / medians.mean())])
    return {"lines": groups, "whole_s": seconds}


def measure_rose() -> Row:
    """Settlement [m] by its test's 12,288 axles, at the force that its first one implies."""
    law, load = get_law("varandas")(), BedLoad(np.array([41.6607e3]), np.array([28e6]))
    first, last = (float(law.advance(load, np.zeros(1), 0.0, n)[0]) for n in (1.0, 12288.0))
    return {"first": first, "last": last}


PARTS: dict[str, Callable[[], Row]] = {
    **{f"rate, {name}": partial(measure_rate, changes) for name, changes in RATES.items()},
    **{f"soft ground, {law}": partial(measure_soft_ground, law)
       for law in ("shenton", "varandas", "guerin")},
    **{f"cost, {law}": partial(measure_cost, law) for law in ("shenton", "power")},
    "cost, lines": measure_lines, "rose": measure_rose,
    **{f"grading, {name}": partial(measure_grading, name) for name in GRADINGS},
}  # fmt: skip
