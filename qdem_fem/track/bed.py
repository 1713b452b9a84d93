"""The prepared bed: grains fall, the sleeper is laid on them, cribs are filled, all comes to rest.

Section 4 of the paper embeds the sleeper in the ballast and lets both settle by free fall.  Here
that is done in `STAGES`, each ended by kinetic damping (`qdem_fem.march.kinetic_damping`):

* ``bed``: the grains below the sleeper fall, rigid and on springs softer by ``softness``, whose
  steps are longer by its root;
* ``crib``: the sleeper is laid on the highest grain below it and goes down upright, grains fall
  beside it, alike;
* ``firm 7/8`` to ``firm 1/8``: the same with springs softer by these powers of ``softness``, each
  in its turn.  Stiffer springs push apart what softer ones let overlap, and a heap that is damped
  body by body moves slowly: where every step is small, all of them are short;
* ``hard``: with the springs asked for;
* ``rest``: deformable bodies on the springs asked for, as the run has them.

Grains fall with a horizontal velocity each, and are stopped only behind they have landed (`FALLS`).
Bodies are stopped one by one, but in the last two stages of a bed that no wall holds along y all
together: it slides as a whole, and hard contacts rattle so fast that each body has a peak every
160 steps, 0.1 ms.  Stopped at each, the heap sinks by g times 0.1 ms/2, half a
millimetre a second, for ever.

Only the last stage says what the state is worth; the others say where grains begin.  What each
leaves is a file, from which the next goes on, and any number of runs: other loads, other
frictions.  `qdem_fem.track.bearing` runs the bed in and tries what it bears.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.bodies import Body
from qdem_fem.files import CheckpointError, Floats, NotConverged
from qdem_fem.grains import GrainSet
from qdem_fem.march import Damping, Rest, find_rest, read_checkpoint, write_checkpoint
from qdem_fem.track.bodies import GAP, place_grains
from qdem_fem.track.recipe import SLEEPER, BedRecipe, make_bed_bodies, make_bed_grains
from trackbed.errors import OutOfMemory
from trackbed.memory import read_arrays
from trackbed.run_files import write_whole

if TYPE_CHECKING:
    from qdem_fem.march import Simulation


FIRM = {f"firm {k}/8": k / 8 for k in range(7, 0, -1)}  # powers of ``softness`` of their springs
STAGES = ("bed", "crib", *FIRM, "hard", "rest")
FALLS = ("bed", "crib")  # stages in which grains fall


@dataclass(frozen=True)
class BedNumbers:
    """Preparation of a bed; three numbers are unbalanced, kinetic and loose share of `Rest` [-]."""

    scatter: float = 0.3
    """Horizontal speed at which grains begin to fall, root mean square [m/s].  Grains that fall
    plumb onto each other and are stopped there stand as towers; poured ones do not."""
    saving_interval: float = 300.0  # of a stage [s]
    falling: tuple[float, float, float] = (0.1, 1e-3, 0.02)  # end stages in which grains fall,
    firming: tuple[float, float, float] = (0.1, 0.1, 0.02)
    """And those of stiffer springs: a few grains always roll there, with most of the energy."""


BED = BedNumbers()


@dataclass(frozen=True, eq=False)
class Bed:
    """A prepared bed, or what a stage on the way to it left."""

    stage: str
    nodes: list[Floats]
    """Reference positions of each body's nodes [m]; grains below, beside, then the sleeper."""
    displacement: Floats  # of all nodes [m], (n, 3)
    contact: dict[str, NDArray[Any]]
    """Pairs and springs, as `Contacts.pack_state` gives them; empty before the last stage."""
    rests: dict[str, dict[str, float]]
    """`qdem_fem.march.kinetic_damping.Rest` of each stage done, and its ``cpu_s``."""
    pulses: list[dict[str, float]] = field(default_factory=list)
    """`qdem_fem.track.bearing.Pulse` of each that ran it in."""
    trials: dict[str, dict[str, float]] = field(default_factory=dict)
    """`qdem_fem.track.bearing.Pulse` by the friction and force of a run."""

    @property
    def positions(self) -> list[Floats]:
        """Where the nodes of each body are now [m]."""
        ends = np.cumsum([len(nodes) for nodes in self.nodes])[:-1]
        moved = np.split(self.displacement, ends)
        return [nodes + u for nodes, u in zip(self.nodes, moved, strict=True)]


def prepare_bed(
    recipe: BedRecipe, path: Path, threads: int | None = None,
    progress: Callable[[str, Rest], None] | None = None,
) -> Bed:  # fmt: skip
    """The bed in the file ``path``; made there, stage after stage, where it is not yet.

    A stage is saved now and then in a file beside it, and where it finds no equilibrium:
    a kill loses less, and more ``patience`` goes on from there.
    Raises `CheckpointError` for a file of another recipe, `NotConverged` where a stage finds no
    equilibrium, `MeshError` where grains have no room below or beside the sleeper.
    """
    bed = read_bed(path, recipe) if path.exists() else None
    grains = make_bed_grains(recipe)
    if bed is None:  # refused before grains fall for hours
        recipe.layout.place_beside(place_grains(grains)[recipe.below :], 0.0, recipe.seed + 1)
    for number, stage in enumerate(STAGES):
        if bed is not None and STAGES.index(bed.stage) >= number:
            continue
        bed = run_stage(recipe, grains, stage, bed, threads, progress, name_file(path, stage))
        write_bed(path, recipe, bed)
        name_file(path, stage).unlink(missing_ok=True)
    assert bed is not None
    return bed


def name_file(path: Path, stage: str) -> Path:
    """Where a stage of the bed in ``path`` is saved: a kill may leave that of one that is done."""
    return path.with_suffix(f".{stage.replace(' ', '-').replace('/', '-of-')}.part.npz")


def list_stages_ahead(recipe: BedRecipe, path: Path) -> tuple[str, ...]:
    """Stages of a preparation that the file ``path`` lacks; raises as `prepare_bed`."""
    done = STAGES.index(read_bed(path, recipe).stage) + 1 if path.exists() else 0
    return STAGES[done:]


def run_stage(
    recipe: BedRecipe, grains: GrainSet, stage: str, before: Bed | None,
    threads: int | None, progress: Callable[[str, Rest], None] | None, part: Path | None = None,
) -> Bed:  # fmt: skip
    """What a stage of `STAGES` leaves, from what the one before left, or from the file ``part``.

    Raises `NotConverged`, and `CheckpointError` where the file is of something else.
    """
    from qdem_fem.march import Simulation

    started = time.process_time()
    last = stage == STAGES[-1]
    nodes = place_start_nodes(recipe, grains, stage, before)
    rigid = recipe.rigid and not last
    bodies = make_bed_bodies(recipe, grains, nodes, rigid="lumped" if rigid else False)
    softness = recipe.softness ** {**FIRM, "hard": 0, "rest": 0}.get(stage, 1)
    contact = recipe.contact(list(bodies), softness)
    if rigid:
        contact = replace(contact, contacts=1)
    if stage in FALLS:
        falling = slice(recipe.below) if stage == "bed" else slice(recipe.below, len(grains))
        scatter(list(bodies.values())[falling], recipe.seed)
    run = Simulation([*bodies.values()], gravity=recipe.gravity, threads=threads, contact=contact)
    if SLEEPER in bodies:
        guide_sleeper(run, bodies[SLEEPER], upright=stage == "crib")
    shares = BED.firming if stage in FIRM else BED.falling
    if stage in ("hard", "rest"):
        shares = (recipe.unbalanced, recipe.kinetic, recipe.loose)
    report = None if progress is None else (lambda rest: progress(stage, rest))
    together = recipe.periodic and stage in ("hard", "rest")  # as said above: a heap slides
    sitting = Sitting(run, part, started)
    damping = sitting.resume()
    try:
        rest = find_rest(
            run, *shares, recipe.patience, report, each=not together, damping=damping,
            keep=sitting.save_if_due, fall=stage in FALLS,
        )  # fmt: skip
    except NotConverged as error:
        sitting.save()
        raise NotConverged(
            error.what, where=f"stage {stage} of the bed, {error.where}",
            remedy="with more track.patience it goes on from there; or ask for less",
        ) from error  # fmt: skip
    rests = {} if before is None else dict(before.rests)
    rests[stage] = {**asdict(rest), "step": run.step, "cpu_s": sitting.time_spent()}
    moved = run.assembly.field("displacement")
    assert run.contacts is not None
    springs = run.contacts.pack_state() if last else {}
    return Bed(stage, [body.nodes for body in run.bodies], moved, springs, rests)


class Sitting:
    """A stage that outlives its process: its state in the file ``part``, if any, now and then."""

    def __init__(self, run: Simulation, part: Path | None, started: float) -> None:
        self.run, self.part, self.started = run, part, started
        self.before, self.saved = 0.0, time.monotonic()
        self.damping: Damping | None = None

    def time_spent(self) -> float:
        """Processor time of the stage, all sittings together [s]."""
        return self.before + time.process_time() - self.started

    def resume(self) -> Damping | None:
        """Take the state in the file, where there is one; raises `CheckpointError`."""
        if self.part is None or not self.part.exists():
            return None
        try:
            arrays = read_checkpoint(self.run, self.part)
            self.before = float(arrays.pop("cpu_s"))
            return Damping.from_arrays(arrays)
        except (CheckpointError, KeyError) as error:
            what = error.what if isinstance(error, CheckpointError) else f"{error} is not in it"
            raise CheckpointError(
                f"a stage of the bed can not go on from it: {what}", where=str(self.part),
                remedy="remove it: the stage then begins again",
            ) from error  # fmt: skip

    def save_if_due(self, damping: Damping) -> None:
        """Save it, `BED.saving_interval` after the last time."""
        self.damping = damping
        if time.monotonic() - self.saved >= BED.saving_interval:
            self.save()

    def save(self) -> None:
        """Write the file."""
        if self.part is None or self.damping is None:
            return
        beside = {**self.damping.pack_state(), "cpu_s": np.array(self.time_spent())}
        write_checkpoint(self.run, self.part, beside)
        self.saved = time.monotonic()


def place_start_nodes(
    recipe: BedRecipe, grains: GrainSet, stage: str, before: Bed | None
) -> list[Floats]:
    """Where the bodies of a stage begin [m]."""
    layout, loose = recipe.layout, place_grains(grains)
    if before is None:
        return layout.place_grains_below(loose[: recipe.below], recipe.seed)
    if stage != "crib":
        return before.positions
    below, radius = before.positions, recipe.radius
    every = np.concatenate(below)
    bottom = float(every[layout.is_under(every), 2].max()) + 2 * radius + GAP
    top = float(every[:, 2].max()) + radius + GAP
    beside = layout.place_beside(loose[recipe.below :], top, recipe.seed + 1)
    return [*below, *beside, layout.sleeper(bottom).nodes]


def scatter(grains: Sequence[Body], seed: int) -> None:
    """Give each grain a horizontal velocity of its own, of root mean square `BED.scatter`."""
    random = np.random.default_rng([seed, len(grains)])
    for grain in grains:
        x, y = BED.scatter / np.sqrt(2) * random.normal(size=2)
        grain.velocity = np.tile([x, y, 0.0], (len(grain.nodes), 1))


def guide_sleeper(run: Simulation, sleeper: Body, *, upright: bool) -> None:
    """Hold a sleeper in its planes of symmetry, or, while it is laid, all but its way down."""
    if upright and sleeper.rigid:
        run.fix(sleeper, np.arange(len(sleeper.nodes)), "xy")
    elif "ends" in sleeper.mesh.node_sets:
        run.fix(sleeper, sleeper.mesh.node_sets["ends"], "x")


def enter_bed(run: Simulation, bed: Bed) -> None:
    """Put a simulation of a bed's bodies into the prepared state, springs included, at rest.

    Its friction, loads and conditions may be others than those it was prepared with: springs
    beyond Coulomb's limit slip in the first step.  Rigid bodies are to have the
    shape that their nodes have there.
    """
    at = 0
    for body, nodes in zip(run.bodies, bed.nodes, strict=True):
        moved = bed.displacement[at : at + len(nodes)]
        body.displacement = nodes + moved - body.nodes if body.rigid else moved
        at += len(nodes)
    if run.contacts is not None and bed.contact:
        run.contacts.restore({**bed.contact, "contact_slid": 0 * bed.contact["contact_slid"]})


def write_bed(path: Path, recipe: BedRecipe, bed: Bed) -> None:
    """Write a bed, atomically."""
    stream = BytesIO()
    state: dict[str, Any] = {"stage": bed.stage, "rests": bed.rests}
    state |= {"pulses": bed.pulses, "trials": bed.trials}
    head = {"recipe": recipe.format_json(), **state}
    np.savez_compressed(
        stream, head=json.dumps(head), nodes=np.concatenate(bed.nodes),
        counts=[len(nodes) for nodes in bed.nodes], displacement=bed.displacement,
        **bed.contact,  # type: ignore[arg-type]
    )  # fmt: skip
    write_whole(path, stream.getvalue())


def read_bed(path: Path, recipe: BedRecipe) -> Bed:
    """Read what `write_bed` wrote for this recipe; raises `CheckpointError` else."""
    remedy = "give another file, or remove it to prepare the bed again"
    try:
        arrays = read_arrays(path)
        head = json.loads(str(arrays.pop("head")))
        there, here = json.loads(head["recipe"]), json.loads(recipe.format_json())
        counts, nodes = arrays.pop("counts"), arrays.pop("nodes")
        displacement = arrays.pop("displacement")
        stage, rests = head["stage"], head["rests"]
        pulses, trials = head.get("pulses", []), head.get("trials", {})  # none in older files
        shapes = (nodes.shape, displacement.shape, counts.dtype.kind, stage in STAGES)
        if shapes != (*2 * ((int(counts.sum()), 3),), "i", True) or not np.isfinite(nodes).all():
            raise ValueError("its arrays do not belong together")
    except OutOfMemory:
        raise
    except Exception as error:  # numpy raises many kinds for a damaged file
        raise CheckpointError(f"no bed ({error})", where=str(path), remedy=remedy) from error
    if there != here:
        other = [name for name in here if there.get(name) != here[name]]
        raise CheckpointError(
            f"it holds a bed that was prepared otherwise: {', '.join(other)} differ",
            where=str(path), remedy=remedy,
        )  # fmt: skip
    parts = np.split(nodes, np.cumsum(counts)[:-1])
    return Bed(stage, parts, displacement, arrays, rests, pulses, trials)
