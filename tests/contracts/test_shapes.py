"""What every grain shape satisfies: solid grains of the asked size, the same by the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from qdem_fem.grains.hulls import GrainForm, GrainRecipe
from qdem_fem.grains.measures import find_surface_edges, integrate_polyhedron, quarter_faces
from qdem_fem.grains.meshing import make_grain_tetrahedra
from qdem_fem.grains.sets import get_shape as get_deformable
from qdem_fem.grains.sets import make_grains
from rigid_lcp.shapes import Polygon, Polyhedron
from rigid_lcp.shapes import get_shape as get_rigid
from trackbed.choices import find_choices

DIAMETER = 0.05

every_deformable = pytest.mark.parametrize("name", find_choices("qdem_fem.grains", "SHAPE"))
every_rigid = pytest.mark.parametrize("name", find_choices("rigid_lcp.shapes", "SHAPE"))


def draw(name: str, seed: int = 0) -> GrainForm:
    """A deformable grain of no set size."""
    form = get_deformable(name)(np.random.default_rng(seed), GrainRecipe())
    assert isinstance(form, GrainForm), f"SHAPE of {name} draws no GrainForm"
    return form


@every_deformable
def test_surface_is_closed_and_filled(name: str) -> None:
    """The surface bounds one body, and its tetrahedra fill it; the centroid is the origin."""
    for seed in range(3):
        form = draw(name, seed)
        corners = int(form.corner_faces.max()) + 1
        assert form.nodes.shape == (5 * corners - 5, 3), f"{name}: nodes {form.nodes.shape}"
        faces = quarter_faces(form.corner_faces, find_surface_edges(form.corner_faces))
        ways = {(a, b) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}
        assert len(ways) == 3 * len(faces), f"{name}: two faces run alike along an edge"
        assert ways == {(b, a) for a, b in ways}, f"{name}: the surface is open"
        volume, centroid = integrate_polyhedron(form.nodes, faces)
        assert np.linalg.norm(centroid) < 1e-9 * np.ptp(form.nodes)
        x = make_grain_tetrahedra(form.nodes, form.corner_faces)
        edges = x.nodes[x.elements[:, 1:]] - x.nodes[x.elements[:, :1]]
        assert np.linalg.det(edges).sum() / 6 == pytest.approx(volume, rel=1e-12)
        assert 0.3 < form.roundness <= 1
        assert 0.3 < form.sphericity <= 1


@every_deformable
def test_seed_decides_and_sets_have_the_asked_sizes(name: str) -> None:
    """The same seed draws the same grain; a set of them passes the sieves that were asked for."""
    np.testing.assert_array_equal(draw(name, 5).nodes, draw(name, 5).nodes)
    grains = make_grains(4, 2, shape=name)
    assert ((grains.sizes > 0.02) & (grains.sizes < 0.08)).all()
    assert len(grains) == 4


@every_rigid
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("corners", [5, 9])
def test_stone_is_within_its_diameter(name: str, dim: int, corners: int) -> None:
    """A convex polygon or polyhedron whose points, as drawn, lie in the circle or sphere."""
    for seed in range(3):
        stone = get_rigid(name)(np.random.default_rng(seed), DIAMETER, corners, dim)
        assert isinstance(stone, Polygon if dim == 2 else Polyhedron), (
            f"SHAPE of {name} draws {type(stone).__name__} in {dim}D"
        )
        drawn = np.linalg.norm(stone.vertices + stone.centroid, axis=1)
        assert drawn.max() <= DIAMETER / 2 * (1 + 1e-12)
        assert stone.reach > DIAMETER / 8
        again = get_rigid(name)(np.random.default_rng(seed), DIAMETER, corners, dim)
        np.testing.assert_array_equal(stone.vertices, again.vertices)
