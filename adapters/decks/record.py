"""The run of a deck as runs of scenes are read: for status, report and export."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from adapters.bed import State
from adapters.decks.exchange import describe_exchange
from adapters.decks.states import States, load_states
from adapters.files import RunFolder
from adapters.procedure import CONTROL, Record, Track, read_track
from adapters.scene import Procedure


class DeckTrack(Track):
    """One run of a deck, whose states are `States`: no spins, contacts and piston are known."""

    def start(self) -> State:
        """The bed before the first load cycle."""
        return make_state(load_states(self._find_sound("preparation") / "states.npz"), 0, 0)

    def window(self, name: str) -> Any:
        """Cycles and states of one window, as a `Window` has them."""
        states = load_states(self._find_sound(name) / "states.npz")
        cycle = dict(self.windows)[name].first_cycle + np.arange(len(states.position))
        return SimpleNamespace(
            cycle=cycle, state=lambda index: make_state(states, index, int(cycle[index]))
        )


def make_state(states: States, index: int, cycle: int) -> State:
    """One of ``states`` as a state of a bed, at the end of a ``cycle``."""
    one = states.at(index)
    grains = one.identifier, one.position[0], one.radius, one.mass, one.velocity[0]
    return State(*grains, np.zeros_like(one.velocity[0]), cycle=cycle)


def read_deck_record(path: Path) -> Record:
    """Read the run folder of a deck as `read_run_record` reads those of scenes."""
    tracks = (vars(read_track(RunFolder(folder))) for folder in (path, path / CONTROL))
    run, beside = (
        DeckTrack(**one | {"exchanged": describe_exchange(one["outcomes"])}) for one in tracks
    )
    manifest = run.folder.manifest()
    scene: Any = SimpleNamespace(  # what is asked of a scene of how far a run is
        procedure=Procedure.model_validate(manifest["scene"]["procedure"]), loading=manifest
    )
    control = beside if len(beside.history.cycle) else None
    return Record(path, manifest, scene, run, control, (), 1)
