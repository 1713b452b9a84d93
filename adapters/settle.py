"""Settlement from Python, as ``trackbed.settle``: a scene run to its end, and what came out."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adapters.procedure import Record, Settled, judge_members, read_run_record
from adapters.procedure import run as procedure
from adapters.scene import load_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Settlement:
    """Means over the members of a finished run; SI units, nan where not known."""

    loaded_body: float  # permanent settlement of the loaded body, which stands for a sleeper [m]
    band: tuple[float, float]
    """Student's 90 % interval of that mean [m]; nan of one member, which knows no chaos."""
    stiffness: float  # secant stiffness under the loaded body in the last cycles computed [N/m]
    mean_grain: float  # settlement of the mean grain [m]
    error: float  # of the gain since the first jump, over that of the full runs; with a control
    cost: float  # CPU time of all members, full runs left out [s]
    settled: Settled = field(repr=False)  # bands and chaos of all of these, too
    record: Record = field(repr=False)  # the run as its reports read it

    def __str__(self) -> str:
        return str(self.settled)

    def plot(self, axes: Axes | None = None) -> Axes:
        """Settlement of the loaded body (µm, downwards) against load cycles, a line for each member
        and one for the full run beside it; on new axes if None are given."""
        from adapters.report import draw_members

        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.subplots()[1]
            axes.set(xlabel="load cycles", ylabel="settlement of the loaded body (µm)")
            axes.invert_yaxis()
        draw_members(axes, (self.record, *self.record.members))
        axes.legend()
        return axes


def settle(
    scene: str | Path, members: int = 1, control: bool = False, *,
    run_folder: str | Path | None = None, **settings: Any,
) -> Settlement:  # fmt: skip
    """Run a scene file, or what is left of its run, and return the result.

    ``members``: runs from states that differ by chance alone; 1 leaves it to the scene.
    ``control``: every cycle of each beside it, to know the error.  ``run_folder``: default ``run/``
    beside the scene.  ``settings``: keys of the scene, those of its table ``procedure``
    (``total_cycles=1000``) or by their whole name (``**{"sample.seed": 2}``).

    Progress goes to stderr.  Raises `TrackbedError`, as ``trackbed run`` does, and `SceneError` for
    a scene without load cycles.
    """
    path = Path(scene)
    folder = path.parent / "run" if run_folder is None else Path(run_folder)
    named = {key if "." in key else f"procedure.{key}": value for key, value in settings.items()}
    named |= {"procedure.members": members} if members != 1 else {}
    overrides = [f"{key}={json.dumps(value, default=int)}" for key, value in named.items()]
    procedure.refuse_unloaded(load_scene(path, overrides), path)
    procedure.run_scene(path, folder, control=control, overrides=overrides)
    record = read_run_record(folder)
    settled = judge_members(record)
    assert settled is not None
    return Settlement(
        settled.loaded_body.value, settled.loaded_body.band or (nan, nan), settled.stiffness.value,
        settled.mean_grain.value, settled.error.value, settled.cost, settled, record,
    )  # fmt: skip
