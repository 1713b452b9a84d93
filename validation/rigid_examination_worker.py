"""One problem of the examination after another, in a process of its own that may be killed.

A process is given so many processor seconds a problem (the system ends it with SIGXCPU, compiled
code or not); what it had said by then is kept, and the next problem has a new one.
"""

from __future__ import annotations

import math
import multiprocessing
import resource
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numba.core.event import install_recorder

from rigid_lcp.energy_proof import gives_energy
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution
from rigid_lcp.solver import solve_friction
from validation.rigid_examination_beds import Posed
from validation.rigid_examination_families import family_named
from validation.rigid_examination_judge import residual_extended
from validation.rigid_peers import batch_size, clarabel_newton, death_words
from validation.rigid_problems import bodies_anew

Row = dict[str, Any]
MAKE_S, SOLVE_S = 300.0, 60.0
"""Processor seconds to make a problem, and to solve it, after which the process is ended."""
SHORT_S = 2.0
"""A solve of less, or one in which code was compiled, is timed again, the shortest as means over
`batch_size` runs: the first one loads the code it needs, and the clock may tick every 4 ms."""
RIVAL_S = 5.0
"""Processor seconds that Clarabel + Newton is given."""
SHARE_LEFT = 0.1
"""Of the natural map without forces; a solution leaves less."""


# --- in the process that asks -----------------------------------------------------------------


class Worker:
    """The process that makes and solves, begun when it is needed and again when it has died."""

    def __init__(self, begun_by: str = "spawn") -> None:
        self._context: Any = multiprocessing.get_context(begun_by)
        self._process: Any = None
        self._pipe: Connection | None = None

    def ask(self, job: str, family: str, seed: int, index: int, *more: Any) -> Row:
        """Do a job on a problem: what the process said of it, and under ``status`` how it died."""
        if self._process is None or not self._process.is_alive():
            self._pipe, other = self._context.Pipe()
            self._process = self._context.Process(target=_serve, args=(other,), daemon=True)
            self._process.start()
            other.close()
        assert self._pipe is not None
        said: Row = {}
        try:
            self._pipe.send((job, (family, seed, index), more))
            while "done" not in said:
                said |= self._pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            return said | {"status": death_words(self._process.exitcode or 1, "")}
        del said["done"]
        return said

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.terminate()
            self._process.join()
            self._process = None


# --- in the process that solves ---------------------------------------------------------------


def _serve(pipe: Connection) -> None:
    from validation.rigid_dantzig_runs import warm

    warm()
    jobs: dict[str, Callable[..., Row]] = {
        "solve": _solve,
        "repeat": _repeat,
        "rival": _rival,
        "save": _save,
    }
    known: tuple[Any, Posed | None] = (None, None)
    while True:
        job, task, more = pipe.recv()
        try:
            _limit(MAKE_S)
            if known[0] != task:
                start = time.process_time()
                name, seed, index = task
                posed = family_named(name).posed(seed, index)
                known = (task, posed)
                pipe.send(_described(posed) | {"make_s": time.process_time() - start})
            assert known[1] is not None
            _limit(SOLVE_S)
            pipe.send(jobs[job](known[1], *more) | {"done": True})
        except Exception as error:  # a failure is a result: it is recorded, the next one follows
            words = f"raised {type(error).__name__}: {error}".splitlines()[0][:200]
            pipe.send({"status": words, "done": True})


def _limit(seconds: float) -> None:
    """End this process when it has used so many processor seconds from now."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    most = math.ceil(used.ru_utime + used.ru_stime + seconds)
    resource.setrlimit(resource.RLIMIT_CPU, (most, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _described(posed: Posed) -> Row:
    problem = posed.problem
    return {
        "recipe": posed.recipe, "contacts": problem.contacts, "dim": problem.dim,
        "bar": posed.bar, "warm": posed.start is not None,
    }  # fmt: skip


def _solved(posed: Posed) -> tuple[FrictionSolution, float]:
    """`solve_friction` by default settings, and its processor seconds."""
    problem = posed.problem
    w = problem.delassus if problem.bodies is None else bodies_anew(problem)
    start = time.process_time()
    found = solve_friction(w, problem.offset, problem.friction, problem.dim, posed.start)
    return found, time.process_time() - start


def _solve(posed: Posed) -> Row:
    with install_recorder("numba:compile") as compiled:
        found, cost = _solved(posed)
    if cost < SHORT_S or compiled.buffer:
        _limit(SOLVE_S)
        cost = float(np.mean([_solved(posed)[1] for _ in range(batch_size(cost))]))
    residual, left = residual_extended(posed.problem, found.r)
    solved = residual <= posed.bar and left <= SHARE_LEFT
    return {
        "residual": residual, "left": left, "own_residual": found.residual,
        "ok": solved, "claims": found.solved,
        "status": found.status, "method": found.method, "cpu_s": cost,
        "factorisations": sum(n for k, n in found.work.items() if k.endswith("factorisations")),
    } | ({} if solved else {"gives_energy": gives_energy(posed.problem)})  # fmt: skip


def _repeat(posed: Posed, repeats: int) -> Row:
    costs = [_solved(posed)[1] for _ in range(repeats)]
    return {"cpu_s": float(np.median(costs)), "repeats_s": costs}


def _rival(posed: Posed) -> Row:
    found = clarabel_newton(posed.problem, posed.bar, RIVAL_S)
    assert found.force is not None
    cost = found.cost_s or 0.0
    if cost < SHORT_S:
        again = [
            clarabel_newton(posed.problem, posed.bar, RIVAL_S).cost_s or 0.0
            for _ in range(batch_size(cost))
        ]
        cost = float(np.mean(again))
    residual, left = residual_extended(posed.problem, found.force)
    return {
        "rival_residual": residual, "rival_s": cost,
        "rival_ok": residual <= posed.bar and left <= SHARE_LEFT,
    }  # fmt: skip


def _save(posed: Posed, path: str) -> Row:
    problem_write(Path(path), posed.problem, posed.start)
    return {}


def problem_write(path: Path, problem: FrictionProblem, start: Any = None) -> None:
    """A problem as `rigid_lcp.read_problem` reads it: ``NAME.npz`` and ``NAME_H.npz``, where the
    bodies are known by a diagonal M^-1, or ``NAME_W.npz``; the array start is for who solves it."""
    arrays: dict[str, Any] = {
        "q": problem.offset,
        "mu": problem.friction,
        "dim": np.array(problem.dim),
    }
    if start is not None:
        arrays["start"] = start
    path.parent.mkdir(parents=True, exist_ok=True)
    space = problem.bodies
    inverse = None if space is None else space.inverse_mass.diagonal()
    if space is not None and abs(space.inverse_mass - sp.diags_array(inverse)).max() == 0:
        arrays["Minv"] = inverse
        sp.save_npz(path.with_name(f"{path.stem}_H.npz"), space.jacobian)
    else:
        sp.save_npz(path.with_name(f"{path.stem}_W.npz"), problem.delassus)
    np.savez_compressed(path, **arrays)
