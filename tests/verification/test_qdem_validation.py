"""QDEM against scikit-fem on the same mesh and closed forms, and proof that checks can fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from qdem_fem import Body, Material, Simulation
from qdem_fem.report.spectra import find_peak_frequencies
from tests.qdem_rings import make_ring_mesh
from validation.bench.qdem import judge, static, vibration, waves
from validation.bench.qdem.checks import check_below, check_near, fit_order, meets
from validation.bench.qdem.closed_forms import find_bar_speed
from validation.bench.qdem.judge import FloatArray
from validation.bench.qdem.problem import make_cantilever, make_smooth_step
from validation.case import Check

SMALL = (12, 2, 2)


def hold(checks: list[Check]) -> None:
    """All of them, or say which do not."""
    failing = [f"{check.name}: {check.value:.4g}, bar {check.bar}" for check in checks]
    assert all(check.holds for check in checks), "\n".join(failing)


def test_static_answers_by_relaxation_and_by_whole_periods() -> None:
    """K u = f: both ways agree with scikit-fem on the same mesh, and with each other."""
    problem = make_cantilever(SMALL)
    relaxed, settled = static.relax(problem), static.settle(problem)
    hold(static.check_answer("relaxed", relaxed))
    hold(static.check_answer("settled", settled))
    assert relaxed.tip == pytest.approx(settled.tip, rel=1e-5)


@pytest.mark.long
def test_order_of_convergence_towards_the_reference_of_second_order() -> None:
    """Excess stiffness of linear elements goes with h^2, here by relaxation, which costs less."""
    answers = [static.relax(make_cantilever((12 * k, 2 * k, 2 * k))) for k in (2, 3)]
    hold(static.check_convergence("small", answers, static.TIP_P2))


def test_first_frequency_after_unloading() -> None:
    """Fit of damped cosines to the tip against eigsh of (K, lumped M): 0.1 %."""
    mode, expected = vibration.find_first_frequency(make_cantilever(SMALL))
    assert mode.frequency == pytest.approx(expected, rel=1e-3)
    assert abs(mode.decay) < 1e-4 * expected


@pytest.mark.long
def test_five_frequencies() -> None:
    """One skew release holds the five lowest modes, each within 0.1 % of the judge's."""
    five = vibration.find_frequencies(make_cantilever(SMALL))
    assert np.abs(five.found / five.judge - 1).max() < 1e-3
    assert len(set(five.found)) == 5


def test_motion_is_of_second_order_in_the_step() -> None:
    """Against the sum over all modes, which is exact in time."""
    hold(vibration.check_exact_motion(make_cantilever(SMALL)))


def test_waves_of_a_bar() -> None:
    """sqrt(E/rho) and sqrt((lam + 2 mu)/rho), dispersion of second order."""
    hold(waves.check_waves([10, 20, 30]))


RADIUS, WIDTH, DEPTH = 0.5, 0.05, 0.05
"""Mean radius, width along it and along the axis, of the ring [m]."""
STEEL = Material(young=210e9, poisson=0.3, density=7850.0)


def free_frequency(body: Body, start: FloatArray, shape: FloatArray, guess: float) -> float:
    """Frequency [Hz] of the free motion from ``start`` [m], of its share of ``shape`` (n, 3)."""
    run = Simulation([body], threads=1)
    body.displacement = start
    mass = judge.lump_mass(body.nodes, body.elements, body.material.density)
    stride = max(1, round(0.05 / guess / run.step))
    values = []
    for _ in range(120):
        values.append(float((mass[:, None] * shape * body.displacement).sum()))
        run.advance(stride * run.step)
    time = stride * run.step * np.arange(len(values), dtype=np.float64)
    return find_peak_frequencies(time, np.array(values), count=3, floor=1e-4)[0].frequency


def nearest_eigenfrequency(body: Body, shape: FloatArray) -> float:
    """Frequency [Hz] of the modes of the same mesh that hold most of ``shape``; all by LAPACK.

    Modes of a ring come in pairs of one frequency, whose vectors are any two of their plane: what
    counts is the share of the pair.
    """
    material = body.material
    mass = judge.lump_mass(body.nodes, body.elements, material.density)
    matrix = judge.build_stiffness(body.nodes, body.elements, material.young, material.poisson)
    root = np.sqrt(np.repeat(mass, 3))
    value, vector = eigh(matrix.toarray() / np.outer(root, root))
    share = (vector.T @ (root * shape.ravel())) ** 2
    first = np.flatnonzero(np.diff(value, prepend=-np.inf) > 1e-6 * value)
    most = first[np.argmax(np.add.reduceat(share, first))]
    return float(np.sqrt(value[most]) / (2 * np.pi))


@pytest.mark.parametrize("kind", ["breathing", "bending"])
def test_ring_against_its_own_eigenvalues(kind: str) -> None:
    """A free ring, all modes of the same mesh by LAPACK; the thin ring's frequency is a guess."""
    mesh = make_ring_mesh(RADIUS - WIDTH / 2, RADIUS + WIDTH / 2, DEPTH, (1, 48, 1))
    angle = np.arctan2(mesh.nodes[:, 1], mesh.nodes[:, 0])
    radial = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    thin, shape = find_bar_speed(210e9, 7850.0) / (2 * np.pi * RADIUS), radial
    if kind == "bending":
        shape = np.cos(2 * angle)[:, None] * radial - 0.5 * np.sin(2 * angle)[:, None] * around
        thin *= WIDTH / np.sqrt(12) / RADIUS * 6 / np.sqrt(5)
    found = free_frequency(Body(mesh, STEEL), 1e-6 * shape, shape, thin)
    assert found == pytest.approx(nearest_eigenfrequency(Body(mesh, STEEL), shape), rel=1e-3)


def test_a_wrong_answer_fails() -> None:
    """A displacement 2e-5 too large fails the tip; one 0.2 % too large fails the stress."""
    problem = make_cantilever(SMALL)
    good = static.relax(problem)
    assert good.difference < 1e-6
    off = replace(good, displacement=(1 + 2e-5) * good.displacement)
    assert not static.check_answer("off", off)[0].holds
    off = replace(good, displacement=(1 + 2e-3) * good.displacement)
    assert not any(check.holds for check in static.check_answer("off", off)[:3])


def test_a_smooth_step_leaves_the_first_mode_at_rest() -> None:
    """|integral of ds/dt exp(i w t)| is zero for whole periods from two on, and not for one."""
    step = make_smooth_step(1.0)
    rate = np.diff(step.values)
    middle = 0.5 * (step.times[1:] + step.times[:-1])
    left = [abs((rate * np.exp(2j * np.pi * n * middle)).sum()) for n in (1, 2, 3)]
    assert left[0] == pytest.approx(0.5, rel=1e-3)
    assert max(left[1:]) < 1e-5


def test_bars() -> None:
    assert not check_below("x", float("nan"), 1.0).holds
    assert check_near("x", 1.004, 1.0, 0.005).holds
    assert not check_near("x", 1.006, 1.0, 0.005).holds
    for bar in ("< 2", "<= 1", ">= 1", "0.5 to 1.5", "= 1.001 within 0.2 %", "reported", "== 1"):
        assert meets(1.0, bar)
        assert meets(3.0, bar) is (bar in (">= 1", "reported"))
    assert fit_order([1, 2, 4], [3, 12, 48]) == pytest.approx(2.0)
