"""Resistance to rolling on every engine: a sphere that spins, rolls and slips, by closed forms.

Mohajeri, Coetzee and Schott (2024), Powder Technology 447, 120136, as LAMMPS' unit tests have it:
mu_r = 0.05, g = 1 m/s^2, omega_0 = 1 rad/s.  On another sphere R* is half the radius.
"""

from __future__ import annotations

import numpy as np
import pytest

from adapters.bed import contact_law as law
from adapters.bed.state import FloatArray
from tests.driven_contacts import find_grain_mass
from tests.engines.test_contact_law_engine import every_engine
from validation.bench import few_grains_lammps
from validation.bench.few_grains import RADIUS, TrackRun, load_table_1

MU, STEP, SAMPLE = 0.05, 2e-6, 1500


def track_sphere(
    run: TrackRun, *settings: str, speed: float = 0.0, spin: float = 1.0,
    below: bool = False,
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Time [s], speed over R and spin [rad/s] of a sphere at rest on the floor, or on another."""
    scene = load_table_1("material.grain.young=1e9", *settings)
    stiffness = scene.stiffness
    modulus, radius = (stiffness.grain, RADIUS / 2) if below else (stiffness.wall, RADIUS)
    overlap = float(law.find_overlap_under_force(find_grain_mass(scene), modulus, radius))
    height = (3 if below else 1) * RADIUS - overlap
    place = np.array([[0.02, 0.02, height], [0.02, 0.02, RADIUS]])[: 1 + below]
    velocity = np.array([[speed, 0.0, 0.0], [0.0, 0.0, 0.0]])[: 1 + below]
    motion = ["group held id 2"] * below
    motion += ["fix fall grain_1 gravity 1.0 vector 0.0 0.0 -1.0"]
    axes = f"omega 0.0 {spin} 0.0" if run is few_grains_lammps.run_grains else f"omegay {spin}"
    motion += [f"set group grain_1 {axes}", "fix motion grain_1 nve/sphere", f"run {10 * SAMPLE}"]
    track = run(scene, place, velocity, motion, time_step=STEP, every=SAMPLE)
    for contacts, positions in zip(track.contacts, track.position, strict=True):
        apart = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        assert contacts.overlap == pytest.approx(2 * RADIUS - apart, rel=1e-9)
    return track.time, track.velocity[:, 0, 0] / RADIUS, track.spin[:, 0, 1]


@every_engine
@pytest.mark.parametrize("below", [False, True])
def test_spinning_sphere_comes_to_rest(run: TrackRun, below: bool) -> None:
    """Without friction omega falls by 5 mu_r g/(2R) a second, on another sphere by half of that,
    and is at rest behind omega_0 over this: it turns back by what the spring held, 5e-3 omega_0.
    """
    floor, grain = (0.9 * MU, MU) if below else (MU, 0.9 * MU)
    time, _, spin = track_sphere(
        run, "material.wall.friction=0", "material.grain.friction=1e-9",
        f"material.wall.rolling_friction={floor}", f"material.grain.rolling_friction={grain}",
        below=below,
    )  # fmt: skip
    rate = 5 * MU / (2 * RADIUS) / (1 + below)
    slips = spin[1:] > 0.1  # what an engine does at the start of a run is left out
    assert np.diff(spin[1:][slips]) / time[1] == pytest.approx(-rate, rel=1e-3)
    assert slips.sum() >= 6
    if not below:
        assert abs(spin[time > 1.1 / rate]).max() < 5e-3


@every_engine
def test_rolling_sphere_slows_by_two_sevenths(run: TrackRun) -> None:
    """Rolling on, with friction, it loses 2/7 of that: d omega/dt = 5 mu_r g/(7 R)."""
    settings = f"material.wall.rolling_friction={MU}", "material.grain.rolling_friction=0.1"
    time, speed, spin = track_sphere(run, *settings, speed=RADIUS)
    assert np.diff(spin)[1:] / time[1] == pytest.approx(-5 * MU / (7 * RADIUS), rel=1e-3)
    assert speed[1:] == pytest.approx(spin[1:], rel=1e-3)


@every_engine
def test_slipping_sphere_rolls_at_five_sevenths(run: TrackRun) -> None:
    """u = 5 u_0/7 once it rolls, without resistance to rolling; slipping ends in 2 u_0/(7 mu g)."""
    _, speed, spin = track_sphere(run, speed=0.01, spin=0.0)
    assert speed[-1] * RADIUS == pytest.approx(5 / 7 * 0.01, rel=2e-3)
    assert spin[-1] == pytest.approx(speed[-1], rel=2e-3)
