"""What a run says of itself: its plan and about its cost before it starts, then how far it is.

Progress is one line rewritten on a terminal, plain lines elsewhere; always on stderr.
"""

import sys
import time
from collections.abc import Iterator

from adapters.engines import get_engine, plan_settling
from adapters.jumps import JUMP, Settings
from adapters.scene import Procedure, Scene, list_stages

SHOWN = 6
"""Jumps that are listed one by one."""


class Progress:
    """Tells cycles computed and jumped, settlement and time left."""

    def __init__(self, quiet: bool = False) -> None:
        self.stream, self.quiet = sys.stderr, quiet
        self.terminal = self.stream.isatty()
        self._printed = 0.0
        self._first: tuple[float, int] | None = None

    def start(self) -> None:
        """Start to count time and cycles again, for another run."""
        self._first = None

    def print_line(self, text: str) -> None:
        """A line that stays."""
        if not self.quiet:
            print(("\r\x1b[K" if self.terminal else "") + text, file=self.stream, flush=True)

    def show_cycles(
        self, *, done: int, total: int, computed: int, settlement: float | None, computed_here: int,
        to_compute: int,
    ) -> None:  # fmt: skip
        """How far the run is.

        ``done`` and ``computed`` cycles of ``total``; ``settlement`` of the loaded body [m];
        ``computed_here`` by this process, ``to_compute`` still.
        """
        now = time.monotonic()
        if self._first is None:
            self._first = now, computed_here
        if self.quiet or now - self._printed < (0.2 if self.terminal else 10.0):
            return
        self._printed = now
        text = f"cycle {done} of {total}: {computed} computed, {done - computed} jumped"
        if settlement is not None:
            text += f", settlement {1e6 * settlement:.1f} um"
        started, at_start = self._first
        if computed_here > at_start:
            left = (now - started) / (computed_here - at_start) * to_compute
            text += f", {left / 60:.0f} min left" if left > 90 else f", {left:.0f} s left"
        if self.terminal:
            print(f"\r\x1b[K{text}", end="", file=self.stream, flush=True)
        else:
            print(text, file=self.stream, flush=True)


def plan_jumps(p: Procedure, begin: int = 0) -> list[tuple[int, int]]:
    """Cycles before and after each jump of given length, where none fails or has to wait, in the
    stage of a load from cycle ``begin`` on."""
    cycle = begin + p.k_i + p.window_cycles
    jumps: list[tuple[int, int]] = []
    while p.h and len(jumps) < p.total_cycles:
        longest = p.total_cycles - cycle - p.healing_cycles - p.window_cycles
        if longest < min(p.h):
            break
        h = min(p.jump_cycles(len(jumps)), longest)
        jumps.append((cycle, cycle + h))
        cycle += h + p.healing_cycles + p.window_cycles
    return jumps


def find_shortest_total(p: Procedure) -> int:
    """Fewest cycles in all with which a jump fits."""
    if p.h:
        return p.k_i + 2 * p.window_cycles + min(p.h) + p.healing_cycles
    assert p.tolerance is not None
    settings = Settings(p.tolerance, p.healing_cycles, p.total_cycles)
    window = JUMP.shortest_window
    return p.k_i + p.window_cycles + settings.shortest_jump + p.healing_cycles + window


def warn_without_jumps(scene: Scene) -> Iterator[str]:
    """The sentence on a run in which no jump fits."""
    p = scene.procedure
    if p is not None and p.total_cycles < (least := find_shortest_total(p)):
        yield (
            f"no jump fits into {p.total_cycles} cycles, so every one is computed; a first window, "
            f"a jump, its healing and the window behind it take procedure.total_cycles = {least}"
        )


def describe_plan(scene: Scene, height: float) -> Iterator[str]:
    """Cycles, jumps and cost of a run whose grains rain from ``height`` [m], in sentences."""
    p = scene.procedure
    if scene.sample.porosity is not None:
        yield (
            f"behind the rain taps to a porosity of {scene.sample.porosity:g}: the run computes "
            "this deck again with each, from the bed as it lay, lifted"
        )
    to_compute = total = 0 if p is None else p.total_cycles
    if p is not None:
        stages = [(begin, stage.procedure) for begin, stage in list_stages(scene)]
        jumps = [jump for begin, own in stages if own for jump in plan_jumps(own, begin)]
        to_compute -= sum(end - start for start, end in jumps)
        listed = ", ".join(f"{start} to {end}" for start, end in jumps[:SHOWN])
        more = f" and {len(jumps) - SHOWN} more" if len(jumps) > SHOWN else ""
        count = f"{len(jumps)} jump" + "s" * (len(jumps) != 1)
        yield f"plan: {total} cycles, {to_compute} of them computed" + (
            f", {count}: {listed}{more}" if jumps
            else ", less what jumps skip, which choose themselves" * (p.tolerance is not None)
        )  # fmt: skip
    shared, members = (p.k_i, p.members) if p is not None else (0, 1)
    computed, every = (shared + members * (cycles - shared) for cycles in (to_compute, total))
    pace = get_engine(scene.engine.name).grain_steps_per_s
    rain, cycle = (
        scene.grain_count * len(scene.form.radius) * steps / pace
        for steps in (plan_settling(scene, height).minimum_steps, scene.steps_per_cycle)
    )
    parts = [f"at least {_format_time(rain)} for the rain of grains"]
    if total:
        parts.append(f"about {_format_time(cycle * computed)} for the cycles computed")
    if to_compute < total:
        parts.append(f"{_format_time(cycle * every)} for all cycles (--control)")
    if members > 1:
        parts[-1] += f", of {members} members"
    yield (
        f"estimated CPU time: {', '.join(parts)}; at {pace / 1e6:.2g} million grain-steps a second"
    )


def _format_time(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
