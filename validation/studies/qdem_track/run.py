"""The parts: 20 grains, and each run of 300 grains."""

from __future__ import annotations

import hashlib
import tempfile
import warnings
from functools import partial
from itertools import product
from pathlib import Path

from qdem_fem.files.errors import StepWarning
from trackbed.errors import NotConverged
from validation.age import digest_rooms
from validation.bench.qdem.checks import make_row
from validation.studies.qdem_track.bogie import FRICTIONS, SEEDS, measure_packing
from validation.studies.qdem_track.trials import check_blows, check_levers, check_resume
from validation.study import Row


def run_twenty() -> Row:
    """20 grains, in a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # contact makes the step short: known here
        folder = Path(name)
        checks, reference = check_blows(folder)
        checks += [check_resume(folder), *check_levers(folder, reference)]
    return make_row(checks)


def run_packing(seed: int, friction: float) -> Row:
    """300 grains under one bogie: a quarter of an hour of one thread, and the bed once.

    Beds stay among the temporary files, for the other friction and after a kill, each version's
    by its own name."""
    code = hashlib.sha256(repr(digest_rooms("qdem-track")).encode()).hexdigest()[:12]
    bed = Path(tempfile.gettempdir()) / f"trackbed-study-bed-{code}-{seed}.npz"
    with tempfile.TemporaryDirectory() as name:
        try:
            return make_row([], run=measure_packing(Path(name), bed, seed, friction))
        except NotConverged as refused:  # a bed that does not bear its sleeper is an answer
            return make_row([], refused=refused.what.partition(": ")[2])


PARTS = {"twenty": run_twenty} | {
    f"packing {seed} at {friction}": partial(run_packing, seed, friction)
    for friction, seed in product(FRICTIONS, SEEDS)
}
