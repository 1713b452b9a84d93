"""The load of one bogie on the rail seat of a slice, from `qdem_fem.track.loads.train`, or a
record."""

from collections.abc import Sequence

import numpy as np

from qdem_fem.files import ConditionError, Series
from qdem_fem.track import loads

DOWN = np.array([0.0, 0.0, -1.0])
RISE = 0.01
"""Time over which the load of a bogie that is still far begins and ends [s]."""


def make_bogie_series(
    train: loads.Train, track: loads.Track, share: float, lead: float, rest: float,
    rate: float = loads.RATE, roughness: loads.Roughness | None = None,
    flats: Sequence[loads.WheelFlat] = (),
) -> Series:  # fmt: skip
    """Force on the seat of a slice while the first bogie of a train passes [N], (k, 3), down.

    The front axle begins ``lead`` [m] before the sleeper and the rear one ends as far behind it,
    then ``rest`` [s] of no load; at both ends the force grows and dies over `RISE` as half a
    cosine.  ``share``: of a seat's force, what the slice takes of it; ``roughness``: what rolling
    adds to it, too; ``flats``: on both wheels of one of these two axles.  Raises `ConditionError`
    as `find_flat_forces` and `find_rolling_forces`, for a bogie so near and fast that it is over
    the sleeper before its load has grown, and for one so slow or far that no record would hold it.
    """
    axles = train.axles[:2]
    end = find_passing_time(train, lead)
    if lead < RISE * train.speed:
        raise ConditionError(
            f"from {lead:g} m before the sleeper it is there before its load has grown, within "
            f"{RISE:g} s", where="bogie",
            remedy=f"give a lead of {RISE * train.speed:.3g} m or more, or less speed",
        )  # fmt: skip
    if not (end + rest) * rate < loads.MOST_SAMPLES:
        raise ConditionError(
            f"it passes and rests for {end + rest:.3g} s, {(end + rest) * rate:.3g} samples",
            where="bogie",
            remedy=f"give more speed, less lead or less rest: at most {loads.MOST_SAMPLES} samples",
        )
    time = np.arange(int(np.ceil((end + rest) * rate)) + 1) / rate
    front = train.speed * time - lead
    of_wheels = sum(loads.find_seat_share(front - axle, track) for axle in axles)
    ramp = np.clip(np.minimum(time, end - time) / RISE, 0.0, 1.0)
    force = train.first_share * train.axle_load * of_wheels
    if roughness is not None:
        force += loads.find_rolling_forces(
            time - lead / train.speed, train.speed, axles, train.wheel_loads[:1], track, roughness
        )[:, 0]
    if flats:
        force += loads.find_flat_forces(front, axles, train.speed, track, flats)
    return Series(time, np.outer(share * force * (1 - np.cos(np.pi * ramp)) / 2, DOWN))


def find_passing_time(train: loads.Train, lead: float) -> float:
    """From the front axle ``lead`` [m] before the sleeper to the rear one as far behind it [s]."""
    return float(2 * lead + train.axles[1]) / train.speed
