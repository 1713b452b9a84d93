"""What callers give that numpy would read without a word, or break at: one of our own sentences."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, aslinearoperator

from rigid_lcp import (
    BodySpace,
    Disc,
    HalfSpace,
    Polygon,
    Polyhedron,
    Scene,
    Simulation,
    collide,
    lcp,
    solve_friction,
)
from rigid_lcp.errors import ProblemError, SceneError, ShapeError

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
W = np.array([[2.0, 0.5], [0.5, 3.0]])
Q = np.array([-1.0, 0.8])


# --- shapes and bodies ----------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [(0, 1), (0, 0, 1)])
@pytest.mark.parametrize("offset", [[3.0], [1.0, 2.0], [[1.0]]])
def test_an_offset_of_several_numbers_is_named(normal, offset):
    with pytest.raises(ShapeError, match=r"half-space: the offset is \["):
        HalfSpace(normal, offset)


def test_masked_numbers_are_not_taken_for_what_they_hide():
    """The mask was left out: a polygon had the corners that its owner had struck out."""
    masked = np.ma.masked_equal
    with pytest.raises(ShapeError, match="masked"):
        Polygon(masked(SQUARE, 1.0))
    with pytest.raises(ShapeError, match="masked"):
        Polyhedron(masked(np.vstack([np.zeros(3), np.eye(3)]), 1.0))
    for what in ("position", "velocity"):
        with pytest.raises(SceneError, match=what):
            Scene().add(Disc(1.0), density=1.0, **{what: masked([0.0, 5.0], 5.0)})
    scene = Scene()
    scene.add(Polygon(np.ma.array(SQUARE)), density=1.0, position=np.ma.array([0.0, 5.0]))
    assert scene.bodies[0].position[1] == 5.0  # an array without a mask is one like any other


@pytest.mark.parametrize("method", ["time-stepping", "acceleration"])
@pytest.mark.parametrize(
    ("answer", "word"),
    [(np.full((1, 3), 1j), "complex"), (np.ma.masked_equal(np.eye(1, 3), 1.0), "masked"),
     ("a", "string")],
)  # fmt: skip
def test_loads_that_are_not_real_are_named(method, answer, word):
    """Of complex ones the real part acted."""
    scene = Scene()
    scene.add(Disc(1.0), density=1.0)
    run = Simulation(scene, method, loads=lambda time, motion: answer)
    with pytest.raises(SceneError, match=rf"loads at .* they are not real numbers.*{word}"):
        run.advance(0.01)
    assert run.time == 0.0


# --- friction problems ----------------------------------------------------------------------------


def operator(product, shape=(2, 2)):
    """Something with products and, unless it is None, a shape."""
    return SimpleNamespace(matmat=product, **({} if shape is None else {"shape": shape}))


class Linear(LinearOperator):
    """scipy's operator, whose product with a vector is ``answer``."""

    def __init__(self, answer):
        super().__init__(float, (2, 2))
        self.answer = answer

    def _matvec(self, x):
        return self.answer


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (operator(lambda x: W @ x, None), "shape is None"),
        (operator(lambda x: W @ x, (2,)), r"shape is \(2,\)"),
        (operator(lambda x: W @ x, (2, 2.0)), r"shape is \(2, 2.0\)"),
        (operator(lambda x: np.ones(3)), r"has shape \(3,\), not \(2, 2\)"),
        (operator(lambda x: None), r"has shape \(\), not \(2, 2\)"),
        (operator(lambda x: 1j * W @ x), "complex"),
        (Linear(np.ones(3)), "product failed.*reshape"),
        (Linear(None), "product failed.*reshape"),
    ],
)
def test_operators_that_are_none_are_named(given, words):
    with pytest.raises(ProblemError, match=rf"^W: .*{words}.*\n  -> "):
        solve_friction(given, Q, 0.3, 2)
    with pytest.raises(ProblemError, match=rf"^A: .*{words}"):
        lcp(given, Q)


@pytest.mark.parametrize("given", [operator(lambda x: W @ x), aslinearoperator(W)])
def test_operators_are_the_matrix_of_their_products(given):
    found = solve_friction(given, Q, 0.3, 2)
    np.testing.assert_array_equal(found.r, solve_friction(W, Q, 0.3, 2).r)


def test_an_operator_s_own_error_stays_what_it_is():
    with pytest.raises(ZeroDivisionError):
        solve_friction(operator(lambda x: 1 / 0), Q, 0.3, 2)


@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("kind", [complex, object])
def test_factors_that_are_not_real_are_named(part, kind):
    """Complex ones were an error of the compiler, objects one of numpy."""
    given = [sp.csr_array(np.eye(2, 3)), sp.csr_array(np.eye(3))]
    rows = given[part]
    data = rows.data.astype(kind)
    given[part] = sp.csr_array((data, rows.indices, rows.indptr), shape=rows.shape)
    bodies = BodySpace(given[0], given[1], 3)
    name = ("jacobian", "inverse_mass")[part]
    for call in (
        lambda: solve_friction(bodies, Q, 0.3, 2), lambda: collide(bodies, [-1.0, 0, 0], 0.5)
    ):  # fmt: skip
        with pytest.raises(ProblemError, match=f"BodySpace: {name} is not made of numbers"):
            call()
