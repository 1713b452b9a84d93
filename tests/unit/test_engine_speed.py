"""How engines are timed: the mirrored bed is in balance, and no time is told of a wrong run."""

from __future__ import annotations

import re
from importlib.resources import files

import numpy as np
import pytest

from adapters import contact_law
from adapters.errors import NotCredible
from adapters.sample import GRAVITY
from validation.cases.engine_speed import checks_of
from validation.engine_speed_accuracy import steps_of_scene
from validation.engine_speed_bare import READ_AFTERWARDS, check_end, most_shared, timings
from validation.engine_speed_bed import MIRROR, SIDE, bed_scene, mirrored
from validation.engine_speed_page import medians, speeds
from validation.engine_speed_windows import output_share


def test_an_image_pushes_as_the_mirror_did() -> None:
    """F(d) of a rigid frictionless plane = F(2 d) of the grain and its image, exactly.

    4/3 E' sqrt(R) d^(3/2) with E' = E/(1 - nu^2), and 4/3 E'/2 sqrt(R/2) (2 d)^(3/2).
    """
    scene = bed_scene("liggghts", (1, 1), **MIRROR)
    radius, overlap = 3.2e-3, 1e-6
    mirror = contact_law.normal_force(overlap, scene.stiffness.mirror, radius)
    image = contact_law.normal_force(2 * overlap, scene.stiffness.grain, radius / 2)
    wall = contact_law.normal_force(overlap, scene.stiffness.wall, radius)
    assert image == pytest.approx(mirror, rel=1e-12)
    assert wall == pytest.approx(mirror, rel=1e-4)  # 46.9e9 over 1e15, the two sides without mirror


def test_tiles_are_reflected_at_each_other() -> None:
    """A grain that leans on a side by d overlaps its image by 2 d; all others keep their gaps."""
    overlap, radius = 1e-5, 3e-3
    place = np.array([[SIDE - radius + overlap, 0.02, 0.01], [0.02, radius - overlap, 0.03]])
    bed, radii = mirrored(place, np.full(2, radius), (3, 2))
    assert bed.shape == (12, 3)
    assert radii.shape == (12,)
    gap = np.linalg.norm(bed[:, None] - bed, axis=2)[np.triu_indices(12, 1)]
    touching = 2 * radius - gap[gap < 2 * radius]
    # Along x the first grain of tiles 0 and 1, in each of two rows; along y the outer sides alone.
    assert len(touching) == 2
    np.testing.assert_allclose(touching, 2 * overlap, rtol=1e-9)
    assert np.all(bed.min(axis=0) >= radius - overlap - 1e-12)
    assert np.all(bed[:, :2].max(axis=0) <= np.array([3, 2]) * SIDE - radius + overlap + 1e-12)


@pytest.mark.parametrize("folder", ["liggghts_inputs", "lammps_inputs"])
def test_the_engine_alone_writes_nothing_and_moves_the_same(folder: str) -> None:
    """Out of in.cycles go the frames and the record; all that acts on a grain stays."""
    deck = files(folder).joinpath("in.cycles").read_text()
    bare = READ_AFTERWARDS.sub("", deck)
    commands = [line for line in bare.splitlines() if line and not line.startswith("#")]
    assert not [line for line in commands if re.search(r"dump|output_part|track|piston\.txt", line)]
    gone = set(deck.splitlines()) - set(bare.splitlines())
    assert 3 <= len(gone) <= 4
    for part in ("bed.in", "piston.in", "${seat_part}", "${load_part}", "${run_part}"):
        assert f"include {part}" in commands


def grains_at_rest(count: int = 4) -> np.ndarray:
    end = np.zeros((count, 9))
    end[:, 0] = np.arange(1, count + 1)
    end[:, 7], end[:, 8] = 3e-3, 3e-4
    return end


def test_no_time_is_told_of_a_bed_that_fell_apart() -> None:
    """Lost grains, nan, and grains that fly are refused; a bed at rest is not."""
    check_end(grains_at_rest(), 4)
    with pytest.raises(NotCredible, match="3 of 4 grains"):
        check_end(grains_at_rest(3), 4)
    for speed in (np.nan, np.sqrt(2 * 1.1e-3 * GRAVITY * 3e-3)):
        end = grains_at_rest()
        end[:, 4] = speed
        with pytest.raises(NotCredible):
            check_end(end, 4)


def test_parts_of_a_run_are_read() -> None:
    """LAMMPS tells least, mean, greatest of the processes, LIGGGHTS the mean."""
    lammps = "Pair    | 0.33 | 0.39 | 0.45 |   9.8 | 15.34\nOther   |      | 1.058 |      |  | 41\n"
    assert timings(lammps) == {"pair": [0.33, 0.39, 0.45], "other": [1.058]}
    assert timings("Comm  time (%) = 2.24 (54.2)\n") == {"comm": [2.24]}
    assert most_shared("Nlocal:    4999.5 ave 5013 max 4986 min\n") == {"nlocal": 5013.0}


def test_steps_in_a_contact() -> None:
    """The slowest impact is 100 times slower: its contact is 100^(1/5) times longer."""
    few, many = steps_of_scene(bed_scene("yade", (1, 1)))
    assert many / few == pytest.approx(100**0.2, rel=1e-12)


def row(kind: str, engine: str, **values: object) -> dict[str, object]:
    setting = {"grains": 100, "repeat": 0}
    return {"kind": kind, "method": engine, "setting": setting, "ok": True, **values}


def test_checks_can_fail() -> None:
    """Under 95 % of the bare engine, or another bed: not ok; the median decides."""
    rows = [
        row("speed", engine, cost_s=cost, work=1000, contacts_per_grain=contacts)
        for engine, cost, contacts in (("a", 1.0, 4.0), ("a", 9.0, 4.0), ("a", 1.0, 4.0))
    ]
    rows += [row("speed", "b", cost_s=2.0, work=1000, contacts_per_grain=4.1)]
    rows += [
        row("adapter", engine, alone_s=alone, cost_s=1.0, steps_per_cycle=18600)
        for engine, alone in (("a", 0.90), ("b", 0.92))  # 1.80 / 1.90 and 1.84 / 1.92
    ]
    assert speeds(rows)["a", 100][0] == 1000
    assert medians(rows[:3], [], lambda r: r["cost_s"])["a",] == (1.0, 1.0, 9.0, 3)
    verdict = {check.name: check.ok for check in checks_of(rows)}
    assert verdict["a: the engine alone over trackbed, the paper's cycle"] is False
    assert verdict["b: the engine alone over trackbed, the paper's cycle"] is True
    assert not verdict["100 grains: contacts per grain, greatest difference of two engines"]


def test_output_share_reads_the_timers_of_both_engines() -> None:
    """Two runs of LIGGGHTS: (0.1 + 0.3) s of (2 + 6) s; one of LAMMPS: 0.5 s of 10 s."""
    liggghts = "Loop time of 2.0 on 1 procs\nPair  time (%) = 1 (50)\nOutpt time (%) = 0.1 (5)\n"
    more = "Loop time of 6.0 on 1 procs\nOutpt time (%) = 0.3 (5)\n"
    lammps = "Loop time of 10 on 1 procs\nOutput  | 0.5        | 0.5 | 0.5 |   0.0 |  5.00\n"
    assert output_share(liggghts + more) == pytest.approx(0.05)
    assert output_share(lammps) == pytest.approx(0.05)
    assert output_share("YADE prints no timers") is None
