"""Minimisers that a user would pick, on the potentials of the project, with the way they went.

``gradient``  steepest descent with a backtracking line search, the paper's "gradient method"
``lbfgs``     SciPy's limited-memory BFGS
``fire``      ASE's FIRE, as it comes: mass 1 and its own step, in the units of the first overlap

Each works on the same `adapters.relaxation_printed.Energy`: eq. 29 (Hertz contacts and weight, with
the grains of the frontier held or all free), or the Hertz contacts alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
from scipy.optimize import minimize

from adapters.overlaps import Neighbours
from adapters.relaxation_kernel import BoolArray
from adapters.relaxation_printed import Energy, EnergyRows
from adapters.sample import GRAVITY
from adapters.state import FloatArray
from validation.relaxation_jumps import Jumped

MARKS = tuple(round(10 ** (i / 8)) for i in range(4, 33))
"""Evaluations after which the way is noted: eight a decade, 3 to 10,000."""
FORCE_SHARE = 0.01
"""A minimiser stops at this residual force, over the mean weight, as the project's own does."""
ARMIJO = 1e-4
"""Share of the slope's decrease that a step of steepest descent has to keep."""

Function = Callable[[FloatArray], tuple[float, FloatArray]]
"""Energy and gradient of free coordinates, in units of the problem."""


@dataclass(frozen=True)
class Noted:
    """A minimiser's positions on its way."""

    evaluations: int
    cpu_s: float
    """Processor time since the start [s], neighbour lists included."""
    position: FloatArray
    """Centres [m], (n, 3)."""
    ended: bool = False
    """True where it stopped by itself: the residual force is below its bound."""


class _Enough(Exception):
    """The last mark is reached."""


@dataclass
class _Way:
    """Counts evaluations and notes positions at the marks."""

    value: Function
    place: Callable[[FloatArray], FloatArray]
    marks: tuple[int, ...]
    started: float
    evaluations: int = 0
    noted: list[Noted] = field(default_factory=list)

    def __call__(self, x: FloatArray) -> tuple[float, FloatArray]:
        self.evaluations += 1
        return self.value(x)

    def note(self, x: FloatArray, ended: bool = False) -> None:
        """To be told each accepted iterate; raises `_Enough` behind the last mark."""
        last = self.noted[-1].evaluations if self.noted else 0
        if ended or any(last < mark <= self.evaluations for mark in self.marks):
            cpu_s = time.process_time() - self.started
            self.noted.append(Noted(self.evaluations, cpu_s, self.place(x), ended))
        if not ended and self.evaluations >= self.marks[-1]:
            raise _Enough


def potential(jump: Jumped, name: str) -> tuple[Energy, BoolArray]:
    """Energy of a jump's estimate, and the grains (n,) that are free.

    ``eq29`` and ``eq29-free``: Hertz contacts and weight, the frontier held or free; ``hertz``:
    the contacts alone, every grain free.
    """
    around = jump.around
    force = np.zeros_like(jump.estimate)
    free = np.ones(len(force), bool)
    if name != "hertz":
        force[:, 2] = -GRAVITY * jump.before.mass
    if name == "eq29":
        touching: Neighbours = jump.around_before.search(jump.before.position, 0.0)
        free[touching.first[touching.second < 0]] = False
    energy = Energy(
        jump.before.radius,
        force,
        jump.estimate,
        0.0,
        around.rows,
        around.search,
        around.row_stiffness,
    )
    return energy, free


def minimised(
    jump: Jumped, potential_name: str, method: str, marks: tuple[int, ...] = MARKS
) -> list[Noted]:
    """The way of a minimiser from the estimate; its last entry is where it ended.

    Units: the greatest estimated overlap, and the Hertz force of that overlap on two mean grains,
    so that the stiffest contact has a stiffness near one.
    """
    if method == "fire":
        import_module("ase.optimize")  # its import is no part of the cost
    energy, free = potential(jump, potential_name)
    around = jump.around
    overlap = float(around.search(jump.estimate, 0.0).overlap.max(initial=0.0))
    length = overlap if overlap > 0 else 1e-3 * float(jump.before.radius.mean())
    stiffness = 4 / 3 * jump.stiffness.grain * np.sqrt(jump.before.radius.mean() / 2)
    unit = float(stiffness * length**1.5)
    bound = FORCE_SHARE * GRAVITY * float(jump.before.mass.mean()) / unit
    started = time.process_time()
    rows = EnergyRows(energy, jump.estimate)
    position = jump.estimate.copy()

    def place(x: FloatArray) -> FloatArray:
        position[free] = jump.estimate[free] + length * x.reshape(-1, 3)
        return position.copy()

    def value(x: FloatArray) -> tuple[float, FloatArray]:
        position[free] = jump.estimate[free] + length * x.reshape(-1, 3)
        total, gradient = rows(position)
        return total / (unit * length), gradient[free].ravel() / unit

    way = _Way(value, place, marks, started)
    x = np.zeros(3 * int(free.sum()))
    try:
        x = {"gradient": _gradient, "lbfgs": _lbfgs, "fire": _fire}[method](way, x, bound)
    except _Enough:
        return way.noted
    way.note(x, ended=True)
    return way.noted


def _gradient(way: _Way, x: FloatArray, bound: float) -> FloatArray:
    """Steepest descent; each step begins at twice the last one and is halved until it pays."""
    energy, gradient = way(x)
    step = 1.0
    while np.abs(gradient).max(initial=0.0) > bound:
        square = float(gradient @ gradient)
        step *= 2.0
        while True:
            tried, slope = way(x - step * gradient)
            if tried <= energy - ARMIJO * step * square or step < 1e-15:
                break
            step /= 2.0
        x = x - step * gradient
        energy, gradient = tried, slope
        way.note(x)
    return x


def _lbfgs(way: _Way, x: FloatArray, bound: float) -> FloatArray:
    """SciPy's L-BFGS-B with as many corrections as the project's own."""
    found = minimize(
        way,
        x,
        jac=True,
        method="L-BFGS-B",
        callback=lambda xk: way.note(xk),
        options={
            "maxcor": 20,
            "maxfun": 10 * way.marks[-1],
            "maxiter": 10 * way.marks[-1],
            "ftol": 0.0,
            "gtol": bound,
        },
    )
    return np.asarray(found.x)


def _fire(way: _Way, x: FloatArray, bound: float) -> FloatArray:
    """ASE's FIRE on a calculator of the same energy; ASE is imported here only."""
    ase: Any = import_module("ase")
    calculator: Any = import_module("ase.calculators.calculator")
    optimize: Any = import_module("ase.optimize")

    class Spheres(calculator.Calculator):  # type: ignore[misc]
        implemented_properties = ["energy", "forces"]  # noqa: RUF012  (as ASE asks for it)

        def calculate(self, *words: Any) -> None:
            super().calculate(*words)
            energy, gradient = way(self.atoms.positions.ravel())
            self.results = {"energy": energy, "forces": -gradient.reshape(-1, 3)}

    atoms = ase.Atoms(f"H{len(x) // 3}", positions=x.reshape(-1, 3))
    atoms.calc = Spheres()
    for _ in optimize.FIRE(atoms, logfile=None).irun(fmax=bound, steps=10 * way.marks[-1]):
        way.note(atoms.positions.ravel())
    return np.asarray(atoms.positions.ravel())
