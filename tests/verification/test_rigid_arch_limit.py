"""Limit analysis of the arch: Milankovitch's thickness for many stones, and where balance turns."""

from __future__ import annotations

import pytest

from validation.bench.rigid.rest_limit import BALANCED, arch_limit, arch_unbalance

MILANKOVITCH = 0.10748
"""Least thickness over mean radius of a semicircular arch of very many stones."""


def test_many_stones_reach_the_known_limit() -> None:
    """The difference is that of straight stones, of the order of the square of their angle."""
    few, many = (abs(arch_limit(stones) - MILANKOVITCH) for stones in (21, 61))
    assert many < 1.5e-4
    assert few / many == pytest.approx((61 / 21) ** 2, rel=0.3)


def test_balance_turns_at_the_limit() -> None:
    limit = arch_limit(9, tolerance=1e-6)
    assert arch_unbalance(9, limit + 1e-5) <= BALANCED
    assert arch_unbalance(9, limit - 1e-4) > 1e3 * BALANCED


def test_an_arch_without_friction_needs_help() -> None:
    """Its lowest stones would slide outwards on their joints: no thickness stands."""
    assert arch_unbalance(9, 0.2, mu=0.0) > 1e3 * BALANCED
