"""Several seeds and values of a scene's keys, side by side."""

from adapters.procedure.sweep.cluster import Cluster, check_libraries
from adapters.procedure.sweep.plan import check_folder, plan_sweep
from adapters.procedure.sweep.results import write_results
from adapters.procedure.sweep.run import list_dry_run, make_sweep_record, run_sweep

__all__ = [
    "Cluster", "check_folder", "check_libraries", "list_dry_run", "make_sweep_record", "plan_sweep",
    "run_sweep", "write_results",
]  # fmt: skip
