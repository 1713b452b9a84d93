"""Other people's solvers of the same friction problem: W, q and mu in, r and its cost out.

Every peer starts from zero, is asked for a tolerance of its own error measure, keeps its other
settings, and is timed in processor seconds of the solve alone.  What is not timed: turning the
problem into the peer's types.  Where a peer stops at its number of iterations, and time is left, it
is run again with more, and both runs are recorded.

``siconos`` (Acary et al.)  by `rigid_siconos`, in a process of its own, as it may abort.
``Clarabel``                convex cone programs, |u_T| frozen, again and again (Acary, Cadoux,
                            Lemarechal and Malick, ZAMM 91 (2011) 155), in body space if possible.
``Clarabel + Newton``       the same to 1e-8 without freezing again, then semismooth Newton steps.
``OSQP``                    without friction, the linear complementarity problem, polished.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.errors import LibraryMissing
from rigid_lcp.friction_problem import FrictionProblem, friction_problem
from validation.rigid_cone_programs import (
    Stopwatch,
    library_named,
    program_of_bodies,
    program_of_contacts,
)
from validation.rigid_newton_polish import newton_polish

Floats = NDArray[np.float64]
SYSTEM_PYTHON = "/usr/bin/python3"
SICONOS = {
    2: ("2D_NSGS", "2D_CPG", "2D_LEMKE"),
    3: ("3D_NSGS", "3D_ADMM", "3D_NSN_AC", "3D_NSN_FB", "3D_PROX"),
}
"""Solvers by dimension; the others are slower or worse on all stored problems."""
SICONOS_MOST = {
    "2D_LEMKE": 300, "2D_NSGS": 500, "2D_CPG": 1000, "3D_NSN_AC": 500, "3D_NSN_FB": 500,
    "3D_PROX": 500,
}  # fmt: skip
"""Contacts above which a solver is not tried: dense matrices, or far behind the others there."""
SICONOS_SPARSE = 400
"""Contacts above which plane problems are also given to sparse solvers, as problems in space."""
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
REPEATS = 5
"""Where a run is short, the cost is the median of so many means over `batch_size` runs."""
BATCH_S, BATCH_MOST = 0.02, 20
"""A mean is over runs of so much time, as clocks of processor time may tick every 4 ms."""
FINEST = 1e-10
"""What Clarabel is asked for at the most: beyond, it stops with worse answers on singular W."""
OUTER = 50
"""Programs that Clarabel solves for one answer, at most."""


@dataclass(frozen=True)
class PeerRun:
    """What a peer made of a problem with one setting."""

    setting: dict[str, Any]
    force: Floats | None
    """r (nc * dim,), or None where the peer died."""
    cost_s: float | None = None
    repeats_s: tuple[float, ...] = ()
    work: float | None = None
    work_unit: str = ""
    claims: bool = False
    """The peer says that it has solved the problem."""
    why: str = ""
    """What it says otherwise, or how it died."""


# --- Siconos ----------------------------------------------------------------------------------


def batch_size(cost_s: float) -> int:
    """Number of runs whose mean cost is one measurement, from the cost of a run [s]."""
    return int(np.clip(np.ceil(BATCH_S / max(cost_s, 1e-6)), 1, BATCH_MOST))


def siconos_solvers(problem: FrictionProblem) -> list[str]:
    """The solvers that are worth a try on a problem."""
    names = [*SICONOS[problem.dim]]
    if problem.dim == 2 and problem.contacts > SICONOS_SPARSE:
        names += ["3D_NSGS", "3D_ADMM"]
    return [name for name in names if problem.contacts <= SICONOS_MOST.get(name, 10**9)]


def in_space(problem: FrictionProblem) -> FrictionProblem:
    """A plane problem as one in space: nothing pushes along t2, so its forces there are zero."""
    contacts = problem.contacts
    wide = np.arange(2 * contacts) // 2 * 3 + np.arange(2 * contacts) % 2
    w = problem.delassus.tocoo()
    across = np.arange(2, 3 * contacts, 3)
    entries = np.concatenate([w.data, np.full(contacts, 1.0 / problem.rho)])
    rows, columns = (np.concatenate([wide[each], across]) for each in (w.row, w.col))
    offset = np.zeros(3 * contacts)
    offset[wide] = problem.offset
    matrix = sp.csr_array((entries, (rows, columns)), (3 * contacts,) * 2)
    made: FrictionProblem = friction_problem(matrix, offset, problem.friction, 3)
    return made


@cache
def siconos_missing() -> str:
    """Why Siconos can not be run; empty if it can."""
    if shutil.which(SYSTEM_PYTHON) is None:
        return f"there is no {SYSTEM_PYTHON}"
    found = subprocess.run(
        [SYSTEM_PYTHON, "-c", "import scipy, siconos.numerics"], capture_output=True, text=True
    )
    return "" if found.returncode == 0 else "apt-get install python3-siconos python3-scipy"


def siconos(
    problem: FrictionProblem, solver: str, tolerances: Sequence[float], budget_s: float
) -> list[PeerRun]:
    """Run a solver of Siconos, ``"3D_NSGS"``, at several tolerances of its own error.

    ``tolerances``: loose ones first; those beyond one that is not reached in time are not tried.
    ``budget_s``: processor seconds of a run.  A run that kills the process is reported, and the
    next tolerance tried.  A plane problem for a solver in space: see `in_space`.
    Raises `LibraryMissing` without Siconos.
    """
    if siconos_missing():
        raise LibraryMissing("Siconos is not installed", remedy=siconos_missing())
    if problem.dim == 2 and solver.startswith("3D"):
        return [
            replace(
                run, force=None if run.force is None else run.force.reshape(-1, 3)[:, :2].ravel()
            )
            for run in siconos(in_space(problem), solver, tolerances, budget_s)
        ]
    jobs = [
        {"solver": solver, "tolerance": t, "iterations": None, "budget_s": budget_s}
        | {"repeats": REPEATS, "batch_s": BATCH_S, "batch_most": BATCH_MOST}
        for t in tolerances
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        w = problem.delassus
        np.savez(
            folder / "problem.npz", dim=problem.dim, q=problem.offset, mu=problem.friction,
            data=w.data, indices=w.indices, indptr=w.indptr,
        )  # fmt: skip
        runs: list[PeerRun] = []
        left = list(enumerate(jobs))
        while left:
            (folder / "results.jsonl").unlink(missing_ok=True)
            (folder / "jobs.json").write_text(json.dumps(left))
            death = _siconos_process(folder)
            done = _siconos_results(folder, jobs)
            runs += [run for _, run in done]
            if not death:
                break
            ended = {number for number, _ in done}
            dead = next((n for n, _ in left if n not in ended), max(ended, default=left[0][0]))
            setting = {"tolerance": jobs[dead]["tolerance"], "iterations": "default"}
            if dead in ended:  # it died in a second run, with more iterations
                setting["iterations"] = "more"
            runs.append(PeerRun(setting, None, why=death))
            left = [] if death == "out of time" else [job for job in left if job[0] > dead]
    return runs


def _siconos_process(folder: Path) -> str:
    """Run the process; how it died, or nothing."""
    worker = Path(__file__).with_name("rigid_siconos.py")
    found = subprocess.run(
        [SYSTEM_PYTHON, str(worker), str(folder)],
        capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        | ONE_THREAD,
    )  # fmt: skip
    return death_words(found.returncode, found.stdout + found.stderr)


def death_words(code: int, said: str) -> str:
    """How a process ended, from its exit code and its output; nothing if it ended well."""
    if code == 0:
        return ""
    if code == -signal.SIGXCPU:
        return "out of time"
    last = next((line.strip() for line in reversed(said.splitlines()) if line.strip()), "")
    if code < 0:
        return f"died of {signal.Signals(-code).name}: {last}"[:200]
    return f"ended with code {code}: {last}"[:200]


def _siconos_results(folder: Path, jobs: list[dict[str, Any]]) -> list[tuple[int, PeerRun]]:
    path = folder / "results.jsonl"
    if not path.exists():
        return []
    found = []
    for row in map(json.loads, path.read_text().splitlines()):
        costs = row.get("repeats_s", [row["cost_s"]])
        setting = {"tolerance": jobs[row["number"]]["tolerance"], "iterations": row["allowed"]}
        run = PeerRun(
            setting, np.load(folder / f"force-{row['number']}-{row['allowed']}.npy"),
            float(np.median(costs)), tuple(costs), row["iterations"], "iterations",
            row["info"] == 0, "" if row["info"] == 0 else f"info = {row['info']}",
        )  # fmt: skip
        found.append((row["number"], run))
    return found


# --- convex programs --------------------------------------------------------------------------


def clarabel(
    problem: FrictionProblem, tolerance: float, budget_s: float, *, outer: int = OUTER
) -> PeerRun:
    """Coulomb's law by convex programs with ``mu |u_T|`` frozen, until the residual is small.

    Stops at the ``tolerance`` of the residual, after ``outer`` programs, after five that do not
    better the best answer, or out of time.  Each program is solved to a hundredth of the tolerance,
    between `FINEST` and 1e-8, W and q scaled to order one.  Raises `LibraryMissing`.
    """
    watch = Stopwatch()
    shape = (problem.contacts, problem.dim)
    program = (program_of_bodies if problem.bodies is not None else program_of_contacts)(problem)
    frozen = np.zeros(problem.contacts)
    best, least, since = np.zeros(len(problem.offset)), np.inf, 0
    while watch.calls < outer and watch.seconds < budget_s and since < 5:
        force = program(frozen, float(np.clip(0.01 * tolerance, FINEST, 1e-8)), watch)
        error = problem.residual(force) if np.isfinite(force).all() else np.inf
        since = 0 if error < 0.9 * least else since + 1
        if error < least:
            best, least = force, error
        if error <= tolerance:
            break
        velocity = problem.velocity(force).reshape(shape)
        frozen = problem.friction * np.linalg.norm(velocity[:, 1:], axis=1)
        if not np.isfinite(frozen).all():
            break
    solved = least <= tolerance
    why = "" if solved else f"{watch.calls} programs, last: {watch.words[-1]}"
    return PeerRun(
        {"tolerance": tolerance}, best, watch.seconds, (), watch.calls, "convex programs",
        solved, why,
    )  # fmt: skip


def clarabel_newton(problem: FrictionProblem, tolerance: float, budget_s: float) -> PeerRun:
    """One convex program to 1e-8, then semismooth Newton steps on the natural map."""
    begun = clarabel(problem, 1e-8, budget_s, outer=1)
    start, spent = begun.force, begun.cost_s or 0.0
    assert start is not None
    watch = Stopwatch()
    force, steps = watch(lambda: newton_polish(problem, start, tolerance, budget_s - spent))
    solved = problem.residual(force) <= tolerance
    return PeerRun(
        {"tolerance": tolerance}, force, spent + watch.seconds, (), steps, "Newton steps",
        solved, "" if solved else "Newton's steps stopped",
    )  # fmt: skip


def osqp(problem: FrictionProblem, tolerance: float) -> PeerRun:
    """Without friction: ``min f.A f/2 + b.f`` over f >= 0, polished; A and b are W's and q's normal
    parts.  Raises `LibraryMissing` without OSQP, `ValueError` with friction."""
    if problem.friction.any():
        raise ValueError("OSQP's problem has no friction")
    library = library_named("osqp")
    normal = slice(None, None, problem.dim)
    a = sp.csc_matrix(problem.delassus[normal, normal])
    b = np.ascontiguousarray(problem.offset[normal])
    identity = sp.csc_matrix(sp.eye_array(len(b)))
    watch = Stopwatch()

    def solve() -> Any:
        solver = library.OSQP()
        solver.setup(
            sp.triu(a, format="csc"), b, identity, np.zeros(len(b)), np.full(len(b), np.inf),
            verbose=False, polishing=True, eps_abs=tolerance, eps_rel=tolerance, max_iter=100_000,
        )  # fmt: skip
        return solver.solve(raise_error=False)

    found = watch(solve)
    force = np.zeros(len(problem.offset))
    force[normal] = np.maximum(np.nan_to_num(found.x), 0.0)
    solved = found.info.status == "solved"
    return PeerRun(
        {"tolerance": tolerance}, force, watch.seconds, (), found.info.iter, "iterations", solved,
        "" if solved else found.info.status,
    )  # fmt: skip
