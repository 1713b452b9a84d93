"""Relaxation after a jump: what it keeps, what it costs, and what it is compared with.

Beds are made, not prepared by an engine: a disordered bed whose nearest pairs are closed until
each grain has the contacts and the overlaps of a ballast bed at rest under its own weight
(coordination number near 4 with walls, exponential overlaps of 6e-8 m in the mean).  The bars are
those of a default that must not change what the jump did not mean to change.

    trackbed validate relaxation            1,085 grains, the three methods, then 1e5 grains
    trackbed validate relaxation --quick    without the 1e5 grains
"""

from __future__ import annotations

import numpy as np

from adapters.contact_law import hertz_stiffness
from adapters.container import Container, Walls
from adapters.overlaps import Neighbours, behind_discs, neighbours, rows_at
from adapters.relaxation import (
    Method,
    Relaxation,
    RelaxationNotConverged,
    relax,
    relax_bare,
)
from adapters.relaxation_smallest import smallest_move
from adapters.state import FloatArray, State
from validation.case import Check

STIFFNESS = hertz_stiffness(46.9e9, 0.25, 210e9, 0.3)
DENSITY = 2710.0
OVERLAP = 6e-8
"""Mean overlap of a made bed [m]."""
EVALUATIONS_MAX = 5_000
"""Where the printed functional is cut off: it goes on flowing for tens of thousands."""
SETTLEMENT = 40e-6
"""Mean settlement of the jumps [m]."""


def state_at_rest(position: FloatArray, radius: FloatArray) -> State:
    """Grains at rest without any record of contacts; metres."""
    n = len(radius)
    mass = 4 / 3 * np.pi * radius**3 * DENSITY
    return State(np.arange(n), position, radius, mass, np.zeros((n, 3)), np.zeros((n, 3)))


def bed_made(count: int, seed: int = 0) -> tuple[State, Walls]:
    """A bed of ``count`` grains (Karrech's radii) in a square box, two contacts closed a grain."""
    generator = np.random.default_rng(seed)
    radius = np.clip(generator.normal(3.2e-3, 5.65e-4, count), 2.07e-3, 4.33e-3)
    edge = float(4 * 4 / 3 * np.pi * np.mean(radius**3) / 0.54) ** (1 / 3)
    side = int(np.ceil((count / 4) ** (1 / 3)))
    cell = np.array(list(np.ndindex(side + 2, side, side)))[:, ::-1]
    corner = np.array([[1, 1, 1], [3, 3, 1], [3, 1, 3], [1, 3, 3]]) / 4
    place = (cell[:, None] + corner).reshape(-1, 3)[:count]
    position = edge * place + 3e-4 * generator.standard_normal((count, 3))
    walls = Container("box", size_x=side * edge, size_y=side * edge).walls()
    position = relax_bare(state_at_rest(position, radius), walls, STIFFNESS).position
    behind = behind_discs(position, walls)
    near = neighbours(position, radius, walls, 1e-3)
    closed = np.argsort(-near.overlap)[: 2 * count]
    none = Neighbours(near.first[:0], near.second[:0], near.normal[:0], near.overlap[:0])
    network = Neighbours(
        near.first[closed],
        near.second[closed],
        near.normal[closed],
        OVERLAP * generator.exponential(size=len(closed)),
    )
    made = smallest_move(
        position,
        position,
        radius,
        network,
        none,
        5 * OVERLAP,
        lambda x, first, second: rows_at(x, radius, first, second, walls, behind),
        lambda x, gap: neighbours(x, radius, walls, gap, behind),
        keep_height=False,
        tolerance=0.01 * OVERLAP,
        accepted=10 * OVERLAP,
        evaluations_max=40_000,
    )
    return state_at_rest(made.position, radius), walls


def jump(state: State, seed: int = 1) -> FloatArray:
    """Estimated positions [m]: settlement that grows with height, and every grain by itself."""
    generator = np.random.default_rng(seed)
    move = SETTLEMENT * generator.standard_normal(state.position.shape)
    height = state.position[:, 2]
    move[:, 2] -= SETTLEMENT * height / height.mean() + move[:, 2].mean()
    return state.position + move


def relaxed(state: State, walls: Walls, method: Method) -> Relaxation:
    """The jump relaxed; what was reached when a method does not converge."""
    try:
        return relax(
            jump(state), state, walls, STIFFNESS, method=method, evaluations_max=EVALUATIONS_MAX
        )
    except RelaxationNotConverged as error:
        return error.best


def height_error(found: Relaxation) -> float:
    """Share of the jump's own settlement by which the mean height is off."""
    settlement = found.before.mean_height - found.estimated.mean_height
    return abs(found.relaxed.mean_height - found.estimated.mean_height) / settlement


def below(name: str, value: float, bar: float, unit: str = "") -> Check:
    """A value that must stay below its bar."""
    return Check(name, value, f"< {bar:g}", value < bar, unit)


def checks_of_jump(state: State, walls: Walls, cpu_bar: float) -> list[Check]:
    """Bars of the default method on one bed."""
    name = f"{len(state.radius)} grains"
    still = relax(state.position, state, walls, STIFFNESS)
    found = relaxed(state, walls, "smallest-move")
    pairs = abs(found.relaxed.coordination_number / found.before.coordination_number - 1)
    mean = abs(found.relaxed.mean_penetration / found.before.mean_penetration - 1)
    return [
        below(f"{name}: greatest move without a jump", still.largest_move, 1e-6, "m"),
        Check(f"{name}: converged", float(found.converged), "= 1", found.converged),
        Check(f"{name}: overlap estimated", found.estimated.max_penetration, "reported", True, "m"),
        below(f"{name}: greatest overlap", found.relaxed.max_penetration, 1e-6, "m"),
        below(f"{name}: mean overlap, change", mean, 0.05),
        below(f"{name}: coordination number, change", pairs, 0.03),
        below(f"{name}: the same with walls", abs(found.coordination_change), 0.03),
        below(f"{name}: mean height, of the settlement", height_error(found), 0.05),
        Check(f"{name}: evaluations", found.evaluations, "reported", True),
        below(f"{name}: processor time", found.cpu_s, cpu_bar, "s"),
    ]


def checks_of_methods(state: State, walls: Walls) -> list[Check]:
    """Why the default is not one of the energies: each fails a bar that the default keeps."""
    rows = []
    methods: tuple[Method, ...] = ("karrech2007", "proximal")
    for method in methods:
        found = relaxed(state, walls, method)
        figures = {
            "coordination number, change": (abs(found.coordination_change), ""),
            "mean height, of the settlement": (height_error(found), ""),
            "greatest overlap": (found.relaxed.max_penetration, "m"),
            "evaluations": (found.evaluations, ""),
            "processor time": (found.cpu_s, "s"),
        }
        rows += [
            Check(f"{method}: {name}", value, "reported", True, unit)
            for name, (value, unit) in figures.items()
        ]
        failing = abs(found.coordination_change) > 0.03 or height_error(found) > 0.05
        rows.append(Check(f"{method}: fails a bar of the default", float(failing), "= 1", failing))
    return rows


def run(quick: bool) -> list[Check]:
    """Checks at paper scale and, unless ``quick``, at 1e5 grains (about two minutes)."""
    small = bed_made(300)
    relax(jump(small[0]), *small, STIFFNESS)  # compiles the kernels, kept out of the times below
    state, walls = bed_made(1085)
    checks = checks_of_jump(state, walls, cpu_bar=1.0) + checks_of_methods(state, walls)
    if not quick:
        checks += checks_of_jump(*bed_made(100_000), cpu_bar=120.0)
    return checks
