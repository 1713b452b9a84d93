"""The two beds, and the ways from cycle k_i to the last one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from adapters.bed.sample import GRAVITY
from adapters.jumps.schedule import schedule_jumps
from adapters.procedure.run import CONTROL
from adapters.procedure.stages import Variant
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file

STEP = 1e-10
"""Displacement [m] of one grain at k_i, times the number of the member."""
EVERY = "every cycle"
LAWS = tuple((law, cycles) for law in ("log", "auto") for cycles in (20, 100))
"""A law, and cycles behind k_i that are computed before it stands for the rest."""


@dataclass(frozen=True)
class Kind:
    """A bed under its load."""

    name: str
    title: str
    scene_name: str
    settings: tuple[str, ...]
    """Keys of the scene that differ, beside the seed."""
    packings: int
    """Seeds 1, 2, ... of the rain of grains."""
    members: int
    """Full runs of each packing."""
    k_i: int
    """Cycles of a packing, from whose state every way starts."""
    end: int
    """Cycles of a full run."""
    last: int = 500
    """Cycle at which the ways are compared."""

    def scene(self, seed: int, *settings: str) -> Scene:
        """The scene of a packing on LIGGGHTS, with ``settings`` on top."""
        own = [f"sample.seed={seed}", 'engine.name="liggghts"', f"procedure.k_i={self.k_i}"]
        total = "procedure.total_cycles"
        if not any(key.startswith(total) for key in settings):
            own.append(f"{total}={self.end}")
        return load_scene(find_scene_file(self.scene_name), [*self.settings, *own, *settings])


CONFINED = Kind("confined", "paper's bed: 1,085 grains", "karrech", (), 3, 2, 50, 500)
SOFT = ("material.grain.young=1e9",)
COARSE = Kind("coarse", "coarse, softer bed: 150 grains", "karrech-coarse", SOFT, 5, 2, 100, 10_000)
KINDS = {kind.name: kind for kind in (CONFINED, COARSE)}


@dataclass(frozen=True)
class Method:
    """A way to the last cycle; without jumps it computes every cycle."""

    name: str
    family: str
    """Methods of one family differ by a number: a colour in the picture."""
    settings: tuple[str, ...] = ()
    """Keys of the scene that differ."""
    variant: Variant = CONTROL
    jumps: int = 0
    """How many jumps reach the last cycle; 0 where the settings say."""
    window: int = 20
    """Cycles fitted before each jump."""
    growing: bool = False
    """Whether the ends of windows are evenly spaced in ln N, not in N."""
    heavier: float = 1.0
    """Mass over that of the packing's state."""
    runs: int = 1
    """Runs of each packing."""

    def scene(self, kind: Kind, seed: int) -> Scene:
        """The scene of a packing as this method changes it; raises `SceneError` where it may not
        be."""
        window = self.window if self.variant.jumps else 100
        keys = [f"procedure.total_cycles={kind.last}", *self.settings]
        if not any(key.startswith("procedure.tolerance") for key in self.settings):
            h: int | list[int] = 0
            if self.jumps:
                h = schedule_jumps(self.jumps, kind.last, kind.k_i, window, 5, self.growing)
            keys += [f"procedure.k={window}", f"procedure.h={h}"]
        return kind.scene(seed, *keys)


JUMPING = Variant()


def jump(jumps: int, *settings: str, suffix: str = "", runs: int = 1) -> Method:
    """So many equal jumps by the law of the last window."""
    name = f"{jumps} jumps{suffix}"
    family = "nothing moved" if "nothing" in suffix else "jumps by the law"
    return Method(name, family, settings, JUMPING, jumps, runs=runs)


def jump_by_history(jumps: int, move: str = "", runs: int = 1) -> Method:
    """So many jumps that settle by the slopes of all cycles computed; ``move``: how, if not by the
    default."""
    keys = ('procedure.settlement="history"', *([f'procedure.move="{move}"'] if move else []))
    moved = f", {move}" if move else ""
    name, family = f"{jumps} jumps, by history{moved}", f"jumps by history{moved}"
    return Method(name, family, keys, JUMPING, jumps, runs=runs)


def grow_jumps(method: Method, window: int, runs: int = 1) -> Method:
    """The same number of jumps, each longer than the one before."""
    name = method.name.replace("jumps", "growing jumps", 1)
    return replace(method, name=name, growing=True, window=window, runs=runs)


STILL = ('procedure.move="still"',)


def jump_still(jumps: int, runs: int = 1) -> Method:
    """Jumps that move nothing."""
    return jump(jumps, *STILL, suffix=", nothing moved", runs=runs)


def soften(factor: int, kind: Kind) -> Method:
    """Young's modulus of the grains over ``factor``, with the longer step that goes with it."""
    young = kind.scene(1).material.grain.young / factor
    return Method(f"E/{factor}", "softer", (f"material.grain.young={young!r}",))


def lengthen(share: float) -> Method:
    """A time step of a ``share`` of the Rayleigh time, where the reference takes 0.2."""
    return Method(f"step x {share / 0.2:g}", "longer step", (f"engine.rayleigh_share={share}",))


def quicken(factor: int) -> Method:
    """The load at a higher frequency."""
    return Method(f"{factor * 50} Hz", "frequency", (f"loading.frequency={factor * 50.0}",))


def weigh(factor: int, kind: Kind) -> Method:
    """Density scaling, the piston with the grains; weights stay (`keep_weights`)."""
    scene = kind.scene(1)
    assert scene.loading is not None
    keys = (
        f"material.grain.density={factor * scene.material.grain.density!r}",
        f"loading.piston_mass={factor * scene.loading.piston_mass!r}",
    )
    return Method(f"density x {factor}", "density", keys, heavier=factor)


def keep_weights(scene: Scene, ratio: float) -> Mapping[str, Sequence[str]]:
    """Lines behind a line of the deck that give saved grains and piston the scene's masses.

    Gravity is divided by the ``ratio`` of these masses to the saved ones, so that weights stay.
    """
    assert scene.loading is not None
    return {
        "include piston.in": (
            f"set group grains density {scene.material.grain.density!r}",
            f"set atom ${{piston_atom}} mass {scene.loading.piston_mass!r}",
            "unfix gravity",
            f"fix gravity grains gravity {GRAVITY / ratio!r} vector 0.0 0.0 -1.0",
        )
    }


def tolerate(tolerance: float) -> Method:
    """Jumps that choose themselves."""
    keys = (f"procedure.tolerance={tolerance}",)
    return Method(f"tolerance {tolerance}", "tolerance", keys, JUMPING)


def list_methods(kind: Kind) -> tuple[Method, ...]:
    """The ways that are judged on a bed, beside every cycle and the laws."""
    profile = "profile"
    best = grow_jumps(jump_by_history(5, profile), 10, runs=4)
    if kind is CONFINED:
        both = (*best.settings, "engine.rayleigh_share=0.4")
        step = replace(best, name=f"{best.name}, step x 2", settings=both, runs=2)
        return (
            jump(2, runs=2), jump_still(2, runs=2), lengthen(0.4),
            jump_by_history(2, profile, runs=2), soften(10, kind), soften(100, kind), quicken(2),
            weigh(10, kind), tolerate(0.02), best, grow_jumps(jump_still(5), 10),
            grow_jumps(jump_by_history(3, profile), 18, runs=2), step,
        )  # fmt: skip
    return (
        *(jump(jumps) for jumps in (2, 5)), *(jump_still(jumps) for jumps in (2, 5, 10)),
        *(jump_by_history(jumps) for jumps in (2, 5, 10)),
        *(jump_by_history(jumps, profile) for jumps in (2, 5)), tolerate(0.1),
        jump(10), *map(lengthen, (0.3, 0.4, 0.6, 0.8, 1.0)),
        *(soften(factor, kind) for factor in (10, 30, 100)), quicken(2), quicken(4),
        weigh(10, kind), weigh(100, kind),
        Method("h = 0", "h = 0", (), Variant("h = 0", still=True)),
    )  # fmt: skip


def list_runs(kind: Kind) -> Iterator[tuple[Method | None, int, int]]:
    """Way (None: every cycle), packing and member of all runs of a bed."""
    for member in range(kind.members):
        for seed in range(1, kind.packings + 1):
            yield None, seed, member
    for method in list_methods(kind):
        for member in range(method.runs):
            for seed in range(1, kind.packings + 1):
                yield method, seed, member
