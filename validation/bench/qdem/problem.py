"""Problems that QDEM and its judge both solve: one mesh, one material, the same held nodes.

problem = cantilever((24, 4, 4))
body, run = problem.simulation(amplitude=smooth_step(2 * period))       QDEM
problem.static, problem.stiffness, problem.mass                          scikit-fem
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sparse

from qdem_fem import Body, Material, Series, Simulation
from qdem_fem.files.series import Value
from qdem_fem.mesh.generation import Pattern, make_box_mesh
from qdem_fem.mesh.tetrahedra import TetMesh
from validation.bench.qdem import judge as qdem_judge
from validation.bench.qdem.closed_forms import CONCRETE_BEAM
from validation.bench.qdem.judge import BoolArray, FloatArray, IntArray
from validation.bench.qdem.modes import Modes, find_modes

DIRECT_NODES = 6000
"""Nodes up to which the judge factorises; above, multigrid."""
END_LOAD = (0.0, 0.0, -200.0)
"""Section 3.1: 200 N downwards on the free end, shared equally by its nodes [N]."""
TABLE = 2000
"""Rows of the table of a smooth step."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A body, how it is held, and a force on some of its nodes."""

    mesh: TetMesh
    material: Material
    free: BoolArray
    """Components that are free, (n, 3)."""
    loaded: IntArray
    """Nodes that share the force equally."""
    force: tuple[float, float, float] = END_LOAD
    """Total force [N]."""

    @property
    def method(self) -> Literal["amg", "direct"]:
        """How the judge solves."""
        return "direct" if len(self.mesh.nodes) < DIRECT_NODES else "amg"

    @cached_property
    def load(self) -> FloatArray:
        """Forces on the nodes [N], (n, 3)."""
        load = np.zeros_like(self.mesh.nodes)
        load[self.loaded] = np.asarray(self.force) / len(self.loaded)
        return load

    @cached_property
    def stiffness(self) -> sparse.csr_matrix:
        """K [N/m] by scikit-fem."""
        material = self.material
        return qdem_judge.build_stiffness(
            self.mesh.nodes, self.mesh.elements, material.young, material.poisson
        )

    @cached_property
    def mass(self) -> FloatArray:
        """Lumped masses [kg], (n,)."""
        return qdem_judge.lump_mass(self.mesh.nodes, self.mesh.elements, self.material.density)

    @cached_property
    def static(self) -> FloatArray:
        """Static displacement under the force [m], (n, 3), by scikit-fem."""
        return self.solve_static(self.load)

    def solve_static(self, load: FloatArray) -> FloatArray:
        """Static displacement [m], (n, 3), under forces on the nodes [N], (n, 3)."""
        return qdem_judge.solve_static(
            self.stiffness, self.free, load, self.mesh.nodes, self.method
        ).displacement

    def modes(self, count: int = 1) -> Modes:
        """Lowest modes of (K, lumped M) by scikit-fem and ARPACK or LOBPCG."""
        return find_modes(
            self.stiffness, self.mass, self.free, count, self.method, self.mesh.nodes
        )  # fmt: skip

    def simulation(self, amplitude: Value | None = None, **options: Any) -> tuple[Body, Simulation]:
        """QDEM of it on one thread; ``amplitude`` [-] multiplies the force, None: no force."""
        body = Body(self.mesh, self.material)
        run = Simulation([body], threads=1, **options)
        held = ~self.free
        every = held.all(axis=1)
        if every.any():
            run.fix(body, every)
        for axis, letter in enumerate("xyz"):
            single = held[:, axis] & ~every
            if single.any():
                run.fix(body, single, letter)
        if isinstance(amplitude, Series):
            force = Series(amplitude.times, np.outer(amplitude.values, self.force))
            run.load(body, self.loaded, force)
        elif amplitude is not None:
            run.load(body, self.loaded, self.force)
        return body, run


def make_cantilever(cells: tuple[int, int, int], pattern: Pattern = "kuhn") -> Problem:
    """Section 3.1: the concrete beam, clamped at x = 0, 200 N on the nodes of the free end."""
    beam = CONCRETE_BEAM
    mesh = make_box_mesh((beam.length, beam.width, beam.height), cells, pattern)
    material = Material(beam.young, beam.poisson, beam.density)
    return clamp_mesh(mesh, material)


def clamp_mesh(mesh: TetMesh, material: Material) -> Problem:
    """A body clamped where x is smallest, with the end load where x is largest."""
    x = mesh.nodes[:, 0]
    free = np.repeat((x > x.min() + 1e-9 * np.ptp(x))[:, None], 3, axis=1)
    return Problem(mesh, material, free, np.flatnonzero(x > x.max() - 1e-9 * np.ptp(x)))


def find_tip_node(mesh: TetMesh) -> int:
    """The node nearest to the middle of the face where x is largest."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    middle = np.array([high[0], (low[1] + high[1]) / 2, (low[2] + high[2]) / 2])
    return int(np.argmin(np.linalg.norm(mesh.nodes - middle, axis=1)))


def make_smooth_step(duration: float, start: float = 0.0, back: float | None = None) -> Series:
    """From 0 to 1 within ``duration`` [s] as t/T - sin(2 pi t/T)/2 pi; ``back`` [s]: to 0 again.

    Its rate is a Hann window: a mode with two or more whole periods within T is left at rest, and
    one of n periods keeps about 1/(2 pi n^3) of its share instead of the 1/(pi n) of a linear ramp.
    """
    t = np.linspace(0.0, 1.0, TABLE)
    rise = t - np.sin(2 * np.pi * t) / (2 * np.pi)
    times, values = start + duration * t, rise
    if back is not None:
        times, values = np.append(times, back + duration * t), np.append(values, 1 - rise)
    return Series(times, values)
