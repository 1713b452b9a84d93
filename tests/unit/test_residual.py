"""Relative errors of eq. 22 against values known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.errors import UsageError
from adapters.laws.fit import residual


def test_relative_errors_tell_displacements_from_coordinates() -> None:
    """Eq. 22 on a jump that is missed whole: 1 of the displacement, 1e-3 of the coordinates."""
    start = np.array([[0.0, 0.0, 1.0]])
    computed = start - [0.0, 0.0, 1e-3]
    assert residual.compare_displacements(start, computed, start) == pytest.approx(1.0)
    assert residual.compare_coordinates(computed, start) == pytest.approx(1e-3, rel=2e-3)
    assert residual.compare_displacements(start, computed, computed) == 0.0
    half = start - [0.0, 0.0, 0.5e-3]
    assert residual.compare_displacements(start, computed, half) == pytest.approx(0.5)
    with pytest.raises(UsageError, match="nothing moved"):
        residual.compare_displacements(start, start, computed)
