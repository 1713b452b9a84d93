"""What shows that a hard case ended right: laws that the contacts keep, and what its physics asks.

Every run that ends: the piston's force is that of the load in the mean, and jumps keep contacts
and overlaps.  The other checks are named by the cases.  Coulomb's bound is none of them: a parting
contact is damped along the tangent while its normal force vanishes, so LIGGGHTS exceeds it there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from adapters.checks import FORCE_START_CYCLES
from adapters.jump_seating import HUNG, SEATING, deflection_over_mean_field
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.state import FloatArray
from adapters.window import Window, window_load
from validation.case import Check
from validation.settlement_hard_beds import crystal_deflection, crystal_hollows

CLOSEST = float(np.pi / np.sqrt(18))
"""Relative density of the closest packing of equal grains, 0.7405."""
ISOSTATIC, ISOSTATIC_FRICTION = 3.0, 2.0
"""Contacts over grains, each contact counted once, where forces are just as many as equations of
balance: 1 force and 3 equations a sphere without friction, 3 forces and 6 equations with it."""


@dataclass(frozen=True)
class Ended:
    """A run that ended."""

    scene: Scene
    path: Path

    @cached_property
    def folder(self) -> RunFolder:
        """Its folder."""
        return RunFolder(self.path)

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of its settlement table."""
        return [row for outcome in self.folder.outcomes() for row in outcome.rows]

    @cached_property
    def windows(self) -> list[Window]:
        """Its windows of load cycles."""
        return [window_load(path) for path in sorted(self.path.glob("window_*/states.npz"))]

    @cached_property
    def settlement(self) -> FloatArray:
        """Settlement of each row [m]."""
        return np.array([row["settlement"] for row in self.rows])

    @cached_property
    def figures(self) -> dict[str, float]:
        """What the rain left: densities and contacts."""
        outcome = self.folder.outcome("preparation")
        assert outcome is not None
        figures = outcome.notes["figures"]
        counted = figures["coordination"]
        # Contacts with walls are counted once, pairs twice: once each is what balance asks for.
        contacts = counted["with_walls"] - counted["grains"] / 2
        return {
            "density": figures["relative_density"],
            "contacts": contacts / (1 - counted["rattler_share"]),
        }


def frictionless(run: Ended) -> Check:
    """Without friction no contact has a tangential force [N], nor is one carried over a jump."""
    forces = [c.tangential_force for window in run.windows for c in window.contacts]
    greatest = max(float(np.abs(force).max(initial=0.0)) for force in forces)
    return Check("greatest tangential force", greatest, "= 0", greatest == 0, "N")


def piston_force(run: Ended) -> Check:
    """Mean force of the piston over the mean of the load, behind the first cycles."""
    steps, ratios = run.scene.steps_per_cycle, []
    for window in run.windows:
        track = window.piston
        rows = track.cycles(steps) >= min(FORCE_START_CYCLES, len(window) - 1)
        ratios.append(float(track.contact_force[rows].sum() / track.target_force[rows].sum()))
    worst = max(ratios, key=lambda ratio: abs(ratio - 1))
    return Check(
        "mean force of the piston over the load's", worst, "1 +- 0.03", abs(worst - 1) < 0.03
    )


def carried(run: Ended) -> Check:
    """The piston stands on the bed, and is not said to hang: the rule's false alarms."""
    assert run.scene.procedure is not None
    begin = SEATING * run.scene.procedure.k_i
    rows = [row for row in run.rows if row["kind"] == "computed" and row["cycle"] > begin]
    greatest = float(np.nanmax(deflection_over_mean_field(run.scene, rows)))
    return Check(
        "elastic deflection over the mean field's", greatest, f"<= {HUNG:g}", greatest <= HUNG
    )


def jumps(run: Ended) -> list[Check]:
    """Contacts and overlaps of every jump, and what it settles."""
    checks = []
    for outcome in run.folder.outcomes():
        if outcome.stage != "jump":
            continue
        record = outcome.notes["relaxation"]
        change = abs(record["coordination_change"])
        deepest = record["relaxed"]["max_penetration"] / record["before"]["max_penetration"]
        checks += [
            Check("jump: contacts a grain, change", change, "< 0.03", change < 0.03),
            Check("jump: greatest overlap over that before", deepest, "< 1.05", deepest < 1.05),
        ]
    if not checks:
        checks = [Check("a jump was made", 0.0, "= 1", False)]
    return checks


def settles(run: Ended) -> Check:
    """A bed under load settles on: behind the jump it never stands higher than before by more than
    twice what it moved in any one cycle before.
    """
    first = [row["kind"] for row in run.rows].index("jumped")
    gained = float(run.settlement[first:].min() - run.settlement[first - 1])
    scatter = float(np.abs(np.diff(run.settlement[:first])).max())
    bar = -2 * scatter
    return Check(
        "least settlement behind the jump, over that before",
        gained,
        f"> {bar:.2g}",
        gained > bar,
        "m",
    )


def stands_still(run: Ended) -> Check:
    """A bed that has nothing to settle by: it drifts by less than a hundredth of a mean radius.

    Mean of the last cycles less that of the k behind k_i: at a cycle's end grains still move.
    """
    procedure = run.scene.procedure
    assert procedure is not None
    first, k = procedure.k_i, procedure.window_cycles
    drift = abs(float(run.settlement[-k:].mean() - run.settlement[first : first + k].mean()))
    bar = 0.01 * run.scene.sample.grain_radius.mean
    return Check("drift of the settlement behind k_i", drift, f"< {bar:.2g}", drift < bar, "m")


def does_not_settle(run: Ended) -> Check:
    """A crystal can not pack closer: half a hundredth of a radius, its seams taken up, is all."""
    greatest = float(np.abs(run.settlement).max())
    bar = 0.005 * run.scene.sample.grain_radius.mean
    return Check("greatest settlement", greatest, f"< {bar:.2g}", greatest < bar, "m")


def nothing_invented(run: Ended) -> Check:
    """The jump itself settles a bed that is at rest by next to nothing."""
    first = [row["kind"] for row in run.rows].index("jumped")
    gained = abs(float(run.settlement[first] - run.settlement[first - 1]))
    bar = 0.001 * run.scene.sample.grain_radius.mean
    return Check("settlement of the jump alone", gained, f"< {bar:.2g}", gained < bar, "m")


def hollows(run: Ended) -> Check:
    """Every grain of a crystal keeps the four that it stands on, cycle after cycle."""
    least = min(row["coordination_number"] for row in run.rows) * run.scene.grain_count / 2
    bar = crystal_hollows()
    return Check("fewest contacts between grains", least, f">= {bar}", least > bar - 0.5)


def crystal_stiff(run: Ended) -> Check:
    """Elastic deflection of a crystal, mean of the last cycles, beside `crystal_deflection`."""
    assert run.scene.procedure is not None
    last = [row["elastic_deflection"] for row in run.rows[-run.scene.procedure.window_cycles :]]
    ratio = float(np.mean(last)) / crystal_deflection(run.scene)
    ok = abs(ratio - 1) < 0.15
    return Check("elastic deflection over the closed form's", ratio, "1 +- 0.15", ok)


def very_loose(run: Ended) -> Check:
    """Looser than rain leaves a bed whose contacts slide (`ordinary`: 0.53)."""
    value = run.figures["density"]
    return Check("relative density after the rain", value, "< 0.51", value < 0.51)


def compacts(run: Ended) -> Check:
    """The load packs a loose bed: its density grows by a hundredth and more, jump and all."""
    value = run.rows[-1]["relative_density"] - run.figures["density"]
    return Check("relative density gained", value, "> 0.01", value > 0.01)


def isostatic(run: Ended) -> Check:
    """A bed at rest without friction has as many contacts as its forces can be determined by."""
    value = run.figures["contacts"]
    ok = abs(value - ISOSTATIC) < 0.1
    return Check("contacts over grains after the rain", value, "3 +- 0.1", ok)


def loose(run: Ended) -> Check:
    """Friction needs fewer contacts, but not less than determine its forces."""
    value = run.figures["contacts"]
    ok = ISOSTATIC_FRICTION <= value < ISOSTATIC
    return Check("contacts over grains after the rain", value, "2 to 3", ok)


def below_crystal(run: Ended) -> Check:
    """Nothing packs more closely than the crystal."""
    density = max(row["relative_density"] for row in run.rows)
    return Check("greatest relative density", density, f"< {CLOSEST:.4f}", density < CLOSEST)


NAMED: dict[str, Callable[[Ended], Check]] = {
    "settles": settles,
    "stands still": stands_still,
    "frictionless": frictionless,
    "isostatic": isostatic,
    "loose": loose,
    "below crystal": below_crystal,
    "does not settle": does_not_settle,
    "nothing invented": nothing_invented,
    "hollows": hollows,
    "crystal stiff": crystal_stiff,
    "very loose": very_loose,
    "compacts": compacts,
}
"""Checks that cases name."""


def checks_of(run: Ended, names: tuple[str, ...]) -> list[Check]:
    """Checks of every run that ended, and those that its case names."""
    return [piston_force(run), carried(run), *jumps(run), *(NAMED[name](run) for name in names)]
