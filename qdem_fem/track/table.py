"""The table ``[track]`` of a scene: its keys, what they demand of one another, its loads.

``trackbed/scenes/track-small.toml`` explains every key.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from qdem_fem.bodies import Rigid
from qdem_fem.files import Series
from qdem_fem.tables import Cells, MaterialTable, SeriesTable, Share, make_series
from qdem_fem.track.bogie import DOWN, find_passing_time, make_bogie_series
from qdem_fem.track.layout import Part
from qdem_fem.track.loads import RailKind, Roughness, Track, Train, WheelFlat, WheelKind
from qdem_fem.track.sleeper_mesh import SleeperShape
from trackbed.scene_files import NonNegative, Positive, Problem, Real, Table, Text

LEAST_SHOULDER = 0.1
"""Ballast beyond a free end, at least [m]: room for a grain and what is between."""


class RoughnessTable(Table):
    """Of wheels and rail (`qdem_fem.track.loads.roughness.Roughness`)."""

    rail: RailKind = "smooth"  # its spectrum
    wheel: WheelKind = "disc"  # by its brakes
    seed: Annotated[int, Field(ge=0)] = 1  # of the phases
    amplitude: NonNegative = 1.0  # factor on all heights [-]
    highest: Positive = 2000.0  # frequency up to which there is any [Hz]


class FlatTable(Table):
    """On both wheels of an axle (`qdem_fem.track.loads.train.WheelFlat`), as ``trackbed train
    --flat``."""

    axle: Annotated[int, Field(ge=0)]  # 0 in front, 1 behind
    peak: Real  # of the added force of one wheel on the rail [N]
    duration: Positive  # [s]; the same at every turn of the wheel


class BogieTable(Table):
    """The first bogie of a train (`qdem_fem.track.loads.train`)."""

    axle_load: Positive = 100e3  # of both wheels [N]
    speed: Positive = 32.0  # of the train [m/s]
    lead: Positive = 3.0
    """From the front axle to the sleeper at first, from it to the rear axle at last [m]."""
    rest: NonNegative = 0.05  # time without load at the end [s]
    roughness: RoughnessTable | None = None
    """What rolling adds; without it the load has next to nothing above 100 Hz."""
    flat: Annotated[tuple[FlatTable, ...], Field(strict=False)] = ()  # of wheels that are not round

    @property
    def train(self) -> Train:
        """Whose first bogie it is."""
        return Train(cars=1, axle_load=self.axle_load, speed=self.speed)

    @property
    def passing(self) -> float:
        """Time from its beginning to the end of its load [s]."""
        return find_passing_time(self.train, self.lead)


class TrackTable(Table):
    """Grains, a sleeper or part of it on them, and a load on its rail seats."""

    part: Part = "slice"
    """Of a sleeper: a slice at a rail seat, half of it with a free end, or the whole."""
    length: Positive  # of the track that is computed, along the sleeper [m]
    width: Positive  # along the track, from one middle between sleepers to the next [m]
    below: Annotated[int, Field(ge=1, le=100_000)]  # grains below the sleeper
    beside: Annotated[int, Field(ge=1, le=100_000)]  # grains that fill the cribs
    seed: Annotated[int, Field(ge=0)] = 1  # of the grains
    sizes: Annotated[tuple[Positive, Positive], Field(strict=False)] = (0.026, 0.034)
    """Least and greatest sieve size of the grains' meshes [m]; spheres make them larger."""
    cells: Cells  # of the sleeper's mesh, along, across and up
    shoulder: Annotated[tuple[NonNegative, Positive], Field(strict=False)] | None = None
    """How far the flat top of the ballast and how far its foot reach beyond a free end [m]; by
    default ballast reaches to the wall."""
    share: Positive | None = None
    """Part of the force on a rail seat that a slice takes [-]; other parts take all."""
    ballast: MaterialTable
    sleeper: MaterialTable
    side_friction: NonNegative = 0.0
    """Of the walls at the sides [-]; without it they are planes of symmetry."""
    bed: Text  # file of the prepared bed, made where it is not there; relative to the scene file
    prepared_friction: NonNegative | None = None
    """Friction that the bed is prepared with [-]; by default that of the contact."""
    rigid: Rigid = False
    """Whether grains are rigid in the run, and with which inertia; the bed is the same."""
    softness: Share = 1e-4  # of the springs while grains fall, over those of the run [-]
    unbalanced: Share = 0.05  # force out of balance over mean contact force [-]
    kinetic: Share = 0.01  # kinetic energy over elastic [-]
    loose: Share = 0.02  # bodies out of balance over all [-]
    """Greatest shares of `qdem_fem.march.kinetic_damping.Rest` that are equilibrium."""
    stays: Positive = 0.2
    """Greatest share of the sleeper's way under a slow pulse of the load's greatest force that may
    be left at rest, down or aside [-]: four fifths spring back."""
    patience: Positive = 5.0
    """Simulated time after which a stage of the preparation is given up [s]."""
    pressure: SeriesTable | None = None
    """Pressure on the rail seat [Pa], as the paper's record; or a bogie."""
    pressure_other: SeriesTable | None = None
    """On the other rail seat of a whole sleeper; by default the same."""
    seat_area: Positive = 0.13 * 0.17  # of the pressure [m^2]
    bogie: BogieTable | None = None


def find_track_faults(track: TrackTable) -> Iterator[Problem]:
    """What keys of the table demand of one another."""
    if (track.pressure is None) == (track.bogie is None):
        yield Problem("track", "give one of pressure, bogie")
    if not track.sizes[0] < track.sizes[1]:
        yield Problem("track.sizes", "the second must be the greater one")
    if track.part == "slice":
        if track.share is None:
            yield Problem("track.share", "missing: what the slice takes of the force on the seat")
        if track.shoulder is not None:
            yield Problem("track.shoulder", "a slice has no free end")
    elif track.share is not None:
        yield Problem("track.share", f"a {track.part} sleeper takes all of the force on a seat")
    if track.pressure_other is not None and (track.part != "whole" or track.pressure is None):
        yield Problem("track.pressure_other", "only a whole sleeper has it, beside pressure")
    if track.part == "slice":
        return
    ends = {"half": 1, "whole": 2}[track.part]
    flat, foot = track.shoulder or (0.0, LEAST_SHOULDER)
    if not flat < foot:
        yield Problem("track.shoulder", "the foot, the second, must lie farther out than the top")
    needed = ends * (SleeperShape().length / 2 + foot)
    if track.length < needed:
        what = f"a {track.part} sleeper and the ballast beyond it need {needed:.4g} m"
        yield Problem("track.length", what)
    if track.cells[0] < 3 * ends:
        yield Problem("track.cells", f"at least {3 * ends} along")


def make_seat_loads(track: TrackTable, folder: Path) -> tuple[Series, ...]:
    """Force on each rail seat over time [N], (k, 3)."""
    share, seats = track.share or 1.0, 2 if track.part == "whole" else 1
    if track.bogie is not None:
        one = track.bogie
        rough = None if one.roughness is None else Roughness(**one.roughness.model_dump())
        flats = [WheelFlat(**flat.model_dump()) for flat in one.flat]
        series = make_bogie_series(
            one.train, Track(), share, one.lead, one.rest, roughness=rough, flats=flats
        )
        return seats * (series,)
    found: list[Series] = []
    for name in ("pressure", "pressure_other")[:seats]:
        table = getattr(track, name)
        if table is None:
            found += found
            continue
        given = make_series(table, f"track.{name}", folder, vector=False)
        found.append(Series(given.times, np.outer(share * track.seat_area * given.values, DOWN)))
    return tuple(found)
