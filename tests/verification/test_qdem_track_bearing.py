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
from qdem_fem.element.material import Material
from qdem_fem.files.errors import NotConverged
from qdem_fem.march.kinetic_damping import find_rest
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.track import bearing
from qdem_fem.track.bearing import Pulse, begin_bed, run_in
from qdem_fem.track.bed import Bed, read_bed, write_bed
from tests.verification.test_qdem_track import RADIUS, RECIPE, STIFFNESS

pytestmark = pytest.mark.long
HARD = Material(1e10, 0.2, 2700.0, shear_viscosity=1e4)
"""Its block is a thousand times stiffer than its four springs."""
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
            name: q.Body(mesh, HARD, name=name, rigid=name == "held")
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


def test_a_block_gives_way_by_its_four_springs_and_comes_back(bed: Bed, tmp_path: Path) -> None:
    """F/(4 k); a pulse of 35 periods leaves some per mille of it swinging.  The bed stays as it is,
    and its file answers the second time."""
    path = tmp_path / "bed.npz"
    borne, pulse = run_in(SLOPING, bed, path, contact(0.5), FORCE, 0.02)
    assert pulse.way == pytest.approx(
        FORCE / (4 * find_pair_stiffness(STIFFNESS, STIFFNESS)), rel=0.02
    )
    assert pulse.stays < 0.02
    assert borne.pulses == []
    assert (borne.displacement == bed.displacement).all()
    kept = read_bed(path, SLOPING)
    assert run_in(SLOPING, kept, path, contact(0.5), FORCE, 0.02) == (kept, pulse)


def test_a_block_that_slides_finds_no_rest(bed: Bed, tmp_path: Path) -> None:
    """With friction 0.15 on a slope of 0.2."""
    with pytest.raises(NotConverged, match="no equilibrium"):
        run_in(replace(SLOPING, patience=0.02), bed, tmp_path / "b.npz", contact(0.15), FORCE, 0.2)


@pytest.mark.parametrize("rigid", [False, True])
def test_a_bed_is_run_in_until_it_bears(rigid: bool, bed: Bed, tmp_path, monkeypatch) -> None:
    """What a pulse leaves is where the next begins; a file from before there were any goes on.  A
    pulse that leaves much is refused behind the last that is allowed, another friction is not."""
    path, left = tmp_path / "bed.npz", [BORNE, SUNK, SUNK, SUNK, BORNE, SUNK, SUNK]

    def press(run: q.Simulation, _: object, force: float) -> Pulse:
        run.bodies[1].displacement = run.bodies[1].displacement - 1e-6
        assert run.contact is not None
        return replace(left.pop(), friction=run.contact.friction, force=force)

    monkeypatch.setattr(bearing, "press_sleeper", press)
    write_bed(path, SLOPING, bed)
    with np.load(path) as archive:
        arrays = dict(archive)
    head = json.loads(str(arrays["head"]))
    del head["pulses"], head["trials"]
    np.savez(path, **{**arrays, "head": json.dumps(head | {"stands": {}})})
    old = read_bed(path, SLOPING)
    assert run_in(SLOPING, old, path, contact(0.5), 8e3, 0.2, rigid=rigid)[1] == BORNE
    kept = read_bed(path, SLOPING)
    assert [Pulse(**one) for one in kept.pulses] == [SUNK, SUNK]
    moved = np.concatenate(kept.positions) - np.concatenate(bed.positions)
    np.testing.assert_allclose(moved[8:], -2e-6, atol=1e-15)
    monkeypatch.setattr(bearing, "PULSES", replace(bearing.PULSES, most=3))
    said = r"does not bear .* behind 3 of them .* leaves it 412 µm down and 9 µm aside .0\.1 of the"
    with pytest.raises(NotConverged, match=said):
        run_in(SLOPING, kept, path, contact(0.5), 9e3, 0.1, rigid=rigid)
    sunk = read_bed(path, SLOPING)
    assert sunk.trials == {}
    assert run_in(SLOPING, sunk, path, contact(0.9), 9e3, 0.1, rigid=rigid)[1].friction == 0.9


def test_rails_hold_the_sleeper_along_the_track(bed: Bed) -> None:
    """Pushed along it by half its weight the block tilts about them."""
    run, bodies = begin_bed(SLOPING, bed, contact(0.5))
    block, before = bodies["sleeper"], bodies["sleeper"].displacement[:, 1].copy()
    run.load(block, np.arange(8), [0.0, 1.6, 0.0])
    run.advance(0.02)
    moved = block.displacement[:, 1] - before
    assert not moved[block.mesh.node_sets["seat"]].any()
    assert moved.max() > 0  # it tilts about them
