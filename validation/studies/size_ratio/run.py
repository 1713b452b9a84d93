"""Three grains on each engine: ``PARTS``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import ceil, cos, hypot, sin, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from adapters.bed.state import FloatArray
from adapters.scene.mechanics import find_wedge_ratio
from validation.bench import few_grains, few_grains_lammps, few_grains_yade
from validation.bench.few_grains import TrackRun, load_table_1

Row = dict[str, Any]
LARGE = 5e-3
"""Radius of the held grains [m]."""
PLACE = np.array([0.03, 0.03, 0.02])
"""Where they touch [m]: far from walls, 20 mm above the floor."""
START = np.radians(1.0)
"""Of the small grain, off the top [rad]."""
JUDGED = np.radians(35.0)
"""Where its roll is judged: before it can leave the groove."""
GRAVITY = 9.81


def synchronise(materials: str) -> str:
    """LAMMPS' contact law between grains with the remedy of Vyas et al., which no other has."""
    return "\n".join(
        f"{line} synchronized_verlet" if line.startswith("pair_coeff") else line
        for line in materials.split("\n")
    )


ENGINES: dict[str, TrackRun] = {
    "LIGGGHTS": few_grains.run_grains,
    "LAMMPS": few_grains_lammps.run_grains,
    "LAMMPS, synchronized_verlet": partial(few_grains_lammps.run_grains, materials=synchronise),
    "YADE": few_grains_yade.run_grains,
}
RATIOS, FRICTIONS, SHARES = (2.0, 2.8, 4.0, 6.0, 10.0, 20.0), (0.5, 1.0), (0.2, 0.4)
"""Size ratios; Coulomb's coefficients; time steps over the Rayleigh time of the small grain."""
FRAMES = 60


def roll(ratio: float, time: FloatArray) -> FloatArray:
    """Angle from the top [rad] of a grain that rolls without slip from rest at `START`.

    Its centre is at H from the axis of the large grains and turns about the line through both
    contacts, at r sin(theta) = r H / (R + r) from it: (1 + 2/5 / sin^2 theta) H phi'' = g sin phi.
    """
    height = sqrt((1 + 1 / ratio) ** 2 - 1) * LARGE
    inertia = 1 + 0.4 / (height / (LARGE * (1 + 1 / ratio))) ** 2
    found = solve_ivp(
        lambda _, y: [y[1], GRAVITY * sin(y[0]) / (height * inertia)], (0, time[-1]), [START, 0.0],
        t_eval=time, rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    angle: FloatArray = found.y[0]
    return angle


def measure(engine: str, ratio: float, friction: float, share: float) -> Row:
    """``off``: error of the angle in the last frame before `JUDGED` [-]; ``falls``: whether it
    does."""
    scene = load_table_1(
        "material.grain.young=5e8", f"material.grain.friction={friction}",
        f"engine.rayleigh_share={share}",
    )  # fmt: skip
    small = LARGE / ratio
    height = sqrt((LARGE + small) ** 2 - LARGE**2)
    step = scene.time_step * small / scene.sample.radii.smallest  # goes as the radius
    time = np.linspace(0, 3, 3001)
    reached = float(np.interp(JUDGED, roll(ratio, time), time))
    end = 2 * reached + 2 * sqrt(2 * PLACE[2] / GRAVITY)
    every = ceil(end / step / FRAMES)
    aside = PLACE + np.array([[-LARGE, 0, 0], [LARGE, 0, 0]])
    top = PLACE + height * np.array([0, sin(START), cos(START)])
    motion = [
        "group held id 1 2", "group free id 3", "fix hold held freeze",
        f"fix fall free gravity {GRAVITY} vector 0 0 -1", "fix motion free nve/sphere",
        f"run {every * FRAMES}",
    ]  # fmt: skip
    track = ENGINES[engine](
        scene, np.vstack([aside, top]), np.zeros((3, 3)), motion, time_step=step, every=every,
        radius=np.array([LARGE, LARGE, small]),
    )  # fmt: skip
    place = track.position[:, 2] - PLACE
    angle = np.arctan2(place[:, 1], place[:, 2])
    exact = roll(ratio, track.time)
    at = int(np.argmax(exact > JUDGED)) - 1
    return {
        "engine": engine, "ratio": ratio, "friction": friction, "share": share,
        "off": float(angle[at] / exact[at] - 1),
        "falls": bool(hypot(*place[-1, 1:]) > 1.1 * height),
        "wedge_ratio": find_wedge_ratio(friction),
    }  # fmt: skip


def list_parts() -> dict[str, Callable[[], Row]]:
    """Every engine, ratio, friction and step."""
    return {
        f"{engine}, ratio {ratio:g}, friction {friction:g}, step {share:g}": partial(
            measure, engine, ratio, friction, share
        )
        for engine in ENGINES
        for friction in FRICTIONS
        for share in SHARES
        for ratio in RATIOS
    }


PARTS = list_parts()
