"""Which ways are compared, from which states and at which cycle: by the name of the study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from validation.settlement_ensemble import COARSE, CONFINED, PARTIAL, Kind
from validation.settlement_rivals import (
    METHODS_OF,
    Method,
    growing,
    jumping,
    rearranging,
    remembering,
    seated,
    shortly,
)

RESULTS = Path(__file__).with_name("results")


@dataclass(frozen=True)
class Study:
    """Ways to the same cycle of an ensemble's runs."""

    kind: Kind
    last: int
    """Cycle at which they are compared: one whose state the ensemble keeps."""
    methods: tuple[Method, ...]
    members: int
    """Runs of each packing."""
    record: Path
    more: Mapping[str, int] = field(default_factory=dict)
    """Runs of each packing of a method that has more of them."""

    def runs_of(self, method: Method) -> int:
        """Runs of each packing of a method."""
        return self.more.get(method.name, self.members)


BY_PROFILE = (
    growing(remembering(13, "profile")),
    *(replace(growing(remembering(jumps, "profile")), window=6) for jumps in (31, 40)),
)
FAR = (
    growing(remembering(13)),
    *BY_PROFILE,
    *map(rearranging, BY_PROFILE),
    growing(jumping(13)[1]),
)
"""To 10,000 cycles of the coarse bed: 13 jumps compute 345 cycles of 9,900, one in 29, so that one
in twenty is left when starts of the engine, relaxations and jumps that failed are counted.

31 from windows of six cycles, which is as many cycles, ask a bed for less at a time; 40 compute one
cycle in 22, and 42 would begin with a jump of one cycle.  By the logarithm the first of 13 equal
jumps, 735 cycles, would settle as much as the next seven.
"""
PARTLY = (
    *(
        replace(method, base=PARTIAL, window=5)
        for method in (
            *(remembering(1), remembering(1, "profile"), *jumping(1), remembering(3)),
            seated(remembering(1)),
        )
    ),
    *(
        replace(shortly(seated(way)), base=PARTIAL, window=4, healing=6)
        for way in (remembering(1), remembering(1, "profile"))
    ),
)
"""Under a piston that covers a part: one jump computes 15 cycles of 80, a gained time of 433 %;
three compute 35, 129 %, near the 120 % at which the paper misses the settlement by 8 % (Fig. 13d).
With windows of four and six healing cycles one jump computes 14; where a piston is let go at cycle
44 and carried for four more, 42: so five beds of which one hangs 19.6, a gained time of 308 %.
"""
STUDIES = {
    "coarse": Study(COARSE, 500, METHODS_OF["coarse"], 1, RESULTS / "settlement-rivals.jsonl"),
    "confined": Study(
        CONFINED, 500, METHODS_OF["confined"], 1, RESULTS / "settlement-rivals-confined.jsonl",
        {
            "5 growing jumps, by history, profile": 4,
            **dict.fromkeys(
                (
                    "2 jumps", "2 jumps, nothing moved", "2 jumps, by history, profile",
                    "3 growing jumps, by history, profile",
                    "5 growing jumps, by history, profile, step x 2",
                ),
                CONFINED.members,
            ),
        },
    ),
    "far": Study(COARSE, COARSE.last, FAR, 2, RESULTS / "settlement-rivals-far.jsonl"),
    "partial": Study(
        PARTIAL, PARTIAL.last, PARTLY, 1, RESULTS / "settlement-rivals-partial.jsonl",
        {
            f"1 jumps, by history, {way}": 2
            for way in ("seated", "seated for 4", "profile, seated for 4")
        },
    ),
}  # fmt: skip
