"""A state of spheres as an ON-DEM VTKHDF file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed import GRAVITY, State
from adapters.errors import UsageError
from adapters.files.ondem.layout import FORMAT, UNITS, VERSION, load_h5py
from trackbed import __version__
from trackbed.run_files import write_whole

VTK_VERSION = (2, 0)
"""Version of VTKHDF: the first with points."""


def write_bodies(
    path: Path, state: State, scene: Mapping[str, float], material: Mapping[str, float]
) -> None:
    """Write spheres and their contacts to ``path``, whole or not at all.

    ``scene``: attributes, such as ``cycle``, ``time`` and ``timestep`` [s].  ``material``, where it
    is known: ``density`` [kg/m^3], ``young`` [Pa], ``poisson``, ``friction_coefficient``.
    Walls and their forces are left out.  Raises `UsageError` for stones, `LibraryMissing` without
    h5py, and as `write_whole`.
    """
    if state.orientation is not None:
        raise UsageError(
            "ON-DEM's draft has no stones of several spheres", where=str(path),
            remedy="trackbed export RUN --to vtu has their centres and rotations",
        )  # fmt: skip
    h5py = load_h5py(path)
    # In memory first: HDF5 does not recover from a disk that fills while it writes.
    with h5py.File("state", "w", driver="core", backing_store=False) as file:
        file.attrs.update(
            file_format=FORMAT, file_format_version=VERSION, source_code=f"trackbed {__version__}"
        )
        _write_points(file.create_group("VTKHDF"), state, 0 if material else -1)
        group = file.create_group("ONDEM/Scene")
        group.attrs.update(scene)
        group["units"] = np.array(UNITS, h5py.string_dtype())
        group["gravity"] = (0.0, 0.0, -GRAVITY)
        group = file.create_group("ONDEM/Materials")
        for name, value in ({"id": 0} | dict(material) if material else {}).items():
            group[f"0/{name}"] = value
        _write_contacts(file.create_group("ONDEM/Interactions"), state)
        file.flush()
        image = file.id.get_file_image()
    write_whole(path, image)


def _write_points(group: Any, state: State, material_id: int) -> None:
    """The bodies as VTK's PolyData: a point and a vertex each, and their fields."""
    count, volume = len(state.radius), 4 / 3 * np.pi * state.radius**3
    group.attrs["Type"], group.attrs["Version"] = np.bytes_("PolyData"), VTK_VERSION
    group["NumberOfPoints"], group["Points"] = [count], state.position
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        cells = count if kind == "Vertices" else 0
        group[f"{kind}/NumberOfCells"] = group[f"{kind}/NumberOfConnectivityIds"] = [cells]
        group[f"{kind}/Connectivity"] = np.arange(cells)
        group[f"{kind}/Offsets"] = np.arange(cells + 1)
    inertia = 2 / 5 * state.mass * state.radius**2
    data = group.create_group("PointData")
    data.attrs["Scalars"] = "radius"
    for name, values in {
        "body_id": state.identifier, "position": state.position, "radius": state.radius,
        "velocity": state.velocity, "angular_velocity": state.spin, "mass": state.mass,
        "volume": volume, "inertia": inertia[:, None] * np.eye(3).ravel(),
        "material_id": np.full(count, material_id), "clump_id": np.full(count, -1),
    }.items():  # fmt: skip
        data[name] = values


def _write_contacts(group: Any, state: State) -> None:
    """Contacts between spheres: the normal from ``id1`` to ``id2``, forces on ``id2`` [N]."""
    contacts = state.contacts
    first, second = np.searchsorted(state.identifier, contacts.pair).T
    apart = state.position[second] - state.position[first]
    normal = apart / np.linalg.norm(apart, axis=1, keepdims=True)
    reach = state.radius[first] - contacts.overlap / 2
    group.attrs["count"] = len(contacts)
    for name, values in {
        "id1": contacts.pair[:, 0], "id2": contacts.pair[:, 1], "normal": normal,
        "overlap": contacts.overlap,
        "contact_point": state.position[first] + reach[:, None] * normal,
        "normal_force": -np.einsum("ma,ma->m", contacts.normal_force, normal),
        "shear_force": -contacts.tangential_force,
    }.items():  # fmt: skip
        group[name] = values
