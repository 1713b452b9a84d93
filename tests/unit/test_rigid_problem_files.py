"""Friction problems are read as they were written, and damage is named, one error for each kind."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import LibraryMissing, ProblemError
from rigid_lcp.friction.files.formats import read_forces, read_problem
from rigid_lcp.friction.problem.definition import FrictionProblem

Arrays = dict[str, Any]
FORMATS = {-2: "csr", -1: "csc", 0: "coo"}


def posed(dim: int, contacts: int, seed: int = 0) -> tuple[Any, Any, Any]:
    """W (not symmetric), q and mu of a random problem."""
    generator = np.random.default_rng(seed)
    n = dim * contacts
    dense = np.where(generator.random((n, n)) < 0.4, generator.normal(size=(n, n)), 0.0)
    return sp.csr_array(dense + np.eye(n)), generator.normal(size=n), generator.random(contacts)


def npz_write(path: Path, made_in: int = 2, **changed: Any) -> Path:
    """A pair of files, three contacts; a changed array that is None is left out."""
    w, q, mu = posed(made_in, 3)
    arrays = {"q": q, "mu": mu, "dim": made_in} | changed
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    sp.save_npz(path.with_name(f"{path.stem}_W.npz"), w)
    return path


def fclib_write(path: Path, matrix: Any, q: Any, mu: Any, dim: int, nz: int = -2) -> Path:
    """A file as FCLIB's `fclib_write_local` writes it."""
    import h5py

    stored = matrix.asformat(FORMATS[nz])
    if nz == 0:
        nz, i, p = stored.nnz, *stored.coords  # as CSparse: rows in i
    else:
        p, i = stored.indptr, stored.indices
    with h5py.File(path, "w") as file:
        local = file.create_group("fclib_local")
        local["spacedim"] = np.array([dim], dtype=np.int32)
        numbers = {"nzmax": stored.nnz, "m": matrix.shape[0], "n": matrix.shape[1], "nz": nz}
        for name, value in numbers.items():
            local[f"W/{name}"] = np.array([value], dtype=np.int32)
        local["W/p"], local["W/i"], local["W/x"] = p, i, stored.data
        local["vectors/q"], local["vectors/mu"] = q, mu
    return path


def assert_same(problem: FrictionProblem, w: Any, q: Any, mu: Any, dim: int) -> None:
    """Read back to the last bit."""
    assert problem.dim == dim
    assert (problem.delassus != w).nnz == 0
    assert (problem.offset == q).all()
    assert (problem.friction == mu).all()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("given_dim", [True, False])
def test_npz_pair(tmp_path: Path, dim: int, given_dim: bool) -> None:
    """W beside q and mu; the dimension follows from their lengths where it is not stored."""
    path = npz_write(tmp_path / "one.npz", dim, **({} if given_dim else {"dim": None}))
    assert_same(read_problem(path), *posed(dim, 3), dim)
    assert read_forces(path).shape == (0, 3 * dim)


def test_npz_dense(tmp_path: Path) -> None:
    """W, and solutions, in the same file."""
    w, q, mu = posed(2, 4)
    path = tmp_path / "one.npz"
    forces = np.arange(16.0).reshape(2, 8)
    np.savez(path, W=w.toarray(), q=q, mu=mu, r=forces)
    assert_same(read_problem(str(path)), w, q, mu, 2)
    assert (read_forces(path) == forces).all()


def bodies_write(path: Path, w_wrong: float = 0.0, **changed: Any) -> Path:
    """Two bodies, three contacts, by factors and by W."""
    generator = np.random.default_rng(3)
    jacobian, inverse = generator.normal(size=(6, 6)), generator.uniform(0.5, 2.0, 6)
    arrays = {"q": np.ones(6), "mu": np.full(3, 0.3), "dim": 2, "Minv": inverse} | changed
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    sp.save_npz(path.with_name(f"{path.stem}_H.npz"), sp.csr_array(jacobian))
    w = jacobian @ np.diag(inverse) @ jacobian.T + w_wrong
    sp.save_npz(path.with_name(f"{path.stem}_W.npz"), sp.csc_array(w))
    return path


def test_npz_bodies(tmp_path: Path) -> None:
    """Factors are kept as factors, and are those of W."""
    problem = read_problem(bodies_write(tmp_path / "one.npz"))
    assert problem.bodies is not None
    assert problem.bodies.body_size == 3
    stored = sp.load_npz(tmp_path / "one_W.npz")
    assert abs(problem.delassus - stored).max() < 1e-14 * abs(stored).max()


@given(
    dim=st.sampled_from([2, 3]),
    contacts=st.integers(1, 5),
    nz=st.sampled_from(list(FORMATS)),
    seed=st.integers(0, 10**6),
)
@settings(max_examples=25)
@pytest.mark.peer("h5py")
def test_fclib_every_storage(tmp_path_factory, dim, contacts, nz, seed):
    """Rows, columns and triplets are one matrix, symmetric or not."""
    w, q, mu = posed(dim, contacts, seed)
    path = tmp_path_factory.mktemp("fclib") / "one.hdf5"
    assert_same(read_problem(fclib_write(path, w, q, mu, dim, nz)), w, q, mu, dim)
    assert read_forces(path).shape == (0, len(q))


@pytest.mark.peer("h5py")
def test_fclib_triplets_add_up(tmp_path: Path) -> None:
    """Two triplets of one place are added; zeros beyond nz are room that was not needed."""
    import h5py

    path = fclib_write(tmp_path / "one.h5", sp.eye_array(2), np.ones(2), np.ones(1), 2, nz=0)
    with h5py.File(path, "r+") as file:
        w = file["fclib_local/W"]
        tables = {"p": [0, 0, 1, 1], "i": [0, 0, 1, 0], "x": [1.0, 2.0, 5.0, 0.0]}
        for name, values in tables.items():
            del w[name]
            w[name] = np.array(values)
        w["nz"][...] = 3
    assert (read_problem(path).delassus.toarray() == [[3, 0], [0, 5]]).all()


@pytest.mark.peer("h5py")
def test_fclib_solution(tmp_path: Path) -> None:
    """A stored solution is read, and refused when its length is not that of q."""
    import h5py

    path = fclib_write(tmp_path / "one.h5", *posed(3, 2), 3)
    with h5py.File(path, "r+") as file:
        file["solution/r"] = np.arange(6.0)
    assert (read_forces(path) == np.arange(6.0)).all()
    with h5py.File(path, "r+") as file:
        del file["solution/r"]
        file["solution/r"] = np.arange(5.0)
    with pytest.raises(ProblemError, match=r"solution/r: it has 5 numbers where q has 6"):
        read_forces(path)


# --- damage -----------------------------------------------------------------------------------


def cut(path: Path) -> Path:
    """A file cut in the middle."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def pair_without_matrix(path: Path) -> Path:
    """q and mu alone."""
    path = npz_write(path)
    path.with_name(f"{path.stem}_W.npz").unlink()
    return path


def pair_with(damage: Callable[[Path], Any]) -> Callable[[Path], Path]:
    """A good pair whose W is damaged."""

    def make(path: Path) -> Path:
        npz_write(path)
        damage(path.with_name(f"{path.stem}_W.npz"))
        return path

    return make


def wrong_index(path: Path) -> None:
    """A column that the matrix does not have."""
    np.savez(path, format=b"csr", shape=(6, 6), data=np.ones(1), indices=np.array([9]),
             indptr=np.array([0, 1, 1, 1, 1, 1, 1]))  # fmt: skip


NAN = np.array([np.nan, 0, 0, 0, 0, 0])
DAMAGED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "missing": (lambda p: p, "there is no such file"),
    "cut short": (lambda p: cut(npz_write(p)), "can not be read as npz"),
    "empty": (lambda p: p.touch() or p, "can not be read as npz"),
    "pickled": (lambda p: npz_write(p, q=np.array([{}])), "can not be read as npz"),
    "no q": (lambda p: npz_write(p, q=None), "it has no q"),
    "no mu": (lambda p: npz_write(p, mu=None), "it has no mu"),
    "no W": (pair_without_matrix, "_W.npz: it is not there"),
    "W cut short": (pair_with(cut), "can not be read as a sparse matrix"),
    "W of wrong index": (pair_with(wrong_index), "can not be read as a sparse matrix"),
    "W too large": (
        pair_with(lambda p: sp.save_npz(p, sp.eye_array(7))), "W is 7 x 7 and q has 6 numbers",
    ),
    "NaN": (lambda p: npz_write(p, q=NAN), "q: 1 of its numbers are not finite"),
    "words": (lambda p: npz_write(p, q=np.array(["a"] * 6)), "q is not made of numbers"),
    "negative": (lambda p: npz_write(p, mu=np.array([1, -1, 0.0])), "mu is -1"),
    "friction of too many": (lambda p: npz_write(p, mu=np.ones(5)), "mu has shape"),
    "dim": (lambda p: npz_write(p, dim=4), "dim is 4"),
    "no contacts, no dim": (lambda p: npz_write(p, mu=np.zeros(0), dim=None), "dim is 0"),
    "no masses": (lambda p: bodies_write(p, Minv=None), "it has no Minv"),
    "mass of zero": (lambda p: bodies_write(p, Minv=np.zeros(6)), "a mass is zero"),
    "too many masses": (lambda p: bodies_write(p, Minv=np.ones(9)), r"shape \(9,\) for 6 freedoms"),
    "W of others": (lambda p: bodies_write(p, w_wrong=0.01), r"W is not J M\^-1 J\^T"),
}  # fmt: skip


@pytest.mark.parametrize("kind", DAMAGED)
def test_damaged_npz(tmp_path: Path, kind: str) -> None:
    """What is wrong, in which file."""
    make, message = DAMAGED[kind]
    path = make(tmp_path / "bad.npz")
    with pytest.raises(ProblemError, match=message) as caught:
        read_problem(path)
    assert "bad" in str(caught.value)


def test_forces_of_wrong_length(tmp_path: Path) -> None:
    """Solutions of another problem."""
    path = npz_write(tmp_path / "bad.npz", r=np.zeros((2, 5)))
    with pytest.raises(ProblemError, match=r"shape \(2, 5\) where q has 6"):
        read_forces(path)


def test_unknown_suffix(tmp_path: Path) -> None:
    """A file of another kind, with those that are known."""
    with pytest.raises(ProblemError, match=r"end in \.mat are not known(?s:.*)\.npz, \.hdf5"):
        read_problem(tmp_path / "one.mat")


@pytest.mark.parametrize("path", [3, None, 1.5, []])
def test_a_path_that_is_none(path: Any) -> None:
    for read in (read_problem, read_forces):
        with pytest.raises(ProblemError, match="name a file"):
            read(path)


def test_bytes_that_are_wrong_in_headers(tmp_path: Path) -> None:
    """Headers of stored arrays are read as Python text: whatever that raises is a sentence.

    Arrays are longer than what is read at once, or their checksum would tell first.
    """
    path = tmp_path / "bad.npz"
    np.savez(path, q=np.zeros(2000), mu=np.zeros(1000))
    sound, draw = path.read_bytes(), np.random.default_rng(4)
    headers = [found.start() for found in re.finditer(rb"\x93NUMPY", sound)]
    for _ in range(300):
        damaged = bytearray(sound)
        for place in draw.choice(headers) + draw.integers(80, size=draw.integers(1, 4)):
            damaged[place] = draw.integers(256)
        path.write_bytes(damaged)
        with suppress(ProblemError):
            read_problem(path)


def no_group(file: Any) -> None:
    """Something else in HDF5."""
    del file["fclib_local"]


def by_masses(file: Any) -> None:
    """A global problem."""
    file.move("fclib_local", "fclib_global")


def replaced(name: str, values: Any) -> Callable[[Any], None]:
    """Other values in the place of a data set."""

    def damage(file: Any) -> None:
        del file[f"fclib_local/{name}"]
        if values is not None:
            file[f"fclib_local/{name}"] = values

    return damage


FCLIB_DAMAGED: dict[str, tuple[Callable[[Any], None], str]] = {
    "another kind": (no_group, "it has no group fclib_local"),
    "global without masses": (by_masses, "it has no fclib_global/M"),
    "rolling": (replaced("spacedim", [5]), "rolling friction"),
    "dim": (replaced("spacedim", [4]), "dim is 4"),
    "no dim": (replaced("spacedim", None), "it has no fclib_local/spacedim"),
    "no W": (replaced("W", None), "it has no fclib_local/W"),
    "no p": (replaced("W/p", None), "it has no fclib_local/W/p"),
    "no q": (replaced("vectors/q", None), "it has no fclib_local/vectors/q"),
    "words": (replaced("vectors/q", "none"), "vectors/q: it is not made of numbers"),
    "short x": (replaced("W/x", np.ones(2)), "are no matrix"),
    "far index": (replaced("W/i", np.full(11, 99)), "are no matrix"),
    "nz": (replaced("W/nz", [-7]), "nz = -7"),
    "NaN": (replaced("vectors/q", np.full(6, np.nan)), "6 of its numbers are not finite"),
    "short mu": (replaced("vectors/mu", np.ones(2)), r"mu has shape \(2,\)"),
    "equalities": (lambda f: f.create_group("fclib_local/V"), "equality constraints"),
}


@pytest.mark.parametrize("kind", FCLIB_DAMAGED)
@pytest.mark.peer("h5py")
def test_damaged_fclib(tmp_path: Path, kind: str) -> None:
    """What is wrong, in which part of the file."""
    import h5py

    damage, message = FCLIB_DAMAGED[kind]
    path = fclib_write(tmp_path / "bad.hdf5", *posed(2, 3), 2)
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(ProblemError, match=message) as caught:
        read_problem(path)
    assert "bad.hdf5" in str(caught.value)


@pytest.mark.peer("h5py")
def test_fclib_pointer_of_git_lfs(tmp_path: Path) -> None:
    """What stands in FCLIB's repository where its files are not fetched."""
    path = tmp_path / "one.hdf5"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    with pytest.raises(ProblemError, match=r"can not be read as HDF5(?s:.*)Git LFS"):
        read_problem(path)


def test_without_h5py(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What to install."""
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    (tmp_path / "one.hdf5").write_bytes(b"")
    with pytest.raises(LibraryMissing, match="pip install h5py"):
        read_problem(tmp_path / "one.hdf5")


def test_stored_problems() -> None:
    """Every real problem of the data folder can be read and posed."""
    folder = os.environ.get("TRACKBED_DATA")
    if folder is None:
        pytest.skip("TRACKBED_DATA does not name the folder that holds friction_problems")
    paths = [
        path for path in sorted((Path(folder) / "friction_problems").glob("*.npz"))
        if not path.stem.endswith(("_W", "_H"))
    ]  # fmt: skip
    assert paths
    for path in paths:
        problem = read_problem(path)
        assert problem.delassus.shape == (problem.contacts * problem.dim,) * 2
        assert all(problem.residual(force) < 1e-12 for force in read_forces(path))


W = np.diag([1.0, 2.0, 1.0, 2.0])
Q = np.array([-1.0, 0.5, 1.0, 0.0])


@pytest.mark.long
@pytest.mark.parametrize(
    ("written", "checked"),
    [
        pytest.param(
            lambda path: np.savez_compressed(path, W=W, q=Q, mu=np.full(2, 0.5)), True, id="npz"
        ),
        pytest.param(
            lambda path: fclib_write(path, sp.csr_array(W), Q, np.full(2, 0.5), 2), False,
            id="hdf5", marks=pytest.mark.peer("h5py"),
        ),
    ],
)  # fmt: skip
def test_a_file_cut_or_spoilt_anywhere_is_named(tmp_path: Path, written, checked):
    """Every cut and flipped byte gives a problem or a `ProblemError`, and no other error.

    Where the format has check sums (``checked``) it gives the problem that was written.
    """
    whole = tmp_path / f"whole.{'npz' if checked else 'hdf5'}"
    written(whole)
    content, rng = whole.read_bytes(), np.random.default_rng(3)
    path = whole.with_stem("spoilt")
    named = 0
    for trial in range(300):
        spoilt = bytearray(content)
        if trial % 2:
            spoilt = spoilt[: int(rng.integers(0, len(content)))]
        else:
            for place in rng.integers(0, len(content), 4):
                spoilt[place] ^= 1 << int(rng.integers(0, 8))
        path.write_bytes(bytes(spoilt))
        try:
            problem = read_problem(path)
        except ProblemError as error:
            named += str(path) in str(error)
        else:
            named += 1
            if checked:
                np.testing.assert_array_equal(problem.delassus.toarray(), W)
    assert named == 300


def test_what_an_npz_holds_beside_a_problem_is_named(tmp_path: Path) -> None:
    """Unknown arrays and a friction of degrees are warned of; two W, and two numbers of dim, are
    refused."""
    w, q, mu = posed(2, 3)
    path = tmp_path / "one.npz"
    np.savez(path, W=w.toarray(), q=q, mu=mu, V=np.eye(2), e=np.ones(1))
    with pytest.warns(UserWarning, match="not used: V, e"):
        assert_same(read_problem(path), w, q, mu, 2)
    np.savez(path, W=w.toarray(), q=q, mu=np.full_like(mu, 30.0), dim=np.array([2]))
    with pytest.warns(UserWarning, match="mu: a friction of 30 is above 2; as an angle in degrees"):
        assert read_problem(path).dim == 2
    np.savez(path, W=w.toarray(), q=q, mu=mu, dim=np.array([2, 3]))
    with pytest.raises(ProblemError, match="not one whole number"):
        read_problem(path)
    np.savez(path, W=w.toarray(), q=q, mu=mu)
    sp.save_npz(tmp_path / "one_W.npz", sp.csr_array(2 * w))
    with pytest.raises(ProblemError, match=r"W is an array of this file, and of one_W\.npz too"):
        read_problem(path)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("fclib_local/vectors/mu_r", 0.1, "mu_r would not be used"),
        ("fclib_local/vectors/s", 1.0, "s would not be used"),
        ("fclib_local/M", 1.0, "M would not be used"),
        ("fclib_global", 1.0, "both groups"),
        ("fclib_local/spacedim", 2.5, "not one whole number"),
        ("fclib_local/W/x", 7.0, "x has 100 numbers, of which it says"),
    ],
)
def test_what_is_more_in_fclib_is_refused(
    tmp_path: Path, name: str, value: float, said: str
) -> None:
    """Rolling friction, constraints, a global problem beside the local one, numbers left over."""
    h5py = pytest.importorskip("h5py")
    path = fclib_write(tmp_path / "one.h5", *posed(2, 3), 2, nz=0)
    with h5py.File(path, "a") as file:
        old = np.ravel(file[name]) if name in file and name.endswith("x") else np.zeros(0)
        if name in file:
            del file[name]
        size = 100 - len(old) if name.endswith("x") else 1
        file[name] = np.concatenate((old, np.full(size, value)))
    with pytest.raises(ProblemError, match=said):
        read_problem(path)
