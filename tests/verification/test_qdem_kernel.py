"""The compiled kernel: its forces against NumPy, its machine code, its bits, its cache."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numba
import numpy as np
import pytest
from numba.core import types

import qdem_fem as q
from qdem_fem import kernel, lanes, reference_forces, stress
from qdem_fem.assembly import NO_LOADS
from qdem_fem.layout import layout_build
from qdem_fem.reference_forces import Elements, Strain, displacement_gradient, volume_change
from validation.cases.qdem_hard_cases import delaunay_mesh

LAWS: tuple[Strain, ...] = get_args(Strain)
LAW = pytest.mark.parametrize("law", LAWS)
PRECISION = pytest.mark.parametrize("precision", ["float64", "float32"])
VISCOUS = pytest.mark.parametrize("viscous", [False, True], ids=["elastic", "viscous"])
ROOT = Path(__file__).parents[2]


@cache
def mesh(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Meshes whose sizes do not fit the lanes, the blocks or the chunks."""
    if name == "one":
        return np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 1, 0], [0.1, 0.3, 1.1]]), np.array(
            [[0, 1, 2, 3]]
        )
    if name == "chunks":  # four chunks, and a number of elements that no register divides
        nodes, elements = delaunay_mesh(700, 1)
        return nodes, elements[: 16 * (len(elements) // 16) - 3]
    nodes, elements = delaunay_mesh(40, 0)
    if name == "unused":  # first, middle and last
        nodes = np.insert(nodes, [0, 20, 40], 0.5, axis=0)
        number = np.delete(np.arange(43), [0, 21, 42])
        return nodes, number[elements]
    if name == "parts":
        other, more = delaunay_mesh(17, 2)
        return np.concatenate([nodes, other + 5]), np.concatenate([elements, more + 40])
    return nodes, elements[: len(elements) // 16 * 16 + 1]


MESHES = ("one", "small", "unused", "parts", "chunks")


def material(elements: int, viscous: bool, seed: int = 3) -> q.Material:
    """Another material in every element."""
    generator = np.random.default_rng(seed)
    shear, bulk = generator.uniform(10, 900, (2, elements)) * viscous
    return q.Material(
        generator.uniform(1e5, 9e5, elements),
        generator.uniform(-0.3, 0.45, elements),
        generator.uniform(500, 4000, elements),
        shear,
        bulk,
    )


@cache
def simulation(name: str, law: Strain, precision: Any, viscous: bool) -> tuple[q.Body, Any]:
    """A body on its own, at rest."""
    nodes, elements = mesh(name)
    body = q.Body((nodes, elements), material(len(elements), viscous))
    return body, q.Simulation([body], strain=law, precision=precision, step=1.0, threads=1)


def kernel_forces(run: Any, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Nodal forces [N], (n, 3), as one step of the kernel adds them to nodes at rest or not."""
    _, held = run.assembly.lists(run.conditions)
    table = np.ones((2, 1))
    return run.assembly.mass[:, None] * run.assembly.accelerations(
        u, v, NO_LOADS, held, table, None
    )


def force_scale(body: q.Body, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Size [N], (n,), of which round-off is a multiple: sums of the magnitudes of what is added.

    A gradient is a sum of products edge x gradient, so its rounding error is of the order of
    sum |e_a| |g_a| =: |H|', however small H itself is; P is at most of third order in F with
    the moduli in front, T_D cof F of order |Hdot|' |F|^4 / J.
    """
    gradients, volumes = body.gradients
    m = body.material
    length = np.linalg.norm(gradients, axis=2)
    corner = body.elements
    h, d = (
        (np.linalg.norm(f[corner[:, 1:]] - f[corner[:, :1]], axis=2) * length).sum(axis=1)
        for f in (u, v)
    )
    size = (abs(m.lame_first) + 2 * m.lame_second) * h * (1 + h) ** 3
    jacobian = 1 + volume_change(displacement_gradient(gradients, corner, u))
    viscous = abs(m.viscous_first) + 2 * m.viscous_second
    size = size + viscous * d * (1 + h) ** 4 / np.minimum(1, jacobian)
    per_node = np.repeat(volumes * size * length.sum(axis=1), 4)
    return np.bincount(corner.ravel(), per_node, len(u))


def stretched(body: q.Body, scale: float, dtype: str, seed: int = 5) -> np.ndarray:
    """Random displacement [m], (n, 3), in numbers of the precision; strains of ``scale``.

    At most: each element's own |H|' is bounded, so that none is inverted.
    """
    u = np.random.default_rng(seed).uniform(-1, 1, body.nodes.shape)
    gradients, _ = body.gradients
    edge = u[body.elements[:, 1:]] - u[body.elements[:, :1]]
    strain = (np.linalg.norm(edge, axis=2) * np.linalg.norm(gradients, axis=2)).sum(axis=1)
    worst = np.zeros(len(u))
    np.maximum.at(worst, body.elements.ravel(), np.repeat(strain, 4))
    u *= scale / max(strain.max(), 1e-300)
    return u.astype(dtype).astype(float)


@pytest.mark.parametrize("name", MESHES)
@VISCOUS
@PRECISION
@LAW
def test_forces_are_those_of_numpy(law: Strain, precision: str, viscous: bool, name: str) -> None:
    """f = sum -V0 P grad N (eq. 11) against `reference_forces.internal_forces`, to round-off.

    Both round some 30 times on the way from u to f, each time by at most half an epsilon of
    `force_scale`: 15 epsilons bound the difference, and 2 are what is found (3e-16 of the
    largest force in double).  Viscous bodies move, elastic ones do not, so that the force read
    from the change of velocity loses no digit to the velocity.
    """
    body, run = simulation(name, law, precision, viscous)
    gradients, volumes = body.gradients
    m = body.material
    for scale in (1e-12, 1e-6, 1e-3, 0.2, 0.7):
        u = stretched(body, scale, precision)
        v = stretched(body, 1e3 * scale, precision, seed=6) * viscous
        expected = reference_forces.internal_forces(
            Elements(body.elements, gradients, volumes),
            u,
            v,
            (m.lame_first, m.lame_second),
            (m.viscous_first, m.viscous_second),
            law,
        )
        error = abs(kernel_forces(run, u, v) - expected).max(axis=1)
        size = force_scale(body, u, v) + abs(v).max() * run.assembly.mass
        assert (error <= 15 * np.finfo(precision).eps * size).all()
        assert abs(expected).max() > 1e-6 * size.max()  # there is something to compare
