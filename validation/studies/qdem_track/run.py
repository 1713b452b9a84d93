"""The parts: 20 grains, three packings of 300, the paper's 5,700 at rest."""

from __future__ import annotations

import tempfile
import time
import warnings
from itertools import product
from pathlib import Path

from qdem_fem.files.errors import StepWarning
from qdem_fem.scene.checks import load_scene
from qdem_fem.track.bed import STAGES, read_bed
from qdem_fem.track.enter import TrackPrepared, choose_contact
from qdem_fem.track.stand import begin_bed
from validation.bench.qdem.checks import make_row, report
from validation.studies.qdem_track.bogie import FRICTIONS, SCENE, SEEDS, measure_packing
from validation.studies.qdem_track.trials import check_blows, check_levers, check_resume
from validation.study import Row

STEPS = 500


def run_twenty() -> Row:
    """20 grains, in a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # contact makes the step short: known here
        folder = Path(name)
        checks, reference = check_blows(folder)
        checks += [check_resume(folder), *check_levers(folder, reference)]
    return make_row(checks)


def run_packings() -> Row:
    """300 grains under one bogie: 12 minutes of one thread a run, and a bed for each packing."""
    with tempfile.TemporaryDirectory() as name:
        pairs = product(SEEDS, FRICTIONS)
        return make_row([], runs=[measure_packing(Path(name), *pair) for pair in pairs])


def run_paper_scale() -> Row:
    """A step of the paper's track from its bed at rest, one thread, all bodies deformable."""
    prepared = load_scene(SCENE.with_name("track.toml"))
    assert isinstance(prepared, TrackPrepared)
    recipe = prepared.recipe
    bed = read_bed(prepared.bed_file, recipe)
    if bed.stage != STAGES[-1]:
        raise SystemExit(
            f"{prepared.bed_file} is at stage {bed.stage}: trackbed qdem goes on there"
        )
    table = prepared.scene.simulation
    run = begin_bed(
        recipe, bed, choose_contact(prepared), strain=table.strain, step=table.step,
        safety=table.safety, threads=1, mass_scaling=table.mass_scaling,
    )[0]  # fmt: skip
    run.advance(20 * run.step)
    started = time.process_time()
    run.advance(STEPS * run.step)
    spent = (time.process_time() - started) / STEPS
    elements = sum(len(body.elements) for body in run.bodies)
    return make_row([
        report("grains", len(run.bodies) - 1),
        report("elements", elements),
        report("step", run.step, "s"),
        report("processor time of a step", spent, "s"),
        report("million element-steps a processor second", elements / spent / 1e6),
        report("preparation", sum(rest["cpu_s"] for rest in bed.rests.values()), "s CPU"),
    ])  # fmt: skip


PARTS = {"twenty": run_twenty, "packings": run_packings, "paper scale": run_paper_scale}
