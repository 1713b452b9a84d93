"""Waves in a bar, and bodies that are no box: a ring, and a block with holes from a generator."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from scipy.linalg import eigh

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh_generation import box_mesh, gmsh_box, ring_mesh
from qdem_fem.spectra import peak_frequencies
from validation import qdem_judge
from validation.case import Check
from validation.qdem_closed_forms import bar_speed, dilatational_speed
from validation.qdem_judge import FloatArray
from validation.qdem_problem import below, between, clamped, orders, reported, tip_node
from validation.qdem_record import Outcome
from validation.qdem_static import relaxed
from validation.qdem_vibration import first_frequency

STEEL = Material(young=210e9, poisson=0.3, density=7850.0)


# --- waves ------------------------------------------------------------------------------------


def wave_speed(cells: int, poisson: float, periods: float = 3.0) -> float:
    """Speed [m/s] of a wave of one metre that runs along an endless bar of 0.1 m square section.

    Periodic in x.  Poisson's ratio zero: sides free, speed sqrt(E/rho); otherwise the sides
    are on rollers, speed sqrt((lam + 2 mu)/rho).  The speed follows from the phase of the first
    harmonic of u_x after so many periods.  ``cells`` are those along the wave.
    """
    across = max(1, cells // 10)
    mesh = box_mesh((1.0, 0.1, 0.1), (cells, across, across))
    sets = mesh.node_sets
    material = Material(STEEL.young, poisson, 7850.0)
    body = Body(mesh, material)
    run = Simulation([body], threads=1, strain="small")
    run.periodic(body, sets["x-min"], sets["x-max"])
    if poisson:
        for axis in "yz":
            run.fix(body, np.union1d(sets[f"{axis}-min"], sets[f"{axis}-max"]), axis)
    speed = dilatational_speed(210e9, poisson, 7850.0)
    angle = 2 * np.pi * mesh.nodes[:, 0]
    displacement, velocity = np.zeros_like(mesh.nodes), np.zeros_like(mesh.nodes)
    displacement[:, 0] = 1e-6 * np.sin(angle)
    velocity[:, 0] = -2e-6 * np.pi * speed * np.cos(angle)
    body.displacement, body.velocity = displacement, velocity
    run.advance(periods / speed)
    mass = qdem_judge.lumped_mass(mesh.nodes, mesh.elements, 7850.0)
    harmonic = mass @ (body.displacement[:, 0] * np.exp(-1j * angle))
    # u = sin(k (x - c t)) has the first harmonic -i/2 exp(-i k c t)
    behind = np.angle(1j * harmonic * np.exp(2j * np.pi * speed * run.time))
    return float(speed - behind / (2 * np.pi * run.time))


def wave_checks(cells: list[int]) -> list[Check]:
    """Bar and dilatational wave: speed at the finest mesh within 1 %, order 2 towards it."""
    rows = []
    for name, poisson, speed in (
        ("bar wave", 0.0, bar_speed(210e9, 7850.0)),
        ("dilatational wave", 0.3, dilatational_speed(210e9, 0.3, 7850.0)),
    ):
        errors = [wave_speed(each, poisson) / speed - 1 for each in cells]
        sizes = [1 / each for each in cells]
        rows += [
            below(f"{name}, {cells[-1]} cells a wave: speed to closed form", abs(errors[-1]), 5e-3),
            between(f"{name}: order of its dispersion", orders(sizes, errors), 1.8, 2.2),
        ]
    return rows


# --- a ring -----------------------------------------------------------------------------------

RADIUS, WIDTH, DEPTH = 0.5, 0.05, 0.05
"""Mean radius, width along it and along the axis, of the ring [m]."""


def ring_frequencies() -> tuple[float, float]:
    """Closed forms of the thin ring [Hz]: breathing, and bending in its plane with four nodes.

    sqrt(E/rho)/2 pi R, and n (n^2 - 1)/sqrt(n^2 + 1) sqrt(E I/rho A R^4)/2 pi for n = 2.
    """
    speed = bar_speed(STEEL.young, STEEL.density)  # type: ignore[arg-type]
    breathing = speed / (2 * np.pi * RADIUS)
    slender = WIDTH / np.sqrt(12) / RADIUS
    return breathing, breathing * slender * 2 * 3 / np.sqrt(5)


def ring_checks(cells: tuple[int, int, int], exact: bool) -> list[Check]:
    """Both motions of a free ring, against the eigenvalues of the same mesh and the thin ring."""
    mesh = ring_mesh(RADIUS - WIDTH / 2, RADIUS + WIDTH / 2, DEPTH, cells)
    angle = np.arctan2(mesh.nodes[:, 1], mesh.nodes[:, 0])
    radial = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    shapes = {
        "breathing": radial,
        "bending": np.cos(2 * angle)[:, None] * radial - 0.5 * np.sin(2 * angle)[:, None] * around,
    }
    ring = f"ring of {len(mesh.elements):,} elements"
    rows = []
    for (name, shape), thin in zip(shapes.items(), ring_frequencies(), strict=True):
        found = free_frequency(Body(mesh, STEEL), 1e-6 * shape, shape, thin)
        if exact:
            expected = nearest_eigenfrequency(Body(mesh, STEEL), shape)
            rows.append(below(f"{ring}, {name}: to same mesh", abs(found / expected - 1), 1e-3))
        rows.append(reported(f"{ring}, {name}: over the thin ring", found / thin))
    return rows


def free_frequency(body: Body, start: FloatArray, shape: FloatArray, guess: float) -> float:
    """Frequency [Hz] of the free motion from ``start`` [m], of its share of ``shape`` (n, 3)."""
    run = Simulation([body], threads=1)
    body.displacement = start
    mass = qdem_judge.lumped_mass(body.nodes, body.elements, body.material.density)
    stride = max(1, round(0.05 / guess / run.step))
    values = []
    for _ in range(120):
        values.append(float((mass[:, None] * shape * body.displacement).sum()))
        run.advance(stride * run.step)
    time = stride * run.step * np.arange(len(values), dtype=np.float64)
    return peak_frequencies(time, np.array(values), count=3, floor=1e-4)[0].frequency


def nearest_eigenfrequency(body: Body, shape: FloatArray) -> float:
    """Frequency [Hz] of the modes of the same mesh that hold most of ``shape``; all by LAPACK.

    Modes of a ring come in pairs of one frequency, whose vectors are any two of their plane: what
    counts is the share of the pair.
    """
    material = body.material
    mass = qdem_judge.lumped_mass(body.nodes, body.elements, material.density)
    matrix = qdem_judge.stiffness(body.nodes, body.elements, material.young, material.poisson)
    root = np.sqrt(np.repeat(mass, 3))
    value, vector = eigh(matrix.toarray() / np.outer(root, root))
    share = (vector.T @ (root * shape.ravel())) ** 2
    first = np.flatnonzero(np.diff(value, prepend=-np.inf) > 1e-6 * value)
    most = first[np.argmax(np.add.reduceat(share, first))]
    return float(np.sqrt(value[most]) / (2 * np.pi))


# --- a block with holes -----------------------------------------------------------------------


def holes_checks(size: float) -> list[Check]:
    """A clamped block with two holes, meshed by gmsh: static answer and first frequency."""
    if find_spec("gmsh") is None:
        return [reported("block with holes: not run, gmsh is not installed", 0.0)]
    mesh = gmsh_box((0.6, 0.2, 0.1), size, [("z", (0.2, 0.1), 0.05), ("y", (0.42, 0.05), 0.025)])
    problem = clamped(mesh, STEEL)
    answer = relaxed(problem)
    mode, expected = first_frequency(problem)
    stress = answer.von_mises_differences()
    return [
        reported("block with holes: elements", len(mesh.elements)),
        below("block with holes: tip, QDEM to scikit-fem", answer.difference, 1e-5),
        below("block with holes: von Mises, greatest difference", 100 * stress.max(), 0.12, "%"),
        below("block with holes: first frequency to same mesh",
              abs(mode.frequency / expected - 1), 1e-3),
        reported("block with holes: tip", 1e6 * answer.problem.static[tip_node(mesh), 2], "um"),
    ]  # fmt: skip


def quick_checks() -> list[Check]:
    """Bars of 10 to 40 cells a wave, a ring of 864 elements, a block of some thousand."""
    return [*wave_checks([10, 20, 40]), *ring_checks((2, 72, 1), True), *holes_checks(0.03)]


def full() -> Outcome:
    """Bars of up to 80 cells a wave, a ring of 27,648 elements besides, a finer block."""
    return Outcome(
        [
            *wave_checks([10, 20, 40, 80]),
            *ring_checks((2, 72, 1), True),
            *ring_checks((4, 288, 4), False),
            *holes_checks(0.015),
        ]
    )
