"""Stones from the dumps of an engine that writes their spheres, and the bodies beside them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from adapters.bed import State
from adapters.bed.stones import Form, spread_spheres
from adapters.errors import EngineFailed, NotCredible
from adapters.files.dump import Frame
from adapters.files.dump_reader import read_frames

SHAPE_KEPT = 1e-6
"""How far a sphere may be from its place in the stone, over the stone's radius [-]: engines that
turn bodies by quaternions round off 1e-12 of it in a cycle."""
BODIES = "stones.dump"
"""Bodies at the instants of ``states.dump``: id, centre, quaternion, velocity, angular velocity,
mass, in this order."""


def gather_all_stones(form: Form, spheres: Sequence[State], folder: Path) -> list[State]:
    """States of stones from those of their spheres and from `BODIES` in ``folder``.

    Raises `EngineFailed` where an instant is missing, and as `gather_stones`.
    """
    path = folder / BODIES
    frames = {frame.time_step: frame for frame in read_frames(path)} if path.exists() else {}
    if missing := [one.time_step for one in spheres if one.time_step not in frames]:
        raise EngineFailed(
            f"the engine left no stones at step {missing[0]}", where=str(path),
            remedy="look at screen.txt beside it for the engine's own words",
        )  # fmt: skip
    stones = [gather_stones(form, one, frames[one.time_step]) for one in spheres]
    if lost := len(stones[0].identifier) - min(len(one.identifier) for one in stones):
        remedy = "a shorter time step; look whether the container holds them"
        raise NotCredible(f"{lost} stones are lost", where=str(path), remedy=remedy)
    return stones


def gather_stones(form: Form, spheres: State, bodies: Frame) -> State:
    """One state of n stones from that of their spheres, m behind one another, and of the bodies.

    A contact keeps its row, between the stones then: two may touch more than once.  Forces of walls
    are sums over spheres.  Raises `NotCredible` unless each sphere is where its stone has it.
    """
    rows = bodies.values[np.argsort(bodies.values[:, 0])]
    identifier, count = rows[:, 0].astype(np.int64), len(form.radius)
    position, orientation, velocity, spin = np.split(rows[:, 1:14], (3, 7, 10), axis=1)
    radius = spheres.radius[::count] / form.radius[0]
    stones = State(
        identifier, position, radius, rows[:, 14].copy(), velocity, spin,
        time_step=spheres.time_step, orientation=orientation,
    )  # fmt: skip
    whole = len(spheres.radius) == count * len(rows)
    if whole:
        centre, _ = spread_spheres(form, stones)
        apart = np.linalg.norm(centre - spheres.position, axis=1).reshape(-1, count).max(axis=1)
        whole = bool((apart <= SHAPE_KEPT * radius).all())
    if not whole:
        raise NotCredible(
            f"{len(spheres.radius)} spheres are not where {len(rows)} stones of {count} have them "
            f"at step {spheres.time_step}", where=BODIES,
            remedy="a shorter time step; one process of the engine, without mpirun",
        )  # fmt: skip
    contacts = replace(
        spheres.contacts, pair=identifier[(spheres.contacts.pair - spheres.identifier[0]) // count]
    )
    walls = {
        name: force.reshape(-1, count, 3).sum(axis=1) for name, force in spheres.wall_force.items()
    }
    return replace(stones, contacts=contacts, wall_force=walls)
