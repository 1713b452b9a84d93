"""A simulation: bodies, conditions and the march in time (eq. 11 and Newton's second law)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, isfinite, nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qdem_fem import kernel
from qdem_fem.assembly import Assembly
from qdem_fem.body import Body
from qdem_fem.checkpoint import checkpoint_read, checkpoint_write
from qdem_fem.conditions import COMPONENTS, Conditions, Held, NodalLoad, Roller
from qdem_fem.critical_step import CriticalStep, critical_step_find
from qdem_fem.dynamic_relaxation import StaticAnswer, relax
from qdem_fem.errors import ConditionError
from qdem_fem.leapfrog import half_work, velocities_level, velocity_now
from qdem_fem.march import march
from qdem_fem.mass_scaling import mass_scaling_factor
from qdem_fem.reactions import reaction
from qdem_fem.reference_forces import (
    Strain,
    displacement_gradient,
    elastic_energy,
)
from qdem_fem.series import Driver, Value, is_real
from qdem_fem.simulation_options import (
    bodies_check,
    bodies_number,
    bounds_check,
    numbers_check,
    words_check,
)
from qdem_fem.surface import faces_within, pressure_forces

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SAFETY = 0.9
STEPS_MOST = 2**53
"""Numbers of steps are exact as floats up to here."""
SAMPLES = 1000
"""Samples of an advance whose sampling is not given."""


@dataclass(frozen=True)
class Energy:
    """Energies at a time [J]."""

    kinetic: float
    elastic: float
    external: float
    """Work of loads, gravity and prescribed motion since the start.

    What it takes to hold a node that a user's state had moved away is not counted."""


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


class Simulation:
    """Explicit dynamics of one or several bodies.

    ``strain``: ``"finger"`` (the paper), ``"small"``, ``"svk"`` or ``"corotational"``;
    ``precision``: ``"float64"`` or ``"float32"``; ``step`` [s], or ``safety`` times the critical
    step; ``gravity`` [m/s^2], three components, constant or a series; ``threads``: all by
    default, the result does not depend on it; ``mass_scaling`` [s]: raise the density of
    elements whose own critical step is shorter than this; ``device``: ``"cpu"``, or ``"cuda"``
    for a GPU (`qdem_fem.cuda_assembly`), whose results repeat to round-off only.

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
    ) -> None:
        if not isinstance(bodies, Iterable):
            raise ConditionError(f"{bodies!r} is no list of bodies", where="simulation")
        self.bodies = list(bodies)
        bodies_check(self.bodies)
        bodies_number(self.bodies)
        words_check(strain=strain, precision=precision, device=device)
        numbers_check(step=step, safety=safety, threads=threads, mass_scaling=mass_scaling)
        bounds_check(safety=safety, threads=threads)
        self._assembly_class = assembly_class(device)
        self.strain, self.precision, self.safety = strain, precision, safety
        self.threads, self.mass_scaling = threads, mass_scaling
        self.gravity = None if gravity is None else Driver(gravity, 3, "gravity")
        self._given_step = None if step is None else float(step)
        self._kept_step: float | None = None
        self.conditions = Conditions()
        self.steps_done = 0
        self.viscous = any(body.material.is_viscous for body in self.bodies)
        counts = [len(body.nodes) for body in self.bodies]
        self.first_node = np.concatenate([[0], np.cumsum(counts)])
        counts = [len(body.elements) for body in self.bodies]
        self._first_element = np.concatenate([[0], np.cumsum(counts)])
        self.master = np.arange(self.first_node[-1])
        self._assembly: Assembly | None = None
        self._lists: tuple[kernel.Loads, kernel.Constraints] | None = None
        self._critical: CriticalStep | None = None
        self.behind = False
        """True while velocities are half a step behind; False: they are at the time itself."""
        self.work = np.zeros(2)
        """Work of the loads and of prescribed motion since the start [J]."""
        self.displacement_set = False
        """Whether the user set a displacement since the last march."""
        self.warned = nan
        """The critical step of which a warning was given [s]."""
        self.put_in = nan
        """Energy of the state that the user set [J]; NaN: not known yet."""
        self.gravity_work = 0.0
        for body in self.bodies:
            body._simulation = self

    # --- conditions ----------------------------------------------------------------------------

    def fix(self, body: Body, nodes: Any, components: str = "xyz") -> Held:
        """Hold components of nodes where they are in the reference configuration."""
        chosen = self._components(components, "fix")
        return self._hold(Held(self._nodes(body, nodes, "fix"), chosen))

    def prescribe(
        self,
        body: Body,
        nodes: Any,
        component: str,
        displacement: Value,
        profile: ArrayLike | None = None,
    ) -> Held:
        """Give one component of the displacement [m], constant or changing with time.

        ``profile`` (n,) [-], one number for every node of the body, multiplies it.
        """
        chosen = self._components(component, "prescribe")
        driver = Driver(displacement, 1, "prescribe")
        here = self._nodes(body, nodes, "prescribe")
        factor = self._profile(body, here, profile, 1.0, "prescribe")
        return self._hold(Held(here, chosen, driver, factor))

    def roller(self, body: Body, nodes: Any, normal: ArrayLike) -> Roller:
        """Keep nodes in the plane through them with this normal, free within it."""
        try:
            direction = np.asarray(normal, dtype=float)
        except (TypeError, ValueError):
            direction = np.zeros(3)
        length = float(np.linalg.norm(direction)) if direction.shape == (3,) else 0.0
        if not (np.isfinite(length) and length > 0):
            raise ConditionError(
                f"{normal!r} is no direction", where="roller", remedy="give three components"
            )
        roller = Roller(self._nodes(body, nodes, "roller"), direction / length)
        velocities_level(self)
        self.conditions.rollers.append(roller)
        self._ties_changed()
        return roller

    def load(
        self, body: Body, nodes: Any, force: Value, profile: ArrayLike | None = None
    ) -> NodalLoad:
        """A total ``force`` [N], three components, shared equally by the nodes (section 3.1).

        With ``profile`` (n,) [-], one number for every node of the body, a node bears that share.
        """
        chosen = self._nodes(body, nodes, "load")
        share = self._profile(body, chosen, profile, 1 / len(chosen), "load")
        weights = np.repeat(share[:, None], 3, axis=1)
        return self._load(NodalLoad(chosen, weights, Driver(force, 3, "load")))

    def pressure(self, body: Body, nodes: Any, pressure: Value) -> NodalLoad:
        """A ``pressure`` [Pa] along the inward reference normal of the faces within ``nodes``."""
        self._offset(body)
        local = body.nodes_select(nodes, "pressure")
        mask = np.zeros(len(body.nodes), dtype=bool)
        mask[local] = True
        faces = faces_within(body.surface, mask)
        if not len(faces):
            raise ConditionError(
                f"no surface face of {body.name} has all three nodes in the selection",
                where="pressure",
            )
        areas = pressure_forces(body.nodes, faces, len(body.nodes))[local]
        chosen = self._nodes(body, local, "pressure")
        return self._load(NodalLoad(chosen, areas, Driver(pressure, 1, "pressure")))

    def periodic(self, body: Body, nodes_a: Any, nodes_b: Any, tolerance: float = 1e-6) -> None:
        """Join opposite faces: every node of ``nodes_b`` moves as its partner of ``nodes_a``.

        The faces differ by one shift along an axis; partners are found by the other two
        coordinates within ``tolerance`` of the body's size.  Before the first advance only.
        """
        from qdem_fem.periodic import partners

        if self._assembly is not None:
            raise ConditionError(
                "the simulation has begun",
                where="periodic",
                remedy="join faces before the first advance and before asking for its step",
            )
        a, b = (body.nodes_select(nodes, "periodic") for nodes in (nodes_a, nodes_b))
        first = self._offset(body)
        one, other = partners(body.nodes, a, b, tolerance, body.name)
        for i, j in zip(one + first, other + first, strict=True):
            i, j = self.master[i], self.master[j]
            self.master[self.master == max(i, j)] = min(i, j)

    def remove(self, condition: NodalLoad | Held | Roller) -> None:
        """Take back a condition that `fix`, `prescribe`, `roller`, `load`, `pressure` returned."""
        lists: tuple[list[Any], ...] = (
            self.conditions.loads, self.conditions.held, self.conditions.rollers
        )  # fmt: skip
        for conditions in lists:
            if condition in conditions:
                velocities_level(self)
                conditions.remove(condition)
                self._changed() if isinstance(condition, NodalLoad) else self._ties_changed()
                return
        raise ConditionError("it is none of the simulation's conditions", where="remove")

    # --- time ----------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * self.step

    @property
    def step(self) -> float:
        """Time step [s]; once steps were done it stays, as time is counted in steps."""
        for step in (self._given_step, self._kept_step):
            if step is not None:
                return step
        step = self.safety * self.critical_step.value
        if not isfinite(step):
            raise ConditionError(
                "every component of every node is held: no motion limits the step",
                where="simulation, step",
                remedy="give step=",
            )
        return step

    def step_keep(self, step: float) -> None:
        """Keep the step [s] that the march began with."""
        self._kept_step = step

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
            own = float((body.material.density * body.gradients[1]).sum())
            nodes = np.unique(self.master[start : start + len(body.nodes)])
            added[body.name] = float(mass[nodes].sum()) / own - 1 if self.mass_scaling else 0.0
        return added

    @property
    def critical_step(self) -> CriticalStep:
        """The largest stable step, for small motions about the reference configuration."""
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
            self.step_keep(self.step)
        chosen = {name: self._probe(name, probe) for name, probe in (probes or {}).items()}
        recorded = march(
            self, steps, stride, np.concatenate([*chosen.values(), np.zeros(0, int)]), progress
        )
        start = self.steps_done - steps
        first = 0 if start == 0 else stride - start % stride
        numbers = start + np.arange(first, steps + 1, stride, dtype=float)
        values, column = {}, 0
        for name, nodes in chosen.items():
            values[name] = recorded[:, column : column + len(nodes)].mean(axis=1)
            column += len(nodes)
        return History(numbers * self.step, values)

    def relax(self, tolerance: float = 1e-8, max_steps: int = 100_000) -> StaticAnswer:
        """Bring the bodies to rest in equilibrium with the loads of the present time.

        Until the residual is below ``tolerance`` of the loads; time stands still, and `advance`
        goes on from there.  See `qdem_fem.dynamic_relaxation.relax` for what is raised.
        """
        return relax(self, tolerance, max_steps)

    def reaction(self, condition: Held | Roller) -> Floats:
        """Total force [N], (3,), that `fix`, `prescribe` or `roller` exerts on the body now."""
        return reaction(self, condition)

    def energy(self) -> Energy:
        """Energies now [J]; elastic energy as `qdem_fem.reference_forces.elastic_energy`."""
        velocity = velocity_now(self)
        kinetic = 0.5 * float((self.assembly.mass * (velocity**2).sum(axis=1)).sum())
        elastic = 0.0
        for body in self.bodies:
            gradients, volumes = body.gradients
            gradient = displacement_gradient(gradients, body.elements, body.displacement)
            material = body.material
            elastic += elastic_energy(
                gradient, volumes, material.lame_first, material.lame_second, self.strain
            ).sum()
        external = float(self.work.sum()) + self.gravity_work
        if self.behind:
            external += float(half_work(self, self.assembly.field("velocity"), velocity).sum())
        return Energy(kinetic, float(elastic), external)

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
                factor = mass_scaling_factor(self.bodies, self.mass_scaling)
            self._assembly = self._assembly_class(
                self.bodies, self.master, self.strain, self.precision, self.threads, factor
            )
            for name in ("displacement", "velocity"):
                fields = [getattr(body, f"_{name}") for body in self.bodies]
                self._assembly.field_set(name, np.concatenate(fields))
            self.displacement_set = any(body._displacement.any() for body in self.bodies)
        return self._assembly

    # --- for the march and the files -----------------------------------------------------------

    def packed_lists(self) -> tuple[kernel.Loads, kernel.Constraints]:
        """The kernel's lists of the present conditions."""
        if self._lists is None:
            self._lists = self.assembly.lists(self.conditions, self.gravity is not None)
        return self._lists

    def gravity_at(self, times: Floats) -> Floats | None:
        """Gravity [m/s^2], (k, 3), at ``times`` (k,) [s]; None without."""
        return None if self.gravity is None else self.gravity.sample(times)

    def _offset(self, body: Body) -> int:
        if not any(body is member for member in self.bodies):
            name = body.name if isinstance(body, Body) else f"a {type(body).__name__}"
            raise ConditionError(
                f"{name} is not a body of this simulation",
                where="body",
                remedy="the first argument is one of the bodies it was made of",
            )
        return int(self.first_node[[body is member for member in self.bodies].index(True)])

    def _nodes(self, body: Body, nodes: Any, where: str) -> Integers:
        start = self._offset(body)
        return body.nodes_select(nodes, where) + start

    def _probe(self, name: str, probe: Any) -> Integers:
        if isinstance(probe, tuple) and len(probe) == 2 and isinstance(probe[0], Body):
            return self._nodes(probe[0], probe[1], f"probe {name}")
        if len(self.bodies) > 1:
            raise ConditionError(
                "with several bodies a probe is a pair (body, nodes)", where=f"probe {name}"
            )
        return self._nodes(self.bodies[0], probe, f"probe {name}")

    @staticmethod
    def _components(components: str, where: str) -> tuple[int, ...]:
        if not isinstance(components, str) or not components or set(components) - set(COMPONENTS):
            raise ConditionError(f"components are of 'xyz', not {components!r}", where=where)
        return tuple(sorted({COMPONENTS.index(c) for c in components}))

    def _profile(
        self, body: Body, nodes: Integers, profile: ArrayLike | None, default: float, where: str
    ) -> Floats:
        """Factors of the chosen nodes, (k,)."""
        if profile is None:
            return np.full(len(nodes), default)
        try:
            every = np.asarray(profile, dtype=float)
        except (TypeError, ValueError):
            every = np.zeros(0)
        if every.shape != (len(body.nodes),) or not np.isfinite(every).all():
            raise ConditionError(
                f"a profile has one finite number for each of the {len(body.nodes)} nodes of "
                f"{body.name}",
                where=where,
            )
        return every[nodes - self._offset(body)]

    def _hold(self, held: Held) -> Held:
        velocities_level(self)
        self.conditions.held.append(held)
        self._ties_changed()
        return held

    def _load(self, load: NodalLoad) -> NodalLoad:
        velocities_level(self)
        self.conditions.loads.append(load)
        self._changed()
        return load

    def _changed(self) -> None:
        """Conditions changed (after `velocities_level`): the kernel's lists are made anew."""
        self._lists = None

    def _ties_changed(self) -> None:
        """What is held changed: the critical step too."""
        self._critical = None
        self._changed()

    def _field_of(self, body: Body, name: str) -> Floats:
        every = velocity_now(self) if name == "velocity" else self.assembly.field(name)
        start = self._offset(body)
        return every[start : start + len(body.nodes)]

    def _field_set(self, body: Body, name: str, values: Floats) -> None:
        if self._assembly is None:
            return
        start = self._offset(body)
        velocities_level(self)
        field = self.assembly.field(name)
        field[start : start + len(body.nodes)] = values
        self.assembly.field_set(name, field)
        self.displacement_set |= name == "displacement"
        self.put_in = nan
