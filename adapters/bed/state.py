"""Mechanical state of a bed of grains: data only, written and read without loss."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from adapters.errors import UsageError
from trackbed.memory import read_arrays
from trackbed.run_files import replace_file

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


GRAIN_ARRAYS = ("identifier", "position", "radius", "mass", "velocity", "spin")
"""Fields of a `State` with one row a grain."""


@dataclass(frozen=True)
class Contacts:
    """Grain-grain contacts of one instant, each pair once."""

    pair: IntArray  # grain identifiers (i, j) with i < j, shape (m, 2)
    overlap: FloatArray  # overlap delta_n = r_i + r_j - |x_i - x_j| [m], shape (m,)
    normal_force: FloatArray  # normal force on grain i, elastic and viscous part [N], shape (m, 3)
    tangential_force: FloatArray
    """Tangential force on grain i [N], shape (m, 3); zeros in a frictionless scene."""
    tangential_spring: FloatArray
    """Tangential displacement delta_t of the contact of grain i [m], shape (m, 3)."""

    def __len__(self) -> int:
        return len(self.overlap)


def make_no_contacts() -> Contacts:
    """No contact at all (a gas of grains)."""
    return Contacts(
        np.empty((0, 2), np.int64), np.empty(0), np.empty((0, 3)), np.empty((0, 3)),
        np.empty((0, 3)),
    )  # fmt: skip


@dataclass(frozen=True)
class State:
    """Grains, contacts and piston at one instant, SI units; grains sorted by identifier."""

    identifier: IntArray  # grain identifiers, ascending, shape (n,)
    position: FloatArray  # centres [m], shape (n, 3)
    radius: FloatArray  # radii [m], shape (n,)
    mass: FloatArray  # masses [kg], shape (n,)
    velocity: FloatArray  # velocities [m/s], shape (n, 3)
    spin: FloatArray  # angular velocities [rad/s], shape (n, 3)
    contacts: Contacts = field(default_factory=make_no_contacts)
    wall_force: dict[str, FloatArray] = field(default_factory=dict)
    """Force of each named wall on each grain [N], shape (n, 3) each."""
    piston_height: float = np.nan  # height of the piston's lower face [m]; nan without a piston
    cycle: int = 0  # load cycles done, jumped ones included
    time_step: int = 0  # the engine's own step count
    orientation: FloatArray | None = None
    """Of stones (`adapters.bed.stones`): quaternions, real part first, (n, 4); radii are those then
    of spheres of the same volume.  None for spheres."""

    def move_to(self, position: FloatArray, **change: object) -> State:
        """The same grains at other positions [m], shape (n, 3)."""
        return replace(self, position=np.asarray(position, float), **change)  # type: ignore[arg-type]


def save_state(state: State, path: Path) -> None:
    """Write a state to ``path`` (npz), atomically: a killed writer leaves the old file."""
    arrays = {name: getattr(state, name) for name in GRAIN_ARRAYS}
    arrays |= {f"contact_{name}": value for name, value in vars(state.contacts).items()}
    arrays |= {f"wall_{name}": value for name, value in state.wall_force.items()}
    if state.orientation is not None:
        arrays["orientation"] = state.orientation
    scalars = np.array([state.piston_height, state.cycle, state.time_step])
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, scalars=scalars, **arrays)


def load_state(path: Path) -> State:
    """Read what `save_state` wrote; raises `UsageError` when ``path`` is no such file."""
    try:
        data = read_arrays(path)
        height, cycle, step = map(float, data["scalars"])
        cycle, step = int(cycle), int(step)
        contacts = Contacts(**{n[8:]: value for n, value in data.items() if n[:8] == "contact_"})
        walls = {name[5:]: value for name, value in data.items() if name.startswith("wall_")}
        grains = {name: data[name] for name in GRAIN_ARRAYS}
        for name, one in grains.items():
            shape = (len(grains["radius"]), 3)[: 2 - (name in ("identifier", "radius", "mass"))]
            if one.dtype.kind not in "iuf" or one.shape != shape:
                raise ValueError(f"{name} is {one.shape} of {one.dtype}, not {shape} of numbers")
    except Exception as error:  # numpy raises many kinds for a file that is not a whole npz
        raise UsageError(
            f"this is not a whole state file ({error})",
            where=str(path),
            remedy="give a .npz written by trackbed, or a LIGGGHTS dump",
        ) from error
    return State(
        **grains, contacts=contacts, wall_force=walls, piston_height=height, cycle=cycle,
        time_step=step, orientation=data.get("orientation"),
    )  # fmt: skip
