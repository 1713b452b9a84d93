"""What one window of load cycles leaves: the state at every cycle end and the piston's record."""

from collections import deque
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path

import numpy as np

from adapters.bed import Contacts, FloatArray, IntArray, State
from adapters.bed.stones import SPHERE, Form
from adapters.errors import EngineFailed
from adapters.files.dump import Frame
from adapters.files.dump_reader import read_frames
from adapters.files.stones import gather_all_stones
from trackbed.memory import read_arrays
from trackbed.run_files import replace_file

ARRAYS = ("time_step", "identifier", "radius", "mass", "position", "velocity", "spin")
"""Fields of a `Window` that are plain arrays."""


@dataclass(frozen=True)
class PistonTrack:
    """Samples of the piston over a window, ``s`` of them, evenly spaced in time."""

    time_step: IntArray  # the engine's step count, shape (s,)
    target_force: FloatArray  # force the load asks for [N], downwards, shape (s,)
    contact_force: FloatArray  # force the bed exerts on the piston [N], upwards, shape (s,)
    height: FloatArray  # height of the piston's face [m], shape (s,)
    kinetic_translational: FloatArray  # translational kinetic energy of the grains [J], shape (s,)
    kinetic_rotational: FloatArray  # rotational kinetic energy of the grains [J], shape (s,)

    def cycles(self, steps_per_cycle: int) -> IntArray:
        """Cycles from the window's start that each sample comes after, shape (s,): 0, 1, ..."""
        start = (self.time_step[0] // steps_per_cycle) * steps_per_cycle
        return np.asarray((self.time_step - start - 1) // steps_per_cycle)

    def force_error(self, steps_per_cycle: int) -> FloatArray:
        """Root mean square of contact minus target force in each cycle, over the peak target."""
        cycle = self.cycles(steps_per_cycle)
        square = ((self.contact_force - self.target_force) / self.target_force.max()) ** 2
        return np.asarray(np.sqrt(np.bincount(cycle, square) / np.bincount(cycle)))

    def elastic_deflection(self, steps_per_cycle: int) -> FloatArray:
        """Height at each cycle's end minus the lowest height in it [m]."""
        cycle = self.cycles(steps_per_cycle)
        heights = [self.height[cycle == c] for c in range(cycle.max() + 1)]
        return np.array([height[-1] - height.min() for height in heights])

    def stiffness(self, steps_per_cycle: int) -> FloatArray:
        """Secant stiffness under the piston in each cycle [N/m]: greatest less last force that the
        load asks for, over the elastic deflection; nan where the bed did not give way."""
        cycle = self.cycles(steps_per_cycle)
        forces = [self.target_force[cycle == c] for c in range(cycle.max() + 1)]
        swing = np.array([force.max() - force[-1] for force in forces])
        deflection = self.elastic_deflection(steps_per_cycle)
        return np.divide(swing, deflection, np.full_like(swing, np.nan), where=deflection > 0)


@dataclass(frozen=True)
class Window:
    """``c`` load cycles of ``n`` grains: the state before the first and after each."""

    first_cycle: int  # cycles done before the window
    time_step: IntArray  # the engine's step count, shape (c + 1,)
    identifier: IntArray  # grain identifiers, ascending, shape (n,)
    radius: FloatArray  # radii [m], shape (n,)
    mass: FloatArray  # masses [kg], shape (n,)
    position: FloatArray  # centres [m], shape (c + 1, n, 3)
    velocity: FloatArray  # velocities [m/s], shape (c + 1, n, 3)
    spin: FloatArray  # angular velocities [rad/s], shape (c + 1, n, 3)
    wall_force: dict[str, FloatArray]
    """Force of each wall on each grain [N], shape (c + 1, n, 3) each."""
    contacts: tuple[Contacts, ...]  # contacts at each of the c + 1 instants
    piston: PistonTrack
    piston_start: float  # height of the piston's face before the first cycle [m]
    orientation: FloatArray | None = None  # of stones, as in `State`, shape (c + 1, n, 4)

    def __len__(self) -> int:
        """Number of load cycles."""
        return len(self.position) - 1

    @property
    def cycle(self) -> IntArray:
        """Cycles done at each state, shape (c + 1,)."""
        return self.first_cycle + np.arange(len(self.position))

    def state(self, index: int) -> State:
        """State after cycle number ``index`` of the window; -1 is the last."""
        index = index % len(self.position)
        heights = self.piston_heights()
        return State(
            self.identifier, self.position[index], self.radius, self.mass, self.velocity[index],
            self.spin[index], self.contacts[index],
            {name: force[index] for name, force in self.wall_force.items()}, float(heights[index]),
            cycle=self.first_cycle + index, time_step=int(self.time_step[index]),
            orientation=None if self.orientation is None else self.orientation[index],
        )  # fmt: skip

    def piston_heights(self) -> FloatArray:
        """Height of the piston's face at each of the c + 1 instants [m]."""
        rows = np.searchsorted(self.piston.time_step, self.time_step[1:])
        return np.concatenate([[self.piston_start], self.piston.height[rows]])


def read_piston_track(path: Path) -> PistonTrack:
    """Read ``piston.txt``; raises `EngineFailed` when it is no whole table of numbers."""
    try:
        table = np.loadtxt(path, skiprows=1, ndmin=2)
        return PistonTrack(table[:, 0].astype(np.int64), *table[:, 1:6].T.copy())
    except (OSError, ValueError, IndexError, TypeError) as error:
        raise EngineFailed(
            f"the piston's record is not whole ({error})",
            where=str(path),
            remedy="look at screen.txt beside it; the window is computed again on resume",
        ) from error


def read_contacts(frame: Frame) -> Contacts:
    """Contacts from an ENTRIES frame whose columns are those of ``output_*.in``.

    The engine's force is that on the first grain of a row; here pairs are (i < j), forces on i.
    """
    values = frame.values
    pair = values[:, :2].astype(np.int64)
    sign = np.where(pair[:, 0] < pair[:, 1], 1.0, -1.0)[:, None]
    order = np.lexsort((pair.max(axis=1), pair.min(axis=1)))
    vectors = [sign * values[:, first : first + 3] for first in range(2, values.shape[1] - 1, 3)]
    while len(vectors) < 3:  # a frictionless scene has neither tangential force nor spring
        vectors.append(np.zeros_like(vectors[0]))
    return Contacts(
        np.sort(pair, axis=1)[order],
        values[order, -1],
        *(np.ascontiguousarray(vector[order]) for vector in vectors),
    )


def _check_files(folder: Path, *names: str) -> None:
    for name in names:
        if not (folder / name).exists():
            raise EngineFailed(
                f"the engine left no {name}",
                where=str(folder),
                remedy="look at screen.txt there for the engine's own words",
            )


def read_window(
    folder: Path, first_cycle: int, wall_names: tuple[str, ...], piston_start: float,
    form: Form = SPHERE,
) -> Window:  # fmt: skip
    """Read the dumps an engine left in ``folder``; the piston started at ``piston_start`` [m].

    With a ``form`` the grains are stones.  Raises `DumpError` for a malformed dump, `EngineFailed`
    for missing files and `NotCredible` for stones that lost their shape.
    """
    _check_files(folder, "states.dump", "contacts.dump", "piston.txt")
    frames = list(read_frames(folder / "states.dump"))
    contact_frames = list(read_frames(folder / "contacts.dump"))
    if [f.time_step for f in frames] != [f.time_step for f in contact_frames]:
        raise EngineFailed(
            f"states.dump has {len(frames)} instants and contacts.dump {len(contact_frames)}",
            where=str(folder),
            remedy="the engine did not end properly; look at screen.txt there",
        )
    states = [_read_grains(*pair, wall_names) for pair in zip(frames, contact_frames, strict=True)]
    if form is not SPHERE:
        states = gather_all_stones(form, states, folder)
    first = states[0]
    return Window(
        first_cycle, np.array([state.time_step for state in states], np.int64), first.identifier,
        first.radius, first.mass, np.array([state.position for state in states]),
        np.array([state.velocity for state in states]), np.array([state.spin for state in states]),
        {name: np.array([state.wall_force[name] for state in states]) for name in wall_names},
        tuple(state.contacts for state in states), read_piston_track(folder / "piston.txt"),
        piston_start,
        None if first.orientation is None else np.array([one.orientation for one in states]),
    )  # fmt: skip


def read_state(folder: Path, wall_names: tuple[str, ...], form: Form = SPHERE) -> State:
    """The settled bed that a preparation left in ``folder``; raises as `read_window`."""
    _check_files(folder, "states.dump", "contacts.dump")
    grains, contacts = (
        deque(read_frames(folder / f"{name}.dump"), 1).pop() for name in ("states", "contacts")
    )
    state = _read_grains(grains, contacts, wall_names)
    return state if form is SPHERE else gather_all_stones(form, [state], folder)[0]


def _read_grains(grains: Frame, contacts: Frame, wall_names: tuple[str, ...]) -> State:
    """State of one instant, from the frames of its grains and contacts."""
    forces = {
        name: grains.block(*(f"f_force_{name}[{axis}]" for axis in (1, 2, 3)))
        for name in wall_names
    }
    return State(
        grains.column("id").astype(np.int64), grains.block("x", "y", "z"), grains.column("radius"),
        grains.column("mass"), grains.block("vx", "vy", "vz"),
        grains.block("omegax", "omegay", "omegaz"), read_contacts(contacts), forces,
        time_step=grains.time_step,
    )  # fmt: skip


def save_window(window: Window, path: Path) -> None:
    """Write a window to ``path`` (npz), without loss, atomically."""
    arrays = {name: getattr(window, name) for name in (*ARRAYS, "first_cycle", "piston_start")}
    arrays |= {f"wall_{name}": force for name, force in window.wall_force.items()}
    arrays |= {f"piston_{name}": values for name, values in vars(window.piston).items()}
    if window.orientation is not None:
        arrays["orientation"] = window.orientation
    arrays["contact_count"] = np.array([len(contacts) for contacts in window.contacts])
    for column in fields(Contacts):
        rows = [getattr(contacts, column.name) for contacts in window.contacts]
        arrays[f"contact_{column.name}"] = np.concatenate(rows)
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)


def load_window(path: Path) -> Window:
    """Read what `save_window` wrote; raises `EngineFailed` when the file is damaged."""
    try:
        arrays = read_arrays(path)
    except Exception as error:  # numpy raises many kinds for a file that is not a whole npz
        raise EngineFailed(
            f"the saved window is damaged ({error})",
            where=str(path),
            remedy="move its folder away and resume: the window is computed again",
        ) from error
    ends = np.concatenate([[0], np.cumsum(arrays.pop("contact_count"))])
    contacts = tuple(
        Contacts(*(arrays[f"contact_{c.name}"][a:b] for c in fields(Contacts)))
        for a, b in pairwise(ends)
    )
    return Window(
        first_cycle=int(arrays["first_cycle"]),
        **{name: arrays[name] for name in ARRAYS},
        wall_force={n[5:]: values for n, values in arrays.items() if n.startswith("wall_")},
        contacts=contacts,
        piston=PistonTrack(*(arrays[f"piston_{c.name}"] for c in fields(PistonTrack))),
        piston_start=float(arrays["piston_start"]),
        orientation=arrays.get("orientation"),
    )
