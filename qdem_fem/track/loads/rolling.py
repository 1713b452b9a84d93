"""What rolling adds to the load of a train: rough wheels on a rough rail, in linear theory.

A wheel (its unsprung mass) and a rail (an infinite beam on pads, sleepers and ballast) are pushed
apart by the roughness r between them; a Hertz spring, made linear at the wheel load, joins them:

    F(f) = r(f) H_c(f) / (alpha_wheel + alpha_contact + alpha_rail)

with receptances alpha [m/N] (Remington, J. Sound Vib. 46, 1976, 359-379; Grassie, Gregory,
Harrison, Johnson, J. Mech. Eng. Sci. 24, 1982, 77-90; Thompson, Railway Noise and Vibration, 2009,
ch. 2, 3, 5).  F is positive where wheel and rail are pressed together, r where metal is added.
What a rail seat takes of F is in closed form too; at f = 0 it is `find_seat_share`.

A strip of roughness is pulled between a wheel and a rail that stand still; the wheel's place moves
on slowly against the waves in the rail (32 m/s against some hundreds).  Not for frequencies above
some 2 kHz: the wheel's modes, shear in the rail and the distance of sleepers are not in it; nor for
roughness at which a wheel leaves the rail, which is refused.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from qdem_fem.files import ConditionError, Floats
from qdem_fem.track.loads.rail import QUIET, Track, refuse_unless_positive
from qdem_fem.track.loads.roughness import (
    RAIL,
    WHEEL,
    ComplexArray,
    Roughness,
    draw_roughness_lines,
    find_contact_filter,
)

Response = Callable[[Floats], ComplexArray]

STEEL_MODULUS = 206e9 / (2 * (1 - 0.3**2))
"""E* of steel on steel [Pa]."""
FREQUENCIES_AT_ONCE = 128
"""Frequencies taken at once, for the memory."""
MOST_WORK = 2e10
"""Samples times frequencies of one rail: some minutes."""


@dataclass(frozen=True)
class Rolling:
    """One wheel and what its rail lies on; assumed but for the rail, 50N as in `Track`."""

    unsprung: float = 600.0  # mass of one wheel with its share of the axle [kg]
    wheel_radius: float = 0.43  # [m]
    head_radius: float = 0.3  # of the rail's head, across [m]
    rail_mass: float = 50.4  # [kg/m]
    pad: float = 225e6  # stiffness of a rail pad [N/m]
    pad_loss: float = 0.25
    sleeper: float = 84.0  # mass of half a sleeper [kg]
    ballast_loss: float = 1.0
    """Loss factors [-]; the ballast's stiffness follows from `Track.modulus`."""

    def __post_init__(self) -> None:
        refuse_unless_positive(self, "rolling")


def find_hertz_contact(load: float, rolling: Rolling) -> tuple[float, float]:
    """Radius a of the contact [m] and its stiffness dP/d delta = 2 E* a [N/m] at a wheel load [N].

    Hertz for a sphere of the geometric mean R of both radii: a^3 = 3 P R/(4 E*).
    """
    radius = (rolling.wheel_radius * rolling.head_radius) ** 0.5
    size = (3 * load * radius / (4 * STEEL_MODULUS)) ** (1 / 3)
    return size, 2 * STEEL_MODULUS * size


def find_foundation_stiffness(frequency: Floats, track: Track, rolling: Rolling) -> ComplexArray:
    """s(f) [N/m^2], (m,): force a metre over deflection of the rail, s = s_p (s_b - w^2 m)/(s_p +
    s_b - w^2 m) of pads, and ballast under sleepers spread along the rail (Thompson, sec. 3.3).

    Without losses s(0) = `Track.modulus`.  Raises `ConditionError` for pads softer than that.
    """
    pads = rolling.pad / track.spacing
    if not pads > track.modulus:
        raise ConditionError(
            f"pads of {rolling.pad:g} N/m are softer than the track's {track.modulus:g} N/m^2",
            where="rolling", remedy="give stiffer pads or a lower modulus",
        )  # fmt: skip
    ballast = (1 + 1j * rolling.ballast_loss) / (1 / track.modulus - 1 / pads)
    below = ballast - (2 * pi * frequency) ** 2 * rolling.sleeper / track.spacing
    above = pads * (1 + 1j * rolling.pad_loss)
    return np.asarray(above * below / (above + below))


def _find_beam(
    frequency: Floats, track: Track, rolling: Rolling
) -> tuple[ComplexArray, ComplexArray]:
    """s/(s - w^2 m_r) [-] and the wavenumber k [1/m] of waves exp(i w t - i k |x|) that die out,
    E I k^4 = w^2 m_r - s."""
    support = find_foundation_stiffness(frequency, track, rolling)
    stiff = support - (2 * pi * frequency) ** 2 * rolling.rail_mass
    number = np.exp(-0.25j * pi) * (stiff / track.rail_stiffness) ** 0.25
    return support / stiff, number


def find_rail_receptance(frequency: Floats, track: Track, rolling: Rolling) -> ComplexArray:
    """Deflection under a unit force, -(1 + i)/(4 E I k^3) [m/N], (m,); L^3/(8 E I) at f = 0."""
    _, number = _find_beam(frequency, track, rolling)
    return np.asarray(-(1 + 1j) / (4 * track.rail_stiffness * number**3))


def find_seat_response(
    distance: Floats, frequency: Floats, track: Track, rolling: Rolling
) -> ComplexArray:
    """What a seat takes of a unit force on the rail at ``distance`` x (n,) from it [m], (n, m).

    s times the deflection over one spacing a, in closed form:

        s/(s - w^2 m_r) (Q(x + a/2) - Q(x - a/2))/4,
        Q(y) = sign(y) (2 - e^(-i k |y|) - e^(-k |y|)).
    """
    carried, number = _find_beam(frequency, track, rolling)

    def sum_side(place: Floats) -> ComplexArray:
        size = np.abs(place)[:, None] * number
        return np.asarray(np.sign(place)[:, None] * (2 - np.exp(-1j * size) - np.exp(-size)))

    half = track.spacing / 2
    return carried * (sum_side(distance + half) - sum_side(distance - half)) / 4


def find_force_response(
    frequency: Floats, speed: float, load: float, track: Track, rolling: Rolling
) -> ComplexArray:
    """Dynamic contact force over roughness [N/m], (m,), at a wheel load [N]."""
    size, stiffness = find_hertz_contact(load, rolling)
    wheel = -1 / (rolling.unsprung * (2 * pi * frequency) ** 2)
    through = wheel + 1 / stiffness + find_rail_receptance(frequency, track, rolling)
    return np.asarray(find_contact_filter(frequency, speed, size) / through)


def sum_lines(time: Floats, frequency: Floats, lines: ComplexArray, response: Response) -> Floats:
    """Re sum over m of lines (m, b) e^(2 pi i f t), (2, n, b), at ``time`` (n,) [s]: as it is,
    and with each term times its ``response`` (n, m), a function of frequencies."""
    total = np.zeros((2, len(time), lines.shape[1]))
    for first in range(0, len(frequency), FREQUENCIES_AT_ONCE):
        part = slice(first, first + FREQUENCIES_AT_ONCE)
        wave = np.exp(2j * pi * np.outer(time, frequency[part]))
        total[0] += (wave @ lines[part]).real
        total[1] += ((wave * response(frequency[part])) @ lines[part]).real
    return total


def roll_on_rail(
    time: Floats, speed: float, load: float, axles: int, track: Track, rolling: Rolling,
    roughness: Roughness, seat: int,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Dynamic contact force of each axle's wheel on one rail, and what the rail seat takes of it
    [N], (n, b), at ``time`` (n,) [s] since that wheel was over the seat.

    ``load``: of a wheel [N]; ``axles``: their number b.  All read the same rail, each has a wheel
    of its own; the number of the ``seat`` chooses the rail's realisation.  Raises `ConditionError`
    where a wheel would leave the rail.
    """
    reach = QUIET * track.elastic_length + track.spacing / 2
    rail, on_rail = draw_roughness_lines(RAIL[roughness.rail], 2 * reach, speed, roughness, [seat])
    turn, levels = 2 * pi * rolling.wheel_radius, WHEEL[roughness.wheel]
    seeds = [[seat, 1 + axle] for axle in range(axles)]
    drawn = [draw_roughness_lines(levels, turn, speed, roughness, seed) for seed in seeds]
    wheel, on_wheel = drawn[0][0], np.stack([lines for _, lines in drawn], axis=1)

    def take_force(some: Floats) -> ComplexArray:
        return find_seat_response(speed * time, some, track, rolling)

    forces = np.zeros((2, len(time), axles))
    for frequency, heights in ((rail, on_rail[:, None]), (wheel, on_wheel)):
        of_heights = find_force_response(frequency, speed, load, track, rolling)[:, None]
        forces += sum_lines(time, frequency, of_heights * heights, take_force)
    contact, on_seat = forces
    if contact.min() <= -load:
        raise ConditionError(
            f"a wheel of {load:g} N leaves the rail: rolling adds {contact.min():.3g} N",
            where="roughness", remedy="give a smoother rail or wheel, or a lower amplitude",
        )  # fmt: skip
    return contact, on_seat


def find_rolling_forces(
    time: Floats, speed: float, axles: Floats, loads: Floats, track: Track,
    roughness: Roughness, rolling: Rolling | None = None,
) -> Floats:  # fmt: skip
    """What rolling adds to the force on each rail seat [N], (k, r), at even times (k,) [s].

    At ``time`` 0 the first of the ``axles`` (b,), by their distance behind it [m], is over the
    sleeper; ``loads`` (r,) [N]: of a wheel on each rail.  Rails have nothing to do with each
    other.  Axles stand to the nearest sample.  Raises `ConditionError` as `roll_on_rail`, for a
    roughness above half the rate of samples, which would be taken for another frequency, and for
    waves so many that they would take hours.
    """
    rolling = Rolling() if rolling is None else rolling
    rate = (len(time) - 1) / (time[-1] - time[0])
    reach = (QUIET * track.elastic_length + track.spacing / 2) / speed
    if not roughness.highest <= rate / 2 * (1 + 1e-9):
        raise ConditionError(
            f"roughness up to {roughness.highest:g} Hz in a record of {rate:g} Hz",
            where="roughness", remedy=f"give a highest frequency of at most {rate / 2:g} Hz",
        )  # fmt: skip
    if not 2 * reach * roughness.highest * min(2 * reach * rate, len(time)) <= MOST_WORK:
        raise ConditionError(
            f"at {speed:g} m/s {2 * reach * roughness.highest:.3g} waves up to "
            f"{roughness.highest:g} Hz pass the sleeper", where="roughness",
            remedy="give more speed, or a lower highest frequency",
        )  # fmt: skip
    later = np.rint(axles / speed * rate).astype(int)
    first = max(-int(later.max()), int(np.ceil((-reach - time[0]) * rate)))
    last = min(len(time) - 1, int((reach - time[0]) * rate))
    near = time[0] + np.arange(first, last + 1) / rate
    total = np.zeros((len(time), len(loads)))
    for seat, load in enumerate(loads):
        of_seat = (speed, float(load), len(axles), track, rolling, roughness, seat)
        _, taken = roll_on_rail(near, *of_seat)
        for axle, begin in enumerate(first + later):
            inside = slice(max(0, begin), min(len(time), begin + len(near)))
            total[inside, seat] += taken[inside.start - begin : inside.stop - begin, axle]
    return total
