"""The tables of a scene file, and what is checked of them."""

from qdem_fem.tables.contact import ContactTable, PeriodicTable, contact_faults, contact_of
from qdem_fem.tables.file import scene_read
from qdem_fem.tables.keys import (
    BodyTable,
    Condition,
    Fix,
    Load,
    MaterialTable,
    Mesh,
    Nodes,
    Output,
    Periodic,
    Prescribe,
    Pressure,
    Probe,
    Roller,
    Scene,
    SeriesTable,
    SimulationTable,
)
from qdem_fem.tables.nodes import NoNodes, find_named_nodes, make_body_mesh, unit_vector
from qdem_fem.tables.prepared import (
    Prepared,
    Step,
    find_output_faults,
    list_named_files,
    list_tables,
)
from qdem_fem.tables.series import TimeSeries, WrongSeries, series_of
from qdem_fem.tables.types import Cells, Share

__all__ = [
    "BodyTable", "Cells", "Condition", "ContactTable", "Fix", "Load", "MaterialTable", "Mesh",
    "NoNodes", "Nodes", "Output", "Periodic", "PeriodicTable", "Prepared", "Prescribe", "Pressure",
    "Probe", "Roller", "Scene", "SeriesTable", "Share", "SimulationTable", "Step", "TimeSeries",
    "WrongSeries", "contact_faults", "contact_of", "find_named_nodes", "find_output_faults",
    "list_named_files", "list_tables", "make_body_mesh", "scene_read", "series_of", "unit_vector",
]  # fmt: skip
