"""Jumps whose relaxation is compared: a bed before, and where the paper's law puts its grains.

    python -m validation.relaxation_jumps --full-runs FOLDER

writes ``validation/results/relaxation-jumps.npz`` from full runs at paper scale (a ``.npz`` a run:
``initial_position_m``, ``radius_m``, ``displacement_um`` of each cycle's end), so that the study
goes without them.  The walls are those of ``scenes/karrech.toml`` without its piston, of whose
height those runs say nothing and which is unloaded at a cycle's end.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from adapters.contact_law import HertzStiffness
from adapters.container import Walls
from adapters.jump_field import jump_field
from adapters.laws import law_named
from adapters.overlaps import behind_discs
from adapters.relaxation_surroundings import Surroundings
from adapters.scene_file import scene_load
from adapters.state import FloatArray, State
from scenes import scene_path

JUMPS = Path(__file__).parent / "results" / "relaxation-jumps.npz"

PAPER = (
    ("paper_scale_a", 25, 50, 50),
    ("paper_scale_b", 24, 48, 48),
    ("paper_scale_a", 50, 100, 100),
    ("paper_scale_a", 100, 200, 100),
)
"""Run, first cycle of the fit, cycle before the jump, cycles jumped."""


@dataclass(frozen=True)
class Jumped:
    """A bed of ``n`` grains before a jump, and its estimate after."""

    name: str
    before: State
    estimate: FloatArray
    """Estimated centres [m], (n, 3)."""
    walls: Walls
    """Walls before the jump."""
    stiffness: HertzStiffness
    walls_after: Walls | None = field(default=None)
    """The same with the piston where it is after the jump; None where nothing moves."""

    @property
    def around(self) -> Surroundings:
        """Walls and moduli after the jump."""
        after = self.walls if self.walls_after is None else self.walls_after
        behind = behind_discs(self.before.position, self.walls)
        return Surroundings(self.before.radius, after, behind, self.stiffness)

    @property
    def around_before(self) -> Surroundings:
        """Walls and moduli before the jump."""
        behind = behind_discs(self.before.position, self.walls)
        return Surroundings(self.before.radius, self.walls, behind, self.stiffness)


def per_grain(cycle: FloatArray, position: FloatArray, radius: FloatArray, h: float) -> FloatArray:
    """The paper's estimate (eqs 16 to 21): each grain by the log law of its own path [m], (n, 3).

    ``cycle`` (k+1,) and ``position`` [m] (k+1, n, 3) of a window, ``radius`` [m] (n,).
    """
    move = jump_field(
        cycle, position, radius, law_named("log"), h, smoothing_radii=0.0, clip_quantile=1.0
    )
    return np.asarray(position[-1] + move)


def state_resting(position: FloatArray, radius: FloatArray, density: float) -> State:
    """Grains at rest without any record of contacts; [m], [kg/m^3]."""
    mass = density * 4 / 3 * np.pi * radius**3
    still = np.zeros_like(position)
    return State(np.arange(len(radius)), position, radius, mass, still, still)


def jumps_make(full_runs: Path, path: Path = JUMPS) -> None:
    """Write the jumps of `PAPER` from the runs in ``full_runs``: beds before, and their moves."""
    arrays: dict[str, FloatArray] = {}
    for run, first, last, h in PAPER:
        with np.load(full_runs / f"{run}.npz") as data:
            start, radius = data["initial_position_m"], data["radius_m"]
            moved = data["displacement_um"][first : last + 1].astype(float)
        position = start + 1e-6 * moved
        cycle = np.arange(first, last + 1).astype(float)
        name = f"{run}-{last}-{h}"
        arrays[f"{name}.position"] = position[-1]
        arrays[f"{name}.radius"] = radius
        move = per_grain(cycle, position, radius, h) - position[-1]
        arrays[f"{name}.move"] = move.astype(np.float32)
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def jumps_load(path: Path = JUMPS) -> list[Jumped]:
    """The jumps at paper scale."""
    scene = scene_load(scene_path("karrech"))
    found = []
    with np.load(path) as data:
        for name in dict.fromkeys(key.rpartition(".")[0] for key in data.files):
            state = state_resting(
                data[f"{name}.position"], data[f"{name}.radius"], scene.material.grain.density
            )
            estimate = state.position + data[f"{name}.move"]
            walls = scene.container.walls()
            found.append(Jumped(name, state, estimate, walls, scene.stiffness))
    return found


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and write the jumps."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full-runs", type=Path, required=True, help="folder of the full runs")
    jumps_make(parser.parse_args(words).full_runs)


if __name__ == "__main__":
    main()
