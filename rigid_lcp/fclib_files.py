"""Friction problems of FCLIB (HDF5).

Acary et al., FCLIB: a collection of discrete 3D frictional contact problems, Inria RT-0444 (2014).
``fclib_local`` has spacedim, vectors/q, vectors/mu and W by its parts m, n, nz, p, i, x; nz = -1
are compressed columns, -2 compressed rows, and nz >= 0 that many triplets, p their rows and i their
columns (fclib.h).  Order of contacts and signs are ours.  Rolling friction (spacedim 5), equality
constraints (V, R) and problems by M and H (``fclib_global``) are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.damaged_files import DAMAGED, part_lacking, problem_named
from rigid_lcp.errors import LibraryMissing, ProblemError
from rigid_lcp.friction_problem import FrictionProblem, friction_problem

Floats = NDArray[np.float64]


def fclib_problem(path: Path) -> FrictionProblem:
    """The problem of a file.  Raises `ProblemError`, and `LibraryMissing` without h5py."""
    with _fclib_file(path) as file:
        if "fclib_local" not in file:
            raise ProblemError(
                "it has no group fclib_local" + (
                    ", but a problem by masses (fclib_global)" if "fclib_global" in file else ""
                ),
                where=str(path), remedy="give a problem in W, q and mu",
            )  # fmt: skip
        local = file["fclib_local"]
        if "V" in local or "R" in local:
            raise ProblemError(
                "it has equality constraints (V, R) beside its contacts", where=str(path),
                remedy="eliminate them first: W - V R^-1 V^T, q - V R^-1 s",
            )  # fmt: skip
        dim = int(_numbers(local, "spacedim", path).ravel()[0])
        if dim == 5:
            raise ProblemError(
                "it has rolling friction (spacedim 5)", where=str(path),
                remedy="only sliding friction is known: spacedim 2 or 3",
            )  # fmt: skip
        if "W" not in local:
            raise part_lacking(path, "fclib_local/W", sorted(local))
        matrix = _fclib_matrix(local["W"], path)
        q, mu = (_numbers(local, f"vectors/{name}", path) for name in ("q", "mu"))
    with problem_named(path):
        problem: FrictionProblem = friction_problem(matrix, q, mu, dim)
    return problem


def fclib_forces(path: Path) -> Floats:
    """Its solution, (1, nc * dim), or none (0, nc * dim).  Raises as `fclib_problem`."""
    with _fclib_file(path) as file:
        q = _numbers(file, "fclib_local/vectors/q", path)
        if "solution" not in file:
            return np.zeros((0, q.size))
        forces = _numbers(file, "solution/r", path)
    if forces.size != q.size:
        raise ProblemError(
            f"it has {forces.size} numbers where q has {q.size}", where=f"{path}: solution/r"
        )
    return np.asarray(forces, dtype=float).reshape(1, -1)


@contextmanager
def _fclib_file(path: Path) -> Iterator[Any]:
    try:
        import h5py  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise LibraryMissing(
            "HDF5 files are read by h5py, which is not installed", where=str(path),
            remedy="pip install h5py",
        ) from error  # fmt: skip
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ProblemError(
            f"it can not be read as HDF5: {error}", where=str(path),
            remedy="fetch it again; a few lines of text stand for a file that Git LFS keeps",
        ) from error  # fmt: skip
    try:
        with file:
            yield file
    except DAMAGED as error:  # h5py opens a file whose inside is damaged
        raise ProblemError(
            f"a part of it can not be read: {error}", where=str(path), remedy="fetch it again"
        ) from error


def _numbers(group: Any, name: str, path: Path) -> NDArray[Any]:
    """A data set as an array of numbers."""
    if name not in group:
        raise part_lacking(path, f"{group.name.rstrip('/')}/{name}".lstrip("/"), sorted(group))
    try:
        values = np.asarray(group[name])
    except (OSError, ValueError, TypeError) as error:
        raise ProblemError(f"it can not be read: {error}", where=f"{path}: {name}") from error
    if values.dtype.kind not in "iuf" or not values.size:
        raise ProblemError("it is not made of numbers", where=f"{path}: {name}")
    return values


def _fclib_matrix(group: Any, path: Path) -> sp.csr_array:
    """W from m, n, nz, p, i, x."""
    m, n, nz = (int(_numbers(group, name, path).ravel()[0]) for name in ("m", "n", "nz"))
    p, i, x = (_numbers(group, name, path).ravel() for name in ("p", "i", "x"))
    try:
        if nz == -2:
            matrix = sp.csr_array((x, i, p), shape=(m, n))
        elif nz == -1:
            matrix = sp.csc_array((x, i, p), shape=(m, n))
        elif nz >= 0:
            matrix = sp.coo_array((x[:nz], (p[:nz], i[:nz])), shape=(m, n))
        else:
            raise ValueError(f"nz = {nz} is none of -2 (rows), -1 (columns), >= 0 (triplets)")
        if nz < 0:
            matrix.check_format(full_check=True)
        return sp.csr_array(matrix)
    except (ValueError, IndexError) as error:
        raise ProblemError(
            f"its m, n, nz, p, i and x are no matrix: {error}", where=f"{path}: fclib_local/W",
            remedy="fetch or write the file again",
        ) from error  # fmt: skip
