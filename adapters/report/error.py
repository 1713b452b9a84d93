"""Error against cost of a run beside its control: pure functions of tables and positions.

Speed-up S = T_full / T_procedure, where T is CPU time of the engine with all its processes and of
Python: engine, start-up, parsing, fitting, relaxing, everything else, and what failed jumps lost;
counted from the start of loading unless "with preparation" is said.  The paper quotes gained times
S - 1, so that its "180 %" is S = 2.8, and defines them nowhere.
"""

from dataclasses import dataclass
from math import nan

import numpy as np

from adapters.bed import FloatArray
from adapters.files import Outcome
from adapters.laws import Law
from adapters.laws.fit import compare_coordinates, compare_displacements
from adapters.procedure import History, find_speed_up

COORDINATION_BAR = 0.03
"""Greatest relative change of the coordination number, by a relaxation or against a control."""
HEIGHT_BAR = 0.05
"""Greatest change of the mean height by a relaxation over the jump's own settlement..."""
HEIGHT_LEAST = 0.01
"""...or over this share of the gain since the first jump, where that is more [-]: a jump that
settles nothing has no settlement to measure by."""


def find_relative_error(value: float, reference: float) -> float:
    """(value - reference) / |reference|; nan when the reference is zero or unknown."""
    return (value - reference) / abs(reference) if reference else nan


@dataclass(frozen=True)
class Comparison:
    """A way to the bed at one cycle, its errors against the full run, and its cost.

    Errors are relative and signed, except E_r; nan where not known.
    """

    name: str
    computed: int  # load cycles the engine computed for it
    loaded_body: float  # permanent settlement of the loaded body [m]
    loaded_body_error: float  # over what the full run gained since the state before the first jump
    settlement: float  # that of the mean grain [m]
    settlement_error: float  # likewise
    stiffness: float = nan  # secant, of the last `AVERAGED` cycles [N/m]
    stiffness_error: float = nan
    coordination_number: float = nan
    """Mean of the last `AVERAGED` cycles, as the elastic deflection."""
    coordination_number_error: float = nan
    elastic_deflection: float = nan  # [m]
    elastic_deflection_error: float = nan
    jump_displacement_error: float = nan
    """E_r (eq. 22) of the residual displacement since the state before the first jump."""
    coordinates_error: float = nan  # E_r of the coordinates, as in the paper: small for any method
    cpu_s: float = nan  # CPU time from the start of loading [s]
    speed_up: float = nan
    speed_up_with_preparation: float = nan


def compare_runs(
    name: str, own: History, own_cycle: int, full: History, full_cycle: int, preparation_s: float,
    beds: tuple[FloatArray | None, FloatArray, FloatArray] | None = None, before: int = 0,
) -> Comparison:  # fmt: skip
    """``own`` at its cycle ``own_cycle`` taken for the bed of ``full`` at ``full_cycle``.

    The two cycles differ for "jump and move nothing", which is the full run cut short.
    ``preparation_s``: CPU time of the preparation, the same for both [s].  E_r needs ``beds``,
    centres [m], (n, 3): before the first jump (the last state that both runs share; None without a
    jump), of the full run at its cycle, and of what is compared with it.  ``before``: the cycle of
    the first of them.
    """
    mine, truth = own.row(own_cycle), full.row(full_cycle)
    late: dict[str, float] = {}
    for column in ("stiffness", "coordination_number", "elastic_deflection"):
        late[column] = own.late_mean(column, own_cycle)
        error = find_relative_error(late[column], full.late_mean(column, full_cycle))
        late[f"{column}_error"] = error
    sunk, settled = float(own.loaded_body[mine]), float(own.settlement[mine])
    cost, full_cost = float(own.cpu_s[mine]), float(full.cpu_s[truth])
    displacement = coordinates = nan
    if beds is not None:
        before_jump, in_full, in_own = beds
        coordinates = compare_coordinates(in_full, in_own)
        # Without a move of the full run E_r has no denominator.
        if before_jump is not None and not np.array_equal(before_jump, in_full):
            displacement = compare_displacements(before_jump, in_full, in_own)
    return Comparison(
        name=name,
        computed=own.count_computed(own_cycle),
        loaded_body=sunk,
        loaded_body_error=full.gain_error(sunk, before, full_cycle, "loaded_body"),
        settlement=settled,
        settlement_error=full.gain_error(settled, before, full_cycle),
        **late,
        jump_displacement_error=displacement,
        coordinates_error=coordinates,
        cpu_s=cost,
        speed_up=find_speed_up(full_cost, cost),
        speed_up_with_preparation=find_speed_up(full_cost + preparation_s, cost + preparation_s),
    )


def extrapolate_curve(
    full: History, law: Law, first: int, last: int, cycle: int, of: str = "settlement"
) -> float:
    """Settlement ``of`` a column at ``cycle`` [m] by the law fitted from ``first`` to ``last``.

    No bed is relaxed or resubmitted; nan where the law needs more cycles.
    """
    rows = (full.cycle >= first) & (full.cycle <= last)
    if rows.sum() <= law.minimum_cycles:
        return nan
    parameters = law.fit(full.cycle[rows].astype(float), getattr(full, of)[rows])
    on = float(law.increment(parameters, float(last), float(cycle)))
    return float(getattr(full, of)[full.row(last)]) + on


@dataclass(frozen=True)
class JumpFigures:
    """What one jump did; lengths in m, nan where the run or its control does not say.

    Settlement is positive downwards.  ``law_error``, ``relaxation_change`` and ``healing_error``
    add up to what the jump and its healing cycles put between the run and its control.
    """

    stage: str
    first_cycle: int
    last_cycle: int
    loaded_body: float  # lowering of the loaded body over the jump
    loaded_body_truth: float  # that of the control over the same cycles
    estimated: float  # settlement of the mean grain over the jump by the law
    truth: float  # that of the control over the same cycles
    law_error: float  # ``estimated`` less ``truth``
    relaxation_change: float  # settlement that relaxation adds
    healing_error: float  # settlement of the healing cycles less that of the control's same cycles
    coordination_change: float
    """Relative change of the coordination number, walls counted, before the jump to relaxed."""
    height_change: float
    """|relaxed - estimated mean height| over the jump's own settlement, `HEIGHT_LEAST` at least."""


def measure_jump(stage: str, jump: Outcome, own: History, full: History | None) -> JumpFigures:
    """Figures of a finished jump from the record of its relaxation and the two tables."""
    record = jump.notes["relaxation"]
    estimated = change = coordination = height = nan
    if "relaxed" in record:
        heights = {when: record[when]["mean_height"] for when in ("before", "estimated", "relaxed")}
        estimated = heights["before"] - heights["estimated"]
        change = heights["estimated"] - heights["relaxed"]
        coordination = find_relative_error(
            record["relaxed"]["coordination_number"], record["before"]["coordination_number"]
        )
        jumped = own.kind.index("jumped") if "jumped" in own.kind else 0
        gained = own.gain(int(own.cycle[jumped - 1]) if jumped else 0, int(own.cycle[-1]))
        scale = np.fmax(abs(estimated), HEIGHT_LEAST * abs(gained))
        height = abs(change) / scale if scale else nan
    healed = jump.last_cycle
    for cycle, kind in zip(own.cycle, own.kind, strict=True):
        if kind == "healing" and cycle == healed + 1:
            healed = int(cycle)
    truth = healing = sunk = nan
    if full is not None:
        sunk = full.gain(jump.first_cycle, jump.last_cycle, "loaded_body")
        truth = full.gain(jump.first_cycle, jump.last_cycle)
        healing = own.gain(jump.last_cycle, healed) - full.gain(jump.last_cycle, healed)
    return JumpFigures(
        stage, jump.first_cycle, jump.last_cycle,
        own.gain(jump.first_cycle, jump.last_cycle, "loaded_body"), sunk,
        estimated, truth, estimated - truth, change, healing, coordination, height,
    )  # fmt: skip
