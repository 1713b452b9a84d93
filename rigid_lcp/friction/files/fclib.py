"""Friction problems of FCLIB (HDF5).

Acary et al., FCLIB: a collection of discrete 3D frictional contact problems, Inria RT-0444 (2014).
``fclib_local`` has spacedim, vectors/q, vectors/mu and W by its parts m, n, nz, p, i, x; nz = -1
are compressed columns, -2 compressed rows, and nz >= 0 that many triplets, i their rows and p their
columns, as CSparse has them and the library's own files (its header says the other way round: H,
which is not square, fits only so).  ``fclib_global`` has M, H, vectors/f, vectors/w instead:
``M v = H r + f``, ``u = H^T v + w``, the same problem by ``W = H^T M^-1 H`` and
``q = w + H^T M^-1 f``; where M is made of one block a body, the bodies are known, ``J = H^T``.
Order of contacts and signs are ours.  Rolling friction (spacedim 5) and equality constraints
(V, R; G) are refused.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import LibraryMissing, ProblemError
from rigid_lcp.friction.files.damaged import (
    describe_damage,
    name_missing_part,
    refuse_damage,
    refuse_unused_parts,
    take_whole_number,
)
from rigid_lcp.friction.problem import BODY_SIZE, BodySpace, FrictionProblem, make_problem
from rigid_lcp.sparse import find_diagonal_blocks, split_csr

PARTS = {"fclib_local": (("W",), ("q", "mu")), "fclib_global": (("M", "H"), ("f", "w", "mu"))}
"""Matrices and vectors of a problem, by its group."""


def read_fclib_problem(path: Path) -> FrictionProblem:
    """The problem of a file.  Raises `ProblemError`, and `LibraryMissing` without h5py."""
    with _open_fclib(path) as file:
        kinds = [kind for kind in PARTS if kind in file]
        if len(kinds) != 1:
            raise ProblemError(
                f"it has {'both groups' if kinds else 'no group'} fclib_local or fclib_global",
                where=str(path), remedy="give one problem of FCLIB in a file",
            )  # fmt: skip
        kind, group = kinds[0], file[kinds[0]]
        if any(name in group for name in ("V", "R", "G")):
            raise ProblemError(
                "it has equality constraints (V, R or G) beside its contacts", where=str(path),
                remedy="eliminate them first: W - V R^-1 V^T, q - V R^-1 s",
            )  # fmt: skip
        dim = take_whole_number(_read_numbers(group, "spacedim", path), f"{path}: spacedim")
        if dim == 5:
            raise ProblemError(
                "it has rolling friction (spacedim 5)", where=str(path),
                remedy="only sliding friction is known: spacedim 2 or 3",
            )  # fmt: skip
        names, vectors = PARTS[kind]
        matrices = [_read_fclib_matrix(group, name, path) for name in names]
        given = [_read_numbers(group, f"vectors/{name}", path).ravel() for name in vectors]
        parts = {*group, *group["vectors"]}
        refuse_unused_parts(path, parts - {"spacedim", "vectors", "info", *names, *vectors})
    with describe_damage(path):
        if kind == "fclib_global":
            return build_global_problem(matrices[0], matrices[1], given[0], given[1], given[2], dim)
        problem: FrictionProblem = make_problem(matrices[0], given[0], given[1], dim)
    return problem


def read_fclib_forces(path: Path) -> Floats:
    """Its solution, (1, nc * dim), or none (0, nc * dim).  Raises as `read_fclib_problem`."""
    with _open_fclib(path) as file:
        name = "fclib_global/vectors/w" if "fclib_global" in file else "fclib_local/vectors/q"
        q = _read_numbers(file, name, path)
        if "solution" not in file:
            return np.zeros((0, q.size))
        forces = _read_numbers(file, "solution/r", path)
    if forces.size != q.size:
        raise ProblemError(
            f"it has {forces.size} numbers where q has {q.size}", where=f"{path}: solution/r",
            remedy="look whether the solution is that of this problem",
        )  # fmt: skip
    return np.asarray(forces, dtype=float).reshape(1, -1)


@contextmanager
def _open_fclib(path: Path) -> Iterator[Any]:
    try:
        import h5py  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise LibraryMissing(
            "HDF5 files are read by h5py, which is not installed", where=str(path),
            remedy="pip install h5py",
        ) from error  # fmt: skip
    remedy = "fetch it again; a few lines of text stand for a file that Git LFS keeps"
    with refuse_damage("it can not be read as HDF5", str(path), remedy):
        file = h5py.File(path, "r")
    # h5py opens a file whose inside is damaged
    with refuse_damage("a part of it can not be read", str(path), "fetch it again"), file:
        yield file


def _read_numbers(group: Any, name: str, path: Path) -> NDArray[Any]:
    """A data set as an array of numbers."""
    if name not in group:
        raise name_missing_part(path, f"{group.name.rstrip('/')}/{name}".lstrip("/"), sorted(group))
    where, remedy = f"{path}: {name}", "write the file again"
    with refuse_damage("it can not be read", where, remedy):
        values = np.asarray(group[name])
    if values.dtype.kind not in "iuf" or not values.size:
        raise ProblemError("it is not made of numbers", where=where, remedy=remedy)
    return values


def _read_fclib_matrix(kind: Any, name: str, path: Path) -> sp.csr_array:
    """A matrix from m, n, nz, p, i, x."""
    if name not in kind:
        raise name_missing_part(path, f"{kind.name.strip('/')}/{name}", sorted(kind))
    group = kind[name]
    m, n, nz = (int(_read_numbers(group, name, path).ravel()[0]) for name in ("m", "n", "nz"))
    p, i, x = (_read_numbers(group, name, path).ravel() for name in ("p", "i", "x"))
    where, remedy = f"{path}: {group.name.strip('/')}", "fetch or write the file again"
    with refuse_damage("its m, n, nz, p, i and x are no matrix", where, remedy):
        if nz == -2:
            matrix = sp.csr_array((x, i, p), shape=(m, n))
        elif nz == -1:
            matrix = sp.csc_array((x, i, p), shape=(m, n))
        elif nz >= 0:
            matrix = sp.coo_array((x[:nz], (i[:nz], p[:nz])), shape=(m, n))
        else:
            raise ValueError(f"nz = {nz} is none of -2 (rows), -1 (columns), >= 0 (triplets)")
        if nz < 0:
            matrix.check_format(full_check=True)
        used = nz if nz >= 0 else int(p[-1])
        if x[used:].any():
            raise ValueError(f"x has {x.size} numbers, of which it says that {used} are used")
        return sp.csr_array(matrix)


def build_global_problem(
    mass: sp.csr_array, directions: sp.csr_array, force: Floats, velocity: Floats, mu: Floats,
    dim: int,
) -> FrictionProblem:  # fmt: skip
    """The problem of M (ndof, ndof), H (ndof, nc * dim), f (ndof,), w (nc * dim,) and mu (nc,).

    Raises `ProblemError` where sizes do not fit or M is singular.
    """
    freedoms, rows = directions.shape
    if mass.shape != (freedoms, freedoms) or force.shape != (freedoms,):
        raise ProblemError(
            f"M is {mass.shape[0]} x {mass.shape[1]} and f has {force.size} numbers for "
            f"{freedoms} freedoms (rows of H)", where="M, f",
            remedy="give a row of M and a number of f for every row of H",
        )  # fmt: skip
    if velocity.shape != (rows,):
        raise ProblemError(
            f"w has {velocity.size} numbers for {rows} columns of H", where="w",
            remedy="give a number for every column of H",
        )  # fmt: skip
    jacobian = sp.csr_array(directions.T)
    size = BODY_SIZE[dim] if dim in BODY_SIZE and is_block_diagonal(mass, BODY_SIZE[dim]) else 0
    try:
        if size:
            inverse = invert_masses(mass, size)
            matrix, moved = BodySpace(jacobian, inverse, size), inverse @ force
        else:
            factor = splu(sp.csc_array(mass))
            spread = sp.csr_array(factor.solve(directions.toarray()))
            matrix, moved = sp.csr_array(jacobian @ spread), factor.solve(force)
    except (RuntimeError, ValueError, np.linalg.LinAlgError) as error:
        raise ProblemError(
            f"M can not be inverted: {error}", where="M",
            remedy="look for a body without mass or moment of inertia",
        ) from error  # fmt: skip
    return make_problem(matrix, velocity + jacobian @ moved, mu, dim)


def is_block_diagonal(mass: sp.csr_array, size: int) -> bool:
    """Whether M (ndof, ndof) has nothing beside one block of ``size`` freedoms a body."""
    places = mass.tocoo()
    row, column = places.row[places.data != 0.0], places.col[places.data != 0.0]
    return mass.shape[0] % size == 0 and bool((row // size == column // size).all())


def invert_masses(mass: sp.csr_array, size: int) -> sp.csr_array:
    """M^-1 block by block.  Raises LinAlgError where one is singular."""
    blocks = find_diagonal_blocks(*split_csr(mass), size)
    number = np.arange(len(blocks))
    rows = (np.linalg.inv(blocks), number, np.arange(len(blocks) + 1))
    inverse = sp.csr_array(sp.bsr_array(rows, shape=mass.shape))
    inverse.eliminate_zeros()
    return inverse
