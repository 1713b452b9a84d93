"""Modes of the Type-3 sleeper: what its printed measures allow, and what 200, 400, 800 Hz ask for.

Nishiura et al. 2017, section 4.2, names the first three vertical bending modes of a modal analysis
that it cites; section and taper of the sleeper are not printed.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize

from qdem_fem import Material
from qdem_fem.mesh_checks import FloatArray
from qdem_fem.sleeper_mesh import SleeperShape, sleeper_mesh
from qdem_fem.sleeper_modes import free_modes

CONCRETE = Material(young=45e9, poisson=0.167, density=2350)
"""Sleeper, Table 1 of the paper."""
PAPER_MODES = np.array([200.0, 400.0, 800.0])
SHEAR = 0.843
"""Shear coefficient of a rectangle at nu = 0.167: 10 (1 + nu)/(12 + 11 nu) (Cowper 1966)."""
SHAPES = {
    "rectangle, 0.24 m": SleeperShape(top_width=0.24),
    "trapezoid, 0.24 to 0.17 m (assumed here)": SleeperShape(),
    "the same, ends 0.14 m high": SleeperShape(end_height=0.14),
    "the same, waist 0.15 m high": SleeperShape(centre_height=0.15),
    "the same, waist 0.15, ends 0.14 m": SleeperShape(centre_height=0.15, end_height=0.14),
}


def beam_modes(x: FloatArray, area: FloatArray, inertia: FloatArray, count: int = 3) -> FloatArray:
    """Lowest bending frequencies [Hz] of a free Timoshenko beam whose section varies.

    ``x`` (n,) [m], ``area`` [m^2] and ``inertia`` [m^4] there; two-node elements with mean
    section, exact in statics, consistent mass with rotary inertia (Przemieniecki 1968, ch. 5, 11).
    """
    young, density = float(CONCRETE.young), float(CONCRETE.density)
    shear_modulus = young / 2 / (1 + float(CONCRETE.poisson))
    stiffness, mass = np.zeros((2, 2 * len(x), 2 * len(x)))
    for e, length in enumerate(np.diff(x)):
        a, i = area[e : e + 2].mean(), inertia[e : e + 2].mean()
        phi = 12 * young * i / (SHEAR * shear_modulus * a * length**2)
        p, q, m = 6 * length, (4 + phi) * length**2, (2 - phi) * length**2
        k = np.array([[12, p, -12, p], [p, q, -p, m], [-12, -p, 12, -p], [p, m, -p, q]])
        s, t, u, w = 22 * length, 13 * length, 4 * length**2, -3 * length**2
        shift = np.array([[156, s, 54, -t], [s, u, t, w], [54, t, 156, -s], [-t, w, -s, u]])
        r, v = 3 * length, -(length**2)
        turn = np.array([[36, r, -36, r], [r, u, -r, v], [-36, -r, 36, -r], [r, v, -r, u]])
        at = slice(2 * e, 2 * e + 4)
        stiffness[at, at] += young * i / (1 + phi) / length**3 * k
        mass[at, at] += density * (a * length / 420 * shift + i / 30 / length * turn)
    value = eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, count + 1])
    return np.asarray(np.sqrt(value[2:]) / 2 / np.pi)


def tapered(height: FloatArray, half: FloatArray, at: FloatArray) -> FloatArray:
    """Frequencies of the assumed section with other heights at ``half`` (k,), over half a length
    from the centre; the sides stay planes."""
    shape = SleeperShape()
    h = np.interp(np.abs(at / shape.length * 2 - 1), half, height)
    b, t = shape.width, shape.width_at(h)
    return beam_modes(at, h * (b + t) / 2, h**3 * (b**2 + 4 * b * t + t**2) / 36 / (b + t))


def profile_nearest(half: FloatArray, seats: bool, at: FloatArray) -> dict[str, Any]:
    """The heights, at most 0.174 m, at places ``half`` from the centre to the end, whose three
    frequencies come nearest to the paper's: least sum of squares of their logarithms.

    With ``seats`` the places within a rail seat keep 0.174 m, none goes below 0.05 m, and
    Young's modulus is free as well: only the ratios of the frequencies count.
    """
    shape = SleeperShape()
    middle = shape.seat_distance / shape.length
    held = seats & (np.abs(half - middle) <= shape.seat_length / shape.length * 1.001)
    floor = 0.05 if seats else 0.0

    def heights(free: FloatArray) -> FloatArray:
        found = floor + (shape.height - floor) / (1 + np.exp(-free))
        return np.asarray(np.where(held, shape.height, found))

    def misfits(free: FloatArray) -> FloatArray:
        away = np.log(tapered(heights(free), half, at) / PAPER_MODES)
        return np.asarray(away - away.mean() if seats else away)

    best = minimize(lambda free: float((misfits(free) ** 2).sum()), np.full(len(half), 2.0),
                    method="Nelder-Mead",
                    options={"maxiter": 1500, "xatol": 1e-3, "fatol": 1e-7})  # fmt: skip
    return {
        "half": half.tolist(), "height": heights(best.x).tolist(),
        "frequency": tapered(heights(best.x), half, at).tolist(),
        "nearest": (PAPER_MODES * np.exp(misfits(best.x))).tolist(),
    }  # fmt: skip


def sleeper_part(folder: Path) -> dict[str, Any]:
    """Vertical modes of assumed shapes, of QDEM's meshes, and of tapers by beam theory."""
    shapes, meshes = [], []
    for name, shape in SHAPES.items():
        modes = free_modes(sleeper_mesh(shape, 30, 4, 3), CONCRETE, 9, quadratic=True)
        vertical = [f for f, kind in zip(modes.frequency, modes.kind, strict=True)
                    if kind == "vertical"]  # fmt: skip
        x = np.linspace(0, shape.length, 121)
        beam = beam_modes(x, shape.area_at(x), shape.inertia_at(x))
        shapes.append({
            "name": name, "mass": shape.volume * float(CONCRETE.density),
            "vertical": vertical[:3], "beam": beam.tolist(),
            "others": [(kind, float(f)) for f, kind in zip(modes.frequency, modes.kind,
                                                           strict=True)
                       if kind != "vertical"][:4],
        })  # fmt: skip
    exact = np.array(shapes[1]["vertical"])
    for cells in ((40, 4, 4), (60, 6, 5), (80, 8, 6), (110, 11, 8)):
        started = time.process_time()
        mesh = sleeper_mesh(SleeperShape(), *cells)
        modes = free_modes(mesh, CONCRETE, 8)
        vertical = [f for f, kind in zip(modes.frequency, modes.kind, strict=True)
                    if kind == "vertical"]  # fmt: skip
        meshes.append({
            "cells": cells, "tetrahedra": len(mesh.elements), "nodes": len(mesh.nodes),
            "vertical": vertical[:3], "error": (np.array(vertical[:3]) / exact - 1).tolist(),
            "cpu_s": time.process_time() - started,
        })  # fmt: skip
    at = np.linspace(0, 2, 81)
    wedges = [
        (end, tapered(np.array([0.174, end]), np.array([0.0, 1.0]), at).tolist())
        for end in (0.174, 0.14, 0.10, 0.06, 0.03)
    ]
    seat = SleeperShape().stations[4:6] - 1.0
    with_seats = np.array([0.0, seat[0] / 2, *seat, (1 + seat[1]) / 2, 1.0])
    return {
        "shapes": shapes, "meshes": meshes, "wedges": wedges,
        "wanted": profile_nearest(np.linspace(0, 1, 7), False, at),
        "seated": profile_nearest(with_seats, True, at),
    }  # fmt: skip
