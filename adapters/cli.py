"""The verbs of ``trackbed`` about settlement; what a verb computes with is loaded when it runs."""

from __future__ import annotations

import argparse
import json
import os
import shlex
from pathlib import Path
from typing import Any

from adapters.errors import EngineMissing, UsageError

JUMP_KEYS = ("procedure.k", "procedure.h")
"""Keys that ``--tolerance`` stands for."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``verb`` to its parser."""
    {
        "doctor": register_doctor,
        "new": register_new,
        "run": register_run,
        "resume": register_resume,
        "status": register_status,
        "report": register_report,
        "fit": register_fit,
        "relax": register_relax,
        "cite": register_cite,
    }[verb](parser)


def add_json_flag(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``."""
    parser.add_argument("--json", action="store_true", help="print JSON on standard output")


def print_json(content: Any) -> None:
    """Print JSON on standard output; a number that is not finite becomes an error."""
    print(json.dumps(content, indent=2, allow_nan=False))


# --- doctor --------------------------------------------------------------------------------


def register_doctor(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``doctor``."""
    add_json_flag(parser)
    parser.set_defaults(command=run_doctor)


def run_doctor(arguments: argparse.Namespace) -> int:
    """Print what is here and what is missing; `EngineMissing` when no engine is here."""
    from dataclasses import asdict

    from adapters.engines import ENGINE_REMEDY, findings, has_usable_engine

    found = findings()
    if arguments.json:
        print_json({"ok": has_usable_engine(found), "findings": [asdict(one) for one in found]})
    else:
        for one in found:
            version = one.version or ("missing" if one.remedy else "yes")
            print(f"{one.kind:9}{one.name:16}{version:28}  {one.where}".rstrip())
            if one.remedy:
                print(f"{'':9}-> {one.remedy}")
    if not has_usable_engine(found):
        raise EngineMissing("no engine is installed, so nothing can be run", remedy=ENGINE_REMEDY)
    return 0


# --- new -----------------------------------------------------------------------------------


def register_new(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``new``."""
    from trackbed.scenes import scene_names

    parser.add_argument("name", metavar="NAME", help="; ".join(scene_names()))
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="made when it is not there")
    parser.set_defaults(command=run_new)


def run_new(arguments: argparse.Namespace) -> int:
    """Copy a shipped scene to FOLDER/scene.toml; a scene that is there already is kept."""
    from trackbed.scene_files import suggest_word
    from trackbed.scenes import scene_names, scene_template, scene_verb

    names = scene_names()
    if arguments.name not in names:
        raise UsageError(f"there is no scene {arguments.name}{suggest_word(arguments.name, names)}")
    path: Path = arguments.folder / "scene.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(scene_template(arguments.name))
    except FileExistsError:
        raise UsageError(
            "this scene is there already and is kept", where=str(path),
            remedy="remove it first, or name another folder",
        ) from None  # fmt: skip
    verb = scene_verb(arguments.name)
    control = " --control" if verb == "run" else ""
    print(f"{path}\nnext: trackbed {verb} {shlex.quote(str(path))}{control}")
    return 0


# --- run, resume, status, report -----------------------------------------------------------


def add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """Add SCENE, ``--engine`` and ``--launcher``."""
    parser.add_argument("scene", metavar="SCENE", type=Path, help="a scene file (TOML)")
    parser.add_argument(
        "--engine", metavar="NAME",
        help="liggghts, lammps, yade or auto; short for --set engine.name=NAME",
    )  # fmt: skip
    parser.add_argument(
        "--launcher", metavar="WORDS", help='before the engine\'s command, as in "mpirun -np 2"'
    )


def register_run(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``run``."""
    add_scene_arguments(parser)
    parser.add_argument(
        "--run-folder", type=Path, metavar="FOLDER", help="default: run/ beside the scene"
    )
    parser.add_argument(
        "--control", action="store_true", help="also run every cycle, to know the error"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help="change a key of the scene, such as procedure.h=10; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=float, metavar="T",
        help="jumps choose themselves: error of the settlement gained in a jump over the total "
        "settlement, such as 0.02; short for --set procedure.tolerance=T, instead of k and h",
    )  # fmt: skip
    parser.add_argument(
        "--cycles", type=int, metavar="N", help="short for --set procedure.total_cycles=N"
    )
    add_cycle_by_cycle_flag(parser)
    parser.add_argument(
        "--dry-run", action="store_true", help="write the decks and print the engine's command"
    )
    parser.set_defaults(command=run_command)


def add_cycle_by_cycle_flag(parser: argparse.ArgumentParser) -> None:
    """Add ``--cycle-by-cycle``."""
    parser.add_argument(
        "--cycle-by-cycle", action="store_true",
        help="where the bed ratchets or collapses, so that no jump is allowed, or a jump and its "
        "shorter tries failed, compute cycles instead of stopping with exit code 6",
    )  # fmt: skip


def list_jump_overrides(arguments: argparse.Namespace) -> list[str]:
    """KEY=VALUE of ``--tolerance`` and ``--cycles``; `UsageError` beside a k or h by hand."""
    overrides = []
    if arguments.tolerance is not None:
        by_hand = [one for one in arguments.overrides if one.split("=")[0].strip() in JUMP_KEYS]
        if by_hand:
            raise UsageError(
                f"--tolerance chooses k and h, and --set {by_hand[0]} gives one by hand",
                remedy="leave one of the two out",
            )
        overrides.append(f"procedure.tolerance={arguments.tolerance!r}")
    if arguments.cycles is not None:
        overrides.append(f"procedure.total_cycles={arguments.cycles}")
    return overrides


def list_overrides(arguments: argparse.Namespace) -> list[str]:
    """KEY=VALUE of ``--set``, ``--engine`` and ``--launcher``; the values are TOML."""
    overrides = list(arguments.overrides)
    if arguments.engine is not None:
        overrides.append(f"engine.name={json.dumps(arguments.engine)}")
    if arguments.launcher is not None:
        try:
            words = shlex.split(arguments.launcher)
        except ValueError as error:
            raise UsageError(f"--launcher can not be split into words: {error}") from None
        overrides.append(f"engine.launcher={json.dumps(words)}")
    return overrides


def run_command(arguments: argparse.Namespace) -> int:
    """Run a scene from its start."""
    from adapters.procedure import run as procedure

    procedure.run_scene(
        arguments.scene,
        arguments.run_folder or arguments.scene.parent / "run",
        control=arguments.control,
        overrides=list_overrides(arguments) + list_jump_overrides(arguments),
        dry_run=arguments.dry_run,
        cycle_by_cycle=arguments.cycle_by_cycle,
    )
    return 0


def add_run_argument(parser: argparse.ArgumentParser) -> None:
    """Add the argument RUN."""
    parser.add_argument("run_folder", metavar="RUN", type=Path, help="a run folder")


def register_resume(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``resume``."""
    add_run_argument(parser)
    add_cycle_by_cycle_flag(parser)
    parser.set_defaults(command=run_resume)


def run_resume(arguments: argparse.Namespace) -> int:
    """Go on with a run from its last window that passes the checks."""
    from adapters.procedure import run as procedure

    procedure.resume(arguments.run_folder, cycle_by_cycle=arguments.cycle_by_cycle)
    return 0


def register_status(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``status``."""
    add_run_argument(parser)
    add_json_flag(parser)
    parser.set_defaults(command=run_status)


def run_status(arguments: argparse.Namespace) -> int:
    """Print how far a run is."""
    from adapters.procedure import status

    content = status(arguments.run_folder).to_dict()
    if arguments.json:
        print_json(content)
    else:
        for key, value in content.items():
            print(f"{key.replace('_', ' '):28}{value}")
    return 0


def register_report(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``report``."""
    add_run_argument(parser)
    parser.add_argument("--open", action="store_true", help="show it, when there is a display")
    parser.set_defaults(command=run_report)


def run_report(arguments: argparse.Namespace) -> int:
    """Write report.html and the figures; print the path."""
    from adapters.report import write_report

    path = write_report(arguments.run_folder)
    print(path)
    if arguments.open and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        import webbrowser

        webbrowser.open(path.resolve().as_uri())
    return 0


# --- fit, relax ----------------------------------------------------------------------------


def register_fit(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``fit``."""
    parser.add_argument(
        "paths", nargs="+", metavar="RUN|DUMP...|CSV", type=Path,
        help="a run folder, dumps with a frame each cycle, or a table (.csv, .tsv, .txt, .dat) of "
        "cycle,settlement (m), also settlement [mm], strain [%%]; decimal commas beside ; or tabs; "
        "two columns of numbers need no header, and their unit is then unknown (see --unit)",
    )  # fmt: skip
    parser.add_argument(
        "--columns", nargs=2, metavar=("CYCLE", "SETTLEMENT"), default=(),
        help="a table's columns, where they are called otherwise",
    )  # fmt: skip
    parser.add_argument(
        "--unit", metavar="U",
        help="of a table's settlement where no header gives it: m, cm, mm, um, %%, or 1 (strain)",
    )  # fmt: skip
    parser.add_argument(
        "--law", default="log", metavar="NAME",
        help="default: log; auto: the slow laws together, refused (exit code 6) where the series "
        "ratchets or collapses, or half the 90 %% band is wider than all settlement so far",
    )  # fmt: skip
    parser.add_argument(
        "--fail-at", type=float, metavar="S",
        help="settlement or strain of failure, in the series' unit, of either sign: a series or a "
        "prediction that reaches it is refused as collapse (exit code 6); failure_excluded in the "
        "JSON: the band (of --probability) does not reach it",
    )  # fmt: skip
    parser.add_argument(
        "--to-cycle", type=float, metavar="N", help="cycle to predict; default: the last one given"
    )
    parser.add_argument(
        "--from-cycle", type=float, default=0.0, metavar="N", help="leave earlier cycles out"
    )
    parser.add_argument(
        "--load-change", type=float, metavar="N",
        help="the load changed at cycle N: leave the cycles up to it out, and count from there, as "
        "the law starts anew; --to-cycle counts on from the first one",
    )  # fmt: skip
    parser.add_argument(
        "--steps-per-cycle", type=float, metavar="N",
        help="dumps only: time steps of a cycle; default: each frame is the end of one",
    )  # fmt: skip
    parser.add_argument(
        "--probability", type=float, default=0.9, metavar="P",
        help="that the band should hold the truth; default: 0.9; refusals do not depend on it",
    )  # fmt: skip
    parser.add_argument(
        "--confidence", type=float, metavar="C",
        help="also the cycles k that keep the mean error term below --error so surely (eq. 15)",
    )  # fmt: skip
    parser.add_argument("--error", type=float, metavar="E", help="in the unit of the series")
    add_json_flag(parser)
    parser.set_defaults(command=run_fit)


def run_fit(arguments: argparse.Namespace) -> int:
    """Fit a law to a series; print its parameters, a prediction and its band."""
    from adapters.errors import JumpRefused
    from adapters.laws import get_law
    from adapters.laws.fit import AGREE, count_cycles_needed, fit_auto, fit_series, read_series

    if (arguments.confidence is None) != (arguments.error is None):
        raise UsageError("--confidence and --error belong together", remedy="give both or none")
    auto = arguments.law == "auto"
    if auto and arguments.error is not None:
        raise UsageError(
            "--law auto is no single law, so it has no error term of eq. 15",
            remedy="name a law for --error, such as --law log",
        )
    law = get_law("log" if auto else arguments.law)
    series = read_series(
        arguments.paths, arguments.steps_per_cycle, arguments.columns, arguments.unit
    )
    to_cycle = arguments.to_cycle
    if to_cycle is None:
        to_cycle = series.cycle.max(initial=0.0)
    ahead = to_cycle
    if arguments.load_change is not None:
        series, ahead = series.after(arguments.load_change), to_cycle - arguments.load_change
    series = series.since(arguments.from_cycle)
    needed = {}
    if arguments.error is not None:
        cycles = count_cycles_needed(series, law, arguments.error, arguments.confidence)
        needed = {"cycles_needed": cycles}
    try:
        if auto:
            found = fit_auto(series, ahead, arguments.probability, arguments.fail_at)
        else:
            found = fit_series(series, law, ahead, arguments.probability, arguments.fail_at)
    except JumpRefused as refusal:
        if arguments.json:
            unexcluded = {} if arguments.fail_at is None else {"failure_excluded": False}
            print_json(refusal.to_json(series.unit) | unexcluded | needed)
        else:
            print_cycles_needed(needed, arguments, series.unit)
        raise
    fitted = found.to_json() | needed
    if arguments.json:
        print_json(fitted)
        return 0
    unit = name_unit(series.unit)
    print(f"law {fitted['law']}, fitted to {len(series.cycle)} cycles")
    for name, value in fitted["parameters"].items():
        print(f"  {name} = {value:.6g}")
    print(f"regime: {fitted['regime'] or 'not told from so few cycles'}")
    if found.laws:
        agreeing = [name for name, said in found.laws.items() if said.agrees]
        print(f"laws that agree to {AGREE:.0%} of the increment: {', '.join(agreeing) or 'none'}")
    low, high = fitted["band"]
    print(f"settlement at cycle {to_cycle:.10g}: {fitted['prediction']:.6g} {unit}")
    print(f"  with probability {arguments.probability:g} in {low:.6g} ... {high:.6g} {unit}")
    if found.failure_excluded is False:
        print(f"  so that failure at {arguments.fail_at:g} is not excluded")
    print_cycles_needed(needed, arguments, series.unit)
    return 0


def name_unit(unit: str) -> str:
    """The unit of a series, for a text."""
    from adapters.files import UNKNOWN

    return "(unit as given)" if unit == UNKNOWN else unit


def print_cycles_needed(needed: dict[str, int], arguments: argparse.Namespace, unit: str) -> None:
    """Print the bound of eq. 15 where it was asked for; a refused prediction has it too."""
    if needed:
        print(
            f"cycles that keep the mean error term below {arguments.error:g} {name_unit(unit)} "
            f"with confidence {arguments.confidence:g}: {needed['cycles_needed']}"
        )


def register_relax(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``relax``."""
    parser.add_argument("state", metavar="STATE", type=Path, help="a .npz of trackbed or a dump")
    parser.add_argument(
        "--out",
        metavar="STATE",
        type=Path,
        required=True,
        help=".npz, or any other name for a dump",
    )
    parser.add_argument(
        "--scene", type=Path, help="for walls and stiffness; default: that of the run STATE is in"
    )
    parser.add_argument(
        "--before", type=Path, metavar="STATE", help="the state before the jump that made STATE"
    )
    parser.add_argument(
        "--method", default="smallest-move", metavar="NAME",
        help="smallest-move (default) or karrech2007",
    )  # fmt: skip
    add_json_flag(parser)
    parser.set_defaults(command=run_relax)


def find_scene_of_state(state: Path) -> tuple[Path, list[str]]:
    """Scene file and overrides of the run folder that a state lies in."""
    from adapters.files import RunFolder

    for folder in state.resolve().parents:
        if (folder / "manifest.json").exists():
            return folder / "scene.toml", RunFolder(folder).manifest()["overrides"]
    raise UsageError(
        "the walls and the stiffness of the grains are not known",
        where=str(state),
        remedy="name the scene: --scene scene.toml",
    )


def run_relax(arguments: argparse.Namespace) -> int:
    """Relax a state, write it at rest, print what changed."""
    import numpy as np

    from adapters.bed import make_no_contacts
    from adapters.files import read_state_file, write_state_file
    from adapters.relaxation import relax, relax_bare
    from adapters.scene import load_scene

    if not arguments.out.parent.is_dir():
        raise UsageError("the folder of --out does not exist", where=str(arguments.out))
    if arguments.scene is None:
        scene = load_scene(*find_scene_of_state(arguments.state))
    else:
        scene = load_scene(arguments.scene)
    density = scene.material.grain.density
    state = read_state_file(arguments.state, density)
    walls = scene.container.walls(state.piston_height, scene.piston_reach)
    if arguments.before is None:
        load = float(scene.stress_at(0.0)) * scene.loaded_area
        relaxation = relax_bare(state, walls, scene.stiffness, method=arguments.method, load=load)
    else:
        before = read_state_file(arguments.before, density)
        if not np.array_equal(before.identifier, state.identifier):
            raise UsageError("the grains are not those of STATE", where=str(arguments.before))
        relaxation = relax(
            state.position,
            before,
            scene.container.walls(before.piston_height, scene.piston_reach),
            scene.stiffness,
            walls_after=walls,
            method=arguments.method,
        )
    still = np.zeros_like(state.position)
    # Contacts and wall forces belong to the positions before and are left out.
    relaxed = state.moved(
        relaxation.position, velocity=still, spin=still, contacts=make_no_contacts(), wall_force={}
    )
    write_state_file(relaxed, arguments.out)
    record = relaxation.record()
    if arguments.json:
        print_json(record)
        return 0
    print(f"{arguments.out}, at rest; all figures in SI units")
    for key, value in record.items():
        if isinstance(value, dict):
            print(f"{key}:")
            for name, figure in value.items():
                print(f"  {name.replace('_', ' '):26}{figure:.6g}")
        else:
            shown = f"{value:.6g}" if isinstance(value, float) else value
            print(f"{key.replace('_', ' '):28}{shown}")
    return 0


# --- cite ----------------------------------------------------------------------------------


def register_cite(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``cite``."""
    parser.set_defaults(command=run_cite)


def run_cite(arguments: argparse.Namespace) -> int:
    """Print BibTeX entries."""
    from importlib.metadata import version

    from adapters.citations import format_citations

    print(format_citations(version("trackbed")))
    return 0
