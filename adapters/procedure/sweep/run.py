"""Running a sweep: what is finished is left alone, the rest goes to a Dask cluster."""

import json
from collections.abc import Sequence
from concurrent.futures import Executor, Future, as_completed, wait
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

from adapters.engines import allow_interrupts, find_engine
from adapters.errors import Interrupted, UsageError
from adapters.files import RunFolder, explain_full_disk
from adapters.procedure import Progress, read_status
from adapters.procedure.sweep.cluster import Cluster, open_executor
from adapters.procedure.sweep.member import COMMAND, STOPPED, Ended, run_member
from adapters.procedure.sweep.plan import Member, Sweep, check_folder, find_pinned_engine
from trackbed.run_files import MANIFEST, RESULT, hold_signals, read_object, write_whole

STOP_S = 30
"""How long members may take to stop when the sweep is interrupted [s]."""


@dataclass(frozen=True)
class Result:
    """How far a member is; SI units, None for what is not known."""

    member: str
    seed: int
    state: str  # ``finished``, ``failed``, ``stopped`` or ``waiting``
    exit_code: int | None  # that of its verb; minus the signal when one ended it
    sentence: str  # what it said of its error; of another story, what it came to
    cycle: int  # load cycles done; 0 of another story, whose runs write what they came to
    cycles_computed: int
    loaded_body_m: float | None  # permanent settlement of the loaded body
    stiffness_n_per_m: float | None
    mean_grain_m: float | None
    speed_up: float | None  # CPU time of the full run beside it over its own; None without one
    cpu_s: float  # CPU time of its finished stages [s]
    run_folder: str


def find_result(sweep: Sweep, member: Member, ended: Ended | None) -> Result:
    """How far a member is, from its run folder and how its command ended, if it ran."""
    folder = sweep.run_folder(member)
    here, summary = None, read_summary(sweep, member)
    done = bool(summary)
    if sweep.settles:
        with suppress(UsageError):  # no run folder yet
            here = read_status(folder)
            done = here.state == "finished"
    state, exit_code, sentence = "waiting", None, ""
    if ended is not None:
        exit_code, sentence = ended.exit_code, ended.sentence
        if exit_code == 0 and not done:
            sentence = f"its files show no finished run: remove {folder}"
        state = "stopped" if ended == STOPPED else "failed"
    if done and not exit_code:
        state, exit_code, sentence = "finished", 0, str(summary.get("sentence", ""))
    return Result(
        member=member.name, seed=member.seed, state=state, exit_code=exit_code, sentence=sentence,
        cycle=here.cycle if here else 0, cycles_computed=here.cycles_computed if here else 0,
        **{name: getattr(here, name, None)
           for name in ("loaded_body_m", "stiffness_n_per_m", "mean_grain_m")},
        speed_up=here.speed_up_so_far if here else None, cpu_s=here.cpu_s if here else 0.0,
        run_folder=str(folder.relative_to(sweep.folder)),
    )  # fmt: skip


def read_summary(sweep: Sweep, member: Member) -> dict[str, Any]:
    """What a finished run of another story came to, by name; empty for any other run."""
    folder = sweep.run_folder(member)
    if sweep.settles or not (folder / MANIFEST).exists():
        return {}
    found = read_object(folder / RESULT) or {}
    numbers = [value for key, value in found.items() if key.endswith(("_m", "_mgt"))]
    return found if all(isinstance(one, (int, float, type(None))) for one in numbers) else {}


def run_sweep(sweep: Sweep, cluster: Cluster, progress: Progress) -> list[Result]:
    """Run every member that is not finished; how far each is afterwards, in the sweep's order.

    A member that fails is named at once and holds no other up.  Raises `Interrupted` on SIGTERM
    and Ctrl-C, when all members are stopped.
    """
    check_folder(sweep)
    try:
        with allow_interrupts(), explain_full_disk(sweep.folder), RunFolder(sweep.folder).lock():
            results = {one.name: find_result(sweep, one, None) for one in sweep.members}
            _write_record(sweep, cluster, results)
            pending = [one for one in sweep.members if results[one.name].state != "finished"]
            done = len(results) - len(pending)
            progress.print_line(f"{len(results)} members, {done} finished")
            sweep.stop_file.unlink(missing_ok=True)
            if pending:
                _run(sweep, cluster, pending, results, progress)
            return list(results.values())
    except Interrupted as stop:
        what = str(stop).partition("\n")[0]
        raise Interrupted(f"{what}\n  -> the same command goes on with the sweep") from None


def _run(
    sweep: Sweep, cluster: Cluster, pending: Sequence[Member], results: dict[str, Result],
    progress: Progress,
) -> None:  # fmt: skip
    """Hand the members to the cluster, and take the results in as they come."""
    with open_executor(cluster, len(pending)) as executor:
        engine = choose_engine(sweep, pending, executor, progress)
        futures = {
            executor.submit(
                run_member, sweep.list_words(member, engine), sweep.log(member).absolute(),
                sweep.stop_file.absolute(),
            ): member
            for member in pending
        }  # fmt: skip

        def take_result(future: Future[Ended]) -> None:
            member = futures[future]
            result = find_result(sweep, member, _find_end(future))
            results[member.name] = result
            _write_record(sweep, cluster, results)
            done = sum(one.state in ("finished", "failed") for one in results.values())
            if result.state != "stopped":
                progress.print_line(f"{done} of {len(results)}: {sum_up_result(result)}")

        taken = set()
        try:
            for future in as_completed(futures):
                with hold_signals():
                    take_result(future)
                    taken.add(future)
        except (KeyboardInterrupt, Exception):
            sweep.stop_file.touch()
            wait([*futures], timeout=STOP_S)
            for future in futures.keys() - taken:
                take_result(future)
            raise


def choose_engine(
    sweep: Sweep, pending: Sequence[Member], executor: Executor, progress: Progress
) -> list[str]:
    """The override that gives every member the same engine, where the scene says ``auto``.

    Asked of a worker: an engine that is here may not be there.  Raises `EngineMissing`.
    """
    if not sweep.settles or all(one.scene.engine.name != "auto" for one in pending):
        return []
    name = find_pinned_engine(sweep)
    if name is None:
        name, version = executor.submit(find_worker_engine).result()
        progress.print_line(f"engine: {name} ({version})")
    return [f'engine.name="{name}"']


def find_worker_engine() -> tuple[str, str]:
    """Name and version of the engine that a worker has; raises `EngineMissing`."""
    engine = find_engine()
    return engine.name, engine.version()


def _find_end(future: Future[Ended]) -> Ended:
    """How a member ended; one whose workers died again and again failed as its engine does."""
    if not future.done():
        return STOPPED
    try:
        return future.result()
    except Exception as error:
        return Ended(5, f"its worker failed: {error or type(error).__name__}")


def sum_up_result(result: Result) -> str:
    """A member's end in one line."""
    if result.state == "finished" and result.loaded_body_m is not None:
        return f"{result.member}: the loaded body settles {1e3 * result.loaded_body_m:.4g} mm"
    first = result.sentence.partition("\n")[0]
    how = f" {result.state}, exit code {result.exit_code}" * (result.state != "finished")
    return f"{result.member}{how}: {first}"


def _write_record(sweep: Sweep, cluster: Cluster, results: dict[str, Result]) -> None:
    """Write ``sweep.json``: how far every member is."""
    content = make_sweep_record(sweep, cluster, list(results.values()))
    write_whole(sweep.folder / "sweep.json", json.dumps(content, indent=1) + "\n")


def make_sweep_record(sweep: Sweep, cluster: Cluster, results: Sequence[Result]) -> dict[str, Any]:
    """A sweep as ``sweep.json`` keeps it."""
    settings = {member.name: dict(member.settings) for member in sweep.members}
    states = [result.state for result in results]
    return {
        "scene": str(sweep.scene_path),
        "scheduler": cluster.scheduler,
        "counts": {state: states.count(state) for state in sorted(set(states))},
        "members": [
            {"member": result.member, "settings": settings[result.member], **asdict(result)}
            for result in results
        ],
    }


def list_dry_run(sweep: Sweep) -> list[str]:
    """The command line of every member, and whether it is finished."""
    import shlex

    lines = []
    for member in sweep.members:
        words = [*COMMAND, *sweep.list_words(member)]
        state = find_result(sweep, member, None).state
        lines.append(f"# {member.name}: {state}\n{shlex.join(words)}")
    return lines
