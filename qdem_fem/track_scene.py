"""Scenes with a table ``[track]``: ballast and a slice of a sleeper in place of ``[[body]]``.

``scenes/track-small.toml`` explains every key.  `track_load` checks such a scene; `track_enter`
prepares the bed, or takes it from its file, and gives the simulation that begins there.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from qdem_fem.contact_scene import ContactTable, PeriodicTable
from qdem_fem.kinetic_damping import Rest
from qdem_fem.load_train import Track, Train
from qdem_fem.material import Material
from qdem_fem.mesh_checks import FloatArray, IntArray
from qdem_fem.scene import BodyTable, MaterialTable, Scene, SeriesTable
from qdem_fem.scene_checks import Prepared, Step, output_faults
from qdem_fem.scene_file import Problem, SceneText
from qdem_fem.scene_series import TimeSeries, WrongSeries, series_of
from qdem_fem.scene_types import Cells, NonNegative, Positive, Share, Table, Text
from qdem_fem.sleeper_mesh import SleeperShape
from qdem_fem.track_bed import (
    SLEEPER,
    Bed,
    BedRecipe,
    bed_enter,
    bed_prepare,
    bodies_of_bed,
    grains_of,
    sleeper_guide,
)
from qdem_fem.track_bodies import TrackBox
from qdem_fem.track_load import bogie_series, down

BELOW = 0.1
"""Depth below the sleeper of the grains that are watched [m], as the paper's accelerometers; in a
bed less than twice as deep its half."""
POINTS = {"B1": 0.2, "B2": 0.5, "B3": 0.8}
"""Where along a slice grains are watched, over its length: towards the sleeper's end, below the
rail, towards the sleeper's centre."""


class BogieTable(Table):
    """The first bogie of a train (`qdem_fem.load_train`)."""

    axle_load: Positive = 100e3
    """Of both wheels [N]."""
    speed: Positive = 32.0
    """[m/s]"""
    lead: Positive = 3.0
    """From the front axle to the sleeper at first, from it to the rear axle at last [m]."""
    rest: NonNegative = 0.05
    """Time without load at the end [s]."""


class TrackTable(Table):
    """Grains, a slice of a sleeper on them, and a load on its rail seat."""

    length: Positive
    """Of the slice, along the sleeper [m]."""
    width: Positive
    """Along the track, from one middle between sleepers to the next [m]."""
    below: Annotated[int, Field(ge=1, le=100_000)]
    """Grains below the sleeper."""
    beside: Annotated[int, Field(ge=1, le=100_000)]
    """Grains that fill the cribs."""
    seed: Annotated[int, Field(ge=0)] = 1
    sizes: Annotated[tuple[Positive, Positive], Field(strict=False)] = (0.026, 0.034)
    """Least and greatest sieve size of the grains' meshes [m]; spheres make them larger."""
    cells: Cells
    """Of the sleeper's mesh, along, across and up."""
    share: Positive
    """Part of the force on a rail seat that the slice takes [-]."""
    ballast: MaterialTable
    sleeper: MaterialTable
    side_friction: NonNegative = 0.0
    """Of the walls at the sides; without it they are planes of symmetry."""
    bed: Text
    """File of the prepared bed, made where it is not there; relative to the scene file."""
    prepared_friction: NonNegative | None = None
    """Friction that the bed is prepared with; by default that of the contact."""
    softness: Share = 1e-4
    """Of the springs while grains fall, over those of the run."""
    unbalanced: Share = 0.05
    kinetic: Share = 0.01
    loose: Share = 0.02
    """Greatest shares of `qdem_fem.kinetic_damping.Rest` that are equilibrium."""
    patience: Positive = 5.0
    """Simulated time after which a stage of the preparation is given up [s]."""
    pressure: SeriesTable | None = None
    """Pressure on the rail seat [Pa], as the paper's record; or a bogie."""
    seat_area: Positive = 0.13 * 0.17
    """Of the pressure [m^2]."""
    bogie: BogieTable | None = None


class TrackScene(Scene):
    """A scene whose bodies are made by ``[track]``."""

    body: Annotated[tuple[BodyTable, ...], Field(strict=False)] = ()
    track: TrackTable

    def left_out(self) -> list[str]:
        """Physics that is not in this run."""
        track = self.track
        viscous = any(m.shear_viscosity or m.bulk_viscosity for m in (track.ballast, track.sleeper))
        told = ["viscosity: the materials are elastic"] * (not viscous)
        missing = [text for text in super().left_out() if not text.startswith(("viscosity", "any"))]
        return told + missing + ["rail, pads and all other sleepers: a force acts on the rail seat"]


@dataclass(frozen=True)
class TrackPrepared(Prepared):
    """A checked scene of a track."""

    recipe: BedRecipe
    bed_file: Path
    load: TimeSeries
    """On the rail seat [N], (k, 3)."""


def track_load(text: SceneText) -> TrackPrepared:
    """Check a scene with ``[track]``; raises `SceneError` with all that is wrong."""
    problems = list(text.problems) + list(_faults(text))
    load = None
    track = text.tables.get("track")
    if isinstance(track, TrackTable):
        try:
            load = load_of(track, text.path.parent)
        except WrongSeries as wrong:
            problems.append(wrong.problem)
    text.refuse(problems + list(output_faults(text)))
    scene = TrackScene.model_validate(text.data)
    assert load is not None
    track = scene.track
    bed_file = text.path.parent / track.bed
    steps = [Step("track", "load", SLEEPER, (np.zeros(0, np.int64), load))]
    return TrackPrepared(
        scene, text, {}, steps, {}, {}, recipe=recipe_of(scene), bed_file=bed_file, load=load
    )


def _faults(text: SceneText) -> Iterator[Problem]:
    """What tables of a track demand of one another."""
    track, contact = text.tables.get("track"), text.tables.get("contact")
    simulation = text.tables.get("simulation")
    for name in ("body", "fix", "prescribe", "roller", "load", "pressure", "periodic"):
        if name in text.data:
            yield Problem(name, "[track] makes the bodies and their conditions")
    if isinstance(track, TrackTable) and (track.pressure is None) == (track.bogie is None):
        yield Problem("track", "give one of pressure, bogie")
    if isinstance(track, TrackTable) and not track.sizes[0] < track.sizes[1]:
        yield Problem("track.sizes", "the second must be the greater one")
    if contact is None and "contact" not in text.data:
        yield Problem("contact", "missing: a track needs it")
    if isinstance(contact, ContactTable):
        names = ("ballast", SLEEPER)
        stiffness = contact.normal_stiffness
        if contact.model != "spheres" or contact.radius is None or contact.plane:
            yield Problem("contact.model", "a track has spheres of one radius, and its own planes")
        if not isinstance(contact.radius, float | None):
            yield Problem("contact.radius", "one number for all bodies of a track")
        if contact.periodic is not None and not _fits(contact.periodic, track):
            yield Problem("contact.periodic", "a track repeats along y by its width")
        if not isinstance(stiffness, dict) or sorted(stiffness) != sorted(names):
            yield Problem("contact.normal_stiffness", "give {ballast = ..., sleeper = ...}")
    if simulation is not None and (simulation.gravity is None or simulation.method == "static"):
        yield Problem("simulation.gravity", "a track is dynamic and needs gravity")
    output = text.tables.get("output")
    if output is not None and output.probes:
        yield Problem("output.probes", "a track names its own points: B1 to B3, S1 to S3, sleeper")


def _fits(periodic: PeriodicTable, track: object) -> bool:
    return periodic.axis == "y" and periodic.width == getattr(track, "width", periodic.width)


def load_of(track: TrackTable, folder: Path) -> TimeSeries:
    """Force on the rail seat of the slice over time [N], (k, 3)."""
    if track.bogie is not None:
        one = track.bogie
        train = Train(cars=1, axle_load=one.axle_load, speed=one.speed)
        return bogie_series(train, Track(), track.share, one.lead, one.rest)
    assert track.pressure is not None
    found = series_of(track.pressure, "track.pressure", folder, vector=False)
    return TimeSeries(found.times, down(track.share * track.seat_area * found.values))


def recipe_of(scene: TrackScene) -> BedRecipe:
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
    )  # fmt: skip


def track_enter(prepared: TrackPrepared) -> tuple[Any, dict[str, Any]]:
    """The simulation of a track in its prepared state, and its bodies by name.

    Fills the meshes, the probes and the load's nodes of ``prepared``.
    """
    from dataclasses import replace

    from qdem_fem.series import Series
    from qdem_fem.simulation import Simulation

    scene, recipe = prepared.scene, prepared.recipe
    table = scene.simulation
    bed = bed_prepare(recipe, prepared.bed_file, table.threads, _Told())
    bodies = bodies_of_bed(recipe, grains_of(recipe), bed.nodes, rigid=False)
    assert scene.contact is not None
    contact = replace(recipe.contact(list(bodies)), friction=scene.contact.friction)
    if scene.contact.contacts is not None:
        contact = replace(contact, contacts=scene.contact.contacts)
    run = Simulation(
        list(bodies.values()), strain=table.strain, step=table.step, safety=table.safety,
        gravity=table.gravity, threads=table.threads, mass_scaling=table.mass_scaling,
        contact=contact,
    )  # fmt: skip
    sleeper = bodies[SLEEPER]
    sleeper_guide(run, sleeper, upright=False)
    seat = sleeper.mesh.node_sets["seat"]
    run.load(sleeper, seat, Series(prepared.load.times, prepared.load.values))
    bed_enter(run, bed)
    prepared.meshes.update({name: body.mesh for name, body in bodies.items()})
    prepared.probes.update(points_of(recipe, bed, bodies))
    return run, bodies


def points_of(
    recipe: BedRecipe, bed: Bed, bodies: dict[str, Any]
) -> dict[str, tuple[str, IntArray]]:
    """Bodies and nodes that are watched: grains at B1 to B3, S1 to S3 on the sleeper, all of it.

    A grain is the one whose centre is nearest to `BELOW` the sleeper's bottom, in the plane of its
    middle, at `POINTS`; ``B2a`` is the nearest to B2's, as in the paper.
    """
    positions = bed.positions
    centres = np.array([x.mean(axis=0) for x in positions[: recipe.below]])
    bottom = float(positions[-1][:, 2].min())
    found: dict[str, tuple[str, IntArray]] = {}

    def watch(name: str, place: FloatArray, but: str = "") -> None:
        order = np.argsort(np.linalg.norm(centres - place, axis=1))
        body = next(f"grain-{i}" for i in order if f"grain-{i}" != but)
        found[name] = (body, np.arange(len(bodies[body].nodes)))

    for name, share in POINTS.items():
        place = [share * recipe.box.length, recipe.box.width / 2, max(bottom - BELOW, bottom / 2)]
        watch(name, np.array(place))
    second = found["B2"][0]
    watch("B2a", centres[int(second.removeprefix("grain-"))], second)
    sleeper = bodies[SLEEPER]
    for name in ("S1", "S2", "S3"):
        found[name] = (SLEEPER, sleeper.mesh.node_sets[name])
    found["sleeper"] = (SLEEPER, np.arange(len(sleeper.nodes)))
    return found


class _Told:
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
