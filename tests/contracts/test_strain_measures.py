"""What every strain measure satisfies: linear elasticity, objectivity, energy, one stress for all.

Numbers are of a material with lambda = mu (nu = 0.25), for which each has a potential.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from qdem_fem.element.kinematics import apply_hooke
from qdem_fem.element.strain_measures import MEASURES
from qdem_fem.files import Floats

LAMBDA = MU = 1.0
ROUND_OFF = 1e-13
ASKED = (
    "MEASURE", "OBJECTIVE", "find_stress_numbers", "find_viscous_numbers",
    "compute_nominal_stress", "compute_stored_energy",
)  # fmt: skip

every_measure = pytest.mark.parametrize("name", MEASURES)


def draw_gradients(scale: float, seed: int = 0, count: int = 20) -> Floats:
    """Random displacement gradients (count, 3, 3)."""
    return np.random.default_rng(seed).uniform(-scale, scale, (count, 3, 3))


def stress_small(H: Floats) -> Floats:
    """Nominal stress of linear elasticity."""
    return apply_hooke((H + np.swapaxes(H, 1, 2)) / 2, LAMBDA, MU)


@every_measure
def test_nothing_is_missing(name: str) -> None:
    """A file sets and defines all that `qdem_fem.element.strain_measures` asks for."""
    missing = [word for word in ASKED if not hasattr(MEASURES[name], word)]
    assert not missing, f"the strain measure {name} lacks {', '.join(missing)}"
    assert MEASURES[name].MEASURE._fields == ("half",)
    assert MEASURES[name].OBJECTIVE in (True, False)


@every_measure
def test_small_strains_are_linear_elasticity(name: str) -> None:
    """|P - P_small| / |P_small| is of the order of the strain, and falls with it."""
    error = []
    for scale in (1e-4, 1e-5):
        H = draw_gradients(scale)
        small = stress_small(H)
        P = MEASURES[name].compute_nominal_stress(H, LAMBDA, MU)
        error.append(np.linalg.norm(P - small) / np.linalg.norm(small))
    assert error[0] < 2e-3
    assert error[1] < 0.11 * error[0] + ROUND_OFF


@every_measure
def test_objective_or_says_that_it_is_not(name: str) -> None:
    """P(Q F) = Q P(F) exactly where ``OBJECTIVE`` says so."""
    H, Q = draw_gradients(0.3), Rotation.random(20, random_state=2).as_matrix()
    P = MEASURES[name].compute_nominal_stress(H, LAMBDA, MU)
    turned = MEASURES[name].compute_nominal_stress(Q @ (np.eye(3) + H) - np.eye(3), LAMBDA, MU)
    assert (np.abs(turned - Q @ P).max() < 1e-11) == MEASURES[name].OBJECTIVE


@every_measure
@pytest.mark.parametrize("scale", [1e-6, 0.2])
def test_stress_is_the_slope_of_the_energy(name: str, scale: float) -> None:
    """P = dW/dF by central differences of fourth order; step 0.02 of the strain."""
    H, step, one = draw_gradients(scale), 0.02 * scale, np.ones(20)
    P = MEASURES[name].compute_nominal_stress(H, LAMBDA, MU)
    slope = np.empty_like(P)
    for i, j in np.ndindex(3, 3):
        way = np.zeros((3, 3))
        way[i, j] = step
        far, near = (
            MEASURES[name].compute_stored_energy(H + k * way, one, LAMBDA, MU)
            - MEASURES[name].compute_stored_energy(H - k * way, one, LAMBDA, MU)
            for k in (2, 1)
        )
        slope[:, i, j] = (8 * near - far) / (12 * step)
    np.testing.assert_allclose(slope, P, rtol=0, atol=1e-8 * np.abs(P).max())


@every_measure
@pytest.mark.parametrize("scale", [1e-12, 1e-3, 0.2])
def test_stress_of_numbers_is_that_of_arrays(name: str, scale: float) -> None:
    """`find_stress_numbers`, on arrays and compiled, is the nominal stress, and J = det F."""
    H = draw_gradients(scale)
    expected = MEASURES[name].compute_nominal_stress(H, 0.7, 1.3)
    found, jacobian = MEASURES[name].find_stress_numbers(tuple(H.reshape(-1, 9).T), 0.7, 1.3, 0.5)
    bound = 100 * ROUND_OFF * np.abs(expected).max()
    np.testing.assert_allclose(np.stack(found, -1).reshape(-1, 3, 3), expected, atol=bound)
    if MEASURES[name].OBJECTIVE:
        np.testing.assert_allclose(jacobian, np.linalg.det(np.eye(3) + H), rtol=ROUND_OFF)
    compiled: Any = njit(MEASURES[name].find_stress_numbers, error_model="numpy")
    alone, _ = compiled(tuple(map(float, H[3].ravel())), 0.7, 1.3, 0.5)
    np.testing.assert_allclose(np.reshape(alone, (3, 3)), expected[3], atol=bound)


@every_measure
def test_viscosity_takes_energy(name: str) -> None:
    """The viscous stress does work against any motion but the pure turn, P_D : Hdot > 0."""
    H, rate = draw_gradients(0.2), draw_gradients(1.0, seed=1)
    h, d = (tuple(A.reshape(-1, 9).T) for A in (H, rate))
    for first, second in ((-2 / 3, 1.0), (1.0, 0.0)):
        stress = MEASURES[name].find_viscous_numbers(h, d, first, second, 0.5)
        assert (sum(p * r for p, r in zip(stress, d, strict=True)) > 0).all()
