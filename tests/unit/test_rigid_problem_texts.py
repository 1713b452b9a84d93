"""Problems of Siconos's text files, and of FCLIB by masses, are read as they were written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.files.formats import read_forces, read_problem


def posed(dim: int, contacts: int, seed: int = 0) -> tuple[Any, Any, Any]:
    """W (dense, not symmetric, some blocks zero), q and mu."""
    draw = np.random.default_rng(seed)
    filled = np.kron(draw.random((contacts, contacts)) < 0.5, np.ones((dim, dim)))
    w = filled * draw.normal(size=filled.shape) + np.eye(dim * contacts)
    return w, draw.normal(size=dim * contacts), draw.random(contacts)


def numbers(values: Any) -> str:
    """Numbers as Siconos prints them."""
    return " ".join(f"{each:.24e}" for each in np.ravel(values)) + "\n"


def text_dense(w: Any, dim: int) -> str:
    """Storage 0."""
    return f"0\n{len(w)}\n{len(w)}\n{len(w)}\t{len(w)}\n" + numbers(w.T)


def text_blocks(w: Any, dim: int) -> str:
    """Storage 1: the blocks that are not zero."""
    contacts = len(w) // dim
    blocks = w.reshape(contacts, dim, contacts, dim).transpose(0, 2, 1, 3)
    row, column = np.nonzero(np.abs(blocks).sum((2, 3)))
    ends = "\t".join(str(dim * (k + 1)) for k in range(contacts)) + "\n"
    begin = np.searchsorted(row, np.arange(contacts + 1))
    lists = [f"{contacts + 1}\n{len(row)}\n"]
    lists += ["\t".join(str(each) for each in values) + "\n" for values in (begin, column)]
    filled = "".join(
        f"{k}\n" + numbers(blocks[i, j].T) for k, (i, j) in enumerate(zip(row, column, strict=True))
    )
    head = f"1\n{len(w)}\n{len(w)}\n{len(row)}\n{contacts}\n{contacts}\n"
    return head + 2 * ends + "".join(lists) + filled


def text_sparse(w: Any, dim: int) -> str:
    """Storage 2: what cs_print writes."""
    matrix = sp.csc_array(w)
    lines = [f"2\n{len(w)}\n{len(w)}\n2\nCSparse Version 3.1.9, May 4, 2016.  Copyright (c)"]
    lines.append(f"{len(w)}-by-{len(w)}, nzmax: {matrix.nnz} nnz: {matrix.nnz}, 1-norm: 25584.9")
    for j in range(len(w)):
        first, last = matrix.indptr[j], matrix.indptr[j + 1]
        lines.append(f"    col {j} : locations {first} to {last - 1}")
        lines += [f"      {matrix.indices[k]} : {matrix.data[k]:.17g}" for k in range(first, last)]
    return "\n".join(lines) + "\n"


TEXTS: dict[str, Callable[[Any, int], str]] = {
    "dense": text_dense, "blocks": text_blocks, "sparse": text_sparse,
}  # fmt: skip


def written(path: Path, kind: str, dim: int, contacts: int, seed: int = 0) -> tuple[Any, Any, Any]:
    """Write a problem; returns its W, q and mu."""
    w, q, mu = posed(dim, contacts, seed)
    parts = (f"{dim}\n{contacts}\n", TEXTS[kind](w, dim), numbers(q), numbers(mu))
    path.write_text("".join(parts))
    return w, q, mu


@given(
    dim=st.sampled_from([2, 3]), contacts=st.integers(1, 5), seed=st.integers(0, 99),
    kind=st.sampled_from(sorted(TEXTS)),
)  # fmt: skip
@settings(max_examples=40)
def test_text_of_every_storage(tmp_path_factory, dim, contacts, seed, kind):
    """W, q and mu to the last bit; a number more at the end, which some files have, is no fault."""
    path = tmp_path_factory.mktemp("text") / "one.dat"
    w, q, mu = written(path, kind, dim, contacts, seed)
    path.write_text(path.read_text() + "1\n")
    problem = read_problem(path)
    assert problem.dim == dim
    assert (problem.delassus.toarray() == w).all()
    assert (problem.offset == q).all()
    assert (problem.friction == mu).all()
    assert read_forces(path).shape == (0, dim * contacts)


TEXT_DAMAGED: dict[str, tuple[str, Callable[[str], str], str]] = {
    "empty": ("dense", lambda text: "", "0 of 5 numbers"),
    "cut short": ("dense", lambda text: text[: len(text) // 2], "ends within W"),
    "left over": ("dense", lambda text: text + "0.5 0.5\n", "2 numbers are left over behind mu"),
    "no friction": ("blocks", lambda text: text[: text.rindex("\n", 0, -1)], "ends within mu"),
    "words": ("dense", lambda text: text.replace("e+00", "x", 1), "could not convert"),
    "rolling": ("dense", lambda text: text.replace("2", "5", 1), "rolling friction"),
    "global": ("dense", lambda text: text.replace("\n6\n6\n", "\n9\n9\n", 1), "W is 9 x 9 where 3"),
    "two sizes": ("dense", lambda text: text.replace("6\t6", "6\t7"), "two sizes of W differ"),
    "storage": ("dense", lambda text: text.replace("\n0\n", "\n7\n", 1), "storage of W is 7"),
    "lists": ("blocks", lambda text: text.replace("\n3\n3\n2\t4\t6", "\n3\n3\n2\t4\t5"), "lists"),
    "negative": ("dense", lambda text: text.replace("3", "-3", 1), "not all whole numbers"),
    "column lost": ("sparse", lambda text: text.replace("col 1 ", "kol 1 "), "5 columns of W"),
    "huge": (
        "sparse",
        lambda text: "2\n2000000000\n2\n4000000000\n4000000000\n2\n",
        "0 columns of W",
    ),
    "far row": ("sparse", lambda text: text.replace("\n      0 :", "\n      9 :", 1), "row 9 of 6"),
    "NaN": ("dense", lambda text: text[: text.rindex(" ")] + " nan\n", "not finite"),
    "friction": ("dense", lambda text: text[: text.rindex(" ")] + " -1.0\n", "mu is -1"),
}


@pytest.mark.parametrize("kind", TEXT_DAMAGED)
def test_damaged_text(tmp_path: Path, kind: str) -> None:
    """What is wrong, and in which file."""
    storage, damage, message = TEXT_DAMAGED[kind]
    path = tmp_path / "one.dat"
    written(path, storage, 2, 3)
    path.write_text(damage(path.read_text()))
    with pytest.raises(ProblemError, match=message) as caught:
        read_problem(path)
    assert str(path) in str(caught.value)


# --- FCLIB by masses ----------------------------------------------------------------------------


def masses_write(path: Path, blocks: bool, dim: int = 3) -> dict[str, Any]:
    """A file as FCLIB's `fclib_write_global` writes it: two bodies and the ground, triplets."""
    import h5py

    draw = np.random.default_rng(3)
    size, contacts = {2: 3, 3: 6}[dim], 4
    root = draw.normal(size=(2 * size, 2 * size))
    if blocks:
        root *= np.kron(np.eye(2), np.ones((size, size)))
    made = {
        "M": root @ root.T + np.eye(2 * size), "H": draw.normal(size=(2 * size, contacts * dim)),
        "f": draw.normal(size=2 * size), "w": draw.normal(size=contacts * dim),
        "mu": draw.random(contacts),
    }  # fmt: skip
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_global")
        group["spacedim"] = np.array([dim], dtype=np.int32)
        for name in "MH":
            stored = sp.coo_array(made[name])
            sizes = {"m": stored.shape[0], "n": stored.shape[1], "nz": stored.nnz}
            for part, value in sizes.items():
                group[f"{name}/{part}"] = np.array([value], dtype=np.int32)
            group[f"{name}/i"], group[f"{name}/p"] = stored.coords
            group[f"{name}/x"] = stored.data
        for name in ("f", "w", "mu"):
            group[f"vectors/{name}"] = made[name]
    return made


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("blocks", [True, False])
@pytest.mark.peer("h5py")
def test_problem_by_masses(tmp_path: Path, blocks: bool, dim: int) -> None:
    """``u = W r + q`` is ``H^T v + w`` with ``M v = H r + f``; bodies where M has their blocks.

    Tolerance: two solves with M of condition below 1e3, 1e-12 of the largest velocity.
    """
    path = tmp_path / "one.hdf5"
    made = masses_write(path, blocks, dim)
    problem = read_problem(path)
    assert (problem.bodies is not None) == blocks
    force = np.random.default_rng(5).normal(size=len(made["w"]))
    velocity = np.linalg.solve(made["M"], made["H"] @ force + made["f"])
    expected = made["H"].T @ velocity + made["w"]
    assert np.abs(problem.velocity(force) - expected).max() <= 1e-12 * np.abs(expected).max()
    assert read_forces(path).shape == (0, len(made["w"]))


def spoiled(name: str, values: Any) -> Callable[[Any], None]:
    """Other values for a data set."""

    def damage(group: Any) -> None:
        del group[name]
        if values is not None:
            group[name] = values

    return damage


MASSES_DAMAGED: dict[str, tuple[Callable[[Any], None], str]] = {
    "no H": (spoiled("H", None), "it has no fclib_global/H"),
    "short f": (spoiled("vectors/f", np.ones(5)), "f has 5 numbers for 12 freedoms"),
    "short w": (spoiled("vectors/w", np.ones(5)), "w has 5 numbers for 12 columns of H"),
    "no mass": (spoiled("M/x", np.zeros(72)), "M can not be inverted"),
    "equalities": (lambda group: group.create_group("G"), "equality constraints"),
}


@pytest.mark.parametrize("kind", MASSES_DAMAGED)
@pytest.mark.peer("h5py")
def test_damaged_masses(tmp_path: Path, kind: str) -> None:
    """What is wrong, and in which file."""
    import h5py

    damage, message = MASSES_DAMAGED[kind]
    path = tmp_path / "one.hdf5"
    masses_write(path, blocks=True)
    with h5py.File(path, "a") as file:
        damage(file["fclib_global"])
    with pytest.raises(ProblemError, match=message) as caught:
        read_problem(path)
    assert str(path) in str(caught.value)
