"""The procedure of Karrech et al. (2007): prepare, compute, jump, relax, resubmit."""

from adapters.procedure import (
    run,
)
from adapters.procedure.checks import (
    FORCE_ERROR_GOAL,
    FORCE_START_CYCLES,
)
from adapters.procedure.history import (
    AVERAGED,
    History,
    cycles_computed,
    list_jumped_spans,
    sum_cost,
)
from adapters.procedure.progress import (
    Progress,
)
from adapters.procedure.record import (
    CONTROL,
    Record,
    Track,
    estimate_band_of_run,
    list_checks,
    list_decisions,
    read_run_record,
)
from adapters.procedure.run import (
    CONTROL_STILL,
    record_scene,
    refuse_differences,
)
from adapters.procedure.seating import (
    HUNG,
    find_hung_cycles,
    spans,
)
from adapters.procedure.status import (
    status,
)

__all__ = [
    "AVERAGED",
    "CONTROL",
    "CONTROL_STILL",
    "FORCE_ERROR_GOAL",
    "FORCE_START_CYCLES",
    "HUNG",
    "History",
    "Progress",
    "Record",
    "Track",
    "cycles_computed",
    "estimate_band_of_run",
    "find_hung_cycles",
    "list_checks",
    "list_decisions",
    "list_jumped_spans",
    "read_run_record",
    "record_scene",
    "refuse_differences",
    "run",
    "spans",
    "status",
    "sum_cost",
]
