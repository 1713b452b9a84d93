"""The picture of docs/settlement-ensemble.md: settlement of every run, a panel a kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from validation.settlement_ensemble import KINDS
from validation.settlement_ensemble_reading import curves
from validation.settlement_ensemble_record import EnsembleRecord

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9")
"""One a packing; told apart by colour-blind readers too (Okabe and Ito)."""


def draw(record: EnsembleRecord, target: Path) -> None:
    """Settlement since the rain over the cycle, packings by colour; kinds that have begun."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = {kind: curves(kind, record) for kind in KINDS.values()}
    shown = {kind: runs for kind, runs in found.items() if runs}
    figure, axes = plt.subplots(
        1, max(len(shown), 1), figsize=(4.2 * max(len(shown), 1), 3.4), layout="constrained"
    )
    for axis, (kind, runs) in zip(np.atleast_1d(axes), shown.items(), strict=False):
        for piece, curve in runs.items():
            colour = COLOURS[(piece.seed - 1) % len(COLOURS)]
            label = f"packing {piece.seed}" if piece.member is None else None
            axis.plot(curve["cycle"], 1e6 * curve["settlement"], color=colour, lw=1, label=label)
        axis.axvline(kind.k_i, color="0.7", lw=0.8)
        axis.set(xscale="log", xlabel="load cycle", title=kind.title)
        axis.set_ylabel("settlement since the rain [µm]")
        axis.title.set_fontsize(9)
        axis.legend(frameon=False, fontsize=8)
    figure.savefig(target, dpi=80)
    plt.close(figure)
