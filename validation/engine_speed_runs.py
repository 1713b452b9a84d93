"""Time the engines: ``python -m validation.engine_speed_runs --work FOLDER [--only speed ...]``.

Writes one line a finished run to ``validation/results/engine-speed.jsonl`` as it goes; a second
call goes on behind the last line.  ``--fresh`` begins a record anew, for the kinds named.

``speed``     the settled bed on each engine, CPU time of two lengths, so that no start-up counts
``adapter``   a window of load cycles, the engine alone beside all that `trackbed` does for it
              (``adapter-paper``: at the paper's stiffness)
``accuracy``  Chung and Ooi's tests at several steps
``ranks``     the settled bed on 1 and 2 processes of MPI

``--paper RUN`` adds the figures of a finished run of ``scenes/karrech.toml`` instead.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from adapters.engine import EngineStart, engine_named
from adapters.provenance import provenance
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from validation import engine_speed_bare as bare
from validation.cases.engines import engines_present
from validation.engine_speed_accuracy import STEPS, errors_at
from validation.engine_speed_bed import TABLE_1, bed_scene, mirrored, tile_settled
from validation.engine_speed_windows import LOADING, start_at_rest, window_cost

Row = dict[str, Any]
Done = Callable[[Row], bool]
"""Whether the record has a row of this kind, engine and setting."""
Sizes = dict[tuple[int, int], tuple[int, int]]

RECORD = Path(__file__).parent / "results" / "engine-speed.jsonl"

REPEATS = 5

YOUNG = TABLE_1["young"]
"""Young's modulus of the grains [Pa] where speed is told."""
SPEED: Sizes = {(1, 1): (500, 4500), (3, 3): (100, 600)}
"""Tiles along x and y -> steps of the short and of the long run."""

ADAPTER_YOUNG = 1e9
"""Young's modulus of the grains [Pa] in the windows through trackbed: a frame every 5,500 steps,
where the paper's grains need 37,200, so that its cost shows seven times as much."""
ADAPTER_CYCLES = {"liggghts": 2, "lammps": 2, "yade": 1}

RANKS = {(3, 3): 300, (10, 9): 40}
"""Tiles along x and y -> steps."""
LAUNCHERS = {"liggghts": ("mpirun", "-np"), "lammps": ("mpiexec", "-n")}


def speed_rows(
    work: Path, done: Done, sizes: Sizes = SPEED, repeats: int = REPEATS, young: float = YOUNG
) -> Iterator[Row]:
    """Every engine on the same bed in turn, ``repeats`` times; beds and steps as `SPEED`."""
    tile = tile_settled(work, young)
    for repeat in range(repeats):
        for tiles, (short, long) in sizes.items():
            position, radius = mirrored(*tile, tiles)
            for engine in engines_present():
                setting = {"grains": len(radius), "steps": [short, long], "repeat": repeat}
                row = {"kind": "speed", "method": engine, "setting": setting}
                if done(row):
                    continue
                scene = bed_scene(engine, tiles, young=young)
                with TemporaryDirectory(dir=work) as temporary:
                    runs = [
                        bare.bed_run(scene, position, radius, steps, Path(temporary) / str(steps))
                        for steps in (short, long)
                    ]
                cost = runs[1].cpu_s - runs[0].cpu_s
                yield row | {
                    "cost_s": cost,
                    "start_up_s": runs[0].cpu_s - cost * short / (long - short),
                    "work": len(radius) * (long - short),
                    "work_unit": "grain-steps",
                    "time_step": scene.time_step,
                    "contacts_per_grain": bare.contacts_per_grain(runs[1].end),
                    "mean_height": bare.mean_height(runs[1].end),
                }


def adapter_rows(
    work: Path,
    done: Done,
    repeats: int = REPEATS,
    young: float = ADAPTER_YOUNG,
    cycles_of: Mapping[str, int] = ADAPTER_CYCLES,
) -> Iterator[Row]:
    """The same window of load cycles through trackbed and by hand, on the bed of one tile."""
    position, radius = tile_settled(work)
    starts: dict[str, EngineStart] = {}
    for repeat in range(repeats):
        for engine in (name for name in engines_present() if name in cycles_of):
            cycles = cycles_of[engine]
            setting = {
                "grains": len(radius),
                "young": young,
                "cycles": cycles,
                "repeat": repeat,
            }
            row = {"kind": "adapter", "method": engine, "setting": setting}
            if done(row):
                continue
            scene = bed_scene(engine, (1, 1), LOADING, young=young)
            if engine not in starts:
                folder = work / f"start_{engine}"
                shutil.rmtree(folder, ignore_errors=True)
                starts[engine] = start_at_rest(scene, position, radius, folder)
            with TemporaryDirectory(dir=work) as temporary:
                if len(starts) == 1:  # compiled code is loaded once a session, not once a window
                    window_cost(scene, starts[engine], 1, Path(temporary) / "warm")
                cost = window_cost(scene, starts[engine], cycles, Path(temporary))
            yield row | {
                "cost_s": cost.through,
                "alone_s": cost.alone,
                "python_s": cost.python,
                "output_s": cost.output,
                "work": len(radius) * scene.steps_per_cycle * cycles,
                "work_unit": "grain-steps",
                "steps_per_cycle": scene.steps_per_cycle,
            }


def adapter_paper_rows(work: Path, done: Done) -> Iterator[Row]:
    """`adapter_rows` at the paper's stiffness, one cycle."""
    return adapter_rows(work, done, REPEATS, YOUNG, dict.fromkeys(ADAPTER_CYCLES, 1))


def accuracy_rows(work: Path, done: Done) -> Iterator[Row]:
    """Errors of Chung and Ooi's tests at `STEPS` steps in a contact."""
    for engine in engines_present():
        for steps in STEPS:
            row = {"kind": "accuracy", "method": engine, "setting": {"steps_in_contact": steps}}
            if not done(row):
                yield row | {"error": errors_at(engine, steps)}


def ranks_rows(work: Path, done: Done) -> Iterator[Row]:
    """The settled bed on 1 and 2 processes; elapsed times need a machine without other work."""
    tile = tile_settled(work)
    for repeat in range(REPEATS):
        for tiles, steps in RANKS.items():
            bed = mirrored(*tile, tiles)
            for engine in (name for name in engines_present() if name in LAUNCHERS):
                for ranks in (1, 2):
                    setting = {
                        "grains": len(bed[1]),
                        "steps": steps,
                        "ranks": ranks,
                        "repeat": repeat,
                    }
                    row = {"kind": "ranks", "method": engine, "setting": setting}
                    if not done(row):
                        yield row | _ranks_run(engine, tiles, bed, setting, work)


def _ranks_run(
    engine: str,
    tiles: tuple[int, int],
    bed: tuple[FloatArray, FloatArray],
    setting: Row,
    work: Path,
) -> Row:
    table = bed_scene(engine, tiles).model_dump(exclude_none=True)
    if setting["ranks"] > 1:
        table["engine"]["launcher"] = (*LAUNCHERS[engine], str(setting["ranks"]))
    before = bare.load_average()
    with TemporaryDirectory(dir=work) as temporary:
        run = bare.bed_run(Scene(**table), *bed, setting["steps"], Path(temporary) / "bed")
    return {
        "cost_s": run.cpu_s,
        "wall_s": run.wall_s,
        "parts_s": bare.timings(run.screen),
        "fullest": bare.most_shared(run.screen),
        "work": setting["grains"] * setting["steps"],
        "work_unit": "grain-steps",
        "load_average": before,
    }


def paper_row(run: Path) -> Row:
    """Figures of a finished run of ``scenes/karrech.toml``: costs, and that nothing grows."""
    folder = RunFolder(run)
    scene = scene_load(run / "scene.toml", folder.manifest()["overrides"])
    outcomes = {outcome.first_cycle: outcome for outcome in folder.outcomes() if outcome.rows}
    rain, last = folder.outcome("preparation"), outcomes[max(outcomes)]
    assert rain is not None
    rows = [row for outcome in outcomes.values() for row in outcome.rows]
    cycles, steps = last.last_cycle - last.first_cycle, scene.steps_per_cycle
    energy = [row["kinetic_translational"] + row["kinetic_rotational"] for row in rows]
    python = sum(value for name, value in last.cost.items() if name not in ("engine", "start_up"))
    figures = {
        "grains, Young's modulus": f"{scene.grain_count:,}, {scene.material.grain.young:.3g} Pa",
        "step; steps a cycle": f"{scene.time_step:.3g} s; {steps:,}",
        "rain of grains to equilibrium": f"{rain.cost['engine']:.0f} CPU s for "
        f"{rain.notes['time_step']:,} steps",
        f"a load cycle, mean of the last {cycles}": f"**{last.cost['engine'] / cycles:.1f} CPU s**",
        "Python beside it": f"{100 * python / last.cost['engine']:.1f} %",
        "kinetic energy at the ends of cycles": ", ".join(f"{1e6 * e:.3g}" for e in energy) + " µJ",
        "settlement at the end": f"{1e6 * rows[-1]['settlement']:.1f} µm",
        "piston's force, rms error over its peak": f"{100 * last.checks['force_error']:.2f} %",
        "greatest overlap over the smallest radius": f"{last.checks['overlap_share']:.2g}",
    }
    setting = {"cycles": rows[-1]["cycle"]}
    cost = last.cost["engine"]
    work = {"work": scene.grain_count * steps * cycles, "work_unit": "grain-steps"}
    row = {"kind": "paper", "method": scene.engine.name, "setting": setting, "cost_s": cost}
    return row | work | {"figures": figures}


KINDS: dict[str, Callable[[Path, Done], Iterator[Row]]] = {
    "speed": speed_rows,
    "adapter": adapter_rows,
    "adapter-paper": adapter_paper_rows,
    "accuracy": accuracy_rows,
    "ranks": ranks_rows,
}


def record_read(path: Path = RECORD) -> list[Row]:
    """Rows of the record; a last line that a killed writer left half is dropped."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    return [json.loads(line) for line in lines if line.endswith("}\n")]


def record_append(kinds: Sequence[str], work: Path, path: Path = RECORD) -> None:
    """Do what the record lacks of ``kinds``, a line as each run ends."""
    work.mkdir(parents=True, exist_ok=True)
    known = record_read(path)
    path.write_text("".join(json.dumps(row) + "\n" for row in known))
    seen = {json.dumps([row["kind"], row["method"], row["setting"]]) for row in known}

    def done(row: Row) -> bool:
        return json.dumps([row["kind"], row["method"], row["setting"]]) in seen

    for kind in kinds:
        for row in KINDS[kind](work, done):
            row_append(row, path)


def row_append(row: Row, path: Path = RECORD) -> None:
    """Add a finished run to the record, with where it comes from."""
    origin = provenance([])
    whole = {"case": "engine-speed", **row, "engine": engine_named(row["method"]).version()}
    whole |= {"ok": True, "why": "", "commit": origin["commit"], "machine": origin["machine"]}
    whole["ended"] = datetime.now(UTC).isoformat(timespec="seconds")
    with path.open("a") as stream:
        stream.write(json.dumps(whole) + "\n")
    print(json.dumps(row), flush=True)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and time the engines."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, help="folder for samples and runs")
    parser.add_argument("--paper", type=Path, metavar="RUN", help="record this run's figures")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--fresh", action="store_true", help="forget the recorded runs of these")
    arguments = parser.parse_args(words)
    if arguments.fresh:
        kept = [row for row in record_read() if row["kind"] not in arguments.only]
        RECORD.write_text("".join(json.dumps(row) + "\n" for row in kept))
    if arguments.paper is not None:
        row_append(paper_row(arguments.paper))
    if arguments.work is not None:
        record_append(arguments.only, arguments.work)


if __name__ == "__main__":
    main()
