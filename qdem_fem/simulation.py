"""A simulation: bodies, conditions and the march in time (eq. 11 and Newton's second law)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from qdem_fem import kernel
from qdem_fem.assembly import Assembly
from qdem_fem.body import Body
from qdem_fem.checkpoint import checkpoint_read, checkpoint_write
from qdem_fem.conditioned_bodies import ConditionedBodies
from qdem_fem.conditions import Absorbing, Held, Roller
from qdem_fem.contact_options import Contact, contact_options_check, contacts_of
from qdem_fem.critical_step import CriticalStep, critical_step_find
from qdem_fem.dynamic_relaxation import StaticAnswer, relax
from qdem_fem.energies import Energy, energy_now
from qdem_fem.errors import ConditionError
from qdem_fem.leapfrog import velocities_level, velocity_now
from qdem_fem.march import march
from qdem_fem.mass_scaling import mass_scaling_factor
from qdem_fem.motion import Motion
from qdem_fem.reactions import reaction
from qdem_fem.reference_forces import Strain
from qdem_fem.series import Driver, Value, is_real
from qdem_fem.simulation_options import (
    bounds_check,
    numbers_check,
    rigid_options_check,
    words_check,
)

if TYPE_CHECKING:
    from qdem_fem.absorbing import Absorbers
    from qdem_fem.contact_state import Contacts
    from qdem_fem.rigid_bodies import RigidBodies

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SAFETY = 0.9
STEPS_MOST = 2**53
"""Numbers of steps are exact as floats up to here."""
SAMPLES = 1000
"""Samples of an advance whose sampling is not given."""


@dataclass(frozen=True)
class History:
    """Displacement of the probes; ``history["tip"]`` is (k, 3) [m]."""

    time: Floats
    """(k,) [s]"""
    values: dict[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.values[name]


def assembly_class(device: str) -> type[Assembly]:
    """The class that computes on a device; raises `LibraryMissing` where there is no GPU."""
    if device == "cpu":
        return Assembly
    from qdem_fem.cuda_assembly import CudaAssembly, gpu_require

    gpu_require()
    return CudaAssembly


class Simulation(ConditionedBodies):
    """Explicit dynamics of one or several bodies.

    ``strain``: ``"finger"`` (the paper), ``"small"``, ``"svk"`` or ``"corotational"``;
    ``precision``: ``"float64"`` or ``"float32"``; ``step`` [s], or ``safety`` times the critical
    step; ``gravity`` [m/s^2], three components, constant or a series; ``threads``: all by
    default, the result does not depend on it; ``mass_scaling`` [s]: raise the density of
    elements whose own critical step is shorter than this; ``device``: ``"cpu"``, or ``"cuda"``
    for a GPU (`qdem_fem.cuda_assembly`), whose results repeat to round-off only; ``contact``:
    how bodies touch, a `qdem_fem.SphereContact` or `SurfaceContact`; not at all by default.

    Bodies of one name are numbered, as messages name them.  In single precision a free body has
    a frame of its own (`qdem_fem.body_frames`), renewed when an advance begins: bits then depend
    on how a march is divided into advances.

    Velocity Verlet, as in the paper: ``v(k+1/2) = v(k-1/2) + dt f(u(k), v(k-1/2))/m``,
    ``u(k+1) = u(k) + dt v(k+1/2)``.  Not for quasi-static problems over long times, where an
    implicit method is cheaper (section 3.2 of the paper says so itself).
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        *,
        strain: Strain = "finger",
        precision: Literal["float64", "float32"] = "float64",
        step: float | None = None,
        safety: float = SAFETY,
        gravity: Value | None = None,
        threads: int | None = None,
        mass_scaling: float | None = None,
        device: Literal["cpu", "cuda"] = "cpu",
        contact: Contact | None = None,
    ) -> None:
        super().__init__(bodies)
        words_check(strain=strain, precision=precision, device=device)
        numbers_check(step=step, safety=safety, threads=threads, mass_scaling=mass_scaling)
        bounds_check(safety=safety, threads=threads)
        contact_options_check(contact, precision, device)
        self.device, self._assembly_class = device, assembly_class(device)
        self.contact = contact
        rigid_options_check(self.bodies, precision, device)
        self._contacts: Contacts | None = None
        self._rigid: RigidBodies | None = None
        self._absorbers: Absorbers | None = None
        self.strain, self.precision, self.safety = strain, precision, safety
        self.threads, self.mass_scaling = threads, mass_scaling
        self.gravity = None if gravity is None else Driver(gravity, 3, "gravity")
        self._given_step = None if step is None else float(step)
        self.motion = Motion()
        self.viscous = any(b.material.is_viscous for b in self.bodies if not b.rigid)
        self._assembly: Assembly | None = None
        self._lists: tuple[kernel.Loads, kernel.Constraints] | None = None
        self._critical: CriticalStep | None = None
        self.warned = nan
        """The critical step of which a warning was given [s]."""
        for body in self.bodies:
            body._simulation = self

    # --- time ----------------------------------------------------------------------------------

    @property
    def steps_done(self) -> int:
        """Time steps since the start."""
        return self.motion.steps_done

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * self.step

    @property
    def step(self) -> float:
        """Time step [s]; once steps were done it stays, as time is counted in steps."""
        for step in (self._given_step, self.motion.step):
            if step is not None:
                return step
        step = self.safety * self.critical_step.value
        if not isfinite(step):
            raise ConditionError(
                "every component of every node is held, or rigid: no motion limits the step",
                where="simulation, step",
                remedy="give step=",
            )
        return step

    @property
    def step_is_given(self) -> bool:
        """Whether the user gave the step."""
        return self._given_step is not None

    @property
    def added_mass(self) -> dict[str, float]:
        """What mass scaling added to each body, over its own mass [-]: the error it may make."""
        mass = self.assembly.mass
        added = {}
        for body, start in zip(self.bodies, self.first_node, strict=False):
            if body.rigid:
                added[body.name] = 0.0
                continue
            own = float((body.material.density * body.gradients[1]).sum())
            nodes = np.unique(self.master[start : start + len(body.nodes)])
            added[body.name] = float(mass[nodes].sum()) / own - 1 if self.mass_scaling else 0.0
        return added

    @property
    def critical_step(self) -> CriticalStep:
        """The largest stable step, for small motions about the reference configuration."""
        elements = self.elements_critical_step
        return elements if self.contacts is None else self.contacts.critical_step(elements)

    @property
    def elements_critical_step(self) -> CriticalStep:
        """The critical step of bodies that touch nothing."""
        if self._critical is None:
            self._critical = critical_step_find(self)
        return self._critical

    def advance(
        self,
        duration: float,
        probes: Mapping[str, Any] | None = None,
        sampling: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> History:
        """March on by ``duration`` [s], rounded up to whole steps.

        ``probes``: selections of nodes of the only body, or pairs ``(body, selection)``; their
        mean displacement is recorded every ``sampling`` [s], rounded to whole steps, at
        multiples of it.  ``progress`` is called with the time after every window of steps.

        Raises `Unstable` when the motion grows without bound, `ElementInverted` when an element
        turns inside out; the state is then that of the step at fault.
        """
        if not (is_real(duration) and 0 <= duration < STEPS_MOST * self.step):
            raise ConditionError(f"a duration of {duration!r} s", where="advance")
        if sampling is not None and not (is_real(sampling) and sampling > 0):
            raise ConditionError(f"a sampling every {sampling!r} s", where="advance")
        if probes is not None and not isinstance(probes, Mapping):
            raise ConditionError(
                "probes have no names", where="advance", remedy='give {"name": nodes}'
            )
        steps = ceil(duration / self.step * (1 - 1e-12) - 1e-9)
        stride = max(1, round((sampling or duration / SAMPLES) / self.step)) if steps else 1
        if steps:
            self.motion.step = self.step
        chosen = {name: self._probe(name, probe) for name, probe in (probes or {}).items()}
        every = np.concatenate([*chosen.values(), np.zeros(0, int)])
        samples = march(self, steps, stride, every, progress)
        values, column = {}, 0
        for name, nodes in chosen.items():
            values[name] = samples.record[:, column : column + len(nodes)].mean(axis=1)
            column += len(nodes)
        return History(samples.step_numbers * self.step, values)

    def absorb(self, body: Body, nodes: Any, depth: float | None = None) -> Absorbing:
        """`ConditionedBodies.absorb`, in double precision on the processor."""
        if self.precision != "float64" or self._assembly_class is not Assembly:
            raise ConditionError(
                "absorbing faces are computed in double precision on the processor",
                where="absorb",
                remedy='take precision="float64" and device="cpu"',
            )
        return super().absorb(body, nodes, depth)

    def relax(self, tolerance: float = 1e-8, max_steps: int = 100_000) -> StaticAnswer:
        """Bring deformable bodies to rest in equilibrium with the loads of the present time.

        Until the residual is below ``tolerance`` of the loads; time stands still, and `advance`
        goes on from there.  See `qdem_fem.dynamic_relaxation.relax` for what is raised.
        """
        if self.contact is not None:
            raise ConditionError(
                "bodies in contact have no static answer here",
                where="relax",
                remedy="march, with viscosity, until they rest",
            )
        if self.rigid is not None:
            raise ConditionError(
                "rigid bodies have no static answer here", where="relax", remedy="march"
            )
        if self.conditions.absorbing:
            raise ConditionError(
                "absorbing faces have no static answer here",
                where="relax",
                remedy="fix them, relax, and remove the fix before absorb",
            )
        return relax(self, tolerance, max_steps)

    def reaction(self, condition: Held | Roller) -> Floats:
        """Total force [N], (3,), that `fix`, `prescribe` or `roller` exerts on the body now."""
        return reaction(self, condition)

    def velocities(self, bodies: Sequence[Body]) -> Floats:
        """`Body.velocity` of some bodies, one after the other, computed once [m/s], (n, 3)."""
        whole = velocity_now(self)
        return np.concatenate([whole[self._own(body)] for body in bodies])

    def energy(self) -> Energy:
        """Energies now [J], see `Energy`."""
        return energy_now(self)

    def save(self, path: str | Path) -> None:
        """Write the state to a file (`qdem_fem.checkpoint.checkpoint_write`)."""
        checkpoint_write(self, path)

    def restore(self, path: str | Path) -> None:
        """Go on from a state that `save` wrote: to the same bits, as if never interrupted.

        The simulation has the meshes, materials, options and conditions of the saved one; else
        `CheckpointError` says what differs.
        """
        checkpoint_read(self, path)

    @property
    def assembly(self) -> Assembly:
        """The kernel's arrays, built when first needed."""
        if self._assembly is None:
            factor = None
            if self.mass_scaling is not None:
                soft = [body for body in self.bodies if not body.rigid]
                factor = mass_scaling_factor(soft, self.mass_scaling)
            self._assembly = self._assembly_class(
                self.bodies, self.master, self.strain, self.precision, self.threads, factor
            )
            for name in ("displacement", "velocity"):
                fields = [getattr(body, f"_{name}") for body in self.bodies]
                self._assembly.field_set(name, np.concatenate(fields))
            self.motion.displacement_set = any(body._displacement.any() for body in self.bodies)
            if any(body.rigid for body in self.bodies):
                from qdem_fem.rigid_bodies import RigidBodies

                self._rigid = RigidBodies(self)
        return self._assembly

    @property
    def rigid(self) -> RigidBodies | None:
        """The rigid bodies; None where there are none."""
        return self._rigid if self.assembly is not None else None

    @property
    def contacts(self) -> Contacts | None:
        """The contacts of the bodies; None where they have none."""
        if self.contact is not None and self._contacts is None:
            self._contacts = contacts_of(self, self.contact)
        return self._contacts

    @property
    def absorbers(self) -> Absorbers | None:
        """Dashpots and springs of absorbing faces; None where there are none."""
        if self._absorbers is None and self.conditions.absorbing:
            from qdem_fem.absorbing import Absorbers

            self._absorbers = Absorbers(self)
        return self._absorbers

    # --- for the march and the files -----------------------------------------------------------

    def packed_lists(self) -> tuple[kernel.Loads, kernel.Constraints]:
        """The kernel's lists of the present conditions."""
        if self._lists is None:
            self._lists = self.assembly.lists(self.conditions, self.gravity is not None)
            if self.rigid is not None:
                self._lists = self.rigid.lists_split(*self._lists)
        return self._lists

    def gravity_at(self, times: Floats) -> Floats | None:
        """Gravity [m/s^2], (k, 3), at ``times`` (k,) [s]; None without."""
        return None if self.gravity is None else self.gravity.sample(times)

    def _begun(self) -> bool:
        return self._assembly is not None

    def _before_change(self) -> None:
        velocities_level(self)

    def _changed(self, ties: bool) -> None:
        self._lists = self._absorbers = None
        if ties:
            self._critical = None
            if self._contacts is not None:
                self._contacts.held_anew()

    def _own(self, body: Body) -> slice:
        start = self._offset(body)
        return slice(start, start + len(body.nodes))

    def _field_of(self, body: Body, name: str) -> Floats:
        own = self._own(body)
        return velocity_now(self)[own] if name == "velocity" else self.assembly.field(name, own)

    def _field_set(self, body: Body, name: str, values: Floats) -> None:
        if self._assembly is None:
            return
        velocities_level(self)
        if self.rigid is not None and body.rigid:
            self.rigid.field_set(body, name, values)
        self.assembly.field_set(name, values, self._own(body))
        self.motion.displacement_set |= name == "displacement"
        self.motion.put_in = nan
        if self._contacts is not None and name == "displacement":
            self._contacts.stale = True
