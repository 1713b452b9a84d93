"""Damage to what an engine left in the folder of a stage, though it ended well."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from adapters.files import Frame, read_frames, write_dump

Damage = Callable[[Path], None]
"""Does something to the files of a stage, when the engine's process is through."""


def last_frame(change: Callable[[Frame], Frame]) -> Damage:
    """Change the last frame of ``states.dump``."""

    def damage(folder: Path) -> None:
        *before, last = read_frames(folder / "states.dump")
        write_dump(folder / "states.dump", [*before, change(last)])

    return damage


def with_value(column: str, value: float) -> Damage:
    """Another value for grain 7 in the last frame."""

    def change(frame: Frame) -> Frame:
        values = frame.values.copy()
        values[6, frame.columns.index(column)] = value
        return replace(frame, values=values)

    return last_frame(change)


def without_grain(frame: Frame) -> Frame:
    """A frame that lost grain 7."""
    return replace(frame, values=np.delete(frame.values, 6, axis=0))


def lost_from_the_start(folder: Path) -> None:
    """Grain 7 is in no frame."""
    frames = [without_grain(frame) for frame in read_frames(folder / "states.dump")]
    write_dump(folder / "states.dump", frames)


def cut(name: str, share: float) -> Damage:
    """A file cut at a share of its length, as on a full disk."""

    def damage(folder: Path) -> None:
        os.truncate(folder / name, int(share * (folder / name).stat().st_size))

    return damage


def gone(name: str) -> Damage:
    """A file that is not there."""
    return lambda folder: (folder / name).unlink()


def track_with(rows: slice, column: int, value: float) -> Damage:
    """Another value in rows of the piston's record."""

    def damage(folder: Path) -> None:
        lines = (folder / "piston.txt").read_text().splitlines()
        head = [line for line in lines if line.startswith("#")]
        body = [line.split() for line in lines[len(head) :]]
        for words in body[rows]:
            words[column] = str(value)
        (folder / "piston.txt").write_text("\n".join([*head, *map(" ".join, body)]) + "\n")

    return damage
