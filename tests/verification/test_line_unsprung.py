"""What unsprung masses add: one degree of freedom over waves, and growth of the line's own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from track_line.beam import Track, roll_axle
from track_line.beds import Scatter
from track_line.laws import get_law
from track_line.settling import Axle, Line, make_line, march_line, start_line
from track_line.settling.unsprung import find_added_load, find_force

TRACK, MASS = Track(sleeper_mass=1e3), 800.0  # so heavy that all sleepers bear
STIFFNESS = 100e3 / 1.499359e-3  # of 60E1 rails on beds of 28 MN/m [N/m]


def find_gain(length: float, speed: float) -> complex:
    """F/z of a wave [N/m]: k r^2 (1 + 2 i zeta r)/(1 - r^2 + 2 i zeta r), r the frequency over the
    natural one, 46 Hz."""
    r = 2 * np.pi * speed / length * (MASS / STIFFNESS) ** 0.5
    damped = 2j * TRACK.damping / (2 * (STIFFNESS * MASS) ** 0.5) * r
    return complex(STIFFNESS * r**2 * (1 + damped) / (1 - r**2 + damped))


@pytest.mark.parametrize(("length", "speed"), [(3.0, 20.0), (3.0, 138.0), (7.3, 40.0), (6.0, 0.1)])
def test_a_wave_is_one_degree_of_freedom(length: float, speed: float) -> None:
    """Amplitude and phase, slow, below resonance and at it, 60 m from the ends; to 1e-4: ends that
    fade have a little of the shortest wave, whose load does not fade.  Nothing is added at rest."""
    wave = 1e-3 * np.exp(2j * np.pi * 0.6 * np.arange(501) / length)
    found = find_added_load(wave.real, TRACK, MASS, speed)
    expected = (find_gain(length, speed) * wave).real
    assert abs(found - expected)[100:-100].max() < 1e-4 * abs(expected).max()
    assert (find_added_load(wave.real, TRACK, MASS, 0.0) == 0).all()


def settle(speed: float, mass: float, size: float, axles: float) -> tuple[np.ndarray, Line]:
    """By how much beds that lie along a wave of 6 m, and level ones, settle, (2, n) [m]."""
    like = Scatter(stiffness=0.0, settlement=0.0)
    axle, law = Axle(load=200e3, unsprung_mass=mass), get_law("guerin")(beta=1.0)
    line = make_line(60.0, TRACK, law, [axle], like, lines=2, speed=speed)
    wave = size * np.cos(2 * np.pi * line.beds.place / 6.0)
    line = replace(line, beds=replace(line.beds, level=np.stack([wave, 0 * wave])))
    *_, (state, _) = march_line(line, start_line(line), axles)
    return state.settled - line.beds.level, line


@pytest.mark.parametrize("mass", [0.0, MASS])
def test_unevenness_feeds_its_own_growth(mass: float) -> None:
    """A wave Z of like beds under a law ds/dN = alpha R: Z' = lambda Z, lambda = alpha (s F/z H -
    k_s (1 - H)), H from bed to rail and s the share of a seat; to 5e-3 of what it changes, the
    error of the blocks and of the ends."""
    series = TRACK.pad * TRACK.bed / (TRACK.pad + TRACK.bed)
    kappa = series * TRACK.spacing**3 / TRACK.bending

    def lattice(q: Any) -> Any:
        return 1 / (1 + 12 / kappa * (1 - np.cos(q)) ** 2 / (2 + np.cos(q)))

    share = lattice((np.arange(20_000) + 0.5) * np.pi / 20_000).mean()
    to_rail = lattice(2 * np.pi * TRACK.spacing / 6.0)
    added = share * find_gain(6.0, 80.0) * to_rail if mass else 0.0
    slope = 1.44e-9 / 1e-3 / TRACK.bed * (added - series * (1 - to_rail))
    settled, line = settle(80.0, mass, 1e-4, 1e5)
    wave = 1e-4 * np.exp(2j * np.pi * line.beds.place / 6.0)
    change, expected = settled[0] - settled[1], (wave * np.expm1(slope * 1e5)).real
    assert abs(change - expected)[line.inside].max() < 5e-3 * abs(expected).max()


def test_no_mass_is_the_line_at_rest_to_the_bit() -> None:
    """Whatever the speed; over waves of 20 mm a wheel with mass leaves the rail, and lifts none."""
    ways = ((0.0, 0.0), (80.0, 0.0), (80.0, MASS))
    (rest, _), (fast, _), (rolling, line) = (settle(*one, 1e-4, 1e4) for one in ways)
    assert (rest == fast).all()
    assert (rest != rolling).any()
    free = roll_axle(line.rail, line.support, 0 * line.beds.level, 0.0)
    wave = 0.02 * np.cos(2 * np.pi * line.beds.place / 6.0) + 0 * free.level
    force = find_force(line, 0 * wave, line.axles[0], replace(free, level=wave))
    assert (force > 0.999 * free.force)[:, line.inside].all()
