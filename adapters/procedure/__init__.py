"""The procedure of Karrech et al. (2007): prepare, compute, jump, relax, resubmit."""

from adapters.procedure import run
from adapters.procedure.checks import BOUNDS
from adapters.procedure.forecast import estimate_gain, estimate_sinking
from adapters.procedure.history import AVERAGED, History, find_speed_up, make_plain, sum_cost
from adapters.procedure.members import Settled, describe_result, estimate_mean, judge_members
from adapters.procedure.progress import Progress
from adapters.procedure.record import CONTROL, Record, Track, read_run_record, read_track
from adapters.procedure.run import refuse_differences, refuse_unloaded
from adapters.procedure.seating import SEATING, find_hung_cycles, format_spans
from adapters.procedure.stages import settle_by
from adapters.procedure.status import judge_progress, read_status

__all__ = [
    "AVERAGED", "BOUNDS", "CONTROL", "SEATING", "History", "Progress", "Record", "Settled", "Track",
    "describe_result", "estimate_gain", "estimate_mean", "estimate_sinking",
    "find_hung_cycles", "find_speed_up", "format_spans", "judge_members", "judge_progress",
    "make_plain", "read_run_record", "read_status", "read_track", "refuse_differences",
    "refuse_unloaded", "run", "settle_by", "sum_cost",
]  # fmt: skip
