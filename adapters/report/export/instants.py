"""The instants of a run that other tools are given: the bed before loading, every cycle end."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray, State
from adapters.bed.stones import find_rotation, find_touching
from adapters.errors import UsageError
from adapters.procedure import CONTROL, Record, Track, read_run_record
from adapters.scene import Scene


@dataclass(frozen=True)
class Instant:
    """The bed at the end of a load cycle; at cycle 0 before loading."""

    state: State
    displacement: FloatArray  # of every grain since cycle 0 [m], (n, 3); nan of one that came later
    rotation: FloatArray | None  # of every stone since cycle 0 [rad], shape (n, 3)
    coordination: IntArray
    """Contacts of every grain with other grains, shape (n,); their mean is the run's table's."""

    @property
    def cycle(self) -> int:
        """Cycles done, jumped ones included."""
        return self.state.cycle


@dataclass(frozen=True)
class ExportedRun:
    """One run of a scene, as its finished stages left it."""

    scene: Scene
    track: Track

    @property
    def own(self) -> bool:
        """Whether trackbed made the bed: of a deck neither contacts nor piston are known."""
        return isinstance(self.scene, Scene)

    @property
    def loaded(self) -> bool:
        """Whether load cycles were computed: without them nothing moves and there is no piston."""
        return bool(self.track.windows)

    def _states(self, every: int) -> Iterator[State]:
        yield self.track.start()
        done, last = 0, max((one.last_cycle for _, one in self.track.windows), default=0)
        for name, _ in self.track.windows:
            window = self.track.window(name)
            for index, cycle in enumerate(window.cycle.tolist()):
                if cycle > done and (cycle % every == 0 or cycle == last):
                    yield window.state(index)
            done = int(window.cycle[-1])

    def instants(self, every: int = 1) -> Iterator[Instant]:
        """The bed before loading, at every multiple of ``every`` cycles, and at the last one.

        A jump's end is the first state of the window after it: forces and contacts are then the
        engine's own.  A jump that no window follows yet is left out.
        """
        start = self.track.start()
        for state in self._states(every):
            both = np.empty(0, np.int64)
            if self.own:  # only pairs of grains are counted
                form, walls = self.scene.form, self.scene.container.walls()
                touching = find_touching(form, state, walls)
                grains = touching.second >= 0
                both = np.concatenate([touching.first[grains], touching.second[grains]])
                both //= len(form.radius)
            coordination = np.bincount(both, minlength=len(state.radius))
            rotation = None
            if start.orientation is not None and state.orientation is not None:
                rotation = find_rotation(start.orientation, state.orientation)
            row = np.searchsorted(start.identifier[:-1], state.identifier)
            since = state.position - start.position[row]
            since[start.identifier[row] != state.identifier] = np.nan
            yield Instant(state, since, rotation, coordination)

    def piston_samples(self) -> Iterator[dict[str, FloatArray | IntArray]]:
        """All samples of the piston, window by window: cycles done, forces [N], height [m]."""
        for name, _ in self.track.windows:
            window = self.track.window(name)
            steps = window.piston.time_step - window.time_step[0]
            yield {
                "cycle": window.first_cycle + steps / self.scene.steps_per_cycle,
                "target_force": window.piston.target_force,
                "contact_force": window.piston.contact_force,
                "height": window.piston.height,
            }


def read_exported_run(
    run_folder: Path, variant: str = "", read: Callable[[Path], Record] = read_run_record
) -> ExportedRun:
    """A run of the folder: the procedure, or the ``control`` beside it; ``read`` knows its kind.

    Raises `UsageError` for a folder or variant that is not there, or not yet prepared.
    """
    record = read(run_folder)
    track = {"": record.run, CONTROL: record.control}.get(variant)
    if track is None:
        known = "none" if record.control is None else CONTROL
        raise UsageError(
            f"there is no run {variant} beside this one; there are: {known}", where=str(run_folder),
            remedy="trackbed run SCENE --control makes the control",
        )  # fmt: skip
    if track.preparation is None:
        raise UsageError(
            "the bed is not prepared yet, so there is nothing to export", where=str(run_folder),
            remedy="wait for it, or go on with: trackbed resume RUN",
        )  # fmt: skip
    return ExportedRun(record.scene, track)
