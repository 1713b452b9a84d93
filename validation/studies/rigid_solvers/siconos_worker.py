"""One solver of Siconos on one friction problem, in a process of its own: it may abort.

    /usr/bin/python3 siconos_worker.py FOLDER SOLVER TOLERANCE BUDGET

Started by `peers` with the system's Python, for which ``apt-get install python3-siconos
python3-scipy`` installs Siconos.  FOLDER holds ``problem.npz``; ``force-K.npy`` and
``results.json`` are written there.  A run that stops at its number of iterations is made again
with up to ten times as many while there is time.  SIGXCPU ends what takes twice its BUDGET [s].
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

MORE, WORTH = 10.0, 2.0
"""Most times as many iterations, and the least for which a run is made again."""


def main(folder: Path, solver: str, tolerance: float, budget_s: float) -> None:
    """Solve from zero, and again with more iterations."""
    import scipy.sparse as sp

    numerics: Any = import_module("siconos.numerics")
    arrays = np.load(folder / "problem.npz")
    dim, q, mu = int(arrays["dim"]), arrays["q"], arrays["mu"]
    sparse = sp.csr_matrix((arrays["data"], arrays["indices"], arrays["indptr"]))
    # the drivers of the plane refuse sparse matrices
    matrix = np.asfortranarray(sparse.toarray()) if dim == 2 else sparse.tocsc()
    resource.setrlimit(resource.RLIMIT_CPU, (int(2 * budget_s) + 3, resource.RLIM_INFINITY))
    option = numerics.SolverOptions(getattr(numerics, f"SICONOS_FRICTION_{solver}"))
    option.dparam[numerics.SICONOS_DPARAM_TOL] = tolerance
    driver = numerics.fc2d_driver if dim == 2 else numerics.fc3d_driver
    results: list[dict[str, Any]] = []
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it converts indices to 64 bits, and says so
            posed = numerics.FrictionContactProblem(dim, len(mu), matrix, q, mu)
        force, velocity = np.zeros(len(q)), np.zeros(len(q))
        start = time.thread_time()
        info = driver(posed, force, velocity, option)
        cost = time.thread_time() - start
        np.save(folder / f"force-{len(results)}.npy", force)
        results.append({"cost_s": cost, "claims": int(info) == 0})
        (folder / "results.json").write_text(json.dumps(results))
        allowed = int(option.iparam[numerics.SICONOS_IPARAM_MAX_ITER])
        short = option.iparam[numerics.SICONOS_IPARAM_ITER_DONE] >= allowed - 1
        more = min(MORE, budget_s / max(cost, 1e-6))
        if int(info) == 0 or not short or more < WORTH:
            return
        option.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = int(more * allowed)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
