"""A state of spheres as an ON-DEM VTKHDF file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed import GRAVITY, FloatArray, IntArray, State
from adapters.errors import UsageError
from adapters.files.ondem.reader import UNITS, load_h5py
from trackbed import __version__
from trackbed.run_files import write_whole


def write_bodies(
    path: Path, state: State, scene: Mapping[str, float],
    material: Mapping[str, float], contacts: Mapping[str, FloatArray | IntArray],
) -> None:  # fmt: skip
    """Write spheres to ``path``, whole or not at all, with what is known beside their state.

    ``scene``: ``iteration``, ``time``, ``timestep`` [s].  ``material``: ``density`` [kg/m^3],
    ``young`` [Pa] and the like.  ``contacts``: ``id1``, ``id2``, ``overlap`` [m], ``normal_force``
    [N], positive where it pushes apart, ``shear_force`` on ``id2`` [N].  Raises `UsageError` for
    stones, `LibraryMissing`, and as `write_whole`.
    """
    if state.orientation is not None:
        what, do = "ON-DEM's draft has no stones of several spheres", "take vtu, which has them"
        raise UsageError(what, where=str(path), remedy=do)
    h5py = load_h5py(path)
    # In memory first: HDF5 does not recover from a disk that fills while it writes.
    with h5py.File("state", "w", driver="core", backing_store=False) as file:
        file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.1-draft")
        file.attrs["source_code"] = f"trackbed {__version__}"
        _write_points(file.create_group("VTKHDF"), state, 0 if material else -1)
        file.create_group("ONDEM/Scene").attrs.update(scene)
        file["ONDEM/Scene/units"] = np.array(UNITS, h5py.string_dtype())
        file["ONDEM/Scene/gravity"] = (0.0, 0.0, -GRAVITY)
        file.create_group("ONDEM/Materials")
        file.create_group("ONDEM/Interactions").attrs["count"] = len(contacts.get("id1", ()))
        for group, values in (("Materials/0", material), ("Interactions", contacts)):
            for name, value in values.items():
                file[f"ONDEM/{group}/{name}"] = value
        file.flush()
        image = file.id.get_file_image()
    write_whole(path, image)


def _write_points(group: Any, state: State, material_id: int) -> None:
    """The bodies as VTK's PolyData: a point and a vertex each, and their fields."""
    count, inertia = len(state.radius), 2 / 5 * state.mass * state.radius**2
    group.attrs["Type"], group.attrs["Version"] = np.bytes_("PolyData"), (2, 0)
    group["NumberOfPoints"], group["Points"] = [count], state.position
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        cells = count if kind == "Vertices" else 0
        group[f"{kind}/NumberOfCells"] = group[f"{kind}/NumberOfConnectivityIds"] = [cells]
        group[f"{kind}/Connectivity"] = np.arange(cells)
        group[f"{kind}/Offsets"] = np.arange(cells + 1)
    data = group.create_group("PointData")
    data.attrs["Scalars"] = "radius"
    for name, values in {
        "body_id": state.identifier, "position": state.position, "radius": state.radius,
        "velocity": state.velocity, "angular_velocity": state.spin, "mass": state.mass,
        "volume": 4 / 3 * np.pi * state.radius**3, "inertia": inertia[:, None] * np.eye(3).ravel(),
        "material_id": np.full(count, material_id), "clump_id": np.full(count, -1),
    }.items():  # fmt: skip
        data[name] = values
