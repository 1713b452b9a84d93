"""Measures of a ballast bed on data whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from validation.rigid_ballast_measures import (
    Floats,
    dissipated,
    fabric_of,
    settlement_law,
)


@pytest.mark.parametrize("kind", ["log", "linear"])
def test_law_finds_its_own_coefficients(kind: str) -> None:
    cycles = np.arange(1, 21, dtype=float)
    column: Floats = np.log(cycles) if kind == "log" else cycles
    settlement = 1e-3 + 2e-4 * column
    a, b, error = settlement_law(settlement, kind)
    assert (a, b) == pytest.approx((1e-3, 2e-4), rel=1e-10)
    assert error < 1e-15


def test_fabric_of_a_column() -> None:
    """Three stones upon each other, two points a face: all normals vertical, anisotropy 2."""
    bodies = [[1, 0], [1, 0], [2, 1], [2, 1], [3, 2], [3, 2], [3, 1]]
    force = [[2.0, 1.2], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
    found = fabric_of(
        {"bodies": bodies, "normal": [[0.0, 1.0]] * 7, "force": force}, stones=3, friction=0.6
    )
    assert found["contacts"] == 6
    assert found["coordination"] == pytest.approx(2.0)
    assert found["anisotropy"] == pytest.approx(2.0)
    assert found["direction"] == pytest.approx(0.0)
    assert found["sliding"] == pytest.approx(1 / 6)
    assert found["force_mean"] == pytest.approx(7 / 6)


def test_isotropic_normals_have_no_anisotropy() -> None:
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    normal = np.column_stack([np.cos(turn), np.sin(turn)])
    found = fabric_of(
        {"bodies": [[1, 0]] * 12, "normal": normal, "force": [[1.0, 0.0]] * 12}, 1, 0.5
    )
    assert found["anisotropy"] == pytest.approx(0.0, abs=1e-12)


def test_no_contact_has_no_fabric() -> None:
    none = {"bodies": np.zeros((0, 2)), "normal": np.zeros((0, 2)), "force": np.zeros((0, 2))}
    assert fabric_of(none, 3, 0.5)["coordination"] == 0.0


def test_dissipation_is_work_less_gain() -> None:
    np.testing.assert_allclose(dissipated([0.0, 3.0, 5.0], [1.0, 2.0, 1.0]), [2.0, 3.0])
