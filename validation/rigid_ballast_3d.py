"""A sleeper block on polyhedral ballast in space: settlement against the step, and what it costs.

    python -m validation.rigid_ballast_3d --run [--quick] [--out FILE]    what the record lacks
    python -m validation.rigid_ballast_3d                    write the page from the record
    python -m validation.rigid_ballast_3d --chains RUN       and the picture of force chains, from
                                                   the folder of a run of the scene

Bed and surfaces are those of ``scenes/sleeper-3d.toml``, each sample with a seed of its own.  The
stones are poured; the block is laid on the highest of them and pressed down; then the load goes
up and down.  The block stays level, as rails hold a sleeper: one that may tilt does, and that
tells more of one stone than of the bed.  Pouring is the same for all steps of a sample, so that
only the cycles differ.  Every run is a line of the record, written when it ends; a killed study
goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from rigid_lcp.motion import Motion
from rigid_lcp.rotations import rotate
from rigid_lcp.scene import Scene
from rigid_lcp.scene_file import scene_build, scene_read
from rigid_lcp.shapes_3d import box
from rigid_lcp.simulation import Simulation

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "scenes" / "sleeper-3d.toml"
RECORD = ROOT / "validation" / "results" / "rigid-ballast-3d.jsonl"
Floats = NDArray[np.float64]
Data = dict[str, Any]

STEPS = (2e-3, 1e-3, 5e-4)
"""Steps of the cycles [s]."""
SAMPLES = 10
BLOWN_UP = 50.0
"""Speed above which a run is no motion of ballast any more [m/s]: it is stopped, and told."""
HELD = 1e6
"""What the block's inertia is multiplied with, so that it does not turn."""
FAR = 10.0
"""Height at which the block waits for the stones [m]."""


@dataclass(frozen=True)
class Study:
    """What is the same in all samples and steps."""

    stones: int = 100
    block: tuple[float, float, float] = (0.12, 0.09, 0.06)
    """Edges of the sleeper block [m]."""
    least: float = 50.0
    most: float = 500.0
    """Smallest and greatest load [N]."""
    frequency: float = 25.0
    """[Hz]."""
    cycles: int = 6
    pouring: float = 0.45
    """Time in which the stones fall and come to rest [s]."""
    laying: float = 0.15
    """Time under the smallest load before the cycles [s]."""
    step: float = 1e-3
    """Step while pouring and laying [s]."""
    tolerance: float = 1e-6
    """Scale-free residual asked of every step [-]."""


QUICK = Study(stones=12, cycles=2, pouring=0.35, laying=0.05)


def bed(study: Study, sample: int) -> tuple[Scene, int]:
    """Stones above their box and the block far above them; the block's number."""
    overrides = (f"grains.0.count={study.stones}", f"grains.0.seed={sample}", "body=[]", "load=[]")
    scene = scene_build(scene_read(SCENE, overrides))
    block = scene.add(
        box(*study.block), density=2400.0, position=[0.0, 0.0, FAR], friction=0.6, name="sleeper"
    )
    body = scene.bodies[block]
    scene.bodies[block] = replace(body, inertia=HELD * body.inertia)
    return scene, block


def block_laid(scene: Scene, motion: Motion, block: int) -> Motion:
    """The block at rest a hair above the highest corner that may be under it."""
    shape = scene.bodies[block].shape
    half, top = shape.vertices.max(axis=0), 0.0
    for number, body in enumerate(scene.bodies):
        if body.movable and number != block:
            corners = motion.position[number] + rotate(motion.angle[number], body.shape.vertices)
            under = (np.abs(corners[:, :2]) <= half[:2] + body.shape.reach).all(axis=1)
            top = max(top, float(corners[under, 2].max(initial=0.0)))
    position, velocity = motion.position.copy(), motion.velocity.copy()
    position[block], velocity[block] = [0.0, 0.0, top + half[2] + 1e-4], 0.0
    return replace(motion, position=position, velocity=velocity)


def laid(study: Study, sample: int) -> tuple[Simulation, int]:
    """Stones poured and the block at rest on them under the smallest load; the block's number."""
    scene, block = bed(study, sample)
    pour = Simulation(scene, step=study.step, tolerance=study.tolerance)
    pour.advance(study.pouring)
    run = Simulation(
        scene, step=study.step, tolerance=study.tolerance,
        loads=lambda _, motion: pushed(motion, block, study.least),
    )  # fmt: skip
    run.motion = block_laid(scene, pour.motion, block)
    run.advance(study.laying)
    return run, block


def pushed(motion: Motion, body: int, force: float) -> Floats:
    """Loads (n, 6) [N, N m]: ``force`` [N] down on a body."""
    loads = np.zeros((len(motion.position), 6))
    loads[body, 2] = -force
    return loads


def load_at(study: Study, seconds: float) -> float:
    """Load [N] ``seconds`` after the first cycle began."""
    rise = 0.5 - 0.5 * np.cos(2 * np.pi * study.frequency * seconds)
    return float(study.least + (study.most - study.least) * rise)


def cycled(study: Study, start: Simulation, block: int, step: float) -> Data:
    """All cycles in steps of ``step`` [s] from the state of ``start``: what came of it."""
    scene = start.world.scene
    began = start.time
    run = Simulation(
        scene, step=step, tolerance=study.tolerance,
        loads=lambda now, motion: pushed(motion, block, load_at(study, now - began)),
    )  # fmt: skip
    run.motion, run.contacts, run.time = start.motion, start.contacts, began
    period = 1.0 / study.frequency
    count = round(period / step)
    height = [run.positions[block, 2]]
    residual, carrying, sliding, found, overlap, gain, lost, work = [], [], [], [], 0.0, 0.0, [], []
    cpu, why = 0.0, ""
    for cycle in range(study.cycles):
        dissipated = worked = 0.0
        for _ in range(count):
            energy, place, now = run.energy, run.positions[block, 2], run.time
            run.worst_residual, tick = 0.0, time.process_time()
            run.advance(period / count)
            cpu += time.process_time() - tick
            force = load_at(study, now + 0.5 * period / count - began)
            done = force * (place - run.positions[block, 2])
            spent = energy + done - run.energy
            dissipated, worked, gain = dissipated + spent, worked + done, max(gain, -spent)
            residual.append(run.worst_residual)
            status = run.contacts.status
            found.append(len(status))
            carrying.append(int((status != "open").sum()))
            sliding.append(int((status == "slide").sum()))
            overlap = max(overlap, run.overlap)
            if (speed := float(np.abs(run.velocities).max())) > BLOWN_UP:
                why = f"{speed:.1g} m/s in cycle {cycle + 1}"
                break
        if why:
            break
        height.append(run.positions[block, 2])
        lost.append(dissipated)
        work.append(worked)
    return {
        "step": step,
        "settlement": [float(height[0] - z) for z in height[1:]],
        "contacts": float(np.mean(found)),
        "carrying": float(np.mean(carrying)),
        "sliding": float(np.mean(np.array(sliding) / np.maximum(carrying, 1))),
        "steps": len(found),
        "ok": not why,
        "why": why,
        "cpu_s": cpu,
        "residual_median": float(np.median(residual)),
        "residual_99": float(np.quantile(residual, 0.99)),
        "residual_worst": float(np.max(residual)),
        "overlap": overlap,
        "size": float(np.mean([2 * b.shape.reach for b in scene.bodies if b.movable])),
        "dissipated": [float(value) for value in lost],
        "work": [float(value) for value in work],
        "gain": gain,
    }


def rows(study: Study, samples: int, steps: Sequence[float], done: set[Any]) -> Iterator[Data]:
    """A line for every sample and step that is not ``done`` yet, (sample, step)."""
    for sample in range(1, samples + 1):
        todo = [step for step in steps if (sample, step) not in done]
        if not todo:
            continue
        start, block = laid(study, sample)
        for step in todo:
            yield {"sample": sample, "stones": study.stones} | cycled(study, start, block, step)


def record_read(path: Path = RECORD) -> list[Data]:
    """Lines of a record; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def study_run(study: Study, samples: int, steps: Sequence[float], path: Path) -> list[Data]:
    """Measure what the record at ``path`` has not; the record after every run on disk."""
    lines = record_read(path)
    origin = provenance(["python", "-m", "validation.rigid_ballast_3d", "--run"])
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    done = {(line["sample"], line["step"]) for line in lines}
    for line in rows(study, samples, steps, done):
        lines.append({"case": "rigid-ballast-3d"} | line | kept)
        write_atomically(path, "".join(json.dumps(each) + "\n" for each in lines))
        came = line["why"] or f"{1e3 * line['settlement'][-1]:.4f} mm"
        print(
            f"sample {line['sample']}, step {line['step']:g} s: {came}, {line['cpu_s']:.1f} s",
            flush=True,
        )
    return lines


def main(words: Sequence[str] | None = None) -> None:
    """Command line."""
    from validation.rigid_ballast_3d_page import chains_write, page_write

    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--run", action="store_true", help="measure what is missing first")
    parser.add_argument("--out", type=Path, default=RECORD, help="record of --run, to begin anew")
    parser.add_argument("--quick", action="store_true", help="a small bed, which is not recorded")
    parser.add_argument("--chains", type=Path, metavar="RUN", help="folder of a run of the scene")
    given = parser.parse_args(words)
    if given.quick:
        for line in rows(QUICK, 1, STEPS[:2], set()):
            print(json.dumps(line))
        return
    if given.run:
        study_run(Study(), SAMPLES, STEPS, given.out)
    if given.chains:
        chains_write(given.chains)
    page_write(record_read())


if __name__ == "__main__":
    main()
