"""The verb ``relax``: a state at rest."""

import argparse
import sys
from pathlib import Path

from adapters.cli.arguments import add_json, print_json
from adapters.errors import UsageError
from trackbed.plausible import describe_implausible


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Arguments of ``relax``."""
    parser.add_argument("state", metavar="STATE", type=Path, help="a .npz, .vtkhdf, dump or run")
    parser.add_argument(
        "--out", metavar="STATE", type=Path, required=True,
        help=".npz, .vtkhdf; or .dump, .lammpstrj, .liggghts, also with .gz, .bz2, .xz behind",
    )  # fmt: skip
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
    add_json(parser)
    parser.set_defaults(command=run_relax)


def find_scene_of_state(state: Path) -> tuple[Path, list[str]]:
    """Scene file and overrides of the run folder that a state lies in, or is."""
    from adapters.files import RunFolder
    from trackbed.run_verbs import refuse_scene

    refuse_scene(state, "no series and no state", ", then give what came out")
    for folder in (state.resolve(), *state.resolve().parents):
        if (folder / "manifest.json").exists():
            return folder / "scene.toml", RunFolder(folder).manifest()["overrides"]
    raise UsageError(
        "the walls and the stiffness of the grains are not known", where=str(state),
        remedy="name the scene: --scene scene.toml",
    )  # fmt: skip


def run_relax(arguments: argparse.Namespace) -> int:
    """Relax a state, write it at rest, print what changed."""
    import numpy as np

    from adapters.bed import judge_state, make_no_contacts
    from adapters.engines import find_crib_forces
    from adapters.files import check_state_name, read_state_file, write_state_file
    from adapters.relaxation import relax, relax_bare
    from adapters.scene import flatten_keys, judge_bed, load_scene

    if not arguments.out.parent.is_dir():
        raise UsageError(
            "the folder of --out does not exist", where=str(arguments.out), remedy="make it first"
        )
    check_state_name(arguments.out)
    given = arguments.scene
    scene = load_scene(given) if given else load_scene(*find_scene_of_state(arguments.state))
    if scene.stones:
        raise UsageError(
            "stones are relaxed in jumps alone", where=str(arguments.state),
            remedy="trackbed run does it; give a state of spheres",
        )  # fmt: skip
    if arguments.method == "karrech2007" and scene.loading and scene.loading.crib is not None:
        raise UsageError(
            "karrech2007 does not know the weight of a crib", where="--method",
            remedy="take smallest-move, or a scene without loading.crib",
        )  # fmt: skip
    density = scene.material.grain.density
    state = read_state_file(arguments.state, density)
    walls = scene.walls(state.piston_height)
    where, sizes = str(arguments.state), 2 * np.append(state.radius, 0.01)
    doubts: list[str | None] = [judge(state, walls, where) for judge in (judge_state, judge_bed)]
    doubts += [describe_implausible("grain", float(d), where) for d in (sizes.min(), sizes.max())]
    for doubt in dict.fromkeys(filter(None, doubts)):
        print(f"warning: {doubt}", file=sys.stderr)
    if arguments.before is None:
        load = float(scene.stress_at(0.0)) * scene.loaded_area
        if len(state.radius):
            load += float(find_crib_forces(scene, state).sum())
        relaxation = relax_bare(state, walls, scene.stiffness, method=arguments.method, load=load)
    else:
        before = read_state_file(arguments.before, density)
        if not np.array_equal(before.identifier, state.identifier):
            raise UsageError(
                "the grains are not those of STATE", where=str(arguments.before),
                remedy="give the state of the same bed before the jump",
            )  # fmt: skip
        relaxation = relax(
            state.position, before, scene.walls(before.piston_height), scene.stiffness,
            walls_after=walls, method=arguments.method,
        )  # fmt: skip
    moved = np.linalg.norm(relaxation.position - state.position, axis=1) / state.radius
    if moved.max(initial=0.0) > 1:
        said = f"{moved.max():.2g} of its radii: look whether radii and places belong together"
        print(f"warning: grain {state.identifier[moved.argmax()]} moved {said}", file=sys.stderr)
    still = np.zeros_like(state.position)
    # Contacts and wall forces belong to the positions before and are left out.
    relaxed = state.move_to(
        relaxation.position, velocity=still, spin=still, contacts=make_no_contacts(), wall_force={}
    )
    write_state_file(relaxed, arguments.out)
    record = relaxation.record()
    if arguments.json:
        print_json(record)
        return 0
    print(f"{arguments.out}, at rest; all figures in SI units")
    for key, value in flatten_keys(record).items():
        shown = f"{value:.6g}" if isinstance(value, float) else value
        print(f"{key.replace('_', ' ').replace('.', ': '):34}{shown}")
    return 0
