"""Settlement curves with known laws and noise, and the controller played on them, no engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from adapters.jump_control import (
    Check, Control, Decision, Settings, accept, begin, decide, judge, observe, reject,
)  # fmt: skip
from adapters.jump_rates import Stretch
from adapters.state import FloatArray


@dataclass
class Play:
    decisions: list = field(default_factory=list)
    jumps: list = field(default_factory=list)  # (decision, check, N, true gain)
    rejected: list = field(default_factory=list)
    computed: int = 0
    wasted: int = 0
    final: float = 0.0
    refused: bool = False


def play(mean: Callable, gains: FloatArray, k_i: int, settings: Settings) -> Play:
    out = Play()
    total = settings.total_cycles
    u = float(gains[:k_i].sum())
    out.computed = k_i
    c = begin(k_i, u)

    def stretch(first, k):
        z = np.full(k, np.nan)
        return Stretch(first, gains[first : first + k], z, z)

    while True:
        d = decide(c, settings)
        out.decisions.append(d)
        if d.action == "end":
            break
        if d.action == "refuse":
            out.refused = True
            break
        if d.action == "compute":
            s = stretch(c.cycle, d.window)
            out.computed += d.window
            c = observe(c, s, c.settlement + float(s.gain.sum()))
            continue
        m = settings.healing
        first = c.cycle + d.jump + m
        s = stretch(first, d.window)
        out.computed += d.window + m
        u = (
            c.settlement
            + d.gain
            + float(gains[c.cycle + d.jump : first].sum())
            + float(s.gain.sum())
        )
        check = judge(c, d, settings, s, u)
        true = mean(c.cycle + d.jump) - mean(c.cycle)
        if check.accepted:
            out.jumps.append((d, check, c.cycle, true, c.settlement + d.gain))
            c = accept(c, d, check, settings, s, u)
        else:
            out.wasted += d.window + m
            out.rejected.append((d, check, c.cycle, true))
            c = reject(c, d, check.error, settings)
    out.final = c.settlement
    return out
