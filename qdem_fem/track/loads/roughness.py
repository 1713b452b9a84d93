"""How rough wheels and rails are: power by frequency, and seeded realisations of it.

Levels: Directive (EU) 2015/996, Annex, Appendix G, table G-1, as replaced by Delegated Directive
(EU) 2021/1226; its smooth rail is the limit of EN ISO 3095:2013.  `qdem_fem.track.loads.rolling`
makes a force of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from qdem_fem.files import ConditionError, Floats

ComplexArray = NDArray[np.complex128]

WAVELENGTHS = 10.0 ** np.arange(0.3, -3.15, -0.1)
"""Middles of the third octaves of table G-1, nominally 2 m to 0.8 mm [m], (35,)."""
RAIL = {
    "smooth": (
        17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 15.0, 13.0, 11.0, 9.0, 7.0, 4.9, 2.9, 0.9,
        -1.1, -3.2, -5.0, -5.6, -6.2, -6.8, -7.4, -8.0, -8.6, -9.2, -9.8, -10.4, -11.0, -11.6,
        -12.2, -12.8, -13.4, -14.0, -14.0,
    ),
    "average": (
        35.0, 31.0, 28.0, 25.0, 23.0, 20.0, 17.0, 13.5, 10.5, 9.0, 6.5, 5.5, 5.0, 3.5, 2.0, 0.1,
        -0.2, -0.3, -0.8, -3.0, -5.0, -7.0, -8.0, -9.0, -10.0, -12.0, -13.0, -14.0, -15.0, -16.0,
        -17.0, -18.0, -19.0, -19.0, -19.0,
    ),
}  # fmt: skip
"""Levels of a rail, dB re 1 um: well kept (EN ISO 3095:2013), and the average network."""
WHEEL = {
    "disc": (
        -5.9, -5.9, -5.9, -5.9, -5.9, -5.9, -5.9, -5.9, -5.9, 2.3, 2.8, 2.6, 1.2, 2.1, 0.9, -0.3,
        -1.6, -2.9, -4.9, -7.0, -8.6, -9.3, -9.5, -10.1, -10.3, -10.3, -10.8, -10.9, -9.5, -9.5,
        -9.5, -9.5, -9.5, -9.5, -9.5,
    ),
    "composite": (
        -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.3,
        -4.6, -4.9, -5.2, -6.3, -6.8, -7.2, -7.3, -7.3, -7.1, -6.9, -6.7, -6.0, -3.7, -2.4, -2.6,
        -2.5, -2.5, -2.5, -2.5, -2.5,
    ),
    "cast-iron": (
        2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.2, 2.4, 0.6, 2.6, 5.8, 8.8, 11.1, 11.0,
        9.8, 7.5, 5.1, 3.0, 1.3, 0.2, -0.7, -1.2, -1.0, 0.3, 0.2, 1.3, 3.1, 3.1, 3.1, 3.1, 3.1,
    ),
}  # fmt: skip
"""Levels of a wheel by what brakes it, dB re 1 um; printed from 1 m on, longer waves as that."""
MICROMETRE = 1e-6
RailKind = Literal["smooth", "average"]
WheelKind = Literal["disc", "composite", "cast-iron"]


@dataclass(frozen=True)
class Roughness:
    """How rough wheels and rails are; one realisation a ``seed``."""

    rail: RailKind = "smooth"
    wheel: WheelKind = "disc"
    seed: int = 1
    amplitude: float = 1.0  # of all heights, over the levels' [-]
    highest: float = 2000.0  # frequency up to which there is any [Hz]

    def __post_init__(self) -> None:
        known = self.rail in RAIL and self.wheel in WHEEL
        if not (known and 0 <= self.amplitude < inf and 0 < self.highest < inf and self.seed >= 0):
            raise ConditionError(
                f"rail {self.rail!r}, wheel {self.wheel!r}, seed {self.seed}, amplitude "
                f"{self.amplitude}, highest {self.highest} Hz", where="roughness",
                remedy=f"use a rail of {', '.join(RAIL)}, a wheel of {', '.join(WHEEL)}, and "
                "numbers that are not negative",
            )  # fmt: skip


def find_roughness_power(levels: Sequence[float], frequency: Floats, speed: float) -> Floats:
    """Power of a roughness over frequency S(f) [m^2/Hz], (m,), one-sided, at a ``speed`` [m/s].

    A third octave of level L about a wavelength v/f holds (1 um)^2 10^(L/10) of mean square; the
    level is linear in the logarithm of the wavelength between the middles of third octaves, and
    constant beyond the first and the last.
    """
    along = np.log10(speed / frequency)
    level = np.interp(along, np.log10(WAVELENGTHS[::-1]), levels[::-1])
    return np.asarray(MICROMETRE**2 * 10 ** (level / 10) / (frequency * np.log(10) / 10), float)


def find_contact_filter(frequency: Floats, speed: float, size: float) -> Floats:
    """H_c [-], (m,): what a contact of radius a averages out, (1 + pi/4 (k a)^3)^(-1/2) with
    k = 2 pi f/v (Remington, J. Acoust. Soc. Am. 81, 1987, 1805-1823)."""
    return np.asarray((1 + pi / 4 * (2 * pi * frequency / speed * size) ** 3) ** -0.5)


def draw_roughness_lines(
    levels: Sequence[float], length: float, speed: float, roughness: Roughness, seed: list[int]
) -> tuple[Floats, ComplexArray]:
    """Frequencies n v/``length`` [Hz] and complex heights [m], (m,): r = Re sum h e^(i w t).

    The roughness repeats after a ``length`` [m], a turn of a wheel for instance.  Sizes are the
    power's, sqrt(2 S df), and only phases are drawn, so any of them has the power asked for.
    """
    apart = speed / length
    frequency = apart * np.arange(1.0, int(roughness.highest / apart) + 1)
    size = roughness.amplitude * np.sqrt(2 * apart * find_roughness_power(levels, frequency, speed))
    phase = np.random.default_rng([roughness.seed, *seed]).uniform(0, 2 * pi, len(frequency))
    return frequency, size * np.exp(1j * phase)
