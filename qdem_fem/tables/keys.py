"""The scene: bodies, conditions and output of one QDEM run, as the tables of a scene file (SI).

`qdem_fem.scene.load_scene` reads a scene; ``cantilever.toml`` explains every key.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from qdem_fem.bodies import Rigid
from qdem_fem.element import MEASURES, Strain
from qdem_fem.tables.contact import ContactTable
from qdem_fem.tables.types import (
    Cells,
    NumberVector,
    NumberVectorName,
    Poisson,
    Share,
    Size,
    Vector,
    make_discriminator,
)
from trackbed.scene_files import Name, NonNegative, Positive, Real, Table, Text

AUDIT = 1e-3
"""Of `Output.audit`, where bodies touch."""


class BoxMesh(Table):
    """A rectangular block with one corner at ``origin``, cut into tetrahedra."""

    size: Size  # edge lengths [m]
    cells: Cells  # hexahedral cells along each edge; each is cut into tetrahedra by the pattern
    pattern: Literal["kuhn", "five"] = "kuhn"
    """Tetrahedra in a cell: six around its diagonal (kuhn), or five, neighbours mirrored."""
    origin: Vector = (0.0, 0.0, 0.0)  # least corner [m]


class Mesh(Table):
    """Where a body's tetrahedra come from: one of the keys."""

    file: Text | None = None
    """Mesh file of any format of meshio; a relative path counts from the scene file."""
    scale: Positive = 1.0  # one unit of the file [m]: 0.001 where it is in millimetres
    box: BoxMesh | None = None


class MaterialTable(Table):
    """Isotropic linear viscoelastic material (eqs 7-8)."""

    young: Positive  # Young's modulus [Pa]
    poisson: Poisson  # Poisson's ratio [-]
    density: Positive  # mass density [kg/m^3]
    shear_viscosity: NonNegative = 0.0  # of a change of shape [Pa s]
    bulk_viscosity: NonNegative = 0.0  # of a change of volume [Pa s]


class Region(Table):
    """Keys of the material that differ in one element set of the mesh."""

    young: Positive | None = None  # Young's modulus [Pa]
    poisson: Poisson | None = None  # Poisson's ratio [-]
    density: Positive | None = None  # mass density [kg/m^3]
    shear_viscosity: NonNegative | None = None  # of a change of shape [Pa s]
    bulk_viscosity: NonNegative | None = None  # of a change of volume [Pa s]


class BodyTable(Table):
    """One body, deformable unless it is said to be rigid."""

    name: Name  # by which other tables name it
    mesh: Mesh
    material: MaterialTable
    rigid: Rigid = False
    """Six freedoms and no element work; with the inertia of the solid, or of masses at nodes."""
    element: Literal["linear", "quadratic"] | None = None
    """Tetrahedra of four nodes, as by default, or of ten, for bodies that bend."""
    regions: dict[str, Region] = Field(default_factory=dict)
    """Material keys that differ, by the name of an element set."""
    velocity: Vector | None = None  # of its centre of mass at the start [m/s]; at rest by default
    spin: Vector | None = None  # angular velocity about its centre of mass at the start [1/s]

    @property
    def moves(self) -> bool:
        """Whether it is in motion at the start."""
        return self.velocity is not None or self.spin is not None


class BoxNodes(Table):
    """Nodes inside a box; the bounds belong to it."""

    min: Vector  # least corner [m]
    max: Vector  # greatest corner [m]


class PlaneNodes(Table):
    """Nodes near a plane."""

    point: Vector  # on the plane [m]
    normal: Vector  # of any length [-]
    tolerance: NonNegative = 1e-6  # greatest distance from the plane [m]


class Nodes(Table):
    """Which nodes of a body: exactly one of the keys."""

    set: Text | None = None
    """A node set of the mesh; every mesh has x-min, x-max, y-min, y-max, z-min, z-max."""
    box: BoxNodes | None = None
    plane: PlaneNodes | None = None
    nearest: Vector | None = None  # the one node nearest to a point [m]
    all: Literal[True] | None = None  # every node of the body


class SeriesTable(Table):
    """A quantity over time: a ramp, a table, or two columns of a CSV file."""

    ramp: Positive | None = None
    """Duration of the linear growth from zero to ``value``, which then stays [s]."""
    value: NumberVectorName | None = None
    """Of a ramp: the value at its end [as its table].  Of a CSV file: the name of the column."""
    times: Annotated[tuple[Real, ...], Field(strict=False)] | None = None
    """Instants [s], growing; linear between them, constant before and behind."""
    values: Annotated[tuple[NumberVector, ...], Field(strict=False)] | None = None
    """Values at the ``times`` [as its table]."""
    csv: Text | None = None
    """CSV file with a header line; a relative path counts from the scene file."""
    time: Text = "time"  # column of the instants [s] in the CSV file
    direction: Vector | None = None
    """Of a force whose values are numbers: the vector that they multiply [-]."""


ScalarSeries = Annotated[
    Annotated[Real, Tag("#number")] | Annotated[SeriesTable, Tag("#table")],
    make_discriminator("#number", "#table"),
]
VectorSeries = Annotated[
    Annotated[Vector, Tag("#vector")] | Annotated[SeriesTable, Tag("#table")],
    make_discriminator("#vector", "#table"),
]


class Condition(Table):
    """A condition on some nodes of one body."""

    body: Name  # that has the nodes
    nodes: Nodes


class Fix(Condition):
    """Components of the displacement that stay zero."""

    components: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"  # that stay zero


class Prescribe(Condition):
    """One component of the displacement [m] that follows a series."""

    component: Literal["x", "y", "z"]  # that is prescribed
    value: ScalarSeries  # displacement [m]


class Roller(Condition):
    """Nodes that stay on a plane."""

    normal: Vector  # of the plane, of any length [-]


class Load(Condition):
    """A total force [N], shared equally over the nodes."""

    force: VectorSeries  # of all nodes together [N]


class Pressure(Condition):
    """A pressure [Pa] on the surface faces whose three nodes are all named."""

    pressure: ScalarSeries  # that pushes inwards [Pa]


class Periodic(Table):
    """Two sets of nodes that share one displacement, pair by pair."""

    body: Name  # that has both sets
    nodes_a: Nodes
    nodes_b: Nodes


class Probe(Nodes):
    """Nodes whose mean displacement is recorded."""

    body: Name | None = None  # needed when there are several bodies


class SimulationTable(Table):
    """How to compute."""

    method: Literal["dynamic", "static"] = "dynamic"  # a march in time, or the answer at rest
    duration: Positive | None = None  # simulated time [s] of a dynamic run
    tolerance: Annotated[float, Field(ge=1e-14, le=0.1, allow_inf_nan=False)] = 1e-8
    """Of a static answer: residual force over the load [-]."""
    strain: Strain = "finger"  # its measure: a file of `qdem_fem.element`
    precision: Literal["float64", "float32"] = "float64"  # of numbers on the device
    step: Positive | None = None  # time step [s]; by default the critical one times ``safety``
    safety: Share = 0.9  # time step over the critical one [-]
    threads: Annotated[int, Field(ge=1, le=1024)] | None = None  # by default one a processor
    device: Literal["cpu", "cuda"] = "cpu"  # what computes
    gravity: Vector | None = None  # acceleration [m/s^2]; left out of the kernel when not given
    mass_scaling: Positive | None = None  # time step [s] that elements are made heavier for


class Output(Table):
    """What is written, and how often; intervals in simulated time unless said otherwise."""

    sampling: Positive | None = None
    """Between rows of probes.csv [s]; by default a 2000th of the duration."""
    energy_interval: Positive | None = None
    """Between rows of energy.csv [s]; by default a 200th of the duration, at least 100 steps."""
    vtu_interval: Positive | None = None
    """Between VTU files [s]; by default only the end is written."""
    magnification: Positive | None = None
    """Of displacements in the report's picture [-]; by default a round one that shows them."""
    checkpoint_interval: NonNegative = 300.0  # between checkpoints, by the clock on the wall [s]
    audit: Share | None = None
    """Share of the greatest energy that may be missing in the account of energies, what viscosity
    takes included [-]; a run stops beyond it.  By default `AUDIT` where bodies touch, and not
    looked at where none do."""
    probes: dict[Name, Probe] = Field(default_factory=dict)
    modes: Annotated[int, Field(ge=0, le=20)] = 3
    """Number of modes sought in each probe's free motion."""


class Scene(Table):
    """A whole scene file."""

    title: str = ""  # of the report
    body: Annotated[tuple[BodyTable, ...], Field(min_length=1, strict=False)]
    simulation: SimulationTable
    fix: Annotated[tuple[Fix, ...], Field(strict=False)] = ()
    prescribe: Annotated[tuple[Prescribe, ...], Field(strict=False)] = ()
    roller: Annotated[tuple[Roller, ...], Field(strict=False)] = ()
    load: Annotated[tuple[Load, ...], Field(strict=False)] = ()
    pressure: Annotated[tuple[Pressure, ...], Field(strict=False)] = ()
    periodic: Annotated[tuple[Periodic, ...], Field(strict=False)] = ()
    contact: ContactTable | None = None  # bodies touch; left out of the kernel when not given
    output: Output = Output()

    @property
    def audit(self) -> float | None:
        """Share of the greatest energy that may be missing; None: not looked at."""
        default = None if self.contact is None else AUDIT
        return default if self.output.audit is None else self.output.audit

    def list_left_out(self) -> list[str]:
        """Physics that is not in this run, because the scene does not name it."""
        viscous = any(
            _is_viscous(body.material) or any(map(_is_viscous, body.regions.values()))
            for body in self.body
            if not body.rigid
        )
        driven = self.load or self.pressure or self.prescribe or self.simulation.gravity
        moved = driven or any(body.moves for body in self.body)
        turns = MEASURES[self.simulation.strain].OBJECTIVE
        missing = [
            (not viscous, "viscosity: the material is elastic"),
            (self.simulation.gravity is None, "gravity"),
            (not moved, "any cause of motion: no load, pressure, gravity, displacement"),
            (self.simulation.mass_scaling is None, "mass scaling: every mass is the material's"),
            (not turns, f"finite rotations: the strain is {self.simulation.strain}"),
            (self.simulation.method == "static", "inertia: the answer is static"),
            (self.contact is None, "contact and friction between bodies"),
            (any(body.rigid for body in self.body), "deformation of the bodies said to be rigid"),
            (True, "plasticity, damage and fracture"),
        ]
        return [text for absent, text in missing if absent]

    def parameters(self) -> dict[str, Any]:
        """Every effective value, defaults included, as JSON would hold it."""
        return self.model_dump(mode="json", exclude_none=True)


def _is_viscous(table: MaterialTable | Region) -> bool:
    return bool(table.shear_viscosity or table.bulk_viscosity)
