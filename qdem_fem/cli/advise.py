"""The verb ``trackbed advise SCENE``: which bodies may be rigid."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from qdem_fem.scene import Advice


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``advise`` to its parser."""
    assert verb == "advise"
    parser.add_argument("scene", metavar="SCENE", type=Path, help="a QDEM scene file (TOML)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help="change a key of the scene; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=float, default=0.01, metavar="SHARE",
        help="error that a rigid body may make, of the compliance of its contacts; default 0.01",
    )  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what is said as JSON")
    parser.set_defaults(command=advise_command)


def advise_command(arguments: argparse.Namespace) -> int:
    """Tell what may be rigid."""
    from qdem_fem.files import UsageError
    from qdem_fem.scene import advise, load_scene, make_simulation, predict_error

    if not 0 < arguments.tolerance < 1:
        raise UsageError(
            f"{arguments.tolerance:g} is no share", where="--tolerance", remedy="give 0.01 or so"
        )
    run, _ = make_simulation(load_scene(arguments.scene, arguments.overrides))
    advice = advise(run, arguments.tolerance)
    answer: dict[str, Any] = {
        "scene": str(arguments.scene),
        "tolerance": arguments.tolerance,
        "bodies": [asdict(one) for one in advice],
        "predicted": predict_error(advice),
    }
    print("\n".join(_lines(advice, answer["predicted"])))
    if arguments.json is not None:
        from trackbed.run_files import write_whole

        write_whole(arguments.json, json.dumps(answer, indent=1) + "\n")
    return 0


def _lines(advice: Sequence[Advice], predicted: float) -> list[str]:
    """A line a body, and what follows from all."""
    lines = [
        f"{one.body}: {'rigid' if one.rigid else 'deformable'}: {one.why}; error {one.error:.2g}, "
        f"first mode {one.own.frequency:.3g} Hz, wave {one.own.transit:.2g} s, load "
        f"{one.load_frequency:.3g} Hz, inertia of the mesh {100 * one.inertia:+.0f} %"
        for one in advice
    ]
    spared = sum(one.elements for one in advice if one.rigid)
    share = spared / sum(one.elements for one in advice)
    lines.append(
        f"rigid: {sum(one.rigid for one in advice)} of {len(advice)} bodies, {100 * share:.0f} % "
        f"of the elements, error {predicted:.2g} predicted at most"
    )
    return lines
