"""Waves in a bar: speed, and order of the dispersion."""

from __future__ import annotations

import numpy as np

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem import judge as qdem_judge
from validation.bench.qdem.checks import check_below, check_between, fit_order
from validation.bench.qdem.closed_forms import find_bar_speed, find_dilatational_speed
from validation.case import Check

STEEL = Material(young=210e9, poisson=0.3, density=7850.0)


def measure_speed(cells: int, poisson: float, periods: float = 3.0) -> float:
    """Speed [m/s] of a wave of one metre that runs along an endless bar of 0.1 m square section.

    Periodic in x.  Poisson's ratio zero: sides free, speed sqrt(E/rho); otherwise the sides
    are on rollers, speed sqrt((lam + 2 mu)/rho).  The speed follows from the phase of the first
    harmonic of u_x after so many periods.  ``cells`` are those along the wave.
    """
    across = max(1, cells // 10)
    mesh = make_box_mesh((1.0, 0.1, 0.1), (cells, across, across))
    sets = mesh.node_sets
    material = Material(STEEL.young, poisson, 7850.0)
    body = Body(mesh, material)
    run = Simulation([body], threads=1, strain="small")
    run.periodic(body, sets["x-min"], sets["x-max"])
    if poisson:
        for axis in "yz":
            run.fix(body, np.union1d(sets[f"{axis}-min"], sets[f"{axis}-max"]), axis)
    speed = find_dilatational_speed(210e9, poisson, 7850.0)
    angle = 2 * np.pi * mesh.nodes[:, 0]
    displacement, velocity = np.zeros_like(mesh.nodes), np.zeros_like(mesh.nodes)
    displacement[:, 0] = 1e-6 * np.sin(angle)
    velocity[:, 0] = -2e-6 * np.pi * speed * np.cos(angle)
    body.displacement, body.velocity = displacement, velocity
    run.advance(periods / speed)
    mass = qdem_judge.lump_mass(mesh.nodes, mesh.elements, 7850.0)
    harmonic = mass @ (body.displacement[:, 0] * np.exp(-1j * angle))
    # u = sin(k (x - c t)) has the first harmonic -i/2 exp(-i k c t)
    behind = np.angle(1j * harmonic * np.exp(2j * np.pi * speed * run.time))
    return float(speed - behind / (2 * np.pi * run.time))


def check_waves(cells: list[int]) -> list[Check]:
    """Bar and dilatational wave: speed at the finest mesh within 1 %, order 2 towards it."""
    rows = []
    for name, poisson, speed in (
        ("bar wave", 0.0, find_bar_speed(210e9, 7850.0)),
        ("dilatational wave", 0.3, find_dilatational_speed(210e9, 0.3, 7850.0)),
    ):
        errors = [measure_speed(each, poisson) / speed - 1 for each in cells]
        sizes = [1 / each for each in cells]
        rows += [
            check_below(
                f"{name}, {cells[-1]} cells a wave: speed to closed form", abs(errors[-1]), 5e-3
            ),
            check_between(f"{name}: order of its dispersion", fit_order(sizes, errors), 1.8, 2.2),
        ]
    return rows
