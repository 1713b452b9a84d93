"""Student's interval of the mean of a few independent figures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student


def interval(values: npt.ArrayLike, level: float = 0.95) -> tuple[float, float]:
    """Mean of values (k,), and half the width of Student's interval of it; nan for a single one."""
    found = np.asarray(values, dtype=float)
    count = len(found)
    if count < 2:
        return float(found.mean()), float("nan")
    error = float(found.std(ddof=1)) / np.sqrt(count)
    return float(found.mean()), float(student.ppf(0.5 + level / 2, count - 1)) * error
