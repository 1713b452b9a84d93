"""Friction problems in files: scipy's npz pairs, FCLIB's HDF5 and Siconos's text files.

    problem = read_problem("discs_125.npz")              # q, mu, dim; W or its factors beside it
    problem = read_problem("KaplasTower-i1061-4.hdf5")   # fclib_local, fclib_global
    problem = read_problem("RockPile_tob1.dat")          # text of Siconos

npz: ``NAME.npz`` holds q (nc * dim,), mu (nc,) and, if their lengths do not show it, dim.
W is an array W in the same file, or else ``NAME_W.npz`` of `scipy.sparse.save_npz`; a problem that
knows its bodies has J (nc * dim, ndof) as ``NAME_H.npz`` and the diagonal of M^-1, Minv (ndof,).

Files that end in ``.hdf5`` or ``.h5`` are read by `rigid_lcp.friction.files.fclib`, those in
``.dat`` by `rigid_lcp.friction.files.siconos`.
"""

import warnings
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.files.damaged import (
    describe_damage,
    name_missing_part,
    refuse_damage,
    take_whole_number,
)
from rigid_lcp.friction.files.fclib import read_fclib_forces, read_fclib_problem
from rigid_lcp.friction.files.siconos import read_siconos_problem
from rigid_lcp.friction.problem import BODY_SIZE, BodySpace, FrictionProblem, make_problem
from trackbed.memory import read_arrays
from trackbed.plausible import describe_implausible
from trackbed.run_files import replace_file

NPZ_ARRAYS = frozenset({"q", "mu", "dim", "W", "Minv", "r", "u", "vfree", "b", "h"})
"""What a file may hold; r and u are a solution, vfree velocities that q was made of, b and h of a
`rigid_lcp.motion.StepProblem`."""
SAME_MATRIX = 1e-8
"""W and its factors, both stored, differ by less than this share of the largest entry of W."""


def read_problem(path: Path | str) -> FrictionProblem:
    """The friction problem of a file, ``.npz``, ``.hdf5``, ``.h5`` or ``.dat``.

    Raises `ProblemError`, which names the file, the part of it and what is wrong with it, and
    `LibraryMissing` for HDF5 without h5py.
    """
    problem = _choose_readers(path)[0](Path(path))
    most = float(problem.friction.max(initial=0.0))
    if said := describe_implausible("friction", most, f"{path}: mu"):
        warnings.warn(said, stacklevel=2)
    return problem


def read_forces(path: Path | str) -> Floats:
    """The solutions that a file brings along, (number, nc * dim), force or impulse; maybe none.

    npz: array r, one solution or a row each; FCLIB: solution/r; text has none.  Raises as
    `read_problem`.
    """
    return _choose_readers(path)[1](Path(path))


def write_problem(path: Path | str, problem: FrictionProblem, **more: Floats) -> list[Path]:
    """Write q, mu, dim and ``more`` as ``NAME.npz``, W as ``NAME_W.npz``; the two files.

    Raises `ProblemError` for another ending, and where ``NAME_H.npz`` would be read for W's factor;
    `trackbed.errors.UsageError` where they can not be written.
    """
    path = Path(path)
    beside, factor = (path.with_name(f"{path.stem}_{name}.npz") for name in ("W", "H"))
    if path.suffix != ".npz" or factor.exists():
        raise ProblemError(
            f"{factor.name} beside it belongs to another problem" if factor.exists()
            else "it is no name of an npz file", where=str(path), remedy="give another name.npz",
        )  # fmt: skip
    with replace_file(beside) as temporary, temporary.open("wb") as stream:
        sp.save_npz(stream, problem.delassus)
    arrays: dict[str, Any] = {"q": problem.offset, "mu": problem.friction, **more}
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, dim=problem.dim, **arrays)
    return [path, beside]


def _choose_readers(
    given: Path | str,
) -> tuple[Callable[[Path], FrictionProblem], Callable[[Path], Floats]]:
    if not isinstance(given, str | PathLike):
        raise ProblemError(f"the path is {given!r}", remedy="name a file")
    path = Path(given)
    readers = {
        ".npz": (_read_npz_problem, _read_npz_forces),
        ".hdf5": (read_fclib_problem, read_fclib_forces),
        ".h5": (read_fclib_problem, read_fclib_forces),
        ".dat": (read_siconos_problem, _read_no_forces),
    }
    if path.suffix not in readers:
        raise ProblemError(
            f"files that end in {path.suffix or 'nothing'} are not known", where=str(path),
            remedy=f"give one of {', '.join(readers)}",
        )  # fmt: skip
    if not path.is_file():
        raise ProblemError(
            "there is no such file", where=str(path), remedy="look at the path and the ending"
        )
    return readers[path.suffix]


def _read_no_forces(path: Path) -> Floats:
    return np.zeros((0, read_siconos_problem(path).offset.size))


# --- npz --------------------------------------------------------------------------------------


def _read_npz_problem(path: Path) -> FrictionProblem:
    parts = _read_npz_arrays(path)
    for name in ("q", "mu"):
        if name not in parts:
            raise name_missing_part(path, name, sorted(parts))
    if unused := sorted(set(parts) - NPZ_ARRAYS):
        warnings.warn(f"{path}: not used: {', '.join(unused)}", stacklevel=4)
    q, mu = parts["q"], parts["mu"]
    if "dim" in parts:
        dim = take_whole_number(parts["dim"], f"{path}: dim")
    else:
        dim = q.size // mu.size if mu.ndim == 1 and mu.size else 0
    factor = path.with_name(f"{path.stem}_H.npz")
    with describe_damage(path):
        if factor.is_file():
            bodies = _read_npz_bodies(path, parts, factor, dim)
            problem: FrictionProblem = make_problem(bodies, q, mu, dim)
            _check_same(problem, path, parts)
        else:
            problem = make_problem(_read_npz_matrix(path, parts), q, mu, dim)
    return problem


def _read_npz_forces(path: Path) -> Floats:
    parts = _read_npz_arrays(path)
    length = parts["q"].size if "q" in parts else 0
    if "r" not in parts:
        return np.zeros((0, length))
    forces = np.atleast_2d(parts["r"])
    if forces.shape[1] != length or forces.dtype.kind != "f":
        raise ProblemError(
            f"it has shape {forces.shape} where q has {length} numbers", where=f"{path}: r",
            remedy="give forces (nc * dim,), or several solutions (k, nc * dim)",
        )  # fmt: skip
    return forces


def _read_npz_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a file."""
    remedy = "write it again with numpy.savez, numbers only; the file may be cut short"
    with refuse_damage("it can not be read as npz", str(path), remedy):
        return read_arrays(path)


def _read_npz_matrix(path: Path, parts: dict[str, NDArray[Any]]) -> Any:
    """W, dense in the file itself or sparse beside it."""
    beside = path.with_name(f"{path.stem}_W.npz")
    if "W" not in parts:
        return _read_npz_sparse(beside)
    if beside.is_file():
        raise ProblemError(
            f"W is an array of this file, and of {beside.name} too", where=f"{path}: W",
            remedy="remove the one that does not belong to this problem",
        )  # fmt: skip
    return parts["W"]


def _read_npz_sparse(path: Path) -> sp.csr_array:
    if not path.is_file():
        raise ProblemError(
            "it is not there, and the problem has no array W", where=path.name,
            remedy="write W beside it with scipy.sparse.save_npz",
        )  # fmt: skip
    remedy = "write it again with scipy.sparse.save_npz"
    with refuse_damage("it can not be read as a sparse matrix", path.name, remedy):
        with path.open("rb") as stream:  # numpy leaves a broken file open that it opened itself
            matrix = sp.csr_array(sp.load_npz(stream))
        matrix.check_format(full_check=True)
    return matrix


def _read_npz_bodies(
    path: Path, parts: dict[str, NDArray[Any]], factor: Path, dim: int
) -> BodySpace:
    """The factors J and M^-1 of W."""
    jacobian = _read_npz_sparse(factor)
    if "Minv" not in parts:
        raise name_missing_part(
            path, "Minv", sorted(parts), f"{factor.name} needs the masses beside it"
        )
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


def _check_same(problem: FrictionProblem, path: Path, parts: dict[str, NDArray[Any]]) -> None:
    """W, where it is stored too, must be that of the factors."""
    if "W" not in parts and not path.with_name(f"{path.stem}_W.npz").is_file():
        return
    stored = sp.csr_array(_read_npz_matrix(path, parts))
    made = problem.delassus
    largest = float(abs(made.data).max(initial=0.0)) or 1.0
    apart = np.inf
    if stored.shape == made.shape:
        apart = float(abs(sp.csr_array(stored - made).data).max(initial=0.0)) / largest
    if apart > SAME_MATRIX:
        raise ProblemError(
            f"W is not J M^-1 J^T (they differ by {apart:.1g} of its largest entry)", where="W",
            remedy=f"remove {path.stem}_W.npz or {path.stem}_H.npz, whichever is the wrong one",
        )  # fmt: skip
