"""Run the coarse bed on LIGGGHTS by tolerance, by fixed jumps and every cycle, and keep what came.

    python -m validation.jump_runs --work FOLDER [--only full|tolerance ...] [--seeds N]

Goes on where the record and FOLDER end; what is in the record is not run again.  The scene is that
of the kind `coarse` of the reference ensemble, with fewer cycles.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adapters.errors import JumpRefused
from adapters.jump_record import CHECK, DECISION
from adapters.procedure import CONTROL, run_variant
from adapters.progress import Progress
from adapters.provenance import commit, machine
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.stages import Variant
from scenes import scene_path
from validation.settlement_ensemble import COARSE

RESULTS = Path(__file__).with_name("results")


@dataclass(frozen=True)
class Way:
    """A way to the last cycle."""

    name: str
    settings: tuple[str, ...]
    variant: Variant = field(default_factory=Variant)


@dataclass(frozen=True)
class Study:
    """Ways to the last cycle of a scene, run on some seeds, the full run first."""

    scene_name: str
    settings: tuple[str, ...]
    k_i: int
    shared: int
    """Cycle up to which every way does what the full run does."""
    last: int
    seeds: int
    ways: tuple[Way, ...]
    record: Path
    facts: Callable[[RunFolder, RunFolder], dict[str, Any]] | None = None
    """What else is kept of a run, from its folder and that of the full run."""

    def scene(self, way: Way, seed: int) -> Scene:
        """The bed of a seed, run in that way."""
        own = (f"sample.seed={seed}", 'engine.name="liggghts"', f"procedure.k_i={self.k_i}")
        total = (f"procedure.total_cycles={self.last}",)
        return scene_load(
            scene_path(self.scene_name), [*self.settings, *own, *total, *way.settings]
        )


STUDY = Study(
    scene_name=COARSE.scene_name,
    settings=COARSE.settings,
    k_i=50,
    shared=70,
    last=300,
    seeds=10,
    ways=(
        Way("full", ("procedure.tolerance=0.1",), CONTROL),
        Way("tolerance 0.1", ("procedure.tolerance=0.1",)),
        Way("fixed h 20", ("procedure.k=20", "procedure.h=20")),
        Way("tolerance 0.05", ("procedure.tolerance=0.05",)),
    ),
    record=RESULTS / "jump-control-liggghts.jsonl",
)


def record_read(path: Path = STUDY.record) -> list[dict[str, Any]]:
    """All runs of the record."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def folder_of(way: Way, seed: int, work: Path) -> RunFolder:
    """Where the run of a seed, in that way, is made in ``work``."""
    return RunFolder(work / f"{way.name.replace(' ', '-')}-{seed}")


def run(study: Study, way: Way, seed: int, work: Path) -> dict[str, Any]:
    """One run to its end, in a folder of its own; the stages before the first jump are shared."""
    full = RunFolder(work / f"full-{seed}")
    home = folder_of(way, seed, work)
    home.path.mkdir(parents=True, exist_ok=True)
    refused = ""
    with home.locked():
        if way.variant != CONTROL:
            home.share_start(RunFolder(full.path / CONTROL.name), study.shared)
        try:
            here = run_variant(home, study.scene(way, seed), way.variant, Progress(), True)
        except JumpRefused as error:
            here, refused = home, str(error)
    costs = [outcome.cost for outcome in here.outcomes() if outcome.stage != "preparation"]
    lost: list[dict[str, Any]] = [
        {"lost_s": 0.0, "lost_cycles": 0, "why": here.failure(name)} | here.failure_details(name)
        for name in here.stage_names()
        if here.failure(name)
    ]
    return {
        "way": way.name,
        "seed": seed,
        "refused": refused,
        "computed": sum(
            o.last_cycle - o.first_cycle for o in here.outcomes() if o.stage == "window"
        ),
        "lost": lost,
        "engine_s": sum(cost["engine"] for cost in costs),
        "rows": [
            [row["cycle"], row["kind"][0], *(_short(row.get(name)) for name in COLUMNS)]
            for outcome in here.outcomes()
            for row in outcome.rows
        ],
        "decisions": [_last(event) for event in here.events() if event["event"] == DECISION],
        "checks": [_last(event) for event in here.events() if event["event"] == CHECK],
        **({} if study.facts is None else study.facts(here, RunFolder(full.path / CONTROL.name))),
        "engine": next(e["version"] for e in home.events() if e["event"] == "engine"),
        "commit": commit(),
        "machine": machine(),
    }


COLUMNS = ("settlement", "coordination_number", "elastic_deflection")
"""Columns of a run's table that are kept, behind cycle and the first letter of its kind."""


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.7g}")


def _last(event: dict[str, Any]) -> dict[str, Any]:
    """An event without its time and name, numbers to six digits."""

    def short(value: Any) -> Any:
        if isinstance(value, list):
            return [short(inner) for inner in value]
        return float(f"{value:.6g}") if isinstance(value, float) else value

    return {key: short(value) for key, value in event.items() if key not in ("time", "event")}


def go_on(study: Study, words: Sequence[str] | None = None) -> None:
    """Read the command line and run what the record lacks."""
    parser = argparse.ArgumentParser(description="Goes on where the record ends.")
    parser.add_argument("--work", type=Path, required=True, help="folder for the engine's files")
    parser.add_argument("--only", nargs="+", choices=[way.name for way in study.ways])
    parser.add_argument("--seeds", type=int, default=study.seeds)
    parser.add_argument("--record", type=Path, default=study.record)
    arguments = parser.parse_args(words)
    for way in study.ways:
        for seed in range(1, arguments.seeds + 1):
            done = {(one["way"], one["seed"]) for one in record_read(arguments.record)}
            if (arguments.only and way.name not in arguments.only) or (way.name, seed) in done:
                continue
            made = run(study, way, seed, arguments.work)
            with arguments.record.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(made, separators=(",", ":")) + "\n")
            print(
                f"{way.name}, seed {seed}: {made['computed']} cycles, {made['engine_s']:.0f} CPU s"
            )


if __name__ == "__main__":
    go_on(STUDY)
