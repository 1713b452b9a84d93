"""Runs of tracks of some 20 grains, judged: equilibrium, energies, resume, friction, speed."""

from __future__ import annotations

import tempfile
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.energy_account import energy_facts
from qdem_fem.errors import StepWarning
from qdem_fem.output import table_read
from qdem_fem.run_folder import RunFolder
from qdem_fem.scene_build import simulation_of
from qdem_fem.scene_checks import scene_load
from qdem_fem.scene_run import run_dynamic
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import bed_prepare
from qdem_fem.track_bodies import grains_nodes
from qdem_fem.track_figures import track_facts
from qdem_fem.track_recipe import bodies_of_bed, grains_of
from qdem_fem.track_scene import TrackPrepared
from validation.case import Check

SCENE = """
[track]
length = 0.13
width = 0.42
below = 14
beside = 6
cells = [3, 6, 4]
share = 0.13
ballast = { young = 30e9, poisson = 0.2, density = 2700.0, shear_viscosity = 1e4 }
sleeper = { young = 45e9, poisson = 0.167, density = 2350.0, shear_viscosity = 1e4 }
bed = "bed.npz"
unbalanced = 0.1
prepared_friction = 0.577
pressure = { times = [0.0, 0.005, 0.010], values = [0.0, 750e3, 0.0] }
[contact]
model = "spheres"
contacts = "near"
radius = 0.012
normal_stiffness = { ballast = 1.613e9, sleeper = 2.39e9 }
friction = 0.577
[simulation]
duration = 0.015
gravity = [0, 0, -9.81]
threads = 1
[output]
sampling = 1e-4
energy_interval = 1e-4
audit = 1e-3
"""
"""A track of 20 grains under one blow of 10 ms, with the stiffness, viscosity and spheres of
Table 1; the peak is the pressure of `qdem_fem.load_train` under an axle of 100 kN."""
FRICTIONS = (0.577, 1.73)
SOFTER = (0.1, 0.01)
"""Springs of the contacts over Table 1's."""
FALL_STEPS = 3000
HEAVIER = (1.2e-6, 1.5e-6, 2e-6)
"""Steps [s] that mass scaling brings every element to."""


class Quiet:
    """No progress is told."""

    def at(self, steps: int, total: int, when: float) -> None:
        """Nothing."""


@dataclass(frozen=True)
class TrackTrial:
    """A run from a prepared bed to its end."""

    facts: dict[str, Any]
    """`track_facts`"""
    energy: dict[str, float]
    """`energy_facts`"""
    rests: dict[str, dict[str, float]]
    step: float
    """[s]"""
    cpu: float
    """Processor time of marching [s]."""


def scene_at(folder: Path, *overrides: str) -> TrackPrepared:
    """The track of 20 grains, its files in a folder."""
    path = folder / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    prepared = scene_load(path, overrides)
    assert isinstance(prepared, TrackPrepared)
    return prepared


def trial(folder: Path, name: str, *overrides: str) -> TrackTrial:
    """Prepare, where that is not done yet, and run."""
    prepared = scene_at(folder, *overrides)
    run, bodies = simulation_of(prepared)
    place = RunFolder(folder / name)
    with place.locked():
        done = run_dynamic(prepared, run, bodies, place, resume=False, progress=Quiet())
    return TrackTrial(
        facts=track_facts(place.path, prepared.load),
        energy=energy_facts(table_read(place.path / "energy.csv")),
        rests=bed_prepare(prepared.recipe, prepared.bed_file).rests,
        step=run.step,
        cpu=done.cost["cpu_s"],
    )


def rest_checks(trial: TrackTrial) -> list[Check]:
    """The prepared state against the shares that the scene names, and its cost."""
    rest = trial.rests["rest"]
    asked = {"unbalanced": 0.1, "kinetic": 0.01, "loose": 0.02}
    checks = [
        Check(f"equilibrium, {name}", rest[name], f"<= {bar}", rest[name] <= bar)
        for name, bar in asked.items()
    ]
    spent = sum(one["cpu_s"] for one in trial.rests.values())
    return [*checks, Check("preparation", spent, "reported", True, "s CPU")]


def friction_checks(folder: Path) -> tuple[list[Check], TrackTrial]:
    """Both frictions of the paper from the same bed."""
    trials = [trial(folder, f"friction-{f}", f"contact.friction={f}") for f in FRICTIONS]
    checks = rest_checks(trials[0])
    for friction, one in zip(FRICTIONS, trials, strict=True):
        of = one.facts["sleeper"]
        missing = one.energy["relative_imbalance"]
        checks += [
            Check(f"friction {friction}: missing in the account of energies", missing, "<= 0.001",
                  missing <= 1e-3),
            Check(f"friction {friction}: greatest settlement", of["settlement_greatest"], "> 0",
                  of["settlement_greatest"] > 0, "m"),
            Check(f"friction {friction}: settlement that stays", of["settlement"], "reported", True,
                  "m"),
            Check(f"friction {friction}: lateral over vertical, greatest",
                  of["lateral_greatest"] / of["settlement_greatest"], "reported", True),
            Check(f"friction {friction}: processor time a simulated second", one.cpu / 0.015,
                  "reported", True, "s/s"),
        ]  # fmt: skip
    for name in ("settlement_greatest", "lateral_greatest"):
        ratio = trials[1].facts["sleeper"][name] / trials[0].facts["sleeper"][name]
        checks.append(
            Check(f"friction 1.73 over 0.577: {name.replace('_', ', ')}", ratio, "< 1", ratio < 1)
        )
    return checks, trials[0]


def resume_check(folder: Path) -> Check:
    """A run that is saved and taken up again beside one that is not: the same to the bit."""
    runs = [simulation_of(scene_at(folder))[0] for _ in range(2)]
    half = 1000 * runs[0].step
    runs[0].advance(half)
    runs[0].save(folder / "half.npz")
    runs[1].restore(folder / "half.npz")
    for run in runs:
        run.advance(half)
    one, other = (run.assembly.field("displacement") for run in runs)
    apart = float(np.abs(one - other).max())
    return Check("resumed run less uninterrupted one", apart, "== 0", apart == 0.0, "m")


def compared(name: str, one: TrackTrial, reference: TrackTrial) -> list[Check]:
    """Step, processor time and motion of the sleeper, over or beside the reference's."""
    ratios = [
        ("step over", one.step / reference.step),
        ("processor time over", one.cpu / reference.cpu),
        *(
            (f"{word}, greatest, beside", one.facts["sleeper"][key] / known - 1)
            for word, key in (
                ("settlement", "settlement_greatest"),
                ("lateral", "lateral_greatest"),
            )
            for known in [reference.facts["sleeper"][key]]
        ),
    ]
    return [Check(f"{name}: {what} the reference's", r, "reported", True) for what, r in ratios]


def speed_checks(folder: Path, reference: TrackTrial) -> list[Check]:
    """What makes a run cheaper, and what it costs in error: heavier small elements, softer springs;
    and the step for any contacts, which near ones make longer."""
    checks = compared("three contacts", trial(folder, "three", "contact.contacts=3"), reference)
    for step in HEAVIER:
        one = trial(folder, f"heavier-{step}", f"simulation.mass_scaling={step}")
        checks += compared(f"mass scaling to {1e6 * step:g} µs", one, reference)
    for softer in SOFTER:
        stiffness = f"{{ballast={softer * 1.613e9:g}, sleeper={softer * 2.39e9:g}}}"
        one = trial(
            folder, f"softer-{softer}", f"contact.normal_stiffness={stiffness}",
            f"track.bed=bed-{softer}.npz", f"track.softness={1e-4 / softer:g}",
        )  # fmt: skip
        checks += compared(f"springs times {softer}", one, reference)
    return checks


def fall_checks(folder: Path) -> list[Check]:
    """Processor time that a simulated second of the fall costs, grains deformable or rigid."""
    recipe = scene_at(folder).recipe
    grains = grains_of(recipe)
    nodes = recipe.layout.grains_below(grains_nodes(grains), recipe.seed)
    spent = []
    for rigid in (False, True):
        bodies = bodies_of_bed(recipe, grains, nodes, rigid=rigid)
        contact = replace(recipe.contact(list(bodies), recipe.softness), contacts=1)
        run = Simulation(list(bodies.values()), gravity=recipe.gravity, threads=1, contact=contact)
        run.advance(run.step)
        started = time.process_time()
        run.advance(FALL_STEPS * run.step)
        spent.append((time.process_time() - started) / (FALL_STEPS * run.step))
    names = ("deformable", "rigid")
    checks = [
        Check(f"fall on soft springs, {name} grains", one, "reported", True, "s CPU/s")
        for name, one in zip(names, spent, strict=True)
    ]
    gain = spent[0] / spent[1]
    return [*checks, Check("fall, deformable grains over rigid ones", gain, "> 1", gain > 1)]


def all_checks(quick: bool) -> list[Check]:
    """Every check of the case, in a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # contact makes the step short: known here
        folder = Path(name)
        checks, reference = friction_checks(folder)
        checks.append(resume_check(folder))
        if not quick:
            checks += speed_checks(folder, reference) + fall_checks(folder)
    return checks
