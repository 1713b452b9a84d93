"""Hard cases of rigid grains with known answers: thresholds, mass ratios, arches, jams, Painleve.

    trackbed validate rigid-hard-cases            some minutes
    trackbed validate rigid-hard-cases --quick    short runs of the same scenes

Ours only; `python -m validation.rigid_hard_page` runs MuJoCo, ODE and LMGC90 on the same scenes too
and writes ``docs/rigid-hard-cases.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from validation import rigid_scenes as scenes
from validation.case import Check
from validation.rigid_hard_further import (
    frame_trials,
    motion_rows,
    ratio_trials,
    rocking_rows,
    space_incline_rows,
    storey_rows,
)
from validation.rigid_hard_measures import (
    bounce_rows,
    card_threshold_rows,
    hopper_rows,
    light_on_heavy_rows,
    rod_rows,
)
from validation.rigid_hard_trials import (
    Row,
    arch_trials,
    card_trials,
    creep_trials,
    incline_trials,
    pile_trials,
    trial_rows,
    wedge_trials,
)

Family = Callable[[bool, Sequence[str]], list[Row]]

FAMILIES: dict[str, Family] = {
    "incline": lambda quick, peers: (
        trial_rows(incline_trials(quick), peers) + space_incline_rows(quick)
    ),
    "creep": lambda quick, peers: trial_rows(creep_trials(2_000 if quick else 100_000), peers),
    "cards": lambda quick, peers: trial_rows(card_trials(), peers) + card_threshold_rows(),
    "storeys": lambda quick, peers: storey_rows(peers),
    "wedge": lambda quick, peers: trial_rows(wedge_trials(), peers),
    "piles": lambda quick, peers: trial_rows(pile_trials(quick), peers) + light_on_heavy_rows(),
    "ratios": lambda quick, peers: trial_rows(ratio_trials(quick), peers),
    "frames": lambda quick, peers: trial_rows(frame_trials(quick), peers),
    "arch": lambda quick, peers: trial_rows(arch_trials(11, quick) + arch_trials(31, quick), peers),
    "rod": lambda quick, peers: rod_rows(peers),
    "bounce": lambda quick, peers: bounce_rows(1_000 if quick else 10_000, peers),
    "rocking": lambda quick, peers: rocking_rows(),
    "motion": lambda quick, peers: motion_rows(quick),
    "hopper": hopper_rows,
}
"""Hard cases by family: rows of ours and of the peers asked for."""


def hard_rows(
    quick: bool, peers: Sequence[str] = (), families: Sequence[str] | None = None
) -> dict[str, list[Row]]:
    """Rows by family; ``peers`` of `validation.rigid_scene_peers.PEERS`."""
    _compile()
    return {name: FAMILIES[name](quick, peers) for name in families or FAMILIES}


def run(quick: bool) -> list[Check]:
    """Ours against the bars."""
    return [row.check() for rows in hard_rows(quick).values() for row in rows]


def _compile() -> None:
    """One short run of every kind, so that no cost holds the time of a compiler."""
    scenes.stack(3).advance(2e-3)
    scenes.bouncing_disc(1e-3, 1.0, step=1e-2).advance(0.1)
    scenes.block_on_incline(0.1, 0.5, method="acceleration").advance(2e-3)
