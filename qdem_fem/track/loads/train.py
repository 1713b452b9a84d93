"""Load of a passing train on the rail seats of one sleeper: a made-up record, not a measured one.

The record of the paper's Fig. 5 is not published.  Axles move at constant speed over a rail that is
an infinite beam on a Winkler foundation (Zimmermann 1888; Hetenyi, Beams on Elastic Foundation,
1946, ch. 2), and a sleeper takes what the foundation carries over its share of the track.  That
holds the quasi-static load, to some tens of Hz; of wheel-rail dynamics only what a `WheelFlat` or
a `qdem_fem.track.loads.roughness.Roughness` names.

    trackbed train --flat 0 60e3 2e-3 --out train.csv
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, pi
from pathlib import Path

import numpy as np

from qdem_fem.files import ConditionError, Floats
from qdem_fem.track.loads.rail import QUIET, Track, find_seat_share, refuse_unless_positive
from qdem_fem.track.loads.rolling import find_rolling_forces
from qdem_fem.track.loads.roughness import Roughness
from trackbed.run_files import write_whole

RATE = 10_000.0  # samples a second of the paper's record (section 4) [Hz]
SEATS = ("rp1", "rp2")  # columns of the right and the left rail seat, named as in Fig. 5
MOST_SAMPLES = 10_000_000  # of a record [-]: 17 minutes at 10 kHz


@dataclass(frozen=True)
class Train:
    """Equal cars with two bogies of two axles each.

    Five cars of 20 m at 32 m/s pass in steps of 0.625 s, as the front axles of the paper's cars do
    (Fig. 7: 0.11, 0.73, 1.35, 1.98, 2.61 s); the other values are assumed.
    """

    cars: int = 5
    car_length: float = 20.0  # from one car to the next [m]
    bogie_distance: float = 13.8  # between the middles of the bogies of a car [m]
    axle_distance: float = 2.1  # between the axles of a bogie [m]
    axle_load: float = 100e3  # of both wheels [N]
    speed: float = 32.0  # [m/s]
    first_share: float = 0.5
    """Share of an axle load on the rail of seat 1; the paper's two rails differ [-]."""

    def __post_init__(self) -> None:
        refuse_unless_positive(self, "train")
        if not (self.axle_distance < self.bogie_distance < self.car_length):
            raise ConditionError(
                f"axles {self.axle_distance} m, bogies {self.bogie_distance} m and cars "
                f"{self.car_length} m apart do not nest",
                where="train", remedy="give axle_distance < bogie_distance < car_length",
            )  # fmt: skip
        if self.cars != int(self.cars) or not self.first_share < 1:
            raise ConditionError(
                f"{self.cars} cars, share {self.first_share} of the load on one rail",
                where="train", remedy="give a whole number of cars and a share below 1",
            )  # fmt: skip

    @property
    def wheel_loads(self) -> Floats:
        """Of an axle, on the rails of seat 1 and 2 [N], (2,)."""
        return self.axle_load * np.array([self.first_share, 1 - self.first_share])

    @property
    def length(self) -> float:
        """From the first axle to the last [m]."""
        return (self.cars - 1) * self.car_length + self.bogie_distance + self.axle_distance

    @property
    def axles(self) -> Floats:
        """Distance of each axle behind the first [m], (4 cars,)."""
        car = np.array([0.0, self.axle_distance])
        car = np.concatenate([car, self.bogie_distance + car])
        return (self.car_length * np.arange(self.cars)[:, None] + car).reshape(-1)


@dataclass(frozen=True)
class WheelFlat:
    """A flat on both wheels of one axle: a half-sine of force at every turn of the wheel.

    Peak and duration are given, not computed: they depend on speed and contact in ways that no
    short formula holds.
    """

    axle: int  # its number from 0, from the front
    peak: float  # of the added force of one wheel on the rail [N]
    duration: float  # [s]
    wheel_radius: float = 0.43  # [m]
    place: float = 0.0
    """Where on the rail one of the impacts begins, from the sleeper [m]; others follow at
    multiples of 2 pi times the radius."""


def find_seat_forces(
    time: Floats, train: Train, track: Track, flats: Sequence[WheelFlat] = ()
) -> Floats:
    """Force on seat 1 and 2 [N], (k, 2), the first axle being over the sleeper at ``time`` 0.

    Raises `ConditionError` as `find_flat_forces`.
    """
    front = train.speed * time
    total = np.zeros((len(time), 2))
    for axle in train.axles:
        total += np.outer(find_seat_share(front - axle, track), train.wheel_loads)
    if flats:
        total += find_flat_forces(front, train.axles, train.speed, track, flats)[:, None]
    return total


def find_flat_forces(
    front: Floats, axles: Floats, speed: float, track: Track, flats: Sequence[WheelFlat]
) -> Floats:
    """What flats add to the force on a rail seat [N], (k,), acting where their wheel is.

    ``front`` (k,): how far the first axle is past the sleeper [m]; ``axles`` (b,): distance of each
    behind the first [m].  Raises `ConditionError` for a flat on an axle that is not one of these,
    of no size, or longer than a turn of its wheel.
    """
    total = np.zeros(len(front))
    for flat in flats:
        turn = 2 * pi * flat.wheel_radius
        sound = isfinite(flat.peak) and 0 < flat.duration * speed <= turn < inf
        if not (flat.axle in range(len(axles)) and sound):
            raise ConditionError(
                f"a flat of {flat.peak} N for {flat.duration} s on axle {flat.axle}, radius "
                f"{flat.wheel_radius} m",
                where="train",
                remedy=f"use an axle from 0 to {len(axles) - 1}, and a duration above zero and "
                "no longer than a turn of the wheel",
            )
        place = front - axles[int(flat.axle)]
        since = np.mod(place - flat.place, turn) / speed
        force = np.where(since < flat.duration, flat.peak * np.sin(pi * since / flat.duration), 0.0)
        total += force * find_seat_share(place, track)
    return total


@dataclass(frozen=True, eq=False)
class LoadRecord:
    """Pressures sampled at an even rate."""

    time: Floats  # [s], (k,), growing evenly
    pressure: Floats
    """Pressure on seat 1 and 2 [Pa], (k, 2); negative where the rail lifts the sleeper."""

    @property
    def rate(self) -> float:
        """Samples a second [Hz]."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def make_train_record(
    train: Train, track: Track, area: float, flats: Sequence[WheelFlat] = (), rate: float = RATE,
    roughness: Roughness | None = None,
) -> LoadRecord:  # fmt: skip
    """The pressure on both seats of ``area`` [m^2] while the train passes, sampled at ``rate``.

    It begins and ends with the nearest axle `QUIET` elastic lengths and half a spacing away; time
    0 is the first sample.  ``roughness``: what rolling adds, too.
    """
    if not (0 < area < inf and 0 < rate < inf):
        raise ConditionError(f"area {area} m^2, rate {rate} Hz", where="train",
                             remedy="give numbers above zero")  # fmt: skip
    lead = (QUIET * track.elastic_length + track.spacing / 2) / train.speed
    last = 2 * lead + train.length / train.speed
    if not last * rate < MOST_SAMPLES:
        raise ConditionError(
            f"the train takes {last:.3g} s to pass, {last * rate:.3g} samples", where="train",
            remedy=f"give more speed or fewer cars: at most {MOST_SAMPLES} samples",
        )  # fmt: skip
    time = np.arange(int(np.ceil(last * rate)) + 1) / rate
    force = find_seat_forces(time - lead, train, track, flats)
    if roughness is not None:
        force += find_rolling_forces(
            time - lead, train.speed, train.axles, train.wheel_loads, track, roughness
        )
    return LoadRecord(time, force / area)


def write_load_record(path: str | os.PathLike[str], record: LoadRecord) -> None:
    """Write a table, atomically; times to 0.1 us, pressures to nine digits."""
    rows = zip(record.time, record.pressure, strict=True)
    lines = (f"{time:.7f},{one:.9g},{two:.9g}\n" for time, (one, two) in rows)
    write_whole(Path(path), f"time,{','.join(SEATS)}\n" + "".join(lines))
