"""One jump on full runs of an engine, without the engine: what a law knows of the future.

The environment variable TRACKBED_DATA names a folder with ``full_runs/*.npz``: states at the ends
of all cycles, as ``initial_position_m`` (n, 3), ``radius_m`` (n,), ``displacement_um``
(cycles + 1, n, 3).  A window (k_i, k) is fitted, h cycles are jumped, the state is compared with
the computed one: the mean settlement relative to the total so far, and the displacement field of
the jump by eq. 22 (1 = move nothing).  Bars stand on two runs of 1,085 grains that differ by
round-off at the start: 7 % apart in the mean after 60 cycles, 1.3 % (one standard deviation) over
one doubling from a common state.  Small bursty beds can not judge a law; none is read here.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from adapters.jump_field import jump_field
from adapters.laws import law_named
from adapters.residual import error_of_displacement
from adapters.state import FloatArray
from validation.case import Check

RUNS = ("paper_scale_a", "paper_scale_b")
JUMPS = ((10, 20, 20), (50, 50, 50), (50, 50, 100), (100, 50, 50))
"""First cycles k_i, fitted cycles k, jumped cycles h; those that a run is long enough for."""
MEAN_BAR = 0.05
"""Greatest error of the mean settlement, relative to the total: one jump inside chaos' 7 %."""

Estimate = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]


def grain_by_grain(law: str) -> Estimate:
    """The paper's estimate: the law of each grain, nothing clipped, nothing smoothed."""
    return lambda cycle, position, radius, h: jump_field(
        cycle, position, radius, law_named(law), h, smoothing_radii=0, clip_quantile=1
    )


METHODS: dict[str, Estimate] = {
    "ours": lambda cycle, position, radius, h: jump_field(
        cycle, position, radius, law_named("log"), h
    ),
    "nothing moved": lambda cycle, position, radius, h: np.zeros_like(position[-1]),
    "linear": grain_by_grain("linear"),
    "log": grain_by_grain("log"),
}


def data_folder() -> Path | None:
    """The folder that TRACKBED_DATA names; None when it is not set or not there."""
    folder = Path(os.environ.get("TRACKBED_DATA", ""))
    return folder if (folder / "full_runs").is_dir() else None


def skipped() -> list[Check]:
    """One check that says why there is nothing to measure."""
    reason = "skipped: TRACKBED_DATA does not name a folder with full_runs/*.npz"
    return [Check(reason, 0.0, "data present", ok=True)]


def errors(run: Path, jump: tuple[int, int, int]) -> dict[str, tuple[float, float]]:
    """Error of the mean settlement and of the field, by method; none when the run is too short."""
    first, k, h = jump
    with np.load(run) as data:
        radius, displacement = data["radius_m"].astype(float), data["displacement_um"]
        if len(displacement) <= first + k + h:
            return {}
        position = data["initial_position_m"] + 1e-6 * displacement.astype(float)
    cycle, window = np.arange(float(len(position))), slice(first, first + k + 1)
    last, truth = position[first + k], position[first + k + h]
    total = float((truth - position[0])[:, 2].mean())
    found = {}
    for method, estimate in METHODS.items():
        moved = last + estimate(cycle[window], position[window], radius, h)
        mean = float((moved - truth)[:, 2].mean()) / total
        found[method] = (mean, error_of_displacement(last, truth, moved))
    return found


def run(quick: bool) -> list[Check]:
    """Errors of our estimate on every jump beside its rivals; ``quick`` changes nothing."""
    folder = data_folder()
    if folder is None:
        return skipped()
    checks, fields = [], []
    for name in RUNS:
        for jump in JUMPS:
            found = errors(folder / "full_runs" / f"{name}.npz", jump)
            if not found:
                continue
            mean, field = found["ours"]
            where = f"{name} {jump}"
            rivals = ", ".join(
                f"{rival} {found[rival][0]:+.3f}" for rival in ("nothing moved", "linear")
            )
            checks.append(
                Check(
                    f"{where}: mean settlement, relative to the total",
                    mean,
                    f"within {MEAN_BAR}, nearer than {rivals}",
                    abs(mean) <= MEAN_BAR
                    and all(abs(mean) < abs(found[r][0]) for r in ("nothing moved", "linear")),
                )
            )
            shown = ", ".join(f"{rival} {error[1]:.2f}" for rival, error in found.items())
            bar = f"below nothing moved and linear: {shown}"
            below = field < min(found["nothing moved"][1], found["linear"][1])
            checks.append(Check(f"{where}: field of the jump", field, bar, below))
            fields.append([error[1] for error in found.values()])
    ours, *rivals_mean = np.mean(fields, axis=0)
    listed = ", ".join(
        f"{rival} {mean:.2f}" for rival, mean in zip(list(METHODS)[1:], rivals_mean, strict=True)
    )
    checks.append(
        Check(
            "field of the jump, mean of all",
            float(ours),
            f"below {listed}",
            ours < min(rivals_mean),
        )
    )
    return checks
