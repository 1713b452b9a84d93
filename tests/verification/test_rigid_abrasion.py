"""Abrasion: worn volumes to round-off, and forces that move to the edges that are not worn.

Reference: Archard 1953; Schwager and Poeschel 2002, section 8 (end), eq. 38.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp.errors import ShapeError
from rigid_lcp.friction.problem.definition import BodySpace, friction_problem
from rigid_lcp.unique.elastic_limit import elastic_limit
from rigid_lcp.wear.abrasion import friction_work, worn_stiffness, worn_volume


def test_work_of_a_sliding_block():
    """F_T = mu m g over s metres: W = mu m g s, and V = k W; what sticks or pulls wears nothing."""
    force = np.array([[100.0, -30.0], [100.0, 10.0], [50.0, 5.0]])
    velocity = np.array([[0.0, 0.2], [0.0, 0.0], [0.0, 0.1]])
    work = friction_work(force, velocity, 0.5)
    assert work == pytest.approx([30 * 0.2 * 0.5, 0, 0])
    assert worn_volume(work, 1e-13) == pytest.approx([3e-13, 0, 0])
    in_3d = friction_work(np.array([[9.0, -3.0, 4.0]]), np.array([[0.0, 3.0, -4.0]]), 2.0)
    assert in_3d == pytest.approx([50.0])


def test_wear_that_is_no_number_is_refused():
    with pytest.raises(ShapeError, match="wear coefficient"):
        worn_volume([1.0], -1.0)
    with pytest.raises(ShapeError, match="volume_scale"):
        worn_stiffness([1.0], [0.0], 0.0)


def test_forces_leave_a_worn_edge_gradually():
    """A beam on three supports, the middle one wearing: f_i = k_i u by symmetry, so the middle
    share is k_2 / (2 + k_2), from 1/3 towards 0.1 / 2.1; the sum stays the weight."""
    x = np.array([-1.0, 0.0, 1.0])
    rows = np.zeros((6, 3))
    rows[0::2, 1], rows[0::2, 2], rows[1::2, 0] = 1.0, x, 1.0
    space = BodySpace(sp.csr_array(rows), sp.csr_array(sp.diags_array([0.1, 0.1, 0.2])), 3)
    problem = friction_problem(space, rows @ [0, -9.81, 0], 0.0, 2)
    shares = []
    for worn in (0.0, 1e-9, 3e-9, 1e-6):
        k = worn_stiffness(np.ones(3), [0.0, worn, 0.0], 1e-9)
        forces = elastic_limit(problem, k).r[0::2]
        assert forces.sum() == pytest.approx(98.1, rel=1e-12)
        assert forces[1] / 98.1 == pytest.approx(k[1] / (2 + k[1]), rel=1e-11)
        shares.append(forces[1] / 98.1)
    assert (np.diff(shares) < 0).all()
    assert shares[0] == pytest.approx(1 / 3)
    assert shares[-1] == pytest.approx(0.1 / 2.1)
