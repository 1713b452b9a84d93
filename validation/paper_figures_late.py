"""Figs 6 and 7 at the paper's k_i of 500: full runs of the ensemble, computed on from there.

    python -m validation.paper_figures_late --work FOLDER [--packings N ...]

The first member of each packing goes on from cycle 500 for as many cycles as the longest window and
jump take, ten a process; a kill loses the ten in progress.  Some ten CPU minutes a packing.  Jumps
are measured on its positions as `validation.paper_figures` does on the stored run's, and take their
place in its record, a packing as a run of its own.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from adapters.engine import interruptible
from adapters.procedure import CONTROL, settle
from adapters.run_folder import RunFolder
from adapters.state import FloatArray
from adapters.window import window_load
from validation.paper_figures import JUMPS, LATE_RUNS, PAPER_LAST, WINDOWS, Row, jump_row, rows_put
from validation.settlement_ensemble import CONFINED, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay
from validation.settlement_rivals import run_in

LAST = PAPER_LAST + max(WINDOWS) + max(JUMPS)
LATE = replace(
    CONFINED,
    settings=(f"procedure.total_cycles={LAST}", "procedure.k=10", "procedure.h=0"),
)


def positions_late(seed: int, folder: Path) -> FloatArray:
    """Compute a packing's run on, in ``folder``: positions at the ends of cycles, (c, n, 3) [m].

    Row 0 is the bed after the rain, rows from `PAPER_LAST` on those cycles; between them nan.
    """
    record, piece = EnsembleRecord(), Piece(CONFINED, seed, 0)
    run = run_in(folder, LATE.scene(seed), CONTROL)
    packing_lay(run, piece, record)
    settle(run)
    _, start = record.states(Piece(CONFINED, seed).name)
    position = np.full((LAST + 1, *start[0].shape), np.nan)
    position[0] = start[0]
    for path in sorted(folder.glob("window_*/states.npz")):
        window = window_load(path)
        position[window.cycle.astype(int)] = window.position
    return position


def rows_late(seed: int, folder: Path) -> list[Row]:
    """Figs 6 and 7 of a packing at k_i = `PAPER_LAST`, every k and h."""
    position = positions_late(seed, folder)
    jumps = product((PAPER_LAST,), WINDOWS, JUMPS)
    return [jump_row(position, position[:1], jump, LATE_RUNS[seed - 1]) for jump in jumps]


def main(words: Sequence[str] | None = None) -> None:
    """Compute and measure packing after packing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for the engine's files")
    parser.add_argument(
        "--packings", type=int, nargs="+", default=range(1, len(LATE_RUNS) + 1), metavar="N"
    )
    arguments = parser.parse_args(words)
    for seed in arguments.packings:
        with interruptible(), RunFolder(arguments.work).locked():
            rows = rows_late(seed, arguments.work / LATE_RUNS[seed - 1])
        rows_put(rows)
        print(f"packing {seed}: measured", flush=True)


if __name__ == "__main__":
    main()
