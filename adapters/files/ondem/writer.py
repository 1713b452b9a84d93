"""A state of spheres as an ON-DEM VTKHDF file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed import GRAVITY, FloatArray, IntArray, State
from adapters.errors import UsageError
from adapters.files.ondem.reader import UNITS, load_h5py
from trackbed import __version__
from trackbed.run_files import write_whole

VERSION = (2, 5)  # of VTKHDF
BLOCK = "grains"
"""Name of the only block: ON-DEM's display group, which is what ParaView lists."""


def write_bodies(
    path: Path, state: State, scene: Mapping[str, float],
    material: Mapping[str, float], contacts: Mapping[str, FloatArray | IntArray],
) -> None:  # fmt: skip
    """Write spheres to ``path``, whole or not at all, with what is known beside their state.

    ``scene``: ``iteration``, ``time`` [s], ``timestep`` [s].  ``material``: ``density`` [kg/m^3],
    ``young`` [Pa], ``poisson``, ``friction``, and what is left out.  ``contacts``: ``id1``,
    ``id2``, ``normal`` from 1 to 2, ``overlap`` [m], ``normal_force`` [N], positive in traction,
    ``shear_force`` on 2 [N].  Raises `UsageError` for stones, `LibraryMissing`, as `write_whole`.
    Source: github.com/ON-DEM/ON-DEM-WG3-FileFormat, implementation/README.md, October 2026.
    """
    if state.orientation is not None:
        what, do = "ON-DEM's draft has no stones of several spheres", "take vtu, which has them"
        raise UsageError(what, where=str(path), remedy=do)
    h5py = load_h5py(path)
    # In memory first: HDF5 does not recover from a disk that fills while it writes.
    with h5py.File("state", "w", driver="core", backing_store=False) as file:
        file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.2-draft")
        file.attrs["source_code"] = f"trackbed {__version__}"
        root = file.create_group("VTKHDF", track_order=True)  # VTK reads by order of creation
        root.attrs.update(Type=np.bytes_("MultiBlockDataSet"), Version=VERSION)
        _write_points(root.create_group(BLOCK, track_order=True), state, 0 if material else -1)
        links = root.create_group("Assembly", track_order=True)
        links[BLOCK] = h5py.SoftLink(f"/VTKHDF/{BLOCK}")
        for name in ("Materials", "Interactions"):
            file.create_group(f"ONDEM/{name}")
        file.create_group("ONDEM/Scene").attrs.update(scene)
        words = {"units": UNITS, "display_group_names": [BLOCK], "shape_names": ["sphere"]}
        for name, listed in words.items():
            file[f"ONDEM/Scene/{name}"] = np.array(listed, h5py.string_dtype())
        file["ONDEM/Scene/gravity"] = (0.0, 0.0, -GRAVITY)
        if material:
            _write_material(file.create_group("ONDEM/Materials/0"), material)
        if contacts:
            group = file.create_group("ONDEM/Interactions/hertz_mindlin")
            group.attrs["count"] = len(contacts["id1"])
            for name, value in contacts.items():
                group[name] = value
        file.flush()
        image = file.id.get_file_image()
    write_whole(path, image)


def _write_material(group: Any, material: Mapping[str, float]) -> None:
    """The material as YADE's FrictMat, whose moduli ON-DEM calls stiffnesses."""
    group.attrs["schema_classes"] = "linear_elastic_frictional_3D"
    young, poisson = material["young"], material["poisson"]
    for name, value in {
        "id": 0, "material_type": "FrictMat", "density": material["density"],
        "normal_stiffness": young, "shear_stiffness": young * poisson, "yade_poisson": poisson,
        "shear_friction": material["friction"], "shear_damping": 0.0,
    }.items():  # fmt: skip
        group[name] = value


def _write_points(group: Any, state: State, material_id: int) -> None:
    """The bodies as VTK's PolyData: a point and a vertex each, and their fields."""
    count, inertia = len(state.radius), 2 / 5 * state.mass * state.radius**2
    group.attrs.update(Type=np.bytes_("PolyData"), Version=VERSION)
    group["NumberOfPoints"], group["Points"] = [count], state.position
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        cells, part = count if kind == "Vertices" else 0, group.create_group(kind, track_order=True)
        part["NumberOfCells"] = part["NumberOfConnectivityIds"] = [cells]
        part["Connectivity"], part["Offsets"] = np.arange(cells), np.arange(cells + 1)
    data, zero = group.create_group("PointData", track_order=True), np.zeros(count, np.int64)
    for name, values in {
        "body_id": state.identifier, "shape_type": zero, "radius": state.radius,
        "velocity": state.velocity, "angular_velocity": state.spin, "mass": state.mass,
        "volume": 4 / 3 * np.pi * state.radius**3, "inertia": inertia[:, None] * np.eye(3).ravel(),
        "orientation": np.tile([1.0, 0, 0, 0], (count, 1)), "blocked_dofs": zero,
        "material_id": zero + material_id, "clump_id": zero - 1,
    }.items():  # fmt: skip
        data[name] = values
    data["orientation"].attrs["order"] = "wxyz"  # the identity: a sphere's axes are free to choose
