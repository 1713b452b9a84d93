"""The scene: what is simulated, in SI units, as the tables and keys of a scene file.

`adapters.scene.load_scene` reads a scene; ``trackbed/scenes/karrech.toml`` explains every key.
"""

from __future__ import annotations

from functools import cached_property
from math import ceil, inf, nan, sqrt
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from adapters import bed
from adapters.bed.stones import SPHERE, Form, find_form
from adapters.files import LoadSeries, read_load_series
from adapters.laws.fit import FIRST_WINDOW
from adapters.moves import DEFAULT as MOVE_DEFAULT
from adapters.scene.ballast import Stage, find_stored_radii, make_radii, read_stored_bed
from adapters.scene.checks import find_problems, find_warnings
from adapters.scene.materials import Material
from adapters.scene.mechanics import COUNT_GREATEST
from adapters.scene.values import flatten_keys
from trackbed.scene_files import GradingKey, NonNegative, Positive, Table, Text

TRACK_SAMPLES = 100
"""Least number of samples of the piston's record in a cycle."""
FLAT_WALLED = ("yade",)
"""Engines without a cylinder: planes tangent to it take its place."""

Share = Annotated[float, Field(ge=1e-6, le=1, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=COUNT_GREATEST)]
MEMBERS_MOST = 1000
"""Members of a run at most: the mean of so many is known to 5 % of what they differ by."""


class GrainRadius(Table):
    """Distribution of the grains' radii."""

    distribution: Literal["normal", "uniform", "constant"]  # of the radii by number
    mean: Positive  # mean radius [m]
    standard_deviation: NonNegative = 0.0
    """Of the normal distribution before it is cut, or of the uniform one [m]."""
    truncation: Annotated[float, Field(ge=0.1, le=10, allow_inf_nan=False)] = 2.0
    """Standard deviations of a normal distribution kept on either side of the mean [-]."""

    @property
    def law(self) -> bed.RadiusDistribution:
        """The distribution itself, with bounds and moments."""
        return bed.RadiusDistribution(
            self.distribution, self.mean, self.standard_deviation, self.truncation
        )


class Sample(Table):
    """The grains and the container they are poured into."""

    container: Literal["cylinder", "box"]  # its shape
    radius: Positive | None = None  # radius of the cylinder [m]
    size_x: Positive | None = None  # length of the box along x [m]
    size_y: Positive | None = None  # length of the box along y [m]
    symmetry: Annotated[tuple[Literal["x", "y"], ...], Field(strict=False)] = ()
    """Axes whose plane through the origin is a mirror."""
    count: Count | None = None  # number of grains
    fill_height: Positive | None = None  # height of the settled bed [m], instead of ``count``
    relative_density_start: Annotated[float, Field(ge=1e-3, le=0.15, allow_inf_nan=False)] = 0.05
    """Relative density of the random start, before the rain [-]."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 1  # seed of radii and start positions
    rain_friction: Positive | None = None
    """Coulomb's coefficient of all contacts while the bed rains [-]: less packs denser."""
    porosity: Annotated[float, Field(ge=0.2, le=0.6, allow_inf_nan=False)] | None = None
    """Share of voids in the middle of the bed [-], to which taps bring it after the rain."""
    grain_radius: GrainRadius | None = None
    grading: GradingKey | None = None
    """Grading by a standard's name, or sieves [mm] with the mass that passes [%], instead."""
    grading_scale: Positive | None = None  # factor on all sieves of ``grading`` [-]; 1
    form: Text | None = None
    """Form of the grains, a name or a file (`adapters.bed.stones.find_form`); radii and sieves are
    those of the sphere of the same volume.  None: spheres."""

    state: Text | None = None
    """File or run folder of a saved bed (`adapters.files.read_state_file`), in place of the rain:
    its places and radii, at rest; a relative path counts from the scene file's folder."""

    @property
    def radii(self) -> bed.Radii:
        """Radii of the grains, with their bounds and moments."""
        if self.state is not None:
            return find_stored_radii(self.state)
        if self.grading is not None:
            return make_radii(self.grading, self.grading_scale)
        assert self.grain_radius is not None
        return self.grain_radius.law


class Loading(Table):
    """The cyclic load on the piston."""

    waveform: Literal["sine", "series"] = "sine"  # of the stress over time
    amplitude: Positive | None = None  # stress from trough to peak [Pa] of a sine
    mean: NonNegative | None = None  # mean stress [Pa] of a sine
    frequency: Positive | None = None  # cycles a second [Hz] of a sine
    series: str | None = None  # CSV file with one period; `adapters.files.load_series`
    area_share: Share = 1.0  # part of the section under the piston [-]
    footprint: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None
    """Lengths along x and y of a rectangle in a box that is loaded instead [m]."""
    crib: Positive | None = None
    """Height of the ballast beside that rectangle [m], whose weight lies on the bed there."""
    stage: Annotated[tuple[Stage, ...], Field(strict=False, min_length=1)] | None = None
    """Loads that follow this one, in the order of their first cycles."""
    piston_mass: Positive  # mass [kg] of the part of the piston inside the scene

    @cached_property
    def samples(self) -> LoadSeries | None:
        """The series; None for a sine."""
        return None if self.series is None else read_load_series(Path(self.series))

    @property
    def period(self) -> float:
        """Duration of a cycle [s]."""
        if self.samples is not None:
            return self.samples.period
        assert self.frequency is not None
        return 1 / self.frequency

    def stress_at(self, phase: float | bed.FloatArray) -> bed.FloatArray:
        """Stress [Pa] on the loaded area at a ``phase`` in cycles (any real number).

        A sine is mean - amplitude/2 cos(2 pi phase): its troughs are at whole cycles.
        """
        if self.samples is not None:
            return self.samples.stress_at(phase)
        assert self.mean is not None
        assert self.amplitude is not None
        return np.asarray(self.mean - self.amplitude / 2 * np.cos(2 * np.pi * np.asarray(phase)))


class Procedure(Table):
    """Numbers of cycles computed and jumped (Fig. 10 of the paper)."""

    name: Literal["paper", "growing", "tolerance"] | None = None
    """What the other keys follow from, where they are not given: `adapters.scene.procedures`."""
    k_i: Annotated[int, Field(ge=1)]  # first cycles, computed before anything is fitted
    k: Annotated[int, Field(ge=2)] | None = None  # cycles computed and fitted before each jump
    h: (
        Annotated[
            tuple[Annotated[int, Field(ge=0)], ...],
            BeforeValidator(lambda value: [value] if type(value) is int else value),
            Field(strict=False, min_length=1),
        ]
        | None
    ) = None
    """Cycles of the first, second, ... jump; the last repeats; 0 resubmits without a jump."""
    tolerance: Annotated[float, Field(ge=1e-9, le=0.5, allow_inf_nan=False)] | None = None
    """Error of the settlement gained in a jump over all settlement [-], instead of k and h."""
    healing_cycles: Annotated[int, Field(ge=0)] = 5
    """Cycles computed after a jump and kept out of the fit."""
    law: str = "log"  # law of the residual displacement
    move: str = MOVE_DEFAULT  # what a jump moves: a way of `adapters.moves`
    settlement: Literal["law", "history"] = "law"
    """What the mean grain settles by in a jump of h cycles: its law, or all cycles computed."""
    seating: Literal["any", "waits"] = "any"
    """Whether the k_i first cycles count from where the bed carries the piston."""
    seating_cycles: Annotated[int, Field(ge=1)] | None = None
    """Where they do and a piston hung: cycles that count in place of k_i; k_i where not given."""
    jammed: Literal["less"] = "less"
    """Where a jump by history finds no room, it moves the bed by less: older scenes say so."""
    relaxation: str = "smallest-move"
    """How a moved bed gets rid of its overlaps: of `adapters.relaxation.methods.METHODS`, or
    "none"."""
    total_cycles: Count  # cycles computed and jumped at the end
    members: Annotated[int, Field(ge=1, le=MEMBERS_MOST)] = 1
    """Runs from states after k_i cycles that differ by chance alone: the result is over them."""

    @model_serializer(mode="wrap")
    def _drop_newer_defaults(self, whole: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Stored runs are older than these keys: at their defaults they are left out.  How many
        runs there are is no parameter of any of them: always left out."""
        newer = {"name": None, "move": MOVE_DEFAULT, "tolerance": None, "settlement": "law"}
        newer |= {"seating": "any", "seating_cycles": None, "jammed": "less"}
        record: dict[str, Any] = whole(self)
        newer["members"] = record["members"]
        return {k: value for k, value in record.items() if k not in newer or value != newer[k]}

    def jump_cycles(self, jump: int) -> int:
        """Cycles of jump number ``jump`` = 0, 1, ...; 0 where the jumps choose themselves."""
        return self.h[min(jump, len(self.h) - 1)] if self.h else 0

    @property
    def carried_cycles(self) -> int:
        """Cycles that the bed carries its piston before windows are fitted, where runs wait."""
        return self.seating_cycles or self.k_i

    @property
    def window_cycles(self) -> int:
        """Cycles of the first window that is fitted."""
        return FIRST_WINDOW if self.k is None else self.k


class Engine(Table):
    """The engine and its time step."""

    name: str = "auto"
    """Engine; ``auto`` is the first that is installed: liggghts, lammps, yade; ``fake`` writes
    analytic states, for tests."""
    time_step: Positive | None = None  # longest time step [s]
    rayleigh_share: Share | None = None
    """Longest time step over the smallest grain's Rayleigh time [-], instead; or "fast"."""
    launcher: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Field(strict=False)] = ()
    """Words before the engine's command line, such as ("mpirun", "-np", "4")."""


class Scene(Table):
    """All of a scene.  Raises pydantic's ValidationError unless every check holds."""

    sample: Sample
    material: Material
    loading: Loading | None = None
    procedure: Procedure | None = None
    engine: Engine

    @model_validator(mode="after")
    def _check(self) -> Scene:
        problems = find_problems(flatten_keys(self.model_dump(exclude_none=True)))
        if problems:
            text = "; ".join(f"{problem.key}: {problem.what}" for problem in problems)
            raise PydanticCustomError("scene", "{text}", {"text": text})
        return self

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is allowed but doubtful."""
        return tuple(
            f"{problem.key}: {problem.what}"
            for problem in find_warnings(flatten_keys(self.model_dump(exclude_none=True)))
        )

    @cached_property
    def form(self) -> Form:
        """Form of the grains."""
        return find_form(self.sample.form)

    @property
    def stones(self) -> bool:
        """Whether grains are no spheres but bodies of several."""
        return self.form is not SPHERE

    @property
    def container(self) -> bed.Container:
        """The container's geometry, as the scene's engine has it."""
        sample = self.sample
        sides = 0
        if sample.radius is not None and self.engine.name in FLAT_WALLED:
            sides = bed.count_sides(sample.radius, sample.radii.mean)
        given = (sample.radius, sample.size_x, sample.size_y)
        radius, size_x, size_y = (nan if size is None else size for size in given)
        return bed.Container(sample.container, sample.symmetry, radius, size_x, size_y, sides)

    @property
    def loaded_area(self) -> float:
        """Area under the piston [m^2]; 0 without loading."""
        if self.loading is None or self.loading.footprint is None:
            return 0.0 if self.loading is None else self.loading.area_share * self.container.area
        return self.loading.footprint[0] * self.loading.footprint[1]

    @property
    def piston_edges(self) -> tuple[float, float, float, float]:
        """Ends along x, then along y, of a rectangular piston [m]; infinite where it has none."""
        if self.loading is None or self.loading.footprint is None:
            return bed.WHOLE
        return self.container.place_footprint(self.loading.footprint)

    def walls(self, piston_height: float) -> bed.Walls:
        """All walls of the bed, the piston at a height [m] among them."""
        return self.container.walls(piston_height, self.piston_reach, self.piston_edges)

    @property
    def piston_reach(self) -> float:
        """Radius of a piston that covers a part of a cylinder [m]; inf when it covers all."""
        if self.loading is None or self.loading.area_share == 1:
            return inf
        return self.container.radius * sqrt(self.loading.area_share)

    @property
    def restitution(self) -> float:
        """Coefficient of restitution, from ``viscous_alpha`` where that is given."""
        grain = self.material.grain
        if grain.restitution is not None:
            return grain.restitution
        assert grain.viscous_alpha is not None
        return bed.contact_law.find_restitution(grain.viscous_alpha)

    @property
    def stiffness(self) -> bed.contact_law.HertzStiffness:
        """Equivalent moduli of grains, walls and mirror planes."""
        grain, wall = self.material.grain, self.material.wall
        return bed.contact_law.make_hertz_stiffness(
            grain.young, grain.poisson, wall.young, wall.poisson
        )

    @property
    def rayleigh_time(self) -> float:
        """Rayleigh time [s] of the smallest sphere that the radius distribution allows."""
        grain = self.material.grain
        return bed.contact_law.find_rayleigh_time(
            self.form.least * self.sample.radii.smallest, grain.density, grain.young, grain.poisson
        )

    @property
    def time_step(self) -> float:
        """Time step [s]: the longest the engine table allows that divides the load's period.

        With a load series it divides the interval between two samples.  A cycle has a multiple
        of `TRACK_SAMPLES` steps, so that the piston's record holds its end, and in each stage of a
        load as many: cycles begin at multiples of them.
        """
        if self.engine.time_step is not None:
            longest = self.engine.time_step
        else:
            assert self.engine.rayleigh_share is not None
            longest = self.engine.rayleigh_share * self.rayleigh_time
        if self.loading is None:
            return longest
        interval = self.loading.period / self.samples_per_cycle
        periods = [1 / stage.frequency for stage in self.loading.stage or ()]
        slowest = max([interval, *(period / self.samples_per_cycle for period in periods)])
        return interval / ceil(slowest / longest * (1 - 1e-12))

    @property
    def steps_per_cycle(self) -> int:
        """Time steps of one load cycle; 0 without loading."""
        return 0 if self.loading is None else round(self.loading.period / self.time_step)

    @property
    def samples_per_cycle(self) -> int:
        """Samples of the piston's record in a cycle; a load sample falls on one of them."""
        samples = None if self.loading is None else self.loading.samples
        intervals = 1 if samples is None else len(samples.time) - 1
        return intervals * ceil(TRACK_SAMPLES / intervals)

    @property
    def grain_count(self) -> int:
        """Number of grains; from ``fill_height`` or a saved bed where that is given."""
        if self.sample.state is not None:
            return len(read_stored_bed(self.sample.state).radius)
        if self.sample.count is not None:
            return self.sample.count
        assert self.sample.fill_height is not None
        return bed.expect_grains(self.sample.radii, self.container, self.sample.fill_height)

    def stress_at(self, phase: float | bed.FloatArray) -> bed.FloatArray:
        """Stress [Pa] on the loaded area at a ``phase`` in cycles; 0 without loading."""
        if self.loading is None:
            return np.zeros_like(np.asarray(phase, float))
        return self.loading.stress_at(phase)
