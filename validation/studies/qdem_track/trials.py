"""Tracks of 20 grains under one blow: two frictions, rails, resumption, levers of cost."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from qdem_fem.files.output import read_table
from qdem_fem.report.track import list_track_facts
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.energy_account import list_energy_facts
from qdem_fem.scene.run import RunFolder, run_dynamic
from qdem_fem.track.bearing import begin_bed, press_sleeper
from qdem_fem.track.bed import prepare_bed, read_bed
from qdem_fem.track.enter import TrackPrepared, choose_contact
from trackbed.errors import NotConverged, SceneError
from validation.bench.qdem.checks import report
from validation.bench.track_trials import load_track
from validation.case import Check

FRICTIONS = (0.577, 1.73)
SEEDS = range(1, 20)
SOFTER = (0.1, 0.01)
"""Springs of the contacts over Table 1's."""
HEAVIER = (1.2e-6, 2e-6)
"""Steps [s] that mass scaling brings every element to."""
DURATION = 0.015
"""[s]"""


class Quiet:
    """No progress is printed."""

    def report(self, steps: int, total: int, when: float) -> None:
        """Nothing."""


@cache
def find_packing() -> str:
    """The first packing of 20 that comes to rest: others rock on, which round-off decides, so that
    processors differ, or have no room in the cribs."""
    for seed in SEEDS:
        with TemporaryDirectory() as folder, suppress(NotConverged, SceneError):
            prepared = load_track(Path(folder), f"track.seed={seed}")
            prepare_bed(prepared.recipe, prepared.bed_file)
            return f"track.seed={seed}"
    raise NotConverged(f"no packing of seeds {SEEDS} comes to rest")


@dataclass(frozen=True)
class Trial:
    """A run from a prepared bed to its end."""

    facts: dict[str, Any]
    """`list_track_facts`"""
    energy: dict[str, float]
    """`list_energy_facts`"""
    rests: dict[str, dict[str, float]]
    step: float
    """[s]"""
    cpu: float
    """Processor time of marching [s]."""
    folder: Path


def run_scene(prepared: TrackPrepared, folder: Path) -> Trial:
    """Prepare, where that is not done yet, and run."""
    run, bodies = make_simulation(prepared)
    place = RunFolder(folder)
    with place.lock():
        done = run_dynamic(prepared, run, bodies, place, resume=False, progress=Quiet())
    return Trial(
        facts=list_track_facts(place.path, prepared.load),
        energy=list_energy_facts(read_table(place.path / "energy.csv")),
        rests=prepare_bed(prepared.recipe, prepared.bed_file).rests,
        step=run.step,
        cpu=done.cost["cpu_s"],
        folder=place.path,
    )


def check_blows(folder: Path) -> tuple[list[Check], Trial]:
    """Equilibrium, both frictions of the paper from the same bed, and rails."""
    trials = [
        run_scene(
            load_track(folder, find_packing(), f"contact.friction={f}"), folder / f"friction-{f}"
        )
        for f in FRICTIONS
    ]
    rest = trials[0].rests["rest"]
    asked = {"unbalanced": 0.1, "kinetic": 0.01, "loose": 0.02}
    checks = [check_max(f"equilibrium, {name}", rest[name], bar) for name, bar in asked.items()]
    spent = sum(one["cpu_s"] for one in trials[0].rests.values())
    checks.append(report("preparation", spent, "s CPU"))
    for friction, one in zip(FRICTIONS, trials, strict=True):
        of, name = one.facts["sleeper"], f"friction {friction}"
        missing = one.energy["relative_imbalance"]
        checks += [
            check_max(f"{name}: missing in the account of energies", missing, 1e-3),
            report(f"{name}: greatest settlement", of["settlement_greatest"], "m"),
            report(f"{name}: settlement that stays", of["settlement"], "m"),
            report(f"{name}: processor time a simulated second", one.cpu / DURATION, "s/s"),
        ]
    for key in ("settlement_greatest", "lateral_greatest"):
        ratio = trials[1].facts["sleeper"][key] / trials[0].facts["sleeper"][key]
        name = f"friction 1.73 over 0.577: {key.replace('_', ', ')}"
        checks.append(Check(name, ratio, "< 1", ratio < 1))
    return [*checks, *check_rails(folder)], trials[0]


def check_rails(folder: Path) -> list[Check]:
    """What a slow pulse leaves where rails hold the seats along the track, or nothing does."""
    prepared, checks = load_track(folder, find_packing()), []
    recipe, file = prepared.recipe, prepared.bed_file
    for name, held in (("held", True), ("free", False)):
        run, _ = begin_bed(recipe, read_bed(file, recipe), choose_contact(prepared), threads=1)
        for one in [] if held else [one for one in run.conditions.held if one.components == (1,)]:
            run.remove(one)
        pulse = press_sleeper(run, recipe, prepared.greatest)
        lengths = ("way", "sunk", "aside")
        checks += [report(f"{name}: {key}", getattr(pulse, key), "m") for key in lengths]
    return checks


def check_max(name: str, value: float, bar: float, unit: str = "") -> Check:
    """A value and its upper bar."""
    return Check(name, float(value), f"<= {bar:g}", bool(value <= bar), unit)


def check_resume(folder: Path) -> Check:
    """A run that is saved and taken up again beside one that is not: the same to the bit."""
    runs = [make_simulation(load_track(folder, find_packing()))[0] for _ in range(2)]
    half = 1000 * runs[0].step
    runs[0].advance(half)
    runs[0].save(folder / "half.npz")
    runs[1].restore(folder / "half.npz")
    for run in runs:
        run.advance(half)
    fields = [[body.displacement for body in run.bodies] for run in runs]
    apart = max(float(np.abs(a - b).max()) for a, b in zip(*fields, strict=True))
    return Check("resumed run less uninterrupted one", apart, "== 0", apart == 0.0, "m")


def check_levers(folder: Path, reference: Trial) -> list[Check]:
    """What makes a run cheaper, and at what error of the greatest settlement."""
    levers = {"three contacts": ["contact.contacts=3"]}
    levers |= {
        f"mass scaling to {1e6 * step:g} µs": [f"simulation.mass_scaling={step}"]
        for step in HEAVIER
    }
    levers |= {
        f"springs times {softer}": [
            "contact.normal_stiffness="
            f"{{ballast={softer * 1.613e9:g}, sleeper={softer * 2.39e9:g}}}",
            f"track.bed=bed-{softer}.npz", f"track.softness={1e-4 / softer:g}",
        ]
        for softer in SOFTER
    }  # fmt: skip
    checks, known = [], reference.facts["sleeper"]["settlement_greatest"]
    for number, (name, overrides) in enumerate(levers.items()):
        one = run_scene(load_track(folder, find_packing(), *overrides), folder / f"lever-{number}")
        error = one.facts["sleeper"]["settlement_greatest"] / known - 1
        checks += [
            report(f"{name}: step over the reference's", one.step / reference.step),
            report(f"{name}: processor time over the reference's", one.cpu / reference.cpu),
            report(f"{name}: settlement, greatest, beside the reference's", error),
        ]
    return checks
