"""Laws and the prediction band on measured and computed settlement series.

The environment variable TRACKBED_DATA names a folder with ``ballast_triaxial/*.txt``, lines
``N, strain`` of cyclic triaxial tests on ballast (Sun, Indraratna and Nimbalkar 2016), and
``full_runs/*.npz`` (see `jump_without_engine`).  Each series is cut at several cycles, fitted, and
predicted to r times its last cycle.  Nothing is tuned to them: the exponents of the band are
bounds of mechanics (shakedown, constant rate), its noise is the residuals' own.

The bar is on the law `log`: the 90 % band holds the truth in at least 80 % of the cases (cuts of
one series are no independent trials: 12 ballast series, one bed).  Errors and widths are measured,
without a bar.  So is the bursty bed of 150 grains: it breaks the band's assumption.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from adapters.fit import Series, fit_series
from adapters.laws import law_named
from adapters.state import FloatArray
from validation.case import Check
from validation.cases.jump_without_engine import data_folder, skipped

REACHES = (2.0, 10.0)
"""Last predicted over last fitted cycle."""
BALLAST_CUTS = (100.0, 300.0, 1e3, 3e3, 1e4)
WINDOWS = ((1, 30), (10, 30), (15, 30), (10, 50), (25, 50), (10, 100), (50, 100), (75, 150))
"""First and last fitted cycle of the full runs."""
COVERAGE_BAR = 0.8

Case = tuple[Series, float, float]
"""A series cut short, the cycle to predict, and the value there."""


def ballast_cases(folder: Path, reach: float) -> Iterator[Case]:
    """Ballast series with at least five points before each cut."""
    for path in sorted((folder / "ballast_triaxial").glob("*.txt")):
        cycle, first = np.unique(np.loadtxt(path, delimiter=",")[:, 0], return_index=True)
        strain = np.loadtxt(path, delimiter=",")[first, 1]
        for cut in BALLAST_CUTS:
            known = cycle <= cut
            to_cycle = reach * cycle[known][-1]
            if known.sum() >= 5 and to_cycle <= cycle[-1]:
                truth = np.interp(np.log(to_cycle), np.log(cycle), strain)
                yield Series(cycle[known], strain[known]), to_cycle, float(truth)


def run_cases(run: Path, reach: float) -> Iterator[Case]:
    """Windows of the mean settlement of a full run."""
    with np.load(run) as data:
        settlement: FloatArray = -1e-6 * data["displacement_um"][:, :, 2].mean(axis=1, dtype=float)
    for first, last in WINDOWS:
        if reach * last < len(settlement):
            cycle = np.arange(first, last + 1)
            series = Series(cycle.astype(float), settlement[cycle])
            yield series, reach * last, float(settlement[int(reach * last)])


def run(quick: bool) -> list[Check]:
    """Coverage of the band and errors of all laws; ``quick`` leaves the other laws out."""
    folder = data_folder()
    if folder is None:
        return skipped()
    checks = []
    for law_name in ("log",) if quick else ("log", "linear", "log-linear", "karrech2007"):
        law = law_named(law_name)
        for reach in REACHES:
            sources = {
                "ballast": list(ballast_cases(folder, reach)),
                "1,085 grains": [
                    case
                    for name in ("paper_scale_a", "paper_scale_b")
                    for case in run_cases(folder / "full_runs" / f"{name}.npz", reach)
                ],
                "150 grains": list(run_cases(folder / "full_runs" / "coarse_bursty.npz", reach)),
            }
            for source, cases in sources.items():
                error, width, inside = [], [], []
                for series, to_cycle, truth in cases:
                    found = fit_series(series, law, to_cycle, probability=0.9)
                    low, high = found.band
                    error.append(abs(found.prediction / truth - 1))
                    width.append((high - low) / 2 / abs(truth))
                    inside.append(low <= truth <= high)
                where = f"{law_name}, r = {reach:g}, {source} ({len(cases)} cases)"
                judged = law_name == "log" and source != "150 grains"
                coverage = float(np.mean(inside))
                checks += [
                    Check(
                        f"{where}: coverage of the 90 % band",
                        coverage,
                        f">= {COVERAGE_BAR}" if judged else "measured",
                        coverage >= COVERAGE_BAR or not judged,
                    ),
                    Check(f"{where}: median error", float(np.median(error)), "measured", True),
                    Check(f"{where}: median half-width", float(np.median(width)), "measured", True),
                ]
    return checks
