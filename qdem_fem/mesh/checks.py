"""What a mesh must obey, each rule a function that returns the problems it found.

All problems of a mesh are collected before one error names them, so that a user mends a file
once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from qdem_fem.files import MeshError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

FLAT = 1e-12
"""Volume over the cube of the longest edge at and below which an element counts as flat; a
regular tetrahedron has 0.118.  Round-off of the volume itself is about 1e-16."""
EXTENT_MOST = 1e100
"""Largest extent of a mesh [m], and one over the smallest: volumes stay within float64."""
_ELEMENTS_AT_ONCE = 1 << 16
_SHOWN = 5


class Problem(NamedTuple):
    """One thing wrong with a mesh."""

    what: str
    remedy: str


def raise_problems(problems: list[Problem], where: str) -> None:
    """Raise one `MeshError` that names all problems, if there are any."""
    if not problems:
        return
    listed = "".join(f"\n  {number}. {p.what}" for number, p in enumerate(problems, 1))
    raise MeshError(
        problems[0].what
        if len(problems) == 1
        else f"{len(problems)} problems with this mesh:{listed}",
        where=where,
        remedy="; ".join(dict.fromkeys(p.remedy for p in problems)),
    )


def take_nodes(raw: Any) -> tuple[FloatArray, list[Problem]]:
    """Coordinates (n, 3) [m] as float64, a copy; every other shape or type is a problem."""
    remedy = "give nodes as an array (n, 3) of coordinates in metres"
    none = np.zeros((0, 3))
    try:
        array = np.asarray(raw)
    except (ValueError, TypeError, OverflowError) as error:
        return none, [Problem(f"the nodes are no array ({error})", remedy)]
    if array.dtype.kind not in "iuf":
        return none, [Problem(f"the nodes are no real numbers but of type {array.dtype}", remedy)]
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "give nodes.T" if array.ndim == 2 and array.shape[0] == 3 else remedy
        return none, [Problem(f"the nodes have the shape {array.shape}, not (n, 3)", hint)]
    with np.errstate(over="ignore"):
        nodes = np.array(array, dtype=np.float64, order="C")
    bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
    if len(bad):
        at = f"{named('node', bad)}; node {bad[0]} is at {nodes[bad[0]].tolist()}"
        return nodes, [
            Problem(f"coordinates that are not finite: {at}", "mend or remove these nodes")
        ]
    with np.errstate(over="ignore"):
        extent = float(np.ptp(nodes, axis=0).max()) if len(nodes) else 1.0
    if extent > EXTENT_MOST or 0 < extent < 1 / EXTENT_MOST:
        what = f"the nodes span {extent:.3g} m, of which no volume can be computed"
        return none, [Problem(what, "check the unit of length: coordinates are in metres")]
    return nodes, []


def take_elements(raw: Any) -> tuple[IntArray, list[Problem]]:
    """Elements (m, 4) as int64, a copy; whole numbers held as float are accepted."""
    remedy = "give elements as an array (m, 4) of whole numbers, the nodes of each, counted from 0"
    none = np.zeros((0, 4), np.int64)
    try:
        array = np.asarray(raw)
    except (ValueError, TypeError, OverflowError) as error:
        return none, [Problem(f"the elements are no array ({error})", remedy)]
    if array.size == 0:
        return none, [Problem("there are no tetrahedra", remedy)]
    if array.dtype.kind not in "iuf":
        text = f"the elements are no whole numbers but of type {array.dtype}"
        return none, [Problem(text, remedy)]
    if array.ndim != 2 or array.shape[1] != 4:
        hint = "give elements.T" if array.ndim == 2 and array.shape[0] == 4 else remedy
        if array.ndim == 2 and array.shape[1] == 10:
            hint = "QDEM has linear tetrahedra only; elements[:, :4] keeps the corners"
        return none, [Problem(f"the elements have the shape {array.shape}, not (m, 4)", hint)]
    if array.dtype.kind != "i":
        # Every index that a float or an unsigned integer may exceed is out of range anyway.
        broken = ~(np.abs(array.astype(np.float64)) < 2.0**53) | (array != np.floor(array))
        bad = np.flatnonzero(broken.any(axis=1))
        if len(bad):
            row = array[bad[0]].tolist()
            text = f"no whole numbers in {named('element', bad)}; element {bad[0]} names {row}"
            return none, [Problem(text, remedy)]
    return np.array(array, dtype=np.int64, order="C"), []


def take_set(raw: Any, kind: str, name: str, count: int) -> tuple[IntArray, list[Problem]]:
    """A set of nodes or elements as sorted int64 without repeats; a bool mask is accepted."""
    remedy = f"name each {kind} of the set by its number, counted from 0"
    none = np.zeros(0, np.int64)
    try:
        array = np.asarray(raw)
    except (ValueError, TypeError, OverflowError) as error:
        return none, [Problem(f"the {kind} set '{name}' is no array ({error})", remedy)]
    if array.size == 0:
        return none, []
    if array.dtype.kind == "b" and array.shape == (count,):
        return np.flatnonzero(array).astype(np.int64), []
    if array.dtype.kind not in "iu" or array.ndim != 1:
        text = f"the {kind} set '{name}' is {array.dtype} of shape {array.shape}"
        return none, [Problem(text, remedy)]
    out = (array < 0) | (array >= count)
    if out.any():
        text = f"the {kind} set '{name}' names {kind} {array[out][0]}, but there are {count}"
        return none, [Problem(text, remedy)]
    return np.unique(array).astype(np.int64), []


def indices_problems(elements: IntArray, n_nodes: int) -> tuple[BoolArray, list[Problem]]:
    """Which elements name four different nodes of the mesh (m,), and what is wrong with others."""
    problems = []
    # Seen as unsigned, a negative number is larger than any count.
    out = (elements.view(np.uint64) >= np.uint64(n_nodes)).any(axis=1)
    bad = np.flatnonzero(out)
    if len(bad):
        row = elements[bad[0]].tolist()
        text = (
            f"indices out of range, as there are {n_nodes} nodes: {named('element', bad)}; "
            f"element {bad[0]} names nodes {row}"
        )
        one = elements.min() == 1 and elements.max() == n_nodes
        problems.append(
            Problem(text, "subtract 1: nodes count from 0" if one else "nodes count from 0")
        )
    a, b, c, d = elements.T
    twice = (a == b) | (a == c) | (a == d) | (b == c) | (b == d) | (c == d)
    bad = np.flatnonzero(twice)
    if len(bad):
        text = (
            f"a node named twice by one element: {named('element', bad)}; "
            f"element {bad[0]} names {elements[bad[0]].tolist()}"
        )
        problems.append(Problem(text, "remove the elements that collapsed, and mesh again there"))
    return ~(out | twice), problems


def duplicates_problems(elements: IntArray, usable: BoolArray, n_nodes: int) -> list[Problem]:
    """Usable elements of the same four nodes, in whatever order they name them."""
    numbers = np.flatnonzero(usable)
    if len(numbers) < len(elements):
        elements = elements[numbers]
    # The sum of a random number per node does not depend on the order of the four; elements
    # that agree in it are compared exactly.
    table = np.random.default_rng(0).integers(0, 2**64, n_nodes, dtype=np.uint64)
    key = table[elements[:, 0]]
    for corner in range(1, 4):
        key += table[elements[:, corner]]
    ordered = np.sort(key)
    repeated = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(repeated) == 0:
        return []
    candidates = np.flatnonzero(np.isin(key, repeated))
    rows = np.sort(elements[candidates], axis=1)
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    twin = candidates[first[inverse.reshape(-1)]]
    bad = numbers[candidates[twin != candidates]]
    if len(bad) == 0:
        return []
    same = numbers[twin[twin != candidates][0]]
    text = (
        f"the same four nodes as an earlier element: {named('element', bad)}; "
        f"element {bad[0]} repeats element {same}"
    )
    return [Problem(text, "keep one of the elements that repeat")]


def flat_problems(
    nodes: FloatArray, elements: IntArray, usable: BoolArray
) -> tuple[FloatArray, list[Problem]]:
    """Signed volume (m,) [m^3] of the usable elements, and those with none worth the name.

    Flat is a volume at or below `FLAT` of the cube of the longest edge, or below what the
    rounding of the coordinates leaves open, four units in their last place.
    """
    volume, shape, noise = _volumes(nodes, elements, usable)
    tiny = np.finfo(np.float64).tiny
    sound = np.isfinite(volume) & (np.abs(volume) >= tiny)
    sound &= np.abs(shape) > np.maximum(FLAT, noise)
    bad = np.flatnonzero(usable & ~sound)
    if len(bad) == 0:
        return volume, []
    at = bad[0]
    text = (
        f"no volume: {named('element', bad)}; element {at} of nodes {elements[at].tolist()} has "
        f"{volume[at]:.3g} m^3, {abs(shape[at]):.1e} of the cube of its longest edge "
        f"(at least {np.fmax(FLAT, noise[at]):.0e} is needed)"
    )
    return volume, [Problem(text, "remove the flat elements or mesh again there")]


def _volumes(
    nodes: FloatArray, elements: IntArray, usable: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Signed volume [m^3], the same over longest edge cubed, and that ratio's rounding, (m,)."""
    volume, shape, noise = np.full((3, len(elements)), np.nan)
    for start in range(0, len(elements), _ELEMENTS_AT_ONCE):
        part = start + np.flatnonzero(usable[start : start + _ELEMENTS_AT_ONCE])
        x = np.ascontiguousarray(nodes[elements[part]].transpose(1, 2, 0))
        with np.errstate(all="ignore"):  # beyond the range of a float: the caller finds it
            e = x[1:] - x[0]
            others = (e[1] - e[0], e[2] - e[0], e[2] - e[1])
            longest = np.sqrt(np.max([(v * v).sum(axis=0) for v in (*e, *others)], axis=0))
            sixfold = (e[0] * np.cross(e[1], e[2], axis=0)).sum(axis=0)
            volume[part] = sixfold / 6
            shape[part] = sixfold / 6 / longest**3
            farthest = np.abs(x).max(axis=(0, 1), initial=0.0)
            noise[part] = 4 * np.finfo(np.float64).eps * farthest / longest
    return volume, shape, noise


def named(kind: str, indices: IntArray) -> str:
    """`elements 3, 8, 9, 12, 40 and 7 more`."""
    shown = ", ".join(str(index) for index in indices[:_SHOWN])
    more = f" and {len(indices) - _SHOWN} more" if len(indices) > _SHOWN else ""
    return f"{kind}{'s' if len(indices) > 1 else ''} {shown}{more}"
