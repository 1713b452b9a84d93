"""The verbs ``trackbed grains`` and ``trackbed train``: parts of a track, written as files."""

import argparse
from pathlib import Path
from typing import Any

from trackbed.choices import find_choices
from trackbed.errors import UsageError
from trackbed.plausible import describe_implausible

SEAT_AREA = 0.13 * 0.17
"""Of a rail seat [m^2]: a foot of 130 mm on a pad of 170 mm."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``grains`` or ``train``; what is not given is the package's own."""
    {"grains": _register_grains, "train": _register_train}[verb](parser)


def _register_grains(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="the .npz file to write")
    parser.add_argument("--count", type=int, default=5700, help="grains (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    parser.add_argument(
        "--shape", default="hulls", choices=find_choices("qdem_fem.grains", "SHAPE"),
        help="default: %(default)s",
    )  # fmt: skip
    for wish in ("sphericity", "roundness"):
        parser.add_argument(f"--{wish}", type=float, help="of every grain, 0 to 1; of hulls only")
    parser.add_argument(
        "--sizes", type=float, nargs=2, metavar=("LEAST", "GREATEST"),
        help="sieves, m, in place of EN 13450 31.5/50 A; 0.045 0.055: the paper's grains",
    )  # fmt: skip
    parser.set_defaults(command=make_grain_file)


def _register_train(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="the .csv file to write")
    parser.add_argument("--cars", type=int, help="of the train (default: 5)")
    parser.add_argument("--speed", type=float, help="m/s")
    parser.add_argument("--axle-load", type=float, help="N")
    parser.add_argument("--first-share", type=float, help="of an axle load on rail seat 1")
    parser.add_argument(
        "--flat", type=float, nargs=3, action="append", default=[],
        metavar=("AXLE", "PEAK", "DURATION"),
        help="a flat on both wheels of an axle, counted from 0: force, N, for that time, s, at "
        "every turn; may be repeated",
    )  # fmt: skip
    parser.add_argument("--modulus", type=float, help="of the track's foundation, N/m^2")
    parser.add_argument(
        "--roughness", choices=["smooth", "average"], help="of a rail that is not even"
    )
    parser.add_argument("--seed", type=int, help="of the roughness (default: 1)")
    parser.add_argument(
        "--area", type=float, default=SEAT_AREA, help="of a rail seat, m^2 (default: %(default)g)"
    )
    parser.set_defaults(command=make_train_file)


def make_grain_file(arguments: argparse.Namespace) -> int:
    """Make random ballast grains, of EN 13450 31.5/50 A or between two sieves, and save them."""
    import numpy as np

    from qdem_fem.grains import BALLAST, GrainRecipe, make_grains, save_grains
    from trackbed.scene_files import Grading

    _refuse_name(arguments.out, ".npz")
    recipe = GrainRecipe(**_select_given(arguments, "sphericity", "roundness"))
    grading = BALLAST
    if arguments.sizes is not None:
        grading = Grading(np.array(arguments.sizes), np.array([0.0, 1.0]))
        if said := describe_implausible("grain", max(arguments.sizes), "--sizes"):
            raise UsageError(said)
    grains = make_grains(arguments.count, arguments.seed, recipe, grading, arguments.shape)
    save_grains(arguments.out, grains)
    print(f"{arguments.out}: {len(grains)} grains, {grains.tetrahedra.sum()} tetrahedra")
    return 0


def make_train_file(arguments: argparse.Namespace) -> int:
    """Write the made-up record of a passing train."""
    from qdem_fem.track import loads

    _refuse_name(arguments.out, ".csv")
    train = loads.Train(**_select_given(arguments, "cars", "speed", "axle_load", "first_share"))
    track, rough = loads.Track(**_select_given(arguments, "modulus")), None
    if arguments.roughness is not None:
        rough = loads.Roughness(arguments.roughness, **_select_given(arguments, "seed"))
    elif arguments.seed is not None:
        raise UsageError("--seed is that of a roughness", remedy="give --roughness, too")
    flats = [loads.WheelFlat(axle, peak, duration) for axle, peak, duration in arguments.flat]
    record = loads.make_train_record(train, track, arguments.area, flats, roughness=rough)
    loads.write_load_record(arguments.out, record)
    print(f"{arguments.out}: {record.time[-1]:.3f} s at {record.rate:g} Hz")
    return 0


def _select_given(arguments: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Those of the named arguments that were given."""
    return {key: getattr(arguments, key) for key in names if getattr(arguments, key) is not None}


def _refuse_name(out: Path, ending: str) -> None:
    """Raise `UsageError` where ``out`` can not be written, before minutes of work are lost, or is
    named as another kind of file."""
    if out.is_dir() or not out.parent.is_dir():
        why = "a folder" if out.is_dir() else "in a folder that is not there"
        raise UsageError(f"{out} is {why}", where="--out", remedy="name a file in a folder that is")
    if out.suffix != ending:
        remedy = f"it is written as {ending}, whatever the name: name it so"
        raise UsageError(f"{out} does not end with {ending}", where="--out", remedy=remedy)
