"""The bodies of a simulation side by side, what holds and loads them, and their arrays.

All that contact and rigid bodies need of a simulation; `qdem_fem.march.state` adds them and the
step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING, Literal

import numpy as np

from qdem_fem.bodies import Assembly, Body, Conditions, find_mass_scaling_factor
from qdem_fem.element import Strain
from qdem_fem.files import Driver, Floats
from qdem_fem.kernel.cpu import Constraints, Loads

if TYPE_CHECKING:
    from qdem_fem.rigid import RigidBodies


def choose_assembly(device: str) -> type[Assembly]:
    """The class that computes on a device; raises `LibraryMissing` where there is no GPU."""
    if device == "cpu":
        return Assembly
    from qdem_fem.kernel.cuda import CudaAssembly, require_gpu

    require_gpu()
    return CudaAssembly


@dataclass
class Motion:
    """The state of a march beside its fields: what a checkpoint keeps with them."""

    steps_done: int = 0
    step: float | None = None  # time step that the march began with [s]; None before
    behind: bool = False
    """True while velocities are half a step behind; False: they are at the time itself."""
    work: Floats = field(default_factory=lambda: np.zeros(3))
    """Work of the loads and of prescribed motion, and what viscosity took, since the start [J]."""
    gravity_work: float = 0.0  # work of gravity since the start [J]
    displacement_set: bool = False  # whether the user set a displacement since the last step
    put_in: float = nan  # energy of the state that the user set [J]; NaN: not known yet

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * (self.step or 0.0)


@dataclass(eq=False)
class System:
    """Bodies numbered through, their conditions, and the arrays made of them when first needed."""

    bodies: list[Body]
    strain: Strain = "finger"
    precision: Literal["float64", "float32"] = "float64"
    threads: int | None = None
    mass_scaling: float | None = None
    device: Literal["cpu", "cuda"] = "cpu"
    gravity: Driver | None = None
    conditions: Conditions = field(default_factory=Conditions)
    motion: Motion = field(default_factory=Motion)

    def __post_init__(self) -> None:
        counts = [len(body.nodes) for body in self.bodies]
        self.first_node = np.concatenate([[0], np.cumsum(counts)])
        """First node of every body in the numbers of all, and their count, (bodies + 1,)."""
        self.starts = {id(b): int(at) for b, at in zip(self.bodies, self.first_node, strict=False)}
        """First node of a body by its identity."""
        self.master = np.arange(self.first_node[-1])
        """The node that a node moves with: itself unless periodic, (n,)."""
        self.viscous = any(b.material.is_viscous for b in self.bodies if not b.rigid)
        self._assembly: Assembly | None = None
        self._rigid: RigidBodies | None = None
        self._lists: tuple[Loads, Constraints] | None = None

    @property
    def steps_done(self) -> int:
        """Time steps since the start."""
        return self.motion.steps_done

    @property
    def begun(self) -> bool:
        """Whether the arrays are made, so that nodes can no longer be joined."""
        return self._assembly is not None

    @property
    def assembly(self) -> Assembly:
        """The kernel's arrays, built when first needed."""
        if self._assembly is None:
            factor = None
            if self.mass_scaling is not None:
                soft = [body for body in self.bodies if not body.rigid]
                factor = find_mass_scaling_factor(soft, self.mass_scaling)
            self._assembly = choose_assembly(self.device)(
                self.bodies, self.master, self.strain, self.precision, self.threads, factor
            )
            for name in ("displacement", "velocity"):
                fields = [getattr(body, f"_{name}") for body in self.bodies]
                self._assembly.set_field(name, np.concatenate(fields))
            self.motion.displacement_set = any(body._displacement.any() for body in self.bodies)
            if any(body.rigid for body in self.bodies):
                from qdem_fem.rigid import RigidBodies

                self._rigid = RigidBodies(self.bodies, self.first_node, self._assembly)
        return self._assembly

    @property
    def rigid(self) -> RigidBodies | None:
        """The rigid bodies; None where there are none."""
        return self._rigid if self.assembly is not None else None

    def pack_lists(self) -> tuple[Loads, Constraints]:
        """The kernel's lists of the present conditions."""
        if self._lists is None:
            self._lists = self.assembly.pack_lists(self.conditions, self.gravity is not None)
            if self.rigid is not None:
                self._lists = self.rigid.split_lists(*self._lists, self.motion.work)
        return self._lists

    @property
    def gravity_vector(self) -> Floats | None:
        """Gravity [m/s^2], (3,); None without."""
        return None if self.gravity is None else self.gravity.constant

    def note_conditions_changed(self, ties: bool) -> None:
        """Make the lists again when next needed; ``ties``: what is held has changed, too."""
        self._lists = None
