"""What keys of a scene stand for: the mesh of a body, which of its nodes, quantities over time.

Ramps, tables and CSV columns become instants and values.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from qdem_fem.files import Floats, Integers, Series, make_ramp, warn_user
from qdem_fem.mesh import TetMesh, make_box_mesh, read_mesh
from qdem_fem.tables.keys import Mesh, Nodes, SeriesTable
from qdem_fem.tables.types import WrongKey
from trackbed.errors import LibraryMissing, UsageError
from trackbed.scene_files import suggest_word
from trackbed.series_file import TIMES, read_columns

SIDE = 1e-6
"""Distance to a side, over the size of the mesh, within which a node lies on it; mesh files keep
single precision or a few digits."""
REACH = 0.6124
"""Greatest distance of a point in an element from a corner, over its longest edge (Jung 1901)."""
KINDS = ("set", "box", "plane", "nearest", "all")
CELLS_MOST = 4_000_000
"""Most cells of a generated mesh: what 128 GB of memory hold."""
WAYS = {"ramp": ("ramp", "value"), "times": ("times", "values"), "csv": ("csv", "value")}
"""First key of each way to give a series, and the keys that it needs."""
UNITS = {
    "force": ("N", "kN", "MN"), "pressure": ("Pa", "kPa", "MPa", "GPa"),
    "value": ("m", "cm", "mm", "um", "µm"),
}  # fmt: skip
"""Units that a column may have, by the key that it is given for."""


def make_body_mesh(table: Mesh, folder: Path, key: str) -> TetMesh:
    """The mesh of a body; a relative path counts from ``folder``.

    Raises `MeshError`, or `WrongKey` with the key for measures that make no mesh.
    """
    if (table.file is None) == (table.box is None):
        raise WrongKey(key, "give one of file, box")
    if table.box is None:
        mesh = read_mesh(folder / str(table.file))
        return replace(mesh, nodes=table.scale * mesh.nodes)
    if table.scale != 1.0:
        raise WrongKey(f"{key}.scale", "it is the unit of a file: give the box in metres")
    count = int(np.prod(table.box.cells))
    if count > CELLS_MOST:
        raise WrongKey(f"{key}.box.cells", f"{count} cells are too many; at most {CELLS_MOST}")
    return read_mesh(make_box_mesh(*dict(table.box).values()))


def list_node_sets(mesh: TetMesh) -> dict[str, Integers]:
    """The mesh's own node sets, and x-min ... z-max where it has none of these names."""
    used = ~np.isin(np.arange(len(mesh.nodes)), mesh.unused)
    low, high = mesh.nodes[used].min(axis=0), mesh.nodes[used].max(axis=0)
    near = SIDE * float((high - low).max())
    sets = {}
    for axis, letter in enumerate("xyz"):
        x = mesh.nodes[:, axis]
        sets[f"{letter}-min"] = np.flatnonzero(used & (x <= low[axis] + near))
        sets[f"{letter}-max"] = np.flatnonzero(used & (x >= high[axis] - near))
    return sets | mesh.node_sets


def find_named_nodes(nodes: Nodes, mesh: TetMesh, key: str) -> Integers:
    """Numbers of the nodes that a scene names at ``key``, sorted, without nodes of no element.

    Raises `WrongKey` for an unknown set and for a selection that names no node.
    """
    given = [name for name in KINDS if getattr(nodes, name) is not None]
    if len(given) != 1:
        raise WrongKey(key, f"give exactly one of {', '.join(KINDS)}")
    kind = given[0]
    x = mesh.nodes
    used = ~np.isin(np.arange(len(x)), mesh.unused)
    if nodes.set is not None:
        sets = list_node_sets(mesh)
        if nodes.set not in sets:
            near = suggest_word(nodes.set, sets)
            known = f" (sets of this mesh: {', '.join(sorted(sets)[:20])})"
            what = f"there is no set {nodes.set!r}{near}{known if 'mean' in near else ''}"
            raise WrongKey(f"{key}.set", what)
        found = sets[nodes.set]
    elif nodes.box is not None:
        low, high = np.array(nodes.box.min), np.array(nodes.box.max)
        if (low > high).any():
            raise WrongKey(f"{key}.box", "min must not be above max")
        found = np.flatnonzero(((x >= low) & (x <= high)).all(axis=1))
    elif nodes.plane is not None:
        normal = make_unit_vector(nodes.plane.normal, f"{key}.plane.normal")
        height = (x - np.array(nodes.plane.point)) @ normal
        found = np.flatnonzero(np.abs(height) <= nodes.plane.tolerance)
    elif nodes.nearest is not None:
        distance = np.linalg.norm(x - np.array(nodes.nearest), axis=1)
        found = np.argmin(np.where(used, distance, np.inf)).reshape(1)
        corners = x[mesh.elements[(mesh.elements == found).any(axis=1)]]
        longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max()
        if (away := distance[found[0]]) > REACH * longest:
            text = f"{key}.nearest is outside the body: the node at {x[found[0]]} m is taken"
            warn_user(f"{text}, {away:.3g} m away; edges there are {longest:.3g} m long at most")
    else:
        found = np.flatnonzero(used)
    found = found[used[found]]
    if not len(found):
        low, high = x[used].min(axis=0), x[used].max(axis=0)
        spans = ", ".join(f"{a:g} ... {b:g}" for a, b in zip(low, high, strict=True))
        what = f"names no node; the body spans {spans} m"
        raise WrongKey(f"{key}.{kind}", what)
    return found


def make_unit_vector(vector: tuple[float, float, float], key: str) -> Floats:
    """The vector over its length; raises `WrongKey` for zero."""
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise WrongKey(key, "has no direction")
    return np.array(vector) / length


def make_series(
    table: SeriesTable | float | tuple[float, ...], key: str, folder: Path, *, vector: bool
) -> Series:
    """The series that a scene gives at ``key``; a relative CSV path counts from ``folder``.

    Values are numbers, or vectors where ``vector``.  Raises `WrongKey`.
    """
    if not isinstance(table, SeriesTable):
        return Series([0.0], [table])
    way = _choose_way(table, key)
    if way == "ramp":
        if isinstance(table.value, str) or table.value is None or table.ramp is None:
            raise WrongKey(f"{key}.value", "a ramp needs a value in SI units")
        found = make_ramp(table.ramp, table.value)
    else:
        found = _read_values(table, key) if way == "times" else _read_csv(table, key, folder)
    return _apply_direction(found, table, key, vector)


def _choose_way(table: SeriesTable, key: str) -> str:
    """Which of the ways to give a series; all keys that belong to it and no other are there."""
    given = table.model_fields_set
    ways = [way for way in WAYS if way in given]
    if len(ways) != 1:
        raise WrongKey(key, "give one of ramp, times or csv")
    (way,) = ways
    needed = set(WAYS[way])
    allowed = needed | {"direction"} | ({"time"} if way == "csv" else set())
    missing, extra = sorted(needed - given), sorted(given - allowed)
    if missing:
        raise WrongKey(f"{key}.{missing[0]}", f"missing: {way} needs it")
    if extra:
        raise WrongKey(f"{key}.{extra[0]}", f"{way} does not use it")
    return way


def _read_values(table: SeriesTable, key: str) -> Series:
    times, values = table.times or (), table.values or ()
    if len(times) != len(values) or not times:
        what = f"{len(times)} times, {len(values)} values: give as many, and at least one"
        raise WrongKey(f"{key}.values", what)
    if len({isinstance(value, tuple) for value in values}) > 1:
        raise WrongKey(f"{key}.values", "numbers and vectors are mixed")
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            what = f"must grow: entry {index}, {times[index]:g} s, follows {times[index - 1]:g} s"
            raise WrongKey(f"{key}.times", what)
    return Series(times, values)


def _read_csv(table: SeriesTable, key: str, folder: Path) -> Series:
    if not isinstance(table.value, str):
        raise WrongKey(f"{key}.value", "name the column of the values")
    path = folder / str(table.csv)

    def refuse(what: str, where: str) -> WrongKey:
        return WrongKey(f"{key}.csv", what, where)

    try:
        units = TIMES, UNITS[key.rpartition(".")[2]]
        (times, values), lines = read_columns(path, (table.time, table.value), units)
    except (UsageError, LibraryMissing) as error:
        raise refuse(error.what, error.where) from error
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        row = int(back[0]) + 1
        what = f"times must grow: {times[row]:g} s follows {times[row - 1]:g} s"
        raise refuse(what, f"{path}:{lines[row]}")
    return Series(times, values)


def _apply_direction(found: Series, table: SeriesTable, key: str, vector: bool) -> Series:
    """Numbers times the direction for a vector quantity; refuses what does not fit."""
    is_vector = found.values.ndim == 2
    if table.direction is not None:
        if not vector or is_vector:
            raise WrongKey(f"{key}.direction", "only numbers of a force are directed")
        return Series(found.times, found.values[:, None] * np.array(table.direction))
    if vector and not is_vector:
        raise WrongKey(key, "a force is a vector: give vectors, or direction = [...]")
    if is_vector and not vector:
        raise WrongKey(key, "must be numbers, not vectors")
    return found
