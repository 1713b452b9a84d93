"""Taps: a settled bed is lifted and dropped until it has the porosity that its scene asks for.

As a jolting apparatus does (ISO 787-11), and alike on every engine: a tap is a preparation that
starts from the lifted bed, at rest, in place of the rain.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from math import isnan
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, State
from adapters.engines.contract import EngineRun
from adapters.engines.plan import PLAN
from adapters.engines.process import ProcessEngine
from adapters.errors import NotConverged, NotCredible
from adapters.files import read_state
from adapters.scene import Scene, measure_porosity

Settle = Callable[[FloatArray, FloatArray, float], EngineRun]
"""Settles a bed from rest: centres (n, 3), radii (n,), a height [m] that none of it reaches."""


class TappingEngine(ProcessEngine):
    """An engine whose preparation is run again with each tap."""

    @abstractmethod
    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engines.contract.Engine`."""

    def run(
        self, scene: Scene, deck: str, folder: Path, watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:  # fmt: skip
        """Run a deck and, after the rain, the taps that the scene's porosity takes; raises as
        `ProcessEngine.run` and `tap_bed`."""
        done = super().run(scene, deck, folder, watch, digests)
        if deck != "in.prepare" or scene.sample.porosity is None:
            return done

        def settle(position: FloatArray, radius: FloatArray, height: float) -> EngineRun:
            decks = self.write_preparation(scene, position, radius, height, folder)
            return ProcessEngine.run(self, scene, deck, folder, watch, decks)

        return tap_bed(scene, folder, self.wall_names(scene, piston=False), done, settle)


def tap_bed(
    scene: Scene, folder: Path, walls: tuple[str, ...], done: EngineRun, settle: Settle
) -> EngineRun:
    """Tap the bed that was ``done`` in ``folder`` until it has the scene's porosity.

    A tap that makes it denser than asked by more than `PLAN.porosity_step` is taken back, and the
    bed dropped half as far.  ``taps.txt`` has the fall of each tap and the porosity behind it.

    Raises `NotCredible` for a bed that is denser before any tap, or too low to be measured, and
    `NotConverged` where the taps do not reach it.
    """
    asked = scene.sample.porosity
    assert asked is not None
    state, porosity = read_bed(scene, folder, walls)
    if porosity < asked - PLAN.porosity_step:
        raise NotCredible(
            f"the bed has a porosity of {porosity:.3f} before any tap, below {asked:g}",
            where="sample.porosity",
            remedy="more friction while it rains (sample.rain_friction), or less porosity",
        )
    fall = PLAN.tap_fall * 2 * float(state.radius.mean())
    rows = [f"0 0 {porosity:.6g}"]
    while porosity > asked and len(rows) <= PLAN.taps_most:
        lifted = state.position + np.array([0.0, 0.0, fall])
        one = settle(lifted, state.radius, 2 * float((lifted[:, 2] + state.radius).max()))
        done = replace(
            one, cpu_s=done.cpu_s + one.cpu_s, wall_s=done.wall_s + one.wall_s,
            start_up_s=done.start_up_s + one.start_up_s,
        )  # fmt: skip
        tapped, found = read_bed(scene, folder, walls)
        rows.append(f"{len(rows)} {fall:.6g} {found:.6g}")
        (folder / "taps.txt").write_text("\n".join(["tap fall_m porosity", *rows, ""]))
        if found < asked - PLAN.porosity_step:
            fall /= 2
        else:
            state, porosity = tapped, found
    if porosity > asked:
        raise NotConverged(
            f"{PLAN.taps_most} taps bring the bed to a porosity of {porosity:.3f}, not {asked:g}",
            where="sample.porosity",
            remedy="a higher one, or less friction while it rains and is tapped "
            "(sample.rain_friction)",
        )
    return done


def read_bed(scene: Scene, folder: Path, walls: tuple[str, ...]) -> tuple[State, float]:
    """A settled bed and its porosity; raises `NotCredible` where that cannot be measured."""
    state = read_state(folder, walls, scene.form)
    porosity = measure_porosity(state.position, state.radius, scene.container)
    if isnan(porosity):
        raise NotCredible(
            "the settled bed is lower than four mean grains, so its porosity is not measured",
            where="sample.porosity", remedy="more grains (sample.fill_height), or leave it out",
        )  # fmt: skip
    return state, porosity
