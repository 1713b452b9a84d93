"""States in ON-DEM VTKHDF: YADE's own file and ours agree, and each fault is named."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

import trackbed
from adapters.bed.state import State
from adapters.errors import DumpError, UsageError
from adapters.files import read_frames
from adapters.files.ondem import write_bodies
from adapters.files.states import read_state_file, write_state_file

pytestmark = pytest.mark.peer("h5py")
SAMPLE = Path(os.environ.get("TRACKBED_DATA", "shared/data"), "ondem/test_box_spheres.vtkhdf")
GLASS = {"density": 2600.0, "young": 1e7, "poisson": 0.3, "friction": 0.5}


@pytest.mark.skipif(not SAMPLE.is_file(), reason="no samples of ON-DEM")
def test_yade_wrote_the_same(tmp_path: Path) -> None:
    """What ON-DEM's exporter of draft 0.1 wrote from YADE, read and written, has its numbers; but
    not the orientations of spheres, which no state has."""
    import h5py

    write_bodies(tmp_path / "a.vtkhdf", read_state_file(SAMPLE, 1.0), {}, GLASS, {})
    with h5py.File(tmp_path / "a.vtkhdf") as ours, h5py.File(SAMPLE) as theirs:
        fields = {*theirs["VTKHDF/PointData"]} - {"orientation", "position"}
        for name in ("Points", *(f"PointData/{field}" for field in fields)):
            one, other = ours[f"VTKHDF/grains/{name}"], theirs[f"VTKHDF/{name}"]
            assert one.dtype.kind == other.dtype.kind, name
            assert np.all(np.isclose(one, other, 1e-15, 0)), name
        for name in ("Scene/units", "Scene/gravity", "Materials/0/density"):
            assert np.all(ours[f"ONDEM/{name}"][()] == theirs[f"ONDEM/{name}"][()])
    (frame,) = read_frames(SAMPLE)  # the step is time over time step
    assert (frame.time_step, frame.values.shape) == (8000, (36, 12))
    with pytest.raises(DumpError, match="there is no radius; there are shape_type"):
        list(read_frames(SAMPLE.with_name("test_5spheres.vtkhdf")))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The file of three grains."""
    place = np.arange(9.0).reshape(3, 3)
    state = State(np.array([4, 7, 9]), place, place[0] + 1, place[0] + 1, place, place)
    write_state_file(state, tmp_path / "a.vtkhdf")
    return tmp_path / "a.vtkhdf"


def test_what_the_importer_for_yade_asks_for(path: Path) -> None:
    """Each group, dataset and attribute that it reads of spheres, with restore_interactions=False.

    Source: implementation/vtkhdf/import_yade_vtkhdf.py and hdf5_utils.py of ON-DEM-WG3-FileFormat,
    October 2026; that VTK shows the block is asked in `test_export`.
    """
    import h5py

    said = {"iteration": 3, "time": 0.5, "timestep": 1e-5}
    write_bodies(path, read_state_file(path, 1.0), said, GLASS, {})
    with h5py.File(path) as file:
        scene, (material,) = file["ONDEM/Scene"], file["ONDEM/Materials"].values()
        assert dict(scene.attrs) == said
        assert (*scene["gravity"],) == (0, 0, -9.81)
        shapes, (name,) = (scene[key].asstr()[:] for key in ("shape_names", "display_group_names"))
        assert {key: material[key][()] for key in material} == {
            "id": 0, "density": 2600.0, "normal_stiffness": 1e7, "shear_stiffness": 3e6,
            "shear_friction": GLASS["friction"], "shear_damping": 0.0, "yade_poisson": 0.3,
            "material_type": b"FrictMat",
        }  # fmt: skip
        data = {key: one[:] for key, one in file[f"VTKHDF/Assembly/{name}/PointData"].items()}
        assert [*shapes[data["shape_type"]]] == ["sphere"] * 3
        free = {"material_id": 0, "clump_id": -1, "blocked_dofs": 0, "orientation": [1, 0, 0, 0]}
        assert all(np.all(data[key] == value) for key, value in free.items())
        assert file[f"VTKHDF/{name}/PointData/orientation"].attrs["order"] == "wxyz"
        assert file[f"VTKHDF/{name}"].attrs["Version"].tolist() == [2, 5]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("ONDEM/Scene/units", ["second", "millimeter", "gram"], "units are second millimeter gram"),
        ("VTKHDF/grains/PointData/body_id", None, "no body_id; there are shape_type radius"),
        ("VTKHDF/grains/PointData/body_id", [4, 7, 7], "body 7 is there twice"),
        ("VTKHDF/grains/PointData/radius", [1.0, 0.0, 3.0], "radius of body 7 is 0"),
        ("VTKHDF/grains/PointData/mass", [1.0, 1.0], r"mass is \(2,\) of float64, not \(3,\)"),
        ("VTKHDF/grains/Points", [[0.0, np.nan, 0]] * 3, "y of body 4 is nan"),
        ("VTKHDF/grains/PointData/clump_id", [-1, 8, 8], "2 of 3 spheres are parts of clumps"),
        ("ONDEM/Bodies/sphere/mass", 1.0, "its clumps stand apart"),
        ("VTKHDF", None, "no whole ON-DEM VTKHDF file"),
    ],
)
def test_faults_are_named(path: Path, name: str, value: object, said: str) -> None:
    """The file, what is wrong with it, and what to give instead."""
    import h5py

    with h5py.File(path, "a") as file:
        file.pop(name, None)
        if value is not None:
            file[name] = value
    with pytest.raises(DumpError, match=rf"a.vtkhdf: .*{said}[^\0]*->"):
        read_state_file(path, 1.0)


def test_more_than_the_file_holds(path: Path) -> None:
    """Numbers that a damaged file promises are not given memory."""
    import h5py

    with h5py.File(path, "a") as file:
        for name, shape in (("Points", (10**7, 3)), ("PointData/radius", (10**7,))):
            del file[f"VTKHDF/grains/{name}"]
            file.create_dataset(f"VTKHDF/grains/{name}", shape, float, chunks=True)
    with pytest.raises(DumpError, match=r"radius is \(10000000,\) of float64"):
        read_state_file(path, 1.0)


@pytest.mark.parametrize("blocked", [63, 62])
def test_blocks_of_later_drafts(tmp_path: Path, blocked: int) -> None:
    """Spheres are read, with the masses of the density given; a wall is left out, and what is no
    sphere and can move is refused."""
    import h5py

    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        for name, count in (("grains", 3), ("unused", 0)):
            block = file.create_group(f"VTKHDF/{name}")
            block.attrs["Type"] = np.bytes_("PolyData")
            block["Points"], block["PointData/body_id"] = (
                np.ones((count, 3)),
                np.arange(count)[::-1],
            )
            block["PointData/radius"] = [1.0, 2.0, np.nan][:count]
            block["PointData/blocked_dofs"] = [0, 0, blocked][:count]
            file[f"VTKHDF/Assembly/{name}"] = h5py.SoftLink(f"/VTKHDF/{name}")
    if blocked == 63:
        masses = read_state_file(tmp_path / "a.vtkhdf", density=3 / (4 * np.pi)).mass
        assert masses == pytest.approx([8, 1], rel=1e-15)  # by their identifiers
        return
    with pytest.raises(DumpError, match="bodies that can move are no spheres"):
        read_state_file(tmp_path / "a.vtkhdf", 1.0)


def test_other_names_and_stones(path: Path) -> None:
    """HDF5 under a dump's name says which name it needs; stones are not written as spheres."""
    state, other = read_state_file(path, 1.0), path.with_suffix(".dump")
    path.rename(other)
    with pytest.raises(DumpError, match=r"name that ends in \.vtkhdf"):
        read_state_file(other, 1.0)
    with pytest.raises(UsageError, match="stones of several spheres"):
        write_state_file(state.move_to(state.position, orientation=np.eye(4)[:3]), path)
    assert not path.exists()


@pytest.mark.long
def test_a_million_grains_in_twenty_seconds(tmp_path: Path) -> None:
    """Three states read, the grains moved ten cycles on, and written: of the processor's time."""
    radius, zero = np.random.default_rng(1).uniform(0.018, 0.0205, 10**6), np.zeros((10**6, 3))
    place = np.indices((100, 100, 100)).reshape(3, -1).T * 0.04
    still, names = State(np.arange(10**6), place, radius, radius**3, zero, zero), []
    for cycle in range(3):
        names.append(tmp_path / f"{cycle}.vtkhdf")
        write_state_file(still.move_to(place * (1 - 1e-4 * np.log1p(cycle))), names[-1])
    start = time.process_time()
    states = [read_state_file(name, 2700.0) for name in names]
    moved = trackbed.jump([state.position for state in states], 10, radius)
    write_state_file(still.move_to(moved), tmp_path / "moved.vtkhdf")
    assert time.process_time() - start < 20
    assert moved.mean() < states[-1].position.mean()
