"""Input files for LAMMPS: only what the scene names, with the numbers of eqs 5 to 7."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed import contact_law
from adapters.bed.state import State
from adapters.engines.contract import EngineStart
from adapters.engines.lammps import LammpsEngine
from adapters.engines.lammps_decks import (
    TANGENTIAL,
    convert_contacts,
    format_contact,
    format_dump_states,
    format_piston_wall,
    format_scene,
    write_moved,
)
from adapters.files.dump import Frame
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file


def scene_of(*overrides: str) -> Scene:
    return load_scene(find_scene_file("karrech-coarse"), ('engine.name="lammps"', *overrides))


def bed(count: int) -> State:
    """Grains of 3 mm in a row."""
    position = np.column_stack([0.007 * np.arange(count), np.zeros((count, 2))])
    still = np.zeros((count, 3))
    return State(
        np.arange(1, count + 1), position, np.full(count, 3e-3), np.ones(count), still, still
    )


def test_contact_words_hold_the_equations() -> None:
    """4/3 E*, e, 8 G*, sqrt(4 G*/E*), mu in LAMMPS' order; without friction no stiffness."""
    words = format_contact(3e9, 1e9, 0.2, 0.5).split()
    assert words[0::2] == [
        "hertz",
        "0.20000000000000001",
        TANGENTIAL,
        "1.1547005383792515",
        "damping",
    ]
    assert [float(w) for w in (words[1], words[5], words[7])] == [4e9, 8e9, 0.5]
    assert "mindlin" not in format_contact(3e9, 1e9, 0.2, 0.0)


def test_scene_names_its_walls_only() -> None:
    """Floor, mirrors and cylinder of a quarter; mirrors without friction, of twice the stiffness.

    A sphere on a rigid plane has the stiffness of the mirrored pair at half its approach:
    E* twice that of two grains.
    """
    scene = scene_of()
    text = format_scene(scene)
    fixes = {line.split()[1]: line for line in text.splitlines() if line.startswith("fix")}
    assert tuple(fixes) == LammpsEngine().wall_names(scene, piston=False)
    assert TANGENTIAL in fixes["floor"]
    assert TANGENTIAL in fixes["cylinder"]
    assert TANGENTIAL not in fixes["symmetry_x"]
    between = next(line for line in text.splitlines() if line.startswith("pair_coeff"))
    mirror = fixes["symmetry_x"].split()
    stiffness = float(mirror[mirror.index("hertz") + 1])
    assert stiffness == pytest.approx(2 * float(between.split()[4]))
    none = format_scene(scene_of("material.grain.friction=0.0", "material.wall.friction=0.0"))
    assert "mindlin" not in none


def test_walls_of_a_box_face_inwards(tmp_path: Path) -> None:
    """Low walls keep what is above them, high walls what is below."""
    text = find_scene_file("karrech-coarse").read_text().replace('"cylinder"', '"box"')
    lines = [line for line in text.splitlines() if not line.startswith("radius =")]
    at = lines.index("[sample]") + 1
    lines[at:at] = ["size_x = 0.04", "size_y = 0.03"]
    path = tmp_path / "scene.toml"
    path.write_text("\n".join(lines) + "\n")
    scene = load_scene(path, ('engine.name="lammps"', "sample.symmetry=[]"))
    words = {
        line.split()[1]: line.split()[-4:-1]
        for line in format_scene(scene).splitlines()
        if line.startswith("fix")
    }
    assert words["wall_x_low"] == ["xplane", "0", "NULL"]
    assert words["wall_x_high"] == ["xplane", "NULL", "0.040000000000000001"]
    assert words["wall_y_high"] == ["yplane", "NULL", "0.029999999999999999"]


def test_piston_is_a_plane_or_the_end_of_a_cylinder() -> None:
    """Full area: a plane that faces down; partial: a cylinder of the reach, from outside."""
    assert "region piston plane 0.0 0.0 0.0 0.0 0.0 -1.0 move" in format_piston_wall(scene_of())
    scene = scene_of("loading.area_share=0.25")
    text = format_piston_wall(scene)
    assert "cylinder z 0.0 0.0 0.014999999999999999 0.0 INF side out move" in text


def test_columns_are_those_of_every_engine() -> None:
    """The force of a wall is renamed to the columns that readers know, in their order."""
    text = format_dump_states(("floor", "piston_wall"))
    assert "f_floor[2] f_floor[3] f_floor[4] f_piston_wall[2]" in text
    assert "colname 13 f_force_floor[1]" in text
    assert text.rstrip().endswith("colname 18 f_force_piston_wall[3]")


def test_moved_places_come_back_exactly(tmp_path: Path) -> None:
    """All grains by identifier, to the last bit, and the piston's atom after them."""
    scene, state = scene_of(), bed(5)
    shifted = state.move_to(state.position + 1 / 3, piston_height=0.1 + 1e-17)
    write_moved(tmp_path, scene.container, shifted)
    for axis, name in enumerate("xyz"):
        rows = (tmp_path / f"moved_{name}.txt").read_text().split("\n")
        assert rows[0] == "6"
        values = dict(row.split() for row in rows[1:-1])
        assert [float(values[str(i)]) for i in range(1, 6)] == shifted.position[:, axis].tolist()
    assert float(values["6"]) == shifted.piston_height


def test_a_window_takes_the_parts_it_needs(tmp_path: Path) -> None:
    """First, next, moved and perturbed windows differ by their parts; steps before only a jump."""
    scene, restart = scene_of(), tmp_path / "end.restart"
    restart.touch()
    moved = bed(scene.grain_count)
    for kind, start in {
        "first": EngineStart(restart, 0, 0, 0.1, first=True),
        "continue": EngineStart(restart, 0, 0, 0.1),
        "moved": EngineStart(restart, 0, 1, 0.1, moved=moved),
        "perturbed": EngineStart(restart, 0, 0, 0.1, perturbation=1e-10),
    }.items():
        folder = tmp_path / kind
        folder.mkdir()
        digests = LammpsEngine().write_cycles(scene, start, 2, folder)
        assert {f"start_{kind}.in", "in.cycles", "load_sine.in"} <= digests.keys()
        parameters = (folder / "parameters.in").read_text()
        assert f"steps_before index {int(kind == 'moved')}\n" in parameters
        assert ("seat_force" in parameters) == (kind == "first")
        assert ("perturbation" in parameters) == (kind == "perturbed")
        assert (folder / "moved_z.txt").exists() == (kind == "moved")


def test_contacts_from_pairs() -> None:
    """Overlap = r_i + r_j - distance; F_t = -k_t delta_t - c_t v_t gives back delta_t.

    Two grains that overlap along x and slide and spin along y, in any unit of length.
    """
    scene = scene_of()
    grain = scene.material.grain
    radius, overlap, spring, slide, spin = 3e-3, 1e-6, 2e-7, 0.03, 4.0
    names = ("id", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass")
    mass = 4 / 3 * np.pi * grain.density * radius**3
    rows = np.zeros((2, 12))
    rows[:, 0], rows[:, 10], rows[:, 11] = [4, 9], radius, mass
    rows[0, 1], rows[0, 5], rows[1, 9] = 2 * radius - overlap, slide, spin
    shear = contact_law.combine_shear_moduli(grain.young, grain.poisson, grain.young, grain.poisson)
    stiffness = float(contact_law.find_tangential_stiffness(overlap, shear, radius / 2))
    alpha = contact_law.find_alpha(scene.restitution)
    damping = 2 * contact_law.DAMPING_FACTOR * alpha * np.sqrt(mass / 2 * stiffness)
    # the surface of grain 9 that faces grain 4, along +x, moves with spin times radius along +y
    velocity = slide - spin * radius
    force = -stiffness * spring - damping * velocity
    pairs = np.array([[4, 9, 1.5, 0, 0, 0, force, 0, 2 * radius - overlap]])
    values = convert_contacts(scene, pairs, Frame(0, names, rows))
    assert values[0, :8].tolist() == [4, 9, 1.5, 0, 0, 0, force, 0]
    assert values[0, 8:11] == pytest.approx([0, spring, 0], abs=1e-12 * spring)
    assert values[0, 11] == pytest.approx(overlap, rel=1e-9)
    plain = convert_contacts(scene, pairs[:, [0, 1, 2, 3, 4, 8]], Frame(0, names, rows))
    assert plain[0] == pytest.approx([4, 9, 1.5, 0, 0, overlap], rel=1e-9)
