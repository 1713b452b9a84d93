"""What a mesh must obey, each rule a function that returns the problems it found, and what it may
be and hardly is meant to be.

All problems of a mesh are collected before one error names them, so that a user mends a file
once.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from qdem_fem.files import Floats, Integers, MeshError

BoolArray = npt.NDArray[np.bool_]

FLAT = 1e-12
"""Volume over the cube of the longest edge at and below which an element counts as flat; a
regular tetrahedron has 0.118.  Round-off of the volume itself is about 1e-16."""
EXTENT_MOST = 1e100
"""Largest extent of a mesh [m], and one over the smallest: volumes stay within float64."""
_SHOWN = 5
SAME_PLACE = 1e-6
"""Distance of two nodes over the size of the mesh at and below which they are at one place."""
NEIGHBOURS = 8
"""Elements nearest to the middle of one that are looked at, whether they contain it, too."""


class Problem(NamedTuple):
    """One thing wrong with a mesh."""

    what: str
    remedy: str


def raise_problems(problems: list[Problem], where: str) -> None:
    """Raise one `MeshError` that names all problems, if there are any."""
    if not problems:
        return
    what = problems[0].what
    if len(problems) > 1:
        listed = "".join(f"\n  {number}. {p.what}" for number, p in enumerate(problems, 1))
        what = f"{len(problems)} problems with this mesh:{listed}"
    remedy = "; ".join(dict.fromkeys(p.remedy for p in problems))
    raise MeshError(what, where=where, remedy=remedy)


def convert_array(raw: Any, what: str, kinds: str, of: str, remedy: str) -> Any:
    """An array of one of the ``kinds`` of numpy's types, or the `Problem` with what it is."""
    try:
        array = np.asarray(raw)
    except (ValueError, TypeError, OverflowError) as error:
        return Problem(f"{what} no array ({error})", remedy)
    if array.size and array.dtype.kind not in kinds:
        return Problem(f"{what} no {of} numbers but of type {array.dtype}", remedy)
    return array


def convert_nodes(raw: Any) -> tuple[Floats, list[Problem]]:
    """Coordinates (n, 3) [m] as float64, a copy; every other shape or type is a problem."""
    remedy = "give nodes as an array (n, 3) of coordinates in metres"
    none = np.zeros((0, 3))
    array = convert_array(raw, "the nodes are", "iuf", "real", remedy)
    if isinstance(array, Problem):
        return none, [array]
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "give nodes.T" if array.ndim == 2 and array.shape[0] == 3 else remedy
        return none, [Problem(f"the nodes have the shape {array.shape}, not (n, 3)", hint)]
    with np.errstate(over="ignore", invalid="ignore"):
        nodes = np.array(array, dtype=np.float64, order="C")
        extent = float(np.ptp(nodes, axis=0).max()) if len(nodes) else 1.0
    bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
    if len(bad):
        at = f"{name_some('node', bad)}; node {bad[0]} is at {nodes[bad[0]].tolist()}"
        what = f"coordinates that are not finite: {at}"
        return nodes, [Problem(what, "mend or remove these nodes")]
    if extent > EXTENT_MOST or 0 < extent < 1 / EXTENT_MOST:
        what = f"the nodes span {extent:.3g} m, of which no volume can be computed"
        return none, [Problem(what, "check the unit of length: coordinates are in metres")]
    return nodes, []


def convert_elements(raw: Any) -> tuple[Integers, list[Problem]]:
    """Elements (m, 4) as int64, a copy; whole numbers held as float are accepted."""
    remedy = "give elements as an array (m, 4) of whole numbers, the nodes of each, counted from 0"
    none = np.zeros((0, 4), np.int64)
    array = convert_array(raw, "the elements are", "iuf", "whole", remedy)
    if isinstance(array, Problem):
        return none, [array]
    if array.size == 0:
        return none, [Problem("there are no tetrahedra", remedy)]
    if array.ndim != 2 or array.shape[1] != 4:
        hint = "give elements.T" if array.ndim == 2 and array.shape[0] == 4 else remedy
        if array.ndim == 2 and array.shape[1] == 10:
            hint = "QDEM's meshes are linear, of quadratic bodies too: take elements[:, :4]"
        return none, [Problem(f"the elements have the shape {array.shape}, not (m, 4)", hint)]
    if array.dtype.kind != "i":
        # Every index that a float or an unsigned integer may exceed is out of range anyway.
        broken = ~(np.abs(array.astype(np.float64)) < 2.0**53) | (array != np.floor(array))
        bad = np.flatnonzero(broken.any(axis=1))
        if len(bad):
            text = name_elements("no whole numbers", bad, f"names {array[bad[0]].tolist()}")
            return none, [Problem(text, remedy)]
    return np.array(array, dtype=np.int64, order="C"), []


def convert_sets(
    sets: dict[str, Any], kind: str, count: int
) -> tuple[dict[str, Integers], list[Problem]]:
    """Sets of nodes or elements as sorted int64 without repeats; a bool mask is accepted."""
    remedy = f"name each {kind} of the set by its number, counted from 0"
    taken: dict[str, Integers] = {}
    problems: list[Problem] = []
    for name, raw in sets.items():
        array = convert_array(raw, f"the {kind} set '{name}' is", "iub", "whole", remedy)
        if not isinstance(array, Problem) and array.dtype.kind == "b" and array.shape == (count,):
            array = np.flatnonzero(array)
        if isinstance(array, Problem):
            problems.append(array)
        elif array.size and (array.ndim != 1 or array.dtype.kind == "b"):
            text = f"the {kind} set '{name}' is {array.dtype} of shape {array.shape}"
            problems.append(Problem(text, remedy))
        elif ((array < 0) | (array >= count)).any():
            out = array[(array < 0) | (array >= count)][0]
            text = f"the {kind} set '{name}' names {kind} {out}, but there are {count}"
            problems.append(Problem(text, remedy))
        else:
            taken[str(name)] = np.unique(array).astype(np.int64)
    return taken, problems


def find_index_problems(elements: Integers, n_nodes: int) -> tuple[BoolArray, list[Problem]]:
    """Which elements name four different nodes of the mesh (m,), and what is wrong with others."""
    problems = []
    # Seen as unsigned, a negative number is larger than any count.
    out = (elements.view(np.uint64) >= np.uint64(n_nodes)).any(axis=1)
    bad = np.flatnonzero(out)
    if len(bad):
        what = f"indices out of range, as there are {n_nodes} nodes"
        text = name_elements(what, bad, f"names nodes {elements[bad[0]].tolist()}")
        one = elements.min() == 1 and elements.max() == n_nodes
        problems.append(Problem(text, "subtract 1: " * bool(one) + "nodes count from 0"))
    twice = (np.diff(np.sort(elements, axis=1), axis=1) == 0).any(axis=1)
    bad = np.flatnonzero(twice)
    if len(bad):
        row = elements[bad[0]].tolist()
        text = name_elements("a node named twice by one element", bad, f"names {row}")
        problems.append(Problem(text, "remove the elements that collapsed, and mesh again there"))
    return ~(out | twice), problems


def find_repeated_elements(elements: Integers, usable: BoolArray) -> list[Problem]:
    """Usable elements of the same four nodes, in whatever order they name them."""
    numbers = np.flatnonzero(usable)
    rows = np.sort(elements[numbers], axis=1)
    _, first, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    lead = first[same.reshape(-1)]
    again = np.flatnonzero(lead != np.arange(len(rows)))
    if not len(again):
        return []
    bad = numbers[again]
    repeated = f"repeats element {numbers[lead[again[0]]]}"
    text = name_elements("the same four nodes as an earlier element", bad, repeated)
    return [Problem(text, "keep one of the elements that repeat")]


def find_flat_elements(
    nodes: Floats, elements: Integers, usable: BoolArray
) -> tuple[Floats, list[Problem]]:
    """Signed volume (m,) [m^3] of the usable elements, and those with none worth the name.

    Flat is a volume at or below `FLAT` of the cube of the longest edge, or below what the
    rounding of the coordinates leaves open, four units in their last place.
    """
    volume, shape, noise = np.full((3, len(elements)), np.nan)
    x = np.ascontiguousarray(nodes[elements[usable]].transpose(1, 2, 0))
    with np.errstate(all="ignore"):  # beyond the range of a float: the caller finds it
        e = x[1:] - x[0]
        others = (e[1] - e[0], e[2] - e[0], e[2] - e[1])
        longest = np.sqrt(np.max([(v * v).sum(axis=0) for v in (*e, *others)], axis=0))
        volume[usable] = (e[0] * np.cross(e[1], e[2], axis=0)).sum(axis=0) / 6
        shape[usable] = volume[usable] / longest**3
        farthest = np.abs(x).max(axis=(0, 1), initial=0.0)
        noise[usable] = 4 * np.finfo(np.float64).eps * farthest / longest
    tiny = np.finfo(np.float64).tiny
    sound = np.isfinite(volume) & (np.abs(volume) >= tiny)
    sound &= np.abs(shape) > np.maximum(FLAT, noise)
    bad = np.flatnonzero(usable & ~sound)
    if len(bad) == 0:
        return volume, []
    at = bad[0]
    measured = (
        f"of nodes {elements[at].tolist()} has {volume[at]:.3g} m^3, {abs(shape[at]):.1e} of the "
        f"cube of its longest edge (at least {np.fmax(FLAT, noise[at]):.0e} is needed)"
    )
    text = name_elements("no volume", bad, measured)
    return volume, [Problem(text, "remove the flat elements or mesh again there")]


def name_some(kind: str, indices: Integers) -> str:
    """`elements 3, 8, 9, 12, 40 and 7 more`."""
    shown = ", ".join(str(index) for index in indices[:_SHOWN])
    more = f" and {len(indices) - _SHOWN} more" if len(indices) > _SHOWN else ""
    return f"{kind}{'s' if len(indices) > 1 else ''} {shown}{more}"


def name_elements(what: str, bad: Integers, first: str) -> str:
    """``what`` is wrong with which elements, and in words what the ``first`` of them has."""
    return f"{what}: {name_some('element', bad)}; element {bad[0]} {first}"


def find_doubts(nodes: Floats, elements: Integers, gradients: Floats) -> Iterator[str]:
    """A sentence for each: parts, doubled nodes, overlapping elements.

    ``gradients`` (m, 3, 3) [1/m] of the right-handed elements.
    """
    count, n = len(elements), len(nodes)
    face = np.sort(elements[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    _, edge = np.unique(face[:, 0] * n + face[:, 1], return_inverse=True)
    _, face_of = np.unique(edge * n + face[:, 2], return_inverse=True)
    owner = np.repeat(np.arange(count), 4)
    size = count + int(face_of.max()) + 1
    graph = coo_matrix((np.ones(4 * count), (owner, count + face_of)), shape=(size, size))
    parts, part = connected_components(graph, directed=False)
    used = np.unique(elements)
    reach = SAME_PLACE * float(np.ptp(nodes[used], axis=0).max())
    twins = cKDTree(nodes[used]).query_pairs(reach, output_type="ndarray")
    seam = f"; at the place of another node: {name_some('node', used[twins[:, 0]])}"
    seam *= bool(len(twins))
    if parts > 1:
        sizes = np.sort(np.bincount(part[:count]))[::-1]
        shown = ", ".join(map(str, sizes[:4])) + ", ..." * (parts > 4)
        yield (
            f"it falls into {parts} parts of {shown} elements that share no face: what holds or "
            f"loads one does nothing to the others{seam}; merge the nodes of a seam, or make each "
            "part a body"
        )
    elif seam:
        yield f"{seam[2:]}; if this is no crack, merge them"
    middle = nodes[elements].mean(axis=1)
    near = cKDTree(middle).query(middle, min(NEIGHBOURS, count))[1].reshape(count, -1)
    inside = np.zeros(count, bool)
    for other in near.T:
        share = np.einsum("mai,mi->ma", gradients[other], middle - nodes[elements[other, 0]])
        within = (share > SAME_PLACE).all(axis=1) & (share.sum(axis=1) < 1 - SAME_PLACE)
        inside |= within & (other != np.arange(count))
    if inside.any():
        shown = name_some("element", np.flatnonzero(inside))
        yield f"it overlaps and counts mass twice: inside other elements are {shown}"
