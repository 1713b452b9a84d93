"""Names in ON-DEM VTKHDF, draft 0.1, and the library that opens such files.

Sources: github.com/ON-DEM/ON-DEM-WG3-FileFormat, whose exporter for YADE wrote the samples that
tests read; docs.vtk.org, "VTKHDF format specification".  ``/VTKHDF`` is what ParaView reads, a
point a body; ``/ONDEM`` has the scene, materials and contacts.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from trackbed.errors import LibraryMissing

ENDING = ".vtkhdf"
"""Ending of a file name that is taken for a state in this format."""
FORMAT, VERSION = "ON-DEM VTKHDF", "0.1-draft"
UNITS = ("second", "meter", "kilogram")
"""``/ONDEM/Scene/units`` of the only files that are read and written; without it SI is assumed."""
COLUMNS = {
    "body_id": ("id",), "radius": ("radius",), "mass": ("mass",), "velocity": ("vx", "vy", "vz"),
    "angular_velocity": ("omegax", "omegay", "omegaz"),
}  # fmt: skip
"""Field of the bodies -> its columns in a text dump; the first two must be there."""


def load_h5py(path: Path) -> Any:
    """The module h5py; raises `LibraryMissing` where it is not installed."""
    try:
        import h5py
    except ImportError as error:
        raise LibraryMissing(
            "HDF5 files are read and written by h5py, which is not installed", where=str(path),
            remedy="pip install h5py",
        ) from error  # fmt: skip
    return h5py
