"""States in ON-DEM VTKHDF, a format that codes of the discrete element method share."""

from adapters.files.ondem.reader import ENDING, read_bodies
from adapters.files.ondem.writer import write_bodies

__all__ = ["ENDING", "read_bodies", "write_bodies"]
