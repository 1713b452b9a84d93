"""The bodies of a simulation side by side, what holds and loads them, and their arrays.

All that contact and rigid bodies need of a simulation; `qdem_fem.march.state` adds them and the
step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import Assembly, Body, Conditions, Motion, find_mass_scaling_factor
from qdem_fem.element import Strain
from qdem_fem.files import Driver
from qdem_fem.kernel.cpu import Constraints, Loads

if TYPE_CHECKING:
    from qdem_fem.bodies import Absorbers
    from qdem_fem.rigid import RigidBodies

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def choose_assembly(device: str) -> type[Assembly]:
    """The class that computes on a device; raises `LibraryMissing` where there is no GPU."""
    if device == "cpu":
        return Assembly
    from qdem_fem.kernel.cuda import CudaAssembly, require_gpu

    require_gpu()
    return CudaAssembly


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
        self._absorbers: Absorbers | None = None
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

    @property
    def absorbers(self) -> Absorbers | None:
        """Dashpots and springs of absorbing faces; None where there are none."""
        if self._absorbers is None and self.conditions.absorbing:
            from qdem_fem.bodies import Absorbers

            held = self.pack_lists()[1]
            self._absorbers = Absorbers(self.assembly, held, self.conditions.absorbing)
        return self._absorbers

    def pack_lists(self) -> tuple[Loads, Constraints]:
        """The kernel's lists of the present conditions."""
        if self._lists is None:
            self._lists = self.assembly.lists(self.conditions, self.gravity is not None)
            if self.rigid is not None:
                self._lists = self.rigid.split_lists(*self._lists, self.motion.work)
        return self._lists

    def gravity_at(self, times: Floats) -> Floats | None:
        """Gravity [m/s^2], (k, 3), at ``times`` (k,) [s]; None without."""
        return None if self.gravity is None else self.gravity.sample(times)

    def note_conditions_changed(self, ties: bool) -> None:
        """Make the lists again when next needed; ``ties``: what is held has changed, too."""
        self._lists = self._absorbers = None
