"""The tables of a scene file, and what is checked of them."""

from qdem_fem.tables.contact import ContactTable, choose_contact, find_contact_faults
from qdem_fem.tables.keys import (
    BodyTable,
    Condition,
    MaterialTable,
    Mesh,
    Nodes,
    Output,
    Periodic,
    Scene,
    SeriesTable,
    SimulationTable,
)
from qdem_fem.tables.prepared import (
    Prepared,
    Step,
    find_output_faults,
    list_named_files,
    list_tables,
)
from qdem_fem.tables.types import Cells, Share, WrongKey
from qdem_fem.tables.values import (
    find_named_nodes,
    make_body_mesh,
    make_series,
    make_unit_vector,
)

__all__ = [
    "BodyTable", "Cells", "Condition", "ContactTable", "MaterialTable", "Mesh", "Nodes",
    "Output", "Periodic", "Prepared", "Scene", "SeriesTable", "Share", "SimulationTable",
    "Step", "WrongKey", "choose_contact", "find_contact_faults", "find_named_nodes",
    "find_output_faults", "list_named_files", "list_tables", "make_body_mesh", "make_series",
    "make_unit_vector",
]  # fmt: skip
