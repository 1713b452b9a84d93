"""Named friction problems on which solvers are compared: stored real ones, and generated families.

Stored: those of the folder ``friction_problems`` under the environment variable ``TRACKBED_DATA``
(real ones of the test suite of Siconos, Apache-2.0, and packings).  Test suite: the other problems
in Siconos's own files, which no setting was chosen by, in the folder TRACKBED_SICONOS (in its
source package ``numerics/src/FrictionContact/test/data``), which the examination changes: q by 5 %
noise, friction by a factor from 0.7 to 1.3, contacts in another order, all by a seed.  Generated:
towers, and settled packings of discs and spheres, also without friction, of other seeds and
frictions, which no setting was chosen by, and near yield: a stored packing under less friction.
Large packings settle for minutes and are kept in the folder TRACKBED_BEDS, if set.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rigid_lcp.friction.files.formats import read_problem
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from validation.bench.rigid.packings import build_crystal, build_packing, build_tower

NONUNIQUE = "nonunique_discs_125"
"""The stored problem that comes with several solutions; not raced."""
SIX_DIGITS = ("granularflow",)
"""Problems whose W was printed to six digits: their residual can be asked for 1e-10."""
OTHER_KINDS = ("GFC3D", "GRFC3D", "LMGC_GFC3D", "RFC3D", "rfc3d", "gfc2d", "ACinputs", "CubeH8")
"""How the names of problems of other kinds begin (in text by masses, rolling, inputs of tests)."""
NOISE, FRICTION_FACTORS = 0.05, (0.7, 1.3)
GRAINS = {2: "discs", 3: "spheres"}


@dataclass(frozen=True)
class NamedProblem:
    """A problem by name; made, or read, when it is asked for."""

    name: str
    family: str
    make: Callable[[], FrictionProblem]

    @property
    def bar(self) -> float:
        """The residual to be reached."""
        return 1e-10 if any(word in self.name for word in SIX_DIGITS) else 1e-12


def find_data_folder() -> Path | None:
    """The folder of the stored problems, or None."""
    named = os.environ.get("TRACKBED_DATA")
    folder = Path(named) / "friction_problems" if named else None
    return folder if folder is not None and folder.is_dir() else None


def list_stored() -> list[NamedProblem]:
    """The stored problems, small ones first; none without the folder."""
    folder = find_data_folder()
    if folder is None:
        return []
    paths = [
        path for path in folder.glob("*.npz")
        if not path.stem.endswith(("_W", "_H")) and path.stem != NONUNIQUE
    ]  # fmt: skip
    problems = [
        NamedProblem(shorten_name(path.stem), "stored", partial(read_problem, path))
        for path in paths
    ]
    return sorted(problems, key=lambda each: (each.make().contacts, each.name))


def shorten_name(stem: str) -> str:
    """``KaplasTower-i1061-4.hdf5.dat`` without its endings."""
    return stem.removesuffix(".dat").removesuffix(".hdf5")


def list_suite() -> list[NamedProblem]:
    """Siconos's problems in contact space, and those by masses of FCLIB, that are not stored."""
    named = os.environ.get("TRACKBED_SICONOS")
    if named is None or not Path(named).is_dir():
        return []
    stored = {each.name for each in list_stored()}
    paths = [
        path for path in Path(named).iterdir()
        if path.suffix in (".dat", ".hdf5") and not path.name.startswith(OTHER_KINDS)
        and shorten_name(path.name) not in stored
    ]  # fmt: skip
    problems = [
        NamedProblem(shorten_name(path.name), "test suite", partial(read_problem, path))
        for path in paths
    ]
    return sorted(problems, key=lambda each: (each.make().contacts, each.name))


def vary(problem: FrictionProblem, generator: np.random.Generator) -> FrictionProblem:
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
        made: FrictionProblem = make_problem(w, offset, friction, dim)
        return made
    jacobian = sp.csr_array(problem.bodies.jacobian[rows])
    push = jacobian @ generator.standard_normal(jacobian.shape[1])
    push *= size * len(rows) ** 0.5 / (float(np.linalg.norm(push)) or 1.0)
    bodies = BodySpace(jacobian, problem.bodies.inverse_mass, problem.bodies.body_size)
    made = make_problem(bodies, problem.offset[rows] + push, friction, dim)
    return made


def renew_bodies(problem: FrictionProblem) -> BodySpace:
    """The bodies of a problem without what they keep of earlier solves."""
    bodies = problem.bodies
    assert bodies is not None
    return BodySpace(bodies.jacobian, bodies.inverse_mass, bodies.body_size)


def list_generated() -> list[NamedProblem]:
    """Towers and packings of up to 5,000 contacts."""
    boxes = ((50, 2), (200, 2), (50, 3), (200, 3))
    grains = ((250, 2), (1000, 2), (2500, 2), (200, 3), (1500, 3))
    problems = [
        NamedProblem(f"tower{dim}d_{count}", f"towers {dim}D", partial(build_tower, count, dim))
        for count, dim in boxes
    ]
    problems += [
        NamedProblem(
            f"tower{dim}d_10_top1e4", f"towers {dim}D", partial(build_tower, 10, dim, top_mass=1e4)
        )
        for dim in (2, 3)
    ]
    problems += [
        NamedProblem(
            f"{GRAINS[dim]}{count}_mu{mu:g}", f"packings {dim}D",
            partial(_make_packing, count, dim, mu),
        )
        for count, dim in grains
        for mu in ((0.5,) if count > 1000 else (0.3, 0.8))
    ]  # fmt: skip
    return problems + [
        NamedProblem(f"spheres_crystal{layers}", "packings 3D", partial(build_crystal, layers))
        for layers in (5, 9)
    ]


OTHERS = (
    (100, 2, 0.1), (200, 2, 1.2), (300, 2, 0.6), (600, 2, 0.2), (600, 2, 1.0),
    (60, 3, 0.1), (80, 3, 1.2), (150, 3, 0.2), (300, 3, 0.6), (300, 3, 1.0),
    (30, 2, 1.5), (30, 3, 0.6), (1500, 2, 0.3), (600, 3, 0.2), (1000, 3, 0.5), (1500, 3, 0.8),
)  # fmt: skip
"""Grains, dimension and friction of packings that are raced only against the nearest rival."""
OTHER_SEEDS = (11, 12)
HARD = ((100, 3, 0.1, 101),)
"""The same with its seed: one of 80 such packings (30 to 250 grains, friction 0.1 to 1.5), and the
only one, that the default was found not to solve."""
FRICTIONLESS = (
    (60, 2, 1), (125, 2, 1), (250, 2, 1), (700, 2, 1), (1500, 2, 1), (2500, 2, 1), (90, 2, 11),
    (400, 2, 12), (40, 3, 1), (120, 3, 1), (200, 3, 1), (400, 3, 1), (1500, 3, 1), (80, 3, 11),
    (250, 3, 12),
)  # fmt: skip
"""Grains, dimension and seed."""


def list_other_packings() -> list[NamedProblem]:
    """Packings of other seeds and frictions from 0.1 to 1.5."""
    beds = [(*other, seed) for other in OTHERS for seed in OTHER_SEEDS]
    return [
        NamedProblem(
            f"{GRAINS[dim]}{count}_mu{mu:g}_seed{seed}", f"other packings {dim}D",
            partial(_make_packing, count, dim, mu, seed),
        )
        for count, dim, mu, seed in (*beds, *HARD)
    ]  # fmt: skip


def list_frictionless() -> list[NamedProblem]:
    """The normal parts of packings of 100 to 5,000 contacts."""
    return [
        NamedProblem(
            f"{GRAINS[dim]}{count}_lcp" + f"_seed{seed}" * (seed > 1), "frictionless",
            partial(_make_frictionless, count, dim, seed),
        )
        for count, dim, seed in FRICTIONLESS
    ]  # fmt: skip


YIELDING, YIELD_FRICTIONS = "spheres_500", (0.2, 0.25, 0.29, 0.3, 0.31, 0.35)
"""A stored packing that was settled under a friction of 0.5, and those it is given then."""


def list_yielding() -> list[NamedProblem]:
    """A packing near yield: below some friction no forces hold it, and many contacts slide."""
    return [
        NamedProblem(f"{each.name}_mu{mu:g}", "near yield", partial(_change_friction, each, mu))
        for each in list_stored()
        for mu in YIELD_FRICTIONS
        if each.name == YIELDING
    ]


def _change_friction(stored: NamedProblem, friction: float) -> FrictionProblem:
    problem = stored.make()
    made: FrictionProblem = replace(problem, friction=np.full(problem.contacts, friction))
    return made


def _find_beds() -> Path | None:
    kept = os.environ.get("TRACKBED_BEDS")
    return Path(kept) if kept else None


@cache
def _make_packing(grains: int, dim: int, friction: float, seed: int = 1) -> FrictionProblem:
    return build_packing(grains, dim, seed=seed, friction=friction, folder=_find_beds())


def _make_frictionless(grains: int, dim: int, seed: int) -> FrictionProblem:
    packed = _make_packing(grains, dim, 0.5, seed)
    assert packed.bodies is not None
    made: FrictionProblem = make_problem(packed.bodies, packed.offset, 0.0, dim)
    return made


def list_problems() -> list[NamedProblem]:
    """Everything that is raced; without the stored ones where their folders are not named."""
    return [
        *list_stored(), *list_generated(), *list_other_packings(), *list_frictionless(),
        *list_yielding(),
    ]  # fmt: skip
