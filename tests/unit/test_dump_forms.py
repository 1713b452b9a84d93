"""Dumps beside those of x y z: scaled, unfolded, packed, tilted, of grains that leave."""

from __future__ import annotations

import bz2
import lzma
from pathlib import Path

import meshio
import numpy as np
import pytest

import adapters.files.meshio_dump  # noqa: F401
from adapters.errors import DumpError, UsageError
from adapters.files import Frame, read_frames, read_series, write_dump
from adapters.files.dump import find_cell
from adapters.files.series import describe_thrown
from adapters.files.states import read_state_file

PLACE = np.array([[0.1, 0.2, 0.5], [1.3, -0.4, 2.4]])
"""Centres of two grains [m]; the second one is out of the box, across three of its sides."""
BOXES = {
    "straight": ("pp pp pp", [[0, 1], [0, 2], [-1, 1]]),
    "tilted": ("xy xz yz pp pp pp", [[-0.1, 1.25, -0.1], [0, 2.2, 0.25], [-1, 1, 0.2]]),
    "general": ("abc origin pp pp pp", [[1, 0.1, 0, -0.1], [0.2, 2, 0.1, 0], [0, 0.3, 2, -1]]),
}
"""What the header says of the box, and its three lines."""


def write_text(
    path: Path, columns: str, rows: np.ndarray, box: str = "straight", step: int = 0, opened=open
) -> Path:
    kind, bounds = BOXES[box]
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS {kind}\n"
    head += "".join(" ".join(map(repr, line)) + "\n" for line in bounds)
    body = "".join(" ".join(f"{x:.17g}" for x in row) + "\n" for row in rows)
    with opened(path, "at") as stream:
        stream.write(f"{head}ITEM: ATOMS {columns}\n{body}")
    return path


@pytest.mark.parametrize("box", BOXES)
def test_places_are_the_same_however_written(tmp_path: Path, box: str) -> None:
    """x, xu, xs, xsu, with image flags or unfolded: one bed, in straight and in tilted boxes."""
    origin, edges = find_cell(np.array(BOXES[box][1], float))
    scaled = (PLACE - origin) @ np.linalg.inv(edges)
    images = np.floor(scaled)
    grains, radius = np.array([[1], [2]]), np.full((2, 1), 0.05)
    forms = {
        "xu yu zu": PLACE,
        "xsu ysu zsu": scaled,
        "xs ys zs ix iy iz": np.hstack([scaled - images, images]),
        "x y z ix iy iz": np.hstack([PLACE - images @ edges, images]),
    }
    for number, (columns, values) in enumerate(forms.items()):
        rows = np.hstack([grains, radius, values])
        path = write_text(tmp_path / f"{number}.dump", f"id radius {columns}", rows, box)
        state = read_state_file(path, 2700.0)
        np.testing.assert_allclose(state.position, PLACE, atol=1e-12)
        if columns != "x y z ix iy iz":  # which meshio gives as they stand, and the flags beside
            np.testing.assert_allclose(meshio.read(path).points, PLACE, atol=1e-12)
        if box == "straight":  # 2 m high
            rows[:, 4] -= 0.005 if "s" in columns else 0.01
            write_text(path, f"id radius {columns}", rows, box, step=5)
            np.testing.assert_allclose(read_series([path]).settlement, [0.0, 0.01], atol=1e-12)


def test_heights_that_are_folded_need_what_unfolds_them(tmp_path: Path) -> None:
    """A grain that sinks through the bottom of a period comes back in at the top."""
    path, sunk = tmp_path / "a.dump", 0.02
    for step, z in ((0, -0.99), (1, -0.99 - sunk + 2.0)):
        write_text(path, "id radius x y z", np.array([[1, 0.05, 0.5, 0.5, z]]), step=step)
    with pytest.raises(UsageError, match="grain 1 passed a periodic side in z"):
        read_series([path])
    scaled = tmp_path / "scaled.dump"
    for step, z in ((0, 0.005), (1, 0.995)):
        write_text(scaled, "id radius xs ys zs", np.array([[1, 0.05, 0.5, 0.5, z]]), step=step)
    with pytest.raises(UsageError, match="grain 1 passed a periodic side in z"):
        read_series([scaled])
    for columns, flags in (("iz", [0, -1]), ("zu", [-0.99, -0.99 - sunk])):
        path = tmp_path / f"{columns}.dump"
        for step, (z, flag) in enumerate(zip((-0.99, 0.99), flags, strict=True)):
            row = np.array([[1, 0.05, 0.5, 0.5, z, flag]])
            write_text(path, f"id radius x y z {columns}", row, step=step)
        np.testing.assert_allclose(read_series([path]).settlement, [0.0, sunk], atol=1e-12)


def test_a_grain_that_was_thrown_off_is_named(tmp_path: Path) -> None:
    """64 grains sink by 1 mm and one flies up by 0.4 m: the mean is that grain's; radii of 2 m."""
    path, grains = tmp_path / "a.dump", np.arange(1, 65)
    rows = np.column_stack((grains, np.full(64, 2.0), grains, grains, np.linspace(0, 0.1, 64)))
    write_text(path, "id radius x y z", rows)
    assert not [one for one in read_series([path]).doubts if "alone" in one]
    assert describe_thrown(np.empty(0), np.empty(0)) is None
    rows[:, 4] -= 1e-3
    rows[7, 4] += 0.4
    write_text(path, "id radius x y z", rows, step=1)
    implausible, thrown = read_series([path]).doubts
    assert "a grain of 4 m" in implausible
    assert "grain 8 alone makes most of this settlement: it sank by -0.399 m" in thrown


def test_other_units_than_si_are_refused(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.dump", "id radius x y z", np.array([[1, 1, 1, 1, 1]]))
    path.write_text("ITEM: UNITS\ncgs\n" + path.read_text())
    with pytest.raises(DumpError, match="the units are 'cgs', not si"):
        list(read_frames(path))


def test_a_tilted_box_by_hand() -> None:
    """xy = -0.1, xz = 0.25, yz = 0.2: LAMMPS bounds hold the whole; edges lie inside."""
    origin, edges = find_cell(np.array(BOXES["tilted"][1], float))
    np.testing.assert_allclose(origin, [0.0, 0.0, -1.0])
    np.testing.assert_allclose(edges, [[1.0, 0, 0], [-0.1, 2.0, 0], [0.25, 0.2, 2.0]])


@pytest.mark.parametrize("box", BOXES)
def test_boxes_go_through_meshio(tmp_path: Path, box: str) -> None:
    """Read, written and read again: the same bounds, tilts with them."""
    rows = np.hstack([[[1], [2]], PLACE])
    mesh = meshio.read(write_text(tmp_path / "a.dump", "id x y z", rows, box))
    mesh.write(tmp_path / "b.dump")
    (frame,) = read_frames(tmp_path / "b.dump")
    np.testing.assert_array_equal(frame.bounds, BOXES[box][1])
    assert frame.boundary.split()[:2] == (
        BOXES[box][0].split()[:2] if box != "straight" else ["ff"] * 2
    )


def test_one_frame_of_a_dump_that_grains_leave(tmp_path: Path) -> None:
    """The last frame is what a mesh or a state asks for; a series of all still names the loss."""
    path, rows = tmp_path / "a.dump", np.hstack([[[1], [2]], PLACE, [[0.05], [0.05]]])
    write_text(path, "id x y z radius", rows)
    write_text(path, "id x y z radius", rows[:1], step=100)
    np.testing.assert_array_equal(meshio.read(path).points, PLACE[:1])
    assert read_state_file(path, 2700.0).identifier.tolist() == [1]
    with pytest.raises(DumpError, match="lost grains: 2"):
        read_series([path])


@pytest.mark.parametrize(("ending", "opened"), [(".bz2", bz2.open), (".xz", lzma.open)])
def test_packed_dumps(tmp_path: Path, ending: str, opened) -> None:
    """Read and written by their ending; named where the ending is another, or they are cut."""
    rows = np.hstack([[[1], [2]], PLACE])
    path = write_text(tmp_path / f"a.dump{ending}", "id x y z", rows, opened=opened)
    (frame,) = read_frames(path)
    np.testing.assert_array_equal(frame.find_centres(), PLACE)
    write_dump(tmp_path / f"b.dump{ending}", [frame])
    assert meshio.read(tmp_path / f"b.dump{ending}").points.tolist() == PLACE.tolist()
    plain = tmp_path / "c.dump"
    plain.write_bytes(path.read_bytes())
    with pytest.raises(DumpError, match=rf"ends in \{ending}"):
        list(read_frames(plain))
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(DumpError):
        list(read_frames(path))


def test_zstd_is_named(tmp_path: Path) -> None:
    """Python has no reader for it: unpack it first."""
    path = tmp_path / "a.dump.zst"
    path.write_bytes(b"\x28\xb5\x2f\xfd" + bytes(40))
    with pytest.raises(DumpError, match="unpack it first"):
        list(read_frames(path))


def test_columns_and_frames_that_are_there_twice(tmp_path: Path) -> None:
    """Two columns of one name are refused; a frame that is written again counts once, a time step
    that has other rows is refused."""
    rows = np.hstack([[[1], [2]], PLACE])
    with pytest.raises(DumpError, match="columns are there twice: z"):
        list(read_frames(write_text(tmp_path / "a.dump", "id x z z", rows)))
    path = tmp_path / "b.dump"
    for step in (0, 100, 100, 200):
        write_text(path, "id x y z", rows - [0, 0, 0, 1e-3 * step], step=step)
    assert [frame.time_step for frame in read_frames(path)] == [0, 100, 200]
    write_text(path, "id x y z", rows, step=200)
    with pytest.raises(DumpError, match="200 follows 200"):
        list(read_frames(path))


def test_scaled_places_need_a_box() -> None:
    """Without bounds there is nothing to scale with."""
    frame = Frame(0, ("id", "xs", "ys", "zs"), np.hstack([[[1], [2]], PLACE]))
    with pytest.raises(DumpError, match="no box"):
        frame.find_centres()
