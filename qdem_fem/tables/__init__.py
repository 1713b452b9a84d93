"""The tables of a scene file, and what is checked of them."""

from qdem_fem.tables.contact import ContactTable, PeriodicTable, contact_faults, contact_of
from qdem_fem.tables.keys import (
    BodyTable,
    Condition,
    MaterialTable,
    Mesh,
    Nodes,
    Output,
    Periodic,
    Probe,
    Scene,
    SeriesTable,
    SimulationTable,
)
from qdem_fem.tables.nodes import find_named_nodes, make_body_mesh, unit_vector
from qdem_fem.tables.prepared import (
    Prepared,
    Step,
    find_output_faults,
    list_named_files,
    list_tables,
    read_tables,
)
from qdem_fem.tables.series import series_of
from qdem_fem.tables.types import Cells, Share, WrongKey

__all__ = [
    "BodyTable", "Cells", "Condition", "ContactTable", "MaterialTable", "Mesh", "Nodes", "Output",
    "Periodic", "PeriodicTable", "Prepared", "Probe", "Scene", "SeriesTable", "Share",
    "SimulationTable", "Step", "WrongKey", "contact_faults", "contact_of", "find_named_nodes",
    "find_output_faults", "list_named_files", "list_tables", "make_body_mesh", "read_tables",
    "series_of", "unit_vector",
]  # fmt: skip
