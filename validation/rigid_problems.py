"""Named friction problems on which solvers are compared: stored real ones, and generated families.

Stored: those of the folder ``friction_problems`` under the environment variable ``TRACKBED_DATA``
(real ones of the test suite of Siconos, Apache-2.0, and packings).  Unseen: the same, changed: q by
5 % noise, friction by a factor from 0.7 to 1.3, contacts in another order, all by a seed.
Generated: towers, and settled packings of discs and spheres (`rigid_packings`), also as problems
without friction; large ones settle for minutes and are kept in the folder TRACKBED_BEDS, if set.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rigid_lcp.friction_problem import BodySpace, FrictionProblem, friction_problem
from rigid_lcp.problem_files import read_problem
from validation.rigid_packings import packing, tower

NONUNIQUE = "nonunique_discs_125"
"""The stored problem that comes with several solutions; not raced."""
SIX_DIGITS = ("granularflow",)
"""Problems whose W was printed to six digits: their residual can be asked for 1e-10."""
NOISE, FRICTION_FACTORS = 0.05, (0.7, 1.3)


@dataclass(frozen=True)
class NamedProblem:
    """A problem by name; made, or read, when it is asked for."""

    name: str
    family: str
    make: Callable[[], FrictionProblem]
    seed: int = 0

    @property
    def bar(self) -> float:
        """The residual to be reached."""
        return 1e-10 if any(word in self.name for word in SIX_DIGITS) else 1e-12


def data_folder() -> Path | None:
    """The folder of the stored problems, or None."""
    named = os.environ.get("TRACKBED_DATA")
    folder = Path(named) / "friction_problems" if named else None
    return folder if folder is not None and folder.is_dir() else None


def stored_problems() -> list[NamedProblem]:
    """The stored problems, small ones first; none without the folder."""
    folder = data_folder()
    if folder is None:
        return []
    paths = [
        path for path in folder.glob("*.npz")
        if not path.stem.endswith(("_W", "_H")) and path.stem != NONUNIQUE
    ]  # fmt: skip
    problems = [
        NamedProblem(stored_name(path.stem), "stored", partial(read_problem, path))
        for path in paths
    ]
    return sorted(problems, key=lambda each: (each.make().contacts, each.name))


def stored_name(stem: str) -> str:
    """``KaplasTower-i1061-4.hdf5.dat`` without its endings."""
    return stem.removesuffix(".dat").removesuffix(".hdf5")


def unseen_problems(seeds: Iterable[int] = (1, 2)) -> list[NamedProblem]:
    """The stored problems changed at random: the same families, not the same problems."""
    return [
        NamedProblem(f"{each.name}~{seed}", "unseen", partial(_changed, each, seed), seed)
        for each in stored_problems()
        for seed in seeds
    ]


def _changed(each: NamedProblem, seed: int) -> FrictionProblem:
    return changed(each.make(), np.random.default_rng(seed))


def changed(problem: FrictionProblem, generator: np.random.Generator) -> FrictionProblem:
    """Another order of contacts, other friction, and q with noise; W stays that of real bodies.

    With bodies the noise is one of their velocities, so that q stays in the image of J.
    """
    dim = problem.dim
    order = generator.permutation(problem.contacts)
    rows = (dim * order[:, None] + np.arange(dim)).ravel()
    friction = problem.friction[order] * generator.uniform(*FRICTION_FACTORS)
    size = NOISE * float(np.linalg.norm(problem.offset)) / max(1.0, len(rows) ** 0.5)
    if problem.bodies is None:
        offset = problem.offset[rows] + size * generator.standard_normal(len(rows))
        w = problem.delassus[rows][:, rows]
        made: FrictionProblem = friction_problem(w, offset, friction, dim)
        return made
    jacobian = sp.csr_array(problem.bodies.jacobian[rows])
    push = jacobian @ generator.standard_normal(jacobian.shape[1])
    push *= size * len(rows) ** 0.5 / (float(np.linalg.norm(push)) or 1.0)
    bodies = BodySpace(jacobian, problem.bodies.inverse_mass, problem.bodies.body_size)
    made = friction_problem(bodies, problem.offset[rows] + push, friction, dim)
    return made


def generated_problems(quick: bool) -> list[NamedProblem]:
    """Towers and packings, up to some 100 contacts if ``quick``, else up to 5,000."""
    boxes = ((10, 2), (10, 3)) if quick else ((50, 2), (200, 2), (50, 3), (200, 3))
    grains = ((60, 2), (40, 3)) if quick else ((250, 2), (1000, 2), (2500, 2), (200, 3), (1500, 3))
    problems = [
        NamedProblem(f"tower{dim}d_{count}", f"towers {dim}D", partial(tower, count, dim))
        for count, dim in boxes
    ]
    problems += [
        NamedProblem(
            f"tower{dim}d_10_top1e4", f"towers {dim}D", partial(tower, 10, dim, top_mass=1e4)
        )
        for dim in (2, 3)
    ]
    problems += [
        NamedProblem(
            f"{'discs' if dim == 2 else 'spheres'}{count}_mu{mu:g}", f"packings {dim}D",
            partial(_packing, count, dim, mu), 1,
        )
        for count, dim in grains
        for mu in ((0.5,) if count > 1000 or quick else (0.3, 0.8))
    ]  # fmt: skip
    return problems


def frictionless_problems(quick: bool) -> list[NamedProblem]:
    """The normal parts of packings in 2D, some 100 contacts if ``quick``, else 100 to 1,300."""
    return [
        NamedProblem(f"discs{count}_lcp", "frictionless", partial(_frictionless, count), 1)
        for count in ((60,) if quick else (60, 125, 250, 700))
    ]


@cache
def _packing(grains: int, dim: int, friction: float) -> FrictionProblem:
    kept = os.environ.get("TRACKBED_BEDS")
    return packing(grains, dim, seed=1, friction=friction, folder=Path(kept) if kept else None)


def _frictionless(grains: int) -> FrictionProblem:
    packed = _packing(grains, 2, 0.5)
    assert packed.bodies is not None
    made: FrictionProblem = friction_problem(packed.bodies, packed.offset, 0.0, 2)
    return made


def all_problems(quick: bool) -> list[NamedProblem]:
    """Everything that is raced."""
    problems = generated_problems(quick) + frictionless_problems(quick)
    return problems if quick else [*stored_problems(), *problems, *unseen_problems()]
