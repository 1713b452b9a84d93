"""A simulation: bodies, conditions and the march in time (eq. 11 and Newton's second law)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, isnan, nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qdem_fem import kernel
from qdem_fem.assembly import NO_LOADS, Assembly
from qdem_fem.body import Body
from qdem_fem.checkpoint import checkpoint_read, checkpoint_write
from qdem_fem.conditions import COMPONENTS, Conditions, Held, NodalLoad, Roller
from qdem_fem.critical_step import CriticalStep, highest_mode
from qdem_fem.dynamic_relaxation import StaticAnswer, relax
from qdem_fem.errors import ConditionError, ElementInverted, Unstable
from qdem_fem.mass_scaling import mass_scaling_factor
from qdem_fem.reference_forces import (
    Strain,
    displacement_gradient,
    elastic_energy,
    volume_change,
)
from qdem_fem.series import Driver, Value, is_real
from qdem_fem.surface import faces_within, pressure_forces

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SAFETY = 0.9
PRECISIONS = ("float64", "float32")
DEVICES = ("cpu", "cuda")
WINDOW_STEPS = 4096
GRAVITY_STEPS = 16
"""Steps over which the work of a gravity that changes is taken from its mean."""
STEPS_MOST = 2**53
"""Numbers of steps are exact as floats up to here."""
SAMPLES = 1000
"""Samples of an advance whose sampling is not given."""
GROWTH = 10.0
"""Kinetic energy over all energy ever put in, above which a motion is called unstable."""
PROBE_STRAIN = 1e-9
"""Strain of the motions that are tried for the critical step."""


@dataclass(frozen=True)
class Energy:
    """Energies at a time [J]."""

    kinetic: float
    elastic: float
    external: float
    """Work of loads, gravity and prescribed motion since the start."""


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
        self._check_options(strain, precision, device, step, safety, threads, mass_scaling)
        self._assembly_class = assembly_class(device)
        self.strain, self.precision, self.safety = strain, precision, safety
        self.threads, self.mass_scaling = threads, mass_scaling
        self._gravity = None if gravity is None else Driver(gravity, 3, "gravity")
        self._given_step = None if step is None else float(step)
        self.conditions = Conditions()
        self.steps_done = 0
        self.viscous = any(body.material.is_viscous for body in self.bodies)
        counts = [len(body.nodes) for body in self.bodies]
        self._first_node = np.concatenate([[0], np.cumsum(counts)])
        counts = [len(body.elements) for body in self.bodies]
        self._first_element = np.concatenate([[0], np.cumsum(counts)])
        self._master = np.arange(self._first_node[-1])
        self._assembly: Assembly | None = None
        self._lists: tuple[kernel.Loads, kernel.Constraints] | None = None
        self._critical: CriticalStep | None = None
        self._behind = False
        """True while velocities are half a step behind; False: they are at the time itself."""
        self.work = np.zeros(2)
        """Work of the loads and of prescribed motion since the start [J]."""
        self._put_in = nan
        """Energy of the state that the user set [J]; NaN: not known yet."""
        self._gravity_work = 0.0
        for body in self.bodies:
            body._simulation = self

    # --- conditions ----------------------------------------------------------------------------

    def fix(self, body: Body, nodes: Any, components: str = "xyz") -> Held:
        """Hold components of nodes where they are in the reference configuration."""
        chosen = self._components(components, "fix")
        return self._hold(Held(self._nodes(body, nodes, "fix"), chosen))

    def prescribe(self, body: Body, nodes: Any, component: str, displacement: Value) -> Held:
        """Give one component of the displacement [m], constant or changing with time."""
        chosen = self._components(component, "prescribe")
        driver = Driver(displacement, 1, "prescribe")
        return self._hold(Held(self._nodes(body, nodes, "prescribe"), chosen, driver))

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
        self._level()
        self.conditions.rollers.append(roller)
        self._changed()
        return roller

    def load(self, body: Body, nodes: Any, force: Value) -> NodalLoad:
        """A total ``force`` [N], three components, shared equally by the nodes (section 3.1)."""
        chosen = self._nodes(body, nodes, "load")
        share = np.full((len(chosen), 3), 1 / len(chosen))
        return self._load(NodalLoad(chosen, share, Driver(force, 3, "load")))

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
            i, j = self._master[i], self._master[j]
            self._master[self._master == max(i, j)] = min(i, j)

    def remove(self, condition: NodalLoad | Held | Roller) -> None:
        """Take back a condition that `fix`, `prescribe`, `roller`, `load`, `pressure` returned."""
        lists: tuple[list[Any], ...] = (
            self.conditions.loads, self.conditions.held, self.conditions.rollers
        )  # fmt: skip
        for conditions in lists:
            if condition in conditions:
                self._level()
                conditions.remove(condition)
                self._changed()
                return
        raise ConditionError("it is none of the simulation's conditions", where="remove")

    # --- time ----------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.steps_done * self.step

    @property
    def step(self) -> float:
        """Time step [s]."""
        return (
            self.safety * self.critical_step.value if self._given_step is None else self._given_step
        )

    @property
    def critical_step(self) -> CriticalStep:
        """The largest stable step, for small motions about the reference configuration."""
        if self._critical is None:
            self._critical = self._critical_step()
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
        if not isinstance(probes or {}, Mapping):
            raise ConditionError(
                "probes have no names", where="advance", remedy='give {"name": nodes}'
            )
        steps = ceil(duration / self.step * (1 - 1e-12) - 1e-9)
        stride = max(1, round((sampling or duration / SAMPLES) / self.step)) if steps else 1
        chosen = {name: self._probe(name, probe) for name, probe in (probes or {}).items()}
        recorded = self._march(
            steps, stride, np.concatenate([*chosen.values(), np.zeros(0, int)]), progress
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

    def energy(self) -> Energy:
        """Energies now [J]; elastic energy as `qdem_fem.reference_forces.elastic_energy`."""
        velocity = self._velocity_now()
        kinetic = 0.5 * float(self.assembly.mass @ (velocity**2).sum(axis=1))
        elastic = 0.0
        for body in self.bodies:
            gradients, volumes = body.gradients
            gradient = displacement_gradient(gradients, body.elements, body.displacement)
            material = body.material
            elastic += elastic_energy(
                gradient, volumes, material.lame_first, material.lame_second, self.strain
            ).sum()
        external = float(self.work.sum()) + self._gravity_work
        if self._behind:
            external += float(self._half_work(self.assembly.field("velocity"), velocity).sum())
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
                self.bodies, self._master, self.strain, self.precision, self.threads, factor
            )
            for name in ("displacement", "velocity"):
                fields = [getattr(body, f"_{name}") for body in self.bodies]
                self._assembly.field_set(name, np.concatenate(fields))
        return self._assembly

    # --- inside --------------------------------------------------------------------------------

    def _packed_lists(self) -> tuple[kernel.Loads, kernel.Constraints]:
        if self._lists is None:
            self._lists = self.assembly.lists(self.conditions)
        return self._lists

    def _gravity_at(self, times: Floats) -> Floats | None:
        return None if self._gravity is None else self._gravity.sample(times)

    def _accelerations(self, displacement: Floats, velocity: Floats) -> Floats:
        """Accelerations now [m/s^2], (n, 3), zero where held."""
        change = self._accelerations_free(displacement, velocity)
        return self.assembly.hold(change, self._packed_lists()[1])

    def _accelerations_free(self, displacement: Floats, velocity: Floats) -> Floats:
        """What the forces would make of all nodes if none were held [m/s^2], (n, 3)."""
        loads, held = self._packed_lists()
        now = np.full(2, self.time)
        return self.assembly.accelerations(
            displacement, velocity, loads, held, self.conditions.table(now), self._gravity_at(now)
        )

    def _velocity_now(self) -> Floats:
        """Velocity at the time of the displacement [m/s], (n, 3)."""
        velocity = self.assembly.field("velocity")
        if self._behind:
            displacement = self.assembly.field("displacement")
            change = 0.5 * self.step * self._accelerations(displacement, velocity)
            _, held = self._packed_lists()
            table = self.conditions.table(self.time + self.step * np.arange(2.0))
            ahead = held.weight * (table[1] - table[0])[held.series] / self.step
            flat = self._by_place(velocity + change)
            flat[held.node_at] = 0.5 * (self._by_place(velocity)[held.node_at] + ahead)
            velocity = flat.reshape(-1, 4)[self.assembly.place, :3]
        return velocity

    def _by_place(self, field: Floats) -> Floats:
        """A nodal field (n, 3) in the kernel's order, four numbers a node."""
        flat = np.zeros((self.assembly.n_nodes, 4))
        flat[self.assembly.place, :3] = field
        return flat.ravel()

    def _begin(self) -> None:
        """Take the velocities half a step back: the leapfrog form of velocity Verlet."""
        if not self._behind:
            displacement = self.assembly.field("displacement")
            velocity = self.assembly.field("velocity")
            change = self._accelerations(displacement, velocity)
            behind = velocity - 0.5 * self.step * change
            self.work -= self._half_work(behind, velocity)
            _, held = self._packed_lists()
            held.previous[:] = self._by_place(behind)[held.node_at]
            self.assembly.field_set("velocity", behind)
            self._behind = True

    def _half_work(self, behind: Floats, level: Floats) -> Floats:
        """Work in the half step up to now [J], from both its velocities (n, 3): as `work`."""
        loads, held = self._packed_lists()
        table = self.conditions.table(np.array([self.time]))[0]
        mean = self._by_place(0.5 * (behind + level))
        force = loads.weight * table[loads.series]
        work = np.array([0.5 * self.step * float(force @ mean[loads.node_at]), 0.0])
        if held.weight.any():  # the impulse that moved the nodes as they were told
            free = self._accelerations_free(self.assembly.field("displacement"), behind)
            missing = self._by_place(level - behind - 0.5 * self.step * free)
            inverse = np.asarray(self.assembly.state.inverse_mass, dtype=float)
            mass = 1 / inverse[held.node_at // 4]
            work[1] = mass @ (missing * mean)[held.node_at]
        return work

    def _level(self) -> None:
        """Bring the velocities to the time of the displacements: what `_begin` did, undone."""
        if self._behind:
            behind, level = self.assembly.field("velocity"), self._velocity_now()
            self.work += self._half_work(behind, level)
            self.assembly.field_set("velocity", level)
            self._behind = False

    def _march(
        self, steps: int, stride: int, nodes: Integers, progress: Callable[[float], None] | None
    ) -> Floats:
        """Compute steps in windows; returns samples (k, nodes, 3) of the displacement [m]."""
        if isnan(self._put_in):
            self._put_in = self._energy_set()
        self._begin()
        assembly, (loads, held) = self.assembly, self._packed_lists()
        start, end = self.steps_done, self.steps_done + steps
        first = 0 if start == 0 else stride - start % stride
        record = np.zeros((max(0, (steps - first) // stride + 1), len(nodes), 3))
        if first == 0 and len(record):
            record[0] = assembly.field("displacement")[nodes]
        most = max(16, min(WINDOW_STEPS, assembly.window_work // len(assembly.elements)))
        if self._gravity is not None and self._gravity.varying is not None:
            most = GRAVITY_STEPS
        while self.steps_done < end:
            count = min(most, end - self.steps_done)
            times = self.step * (self.steps_done + np.arange(count + 1, dtype=float))
            behind = self.steps_done - start - first  # steps since the first sample
            taken = behind // stride + 1 if behind >= 0 else 0
            ahead = taken * stride - behind
            probes = kernel.Probes(4 * assembly.place[nodes], record[taken:], stride, ahead)
            gravity = self._gravity_at(times)
            before = assembly.field("displacement") if gravity is not None else None
            done, bad = assembly.window(
                count, self.step, loads, held, probes, self.conditions.table(times), gravity,
                self.work,
            )  # fmt: skip
            self.steps_done += done
            if gravity is not None and before is not None:
                moved = assembly.field("displacement") - before
                self._gravity_work += float(assembly.mass @ (moved @ gravity.mean(axis=0)))
            self._check_motion(bad)
            if progress is not None:
                progress(self.time)
        return record

    def _kinetic(self) -> float:
        velocity = self.assembly.field("velocity")
        return 0.5 * float(self.assembly.mass @ (velocity**2).sum(axis=1))

    def _energy_set(self) -> float:
        """Energy of the state that the march begins with [J]."""
        if not any(self.assembly.field(name).any() for name in ("displacement", "velocity")):
            return 0.0
        energy = self.energy()
        return energy.kinetic + abs(energy.elastic)

    def _check_motion(self, bad: float) -> None:
        """Raise when the state can not be right: energy from nothing, or inverted elements."""
        kinetic = self._kinetic()
        put_in = self._put_in + abs(self.work).sum() + abs(self._gravity_work)
        ratio = self.step / self.critical_step.value
        if not kinetic <= GROWTH * put_in and (ratio > 1 or not np.isfinite(kinetic)):
            critical = self.critical_step
            raise Unstable(
                f"the motion grew without bound: {kinetic:.3g} J of kinetic energy from "
                f"{put_in:.3g} J put in; the step of {self.step:.4g} s is {ratio:.3f} times the "
                f"critical one of {critical.value:.4g} s, which element {critical.element} of "
                f"{critical.body} governs",
                where=f"t = {self.time:.6g} s, step {self.steps_done}",
                remedy="take a step below the critical one (safety 0.9 does), or mend the mesh",
            )
        if bad > 0:
            self._raise_inverted()

    def _raise_inverted(self) -> None:
        for body in self.bodies:
            gradient = displacement_gradient(body.gradients[0], body.elements, body.displacement)
            jacobian = 1 + volume_change(gradient)
            wrong = np.flatnonzero(~(jacobian > 0))
            if wrong.size:
                raise ElementInverted(
                    f"element {wrong[0]} of {body.name} was turned inside out (its volume is "
                    f"{jacobian[wrong[0]]:.3g} times what it was; {wrong.size} such elements)",
                    where=f"t = {self.time:.6g} s, step {self.steps_done}",
                    remedy="the load crushes it: lower the load, mesh finer there, or take a "
                    "shorter step",
                    element=int(wrong[0]),
                )
        raise ElementInverted(
            "an element was turned inside out within one step and back",
            where=f"t = {self.time:.6g} s, step {self.steps_done}",
            remedy="take a shorter step",
        )

    def _critical_step(self) -> CriticalStep:
        """`highest_mode` of the kernel's own forces for small motions."""
        assembly, (_, held) = self.assembly, self._packed_lists()
        size = PROBE_STRAIN * max(float(np.ptp(body.nodes, axis=0).max()) for body in self.bodies)
        nothing = np.ones((2, 1))

        follows = self._master != np.arange(len(self._master))

        def accelerate(u: Floats, v: Floats) -> Floats:
            u, v = u[self._master], v[self._master]
            scale = size / max(abs(u).max(), 1e-300)
            u, v = (assembly.hold(scale * field, held) for field in (u, v))
            change = assembly.accelerations(u, v, NO_LOADS, held, nothing, None)
            change = assembly.hold(change, held) / scale
            change[follows] = 0.0  # no motion of their own: the operator stays symmetric
            return change

        step, stiffness, damping, mode, count = highest_mode(
            accelerate, assembly.mass, viscous=self.viscous
        )
        mode = mode[self._master]
        body, element = self._governing(mode)
        return CriticalStep(
            value=step,
            omega=float(np.sqrt(max(stiffness, 0.0))),
            damping_ratio=damping / (2 * np.sqrt(stiffness)) if stiffness > 0 else 0.0,
            element=element,
            body=body.name,
            mode=mode / abs(mode).max(),
            forces_evaluated=count,
        )

    def _governing(self, mode: Floats) -> tuple[Body, int]:
        """The element with most energy in a motion (n, 3), and its body."""
        found: list[tuple[float, Body, int]] = []
        for body in self.bodies:
            gradients, volumes = body.gradients
            moved = mode[self._offset(body) : self._offset(body) + len(body.nodes)]
            gradient = displacement_gradient(gradients, body.elements, moved)
            material = body.material
            energy = elastic_energy(
                gradient, volumes, material.lame_first, material.lame_second, "small"
            )
            found.append((float(energy.max()), body, int(np.argmax(energy))))
        _, body, element = max(found, key=lambda entry: entry[0])
        return body, element

    def _offset(self, body: Body) -> int:
        if not any(body is member for member in self.bodies):
            name = body.name if isinstance(body, Body) else repr(body)
            raise ConditionError(f"{name} is not in this simulation", where="body")
        return int(self._first_node[[body is member for member in self.bodies].index(True)])

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
        if not components or not set(components) <= set(COMPONENTS):
            raise ConditionError(f"components are of 'xyz', not {components!r}", where=where)
        return tuple(sorted({COMPONENTS.index(c) for c in components}))

    def _hold(self, held: Held) -> Held:
        self._level()
        self.conditions.held.append(held)
        self._changed()
        return held

    def _load(self, load: NodalLoad) -> NodalLoad:
        self._level()
        self.conditions.loads.append(load)
        self._changed()
        return load

    def _changed(self) -> None:
        """Conditions changed (after `_level`): lists and critical step are made anew."""
        if self._given_step is None and self._critical is not None and self.steps_done == 0:
            self._critical = None
        self._lists = None

    def _field_of(self, body: Body, name: str) -> Floats:
        every = self._velocity_now() if name == "velocity" else self.assembly.field(name)
        start = self._offset(body)
        return every[start : start + len(body.nodes)]

    def _field_set(self, body: Body, name: str, values: Floats) -> None:
        if self._assembly is None:
            return
        start = self._offset(body)
        self._level()
        field = self.assembly.field(name)
        field[start : start + len(body.nodes)] = values
        self.assembly.field_set(name, field)
        self._put_in = nan

    def _check_options(
        self, strain: str, precision: str, device: str, step: float | None, safety: float,
        threads: int | None, mass_scaling: float | None,
    ) -> None:  # fmt: skip
        if not self.bodies or not all(isinstance(body, Body) for body in self.bodies):
            raise ConditionError("give a list of at least one Body", where="simulation")
        if len({id(body) for body in self.bodies}) < len(self.bodies):
            raise ConditionError("a body is listed twice", where="simulation")
        for body in self.bodies:
            if body._simulation is not None:
                raise ConditionError(
                    f"{body.name} is in another simulation, which moves it",
                    where="simulation",
                    remedy="make another of the same mesh: Body(body.mesh, body.material)",
                )
        for name, value, known in (
            ("strain", strain, tuple(kernel.LAWS)), ("precision", precision, PRECISIONS),
            ("device", device, DEVICES),
        ):  # fmt: skip
            if value not in known:
                raise ConditionError(
                    f"{value!r} is none of {', '.join(known)}", where=f"simulation, {name}"
                )
        for name, number in (
            ("step", step), ("safety", safety), ("threads", threads), ("mass_scaling", mass_scaling)
        ):  # fmt: skip
            if number is not None and not (is_real(number) and number > 0):
                raise ConditionError(f"{number!r} is not above zero", where=f"simulation, {name}")
