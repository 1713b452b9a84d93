"""What every settlement law of beds satisfies, found as it is; none is named here."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from track_line.beds import spread_around_one
from track_line.laws import SEAT_AREA, BedLoad, Law, get_law, list_laws
from track_line.measured import fit_beds
from track_line.measured.ensemble import align_beds
from trackbed.errors import UsageError

FORCE = np.array([0.0, 5e3, 20e3, 35e3, 60e3])
LOAD = BedLoad(FORCE, np.full(5, 28e6))

every_law = pytest.mark.parametrize("name", list_laws())


def make(name: str) -> Law:
    """The law with its own parameters."""
    return get_law(name)()


@every_law
def test_it_says_where_it_is_from(name: str) -> None:
    """Formula, source and validity are sentences; every parameter is a number with a default."""
    law = make(name)
    for said in (law.formula, law.source, law.validity):
        assert len(said) > 10, f"{name} does not say its formula, source or validity"
    assert all(isinstance(getattr(law, one.name), float) for one in fields(law))  # type: ignore[arg-type]


@every_law
def test_a_sleeper_that_hangs_does_not_settle(name: str) -> None:
    """No force, no settlement; more force, at least as much; nothing ever heaves."""
    law = make(name)
    for cycle, settled in ((0.0, np.zeros(5)), (1e4, np.full(5, 2e-3))):
        grown = law.advance(LOAD, settled, cycle, 1e3)
        assert grown[0] == 0
        assert (np.diff(grown) >= 0).all()
        assert grown[-1] > 0


@every_law
def test_what_it_adds_is_the_integral_of_its_rate(name: str) -> None:
    """``advance`` solves ds/dN = rate(F, s, N) at constant load, by an independent integrator."""
    law, load = make(name), BedLoad(FORCE[2:], LOAD.bed[2:])
    begin = law.advance(load, np.zeros(3), 0.0, 50.0)

    def slope(cycle: float, settled: np.ndarray) -> np.ndarray:
        return law.rate(load, settled, cycle)

    found = solve_ivp(slope, (50.0, 5e4), begin, method="LSODA", rtol=1e-10, atol=1e-16)
    grown = law.advance(load, begin, 50.0, 5e4 - 50.0)
    assert begin + grown == pytest.approx(found.y[:, -1], rel=1e-6)


@every_law
def test_kinds_of_axles_add_their_rates(name: str) -> None:
    """``advance_mixed`` solves ds/dN = sum of share_i rate(F_i, s, N); another integrator, too."""
    law, shares = make(name), np.array([0.01, 0.99])
    force = np.stack([2 * FORCE[2:], 0.7 * FORCE[2:]])
    load, begin = BedLoad(force, LOAD.bed[2:]), np.full(3, 2e-3)

    def slope(cycle: float, settled: np.ndarray) -> np.ndarray:
        return shares @ np.array([law.rate(BedLoad(f, load.bed), settled, cycle) for f in force])

    found = solve_ivp(slope, (50.0, 5e4), begin, method="LSODA", rtol=1e-10, atol=1e-16)
    grown = law.advance_mixed(load, shares, begin, 50.0, 5e4 - 50.0)
    assert begin + grown == pytest.approx(found.y[:, -1], rel=1e-6)


@every_law
@pytest.mark.parametrize(("cycle", "first", "second"), [(0.0, 3.0, 9e4), (1e5, 1e-3, 1e6)])
def test_two_spans_are_one(name: str, cycle: float, first: float, second: float) -> None:
    """Axles in two lots settle a bed as those in one do, from the first axle on."""
    law = make(name)
    before = law.advance(LOAD, np.zeros(5), 0.0, cycle) if cycle else np.zeros(5)
    one = law.advance(LOAD, before, cycle, first + second)
    part = law.advance(LOAD, before, cycle, first)
    two = law.advance(LOAD, before + part, cycle + first, second)
    assert part + two == pytest.approx(one, rel=1e-8)
    assert np.isfinite(one).all()


@every_law
def test_lengths_scale(name: str) -> None:
    """Arrays of any shape give the same numbers, one by one."""
    law = make(name)
    wide = BedLoad(np.broadcast_to(FORCE, (3, 5)), np.broadcast_to(LOAD.bed, (3, 5)))
    many = law.advance(wide, np.full((3, 5), 1e-3), 10.0, 1e4)
    one = law.advance(LOAD, np.full(5, 1e-3), 10.0, 1e4)
    np.testing.assert_allclose(many, np.broadcast_to(one, (3, 5)), rtol=1e-12)


@every_law
def test_its_own_readings_give_it_back(name: str) -> None:
    """Twelve beds under two loads that settle by the law, times lasting factors of mean 1, from a
    level of their own: the law that is found settles as it under both, and no law leaves less.
    To 3 %: between readings, 12 % apart, a straight line in ln N is taken."""
    law, cycle, bed = make(name), np.geomspace(1, 1e6, 121), np.full(121, 30e6)
    factor = spread_around_one(np.random.default_rng(3).normal(size=12), 0.3)
    pressure, packing = np.repeat([60e3, 120e3], 12), np.tile(np.arange(12), 2)

    def settle(one: Law, force: float) -> np.ndarray:
        return one.advance(BedLoad(np.full(121, force), bed), np.zeros(121), 0.0, cycle)

    curves = [(cycle, 1e-3 * i + factor[i] / factor.mean() * settle(law, p * SEAT_AREA))
              for i, p in zip(packing, pressure, strict=True)]  # fmt: skip
    ensemble = align_beds(curves, name, names=[name] * 24, packing=packing, pressure=pressure,
                          bedding=np.full(24, 30e6 / SEAT_AREA), in_order=False)  # fmt: skip
    laws = fit_beds(ensemble, name).laws
    assert name in laws, f"{name} says by no Law.terms how measured beds give its parameters"
    for force in (60e3 * SEAT_AREA, 120e3 * SEAT_AREA):
        found, true = (np.diff(settle(one, force)[::20]) for one in (laws[name].law, law))
        np.testing.assert_allclose(found, true, rtol=0.03)
    assert laws[name].misfit.mean() <= min(one.misfit.mean() for one in laws.values()) + 1e-6


def test_a_law_that_is_not_there_is_a_sentence() -> None:
    with pytest.raises(UsageError, match="there is no settlement law 'shenten'; did you mean"):
        get_law("shenten")
