"""The procedure of Karrech et al. (2007): prepare, compute, jump, relax, resubmit."""

from adapters.procedure import run
from adapters.procedure.checks import FORCE_ERROR_GOAL, FORCE_START_CYCLES
from adapters.procedure.history import AVERAGED, History, list_jumped_spans, sum_cost
from adapters.procedure.progress import Progress
from adapters.procedure.record import (
    CONTROL,
    Record,
    Track,
    estimate_band_of_run,
    find_comparable_cycle,
    list_checks,
    list_decisions,
    read_run_record,
    to_plain,
)
from adapters.procedure.run import record_scene, refuse_differences
from adapters.procedure.seating import HUNG, find_hung_cycles, spans
from adapters.procedure.status import describe_result, judge_progress, status

__all__ = [
    "AVERAGED", "CONTROL", "FORCE_ERROR_GOAL", "FORCE_START_CYCLES", "HUNG", "History", "Progress",
    "Record", "Track", "describe_result", "estimate_band_of_run", "find_comparable_cycle",
    "find_hung_cycles", "judge_progress", "list_checks", "list_decisions", "list_jumped_spans",
    "read_run_record", "record_scene", "refuse_differences", "run", "spans", "status", "sum_cost",
    "to_plain",
]  # fmt: skip
