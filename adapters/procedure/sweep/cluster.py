"""Where the members of a sweep run: threads here, a Dask cluster that is there, or SLURM jobs."""

import os
import tomllib
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from adapters.errors import EngineMissing, UsageError

LOCAL, SLURM = "local", "slurm"
"""Names for ``--scheduler``; anything else is the address of a scheduler."""
CONNECT_S = 30
"""How long a scheduler may take to answer [s]."""
EXTRA = "pip install 'trackbed[sweep]'"


def check_libraries(scheduler: str) -> None:
    """Raise `EngineMissing` before anything starts where a library of the extra is missing."""
    from importlib.util import find_spec

    needed = {LOCAL: (), SLURM: ("distributed", "dask_jobqueue")}.get(scheduler, ("distributed",))
    if missing := [name for name in needed if find_spec(name) is None]:
        what = f"a sweep by --scheduler {scheduler} needs {', '.join(missing)}"
        raise EngineMissing(what, remedy=EXTRA)


@dataclass(frozen=True)
class Cluster:
    """Where a sweep runs."""

    scheduler: str = LOCAL  # `LOCAL`, `SLURM` or the address of a Dask scheduler
    config: Path | None = None  # TOML file with the keywords of `dask_jobqueue.SLURMCluster`
    workers: int | None = None
    """Members at a time here, or SLURM jobs; None: as many as processors, or as members."""


@contextmanager
def open_executor(cluster: Cluster, members: int) -> Iterator[Executor]:
    """What members are handed to, closed at the end, and with it what was started for it.

    Raises `UsageError` where the scheduler does not answer or the configuration is wrong.
    """
    if cluster.scheduler == LOCAL:
        most = cluster.workers or len(os.sched_getaffinity(0))
        with ThreadPoolExecutor(min(most, members)) as threads:
            yield threads
        return
    import distributed

    with ExitStack() as stack:
        place: Any = cluster.scheduler
        if cluster.scheduler == SLURM:
            place = stack.enter_context(_open_slurm(cluster.config))
            jobs = cluster.workers or members
            place.adapt(minimum_jobs=jobs, maximum_jobs=jobs)  # a job that is lost is replaced
        try:
            client = stack.enter_context(distributed.Client(place, timeout=CONNECT_S))
        except (OSError, ValueError) as error:
            raise UsageError(
                f"no Dask scheduler answers ({error})",
                where=f"--scheduler {cluster.scheduler}",
                remedy="give local, slurm, or the address that dask-scheduler printed, such as "
                "tcp://node1:8786",
            ) from error
        yield client.get_executor(pure=False)


def _open_slurm(config: Path | None) -> Any:
    """A `dask_jobqueue.SLURMCluster` with the keywords of a TOML file, besides Dask's own files."""
    from dask_jobqueue.slurm import SLURMCluster

    keywords: dict[str, Any] = {}
    if config is not None:
        try:
            keywords = tomllib.loads(config.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise UsageError(f"cannot read it as TOML ({error})", where=str(config)) from error
    try:
        return SLURMCluster(**keywords)
    except (TypeError, ValueError) as error:
        raise UsageError(
            f"dask-jobqueue does not take this ({error})",
            where=str(config) if config else "--scheduler slurm",
            remedy="write the keywords of dask_jobqueue.SLURMCluster to --cluster-config FILE: "
            'cores = 1, processes = 1, memory = "2GB", walltime = "24:00:00", queue = "..."',
        ) from error
