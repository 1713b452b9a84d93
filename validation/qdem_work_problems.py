"""The two questions of the work-precision report, and what their answers are measured against.

``bending``  The paper's cantilever (section 3.1).  200 N at the free end, raised by sin^2 in 20 ms
             and kept; how does the end's middle move in three first periods?  Slow against the
             time of a wave through an element: where implicit steps may be long.
``pulse``    The same bar, free.  A sin^2 pulse of pressure, 50 microseconds long at half its
             height, on one end; how fast does the middle of the other end move?  The blow of an
             impact-echo test of a sleeper: where every method needs short steps.

The error of a history is its relative L2 distance to the reference over the whole time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from qdem_fem.mesh import TetMesh
from qdem_fem.mesh_generation import box_mesh, gmsh_box
from qdem_fem.surface import faces_within, pressure_forces, surface_faces
from validation.qdem_closed_forms import CONCRETE_BEAM
from validation.qdem_work_reference import bending_reference, pulse_reference, raised

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

BEAM = CONCRETE_BEAM
SIZE = (BEAM.length, BEAM.width, BEAM.height)
LOAD = 200.0
"""[N]"""
RISE = 0.02
"""[s]"""
PERIOD = 1 / 26.87
"""First period of the cantilever [s]."""
PRESSURE = 1e6
"""[Pa]: strains of 2e-5, so that every strain measure gives the same."""
PULSE = 1e-4
"""[s]"""
RESULTS = Path(__file__).parent / "results"


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
    def end(self) -> float:
        """[s]"""
        return float(self.times[-1])

    @property
    def kind(self) -> str:
        """What the error is of."""
        quantity = ("displacement", "velocity")[self.derivative]
        return f"{quantity} of the end's middle, relative L2 in time"

    def table(self) -> tuple[FloatArray, FloatArray]:
        """Times [s] and factors of the load, so dense that lines between them are exact to 1e-6."""
        until = RISE if self.name == "bending" else PULSE
        times = np.linspace(0.0, until, 1001)
        return times, self.factor(times)

    def held(self, nodes: FloatArray) -> BoolArray:
        """Clamped nodes, (n,)."""
        return np.asarray((nodes[:, 0] < 1e-9) & (self.name == "bending"))

    def loaded(self, nodes: FloatArray) -> BoolArray:
        """Nodes of the loaded end, (n,)."""
        return np.abs(nodes[:, 0] - (BEAM.length if self.name == "bending" else 0.0)) < 1e-9

    def force(self, mesh: TetMesh) -> FloatArray:
        """Greatest nodal forces [N], (n, 3): equal shares as in the paper, or a pressure's."""
        loaded = self.loaded(mesh.nodes)
        if self.name == "bending":
            force = np.zeros_like(mesh.nodes)
            force[loaded, 2] = LOAD / loaded.sum()
            return force
        faces = faces_within(surface_faces(mesh.elements), loaded)
        return self.amplitude * pressure_forces(mesh.nodes, faces, len(mesh.nodes))

    def error(self, times: FloatArray, displacement: FloatArray, wanted: FloatArray) -> float:
        """Relative L2 error of a history ``displacement`` [m] at ``times`` [s]."""
        found = CubicSpline(times, displacement)(self.times, self.derivative)
        return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))

    def reference(self, folder: Path = RESULTS) -> tuple[FloatArray, float]:
        """The reference at ``times``, and its uncertainty as an error; stored once computed."""
        path = folder / f"qdem-cost.{self.name}.csv"
        if not path.exists():
            columns = [self.times, *(self._reference_computed(fine) for fine in (True, False))]
            temporary = path.with_name(path.name + ".partial")
            np.savetxt(
                temporary, np.column_stack(columns), fmt="%.9e", delimiter=",", comments="",
                header="time_s,fine,coarse",
            )  # fmt: skip
            temporary.replace(path)
        times, fine, coarse = np.loadtxt(path, delimiter=",", skiprows=1).T
        if len(times) != len(self.times) or not np.allclose(times, self.times):
            raise ValueError(f"{path} has other times: delete it")
        return fine, float(np.linalg.norm(fine - coarse) / np.linalg.norm(fine))

    def _reference_computed(self, fine: bool) -> FloatArray:
        if self.name == "bending":
            return bending_reference(BEAM, LOAD, RISE, self.times, order=6 if fine else 5)
        order, count = (6, 48) if fine else (5, 40)
        return pulse_reference(BEAM, PRESSURE, PULSE, self.times, order, count)


def _pulse(times: FloatArray) -> FloatArray:
    return np.where(times < PULSE, np.sin(np.pi * times / PULSE) ** 2, 0.0)


def _rise(times: FloatArray) -> FloatArray:
    return raised(times, RISE)


BENDING = Question("bending", np.linspace(0, 0.11, 1101), PERIOD, 0, 2, _rise, LOAD)
TRAVEL = Question("pulse", np.linspace(0, 8e-4, 801), PULSE, 1, 0, _pulse, PRESSURE)
QUESTIONS = {question.name: question for question in (BENDING, TRAVEL)}


def bar_mesh(cells: tuple[int, int, int] | None, h: float | None = None) -> TetMesh:
    """The bar in five tetrahedra a cell, or by gmsh with elements of ``h`` [m]."""
    if cells is not None:
        return box_mesh(SIZE, cells, "five")
    assert h is not None
    return gmsh_box(SIZE, h)


def end_middle(nodes: FloatArray) -> int:
    """The node next to the middle of the end x = L."""
    middle = np.array([BEAM.length, BEAM.width / 2, BEAM.height / 2])
    return int(np.argmin(np.linalg.norm(nodes - middle, axis=1)))
