"""A line under many axles: exact cases, linear theory, order and limit of the blocks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.signal import butter, sosfreqz

from track_line.beam import Track, roll_axle
from track_line.beds import Scatter, Zone, draw_normal, renew_scores
from track_line.laws import BedLoad, get_law
from track_line.settling import Axle, Line, find_alert_limit, find_crossings, make_line
from track_line.settling.blocks import measure_gain
from track_line.settling.level import measure_deviations, smooth_level
from track_line.settling.march import march_line, start_line
from trackbed.errors import NotConverged

TRACK, BED = Track(), 28e6
SERIES = TRACK.pad * BED / (TRACK.pad + BED)
ONE_KIND = (Axle(load=200e3),)
EVEN = Scatter(stiffness=0.0, settlement=0.0)


def build(
    law: str = "shenton", scatter: Scatter = EVEN, *, length: float = 200.0,
    axles: tuple[Axle, ...] = ONE_KIND, **keys: Any,
) -> Line:  # fmt: skip
    """A line of 60E1 rails and beds of 28 MN/m, by the law's own parameters."""
    return make_line(length, TRACK, get_law(law)(), axles, scatter, **keys)


def march(line: Line, axles: float, finer: float = 1.0) -> list[Any]:
    """States and records of a run."""
    return list(march_line(line, start_line(line), axles, finer=finer))


def test_like_beds_stay_level_for_ever() -> None:
    """Beds of one kind settle as the law says at their force, all alike to the 6e-7 by which the
    wheels of the comb near the free ends are felt."""
    line = build()
    state, record = march(line, 1e6)[-1]
    settled = state.settled[:, line.inside]
    assert np.ptp(settled) < 6e-7 * settled.mean()
    assert record.deviation.max() < 1e-7  # m: the ends, through the margins
    force = roll_axle(line.rail, line.support, state.settled, 100e3).force[:, line.inside]
    grown = line.law.advance(BedLoad(force, np.full_like(force, BED)), 0 * force, 0.0, 1e6)
    np.testing.assert_allclose(settled, grown, rtol=6e-7)
    assert (record.voids == 0).all()


def test_varandas_on_a_level_line_is_the_closed_form_of_rose() -> None:
    """12,288 axles settle H(12,288) = 25.2661945 times the first."""
    line = build("varandas")
    first, last = (march(line, axles)[-1][1].settlement[0] for axles in (1.0, 12288.0))
    assert last / first == pytest.approx(25.2661945, rel=1e-8)


def test_rose_example() -> None:
    """Its stored first and last settlement, at the force that they imply."""
    law = get_law("varandas")()
    load = BedLoad(np.array([41.6607e3]), np.array([BED]))
    assert law.advance(load, np.zeros(1), 0.0, 1.0)[0] == pytest.approx(0.120841e-3, rel=1e-5)
    assert law.advance(load, np.zeros(1), 0.0, 12288)[0] == pytest.approx(3.053204e-3, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "keys", "force", "cycles", "settled"),
    [
        ("power", {}, 68e3, 1e5, 0.7e-3 * 2**1.6 * 10),
        ("shenton", {}, 34e3, 1e6, 1.1 * (0.69e-3 * 10**1.2 + 2.7e-3)),
        ("shenton", {"lift": 0.02}, 17e3, 1e6, 0.55 * ((0.69e-3 + 0.56e-3) * 10**1.2 + 2.7e-3)),
        ("sato", {}, 29.9e3, 1e6, 1e-3 * (1 - np.exp(-10)) + 1e-19 * 50e3**2 * 1e6),
        ("guerin", {}, 42e3, 1e4, 1.44e-9 * 1.5**2.51 * 1e4),
        ("li-selig", {}, 81.25e3, 1e6, 2 * 0.012 * 0.5**2.4 * 10**1.08),
    ],
)
def test_laws_by_hand(
    name: str, keys: dict[str, float], force: float, cycles: float, settled: float
) -> None:
    """The formulas of the sources at round numbers: F = 2 F0, p - p0 = 50 kPa, F/k_b = 1.5 mm,
    sigma_d = sigma_s/2; with the lift of 20 mm half of the force."""
    load = BedLoad(np.array([force]), np.array([28e6]))
    found = get_law(name)(**keys).advance(load, np.zeros(1), 0.0, cycles)
    assert found[0] == pytest.approx(settled, rel=1e-9)


def find_seat_forces(line: Line, state: Any) -> np.ndarray:
    """Peak forces of the beds [N]."""
    return roll_axle(line.rail, line.support, state.settled, 100e3).force


def test_a_soft_bed_and_a_weak_one() -> None:
    """By one soft bed the load moves to its neighbours, which settle more at first, until the soft
    one stands above them; a bed that settles more under equal load gets less of it, and ends
    between the law's two curves."""
    at = 99.6
    soft = build(zones=(Zone(begin=at, end=at, stiffness=0.5),))
    weak = build(zones=(Zone(begin=at, end=at, settlement=1.5),))
    here = int(np.argmin(abs(soft.beds.place - at)))
    assert soft.beds.stiffness[0, here] == BED / 2
    even = march(build(), 1.0)[-1][0].settled[0, here]
    settled = march(soft, 1.0)[-1][0].settled[0]
    assert settled[here] < even < settled[here + 1] == pytest.approx(settled[here - 1], rel=1e-9)
    first, last = (find_seat_forces(soft, march(soft, n)[-1][0])[0] for n in (1.0, 1e6))
    assert 1 - first[here] / first[here + 1] > 2 * abs(1 - last[here] / last[here + 1])
    even, state = march(build(), 1e6)[-1][0].settled[0, here], march(weak, 1e6)[-1][0]
    assert even < state.settled[0, here] < 1.5 * even
    forces = find_seat_forces(weak, state)[0]
    assert forces[here] < forces[here + 20] < forces[here + 1]


def test_a_void_fills_as_its_neighbours_sink() -> None:
    """A hanging sleeper does not settle at first; its neighbours do until it bears."""
    at = 99.6
    line = build(zones=(Zone(begin=at, end=at, void=3e-3),))
    run = march(line, 1e6)
    here = int(np.argmin(abs(line.beds.place - at)))
    path = np.array([state.settled[0, [here, here + 1]] for state, _ in run])
    assert path[1, 0] == path[0, 0] == 3e-3
    assert path[1, 1] > 0
    gap = path[:, 0] - path[:, 1]
    assert (np.diff(gap) < 1e-9).all()
    assert 0 < gap[-1] < 3e-3
    assert run[0][1].deepest[0] > run[-1][1].deepest[0]


def test_a_bridge_end_makes_a_step() -> None:
    """Beds that do not settle stay; the step behind the end is what the open line has settled, and
    the first sleepers off the bridge hang."""
    line = build(zones=(Zone(begin=100.0, end=150.0, stiffness=5.0, settlement=0.0),))
    state, record = march(line, 1e6)[-1]
    place, settled = line.beds.place, state.settled[0]
    assert (settled[(place >= 100) & (place <= 150)] == 0).all()
    assert settled[np.argmin(abs(place - 60))] > 5e-3
    near = settled[(place < 100) & (place > 97)]
    assert (np.diff(near) <= 0).all()
    assert record.voids[0, 0] > 0


@pytest.mark.long
def test_error_of_blocks_is_of_first_order() -> None:
    """Half the blocks, half the error of D1; at the step taken, it is within 0.3 %."""
    line = build("power", Scatter(stiffness=0.0, settlement=0.2), lines=4)
    found = [
        np.sqrt((march(line, 1e5, finer)[-1][1].deviation ** 2).mean()) for finer in (1, 2, 4, 8)
    ]
    apart = -np.diff(found)
    assert np.log2(apart[0] / apart[2]) / 2 == pytest.approx(1.0, abs=0.25)
    assert abs(found[0] / (2 * found[-1] - found[-2]) - 1) < 3e-3


def test_blocks_beyond_the_limit_blow_up() -> None:
    """With k_s ds/dF four times as large as is taken, twice the limit, alternate sleepers part."""
    line = build("power", Scatter(stiffness=0.0, settlement=0.2), lines=2)
    sound, wild = (march(line, 1e6, finer)[-1][1].deviation.mean() for finer in (1.0, 0.2))
    assert wild > 1.5 * sound


def test_gain_is_the_closed_form() -> None:
    """k_s ds/dF = m ds k_s/F of a law that goes as F^m."""
    line = build("li-selig", lines=1)
    state = start_line(line)
    force = find_seat_forces(line, state)
    grown = line.law.advance(BedLoad(force, line.support.bed), 0 * force, 10.0, 1e4)
    gain = measure_gain(line, force[None], 0 * force, np.ones_like(force), 10.0, 1e4)
    np.testing.assert_allclose(gain, (2.4 * grown / force * SERIES).ravel(), rtol=2e-4)
    twice = measure_gain(line, force[None], 0 * force, np.full_like(force, 2.0), 10.0, 1e4)
    np.testing.assert_allclose(twice, 2 * gain, rtol=1e-12)


def predict_deviation(line: Line, settlement: float, variation: float) -> float:
    """D1 by linear theory of time hardening with F^1, white scatter: each wave of settlement is
    held back by the load that it moves, cv H g (1 - e^(-l S))/l, l = k_s (1 - H)/R0."""
    force = float(find_seat_forces(line, start_line(line))[0, line.inside].mean())
    q = np.linspace(1e-6, np.pi, 20_001)
    c = np.cos(q)
    lattice = 1 / (1 + 12 * TRACK.bending / TRACK.spacing**3 / SERIES * (1 - c) ** 2 / (2 + c))
    band = butter(2, [1 / 25, 1 / 3], "bandpass", fs=1 / TRACK.spacing, output="sos")
    gain = abs(sosfreqz(band, q)[1])
    held = SERIES * (1 - lattice) / force
    wave = lattice * gain * -np.expm1(-held * settlement) / np.maximum(held, 1e-12)
    return variation * float(np.sqrt(trapezoid(wave**2, q) / np.pi))


def test_small_scatter_grows_as_linear_theory_says() -> None:
    """D1 of 40 lines of white scatter within 4 %: three errors of its estimate from 40 times 333
    sleepers (1 %), and sleepers that hang, which the theory has not."""
    line = build(scatter=Scatter(stiffness=0.0, settlement=0.02), lines=40)
    record = march(line, 3e5)[-1][1]
    found = np.sqrt((record.deviation**2).mean())
    expected = predict_deviation(line, float(record.settlement.mean()), 0.02)
    assert found == pytest.approx(expected, rel=0.04)


def test_kinds_of_axles_share_the_settlement() -> None:
    """Half the axles of no weight that counts: as half as many axles, for a law in proportion."""
    some = Axle(load=200e3, share=2.0), Axle(load=1.0, share=2.0)
    line = build("guerin", axles=some)
    half = march(line, 1e5)[-1][1].settlement[0]
    whole = march(build("guerin"), 5e4)[-1][1].settlement[0]
    assert half == pytest.approx(whole, rel=1e-3)
    assert line.find_tonnage(np.array(2e6)) == pytest.approx(100.0005e3 * 2e6 / 9.81 / 1e9)


def test_rare_heavy_axles_settle_a_bed_that_hardens_by_strain() -> None:
    """One axle in a hundred of 225 kN among those of 100 kN: u^(1/b) is the mean of theirs, on a
    level line whatever the blocks are."""
    some = Axle(load=225e3, share=0.01), Axle(load=100e3, share=0.99)
    line = build("power", axles=some)
    state, record = march(line, 1e6)[-1]
    law, forces = line.law, [find_wheel_force(line, state, one.wheel) for one in some]
    alone = [law.advance(BedLoad(f, np.full(1, BED)), np.zeros(1), 0.0, 1e6)[0] for f in forces]
    expected = (0.01 * alone[0] ** 5 + 0.99 * alone[1] ** 5) ** 0.2
    assert record.settlement[0] == pytest.approx(expected, rel=1e-5)


def find_wheel_force(line: Line, state: Any, wheel: float) -> np.ndarray:
    """Peak force of a bed far from the ends [N], (1,)."""
    passage = roll_axle(line.rail, line.support, state.settled, wheel)
    return passage.force[0, [line.beds.place.size // 2]]


def test_zones_reach_their_ends_and_those_of_the_line() -> None:
    """Sleepers at an end of a zone are in it, whatever their place is rounded to; a zone that
    begins where the line does holds the margin too, so that no step is made there."""
    for k in range(1, 101):
        line = build(length=120.0, zones=(Zone(begin=0.6 * k, end=0.6 * (k + 1), void=1e-3),))
        assert (line.beds.level > 0).sum() == 2
    still = build(length=60.0, zones=(Zone(begin=0.0, end=60.0, settlement=0.0),))
    assert march(still, 1e5)[-1][1].deviation.max() < 1e-7  # m: the free ends


@pytest.mark.parametrize(("spacing", "bed"), [(0.2, 5e6), (0.6, 1e5), (1.2, 28e6)])
def test_wheels_of_the_comb_are_out_of_reach(spacing: float, bed: float) -> None:
    """On soft beds and narrow sleepers too: forces are those of wheels twice as far apart, 1e-5."""
    track = Track(bed=bed, spacing=spacing)
    line = make_line(150.0, track, get_law("shenton")(), ONE_KIND, EVEN)
    near, far = (
        roll_axle(line.rail, replace(line.support, period=n * line.support.period),
                  line.beds.level, 100e3).force[:, line.inside]
        for n in (1, 2)
    )  # fmt: skip
    np.testing.assert_allclose(near, far, rtol=1e-5)


def test_settlement_beyond_all_sense_ends_a_run() -> None:
    with pytest.raises(NotConverged, match=r"a bed has settled by .* m, which no line does"):
        march(make_line(60.0, TRACK, get_law("shenton")(quality=1e6), ONE_KIND, EVEN), 1e6)


# --- scatter ---------------------------------------------------------------------------------


def test_scatter_has_the_asked_moments() -> None:
    """Mean 1, variation, correlation along the line e^(-x/l) and with stiffness: within three
    errors of the estimate from 400 lines of 300 beds."""
    scatter = Scatter(stiffness=0.3, settlement=0.4, length=3.0, together=-0.6)
    line = build(scatter=scatter, lines=400, length=120.0)
    factor = line.beds.find_factors(line.beds.score)
    bed = line.beds.stiffness / BED
    alike = 400 * 300 * 0.6 / (2 * 3.0)  # beds that count: length over twice the correlation's
    for values, variation in ((factor, 0.4), (bed, 0.3)):
        assert values.mean() == pytest.approx(1.0, abs=3 * variation / alike**0.5)
        assert values.std() == pytest.approx(variation, rel=0.05)
    score = line.beds.score
    for apart in (1, 5):
        found = (score[:, apart:] * score[:, :-apart]).mean() / score.var()
        assert found == pytest.approx(np.exp(-0.6 * apart / 3.0), abs=0.02)
    assert np.corrcoef(score.ravel(), np.log(bed).ravel())[0, 1] == pytest.approx(-0.6, abs=0.02)


def test_forgotten_scatter_is_of_the_settlement_not_of_the_blocks() -> None:
    """After the memory, scores are correlated by e^-1; two ways there give the same scores and the
    same settlement; the first lines of many are those of few."""
    beds = build(scatter=Scatter(memory=2e-3, length=1.2), lines=50).beds
    later, factor = renew_scores(beds, beds.score, 0.0, 2.1e-3)
    halfway, first = renew_scores(beds, beds.score, 0.0, 0.7e-3)
    again, second = renew_scores(beds, halfway, 0.7e-3, 2.1e-3)
    np.testing.assert_array_equal(again, later)
    np.testing.assert_allclose((first + 2 * second) / 3, factor, rtol=1e-12)
    assert (beds.score * later).mean() == pytest.approx(np.exp(-1), abs=0.05)
    assert later.std() == pytest.approx(1.0, abs=0.05)
    few = draw_normal((1, 0), (3, 400), 0.6, 1.2)
    np.testing.assert_array_equal(draw_normal((1, 0), (50, 400), 0.6, 1.2)[:3], few)


@pytest.mark.long
def test_lasting_scatter_makes_a_line_more_uneven() -> None:
    """Scatter that is forgotten within a millimetre averages out; blocks have no part in it, even
    where it is forgotten many times in one: three times as many change D1 by less than 3 %."""

    def find_deviation(memory: float | None, finer: float = 1.0) -> float:
        scatter = Scatter(stiffness=0.0, settlement=0.2, memory=memory)
        return float(march(build(scatter=scatter, lines=10), 1e6, finer)[-1][1].deviation.mean())

    assert find_deviation(1e-3) < 0.7 * find_deviation(None)
    assert find_deviation(2e-4, 3.0) == pytest.approx(find_deviation(2e-4), rel=0.03)


# --- the level -------------------------------------------------------------------------------


@pytest.mark.parametrize(("wave", "gain"), [(3.0, 0.5**0.5), (25.0, 0.5**0.5), (8.0, 1.0)])
def test_waves_pass_as_the_standard_says(wave: float, gain: float) -> None:
    """The middle of a long wave is left in place; 1/sqrt(2) at the ends of the band."""
    place = 0.5 * np.arange(4001)
    level = np.cos(2 * np.pi * (place - 1000) / wave)
    middle = smooth_level(level, 0.5)[1000:3000]
    assert np.sqrt(2) * middle.std() == pytest.approx(gain, abs=0.01)
    assert middle @ level[1000:3000] > 0.99 * gain * 1000


def test_deviation_of_a_wave_is_its_amplitude_over_root_two() -> None:
    """In each of five sections of 200 m; a slope and an offset do not count."""
    place = 0.6 * np.arange(round(1060 / 0.6) + 1)
    level = 1e-3 * np.cos(2 * np.pi * place / 8) + 0.3 + 1e-4 * place
    found = measure_deviations(np.stack([level, 2 * level]), 0.6)
    assert found.shape == (2, 5)
    assert found[0] == pytest.approx(1e-3 / 2**0.5, rel=0.03)
    np.testing.assert_allclose(found[1], 2 * found[0])


def test_crossing_is_where_the_curve_first_meets_the_limit() -> None:
    tonnage = np.array([0.0, 10.0, 20.0, 30.0])
    curves = np.array([[0, 0, 3], [1, 0.5, 3], [3, 1, 3], [2, 1.5, 3.0]])
    assert find_crossings(tonnage, curves, 2.0).tolist() == [15.0, np.inf, 0.0]
    assert find_crossings(tonnage, curves, 2.5).tolist() == [17.5, np.inf, 0.0]


def test_alert_limits_are_by_kilometres_an_hour() -> None:
    assert [find_alert_limit(v / 3.6) for v in (60, 140, 400)] == [2.3e-3, 1.4e-3, 1.0e-3]


def test_unevenness_is_there_before_the_first_axle_and_no_settlement() -> None:
    line = build(scatter=Scatter(stiffness=0.0, settlement=0.0, unevenness=1e-3), lines=50)
    assert line.beds.level.std() == pytest.approx(1e-3, rel=0.03)
    first, last = (march(line, 1e3)[k][1] for k in (0, -1))
    assert (first.settlement == 0).all()
    even = march(build(), 1e3)[-1][1].settlement[0]
    assert last.settlement.mean() == pytest.approx(even, rel=0.05)
