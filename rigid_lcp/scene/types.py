"""Tables of a rigid scene file, as pydantic checks them; SI units throughout."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, inf
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from rigid_lcp.contact import MOST_EDGES
from rigid_lcp.motion import BOUNDS, explain_step_limit
from rigid_lcp.scene.simulation import SIMULATION
from trackbed.choices import find_choices
from trackbed.scene_files import (
    GradingKey,
    LengthUnit,
    Name,
    NonNegative,
    Positive,
    Problem,
    Real,
    Table,
    Text,
    suggest_word,
)

Vector = Annotated[list[Real], Field(min_length=2, max_length=3)]
VECTORS = (
    "normal", "position", "velocity", "box", "region_low", "region_high", "force", "least",
)  # fmt: skip
"""Keys whose values have one number a dimension."""
Restitution = Annotated[Real, Field(ge=0, le=1)]
Sizes = Annotated[list[Positive], Field(min_length=2, max_length=2)]
Corners = Annotated[int, Field(le=1000)]
MOST_CORNERS = (MOST_EDGES + 4) // 3
"""Of a scanned stone: with n it has 3 n - 6 edges at most; a body may have `MOST_EDGES` - 2."""
LEAST_OF_A_STEP = 1e-6
"""Shortest time between two frames in steps."""
STEPS_OF_A_PERIOD = 10
"""Fewest in a period of a cyclic load [-].  Each takes the force at its middle: with n, the impulse
of a sine is too large by (pi/n) / sin(pi/n), 1.7 % at 10, 57 % at 2; below 2 another sine's."""


def check_shape(name: str) -> str:
    """The name of a grain shape, if there is one of it."""
    if name not in (known := find_choices("rigid_lcp.shapes", "SHAPE")):
        raise ValueError(f"there is no grain shape {name!r}{suggest_word(name, known)}")
    return name


class Surface(Table):
    """What bodies without values of their own get."""

    friction: NonNegative = 0.0  # Coulomb's coefficient [-]
    restitution: Restitution = 0.0  # Newton's coefficient [-]


class Run(Table):
    """How long, and how."""

    duration: Positive  # simulated time [s]
    step: Positive = 1e-3  # length of a step, the longest one at acceleration level [s]
    method: Literal["time-stepping", "acceleration"] = "time-stepping"  # second: few bodies
    tolerance: Annotated[Real, Field(ge=1e-14, le=1e-3)] = 1e-10
    """Scale-free residual of the contact forces [-]."""
    frames: Annotated[int, Field(ge=1, le=100_000)] = 20  # states that are kept, at equal times

    @model_validator(mode="after")
    def _check_steps(self) -> Run:
        steps = self.duration / self.step
        if not LEAST_OF_A_STEP * self.frames <= steps <= BOUNDS.steps:
            raise ValueError(
                f"{explain_step_limit('duration', steps)}, and the time between two frames must be"
                f" at least {LEAST_OF_A_STEP:g} of one"
            )
        return self


class Ground(Table):
    """A half-space: everything with ``normal . x <= offset``."""

    normal: Vector  # out of it, of any length [-]
    offset: Real = 0.0  # of its face from the origin along ``normal`` [m]
    friction: NonNegative | None = None  # by default that of ``surface`` [-]
    restitution: Restitution | None = None  # by default that of ``surface`` [-]


class BodyTable(Table):
    """One body; exactly one of the shapes."""

    name: Name  # by which loads name it
    box: Vector | None = None  # edge lengths [m]
    radius: Positive | None = None  # of a disc or a sphere [m]
    vertices: list[Vector] | None = None  # of a convex polygon (anticlockwise) or polyhedron [m]
    density: Positive | None = None  # [kg/m^3]; in 2D [kg/m^2], or per metre of depth
    inertia: Positive | None = None
    """Moment of inertia in place of the shape's own, in 2D [kg m^2]; a huge one holds the body
    upright."""
    fixed: bool = False  # never moves
    position: Vector | None = None  # of its centre of mass [m]
    angle: Real | Annotated[list[Real], Field(min_length=4, max_length=4)] | None = None
    """[rad]; in 3D a quaternion w, x, y, z."""
    velocity: Vector | None = None  # of its centre of mass at the start [m/s]
    spin: Real | Vector | None = None  # angular velocity at the start [rad/s]
    friction: NonNegative | None = None  # by default that of ``surface`` [-]
    restitution: Restitution | None = None  # by default that of ``surface`` [-]

    @model_validator(mode="after")
    def _check_body(self) -> BodyTable:
        given = [k for k in ("box", "radius", "vertices") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of box, radius and vertices, not {len(given)} of them")
        if not self.fixed and self.density is None:
            raise ValueError("give a density, or fixed = true")
        return self


def list_names(given: Any) -> Any:
    """A name as a list of it."""
    return [given] if isinstance(given, str) else given


Meshes = Annotated[list[Text], BeforeValidator(list_names), Field(min_length=1)]


class Poured(Table):
    """Many bodies on a loose grid inside a region, at random angles, to be poured."""

    count: Annotated[int, Field(ge=1, le=100_000)]  # number of stones
    size: Sizes | None = None
    region_low: Vector  # least corner [m] of ...
    region_high: Vector
    """Corners of the region that the grid fills from below [m]; higher if it does not suffice."""
    density: Positive  # as that of a body [kg/m^3]
    seed: Annotated[int, Field(ge=0)] = 1  # of the stones
    friction: NonNegative | None = None  # by default that of ``surface`` [-]
    restitution: Restitution | None = None  # by default that of ``surface`` [-]

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.size and self.size[0] > self.size[1]:
            raise ValueError("size is [smallest, largest]")
        if len(self.region_low) != len(self.region_high) or any(
            low >= high for low, high in zip(self.region_low, self.region_high, strict=True)
        ):
            raise ValueError("region_high must lie beyond region_low in every direction")
        return self


class Grains(Poured):
    """Irregular stones, drawn at random."""

    size: Sizes  # smallest and largest diameter [m], uniform in between
    corners: Annotated[list[Corners], Field(min_length=2, max_length=2)] = Field([5, 9])
    """Fewest and most corners of a stone."""
    shape: Annotated[str, AfterValidator(check_shape)] = "irregular"
    """A file of `rigid_lcp.shapes` that draws stones."""

    @model_validator(mode="after")
    def _check_corners(self) -> Grains:
        if not 3 <= self.corners[0] <= self.corners[1]:
            raise ValueError("corners is [fewest, most], at least 3")
        return self


class Stones(Poured):
    """Scanned stones: convex hulls of closed surfaces, of as few corners as asked; in space."""

    mesh: Meshes
    """Mesh file, STL, OBJ or PLY, or a list of them, or a folder whose files of these endings are
    taken: as many stones of each; paths from the scene's folder."""
    unit: LengthUnit  # of the lengths in the files
    grading: GradingKey | None = None
    """Sieve sizes by a standard's name, or sieves [mm] with the mass that passes [%]; drawn by
    mass."""
    size: Sizes | None = None
    """Or smallest and largest sieve size [m], uniform in between; the scan's own without both."""
    corners: Annotated[int, Field(ge=4, le=MOST_CORNERS)] = 40
    """Most corners of a stone: a hull of more is thinned to as many (cost: docs/hard-grains.md)."""
    hull_excess: NonNegative = 0.25
    """Most volume that a hull may have beyond its scan, over the scan's [-]."""

    @model_validator(mode="after")
    def _check_sizes(self) -> Stones:
        if self.grading is not None and self.size is not None:
            raise ValueError("give grading or size, or neither for the scan's own size")
        return self


class Pair(Table):
    """Friction and restitution of contacts between two kinds of bodies, in place of the smaller one
    of each body's own; of pairs that name the same bodies, the last."""

    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    """Two of: the name of a body; ground, grains, stones; or one table of these, as grains.0.  A
    name of a body goes first."""
    friction: NonNegative | None = None  # Coulomb's coefficient [-]
    restitution: Restitution | None = None  # Newton's coefficient [-]

    @model_validator(mode="after")
    def _check_pair(self) -> Pair:
        if self.friction is None and self.restitution is None:
            raise ValueError("give friction, restitution or both")
        return self


class Load(Table):
    """A force on a named body, constant or cyclic between two values."""

    body: Name  # that it acts on, at the centre of mass
    force: Vector  # [N]; the greatest one of a cyclic load
    least: Vector | None = None  # the smallest force of a cyclic load [N]; zero if not given
    frequency: Positive | None = None  # [Hz], ten steps a period; without it the load is constant
    phase: Real = 0.0
    """Of a cyclic load at its begin [rad]; at zero it starts from the smallest force."""
    begin: NonNegative = 0.0  # instant [s]
    end: Positive | None = None  # instant [s]; it acts to the end of the run if not given

    @model_validator(mode="after")
    def _check_load(self) -> Load:
        if self.end is not None and self.end <= self.begin:
            raise ValueError(f"end ({self.end:g} s) is not after begin ({self.begin:g} s)")
        if self.frequency is None and (self.least is not None or self.phase != 0.0):
            raise ValueError("least and phase are of a cyclic load: give its frequency too")
        return self


class WearTable(Table):
    """Corners of polygons, corners and edges of polyhedra worn by the work of friction."""

    coefficient: Positive  # volume per work of friction [m^3/J]
    every: Annotated[int, Field(ge=1)] = 20  # steps between cuts


class StrengthTable(Table):
    """Grains that break under their contact forces."""

    tension: Positive  # tensile strength [Pa]
    every: Annotated[int, Field(ge=1)] = 20  # steps between judgements
    smallest: NonNegative = 0.0  # volume below which grains do not break [m^3], in 2D area [m^2]
    modulus: Positive | None = None  # Weibull's modulus [-]; with ``reference_volume``
    reference_volume: Positive | None = None  # of a grain that bears ``tension`` [m^3], in 2D [m^2]
    unique: bool = False  # judge by the forces of elastic contacts; for piles at rest


class SceneTables(Table):
    """A whole scene file."""

    title: str = ""  # of the report
    dimensions: Literal[2, 3]  # of space
    gravity: Vector | None = None  # acceleration [m/s^2]; none if not given
    run: Run
    surface: Surface = Surface()
    ground: list[Ground] = Field([])
    body: list[BodyTable] = Field([])
    grains: list[Grains] = Field([])
    stones: list[Stones] | None = None  # None, not empty: older runs without this key still go on
    pair: list[Pair] | None = None  # as stones
    load: list[Load] = Field([])
    wear: WearTable | None = None
    strength: StrengthTable | None = None


def plan_steps(run: Run) -> tuple[int, float]:
    """Number of the steps of a whole run and the length of each [s]: equal steps, not longer than
    the scene's, that end at every frame.  At acceleration level the fewest and the longest."""
    span = run.duration / run.frames
    count = max(ceil(span / run.step - SIMULATION.time_round_off), 1)
    return count * run.frames, span / count


def find_faults(tables: SceneTables) -> Iterator[Problem]:
    """What the tables of a scene demand of one another."""
    yield from _find_wrong_sizes(tables)
    names = [body.name for body in tables.body]
    held = {body.name for body in tables.body if body.fixed}
    for i, body in enumerate(tables.body):
        if body.name in names[:i]:
            yield Problem(f"body.{i}.name", f"two bodies have the name {body.name}")
        if body.inertia is not None and (tables.dimensions == 3 or body.fixed):
            yield Problem(f"body.{i}.inertia", "for bodies that move, in 2 dimensions")
    yield from _find_wrong_pairs(tables, held)
    for i, load in enumerate(tables.load):
        if load.body not in names:
            near = suggest_word(load.body, names)
            yield Problem(f"load.{i}.body", f"there is no body {load.body}{near}")
        elif load.body in held:
            yield Problem(f"load.{i}.body", f"{load.body} is fixed, no load moves it")
        longest = 1.0 / (STEPS_OF_A_PERIOD * load.frequency) if load.frequency else inf
        if plan_steps(tables.run)[1] > longest * (1 + SIMULATION.time_round_off):
            said = f"{load.frequency:g} Hz have fewer than {STEPS_OF_A_PERIOD} steps a period"
            yield Problem(f"load.{i}.frequency", f"{said}: give run.step = {longest:.10g} or less")
    if tables.stones and tables.dimensions == 2:
        yield Problem("stones", "scanned stones are in 3 dimensions: give dimensions = 3")
    for i, grains in enumerate(tables.grains):
        if tables.dimensions == 3 and grains.corners[0] < 4:
            yield Problem(f"grains.{i}.corners", "a polyhedron has at least 4")
    if tables.run.method == "acceleration" and (tables.wear or tables.strength):
        yield Problem("run.method", "nothing wears or breaks at acceleration level")
    size = tables.strength and (tables.strength.modulus, tables.strength.reference_volume)
    if size and (size[0] is None) != (size[1] is None):
        yield Problem("strength", "give both modulus and reference_volume, or neither")
    if not (tables.grains or tables.stones) and all(body.fixed for body in tables.body):
        said = "no body can move: add a [[body]] with a density, [[grains]] or [[stones]]"
        yield Problem("", said)


def list_surfaces(tables: SceneTables) -> dict[str, list[str]]:
    """What a pair may name, and the surfaces of bodies that it means."""
    found: dict[str, list[str]] = {}
    for kind in ("ground", "grains", "stones"):
        if own := [f"{kind}.{i}" for i in range(len(getattr(tables, kind) or ()))]:
            found |= {kind: own} | {one: [one] for one in own}
    return found | {body.name: [body.name] for body in tables.body}


def _find_wrong_pairs(tables: SceneTables, held: set[str]) -> Iterator[Problem]:
    """Pairs of bodies that are not there, or that never touch."""
    known, bodies = list_surfaces(tables), {body.name for body in tables.body}
    moving = {word for word in known if word.startswith(("grains", "stones"))} | bodies
    for i, pair in enumerate(tables.pair or ()):
        one, other = pair.between
        lost = [word for word in pair.between if word not in known]
        for word in lost:
            yield Problem(f"pair.{i}.between", f"there is no {word}{suggest_word(word, known)}")
        if not (lost or (moving - held) & {one, other}) or one == other in bodies:
            yield Problem(f"pair.{i}.between", f"{one} and {other} never touch, or neither moves")


def _find_wrong_sizes(tables: SceneTables) -> Iterator[Problem]:
    """Vectors that are not of the scene's dimensions."""
    vectors: list[tuple[str, Any]] = [("gravity", tables.gravity)]
    for kind in ("ground", "body", "grains", "stones", "load"):
        for i, table in enumerate(getattr(tables, kind) or ()):
            vectors += [(f"{kind}.{i}.{name}", getattr(table, name, None)) for name in VECTORS]
            for k, vertex in enumerate(getattr(table, "vertices", None) or ()):
                vectors.append((f"{kind}.{i}.vertices.{k}", vertex))
    for key, value in vectors:
        if value is not None and len(value) != tables.dimensions:
            yield Problem(key, f"has {len(value)} numbers in {tables.dimensions} dimensions")
