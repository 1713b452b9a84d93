"""A simulation: bodies, conditions and the march in time (eq. 11 and Newton's second law)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.bodies import Body, Discretisation
from qdem_fem.contact import choose_assembly
from qdem_fem.element import Strain
from qdem_fem.files import ConditionError, Floats, is_real
from qdem_fem.march import options
from qdem_fem.march.checkpoint import read_checkpoint, write_checkpoint
from qdem_fem.march.conditioned_bodies import ConditionedBodies
from qdem_fem.march.dynamic_relaxation import StaticAnswer, relax
from qdem_fem.march.energies import Energy, estimate_errors, find_energy
from qdem_fem.march.leapfrog import find_velocity, level_velocities
from qdem_fem.march.state import STEP_SAFETY
from qdem_fem.march.steps import march

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


class Simulation(ConditionedBodies):
    """Explicit dynamics of one or several bodies.

    ``strain``: ``"finger"`` (the paper), or another of `qdem_fem.element.MEASURES`;
    ``precision``: ``"float64"`` or ``"float32"``; ``step`` [s], or ``safety`` times the critical
    step; ``gravity`` [m/s^2], three components; ``threads``: all by default, the result does not
    depend on it; ``mass_scaling`` [s]: raise the density of elements whose own critical step is
    shorter than this; ``device``: ``"cpu"``, or ``"cuda"`` for a GPU
    (`qdem_fem.kernel.cuda.assembly`), whose results repeat to round-off only;
    ``contact``: how bodies touch, a `qdem_fem.SphereContact` or `SurfaceContact`; by default not.

    Bodies of one name are numbered, as messages name them.  In single precision a free body has
    a frame of its own (`qdem_fem.bodies.frames`), renewed when an advance begins: bits then depend
    on how a march is divided into advances.

    Velocity Verlet, as in the paper: ``v(k+1/2) = v(k-1/2) + dt f(u(k), v(k-1/2))/m``,
    ``u(k+1) = u(k) + dt v(k+1/2)``.  Not for quasi-static problems over long times, where an
    implicit method is cheaper (section 3.2 of the paper says so itself).
    """

    def __init__(
        self, bodies: Sequence[Body], *, strain: Strain = "finger",
        precision: Literal["float64", "float32"] = "float64", step: float | None = None,
        safety: float = STEP_SAFETY, gravity: ArrayLike | None = None, threads: int | None = None,
        mass_scaling: float | None = None, device: Literal["cpu", "cuda"] = "cpu",
        contact: options.Contact | None = None,
    ) -> None:  # fmt: skip
        own = options.list_bodies(bodies)
        options.check_options(
            strain=strain, precision=precision, device=device, step=step, safety=safety,
            threads=threads, mass_scaling=mass_scaling,
        )  # fmt: skip
        options.check_contact(contact, precision, device)
        options.check_elements(own, device)
        choose_assembly(device)
        options.check_rigid(own, precision, device)
        super().__init__(
            own, strain, precision, threads, mass_scaling, device, options.make_gravity(gravity),
            contact=contact, given_step=None if step is None else float(step), safety=safety,
        )  # fmt: skip
        for body in self.bodies:
            body.mover = self

    @property
    def added_mass(self) -> dict[str, float]:
        """What mass scaling added to each body, over its own mass [-]: the error it may make."""
        added = {body.name: 0.0 for body in self.bodies}
        for body in self.bodies:
            if self.mass_scaling and not body.rigid:
                own = float((body.material.density * body.gradients[1]).sum())
                nodes = np.unique(self.master[self._node_slice(body)])
                added[body.name] = float(self.assembly.mass[nodes].sum()) / own - 1
        return added

    def advance(
        self, duration: float, probes: Mapping[str, Any] | None = None,
        sampling: float | None = None, progress: Callable[[float], None] | None = None,
    ) -> History:  # fmt: skip
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
        chosen = {name: self._probe(name, probe) for name, probe in (probes or {}).items()}
        every = np.concatenate([*chosen.values(), np.zeros(0, int)])
        samples = march(self, steps, stride, every, progress)
        ends = np.cumsum([len(nodes) for nodes in chosen.values()])
        parts = zip(chosen, np.split(samples.record, ends, axis=1), strict=False)
        values = {name: part.mean(axis=1) for name, part in parts}
        numbers = samples.first_step + samples.stride * np.arange(len(samples.record), dtype=float)
        return History(numbers * self.step, values)

    def relax(self, tolerance: float = 1e-8, max_steps: int = 100_000) -> StaticAnswer:
        """Bring deformable bodies to rest in equilibrium with the loads of the present time.

        Until the residual is below ``tolerance`` of the loads; time stands still, and `advance`
        goes on from there.  See `qdem_fem.march.dynamic_relaxation.relax` for what is raised.
        """
        for there, what, remedy in (
            (self.contact, "bodies in contact", "march, with viscosity, until they rest"),
            (self.rigid, "rigid bodies", "march"),
        ):
            if there is not None:
                said = f"{what} have no static answer here"
                raise ConditionError(said, where="relax", remedy=remedy)
        return relax(self, tolerance, max_steps)

    def velocities(self, bodies: Sequence[Body]) -> Floats:
        """`Body.velocity` of some bodies, one after the other, computed once [m/s], (n, 3)."""
        whole = find_velocity(self)
        return np.concatenate([whole[self._node_slice(body)] for body in bodies])

    def energy(self) -> Energy:
        """Energies now [J], see `Energy`."""
        return find_energy(self)

    def estimate_errors(self, displacement: Floats | None = None) -> Discretisation | None:
        """Errors of the meshes in the answer or motion now, estimated: `Discretisation`.

        ``displacement`` (n, 3) [m] of all bodies, one after the other: of another time.
        """
        return estimate_errors(self, displacement)

    def save(self, path: str | Path) -> None:
        """Write the state to a file (`qdem_fem.march.write_checkpoint`)."""
        write_checkpoint(self, path)

    def restore(self, path: str | Path) -> None:
        """Go on from a state that `save` wrote: to the same bits, as if never interrupted.

        The simulation has the meshes, materials, options and conditions of the saved one; else
        `CheckpointError` says what differs.
        """
        read_checkpoint(self, path)

    # --- what the bodies ask for ---------------------------------------------------------------

    def field_of(self, body: Body, name: str) -> Floats:
        """``displacement`` [m] or ``velocity`` [m/s] of a body's nodes now, (n, 3)."""
        own = self._node_slice(body)
        return find_velocity(self)[own] if name == "velocity" else self.assembly.field(name, own)

    def set_field(self, body: Body, name: str, values: Floats) -> None:
        """Set one of them; before the arrays are made the body keeps it."""
        if not self.begun:
            return
        level_velocities(self)
        if self.rigid is not None and body.rigid:
            self.rigid.set_field(body, name, values)
        self.assembly.set_field(name, values, self._node_slice(body))
        self.motion.put_in = nan
        if name == "displacement":
            self.motion.displacement_set = True
            if self._contacts is not None:  # are to be found again: the user moved a body
                self._contacts.stale = True

    def _node_slice(self, body: Body) -> slice:
        start = self._offset(body)
        return slice(start, start + len(body.nodes))
