"""Live beds of the coarse scene, jumped, relaxed by each method, and loaded on for ten cycles.

A bed is the rain of a seed and k_i = 100 cycles of the kind ``coarse`` of
`validation.settlement_ensemble`; the jump goes over h = 100 by the paper's law, each grain by its
own path of the last 50 cycles.  The full run, 110 cycles more, is what the jump is to meet.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import EngineStart, engine_named
from adapters.laws import law_named
from adapters.progress import Progress
from adapters.run_folder import Outcome, RunFolder
from adapters.stages import Bed, Run, Variant, compute, prepare
from adapters.state import Contacts, FloatArray, State
from adapters.window import Window, window_load
from validation.relaxation_jumps import Jumped, per_grain
from validation.relaxation_measures import figures_before
from validation.settlement_ensemble import COARSE, piston_stiffness

SEEDS = tuple(range(1, 9))
WINDOW, JUMP, AFTER = 50, 100, 10
"""Cycles of the fit, of the jump, and computed behind it."""

Row = dict[str, Any]


class LiveBed:
    """A bed of one seed under ``work``; its stages are computed once."""

    def __init__(self, seed: int, work: Path) -> None:
        self.seed, self.folder = seed, work / f"coarse-{seed}"
        self.scene = COARSE.scene(seed)

    def run(self, folder: Path) -> Run:
        """A run of this bed's scene in ``folder``."""
        engine = engine_named(self.scene.engine.name)
        return Run(self.scene, RunFolder(folder), engine, Variant(), Progress(quiet=True))

    @cached_property
    def bed(self) -> Bed:
        """The bed after k_i cycles, its last window that of the fit."""
        run = self.run(self.folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        first = compute(run, prepare(run), COARSE.k_i - WINDOW)
        return compute(run, first, WINDOW)

    @cached_property
    def window(self) -> Window:
        """The window of the fit."""
        return window_load(self.folder / self.bed.window / "states.npz")

    @cached_property
    def jump(self) -> Jumped:
        """The jump; the piston follows the log law of its own heights."""
        window, law = self.window, law_named("log")
        cycle = window.cycle.astype(float)
        estimate = per_grain(cycle, window.position, window.radius, JUMP)
        heights, rows = window.piston_heights(), slice(law.first_state, None)
        parameters = law.fit(cycle[rows], heights[rows])
        drop = float(law.increment(parameters, cycle[-1], cycle[-1] + JUMP))
        before = window.state(-1)
        walls = self.scene.container.walls
        return Jumped(
            f"coarse-{self.seed}",
            before,
            estimate,
            walls(before.piston_height),
            self.scene.stiffness,
            walls(before.piston_height + min(drop, 0.0)),
        )

    @property
    def piston_height(self) -> float:
        """Height of the piston behind the jump [m]."""
        after = self.jump.walls_after
        assert after is not None
        return float(after.plane_point[after.plane_name.index("piston"), 2])

    def resubmission(self, position: FloatArray, piston_height: float) -> EngineStart:
        """A start of the engine with grains at rest at ``position`` [m], as after any jump."""
        still = np.zeros_like(position)
        moved = self.jump.before.moved(
            position, velocity=still, spin=still, piston_height=piston_height
        )
        start = self.bed.start
        return replace(
            start, moved=moved, piston_height=piston_height, piston_mesh=start.piston_mesh + 1
        )

    def loaded(self, name: str, start: EngineStart, cycles: int) -> Window:
        """Load cycles from ``start`` in a folder of their own, which is not kept."""
        folder = self.folder / "after" / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        run = self.run(folder)
        preparation = RunFolder(self.folder).outcome("preparation")
        assert preparation is not None
        run.folder.finish(
            run.folder.begin("preparation"),
            Outcome("preparation", 0, 0, [], {}, notes=preparation.notes),
        )
        done = compute(run, Bed(self.bed.cycle, start), cycles)
        window = window_load(folder / done.window / "states.npz")
        shutil.rmtree(folder)
        return window

    def base(self) -> Row:
        """The cycles before the jump, the full run's behind it, and those the jump is to meet."""
        last = cycles_of(self.window, WINDOW - AFTER, WINDOW)
        full = self.loaded("full", self.bed.start, JUMP + AFTER)
        start = self.jump.before
        return {
            "figures": figures_before(self.jump),
            "before": self.answer(last, last.state(0), history=False),
            "full": self.answer(cycles_of(full, 0, AFTER), start, history=False),
            "met": self.answer(cycles_of(full, JUMP, JUMP + AFTER), start, history=False),
        }

    def answer(self, window: Window, before: State, history: bool) -> Row:
        """Figures of each cycle of a window behind a jump; heights against ``before``."""
        steps = self.scene.steps_per_cycle
        track, cycle = window.piston, window.piston.cycles(steps)
        peak = [float(track.contact_force[cycle == c].max()) for c in range(len(window))]
        touching = [2 * len(contacts) / len(window.radius) for contacts in window.contacts]
        row = {
            "settlement": (before.position[:, 2].mean() - window.position[:, :, 2].mean(axis=1)),
            "piston": before.piston_height - window.piston_heights(),
            "peak_force": np.array(peak) / track.target_force.max(),
            "force_error": track.force_error(steps),
            "coordination": np.array(touching),
            "deflection": track.elastic_deflection(steps),
            "stiffness": piston_stiffness(track, steps),
            "kinetic": 0.5
            * np.einsum("n,cni,cni->c", window.mass, window.velocity, window.velocity)[1:],
        }
        told: Row = {key: [float(f"{value:.6g}") for value in row[key]] for key in row}
        if history:
            told |= history_kept(before.contacts, window.contacts[0], window.contacts[1])
        return told


def cycles_of(window: Window, first: int, last: int) -> Window:
    """Cycles ``first`` + 1 to ``last`` of a window as a window of their own."""
    states, heights = slice(first, last + 1), window.piston_heights()
    cut = {
        name: getattr(window, name)[states]
        for name in ("time_step", "position", "velocity", "spin", "contacts")
    }
    low, high = window.time_step[first], window.time_step[last]
    track = window.piston
    inside = (track.time_step > low) & (track.time_step <= high)
    piston = replace(track, **{name: values[inside] for name, values in vars(track).items()})
    return replace(
        window,
        first_cycle=window.first_cycle + first,
        wall_force={name: force[states] for name, force in window.wall_force.items()},
        piston=piston,
        piston_start=float(heights[first]),
        **cut,
    )


def history_kept(before: Contacts, start: Contacts, first: Contacts) -> Row:
    """What became of the tangential forces between grains, over their sum before the jump.

    ``tangential_start`` and ``tangential_first`` at the restart and after the first cycle;
    ``pairs_kept`` share of the pairs before that touch at the restart.
    """

    def keys(contacts: Contacts) -> FloatArray:
        return np.asarray((contacts.pair[:, 0] << 32) + contacts.pair[:, 1])

    def total(contacts: Contacts) -> float:
        return float(np.linalg.norm(contacts.tangential_force, axis=1).sum())

    def normal(contacts: Contacts) -> float:
        return float(np.linalg.norm(contacts.normal_force, axis=1).sum())

    return {
        "pairs_kept": float(np.isin(keys(before), keys(start)).mean()),
        "tangential_start": total(start) / total(before),
        "tangential_first": total(first) / total(before),
        "normal_start": normal(start) / normal(before),
    }
