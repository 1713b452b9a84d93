"""The preparation of a bed as its report shows it: Fig. 3 of the paper and its numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray, relative_density
from adapters.errors import UsageError
from adapters.files import read_frames
from adapters.procedure import Record, Track, sum_cost


@dataclass(frozen=True)
class PreparationFigures:
    """The settled bed before loading."""

    weight: float
    """All grains [N]."""
    apparent_weight: float
    """Force on the floor [N]."""
    coordination_grains: float
    coordination_with_walls: float
    coordination_without_rattlers: float
    rattler_share: float
    relative_density: float
    """Below nine tenths of the bed's height."""
    height: float
    """[m]"""
    energy_ratio: float
    """Translational kinetic over potential energy at the end."""
    energy_ratio_with_rotation: float
    duration: float
    """Simulated time [s]."""
    cpu_s: float


@dataclass(frozen=True)
class PreparationSeries:
    """The rain of grains in time: t instants, and f of the dumped frames."""

    time: FloatArray
    """[s], shape (t,)."""
    apparent_weight: FloatArray
    """[N], shape (t,)."""
    coordination_number: FloatArray
    """Contacts with other grains, shape (t,)."""
    translational: FloatArray
    """Translational kinetic over potential energy, shape (t,)."""
    rotational: FloatArray
    """Rotational kinetic over potential energy, shape (t,)."""
    frame_time: FloatArray
    """[s], shape (f,)."""
    relative_density: FloatArray
    """Below a fixed height, nine tenths of the settled bed's, shape (f,)."""


def measure_preparation(run: Track) -> PreparationFigures | None:
    """The settled bed; None while it is not settled."""
    outcome = run.preparation
    series = read_preparation_history(run)
    if outcome is None or series is None:
        return None
    figures = outcome.notes["figures"]
    coordination = figures["coordination"]
    potential = series["potential_J"][-1]
    still, spinning = series["kinetic_translational_J"][-1], series["kinetic_rotational_J"][-1]
    return PreparationFigures(
        weight=figures["weight"],
        apparent_weight=figures["apparent_weight"],
        coordination_grains=coordination["grains"],
        coordination_with_walls=coordination["with_walls"],
        coordination_without_rattlers=coordination["without_rattlers"],
        rattler_share=coordination["rattler_share"],
        relative_density=figures["relative_density"],
        height=figures["height"],
        energy_ratio=float(still / potential),
        energy_ratio_with_rotation=float((still + spinning) / potential),
        duration=float(series["time_s"][-1]),
        cpu_s=sum_cost(outcome.cost),
    )


def read_preparation_history(run: Track) -> dict[str, FloatArray] | None:
    """Columns of ``history.txt`` by the names in its header; None while there is no settled bed."""
    path = run.folder.path / "preparation" / "history.txt"
    if run.preparation is None or not path.exists():
        return None
    with path.open(encoding="utf-8") as stream:
        names = stream.readline().lstrip("# ").split()
        try:
            table = np.loadtxt(stream, ndmin=2)
        except ValueError as error:
            raise UsageError(f"this is no table of numbers ({error})", where=str(path)) from error
    return dict(zip(names, table.T, strict=True))


def read_preparation(record: Record) -> PreparationSeries | None:
    """Fig. 3 of the paper: the rain of grains in time."""
    run, container = record.run, record.scene.container
    history = read_preparation_history(run)
    if history is None:
        return None
    assert run.preparation is not None
    height = run.preparation.notes["density_height"]
    steps, times = history["step"], history["time_s"]
    time_step = times[-1] / steps[-1] if steps[-1] else record.scene.time_step
    frames = [
        (
            frame.time_step * time_step,
            relative_density(frame.block("x", "y", "z"), frame.column("radius"), container, height),
        )
        for frame in read_frames(run.folder.path / "preparation" / "rain.dump")
    ]
    frame_times, densities = np.array(frames).T
    return PreparationSeries(
        time=times,
        apparent_weight=history["floor_force_N"],
        coordination_number=history["coordination_number"],
        translational=history["kinetic_translational_J"] / history["potential_J"],
        rotational=history["kinetic_rotational_J"] / history["potential_J"],
        frame_time=frame_times,
        relative_density=densities,
    )
