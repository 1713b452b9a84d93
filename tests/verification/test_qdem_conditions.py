"""Conditions: held nodes, rollers, loads, pressure, periodic faces, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.files.errors import ConditionError, QdemError
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.meshes import make_delaunay

pytestmark = pytest.mark.lowest

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
STEEL = q.Material(YOUNG, POISSON, DENSITY)


def block(rotation: Rotation | None = None, cells: tuple[int, int, int] = (3, 2, 2)) -> q.Body:
    """A block of 1 x 0.6 x 0.5 m with one corner in the origin, turned about it."""
    mesh = make_box_mesh((1.0, 0.6, 0.5), cells)
    nodes = mesh.nodes if rotation is None else rotation.apply(mesh.nodes)
    return q.Body((nodes, mesh.elements), STEEL)


def free(body: q.Body, **options: Any) -> q.Simulation:
    return q.Simulation([body], threads=1, **options)


X = block().nodes
LEFT, RIGHT = X[:, 0] < 1e-9, X[:, 0] > 1 - 1e-9
BOTTOM, FRONT, BACK = X[:, 2] < 1e-9, X[:, 1] < 1e-9, X[:, 1] > 0.6 - 1e-9


# --- held nodes ----------------------------------------------------------------------------------


def test_fixed_nodes_do_not_move_and_the_others_do() -> None:
    body = block()
    run = free(body)
    run.fix(body, LEFT)
    run.fix(body, RIGHT, "y")
    run.load(body, RIGHT, [0.0, 50.0, 50.0])
    run.advance(0.05)
    assert not body.displacement[LEFT].any()
    assert not body.displacement[RIGHT, 1].any()
    assert (body.displacement[RIGHT, 2] > 0).all()
    assert abs(body.velocity[LEFT]).max() < 1e-15 * abs(body.velocity).max()


@pytest.mark.parametrize(
    "given",
    [0.01, (np.array([0.0, 1.0]), np.array([0.01, 0.02])), lambda t: 0.01 * (1 + t)],
    ids=["constant", "table", "function"],
)
def test_prescribed_nodes_are_where_they_should_be(given: Any) -> None:
    """At the time reached, whatever the form of the value is."""
    body = block()
    run = free(body)
    run.prescribe(body, RIGHT, "z", given)
    run.advance(20 * run.step)
    expected = 0.01 if isinstance(given, float) else 0.01 * (1 + run.time)
    np.testing.assert_allclose(body.displacement[RIGHT, 2], expected, rtol=1e-13)


def test_velocity_of_prescribed_nodes_is_level_with_them() -> None:
    """(u(k+1) - u(k-1))/(2 dt), the mean of the speeds to and from here: t for u = t^2/2,
    to round-off of u over dt t, here 10 times that of one number."""
    body = block()
    run = free(body)
    run.prescribe(body, RIGHT, "z", lambda t: t * t / 2)
    run.advance(20 * run.step)
    np.testing.assert_allclose(body.velocity[RIGHT, 2], run.time, rtol=1e-12)


def test_of_two_values_for_a_component_the_later_counts() -> None:
    body = block()
    run = free(body)
    first = run.prescribe(body, RIGHT, "x", 1e-3)
    second = run.prescribe(body, RIGHT, "x", 2e-3)
    run.advance(3 * run.step)
    assert (body.displacement[RIGHT, 0] == 2e-3).all()
    run.remove(second)
    run.advance(3 * run.step)
    assert (body.displacement[RIGHT, 0] == 1e-3).all()
    run.remove(first)
    run.advance(3 * run.step)
    assert (body.displacement[RIGHT, 0] != 1e-3).all()


# --- rollers -------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_roller_across_an_axis_is_a_fix(axis: int) -> None:
    """A plane of normal e_c holds component c: the same motion, to round-off."""
    displacements = []
    for roller in (True, False):
        body = block()
        run = free(body)
        face = body.nodes[:, axis] < 1e-9
        if roller:
            run.roller(body, face, 3.0 * np.eye(3)[axis])
        else:
            run.fix(body, face, "xyz"[axis])
        run.load(body, RIGHT, [30.0, 20.0, -10.0])
        run.advance(100 * run.step)
        displacements.append(body.displacement)
    np.testing.assert_allclose(*displacements, rtol=0, atol=1e-13 * abs(displacements[0]).max())


@pytest.mark.parametrize("strain", ["finger", "svk"])
def test_a_turned_block_moves_as_the_block_turned(strain: Any) -> None:
    """Q u(X) = u'(Q X) for an objective stress, with rollers, loads and gravity turned along."""
    displacements = []
    for angle in (0.0, 45.0):
        turn = Rotation.from_rotvec([0.3 * angle, -0.5 * angle, angle], degrees=True)
        body = block(turn)
        run = free(body, strain=strain, step=5e-4, gravity=turn.apply([1.0, 2.0, -9.81]))
        run.roller(body, LEFT, turn.apply([1.0, 0, 0]))
        run.roller(body, BOTTOM, turn.apply([0, 0, 1.0]))
        run.load(body, RIGHT, turn.apply([2e4, 1e3, -1e3]))
        run.pressure(body, BACK, 5e3)
        run.advance(0.05)
        displacements.append(turn.inv().apply(body.displacement))
    assert abs(displacements[0]).max() > 0.01
    np.testing.assert_allclose(*displacements, rtol=0, atol=1e-12)


def test_two_planes_leave_their_line() -> None:
    """A node in two oblique planes, or in one and held, moves along what they have in common."""
    body = block()
    run = free(body)
    one, two = np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.5, 0.1])
    run.roller(body, LEFT, one)
    run.roller(body, LEFT, two)
    run.roller(body, RIGHT, one)
    run.fix(body, RIGHT, "x")
    run.load(body, LEFT | RIGHT, [50.0, 70.0, 90.0])
    run.advance(0.05)
    u = body.displacement
    scale = abs(u).max()
    assert abs(u[LEFT] @ one).max() < 1e-13 * scale
    assert abs(u[LEFT] @ two).max() < 1e-13 * scale
    assert abs(u[LEFT]).max() > 0.01 * scale
    assert not u[RIGHT, :2].any()
    assert abs(u[RIGHT, 2]).min() > 0


# --- loads ---------------------------------------------------------------------------------------


def centre_acceleration(body: q.Body, run: q.Simulation) -> np.ndarray:
    """Of a free body under constant loads, from u = a t^2/2, which the scheme meets exactly."""
    run.advance(50 * run.step)
    mass = run.assembly.mass
    return 2 * (mass @ body.displacement) / mass.sum() / run.time**2


def test_load_is_a_total_force_shared_equally() -> None:
    """F = M a of a free body; each of k nodes has F/k, so the moment is that of their mean."""
    body = block()
    run = free(body)
    force = np.array([3.0, -2.0, 1.0])
    load = run.load(body, RIGHT, force)
    np.testing.assert_allclose(load.weights, 1 / RIGHT.sum())
    mass = 0.3 * DENSITY
    np.testing.assert_allclose(centre_acceleration(body, run), force / mass, rtol=1e-11)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_pressure_resultant(precision: Any) -> None:
    """p A along the inward normal of the faces named; nothing from a closed surface."""
    body = block()
    run = free(body, precision=precision)
    run.pressure(body, RIGHT, 40.0)
    found = centre_acceleration(body, run)
    expected = np.array([-40.0 * 0.3 / (0.3 * DENSITY), 0, 0])
    assert abs(found - expected).max() < (1e-12 if precision == "float64" else 1e-5)

    nodes, elements = make_delaunay(60, 7)
    stone = q.Body((nodes, elements), STEEL)
    run = free(stone)
    load = run.pressure(stone, np.arange(len(nodes)), 40.0)
    force = load.weights * 40.0
    arm = nodes[load.nodes]
    assert abs(force.sum(axis=0)).max() < 1e-13
    assert abs(np.cross(arm, force).sum(axis=0)).max() < 1e-13


def test_series_and_functions_drive_loads_alike() -> None:
    """A table, a function and a ramp of the same values give the same bits."""
    displacements = []
    table = (np.array([0.0, 0.02]), np.array([[0.0, 0, 0], [20.0, 0, 5]]))
    ramp = q.make_ramp(0.02, [20.0, 0, 5])
    for value in (table, ramp, q.Series(*table), lambda t: ramp(t)):
        body = block()
        run = free(body)
        run.load(body, RIGHT, value)
        run.advance(0.03)
        displacements.append(body.displacement.tobytes())
    assert len(set(displacements)) == 1


def test_a_removed_load_is_gone() -> None:
    """Without it the free body moves on at constant speed."""
    body = block()
    run = free(body)
    load = run.load(body, X[:, 0] > -1, [30.0, 0, 0])
    run.advance(20 * run.step)
    speed = run.assembly.mass @ body.velocity / run.assembly.mass.sum()
    assert speed[0] == pytest.approx(30 / (0.3 * DENSITY) * run.time, rel=1e-11)
    run.remove(load)
    run.advance(50 * run.step)
    after = run.assembly.mass @ body.velocity / run.assembly.mass.sum()
    np.testing.assert_allclose(after, speed, rtol=1e-11, atol=1e-14)


# --- periodic faces ------------------------------------------------------------------------------


def test_periodic_faces_make_plane_strain() -> None:
    """Joined faces keep their distance: e_x = (1 - nu^2) s/E, e_z = -nu (1 + nu) s/E, e_y = 0.

    Constant strain is in the space of linear elements, so the static answer is exact.
    """
    body = block()
    run = free(body, strain="small")
    run.periodic(body, FRONT, BACK)
    run.roller(body, LEFT, [1, 0, 0])
    run.roller(body, BOTTOM, [0, 0, 1])
    run.fix(body, int(np.flatnonzero(LEFT & BOTTOM & FRONT)[0]), "y")
    stress = 100.0
    run.pressure(body, RIGHT, -stress)
    run.relax(1e-10)
    u = body.displacement
    expected = np.zeros_like(u)
    expected[:, 0] = (1 - POISSON**2) * stress / YOUNG * X[:, 0]
    expected[:, 2] = -POISSON * (1 + POISSON) * stress / YOUNG * X[:, 2]
    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-8 * abs(expected).max())
    np.testing.assert_array_equal(u[FRONT], u[BACK])


def test_one_periodic_cell_is_a_row_of_them() -> None:
    """One cell of a row that repeats moves as each cell of three; momentum goes round."""
    displacements = []
    for cells in (1, 3):
        mesh = make_box_mesh((0.2 * cells, 0.6, 0.5), (cells, 3, 2))
        body = q.Body(mesh, STEEL)
        run = free(body, step=5e-4, gravity=[0.5, 0, -9.81])
        x = mesh.nodes
        run.periodic(body, x[:, 0] < 1e-9, x[:, 0] > 0.2 * cells - 1e-9)
        run.fix(body, (x[:, 2] < 1e-9) & (x[:, 1] < 1e-9))
        run.advance(0.05)
        assert run.assembly.mass.sum() == pytest.approx(0.06 * cells * DENSITY)
        displacements.append(body.displacement[x[:, 0] < 1e-9])
    assert abs(displacements[0]).max() > 1e-3
    np.testing.assert_allclose(*displacements, rtol=0, atol=1e-13)


# --- refusals ------------------------------------------------------------------------------------


def refused(call: Callable[[], object]) -> str:
    """The message of the `ConditionError` that the call raises: a sentence with its place."""
    with pytest.raises(ConditionError) as raised:
        call()
    error = raised.value
    assert error.where
    assert len(error.what.split()) >= 3
    return str(error)


BODY, OTHER = block(), block()
RUN = free(BODY)
SELECTIONS: dict[str, Any] = {
    "no node": X[:, 0] > 7,
    "empty": [],
    "mask too short": LEFT[:-1],
    "mask of numbers": LEFT.astype(int),
    "beyond": 99_999,
    "before": -1000,
    "coordinates": X,
    "halves": [0.5],
    "text": "left",
    "none": None,
}


@pytest.mark.parametrize("name", SELECTIONS)
@pytest.mark.parametrize("verb", ["fix", "load", "pressure", "roller", "prescribe", "probe"])
def test_bad_selections(verb: str, name: str) -> None:
    nodes = SELECTIONS[name]
    calls: dict[str, Callable[[], object]] = {
        "fix": lambda: RUN.fix(BODY, nodes),
        "load": lambda: RUN.load(BODY, nodes, [0, 0, 1]),
        "pressure": lambda: RUN.pressure(BODY, nodes, 1.0),
        "roller": lambda: RUN.roller(BODY, nodes, [0, 0, 1]),
        "prescribe": lambda: RUN.prescribe(BODY, nodes, "x", 0.0),
        "probe": lambda: RUN.advance(1e-3, {"a": nodes}),
    }
    assert verb in refused(calls[verb])


DIAGONAL = np.argsort(X @ [1, 0.9, 0.3])[-LEFT.sum() :]


def periodic(a: Any, b: Any) -> None:
    body = block()
    free(body).periodic(body, a, b)


BAD_CALLS: dict[str, tuple[str, Callable[[], object]]] = {
    "other body, fix": ("not a body of this simulation", lambda: RUN.fix(OTHER, LEFT)),
    "other body, pressure": ("not a body of this", lambda: RUN.pressure(OTHER, RIGHT, 1.0)),
    "other body, probe": ("not a body of this", lambda: RUN.advance(1e-3, {"a": (OTHER, LEFT)})),
    "no body": ("not a body of this simulation", lambda: RUN.fix("body", LEFT)),  # type: ignore[arg-type]
    "component w": ("'w'", lambda: RUN.fix(BODY, LEFT, "w")),
    "no component": ("''", lambda: RUN.fix(BODY, LEFT, "")),
    "component 0": ("not 0", lambda: RUN.fix(BODY, LEFT, 0)),  # type: ignore[arg-type]
    "NaN": ("not finite", lambda: RUN.prescribe(BODY, LEFT, "z", nan)),
    "vector": ("3 components", lambda: RUN.prescribe(BODY, LEFT, "z", [1, 2, 3])),
    "NaN function": ("t = 0", lambda: RUN.prescribe(BODY, LEFT, "z", lambda t: nan)),
    "scalar force": ("1 component", lambda: RUN.load(BODY, LEFT, 5.0)),
    "infinite force": ("not finite", lambda: RUN.load(BODY, LEFT, [0, 0, inf])),
    "scalar series": ("1 comp", lambda: RUN.load(BODY, LEFT, q.Series([0, 1], [0, 1]))),
    "text force": ("no number", lambda: RUN.load(BODY, LEFT, ["a", "b", "c"])),
    "vector pressure": ("3 components", lambda: RUN.pressure(BODY, RIGHT, [1, 2, 3])),
    "no face": ("three nodes", lambda: RUN.pressure(BODY, 0, 1.0)),
    "normal of zeros": ("direction", lambda: RUN.roller(BODY, LEFT, [0, 0, 0])),
    "short normal": ("direction", lambda: RUN.roller(BODY, LEFT, [0, 1])),
    "text normal": ("direction", lambda: RUN.roller(BODY, LEFT, "x")),  # type: ignore[arg-type]
    "NaN normal": ("direction", lambda: RUN.roller(BODY, LEFT, [0, 0, nan])),
    "no partner": ("no partner", lambda: periodic(LEFT, DIAGONAL)),
    "unlike faces": ("on one face", lambda: periodic(LEFT, (RIGHT | BACK) & ~LEFT)),
    "no condition": ("none of", lambda: RUN.remove("fix")),  # type: ignore[arg-type]
    "back in time": ("-1", lambda: RUN.advance(-1.0)),
    "NaN seconds": ("nan", lambda: RUN.advance(nan)),
    "for ever": ("inf", lambda: RUN.advance(inf)),
    "too long": ("1e+300", lambda: RUN.advance(1e300)),
    "text seconds": ("'1'", lambda: RUN.advance("1")),  # type: ignore[arg-type]
    "NaN sampling": ("nan", lambda: RUN.advance(1.0, {"a": LEFT}, nan)),
    "no sampling": ("0.0", lambda: RUN.advance(1.0, {"a": LEFT}, 0.0)),
    "list of probes": ("names", lambda: RUN.advance(1.0, [LEFT])),  # type: ignore[arg-type]
    "velocity": ("shape", lambda: setattr(BODY, "velocity", np.zeros(3))),
    "NaN velocity": ("node 0", lambda: setattr(BODY, "velocity", np.full(X.shape, nan))),
    "text velocity": ("numbers", lambda: setattr(BODY, "velocity", "fast")),
    "strain": ("green", lambda: free(OTHER, strain="green")),
    "precision": ("float16", lambda: free(OTHER, precision="float16")),
    "step 0": ("0", lambda: free(OTHER, step=0)),
    "text step": ("'1'", lambda: free(OTHER, step="1")),
    "safety": ("-1", lambda: free(OTHER, safety=-1)),
    "changing gravity": (
        "change with time",
        lambda: free(OTHER, gravity=q.make_ramp(1.0, [0, 0, 1])),
    ),
    "mass scaling": ("nan", lambda: free(OTHER, mass_scaling=nan)),
    "gravity": ("1 component", lambda: free(OTHER, gravity=9.81)),
    "no bodies": ("at least one", lambda: q.Simulation([])),
    "a bare body": ("list", lambda: q.Simulation(OTHER)),  # type: ignore[arg-type]
    "twice": ("twice", lambda: q.Simulation([OTHER, OTHER])),
    "taken": ("another simulation", lambda: q.Simulation([BODY])),
}


@pytest.mark.parametrize("name", BAD_CALLS)
def test_bad_calls(name: str) -> None:
    """Each is refused with a word on what was wrong, and leaves nothing behind."""
    word, call = BAD_CALLS[name]
    before = len(RUN.conditions.loads + RUN.conditions.held + RUN.conditions.rollers)
    assert word in refused(call)
    assert before == len(RUN.conditions.loads + RUN.conditions.held + RUN.conditions.rollers)
    assert RUN.steps_done == 0
    free(block())  # a refused body can still be used
    assert OTHER.mover is None


def test_periodic_after_the_start_is_refused() -> None:
    body = block()
    run = free(body)
    run.advance(run.step)
    assert "begun" in refused(lambda: run.periodic(body, FRONT, BACK))


def test_a_function_that_turns_nan_says_when() -> None:
    """The run stops before the window that would need the value."""
    body = block()
    run = free(body)
    run.load(body, RIGHT, lambda t: [0, 0, 1.0 if t < 0.01 else nan])
    with pytest.raises(QdemError, match=r"load: the value at t = 0\.01\d* s is not finite"):
        run.advance(1.0)
    assert np.isfinite(body.displacement).all()


def test_moving_a_node_out_of_its_plane_is_refused() -> None:
    body = block()
    run = free(body)
    run.roller(body, RIGHT, [1, 1, 0])
    run.prescribe(body, RIGHT, "x", 1e-3)
    assert "out of its plane" in refused(lambda: run.advance(run.step))
