"""Bodies that begin in each other: named where no contact sees it, accounted for where one does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import ContactTooDeep
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.energy_account import list_energy_facts

SIDE = 0.03
STONE = q.Material(30e9, 0.2, 2700.0)
MODELS = {
    "spheres": q.SphereContact(0.002, 1e6, 0.5),
    "surface": q.SurfaceContact(1e10, 0.5, depth=0.002),
}
BY_MODEL = pytest.mark.parametrize(
    "model",
    [
        model if model == "spheres" else pytest.param(model, marks=pytest.mark.long)
        for model in MODELS
    ],
)  # the loop of surfaces compiles for a minute
LOW = make_box_mesh((SIDE,) * 3, (2, 2, 2))


def beside(model: str, size: float, corner: tuple[float, float, float]) -> q.Simulation:
    """A cube of 3 cm at the origin, and one of ``size`` [m] with its least corner at ``corner``."""
    other = make_box_mesh((size,) * 3, (1, 1, 1), origin=corner)
    bodies = [q.Body(LOW, STONE, name="low"), q.Body(other, STONE, name="other")]
    return q.Simulation(bodies, threads=1, contact=MODELS[model], step=1e-8)


@BY_MODEL
@pytest.mark.parametrize(
    ("size", "corner"),
    [
        (0.03, (0.011, 0.009, 0.013)),  # a corner in the other
        (0.01, (0.009, 0.011, 0.008)),  # swallowed
        (0.05, (-0.01, -0.011, -0.009)),  # swallows: no point of it is in the other
    ],
)
def test_bodies_deep_in_each_other_are_named(
    model: str, size: float, corner: tuple[float, float, float]
) -> None:
    run = beside(model, size, corner)
    with pytest.raises(ContactTooDeep, match=r"t = 0 s, step 0: (low|other) lies .* m below the"):
        run.advance(1e-8)


@pytest.mark.long
@pytest.mark.parametrize(
    ("y", "said"),
    [
        (0.009, "m below the surface of (low|other), where"),
        (0.309, "m below the surface of (low|other), where"),  # three widths ahead
        (-0.02, "across the width, where"),  # half over a side
        (-0.52, "across the width, where"),
        (0.05, None),
    ],
)
def test_images_across_a_width_are_looked_at(y: float, said: str | None) -> None:
    """Cubes of 3 cm, the other's place taken any number of widths of 10 cm ahead or back."""
    other = make_box_mesh((0.03,) * 3, (1, 1, 1), origin=(0.011, y, 0.013))
    bodies = [q.Body(LOW, STONE, name="low"), q.Body(other, STONE, name="other")]
    contact = replace(MODELS["spheres"], periodic=q.PeriodicWidth("y", 0.1))
    run = q.Simulation(bodies, threads=1, contact=contact, step=1e-8)
    if said is None:
        run.advance(1e-8)
        return
    with pytest.raises(ContactTooDeep, match=said):
        run.advance(1e-8)


@BY_MODEL
@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # an overlap is meant
def test_bodies_that_contact_parts_are_not(model: str) -> None:
    """1 mm deep, within a sphere's radius and the greatest depth; and apart."""
    for corner in ((0.002, 0.002, SIDE - 1e-3), (0.002, 0.002, SIDE + 0.01)):
        run = beside(model, 0.02, corner)
        run.advance(1e-8)
        assert run.steps_done == 1


def test_what_overlap_gives_is_what_the_account_is_measured_by() -> None:
    """Springs that the scene begins with make motion: nothing was put in, and 1 % is missing."""
    rows = {"kinetic": [0.0, 60, 99], "elastic": [0.0, 0, 0], "external": [0.0, 0, 0]}
    rows |= {"contact": [100.0, 40, 0]}
    facts = list_energy_facts({name: np.array(values) for name, values in rows.items()})
    assert facts["greatest_imbalance"] == pytest.approx(1.0)
    assert facts["relative_imbalance"] == pytest.approx(0.01)


def test_motion_that_a_scene_begins_with_is_not_missing() -> None:
    """`velocity` of a body is no work of loads; what is lost on the way is divided by it."""
    rows = {"kinetic": [400.0, 400.0, 396.0], "elastic": [0.0] * 3, "external": [0.0] * 3}
    steady = list_energy_facts({name: np.array(values[:2]) for name, values in rows.items()})
    assert steady["relative_imbalance"] == 0.0
    assert list_energy_facts({name: np.array(values) for name, values in rows.items()})[
        "relative_imbalance"
    ] == pytest.approx(0.01)
