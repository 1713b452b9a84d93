"""What the unsprung mass of a wheel adds to its load where it rolls over an uneven line.

The mass m follows the level z(x) of the line under the wheel at rest, x = v t, by the stiffness k
and the damping c of the track under a wheel, one degree of freedom:

    m y'' + c (y' - z') + k (y - z) = 0,    F = c (y' - z') + k (y - z) = -m y''.

On a wave of length L, w = 2 pi v/L, F = z m w^2 (k + i c w)/(k + i c w - m w^2), as v^2 for a slow
wheel; k = (64 E I u^3)^(1/4) is that of a beam on a continuous bed u.  The level is that of each
block of axles, so that unevenness feeds its own growth.
"""

import numpy as np

from track_line.arrays import Floats
from track_line.beam import Passage, Track, roll_axle
from track_line.settling.level import fade_ends
from track_line.settling.line import Axle, Line


def find_added_load(level: Floats, track: Track, mass: float, speed: float) -> Floats:
    """F over each seat, (b, n) [N], of an unsprung ``mass`` [kg] that rolls at a ``speed`` [m/s]
    over ``level`` (b, n) [m]."""
    n, level = level.shape[-1], fade_ends(level, track.spacing)
    w = 2 * np.pi * speed * np.fft.rfftfreq(n, track.spacing)
    bed = track.pad * track.bed / (track.pad + track.bed) / track.spacing
    spring = (64 * track.bending * bed**3) ** 0.25 + 1j * w * track.damping
    inertia = mass * w**2
    return np.fft.irfft(np.fft.rfft(level) * inertia * spring / (spring - inertia), n)


def find_force(line: Line, settled: Floats, axle: Axle, passage: Passage) -> Floats:
    """R of each sleeper as an axle rolls over it at the line's speed, (b, n) [N].

    ``settled`` (b, n) [m]: how deep each bed lies; ``passage``: of the axle at rest, taken as it is
    where it has no unsprung mass.  A wheel that would pull leaves the rail.
    """
    if axle.unsprung_mass == 0:
        return passage.force
    added = find_added_load(passage.level, line.track, axle.unsprung_mass, line.speed)
    wheel = np.maximum(axle.wheel + added, 0.0)
    return roll_axle(line.rail, line.support, settled, wheel, passage.bears).force
