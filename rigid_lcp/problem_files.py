"""Friction problems from files: scipy's npz pairs, and the HDF5 files of FCLIB.

    problem = read_problem("discs_125.npz")              # q, mu, dim; W or its factors beside it
    problem = read_problem("KaplasTower-i1061-4.hdf5")   # group fclib_local

npz: ``NAME.npz`` holds q (nc * dim,), mu (nc,) and, if it can not be told from their lengths, dim.
W is an array W in the same file, or ``NAME_W.npz`` of `scipy.sparse.save_npz`; a problem that
knows its bodies has J (nc * dim, ndof) as ``NAME_H.npz`` and the diagonal of M^-1, Minv (ndof,).

FCLIB: Acary et al., FCLIB: a collection of discrete 3D frictional contact problems, Inria RT-0444
(2014).  ``fclib_local`` has spacedim, vectors/q, vectors/mu and W by its parts m, n, nz, p, i, x;
nz = -1 are compressed columns, -2 compressed rows, and nz >= 0 that many triplets, p their rows and
i their columns (fclib.h).  Order of contacts and signs are ours.  Rolling friction (spacedim 5),
equality constraints (V, R) and problems by M and H (``fclib_global``) are refused.
"""

from __future__ import annotations

import lzma
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.errors import LibraryMissing, ProblemError
from rigid_lcp.friction_problem import BodySpace, FrictionProblem, friction_problem

Floats = NDArray[np.float64]
BODY_SIZE = {2: 3, 3: 6}
"""Freedoms of a body by dimension."""
DAMAGED = (
    OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, MemoryError,
    zipfile.BadZipFile, zlib.error, lzma.LZMAError,
)  # fmt: skip
"""What numpy and h5py raise as they read a damaged file: any byte of it may be wrong."""
SAME = 1e-8
"""W and its factors, both stored, differ by less than this share of the largest entry of W."""


def read_problem(path: Path | str) -> FrictionProblem:
    """The friction problem of a file, ``.npz``, ``.hdf5`` or ``.h5``.

    Raises `ProblemError`, which names the file, the part of it and what is wrong with it, and
    `LibraryMissing` for HDF5 without h5py.
    """
    return _reader(Path(path))[0](Path(path))


def read_forces(path: Path | str) -> Floats:
    """The solutions that a file brings along, (number, nc * dim), force or impulse; maybe none.

    npz: array r, one solution or a row each; FCLIB: solution/r.  Raises as `read_problem`.
    """
    return _reader(Path(path))[1](Path(path))


def _reader(path: Path) -> tuple[Callable[[Path], FrictionProblem], Callable[[Path], Floats]]:
    readers = {
        ".npz": (_npz_problem, _npz_forces),
        ".hdf5": (_fclib_problem, _fclib_forces),
        ".h5": (_fclib_problem, _fclib_forces),
    }
    if path.suffix not in readers:
        raise ProblemError(
            f"files that end in {path.suffix or 'nothing'} are not known", where=str(path),
            remedy=f"give one of {', '.join(readers)}",
        )  # fmt: skip
    if not path.is_file():
        raise ProblemError("there is no such file", where=str(path))
    return readers[path.suffix]


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Put the file's name before what the checks of a problem say."""
    try:
        yield
    except ProblemError as error:
        where = f"{path}: {error.where}" if error.where else str(path)
        raise ProblemError(error.what, where=where, remedy=error.remedy) from error


# --- npz --------------------------------------------------------------------------------------


def _npz_problem(path: Path) -> FrictionProblem:
    parts = _npz_arrays(path)
    for name in ("q", "mu"):
        if name not in parts:
            raise _lacking(path, name, sorted(parts))
    q, mu = parts["q"], parts["mu"]
    dim = parts["dim"].item() if "dim" in parts and parts["dim"].ndim == 0 else None
    if dim is None:
        dim = q.size // mu.size if mu.ndim == 1 and mu.size else 0
    factor = path.with_name(f"{path.stem}_H.npz")
    with _named(path):
        if factor.is_file():
            bodies = _npz_bodies(path, parts, factor, dim)
            problem: FrictionProblem = friction_problem(bodies, q, mu, dim)
            _same(problem, path, parts)
        else:
            problem = friction_problem(_npz_matrix(path, parts), q, mu, dim)
    return problem


def _npz_forces(path: Path) -> Floats:
    parts = _npz_arrays(path)
    length = parts["q"].size if "q" in parts else 0
    if "r" not in parts:
        return np.zeros((0, length))
    forces = np.atleast_2d(parts["r"])
    if forces.shape[1] != length or forces.dtype.kind != "f":
        raise ProblemError(
            f"it has shape {forces.shape} where q has {length} numbers", where=f"{path}: r"
        )
    return forces


def _npz_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a file."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except DAMAGED as error:
        raise ProblemError(
            f"it can not be read as npz: {error}", where=str(path),
            remedy="write it again with numpy.savez, numbers only; the file may be cut short",
        ) from error  # fmt: skip


def _npz_matrix(path: Path, parts: dict[str, NDArray[Any]]) -> Any:
    """W, dense in the file itself or sparse beside it."""
    if "W" in parts:
        return parts["W"]
    return _npz_sparse(path.with_name(f"{path.stem}_W.npz"))


def _npz_sparse(path: Path) -> sp.csr_array:
    if not path.is_file():
        raise ProblemError(
            "it is not there, and the problem has no array W", where=path.name,
            remedy="write W beside it with scipy.sparse.save_npz",
        )  # fmt: skip
    try:
        with path.open("rb") as stream:  # numpy leaves a broken file open that it opened itself
            matrix = sp.csr_array(sp.load_npz(stream))
        matrix.check_format(full_check=True)
    except DAMAGED as error:
        raise ProblemError(
            f"it can not be read as a sparse matrix: {error}", where=path.name,
            remedy="write it again with scipy.sparse.save_npz",
        ) from error  # fmt: skip
    return matrix


def _npz_bodies(path: Path, parts: dict[str, NDArray[Any]], factor: Path, dim: int) -> BodySpace:
    """The factors J and M^-1 of W."""
    jacobian = _npz_sparse(factor)
    if "Minv" not in parts:
        raise _lacking(path, "Minv", sorted(parts), f"{factor.name} needs the masses beside it")
    inverse = parts["Minv"]
    size = BODY_SIZE.get(dim, 1)
    if inverse.shape != (jacobian.shape[1],) or len(inverse) % size:
        raise ProblemError(
            f"it has shape {inverse.shape} for {jacobian.shape[1]} freedoms of bodies with {size} "
            f"each", where="Minv", remedy="give the diagonal of M^-1, a number a freedom",
        )  # fmt: skip
    if not (np.isfinite(inverse) & (inverse > 0)).all():
        raise ProblemError(
            "a mass is zero, negative or no number", where="Minv",
            remedy="leave out the columns of bodies that can not move",
        )  # fmt: skip
    return BodySpace(jacobian, sp.csr_array(sp.diags_array(inverse)), size)


def _same(problem: FrictionProblem, path: Path, parts: dict[str, NDArray[Any]]) -> None:
    """W, where it is stored too, must be that of the factors."""
    if "W" not in parts and not path.with_name(f"{path.stem}_W.npz").is_file():
        return
    stored = sp.csr_array(_npz_matrix(path, parts))
    made = problem.delassus
    largest = float(abs(made.data).max(initial=0.0)) or 1.0
    apart = np.inf
    if stored.shape == made.shape:
        apart = float(abs(sp.csr_array(stored - made).data).max(initial=0.0)) / largest
    if apart > SAME:
        raise ProblemError(
            f"W is not J M^-1 J^T (they differ by {apart:.1g} of its largest entry)", where="W",
            remedy=f"remove {path.stem}_W.npz or {path.stem}_H.npz, whichever is the wrong one",
        )  # fmt: skip


def _lacking(path: Path, name: str, have: list[str], why: str = "") -> ProblemError:
    return ProblemError(
        f"it has no {name}" + (f"; {why}" if why else ""), where=str(path),
        remedy=f"it has {', '.join(have) or 'nothing'}; add {name}",
    )  # fmt: skip


# --- FCLIB ------------------------------------------------------------------------------------


def _fclib_problem(path: Path) -> FrictionProblem:
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
            raise _lacking(path, "fclib_local/W", sorted(local))
        matrix = _fclib_matrix(local["W"], path)
        q, mu = (_numbers(local, f"vectors/{name}", path) for name in ("q", "mu"))
    with _named(path):
        problem: FrictionProblem = friction_problem(matrix, q, mu, dim)
    return problem


def _fclib_forces(path: Path) -> Floats:
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
        raise _lacking(path, f"{group.name.rstrip('/')}/{name}".lstrip("/"), sorted(group))
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
