"""Pictures of a run: one colour scale and one frame for all, however often it was interrupted."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import pytest
from matplotlib import colormaps, image

import qdem_fem as q
from qdem_fem.cli.run import Progress
from qdem_fem.contact.search.periodic import PeriodicWidth
from qdem_fem.files.output import write_bodies_vtu
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import find_surface_faces
from qdem_fem.report import series as pictures_series
from qdem_fem.report.series import Shown, draw_series, inside, place_picture_beside
from trackbed.command import main

pytestmark = pytest.mark.lowest

SCENE = """
[[body]]
name = "lower"
mesh = { box = { size = [0.05, 0.05, 0.05], cells = [1, 1, 1], origin = [0, 0, 0.0099] } }
material = { young = 1e7, poisson = 0.2, density = 2000.0 }
[[body]]
name = "upper"
mesh = { box = { size = [0.05, 0.05, 0.05], cells = [1, 1, 1], origin = [0, 0, 0.081] } }
material = { young = 1e7, poisson = 0.2, density = 2000.0 }
velocity = [0, 0, -1.0]
[contact]
model = "spheres"
radius = 0.01
normal_stiffness = 1e5
friction = 0.3
plane = [{ point = [0, 0, 0], normal = [0, 0, 1] }]
[simulation]
duration = 0.004
safety = 0.1
threads = 1
[output]
vtu_interval = 1e-3
magnification = 1.0
"""
"""A block that falls on another one: no stress in the first picture, some later."""
STILL = SimpleNamespace(contacts=None)
"""A simulation without contact."""


def block(stress: float, moved: float = 0.0) -> Any:
    """A cube of 1 m of one stress [Pa], shifted along x."""
    mesh = make_box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    return SimpleNamespace(
        nodes=mesh.nodes, elements=mesh.elements, surface=find_surface_faces(mesh.elements),
        displacement=np.tile([moved, 0.0, 0.0], (len(mesh.nodes), 1)),
        velocity=np.zeros_like(mesh.nodes), mover=None,
        von_mises=lambda: np.full(len(mesh.elements), stress),
    )  # fmt: skip


def hue(picture: Path) -> np.ndarray:
    """Direction in red, green, blue of the commonest colour that is not grey, without the bar."""
    pixels = image.imread(picture)[:, :-220, :3].reshape(-1, 3)
    coloured = pixels[np.ptp(pixels, axis=1) > 0.1]
    found, count = np.unique(np.rint(255 * coloured), axis=0, return_counts=True)
    most = found[np.argmax(count)]
    return np.asarray(most / np.linalg.norm(most))


@pytest.mark.long
def test_colours_of_a_series_are_shares_of_its_greatest_stress(tmp_path: Path) -> None:
    """Shading scales a colour and keeps its hue, to 1/2 of 255 steps.  The first picture, next to
    empty, is at the dark end; drawn alone it would be at the bright one."""
    stresses = [1.0, 2e6, 4e6]
    files = [(0.1 * n, tmp_path / f"fields_{n}.vtu") for n in range(3)]
    for stress, (_, path) in zip(stresses, files, strict=True):
        write_bodies_vtu(path, [block(stress)])
    pictures = draw_series(STILL, [block(0.0)], files, 1.0)
    assert pictures == [place_picture_beside(path) for _, path in files]
    for stress, picture in zip(stresses, pictures, strict=True):
        expected = np.array(colormaps["viridis"](stress / 4e6)[:3])
        assert hue(picture) == pytest.approx(expected / np.linalg.norm(expected), abs=0.01)


def test_a_series_has_one_frame(tmp_path: Path) -> None:
    """A body that moves far leaves another where it stands; pictures have one size."""
    files = [(0.1 * n, tmp_path / f"fields_{n}.vtu") for n in range(2)]
    for moved, (_, path) in zip((0.0, 4.0), files, strict=True):
        write_bodies_vtu(path, [block(4.0, moved), block(1.0)])
    first, last = (image.imread(p) for p in draw_series(STILL, 2 * [block(0.0)], files, 1.0))
    assert first.shape == last.shape
    seen = [
        [along(picture, colormaps["viridis"](share)[:3]) for share in (0.25, 1.0)]
        for picture in (first, last)
    ]
    # where both are in the same place the last one is drawn over the other
    assert len(seen[1][0]) > 1000
    assert (np.abs(seen[1][0].max(axis=0) - seen[0][0].max(axis=0)) <= 1).all()
    assert seen[1][1][:, 1].min() > seen[1][0][:, 1].max()
    assert len(seen[1][1]) == pytest.approx(len(seen[1][0]), rel=0.1)  # all of it is in the frame


def along(picture: np.ndarray, colour: tuple[float, ...]) -> np.ndarray:
    """Places (k, 2) of pixels, without the colour bar, of the hue of a colour."""
    pixels = picture[:, :-220, :3]
    size = np.linalg.norm(pixels, axis=2)
    alike = pixels @ colour / np.where(size > 0, size, 1) / np.linalg.norm(colour)
    return np.argwhere((alike > 0.9995) & (np.ptp(pixels, axis=2) > 0.1))


@pytest.mark.long
def test_pictures_of_an_interrupted_run_are_those_of_a_whole_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every byte of PNG and VTU; spheres that bear are stored, and drawn from there."""
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    words = ["qdem", str(scene), "--no-pictures", "--set", "output.checkpoint_interval=0.0"]
    drawn, draw = [], pictures_series.draw_deformed

    def note(*given: Any, **named: Any) -> None:
        drawn.append(len(named["bearing"].nodes))
        draw(*given, **named)

    with monkeypatch.context() as noted:
        noted.setattr(pictures_series, "draw_deformed", note)
        assert main([*words, "--run-folder", str(tmp_path / "whole")]) == 0
    at, stopped = Progress.at, []

    def stop(self: Progress, steps: int, total: int, when: float) -> None:
        at(self, steps, total, when)
        if 2 * steps >= total and not stopped:
            stopped.append(
                place_picture_beside(tmp_path / "parts" / "fields_000000.vtu").read_bytes()
            )
            os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(Progress, "at", stop)
    assert main([*words, "--run-folder", str(tmp_path / "parts")]) == 130
    assert main([*words, "--run-folder", str(tmp_path / "parts"), "--resume"]) == 0
    kept = {
        folder: {
            path.name: path.read_bytes()
            for kind in ("picture-fields_*.png", "*.vtu")
            for path in (tmp_path / folder).glob(kind)
        }
        for folder in ("whole", "parts")
    }
    assert len(kept["whole"]) == 2 * len(list((tmp_path / "whole").glob("*.vtu"))) >= 10
    assert kept["parts"] == kept["whole"]
    assert stopped[0] != kept["whole"]["picture-fields_000000.png"]  # a scale of its own, before
    bears = [
        meshio.read(path).point_data["bears"].sum()
        for path in sorted((tmp_path / "whole").glob("*.vtu"))
    ]
    assert drawn == 2 * bears
    assert (bears[0], max(bears)) == (4, 12)


def test_bodies_that_left_a_periodic_width_are_drawn_as_their_images() -> None:
    """Three of five lie inside of half a width of 1 m from the middle one; of 0.6 and -1.7 m the
    images do, at -0.4 and 0.3; moves count, and along the other axes nothing is done."""
    size = np.array([0.1, 0.1, 0.1])
    bodies = []
    for place, move in ((0.0, 0.0), (0.3, 0.1), (-0.4, 0.0), (0.2, 0.4), (-0.7, -1.0)):
        mesh = make_box_mesh(tuple(size), (1, 1, 1), origin=tuple([3.0, place, 5.0] - size / 2))
        moved = np.tile([0.0, move, 0.0], (8, 1))
        faces = find_surface_faces(mesh.elements)
        bodies.append(Shown(mesh.nodes, mesh.elements, faces, moved, np.zeros(len(mesh.elements))))
    found = inside(bodies, PeriodicWidth("y", 1.0))
    places = [(body.nodes + body.displacement).mean(axis=0) for body in found]
    assert np.array(places) == pytest.approx(
        np.array([[3.0, y, 5.0] for y in (0.0, 0.4, -0.4, -0.4, 0.3)])
    )
    assert all(one is other for one, other in zip(inside(bodies, None), bodies, strict=True))


@pytest.mark.parametrize("torn", [False, True])
def test_a_file_that_is_gone_is_named_and_the_others_are_drawn(tmp_path: Path, torn: bool) -> None:
    if torn:
        (tmp_path / "fields_0.vtu").write_text("torn")
    write_bodies_vtu(tmp_path / "fields_1.vtu", [block(1.0)])
    files = [(float(i), tmp_path / f"fields_{i}.vtu") for i in (0, 1)]
    with pytest.warns(UserWarning, match=r"fields_0\.vtu, of which a picture is drawn"):
        assert draw_series(STILL, [block(0.0)], files, 1.0) == [place_picture_beside(files[1][1])]
    with pytest.warns(UserWarning, match=r"it gets none"):
        assert draw_series(STILL, [block(0.0)], files[:1], 1.0) == []


def test_a_series_without_any_stress_is_drawn(tmp_path: Path) -> None:
    """A rigid body has none."""
    mesh = make_box_mesh((1.0, 1.0, 1.0), (1, 1, 1))
    body = q.Body(mesh, q.Material(1e6, 0.2, 1000.0), rigid=True)
    write_bodies_vtu(tmp_path / "fields_0.vtu", [body])
    (picture,) = draw_series(STILL, [body], [(0.0, tmp_path / "fields_0.vtu")], 1.0)
    assert picture.read_bytes().startswith(b"\x89PNG")
