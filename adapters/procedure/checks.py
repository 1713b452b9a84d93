"""Validators: whether what an engine left is credible.  An exit code proves nothing."""

from dataclasses import asdict, dataclass, fields
from math import nan, pi, sqrt

import numpy as np

from adapters.bed import GRAVITY, OVERLAP_BOUND, FloatArray, State, find_sample_mass
from adapters.bed.stones import find_kinetic_energies, find_touching
from adapters.errors import EngineFailed, NotCredible
from adapters.files import Window
from adapters.scene import DOUBTFUL, Scene, estimate_swing


@dataclass(frozen=True)
class BoundNumbers:
    """What is credible of a piston's force and of a jump's rise."""

    force_error: float = 0.25  # greatest rms of force minus target in a cycle over its peak [-]
    force_error_goal: float = 0.03  # the same, as the report's goal [-]
    force_start_cycles: int = 3  # in which the piston finds the bed: its force is not judged
    rise_floor: float = 1e-3  # less of the mean radius hurts nothing, whatever the window shows [-]


BOUNDS = BoundNumbers()


@dataclass(frozen=True)
class WindowFigures:
    """The figures that are judged."""

    overlap_share: float  # greatest overlap over the smallest radius, all cycle ends
    energy_share: float
    """Greatest kinetic energy at a cycle end over the grains' weight times their mean radius."""
    move_share: float  # greatest mean move of the grains in one cycle over their mean radius
    force_error: float
    """Greatest rms force error of the piston after the first cycles; nan in a short window."""
    own_frequency: float  # sqrt(k/m) of the piston on its bed over the load's; nan where unknown


def check_complete(scene: Scene, window: Window, cycles: int) -> None:
    """All instants and all grains are there, the piston too, and every number is finite.

    Raises `EngineFailed` for missing instants, `NotCredible` for lost grains and nan.
    """
    if len(window) != cycles or np.any(np.diff(window.time_step) != scene.steps_per_cycle):
        raise EngineFailed(
            f"{len(window)} of {cycles} cycle ends were written", where="states.dump",
            remedy="the engine ended early; resume computes the window again",
        )  # fmt: skip
    lost = np.setdiff1d(np.arange(1, scene.grain_count + 1), window.identifier)
    if len(lost):
        raise NotCredible(
            f"{len(lost)} grains are lost: {', '.join(map(str, lost[:10]))}", where="states.dump",
            remedy="a shorter time step; look whether the container holds them",
        )  # fmt: skip
    for name in ("position", "velocity", "spin"):
        bad = ~np.isfinite(getattr(window, name)).all(axis=(1, 2))
        if bad.any():
            raise NotCredible(
                f"{name} is not finite from cycle {window.cycle[bad][0]} on", where="states.dump",
                remedy="a shorter time step; grains may share one centre",
            )  # fmt: skip
    track = window.piston
    if not np.isin(window.time_step[1:], track.time_step).all():
        raise EngineFailed(
            f"the piston's record ends at step {track.time_step.max(initial=0)}, "
            f"the window at {window.time_step[-1]}",
            where="piston.txt", remedy="the engine ended early; resume computes the window again",
        )  # fmt: skip
    finite = np.isfinite([getattr(track, f.name) for f in fields(track)]).all(axis=0)
    if not finite.all():
        raise NotCredible(
            f"the piston's record is not finite from step {track.time_step[~finite][0]} on",
            where="piston.txt", remedy="a shorter time step, or a heavier piston",
        )  # fmt: skip


def check_state(scene: Scene, state: State) -> None:
    """A settled bed holds all its grains, finite and inside; raises `NotCredible`."""
    lost = scene.grain_count - len(state.identifier)
    if lost:
        raise NotCredible(
            f"{lost} of {scene.grain_count} grains are lost", where="preparation",
            remedy="a shorter time step, a looser start (sample.relative_density_start); look "
            "whether the container holds them",
        )  # fmt: skip
    if not np.isfinite(state.position).all():
        raise NotCredible(
            "a position of the settled bed is not finite", where="preparation",
            remedy="a shorter time step",
        )  # fmt: skip
    touching = find_touching(scene.form, state, scene.container.walls())
    radius = float(state.radius.min()) * scene.form.usual
    share = float(touching.overlap.max(initial=0.0)) / radius
    if not share <= OVERLAP_BOUND:
        raise NotCredible(
            f"the greatest overlap of the settled bed is {share:.3g} of the smallest radius",
            where="preparation", remedy="a shorter time step, or stiffer grains",
        )  # fmt: skip


def measure(scene: Scene, window: Window) -> WindowFigures:
    """The figures of `check_bounds`."""
    walls = scene.container.walls()
    # From the positions, not from the engine's list of contacts: it cannot hide one.
    states = [window.state(index) for index in range(1, len(window.position))]
    overlaps = [find_touching(scene.form, one, walls).overlap.max(initial=0.0) for one in states]
    kinetic = [sum(find_kinetic_energies(scene.form, one)) for one in states]
    # The first state after a jump is at rest and not the engine's work: it is not judged.
    move = np.linalg.norm(np.diff(window.position, axis=0), axis=2).mean(axis=1)
    force_error = window.piston.force_error(scene.steps_per_cycle)[BOUNDS.force_start_cycles :]
    return WindowFigures(
        float(max(overlaps)) / (float(window.radius.min()) * scene.form.usual),
        float(max(kinetic) / (GRAVITY * np.sum(window.mass) * window.radius.mean())),
        float(move.max() / window.radius.mean()),
        float(force_error.max()) if len(force_error) else nan,
        find_own_frequency(scene, window),
    )


def find_own_frequency(scene: Scene, window: Window) -> float:
    """Frequency sqrt(k/m)/2 pi of the piston on its bed over the load's [-]: undamped it misses its
    load by 1 in that number squared, less one.  nan where the bed never gave way."""
    assert scene.loading is not None  # it would have no piston
    known = window.piston.stiffness(scene.steps_per_cycle)
    known = known[np.isfinite(known)]
    if not len(known):
        return nan
    return sqrt(np.median(known) / scene.loading.piston_mass) * scene.loading.period / (2 * pi)


def check_bounds(scene: Scene, figures: WindowFigures) -> None:
    """Overlaps, energies, moves and the piston's force are bounded; raises `NotCredible`."""
    share = scene.time_step / scene.rayleigh_time
    remedy = f"the time step is {share:.3g} of the Rayleigh time; " + (
        "shorten it below 0.2" if share > 0.2 else "look at the scene's load and stiffness"
    )
    if figures.force_error > BOUNDS.force_error:
        remedy += f"; {advise_other_piston(scene, figures.own_frequency)}"
    bounds = (
        ("the greatest overlap over the smallest radius", figures.overlap_share, OVERLAP_BOUND),
        ("kinetic energy over weight times radius at a cycle end", figures.energy_share, 1.0),
        ("the mean move in one cycle over the radius", figures.move_share, 1.0),
        ("the piston's rms force error over the peak", figures.force_error, BOUNDS.force_error),
    )
    for what, value, bound in bounds:
        if value > bound:  # nan, which stands for "not judged", passes
            raise NotCredible(f"{what} is {value:.3g}, above {bound:g}", remedy=remedy)


def advise_other_piston(scene: Scene, own_frequency: float) -> str:
    """What to do with a piston that does not follow its load: a light one bounces from grain to
    grain, a heavy one swings on its bed, ``own_frequency`` times as fast as the load."""
    assert scene.loading is not None  # it would have no piston
    radius = np.array([scene.sample.radii.mean])
    grains = scene.loading.piston_mass / find_sample_mass(radius, scene.material.grain.density)[0]
    why, other = f"as heavy as {grains:.2g} mean grains", "heavier"
    times = np.fmin(own_frequency, estimate_swing(scene))  # a piston too heavy shows none
    if times < DOUBTFUL.own_frequency:
        why, other = f"swinging on its bed {times:.2g} times as fast as the load", "lighter"
    return (
        f"the piston, {why}, does not follow its load: a {other} one (loading.piston_mass), or a "
        "lower loading.frequency"
    )


def check_rise(scene: Scene, height: FloatArray, rise: FloatArray) -> None:
    """A jump does not lift a loaded bed by more than it moved in all of the jump's window.

    ``height`` (k+1, n) [m] of the grains at the ends of the window's cycles, ``rise`` (n,) [m] of
    each in the jump; medians are compared, as a loose grain may be thrown up.  A law that is fitted
    to the noise of a few cycles may lift the bed.  Raises `NotCredible`.
    """
    moved = float(np.ptp(np.median(height - height[0], axis=1)))
    lift = float(np.median(rise))
    if lift > max(moved, BOUNDS.rise_floor * scene.sample.radii.mean):
        raise NotCredible(
            f"the law lifts the bed by {lift * 1e6:.4g} um in the jump, where it moved by"
            f" {moved * 1e6:.4g} um in all of the {len(height) - 1} cycles fitted",
            remedy="fit more cycles (procedure.k), jump less far (procedure.h), or let jumps"
            " choose themselves (procedure.tolerance)",
        )


def check_window(scene: Scene, window: Window, cycles: int) -> dict[str, float]:
    """All checks of a window; returns the figures judged, for the record."""
    check_complete(scene, window, cycles)
    figures = measure(scene, window)
    check_bounds(scene, figures)
    return asdict(figures)
