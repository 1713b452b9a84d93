"""Hard cases of the settlement procedure: variants of the demo's scene, and how each has to end.

Each is ``scenes/karrech-coarse.toml`` with softer grains (10^9 Pa) and a short procedure (16 cycles
computed, 20 jumped, 14 computed), and what makes it hard.  It has to end with the right answer
(``code`` 0) or be refused with a reason and a documented exit code.
"""

from __future__ import annotations

from dataclasses import dataclass

from adapters.scene import Scene
from adapters.scene_checks import JUMP_KEYS, TOLERANCE_KEY
from adapters.scene_file import scene_load
from scenes import scene_path
from validation.settlement_hard_beds import APART, RADIUS, SIDE

DEMO = "karrech-coarse"
SHORT = (
    "material.grain.young=1e9",
    'engine.name="liggghts"',
    "procedure.k_i=8",
    "procedure.k=8",
    "procedure.h=20",
    "procedure.healing_cycles=3",
    "procedure.total_cycles=50",
)
"""Settings that all cases share, unless they name the key themselves."""


@dataclass(frozen=True)
class HardCase:
    """A scene, and how it has to end."""

    name: str
    title: str
    settings: tuple[str, ...]
    """Keys of the scene that differ from `SHORT`."""
    code: int = 0
    """Exit code of ``trackbed run``."""
    says: str = ""
    """Words that the refusal has to have."""
    checks: tuple[str, ...] = ()
    """Checks of `validation.settlement_hard_checks` beside those that every run has to pass."""
    bed: str = ""
    """Preparation of `validation.settlement_hard_beds` that the call goes on with."""
    then: tuple[str, ...] = ()
    """Keys that change in a second call on the finished run: ``code`` and ``says`` are its."""

    @property
    def overrides(self) -> list[str]:
        """All settings of the demo's scene that differ."""
        own = {setting.partition("=")[0] for setting in self.settings}
        if TOLERANCE_KEY in own:
            own |= set(JUMP_KEYS)
        shared = [setting for setting in SHORT if setting.partition("=")[0] not in own]
        return [*shared, *self.settings]

    def scene(self) -> Scene:
        """The scene; raises `SceneError` where that is the refusal."""
        return scene_load(scene_path(DEMO), self.overrides)


def friction(grain: float) -> tuple[str, ...]:
    """Settings of one coefficient of friction everywhere."""
    return (f"material.grain.friction={grain}", f"material.wall.friction={grain}")


def load(amplitude: float, share: float = 1.0) -> tuple[str, ...]:
    """Settings of a load from zero to ``amplitude`` [Pa] on a ``share`` of the section."""
    return (
        f"loading.amplitude={amplitude}",
        f"loading.mean={amplitude / 2}",
        f"loading.area_share={share}",
    )


FAR = ("procedure.k_i=20", "procedure.k=4", "procedure.h=400", "procedure.total_cycles=432")
"""Settings of a jump a hundred times as long as its window."""


def crystal_box(count: int, gap: float = 0.0) -> str:
    """Setting of ``count`` equal grains in the box of the crystal, wider by the share ``gap``."""
    size = 2 * RADIUS * SIDE * (1 + APART) * (1 + gap)
    radii = f'{{distribution="constant",mean={RADIUS}}}'
    box = f'container="box",size_x={size!r},size_y={size!r}'
    return f"sample={{{box},count={count},grain_radius={radii}}}"


CASES = (
    HardCase("ordinary", "none: the demo, softer and shorter", (), checks=("settles",)),
    HardCase(
        "friction-0",
        "no friction",
        friction(0.0),
        checks=("frictionless", "isostatic", "stands still"),
    ),
    HardCase("friction-1.5", "friction 1.5", friction(1.5), checks=("settles", "loose")),
    HardCase(
        "equal-grains",
        "equal grains with hardly any friction, packed at random",
        (
            'sample.grain_radius.distribution="constant"',
            "sample.grain_radius.standard_deviation=0.0",
            *friction(0.02),
        ),
        checks=("below crystal",),
    ),
    HardCase(
        "crystal",
        "a face-centred cubic crystal, jumps by history",
        (crystal_box(148), 'procedure.settlement="history"'),
        checks=(
            "does not settle",
            "nothing invented",
            "stands still",
            "hollows",
            "crystal stiff",
            "below crystal",
        ),
        bed="crystal",
    ),
    HardCase(
        "crystal-by-law",
        "the same, jumps by the law of its last microns' noise",
        (crystal_box(148),),
        code=6,
        says="relaxation 'smallest-move' stopped",
        bed="crystal",
    ),
    HardCase(
        "near-crystal",
        "a crystal less three grains, in a box half a percent wider, jumps by history",
        (crystal_box(145, 0.005), 'procedure.settlement="history"'),
        checks=("does not settle", "nothing invented", "stands still", "below crystal"),
        bed="crystal",
    ),
    HardCase(
        "near-crystal-by-profile",
        "the same, its grains moved by their mean profile",
        (
            crystal_box(145, 0.005),
            'procedure.settlement="history"',
            'procedure.move="profile"',
        ),
        checks=("does not settle", "nothing invented", "stands still", "below crystal"),
        bed="crystal",
    ),
    HardCase(
        "loose-bed",
        "rained with friction 10, loaded with 0.5",
        ("sample.relative_density_start=0.15",),
        checks=("settles", "very loose", "compacts"),
        bed="loose",
    ),
    HardCase(
        "loose-start",
        "rain from a relative density of 0.01",
        ("sample.relative_density_start=0.01",),
        checks=("settles",),
    ),
    HardCase("one-layer", "a bed one grain thick", ("sample.count=16",), checks=("stands still",)),
    HardCase(
        "radii-1-to-5",
        "radii from 0.8 to 4 mm",
        (
            'sample.grain_radius.distribution="uniform"',
            "sample.grain_radius.mean=2.4e-3",
            "sample.grain_radius.standard_deviation=0.9237e-3",
        ),
        checks=("settles",),
    ),
    HardCase("light-piston", "a piston of 1 g", ("loading.piston_mass=1e-3",), checks=("settles",)),
    HardCase(
        "feather-piston",
        "a piston of 0.01 g, thrown off by the bed",
        ("loading.piston_mass=1e-5",),
        code=5,
        says="the piston left the box",
    ),
    HardCase("load-10", "ten times the load", load(141.5e3), checks=("settles",)),
    HardCase("load-30", "thirty times the load", load(424.5e3), code=6, says="kinetic energy"),
    HardCase(
        "load-100", "a hundred times the load", load(1.415e6), code=3, says="into one another"
    ),
    HardCase(
        "load-raised",
        "three times the load on a run that has ended",
        (),
        code=3,
        says="loading.amplitude: 14150.0 in the run, 42450.0 now",
        then=load(42.45e3),
    ),
    HardCase(
        "ratcheting",
        "friction 0.1, 5 kPa at 20 Hz on 15 % of the section: the piston breaks in",
        (
            *friction(0.1),
            *load(5e3, 0.15),
            "loading.frequency=20.0",
            "procedure.tolerance=0.05",
            "procedure.total_cycles=300",
        ),
        code=6,
        says="rate at which the piston sinks",
    ),
    HardCase(
        "collapse",
        "20 times the load on 15 % of the section: the piston breaks in",
        load(300e3, 0.15),
        code=6,
        says="kinetic energy",
    ),
    HardCase("punching", "4 times the load on 30 % of the section", load(60e3, 0.3)),
    HardCase(
        "far-jump",
        "h/k = 100: 400 cycles from 4",
        FAR,
        code=6,
        says="the law lifts the bed",
    ),
    HardCase(
        "far-jump-by-history",
        "the same, settled by the history of all 24 cycles",
        (*FAR, 'procedure.settlement="history"'),
        checks=("settles",),
    ),
)
"""All cases; those without words of a refusal have to end."""

QUICK = ("load-100", "one-layer")
"""Cases that the tests run: eight CPU seconds together."""


def case_named(name: str) -> HardCase:
    """A case by its name; raises `KeyError`."""
    return {case.name: case for case in CASES}[name]
