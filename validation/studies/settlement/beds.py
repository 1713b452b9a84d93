"""The beds, and the ways from cycle k_i to the last one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from adapters.procedure.run import CONTROL
from adapters.procedure.stages import Variant
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file

EVERY = "every cycle"
JUMPING = Variant()


@dataclass(frozen=True)
class Kind:
    """A bed under its load."""

    name: str
    title: str
    path: Path  # of its scene file
    settings: tuple[str, ...]
    """Keys of the scene that differ, beside the seed."""
    seeds: range
    """Of the rain of grains: a packing each."""
    last: int
    """Cycle at which the ways are compared."""
    k_i: int = 50
    """Cycles of a packing, from whose state every way starts."""

    def scene(self, seed: int, *settings: str) -> Scene:
        """The scene of a packing on LIGGGHTS, with ``settings`` on top."""
        own = [f"procedure.total_cycles={self.last}", f"sample.seed={seed}",
               'engine.name="liggghts"', f"procedure.k_i={self.k_i}", "procedure.k=10",
               "procedure.h=35"]  # fmt: skip
        return load_scene(self.path, [*self.settings, *own, *settings])


PAPER, SMALL, PART = map(find_scene_file, ("karrech", "karrech-coarse", "karrech-partial"))
BOX = Path(__file__).with_name("box.toml")
CONFINED = Kind("confined", "paper's bed: 1,085 grains", PAPER, (), range(1, 10), 500)
COARSE = Kind("coarse", "coarse, softer bed: 150 grains", SMALL, (), range(101, 201), 500)
FAR = Kind("far", "the coarse bed, further", SMALL, (), range(101, 131), 10_000)
PARTIAL = Kind("partial", "piston on 80 % of the section", PART, (), range(1, 10), 100, k_i=25)
UNSEEN = Kind("unseen", "a box, another grading, stiffness and frequency", BOX, (), range(1, 13),
              500)  # fmt: skip
KINDS = {kind.name: kind for kind in (CONFINED, COARSE, FAR, PARTIAL, UNSEEN)}


@dataclass(frozen=True)
class Method:
    """A way to the last cycle; without jumps it computes every cycle."""

    name: str
    family: str
    """Methods of one family have one colour in the picture."""
    settings: tuple[str, ...] = ()
    """Keys of the scene that differ; a procedure's name first, as it replaces its other keys."""
    variant: Variant = CONTROL


DOUBLED = "engine.rayleigh_share=0.4"
"""Twice the time step of the full runs."""


STILL = ('procedure.move="still"', 'procedure.settlement="law"')


def jump(name: str, family: str, *settings: str) -> Method:
    """Growing jumps, as the procedure of that name does them, but for ``settings``."""
    return Method(name, family, ('procedure.name="growing"', *settings), JUMPING)


LONGER = jump("growing, k = 30", "growing", "procedure.k=30")
"""Windows three times as long: what a jump stirs up is over before they end."""


def list_methods(kind: Kind) -> tuple[Method, ...]:
    """The ways that are judged on a bed, beside every cycle and the law of the first cycles."""
    growing = jump("growing", "growing")
    both = jump("growing, step x 2", "growing", DOUBLED)
    if kind is UNSEEN:
        return growing, both, LONGER
    if kind in (FAR, PARTIAL):
        return growing, both
    material, loading = kind.scene(1).material, kind.scene(1).loading
    assert loading is not None
    assert loading.frequency is not None
    return (
        growing, both, *((LONGER,) if kind is COARSE else ()),
        Method("tolerance", "tolerance", ('procedure.name="tolerance"',), JUMPING),
        jump("nothing moved", "nothing moved", *STILL),
        Method("step x 2", "longer step", (DOUBLED,)),
        Method("E/10", "softer grains", (f"material.grain.young={material.grain.young / 10!r}",)),
        Method("frequency x 2", "faster load", (f"loading.frequency={2 * loading.frequency!r}",)),
    )  # fmt: skip


def list_runs(kind: Kind) -> Iterator[tuple[Method | None, int]]:
    """Way (None: every cycle) and packing of all runs of a bed, full runs first."""
    for method in (None, *list_methods(kind)):
        for seed in kind.seeds:
            yield method, seed
