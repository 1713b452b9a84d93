"""Siconos on one friction problem, in a process of its own: its solvers may abort it.

    /usr/bin/python3 validation/rigid_siconos.py FOLDER

Started by `rigid_peers` with the system's Python, for which ``apt-get install python3-siconos
python3-scipy`` installs Siconos.  FOLDER holds ``problem.npz`` and ``jobs.json``; a line is added
to ``results.jsonl`` for every run as it ends, and its forces are ``force-N.npy``.  A run that takes
more processor time than it may ends the process with the signal SIGXCPU.
"""

from __future__ import annotations

import json
import resource
import sys
import time
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

GROWTH, WORTH = 10.0, 2.0
"""A run that stopped at its number of iterations is made again with up to ten times as many, if
there is time for twice as many and the forces were not the same as before."""
SAME, SHORT_S = 1e-14, 0.2
PILOT = 20
"""Iterations that show what one costs, so that the first run ends in time."""
TOGETHER = 3.0
"""All runs of a solver on a problem end when they have taken so many times what one may."""


def run(numerics: Any, problem: Any, job: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """One solve from zero: what Siconos says of it, and its forces."""
    dim, matrix, q, mu = problem
    option = numerics.SolverOptions(getattr(numerics, f"SICONOS_FRICTION_{job['solver']}"))
    option.dparam[numerics.SICONOS_DPARAM_TOL] = job["tolerance"]
    if job["iterations"] is not None:
        option.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = job["iterations"]
    allowed = int(option.iparam[numerics.SICONOS_IPARAM_MAX_ITER])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it converts indices to 64 bits, and says so
        posed = numerics.FrictionContactProblem(dim, len(mu), matrix, q, mu)
    force, velocity = np.zeros(len(q)), np.zeros(len(q))
    driver = numerics.fc2d_driver if dim == 2 else numerics.fc3d_driver
    start = time.process_time()
    info = driver(posed, force, velocity, option)
    cost = time.process_time() - start
    done = int(option.iparam[numerics.SICONOS_IPARAM_ITER_DONE])
    return {"info": int(info), "cost_s": cost, "iterations": done, "allowed": allowed}, force


def affordable(numerics: Any, problem: Any, job: dict[str, Any]) -> int | None:
    """Iterations that the time is enough for, or None where it is enough for the default."""
    if not job["solver"].endswith(("NSGS", "ADMM", "CPG", "PROX")):
        return None
    pilot, _ = run(numerics, problem, job | {"iterations": PILOT})
    default, _ = run(numerics, problem, job | {"iterations": None, "tolerance": 1e30})
    each = pilot["cost_s"] / max(pilot["iterations"], 1)
    return None if each * default["allowed"] <= job["budget_s"] else int(job["budget_s"] / each)


def matrix_of(arrays: Any, dim: int) -> Any:
    """W as the drivers take it: dense in 2D, where they refuse sparse ones, columns in 3D."""
    import scipy.sparse as sp

    sparse = sp.csr_matrix((arrays["data"], arrays["indices"], arrays["indptr"]))
    return np.asfortranarray(sparse.toarray()) if dim == 2 else sparse.tocsc()


def main(folder: Path) -> None:
    """Make the runs of the folder, loose tolerances first, until one is not reached."""
    numerics = import_module("siconos.numerics")
    arrays = np.load(folder / "problem.npz")
    dim = int(arrays["dim"])
    problem = dim, matrix_of(arrays, dim), arrays["q"], arrays["mu"]
    jobs = json.loads((folder / "jobs.json").read_text())
    begun = time.process_time()
    allowed = affordable(numerics, problem, jobs[0][1]) if jobs else None
    for number, job in jobs:
        budget, last = job["budget_s"], np.full(len(problem[2]), np.nan)
        if time.process_time() - begun > TOGETHER * budget:
            break
        if allowed is not None:  # with fewer it would stop at a point that is recorded already
            job = job | {"iterations": allowed}
        while True:
            limit = time.process_time() + 2 * budget + job["repeats"] * job["batch_s"]
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, resource.RLIM_INFINITY))
            start = time.perf_counter()
            result, force = run(numerics, problem, job)
            wall = time.perf_counter() - start
            if wall < min(budget / 10, SHORT_S):
                batch = int(np.clip(np.ceil(job["batch_s"] / wall), 1, job["batch_most"]))
                result["repeats_s"] = [
                    float(np.mean([run(numerics, problem, job)[0]["cost_s"] for _ in range(batch)]))
                    for _ in range(job["repeats"])
                ]
            np.save(folder / f"force-{number}-{result['allowed']}.npy", force)
            with (folder / "results.jsonl").open("a") as stream:
                stream.write(json.dumps({"number": number} | result) + "\n")
            more = min(GROWTH, budget / max(result["cost_s"], 1e-6))
            short = result["info"] != 0 and result["iterations"] >= result["allowed"] - 1
            if (
                not short
                or more < WORTH
                or np.allclose(force, last, rtol=0, atol=SAME * max(abs(force)))
            ):
                break
            last, allowed = force, int(more * result["allowed"])
            job = job | {"iterations": allowed}
        if result["info"] != 0:
            break  # what it could not reach, it can not better


if __name__ == "__main__":
    main(Path(sys.argv[1]))
