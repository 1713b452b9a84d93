"""Errors of every jump of a stored full run, and the relaxed cell: ``PARTS``."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any, Literal

import numpy as np

from adapters.bed.overlaps import find_pairs
from adapters.bed.state import FloatArray, State
from adapters.laws import get_law
from adapters.laws.fit.residual import compare_coordinates, compare_displacements
from adapters.relaxation.measured import RelaxationNotConverged
from adapters.relaxation.methods import relax
from adapters.scene.file import load_scene
from trackbed.scenes import find_scene_file
from validation.studies.laws.run import find_data

Row = dict[str, Any]
FIRST = (10, 20, 50, 100, 200)
"""k_i: cycles before the window."""
LENGTHS = (5, 10, 20, 40, 80)
"""k, cycles of the window, and h, cycles jumped."""
LAWS = ("linear", "log")
NOTHING, OTHER = "nothing moved", "another member"
DENOMINATORS = ("coordinates", "displacement since cycle 0", "displacement of the jump")
DEPTH = 1.8e-3
"""Overlap of the cell of nine grains [m]: the greatest one of the paper's Fig. 9a."""


def read_positions(name: str) -> FloatArray:
    """Centres at all cycle ends of a stored full run [m], shape (cycles + 1, n, 3)."""
    with np.load(find_data() / "full_runs" / f"{name}.npz") as data:
        return np.asarray(data["initial_position_m"] + 1e-6 * data["displacement_um"].astype(float))


def judge_jump(position: FloatArray, twin: FloatArray, k_i: int, k: int, h: int) -> Row:
    """E_r (eq. 22) of a jump from cycle ``k_i`` + ``k`` over ``h``, by way and denominator."""
    cycle, first, last = np.arange(k_i, k_i + k + 1.0), position[k_i + k], position[k_i + k + h]
    window = position[k_i : k_i + k + 1]
    estimates = {NOTHING: first}
    for name in LAWS:
        law = get_law(name)
        rows = slice(law.first_state, None)
        parameters = law.fit(cycle[rows], window[rows] - position[0])
        estimates[name] = first + law.increment(parameters, cycle[-1], cycle[-1] + h)
    if k_i + k + h < len(twin):
        estimates[OTHER] = first + twin[k_i + k + h] - twin[k_i + k]
    errors = {
        name: (
            compare_coordinates(last, estimate),
            compare_displacements(position[0], last, estimate),
            compare_displacements(first, last, estimate),
        )
        for name, estimate in estimates.items()
    }
    rounded = {name: [float(f"{one:.4g}") for one in three] for name, three in errors.items()}
    return {"k_i": k_i, "k": k, "h": h, "errors": rounded}


def judge_jumps() -> Row:
    """Figs 6 and 7: all jumps that the stored run has."""
    position, twin = read_positions("paper_scale_a"), read_positions("paper_scale_b")
    return {
        "jumps": [
            judge_jump(position, twin, *jump)
            for jump in product(FIRST, LENGTHS, LENGTHS)
            if sum(jump) < len(position)
        ]
    }


def relax_cell() -> Row:
    """Fig. 8: greatest overlap of the cell before, as estimated, and relaxed both ways [m].

    Eight equal grains at the corners of a cube touch the one in its middle, far from any wall.  The
    paper's method holds the eight, its frontier.
    """
    scene = load_scene(find_scene_file("karrech"))
    radius, walls = np.full(9, scene.sample.radii.mean), scene.container.walls()
    corners = np.array(list(product((-1, 1), repeat=3))) / np.sqrt(3)
    middle = np.array([[0.03, 0.03, 0.03]])
    position = np.concatenate([middle, middle + 2 * radius[0] * corners])
    mass = 4 / 3 * np.pi * scene.material.grain.density * radius**3
    still = np.zeros_like(position)
    before = State(np.arange(9), position, radius, mass, still, still)
    estimate = position.copy()
    estimate[0] += DEPTH * corners[-1]

    def find_greatest(places: FloatArray) -> float:
        overlap = find_pairs(places, radius, walls).overlap
        return float(f"{overlap.max(initial=0.0):.4g}")

    held = np.arange(9) > 0

    def relax_by(method: Literal["smallest-move", "karrech2007"]) -> float:
        try:
            found = relax(estimate, before, walls, scene.stiffness, method=method, frontier=held)
        except RelaxationNotConverged as error:  # overlaps of round-off, with no load to close
            found = error.best
        return find_greatest(found.position)

    return {
        "overlap": {
            "before": find_greatest(position),
            "estimate": find_greatest(estimate),
            "smallest-move": relax_by("smallest-move"),
            "karrech2007": relax_by("karrech2007"),
        }
    }


PARTS: dict[str, Callable[[], Row]] = {"jumps": judge_jumps, "cell": relax_cell}
