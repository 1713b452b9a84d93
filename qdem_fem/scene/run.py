"""The run of a scene: advance, record, save; goes on after a kill to the same bits."""

import io
import json
import time
import zipfile
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from qdem_fem.files import (
    CheckpointError,
    EnergyLost,
    Floats,
    Interrupted,
    NotConverged,
    Table,
    read_table,
    write_bodies_vtu,
)
from qdem_fem.scene.doubts import warn_of_strain
from qdem_fem.scene.energy_account import EnergyAccount
from qdem_fem.tables import Prepared
from trackbed.memory import read_arrays
from trackbed.run_files import RESULT, note_signals, read_object, write_pvd, write_whole
from trackbed.run_files import folder as run_folder

ENERGIES = ("kinetic", "elastic", "external")
CONTACT_ENERGIES = ("contact", "friction")
VISCOUS_ENERGY = ("viscous",)
CHECKPOINT, COST, PEAK, SEALS = "checkpoint.npz", "cost.json", "peak.npz", "tables"
NO_REST = {
    "inside out": "look at the units of material.young, of the mesh and of the loads",
    "": "where a warning names parts of a mesh that share no face, join them or hold each, as they "
    "turn about an edge or a point; else raise simulation.tolerance above the residual",
}
"""What to do about no static answer, by the words on how it ended."""


@dataclass(frozen=True)
class PlanNumbers:
    """How often a run records and looks up, unless asked otherwise."""

    samples: int = 2000  # of the probes in a run [-]
    energy_rows: int = 200  # in a run [-],
    energy_steps: int = 100  # and steps between two at least [-]: a row costs as much as twenty
    chunk_work: int = 50_000_000  # element-steps between looks at clock and signals [-]: seconds


PLAN = PlanNumbers()


class RunFolder(run_folder.RunFolder):
    """The folder of one QDEM run; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, CHECKPOINT, COST, PEAK, "probes.csv",
        "energy.csv", "fields.pvd", "fields_*.vtu", "report.html", "picture-*.png", ".*.partial",
    )  # fmt: skip
    states = CHECKPOINT
    compared = ("scene", "files")
    free: ClassVar[tuple[str, ...]] = (
        "scene.title", "scene.simulation.threads", "scene.output.checkpoint_interval",
        "scene.output.audit", "scene.output.magnification", "scene.output.modes",
    )  # fmt: skip

    def find_extended(self, before: Any, after: Any) -> tuple[str, ...]:
        """The duration, where the scene names the intervals that would else follow from it."""
        try:
            old, new = (one["scene"]["simulation"]["duration"] for one in (before, after))
            output = after["scene"]["output"]
            named = output["sampling"] and output["energy_interval"] and new > old
        except (LookupError, TypeError):  # no manifest of ours, or a key that is not named
            return ()
        return ("scene.simulation.duration",) if named else ()


@dataclass(frozen=True)
class Plan:
    """When what is written, in time steps; all are multiples of ``sampling``.

    They depend on the scene alone, so that an interrupted run writes what a whole one does.
    """

    step: float  # [s]
    total: int
    sampling: int
    chunk: int
    """Steps that are computed at one go; fixed, as sums over them round differently otherwise."""
    energy: int
    fields: int
    every_field: bool  # whether fields are written on the way, or only at the end

    def find_next_stop(self, done: int) -> int:
        """Steps at which the computation comes back next."""
        strides = [self.chunk, self.energy, *([self.fields] if self.every_field else [])]
        return min(self.total, *(done - done % stride + stride for stride in strides))

    def list_field_files(self, done: int) -> list[tuple[int, float, str]]:
        """Step, time [s] and name of all VTU files of a run that has done so many steps."""
        steps = list(range(0, done + 1, self.fields)) if self.every_field else []
        if done == self.total and self.total not in steps:
            steps.append(self.total)
        return [(n, n * self.step, f"fields_{i:06}.vtu") for i, n in enumerate(steps)]


def make_plan(prepared: Prepared, step: float) -> Plan:
    """When what is written; ``step`` is the time step [s]."""
    elements = sum(len(mesh.elements) for mesh in prepared.meshes.values())
    duration, output = prepared.scene.simulation.duration, prepared.scene.output
    assert duration is not None

    def round_steps(interval: float, unit: int) -> int:
        return unit * max(1, round(interval / (unit * step)))

    spacing = max(duration / PLAN.energy_rows, PLAN.energy_steps * step)
    sampling = round_steps(output.sampling or duration / PLAN.samples, 1)
    return Plan(
        step=step,
        total=sampling * max(1, ceil(duration / (sampling * step) - 1e-6)),
        sampling=sampling,
        chunk=sampling * max(1, PLAN.chunk_work // (elements * sampling)),
        energy=round_steps(output.energy_interval or spacing, sampling),
        fields=round_steps(output.vtu_interval or duration, sampling),
        every_field=output.vtu_interval is not None,
    )


@dataclass
class Done:
    """A run at its end."""

    run: Any  # `qdem_fem.Simulation`
    bodies: dict[str, Any]
    plan: Plan | None  # None for a static answer
    cost: dict[str, float]  # ``cpu_s`` and ``wall_s`` [s] of advancing, all sittings together
    static: dict[str, float] = field(default_factory=dict)
    """``residual`` and ``solver_bound`` of a static answer [-], ``steps`` it took."""
    discretisation: Any = None
    """`qdem_fem.bodies.Discretisation` of the answer, or where most elastic energy was."""


def run_dynamic(
    prepared: Prepared, run: Any, bodies: dict[str, Any], folder: RunFolder, *, resume: bool,
    progress: Any,
) -> Done:  # fmt: skip
    """Advance a scene to its duration, from its start or from the last checkpoint.

    ``run`` and ``bodies`` are those of `make_simulation`, ``progress`` is a
    `trackbed.run_files.Progress`.
    Every row and field is the same, bit by bit, however often the run was interrupted.  SIGINT
    and SIGTERM save the state and raise `Interrupted`.
    """
    checkpoint = folder.path / CHECKPOINT
    goes_on = resume and checkpoint.exists()
    if goes_on:
        run.restore(checkpoint)
    plan = make_plan(prepared, float(run.step))
    done = Done(run, bodies, plan, {"cpu_s": 0.0, "wall_s": 0.0})
    record = _Record(prepared, done, folder.path)
    if goes_on:
        cost = read_object(folder.path / COST) or {}  # none: killed before it was written
        record.resume(cost.pop(SEALS, {}))
        done.cost |= cost
    else:
        record.begin()
    saved = time.monotonic()
    with note_signals() as stop:
        while run.steps_done < plan.total:
            record.advance(plan.find_next_stop(run.steps_done) - run.steps_done)
            text = f"t = {run.time:.4g} s, step {run.steps_done} of {plan.total}"
            progress.report(run.steps_done, plan.total, text)
            late = time.monotonic() - saved >= prepared.scene.output.checkpoint_interval
            if stop.name or late or run.steps_done == plan.total:
                record.save(checkpoint)
                saved = time.monotonic()
            if stop.name and run.steps_done < plan.total:
                raise Interrupted(
                    f"stopped by {stop.name} at t = {run.time:.6g} s; the state is saved in "
                    f"{checkpoint}\n  -> the same command with --resume goes on from there"
                )
    done.discretisation = run.estimate_errors(record.peak)
    warn_of_strain(run, record.peak)
    return done


def run_static(prepared: Prepared, run: Any, bodies: dict[str, Any], folder: RunFolder) -> Done:
    """Find the static answer of a scene by conjugate gradients; it leaves nothing to resume from.

    Raises `NotConverged` when the tolerance is not reached.
    """
    started, cpu = time.perf_counter(), time.process_time()
    try:
        answer = run.relax(tolerance=prepared.scene.simulation.tolerance)
    except NotConverged as error:
        remedy = next(text for end, text in NO_REST.items() if end in error.what)
        raise NotConverged(error.what, where="simulation", remedy=remedy) from error
    cost = {"cpu_s": time.process_time() - cpu, "wall_s": time.perf_counter() - started}
    names = ("residual", "solver_bound", "steps")
    facts = {name: float(getattr(answer, name)) for name in names}
    done = Done(run, bodies, None, cost, facts, answer.discretisation)
    record = _Record(prepared, done, folder.path)
    record.begin()
    warn_of_strain(run, record.peak)
    return done


class _Record:
    """What a run writes on its way; of a static answer only what it came to."""

    def __init__(self, prepared: Prepared, done: Done, path: Path) -> None:
        self.done, self.run, self.path = done, done.run, path
        self.probes = {
            name: (done.bodies[on], nodes) for name, (on, nodes) in prepared.probes.items()
        }
        self.plan = done.plan or Plan(0.0, 0, 1, 1, 1, 1, every_field=False)
        self.audit, self.account = prepared.scene.audit, EnergyAccount()
        names = [f"{name}_{axis}" for name in self.probes for axis in "xyz"]
        self.rows = Table(path / "probes.csv", ["time", *names])
        self.energies = Table(path / "energy.csv", ["time", *list_energies(self.run)])
        self.peak, self.peak_energy = self.run.assembly.field("displacement"), -1.0
        """Displacement [m] where most elastic energy was [J]."""

    def begin(self) -> None:
        """First rows and fields, at t = 0."""
        self.rows.begin()
        self.energies.begin()
        means = [body.displacement[nodes].mean(axis=0) for body, nodes in self.probes.values()]
        self.rows.append(np.concatenate([[0.0], *means])[None])
        self.write_energy(0.0)
        self.write_fields()

    def resume(self, seals: dict[str, tuple[int, str]]) -> None:
        """Take back what was written behind the checkpoint; ``seals`` of the tables by name."""
        now = (self.run.steps_done + 0.5) * self.plan.step
        done, plan = self.run.steps_done, self.plan
        rows, energies = done // plan.sampling + 1, done // plan.energy + 1
        at_end = energies + (done % plan.energy > 0)  # one more where this run, or a shorter, ended
        for table, counts in ((self.rows, {rows}), (self.energies, {energies, at_end})):
            table.cut(now, counts, *([seals[table.path.name]] if table.path.name in seals else []))
        self.account.add_rows(read_table(self.energies.path))
        if (self.path / PEAK).exists():  # an earlier version wrote none
            self.peak, self.peak_energy = read_peak(self.path / PEAK, self.peak.shape)
        kept = {name for _, _, name in self.plan.list_field_files(self.run.steps_done)}
        for path in self.path.glob("fields_*.vtu"):
            if path.name not in kept:
                path.unlink()

    def advance(self, steps: int) -> None:
        """Advance and write the rows, energies and fields that fall due."""
        run, plan = self.run, self.plan
        start = run.steps_done
        started, cpu = time.perf_counter(), time.process_time()
        history = run.advance(steps * plan.step, self.probes, plan.sampling * plan.step)
        self.done.cost["wall_s"] += time.perf_counter() - started
        self.done.cost["cpu_s"] += time.process_time() - cpu
        new = history.time > (start + 0.5) * plan.step
        number = np.rint(history.time[new] / plan.step)
        columns = [history[name][new] for name in self.probes]
        self.rows.append(np.column_stack([number * plan.step, *columns]))
        if run.steps_done % plan.energy == 0 or run.steps_done == plan.total:
            self.write_energy(run.steps_done * plan.step)
            self.check_audit()
        self.write_fields()

    def write_energy(self, when: float) -> None:
        """A row of energies at a time [s], into its file and the account."""
        energy, names = self.run.energy(), list_energies(self.run)
        row = np.array([[when, *(float(getattr(energy, name)) for name in names)]])
        self.energies.append(row)
        if energy.elastic > self.peak_energy:
            self.peak_energy, self.peak = energy.elastic, self.run.assembly.field("displacement")
        self.account.add_rows(dict(zip(names, row[:, 1:].T, strict=True)))

    def check_audit(self) -> None:
        """Raise `EnergyLost` where the account of energies so far does not close."""
        missing = self.account.relative
        if self.audit is not None and missing > self.audit:
            overlap = self.account.first.get("contact", 0.0)
            cause = "take a shorter step (simulation.safety), look in energy.csv what grows, "
            if overlap > self.account.missing:
                cause = (
                    f"bodies begin in each other, with {overlap:.3g} J in the contacts: begin with "
                    "bodies that do not overlap, "
                )
            raise EnergyLost(
                f"{missing:.2e} of the greatest energy is missing in the account; "
                f"{self.audit:.2g} is allowed",
                where=f"t = {self.run.time:.6g} s, step {self.run.steps_done}",
                remedy=f"{cause}or allow more (output.audit)",
            )

    def write_fields(self) -> None:
        """Write the VTU file that is due now, and the list of all."""
        files = self.plan.list_field_files(self.run.steps_done)
        if files and files[-1][0] == self.run.steps_done:
            write_bodies_vtu(self.path / files[-1][2], list(self.done.bodies.values()))
            write_pvd(self.path / "fields.pvd", [(when, name) for _, when, name in files])

    def save(self, checkpoint: Path) -> None:
        """Save the state; the tables reach the disk first, so that they hold all rows up to it."""
        seals = {table.path.name: table.seal() for table in (self.rows, self.energies)}
        peak = io.BytesIO()  # before the checkpoint: what is ahead of it, the run finds again
        np.savez(peak, displacement=self.peak, energy=self.peak_energy)
        write_whole(self.path / PEAK, peak.getvalue())
        self.run.save(checkpoint)
        write_whole(self.path / COST, json.dumps(self.done.cost | {SEALS: seals}) + "\n")


def read_peak(path: Path, shape: tuple[int, ...]) -> tuple[Floats, float]:
    """Displacement (n, 3) [m], as ``shape`` says, where most elastic energy was, and that [J].

    Raises `CheckpointError` for a damaged file.
    """
    try:
        kept = read_arrays(path)
        return kept["displacement"].reshape(shape), float(kept["energy"])
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise CheckpointError(
            f"this is no record of the greatest strain ({error})", where=str(path),
            remedy="remove it, which leaves out what came before, or compute again with --force",
        ) from error  # fmt: skip


def list_energies(run: Any) -> tuple[str, ...]:
    """Columns of energy.csv beside the time; of what the scene has and counts."""
    touching = () if run.contact is None else CONTACT_ENERGIES
    return ENERGIES + touching + VISCOUS_ENERGY * run.viscous
