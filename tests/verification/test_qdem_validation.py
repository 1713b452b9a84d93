"""The validation of QDEM in its smallest forms, and proof that its checks can fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qdem_fem import Body
from validation import (
    qdem_energy,
    qdem_motion,
    qdem_protocol,
    qdem_rotation,
    qdem_slab,
    qdem_static,
    qdem_vibration,
    qdem_viscous,
    qdem_waves,
)
from validation.case import Check
from validation.qdem_problem import below, cantilever, near, orders, smooth_step, tip_node

SMALL = (12, 2, 2)


def hold(checks: list[Check]) -> None:
    """All of them, or say which do not."""
    failing = [f"{check.name}: {check.value:.4g}, bar {check.bar}" for check in checks]
    assert all(check.holds for check in checks), "\n".join(failing)


# --- the parts, small ------------------------------------------------------------------------


def test_static_answers_by_relaxation_and_by_whole_periods() -> None:
    """K u = f: both ways agree with scikit-fem on the same mesh, and with each other."""
    problem = cantilever(SMALL)
    relaxed, settled = qdem_static.relaxed(problem), qdem_static.settled(problem)
    hold(qdem_static.answer_checks("relaxed", relaxed))
    hold(qdem_static.answer_checks("settled", settled))
    assert relaxed.tip == pytest.approx(settled.tip, rel=1e-5)


def test_order_of_convergence_towards_the_reference_of_second_order() -> None:
    """Excess stiffness of linear elements goes with h^2, here by relaxation, which costs less."""
    answers = [qdem_static.relaxed(cantilever((12 * k, 2 * k, 2 * k))) for k in (2, 3)]
    hold(qdem_static.convergence_checks("small", answers, qdem_static.TIP_P2))


def test_first_frequency_after_unloading() -> None:
    """Fit of damped cosines to the tip against eigsh of (K, lumped M): 0.1 %."""
    mode, expected = qdem_vibration.first_frequency(cantilever(SMALL))
    assert mode.frequency == pytest.approx(expected, rel=1e-3)
    assert abs(mode.decay) < 1e-4 * expected


def test_five_frequencies() -> None:
    """One skew release holds the five lowest modes, each within 0.1 % of the judge's."""
    five = qdem_vibration.five_frequencies(cantilever(SMALL))
    assert np.abs(five.found / five.judge - 1).max() < 1e-3
    assert len(set(five.found)) == 5


def test_motion_is_of_second_order_in_the_step() -> None:
    """QDEM and Newmark (beta = 1/4) against the sum over all modes, which is exact in time."""
    hold(qdem_motion.motion_checks(cantilever(SMALL)))


def test_the_paper_s_load_and_release_next_to_newmark() -> None:
    """Ramp, rest and release in a tenth of the paper's times: mean and history of the tip."""
    checks, both = qdem_protocol.protocol_checks(cantilever(SMALL, "five"), 0.1, 0.2, 0.3)
    hold(checks)
    assert both.time[-1] == pytest.approx(0.3)
    assert np.abs(both.qdem).max() > 20e-6


def test_invariant_of_the_leapfrog() -> None:
    """1/2 v-.M v+ + 1/2 u.K u stays to rounding for the linear law."""
    assert qdem_energy.invariant_drift(qdem_energy.block(), 10_000) < 1e-13


def test_energy_of_a_law_with_potential_wavers_with_the_square_of_the_step() -> None:
    """Saint-Venant and Kirchhoff at strains of 1 %."""
    hold(qdem_energy.law_checks("svk", duration=0.25))


def test_energy_stays_in_its_band_where_there_is_a_potential_and_grows_where_there_is_none() -> (
    None
):
    """The Finger law has a potential at lam = mu alone; at nu = 0.167 it gains with the strains."""
    hold(qdem_energy.long_checks(5_000))
    gained = [check.value for check in qdem_energy.without_potential_checks(10_000)]
    assert gained[0] > 3 * abs(gained[1]) > 3e-5


def test_thickness_mode_decays_by_four_thirds_of_the_viscosity() -> None:
    """(4/3) k^2 mu_D/(2 rho), k = pi/2H, within 1 %."""
    hold(qdem_viscous.decay_checks(8))


@pytest.mark.long
def test_creep_in_uniaxial_strain_has_four_thirds_of_the_viscosity() -> None:
    """Within 0.5 % of the closed form at 4/3 mu_D/E, and far from eq. 14's mu_D/E."""
    time, strain = qdem_viscous.creep_run(free_sides=False)
    closed = qdem_viscous.convolved(qdem_viscous.creep_uniaxial_strain, time)
    eq14 = qdem_viscous.convolved(qdem_viscous.creep_equation_14, time)
    assert np.abs(strain - closed).max() < 5e-3 * closed.max()
    assert np.abs(strain - eq14).max() > 5e-2 * closed.max()


def test_equation_14_is_a_solid_of_negative_bulk_viscosity_and_its_printed_sign_is_wrong() -> None:
    """Axial viscosity lam_D + 2 mu_D = mu_D asks for lam_D = -mu_D; strain must not jump."""
    hold(qdem_slab.equation_14_checks(100))


def test_ends_that_do_not_slip() -> None:
    """The paper's slab: decay of its thickness mode against phi C phi/2 of the same mesh."""
    checks = qdem_slab.decay_checks((20, 4, 4))
    hold(checks)


def test_spin_keeps_strain_and_angular_momentum() -> None:
    """Two turns of a free irregular block."""
    hold(qdem_rotation.spin_checks(2))


def test_patches() -> None:
    """Uniform gradients of 10 % on two random meshes: stress exact, inner nodes in balance."""
    hold(qdem_rotation.patch_checks(2))


def test_waves_of_a_bar() -> None:
    """sqrt(E/rho) and sqrt((lam + 2 mu)/rho), dispersion of second order."""
    hold(qdem_waves.wave_checks([10, 20, 30]))


def test_ring_against_its_own_eigenvalues() -> None:
    """Breathing and bending of a free ring, all modes of the same mesh by LAPACK."""
    hold(qdem_waves.ring_checks((1, 48, 1), exact=True))


# --- the checks can fail ----------------------------------------------------------------------


def test_a_wrong_answer_fails() -> None:
    """A displacement 2e-5 too large fails the tip; a modulus 0.1 % too large fails the stress."""
    problem = cantilever(SMALL)
    good = qdem_static.relaxed(problem)
    assert good.difference < 1e-6
    off = replace(good, displacement=(1 + 2e-5) * good.displacement)
    assert not qdem_static.answer_checks("off", off)[0].holds
    off = replace(good, displacement=(1 + 2e-3) * good.displacement)
    checks = qdem_static.answer_checks("off", off)
    assert not any(check.holds for check in checks[:3])


def test_small_strain_fails_the_spin(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under the linear law a turning body is stretched: the spin's check must see it."""
    simulation = qdem_rotation.Simulation
    monkeypatch.setattr(
        qdem_rotation,
        "Simulation",
        lambda bodies, **o: simulation(bodies, **(o | {"strain": "small"})),
    )
    assert not all(check.holds for check in qdem_rotation.spin_checks(0.2))


def test_wrong_viscosity_fails_the_decay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bulk viscosity of 5 % of mu_D changes the decay by 3.75 %: seen."""
    material = qdem_viscous.Material
    monkeypatch.setattr(
        qdem_viscous,
        "Material",
        lambda *a, shear_viscosity: material(
            *a, shear_viscosity=shear_viscosity, bulk_viscosity=0.05 * shear_viscosity
        ),
    )
    decays = [check for check in qdem_viscous.decay_checks(8) if "decay to" in check.name]
    assert not any(check.holds for check in decays)


# --- tools ------------------------------------------------------------------------------------


def test_a_smooth_step_leaves_the_first_mode_at_rest() -> None:
    """|integral of ds/dt exp(i w t)| is zero for whole periods from two on, and not for one."""
    step = smooth_step(1.0)
    rate = np.diff(step.values)
    middle = 0.5 * (step.times[1:] + step.times[:-1])
    left = [abs((rate * np.exp(2j * np.pi * n * middle)).sum()) for n in (1, 2, 3)]
    assert left[0] == pytest.approx(0.5, rel=1e-3)
    assert max(left[1:]) < 1e-5


def test_a_step_back_ends_where_it_began() -> None:
    step = smooth_step(0.5, start=1.0, back=3.0)
    assert step(0.9) == 0.0
    assert step(2.0) == pytest.approx(1.0)
    assert step(1.25) == pytest.approx(0.5, abs=1e-3)
    assert step(4.0) == pytest.approx(0.0, abs=1e-12)


def test_bars() -> None:
    assert not below("x", float("nan"), 1.0).holds
    assert near("x", 1.004, 1.0, 0.005).holds
    assert not near("x", 1.006, 1.0, 0.005).holds
    assert orders([1, 2, 4], [3, 12, 48]) == pytest.approx(2.0)


def test_problem_and_body_agree_about_the_mass() -> None:
    problem = cantilever(SMALL)
    body, run = problem.simulation()
    assert isinstance(body, Body)
    np.testing.assert_allclose(run.assembly.mass, problem.mass, rtol=1e-14)
    np.testing.assert_array_equal(body.nodes[tip_node(problem.mesh)], [2.4, 0.125, 0.11])
