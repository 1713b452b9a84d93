"""The verb ``trackbed advise SCENE``: which bodies may be rigid, and a run that tells."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qdem_fem.advise import Advice, advise, error_together

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SAMPLES = 200
"""Samples of a history that two runs are compared at."""


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
    parser.add_argument(
        "--check", action="store_true",
        help="run the scene twice, all deformable and as advised, and compare: for small scenes",
    )  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what is said as JSON")
    parser.set_defaults(command=advise_command)


@dataclass(frozen=True)
class Checked:
    """Two runs of a scene, all deformable and as advised."""

    predicted: float
    """`error_together`"""
    measured: float
    """Difference of the histories over the deformable one, in the norm over time, greatest of
    all probes [-]; of scenes without probes, of the bodies' mean displacements."""
    cost: tuple[float, float]
    """Processor time of the deformable and of the advised run [s]."""
    steps: tuple[int, int]


def advise_scene(path: Path, overrides: Sequence[str], tolerance: float) -> list[Advice]:
    """What is said of each body of a scene; raises `SceneError`."""
    from qdem_fem.scene_build import simulation_of
    from qdem_fem.scene_checks import scene_load

    run, _ = simulation_of(scene_load(path, overrides))
    return advise(run, tolerance)


def advice_check(path: Path, overrides: Sequence[str], advice: Sequence[Advice]) -> Checked:
    """Run a scene as it is and as advised, to its duration, and compare its probes.

    Advised bodies are rigid with the inertia of their mesh (``"lumped"``), which the deformable
    ones have; what the runs differ by is then their stiffness alone.  Both take the shorter of
    their time steps, so that neither's own error of time is compared.
    """
    marks = [f'body.{i}.rigid="lumped"' for i, one in enumerate(advice) if one.rigid]
    step = min(_step(path, overrides), _step(path, [*overrides, *marks]))
    same = f"simulation.step={step!r}"
    soft, soft_cost, steps = _histories(path, [*overrides, same])
    hard, hard_cost, hard_steps = _histories(path, [*overrides, *marks, same])
    worst = max(
        float(((h - s) ** 2).sum() ** 0.5 / ((s**2).sum() ** 0.5 or 1.0))
        for s, h in zip(soft, hard, strict=True)
    )
    return Checked(error_together(advice), worst, (soft_cost, hard_cost), (steps, hard_steps))


def _step(path: Path, overrides: Sequence[str]) -> float:
    from qdem_fem.scene_build import simulation_of
    from qdem_fem.scene_checks import scene_load

    return float(simulation_of(scene_load(path, overrides))[0].step)


def _histories(
    path: Path, overrides: Sequence[str]
) -> tuple[list[NDArray[np.float64]], float, int]:
    """Displacement of every probe (samples, 3) [m], processor time [s], and steps of a run."""
    from qdem_fem.scene_build import simulation_of
    from qdem_fem.scene_checks import scene_load

    prepared = scene_load(path, overrides)
    run, bodies = simulation_of(prepared)
    probes: dict[str, Any] = {n: (bodies[b], nodes) for n, (b, nodes) in prepared.probes.items()}
    if not probes:
        probes = {name: (body, body.nodes[:, 0] > -float("inf")) for name, body in bodies.items()}
    duration = prepared.scene.simulation.duration
    assert duration is not None
    run.advance(run.step)
    started = time.process_time()
    history = run.advance(duration - run.step, probes, duration / SAMPLES)
    cost = time.process_time() - started
    return [history[name] for name in probes], cost, run.steps_done


def advise_command(arguments: argparse.Namespace) -> int:
    """Tell what may be rigid; with ``--check``, what two runs say to that."""
    from qdem_fem.errors import UsageError

    if not 0 < arguments.tolerance < 1:
        raise UsageError(
            f"{arguments.tolerance:g} is no share", where="--tolerance", remedy="give 0.01 or so"
        )
    advice = advise_scene(arguments.scene, arguments.overrides, arguments.tolerance)
    answer: dict[str, Any] = {
        "scene": str(arguments.scene),
        "tolerance": arguments.tolerance,
        "bodies": [asdict(one) for one in advice],
        "predicted": error_together(advice),
    }
    print("\n".join(_lines(advice)))
    if arguments.check:
        if not any(one.rigid for one in advice):
            print("nothing to check: no body may be rigid", file=sys.stderr)
        else:
            checked = advice_check(arguments.scene, arguments.overrides, advice)
            answer["check"] = asdict(checked)
            print(
                f"two runs: error {checked.measured:.2g} measured, {checked.predicted:.2g} "
                f"predicted at most; {checked.cost[0]:.2f} s and {checked.cost[1]:.2f} s"
            )
    if arguments.json is not None:
        from qdem_fem.output import write_whole

        write_whole(arguments.json, json.dumps(answer, indent=1) + "\n")
    return 0


def _lines(advice: Sequence[Advice]) -> list[str]:
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
        f"of the elements, error {error_together(advice):.2g} predicted at most"
    )
    return lines
