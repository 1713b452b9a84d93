"""Slow pulses: what a block on four springs gives way by, what slides, and what a bed's file keeps.

The block lies with four spheres on those of one that is held, on a slope of tan(alpha) = 0.2.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.contact.spheres import find_pair_stiffness
from qdem_fem.files.errors import NotConverged
from qdem_fem.march.kinetic_damping import find_rest
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.track import bearing
from qdem_fem.track.bearing import Pulse, begin_bed, judge_bed, press_bed, press_sleeper
from qdem_fem.track.bed import Bed, read_bed, write_bed
from tests.verification.test_qdem_track import RADIUS, RECIPE, STIFFNESS, STONE

SLOPE, FORCE = np.arctan(0.2), 40.0
DOWN = 9.81 * np.array([np.sin(SLOPE), 0.0, -np.cos(SLOPE)])
SLOPING = replace(
    RECIPE, gravity=tuple(DOWN), unbalanced=1e-3, kinetic=1e-4, loose=0.0, patience=0.5
)
BORNE, SUNK = Pulse(0.5, 8e3, 20e-6, 1e-6, 2e-6), Pulse(0.5, 8e3, 30e-6, 412e-6, 9e-6)


def contact(friction: float) -> q.SphereContact:
    return q.SphereContact(RADIUS, STIFFNESS, friction)


@pytest.fixture
def bed(monkeypatch: pytest.MonkeyPatch) -> Bed:
    """The block at rest on the other with friction 0.5; pulses of many periods of its springs."""

    def bodies(*_: object, **__: object) -> dict[str, q.Body]:
        size, apart = (0.05, 0.05, 0.05), 0.05 + 2 * RADIUS
        made = [make_box_mesh(size, (1, 1, 1), origin=(0.0, 0.0, z)) for z in (0.0, apart)]
        made[1].node_sets["seat"] = made[1].node_sets["z-max"]
        return {
            name: q.Body(mesh, STONE, name=name, rigid=True)
            for name, mesh in zip(("held", "sleeper"), made, strict=True)
        }

    def hold(run: q.Simulation, *_: object, **__: object) -> None:
        run.fix(run.bodies[0], np.arange(8), "xyz")

    monkeypatch.setattr(bearing, "make_bed_bodies", bodies)
    monkeypatch.setattr(bearing, "guide_sleeper", hold)
    monkeypatch.setattr(bearing, "make_bed_grains", lambda recipe: None)
    monkeypatch.setattr(bearing, "PULSES", replace(bearing.PULSES, lasts=0.2))
    monkeypatch.setattr(bearing, "find_rest", partial(find_rest, look=5))  # few steps a period
    nodes = [body.nodes for body in bodies().values()]
    run, _ = begin_bed(SLOPING, Bed("rest", nodes, np.zeros((16, 3)), {}, {}), contact(0.5))
    find_rest(run, 1e-3, 1e-4, 0.0, 2.0, look=5)
    assert run.contacts is not None
    moved = np.concatenate([body.displacement for body in run.bodies])
    return Bed("rest", nodes, moved, run.contacts.pack_state(), {"rest": {}})


def test_a_block_gives_way_by_its_four_springs_and_comes_back(bed: Bed) -> None:
    """F/(4 k); a pulse of 35 periods leaves some per mille of it swinging."""
    run, _ = begin_bed(SLOPING, bed, contact(0.5))
    pulse = press_sleeper(run, SLOPING, FORCE)
    way = FORCE / (4 * find_pair_stiffness(STIFFNESS, STIFFNESS))
    assert pulse.way == pytest.approx(way, rel=0.02)
    assert pulse.stays < 0.02


def test_a_block_that_slides_finds_no_rest(bed: Bed, tmp_path: Path) -> None:
    """With friction 0.15 on a slope of 0.2, which the same bed bears with 0.5."""
    path = tmp_path / "bed.npz"
    assert judge_bed(SLOPING, bed, path, contact(0.5), FORCE, 0.2).stays < 0.02
    with pytest.raises(NotConverged, match="no equilibrium"):
        judge_bed(SLOPING, bed, path, contact(0.15), FORCE, 0.2)


def test_a_bed_that_gives_way_is_refused_and_remembered(
    bed: Bed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bed.npz"
    monkeypatch.setattr(bearing, "press_sleeper", lambda *_: SUNK)
    said = r"does not bear .* 30 µm down and leaves it 412 µm down and 9 µm aside .0\.2 of the way"
    with pytest.raises(NotConverged, match=said):
        judge_bed(SLOPING, bed, path, contact(0.5), 8e3, 0.2)
    monkeypatch.setattr(bearing, "press_sleeper", None)  # read from the file
    kept = read_bed(path, SLOPING)
    assert judge_bed(SLOPING, kept, path, contact(0.5), 8e3, 20.0) == SUNK


def test_a_bed_is_run_in_until_a_pulse_leaves_little(
    bed: Bed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its own friction; a file from before goes on with the first pulse, a later one none."""
    path, left = tmp_path / "bed.npz", [BORNE, SUNK, SUNK]

    def press(run: q.Simulation, *_: object) -> Pulse:
        assert run.contact is not None
        assert run.contact.friction == SLOPING.friction
        run.bodies[1].displacement = run.bodies[1].displacement - 1e-6
        return left.pop()

    monkeypatch.setattr(bearing, "press_sleeper", press)
    write_bed(path, SLOPING, bed)
    with np.load(path) as archive:
        arrays = dict(archive)
    head = json.loads(str(arrays["head"]))
    del head["pulses"], head["trials"]
    np.savez(path, **{**arrays, "head": json.dumps(head | {"stands": {}})})
    once = press_bed(SLOPING, read_bed(path, SLOPING), path, contact(0.9), 8e3, 0.2)
    assert [Pulse(**one) for one in once.pulses] == [SUNK, SUNK, BORNE]
    kept = read_bed(path, SLOPING)
    np.testing.assert_allclose(kept.displacement[8:], bed.displacement[8:] - 3e-6, atol=1e-15)
    assert press_bed(SLOPING, kept, path, contact(0.9), 8e3, 0.2) is kept
    monkeypatch.setattr(bearing, "PULSES", replace(bearing.PULSES, most=3))
    with pytest.raises(NotConverged, match=r"3 slow pulses do not run the bed in.*way asked"):
        press_bed(SLOPING, kept, path, contact(0.9), 8e3, 0.01)
