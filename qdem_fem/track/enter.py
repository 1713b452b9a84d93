"""Scenes with a table ``[track]``: ballast and a sleeper, or part of it, in place of ``[[body]]``.

``track-small.toml`` explains every key.  `check_track` checks such a scene; `enter_track`
prepares the bed, or takes it from its file, and gives the simulation that begins there.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from qdem_fem import tables
from qdem_fem.contact.spheres import SphereContact
from qdem_fem.element import Material
from qdem_fem.files import ConditionError, Floats, Integers, Series
from qdem_fem.march import Rest
from qdem_fem.track.bed import Bed, list_stages_ahead, prepare_bed, read_bed
from qdem_fem.track.bodies import TrackBox
from qdem_fem.track.recipe import SLEEPER, BedRecipe, name_bodies
from qdem_fem.track.sleeper_mesh import SleeperShape
from qdem_fem.track.table import TrackTable, find_track_faults, make_seat_loads
from trackbed.scene_files import Problem, SceneText, describe_error

BELOW = 0.1
"""Depth below the sleeper of the grains that are watched [m], as the paper's accelerometers; in a
bed less than twice as deep its half."""


class TrackScene(tables.Scene):
    """A scene whose bodies are made by ``[track]``."""

    body: Annotated[tuple[tables.BodyTable, ...], Field(strict=False)] = ()
    track: TrackTable

    def list_left_out(self) -> list[str]:
        """Physics that is not in this run."""
        track = self.track
        viscous = any(m.shear_viscosity or m.bulk_viscosity for m in (track.ballast, track.sleeper))
        elastic = ["viscosity: the materials are elastic"] * (not viscous)
        missing = [
            text for text in super().list_left_out() if not text.startswith(("viscosity", "any"))
        ]
        missing += ["deformation of grains, said to be rigid"] * bool(track.rigid)
        missing += ["rail, pads, other sleepers: a force acts on a rail seat held along the track"]
        duration = self.simulation.duration or 0.0
        if track.bogie is not None and track.bogie.passing > duration:
            passing = f"it takes {track.bogie.passing:.4g} s, this run {duration:.4g} s"
            missing.append(f"the end of the bogie's passing: {passing}")
        return elastic + missing


@dataclass(frozen=True)
class TrackPrepared(tables.Prepared):
    """A checked scene of a track."""

    recipe: BedRecipe
    bed_file: Path
    loads: tuple[Series, ...]  # on each rail seat [N], (k, 3)
    trial: dict[str, Any] = field(default_factory=dict)
    """`qdem_fem.track.bearing.Pulse` that the bed bears, the ``pulses`` that ran it in, and its
    ``words``; filled by `enter_track`."""

    @property
    def load(self) -> Series:
        """On the first rail seat."""
        return self.loads[0]

    @property
    def greatest(self) -> float:
        """Greatest force down on a rail seat [N]."""
        return max(0.0, *(float(-load.values[:, 2].min()) for load in self.loads))


def check_track(text: SceneText) -> TrackPrepared:
    """Check a scene with ``[track]``; raises `SceneError` with all that is wrong."""
    problems = list(text.problems) + list(_find_faults(text))
    loads: tuple[Series, ...] = ()
    track = text.tables.get("track")
    if isinstance(track, TrackTable):
        try:
            loads = make_seat_loads(track, text.path.parent)
        except tables.WrongKey as wrong:
            problems.append(wrong.problem)
        except ConditionError as error:
            problems.append(Problem("track.bogie", describe_error(error)))
        bed = (text.path.parent / track.bed).parent
        if not bed.is_dir():  # or minutes of preparation would find no place
            problems.append(Problem("track.bed", f"there is no folder {bed}"))
        inside = bed.resolve().is_relative_to(text.path.parent.resolve())
        if not inside and "track.bed" not in text.overrides:
            what = (
                f"a scene writes into its own folder, not {bed}: to have it so, use --set track.bed"
            )
            problems.append(Problem("track.bed", what))
    text.refuse(problems + list(tables.find_output_faults(text)))
    scene = TrackScene.model_validate(text.data)
    track = scene.track
    bed_file = text.path.parent / track.bed
    steps = [tables.Step("track", "load", SLEEPER, (np.zeros(0, np.int64), load)) for load in loads]
    return TrackPrepared(
        scene, text, {}, steps, {}, dict(tables.list_named_files(text, text.path.parent)),
        recipe=make_bed_recipe(scene), bed_file=bed_file, loads=loads,
    )  # fmt: skip


def _find_faults(text: SceneText) -> Iterator[Problem]:
    """What tables of a track demand of one another."""
    track, contact = text.tables.get("track"), text.tables.get("contact")
    simulation = text.tables.get("simulation")
    for name in ("body", "fix", "prescribe", "roller", "load", "pressure", "periodic"):
        if name in text.data:
            yield Problem(name, "[track] makes the bodies and their conditions")
    if isinstance(track, TrackTable):
        yield from find_track_faults(track)
    if contact is None and "contact" not in text.data:
        yield Problem("contact", "missing: a track needs it")
    if isinstance(contact, tables.ContactTable):
        names = ("ballast", SLEEPER)
        for fault in tables.find_contact_faults(contact, simulation, names):
            yield Problem(*fault)
        stiffness = contact.normal_stiffness
        if contact.model != "spheres" or contact.radius is None or contact.plane:
            yield Problem("contact.model", "a track has spheres of one radius, and its own planes")
        if not isinstance(contact.radius, float | None):
            yield Problem("contact.radius", "one number for all bodies of a track")
        if isinstance(track, TrackTable) and isinstance(contact.radius, float):
            needed = SleeperShape().width + 2 * contact.radius
            if track.width <= needed:
                what = f"the sleeper with its spheres is {needed:.4g} m wide, and grains lie beside"
                yield Problem("track.width", what)
            if track.sizes[0] < contact.radius:
                what = f"{track.sizes[0]:.4g} m is smaller than the radius of a grain's spheres"
                yield Problem("track.sizes", what)
        if (side := contact.periodic) is not None and (
            side.axis != "y" or side.width != getattr(track, "width", side.width)
        ):
            yield Problem("contact.periodic", "a track repeats along y by its width")
        if not isinstance(stiffness, dict) or sorted(stiffness) != sorted(names):
            yield Problem("contact.normal_stiffness", "give {ballast = ..., sleeper = ...}")
    if simulation is not None and (simulation.gravity is None or simulation.method == "static"):
        yield Problem("simulation.gravity", "a track is dynamic and needs gravity")
    elif simulation is not None and not simulation.gravity[2] < 0:
        yield Problem("simulation.gravity", "must point down, along -z, or no grain comes to rest")
    on_card = simulation is not None and simulation.device != "cpu"
    if isinstance(track, TrackTable) and track.rigid and on_card:
        yield Problem("track.rigid", "rigid grains are computed on the processor")
    output = text.tables.get("output")
    if output is not None and output.probes:
        yield Problem("output.probes", "a track names its own points: B1 to B3, S1 to S3, sleeper")


def make_bed_recipe(scene: TrackScene) -> BedRecipe:
    """How the bed of a scene is prepared."""
    track, contact = scene.track, scene.contact
    assert contact is not None
    assert scene.simulation.gravity is not None
    stiffness = contact.normal_stiffness
    assert isinstance(stiffness, dict)
    assert isinstance(contact.radius, float)
    friction = contact.friction if track.prepared_friction is None else track.prepared_friction
    return BedRecipe(
        box=TrackBox(track.length, track.width), below=track.below, beside=track.beside,
        seed=track.seed, sizes=track.sizes, shape=SleeperShape(), cells=track.cells,
        ballast=Material(**track.ballast.model_dump()),
        sleeper=Material(**track.sleeper.model_dump()), radius=contact.radius,
        stiffness=(stiffness["ballast"], stiffness[SLEEPER]), friction=friction,
        side_friction=track.side_friction, gravity=scene.simulation.gravity,
        softness=track.softness, unbalanced=track.unbalanced, kinetic=track.kinetic,
        loose=track.loose, patience=track.patience, periodic=contact.periodic is not None,
        part=track.part, shoulder=track.shoulder,
    )  # fmt: skip


def choose_contact(prepared: TrackPrepared) -> SphereContact:
    """Contact of the run: that of the bed, with the scene's own friction, skin and step."""
    table, recipe = prepared.scene.contact, prepared.recipe
    assert table is not None
    every = recipe.contact(name_bodies(recipe.below + recipe.beside, sleeper=True))
    contacts = every.contacts if table.contacts is None else table.contacts
    return replace(every, friction=table.friction, skin=table.skin, contacts=contacts)


def preview_bed(prepared: TrackPrepared) -> dict[str, Any]:
    """What a run has to do before its bed stands; empty where that is in its file."""
    from qdem_fem.track.bearing import name_trial

    recipe, path, scene = prepared.recipe, prepared.bed_file, prepared.scene
    assert isinstance(scene, TrackScene)
    ahead = list(list_stages_ahead(recipe, path))
    trial = name_trial(choose_contact(prepared), prepared.greatest, scene.track.rigid)
    if not ahead and trial in read_bed(path, recipe).trials:
        return {}
    ahead.append("slow pulses")
    stages = f"stages {ahead[0]} to {ahead[-2]}, then slow pulses" if ahead[:-1] else "slow pulses"
    words = (
        f"{recipe.below + recipe.beside} grains, to be prepared first ({stages}), half a second to "
        f"two of processor time a grain, and as much for each pulse; kept in {path}"
    )
    return {"grains": recipe.below + recipe.beside, "stages_ahead": ahead, "words": words}


def enter_track(prepared: TrackPrepared) -> tuple[Any, dict[str, Any]]:
    """The simulation of a track in its prepared state, and its bodies by name.

    Fills the meshes, the probes and the trial of ``prepared``.  Raises `NotConverged` for a bed
    that finds no equilibrium or does not bear its sleeper.
    """
    from qdem_fem.track.bearing import begin_bed, list_seats, run_in

    scene, recipe = prepared.scene, prepared.recipe
    assert isinstance(scene, TrackScene)
    table, track = scene.simulation, scene.track
    path, contact, force = prepared.bed_file, choose_contact(prepared), prepared.greatest
    bed = prepare_bed(recipe, path, table.threads, _Report())
    bed, trial = run_in(
        recipe, bed, path, contact, force, track.stays, table.threads, track.rigid
    )  # fmt: skip
    run, bodies = begin_bed(
        recipe, bed, contact, track.rigid, strain=table.strain, step=table.step,
        safety=table.safety, threads=table.threads, mass_scaling=table.mass_scaling,
        device=table.device,
    )  # fmt: skip
    sleeper = bodies[SLEEPER]
    for seat, load in zip(list_seats(sleeper), prepared.loads, strict=True):
        run.load(sleeper, seat, load)
    words = f"slow pulses that ran it in: {len(bed.pulses)}; {trial.describe()}"
    prepared.trial.update(asdict(trial), pulses=bed.pulses, words=words)
    prepared.meshes.update({name: body.mesh for name, body in bodies.items()})
    prepared.probes.update(find_watched_points(recipe, bed, bodies))
    return run, bodies


def find_watched_points(
    recipe: BedRecipe, bed: Bed, bodies: dict[str, Any]
) -> dict[str, tuple[str, Integers]]:
    """Bodies and nodes that are watched: grains at B1 to B3, S1 to S3 on the sleeper, all of it.

    A grain is the one whose centre is nearest to `BELOW` the sleeper's bottom, in the plane of its
    middle, at `TrackLayout.list_watched`; ``B2a`` is the nearest to B2's, as in the paper.
    """
    positions = bed.positions
    centres = np.array([x.mean(axis=0) for x in positions[: recipe.below]])
    centres[:, 1] = recipe.layout.measure_across(centres)
    bottom = float(positions[-1][:, 2].min())
    found: dict[str, tuple[str, Integers]] = {}

    def watch(name: str, place: Floats, but: str = "") -> None:
        order = np.argsort(np.linalg.norm(centres - place, axis=1))
        body = next(f"grain-{i}" for i in order if f"grain-{i}" != but)
        found[name] = (body, np.arange(len(bodies[body].nodes)))

    for name, x in recipe.layout.list_watched().items():
        watch(name, np.array([x, 0.0, max(bottom - BELOW, bottom / 2)]))
    second = found["B2"][0]
    watch("B2a", centres[int(second.removeprefix("grain-"))], second)
    sleeper = bodies[SLEEPER]
    for name in ("S1", "S2", "S3"):
        found[name] = (SLEEPER, sleeper.mesh.node_sets[name])
    found["sleeper"] = (SLEEPER, np.arange(len(sleeper.nodes)))
    return found


class _Report:
    """How far a preparation is, on standard error, every 10 s."""

    def __init__(self) -> None:
        self.at = time.monotonic()

    def __call__(self, stage: str, rest: Rest) -> None:
        if time.monotonic() - self.at >= 10:
            self.at = time.monotonic()
            print(
                f"bed, stage {stage}: t = {rest.time:.4g} s, unbalanced {rest.unbalanced:.3g}, "
                f"kinetic {rest.kinetic:.3g}, loose {rest.loose:.3g}",
                file=sys.stderr, flush=True,
            )  # fmt: skip
