"""Figs 11 and 12 of Karrech et al. (2007): their bed by jumps of several k and h, and in full.

    python -m validation.paper_convergence_runs --work FOLDER [--only WAY ...]

Goes on where the record and FOLDER end, as `validation.jump_runs` does; some two and a half CPU
hours.  The procedure is the project's (law log, smoothed move, smallest move, five healing cycles),
begun as in Fig. 11 after k_i = 10 cycles.
"""

from __future__ import annotations

from adapters.procedure import CONTROL, control_perturbed
from adapters.report_record import track_read
from adapters.residual import error_of_coordinates, error_of_displacement
from adapters.run_folder import RunFolder
from validation.jump_runs import RESULTS, Study, Way, go_on

JUMPS = (
    (10, 10), (20, 10), (40, 10), (40, 5), (40, 20), (40, 40), (20, 40), (10, 40), (10, 50),
)  # fmt: skip
"""k and h; the last three for the gained times of Fig. 12, 180 % among them."""
STILL = 'procedure.move="still"'
LAST = 150


def facts(here: RunFolder, full: RunFolder) -> dict[str, float]:
    """Fig. 12c: E_r (eq. 22) at the end, of coordinates and of displacements since cycle 0."""
    mine, truth = track_read("", here), track_read("", full)
    start, there = truth.start().position, truth.position(LAST)
    return {
        "coordinates": error_of_coordinates(there, mine.position(LAST)),
        "displacement": error_of_displacement(start, there, mine.position(LAST)),
    }


def jumping(k: int, h: int, *settings: str) -> tuple[str, ...]:
    """Settings of a run with fixed jumps."""
    return (f"procedure.k={k}", f"procedure.h={h}", *settings)


STUDY = Study(
    scene_name="karrech",
    settings=(),
    k_i=10,
    shared=10,
    last=LAST,
    seeds=1,
    ways=(
        Way("full", jumping(10, 10), CONTROL),
        *(Way(f"k {k}, h {h}", jumping(k, h)) for k, h in JUMPS),
        Way("another member", jumping(10, 10), control_perturbed(1)),
        Way("k 20, h 10, nothing moved", jumping(20, 10, STILL)),
    ),
    record=RESULTS / "paper-convergence.jsonl",
    facts=facts,
)

if __name__ == "__main__":
    go_on(STUDY)
