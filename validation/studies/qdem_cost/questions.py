"""The two questions, and what their answers are measured against.

``bending``  The paper's cantilever (section 3.1).  200 N at the free end, raised by sin^2 in 20 ms
             and kept; how does the end's middle move in three first periods?
``pulse``    The same bar, free.  A sin^2 pulse of pressure, 50 microseconds long at half its
             height, on one end; how fast does the middle of the other end move?  The blow of an
             impact-echo test of a sleeper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import find_faces_within, find_pressure_forces, find_surface_faces
from qdem_fem.mesh.tetrahedra import TetMesh
from validation.bench.qdem.closed_forms import CONCRETE_BEAM

FloatArray = NDArray[np.float64]
BEAM = CONCRETE_BEAM
SIZE = (BEAM.length, BEAM.width, BEAM.height)
LOAD, RISE = 200.0, 0.02
"""[N], [s]"""
PRESSURE, PULSE = 1e6, 1e-4
"""[Pa]: strains of 2e-5, so that every strain measure gives the same; [s]."""


@dataclass(frozen=True)
class Question:
    """What is asked of every method."""

    name: str
    times: FloatArray
    """When histories are compared [s]."""
    unit: float
    """What implicit steps are counted in: the first period, the pulse [s]."""
    derivative: int
    """0: displacement is compared; 1: velocity."""
    component: int
    """Of load and answer: 0 is x, 2 is z."""
    factor: Callable[[FloatArray], FloatArray]
    """The load over its greatest value at times [s]."""
    amplitude: float
    """Greatest load, [N] or [Pa]."""

    @property
    def bends(self) -> bool:
        """Whether the bar is clamped and bent."""
        return self.derivative == 0

    @property
    def end(self) -> float:
        """[s]"""
        return float(self.times[-1])

    def table(self) -> tuple[FloatArray, FloatArray]:
        """Times [s] and factors of the load, so dense that lines between them are exact to 1e-6."""
        times = np.linspace(0.0, RISE if self.bends else PULSE, 1001)
        return times, self.factor(times)

    def find_held(self, nodes: FloatArray) -> NDArray[np.bool_]:
        """Clamped nodes, (n,)."""
        return np.asarray((nodes[:, 0] < 1e-9) & self.bends)

    def find_loaded(self, nodes: FloatArray) -> NDArray[np.bool_]:
        """Nodes of the loaded end, (n,)."""
        return np.abs(nodes[:, 0] - (BEAM.length if self.bends else 0.0)) < 1e-9

    def force(self, mesh: TetMesh) -> FloatArray:
        """Greatest nodal forces [N], (n, 3): equal shares as in the paper, or a pressure's."""
        loaded = self.find_loaded(mesh.nodes)
        if self.bends:
            force = np.zeros_like(mesh.nodes)
            force[loaded, 2] = LOAD / loaded.sum()
            return force
        faces = find_faces_within(find_surface_faces(mesh.elements), loaded)
        return self.amplitude * find_pressure_forces(mesh.nodes, faces, len(mesh.nodes))

    def error(self, times: FloatArray, displacement: FloatArray, wanted: FloatArray) -> float:
        """Relative L2 error of a history ``displacement`` [m] at ``times`` [s]."""
        found = CubicSpline(times, displacement)(self.times, self.derivative)
        return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))

    def reference(self) -> tuple[FloatArray, float]:
        """The reference at ``times``, and how far its coarser form is from it, as an error."""
        path = Path(__file__).with_name(f"{self.name}.csv")
        _, fine, coarse = np.loadtxt(path, delimiter=",", skiprows=1).T
        return fine, float(np.linalg.norm(fine - coarse) / np.linalg.norm(fine))


def _raise_load(times: FloatArray) -> FloatArray:
    return np.where(times < RISE, np.sin(np.pi * times / RISE / 2) ** 2, 1.0)


def _pulse_load(times: FloatArray) -> FloatArray:
    return np.where(times < PULSE, np.sin(np.pi * times / PULSE) ** 2, 0.0)


BENDING = Question("bending", np.linspace(0, 0.11, 1101), 1 / 26.87, 0, 2, _raise_load, LOAD)
TRAVEL = Question("pulse", np.linspace(0, 8e-4, 801), PULSE, 1, 0, _pulse_load, PRESSURE)
QUESTIONS = {question.name: question for question in (BENDING, TRAVEL)}


def mesh_bar(cells: list[int]) -> TetMesh:
    """The bar in five tetrahedra a cell."""
    return make_box_mesh(SIZE, (cells[0], cells[1], cells[2]), "five")


def find_end_middle(nodes: FloatArray) -> int:
    """The node next to the middle of the end x = L."""
    middle = np.array([BEAM.length, BEAM.width / 2, BEAM.height / 2])
    return int(np.argmin(np.linalg.norm(nodes - middle, axis=1)))
