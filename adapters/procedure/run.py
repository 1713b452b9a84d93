"""The settlement procedure of Karrech et al. (2007), Fig. 10, and the runs made of it."""

import json
import os
import shlex
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from adapters.engines import allow_interrupts, find_engine, get_engine, list_real_engines
from adapters.errors import EngineMissing, NotConverged, SceneError, UsageError
from adapters.files import RunFolder, explain_full_disk
from adapters.procedure import stages
from adapters.procedure.controlled import settle_controlled
from adapters.procedure.fixed import settle_fixed
from adapters.procedure.progress import Progress, describe_plan, warn_without_jumps
from adapters.procedure.record import MEMBERS, read_members, refuse_other_member
from adapters.procedure.stages import Bed, Clock, Run, Variant
from adapters.scene import (
    INPUT_FILES,
    Scene,
    bound_friction,
    copy_inputs,
    count_layers,
    draw_start,
    list_stages,
    load_scene,
    record_scene,
    warn_of_bed,
)
from trackbed.memory import refuse_more_memory
from trackbed.run_files import list_differences, record_provenance, refuse_writing, write_whole

OWN_FILES = ("lock", *INPUT_FILES, "dry_run")
"""What may be in a run folder before its manifest is written."""
STATE_BYTES = 500
"""Memory that a grain takes at each cycle end of a window, contacts and wall forces too [bytes]."""
CONTROL = Variant("control", jumps=False)
MEMBER_STEP = 1e-10
"""By which the first grain of member m is moved along x after k_i cycles, m times [m]: far below
what anyone measures of a grain of millimetres, far above the round-off of its place."""


def settle(run: Run) -> Bed:
    """The flow chart, Fig. 10: rain, k_i cycles, then k cycles and a jump of h until the end."""
    bed = stages.prepare(run)
    (_, run.scene), *later = list_stages(run.scene)
    p = run.procedure
    bed = stages.compute(run, bed, p.k_i)
    bed = replace(bed, start=replace(bed.start, perturbation=run.variant.perturbation))
    if p.tolerance is not None and run.variant.jumps:
        return settle_controlled(run, bed)
    bed = settle_fixed(run, bed)
    for begin, scene in later:
        run.first_cycle, run.scene = begin, scene
        bed = settle_fixed(run, bed)
    return bed


def run_scene(
    scene_path: Path, run_path: Path, *, control: bool = False, overrides: Sequence[str] = (),
    dry_run: bool = False, cycle_by_cycle: bool = False, progress: Progress | None = None,
) -> None:  # fmt: skip
    """Run a scene in the folder ``run_path``; with ``control``, every cycle beside it too.

    Members beside the first, where ``procedure.members`` asks for more, run in ``members/`` inside.

    A folder that holds the same scene is resumed; one that holds another is refused with the
    differences.  ``dry_run`` writes the first decks and prints the engine's command line.
    ``cycle_by_cycle``: where a controlled run may not jump, compute instead of `JumpRefused`.
    """
    scene = load_scene(scene_path, overrides)
    progress = progress or Progress()
    if scene.engine.name == "auto":  # from here on, and in the manifest, by its name
        try:
            name = find_engine().name
        except EngineMissing:
            if not dry_run:
                raise
            name = list_real_engines()[0]  # decks can be looked at without it
        overrides = [*overrides, f'engine.name="{name}"']
        scene = load_scene(scene_path, overrides)
        progress.print_line(f"engine: {scene.engine.name}")
    refuse_large(scene)
    if control:
        refuse_unloaded(scene, scene_path)
    for warning in (*scene.warnings, *warn_of_bed(scene), *warn_without_jumps(scene)):
        progress.print_line(f"warning: {warning}")
    if dry_run:
        _write_dry_run(scene, run_path)
        return
    folder = RunFolder(run_path)
    with allow_interrupts(), explain_full_disk(run_path), folder.lock():
        members = scene.procedure.members if scene.procedure else 1
        prepare_manifest(folder, scene, scene_path, overrides, control, members)
        _run_all(folder, scene, cycle_by_cycle, progress)


def resume(
    run_path: Path, *, cycles: int | None = None, cycle_by_cycle: bool = False,
    progress: Progress | None = None,
) -> None:  # fmt: skip
    """Go on with the run in ``run_path`` from its last whole stage, to more ``cycles`` in all if
    given; see `run_scene`."""
    folder = RunFolder(run_path)
    manifest = folder.manifest()
    scene = load_scene(run_path / "scene.toml", manifest["overrides"])
    with allow_interrupts(), explain_full_disk(run_path), folder.lock():
        refuse_differences(manifest["scene"], record_scene(scene), run_path)
        if cycles is not None and (
            scene.procedure is None or cycles != scene.procedure.total_cycles
        ):
            scene = extend(folder, manifest, scene, cycles)
        folder.add_event("resumed")
        _run_all(folder, scene, cycle_by_cycle, progress or Progress())


def extend(folder: RunFolder, manifest: dict[str, Any], scene: Scene, cycles: int) -> Scene:
    """The scene of a run to more ``cycles`` in all, which its manifest then holds.

    The stages are those of a run that was asked for so many from the start; what its last ones
    computed because the end was near goes to discarded/.  The first cycles and the lengths of jumps
    stay.
    """
    if number := read_members(folder)[0]:
        raise UsageError(
            f"this is member {number} of another run, and as long as that", where=str(folder.path),
            remedy="extend the run around it: trackbed resume RUN --cycles N",
        )  # fmt: skip
    p = scene.procedure
    staged = len(list_stages(scene)) > 1
    if p is None or cycles < p.total_cycles or staged:
        have = f"this run is of {p.total_cycles} cycles" if p else "this run has no load cycles"
        why = "has stages of given lengths" if staged else f"can not be shortened to {cycles}"
        raise UsageError(
            f"{have}, and {why}" if p else have,
            where=str(folder.path), remedy="give more cycles, or another folder",
        )  # fmt: skip
    more = [f"procedure.total_cycles={cycles}", f"procedure.k_i={p.k_i}"]
    if p.h is not None:
        more.append(f"procedure.h={list(p.h)}")
    overrides = [*manifest["overrides"], *more]
    longer = load_scene(folder.path / "scene.toml", overrides)
    record = {"scene": record_scene(longer), "overrides": overrides}
    write_whole(folder.path / "manifest.json", json.dumps(manifest | record, indent=1) + "\n")
    folder.add_event("extended", cycles=[p.total_cycles, cycles])
    return longer


def refuse_unloaded(scene: Scene, path: Path) -> None:
    """Raise `SceneError` for a scene at ``path`` that has no load cycles to settle in."""
    if scene.loading is None or scene.procedure is None:
        raise SceneError(
            "this scene has no load cycles, so there is no settlement to ask for",
            where=str(path), remedy="add the tables [loading] and [procedure]",
        )  # fmt: skip


def refuse_large(scene: Scene) -> None:
    """Raise `OutOfMemory` where the states of one window would not fit into memory."""
    p = scene.procedure
    cycles = max(p.k_i, p.window_cycles) if p else 0
    grains = scene.grain_count
    refuse_more_memory(
        STATE_BYTES * grains * (1 + cycles), f"{grains} grains over a window of {cycles} cycles",
        "sample and procedure", "fewer grains, or shorter windows (procedure.k_i, procedure.k)",
    )  # fmt: skip


def _run_all(folder: RunFolder, scene: Scene, cycle_by_cycle: bool, progress: Progress) -> None:
    """All members, then the full runs beside them: the answer comes before its error."""
    with note_stop(folder):
        number, members = read_members(folder)
        asked = folder.keep_cycle_by_cycle(cycle_by_cycle)
        for kind in (Variant(), CONTROL)[: 1 + bool(folder.manifest()["control"])]:
            own = replace(kind, perturbation=number * MEMBER_STEP)
            run_variant(folder, scene, own, progress, asked)
            for other in range(1, members):
                progress.print_line(f"member {other} of {members - 1} beside the first")
                moved = replace(kind, perturbation=other * MEMBER_STEP)
                with open_member(folder, scene, other) as inner:
                    run_variant(inner, scene, moved, progress, inner.keep_cycle_by_cycle(asked))
        path = shlex.quote(str(folder.path))
        progress.print_line(f"the run is finished: trackbed report {path}")


@contextmanager
def note_stop(folder: RunFolder) -> Iterator[None]:
    """Keep among the events of a run why it stopped."""
    try:
        yield
    except BaseException as error:
        with explain_full_disk(folder.path):
            folder.add_event("stopped", why=str(error) or type(error).__name__)
        raise


@contextmanager
def open_member(folder: RunFolder, scene: Scene, number: int) -> Iterator[RunFolder]:
    """The folder of a member of the run in ``folder``, its lock held: an ordinary run, which has
    the first k_i cycles of that run and then a grain moved.

    Its manifest is that of the run around it, which may have been extended since, with its number.
    Raises `SceneError` for a folder that is no such member, and `UsageError` for no run.
    """
    whole, inner = folder.manifest(), RunFolder(folder.path / MEMBERS / str(number))
    manifest = inner.path / "manifest.json"
    with inner.lock():
        if manifest.exists():
            refuse_other_member(whole, inner, number)
        else:
            refuse_strangers(inner)
            for name in {*INPUT_FILES} & {*os.listdir(folder.path)}:
                shutil.copyfile(folder.path / name, inner.path / name)
        own = whole | {"members": 1, "member": number}
        write_whole(manifest, json.dumps(own, indent=1) + "\n")
        with note_stop(inner):
            first = list_stages(scene)[0][1].procedure
            assert first is not None
            inner.share_start(folder, first.k_i)
            yield inner


def run_variant(
    folder: RunFolder, scene: Scene, variant: Variant, progress: Progress,
    cycle_by_cycle: bool = False,
) -> RunFolder:  # fmt: skip
    """Run one variant of a scene: the procedure in ``folder`` itself, others in a folder inside.

    The control shares the stages before the first jump: the same work would give the same bits.
    """
    engine = get_engine(scene.engine.name)
    folder.add_event("engine", name=engine.name, version=engine.version(), variant=variant.name)
    if variant.name == "procedure":
        here = folder
    else:
        here = folder.enter(variant.name)
        here.share_start(folder, count_shared_cycles(folder, scene))
        progress.print_line(variant.name.replace("_", " "))
    if scene.engine.launcher:
        words = shlex.join(engine.command(scene, "in.prepare"))
        progress.print_line(f"the scene's launcher is started, as in: {words}")
    run = Run(scene, here, engine, variant, progress, cycle_by_cycle)
    if variant == Variant():
        run.clock = Clock(0.0)  # it bears the start-up of Python; the others come in its wake
    progress.start()
    try:
        (settle if scene.procedure and scene.loading else stages.prepare)(run)
    except NotConverged as error:
        if count_layers(scene) >= 1:
            raise
        remedy = "more grains: these make less than one layer, and roll on whatever damps them"
        raise NotConverged(error.what, where=error.where, remedy=remedy) from error
    here.write_settlement()  # a run killed after its last stage may miss a row
    return here


def count_shared_cycles(folder: RunFolder, scene: Scene) -> int:
    """Cycles up to which the control's stages are those of the procedure in ``folder``.

    The first window, and where jumps waited for the piston all windows before the first jump.
    """
    p = list_stages(scene)[0][1].procedure
    assert p is not None
    first = p.k_i + p.window_cycles
    if p.seating == "any":
        return first
    jumps = (one.first_cycle for one in folder.outcomes() if one.stage == "jump")
    return max(first, next(jumps, p.total_cycles))


def prepare_manifest(
    folder: RunFolder, scene: Scene, scene_path: Path, overrides: Sequence[str], control: bool,
    members: int,
) -> None:  # fmt: skip
    """Write the manifest of a new run, or refuse a folder that holds another scene's run.

    A run that is there goes on with a ``control``, and ``members``, if it is asked for more.
    """
    path = folder.path / "manifest.json"
    if path.exists():
        manifest = folder.manifest()
        refuse_differences(manifest["scene"], record_scene(scene), folder.path)
        number, most = read_members(folder)
        if number:
            raise UsageError(
                f"this is member {number} of another run", where=str(folder.path),
                remedy="trackbed resume goes on with it; members are those of the run around it",
            )  # fmt: skip
        more = {"control": manifest["control"] or control, "members": max(most, members)}
        if not more.items() <= manifest.items():
            write_whole(path, json.dumps(manifest | more, indent=1) + "\n")
        folder.add_event("resumed")
        return
    refuse_strangers(folder)
    kept = [*overrides, *copy_inputs(scene, scene_path, folder.path)]
    manifest = {
        "scene": record_scene(scene), "overrides": kept, "control": control, "members": members,
        "provenance": record_provenance(sys.argv),
    }  # fmt: skip
    write_whole(path, json.dumps(manifest, indent=1) + "\n")
    folder.add_event("started")


def refuse_strangers(folder: RunFolder) -> None:
    """Raise `UsageError` for a folder without a manifest that holds other people's files."""
    strangers = [p.name for p in folder.path.iterdir() if p.name not in OWN_FILES]
    if strangers:
        raise UsageError(
            f"the folder holds something else ({', '.join(sorted(strangers)[:3])}), no manifest",
            where=str(folder.path),
            remedy="give an empty or new folder: --run-folder FOLDER",
        )


def refuse_differences(old: dict[str, Any], new: dict[str, Any], path: Path) -> None:
    """Raise `SceneError` with every parameter that differs from the run's manifest."""
    if lines := list(list_differences("", old, new)):
        longer = all(line.startswith(("procedure.total_cycles:", "procedure.h:")) for line in lines)
        extend_it = f"trackbed resume {shlex.quote(str(path))} --cycles N computes more cycles; or "
        raise SceneError(
            "the scene differs from the one this run was started with:\n  " + "\n  ".join(lines),
            where=str(path),
            remedy=extend_it * longer
            + "take the parameters back, or start a new run: --run-folder FOLDER",
        )


def _write_dry_run(scene: Scene, run_path: Path) -> None:
    """Write the decks of the rain of grains and print the command that runs them."""
    engine = get_engine(scene.engine.name)
    folder = run_path / "dry_run"
    with refuse_writing(run_path):
        folder.mkdir(parents=True, exist_ok=True)
    position, radius, height = draw_start(scene)
    engine.write_preparation(bound_friction(scene), position, radius, height, folder)
    for sentence in describe_plan(scene, height):
        print(f"# {sentence}")
    print(f"cd {shlex.quote(str(folder))}")
    print(shlex.join(engine.command(scene, "in.prepare")))
