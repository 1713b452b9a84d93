"""What a run may be made of: a scene, a method, loads, laws of wear and breakage."""

from __future__ import annotations

from typing import Any, Literal, get_args

from rigid_lcp.breakage import Breakage
from rigid_lcp.errors import SceneError, UsageError
from rigid_lcp.scene import Scene
from rigid_lcp.wear import Wear

Method = Literal["time-stepping", "acceleration"]


def check_run(scene: Any, method: Any, loads: Any, wear: Any, breakage: Any) -> None:
    """Raise `SceneError` or `UsageError` for what `rigid_lcp.simulation.Simulation` can not take.

    Its steps and residuals are looked at by `rigid_lcp.scene_input`.
    """
    if method not in get_args(Method):
        raise UsageError(f"method is {method!r}", remedy="give 'time-stepping' or 'acceleration'")
    if not isinstance(scene, Scene):
        raise SceneError(f"the scene is {scene!r}", remedy="give a rigid_lcp.Scene")
    for given, kind, what in ((wear, Wear, "wear"), (breakage, Breakage, "breakage")):
        if given is not None and not isinstance(given, kind):
            raise SceneError(
                f"{what} is {given!r}", where="Simulation",
                remedy=f"give a rigid_lcp.{kind.__name__}, or None",
            )  # fmt: skip
    if loads is not None and not callable(loads):
        raise UsageError("loads are no function", remedy="give loads(time, motion)")
    if method == "acceleration" and (wear is not None or breakage is not None):
        raise UsageError(
            "bodies do not wear or break at acceleration level", where="method",
            remedy="give method='time-stepping', or leave wear and breakage out",
        )  # fmt: skip
