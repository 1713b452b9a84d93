"""Forces of statically indeterminate grains: micro-displacements, their limit, and stiff springs.

Every scene is solved four ways: the direct limit (`rigid_lcp.elastic_limit`), the relaxation of
section 8 (`rigid_lcp.micro_displacements`), springs in time (`rigid_indeterminacy_springs`) and
LIGGGHTS where the grains are discs.  Error: greatest difference of a contact force from the direct
limit over the weight of all grains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import median
from time import process_time

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.elastic_limit import elastic_limit, state_reached_from
from rigid_lcp.friction_problem import FrictionProblem
from rigid_lcp.micro_displacements import micro_displacements
from validation.rigid_indeterminacy_liggghts import DAMPING, liggghts_rest, liggghts_there
from validation.rigid_indeterminacy_scenes import beam, groove, pyramid, wedge
from validation.rigid_indeterminacy_springs import Grains, springs_rest

Floats = NDArray[np.float64]

LIMIT, RELAXATION, SPRINGS, LIGGGHTS = "direct limit", "relaxation", "springs", "LIGGGHTS"
DAMPED = "springs with dashpots along the normals"
FROM_SPRINGS = "direct limit begun where the springs rest"
ORDER_BAR = 1e-10
"""Relative change of forces that another order, other numbers or another start may make [-]."""
SLOW, SLOW_QUICK = 30_000, 10_000
"""Steps of loading where contacts stick, in the full and in the quick form."""
LOADINGS = (0, SLOW // 10, SLOW, 10 * SLOW)
"""Steps of loading that are compared there at one stiffness."""


@dataclass(frozen=True)
class Scene:
    """A scene and how it is judged."""

    name: str
    make: Callable[[], Grains]
    friction: float
    discs: bool
    """LIGGGHTS can have it."""
    mobilised: bool = False
    """Contacts slide in the limit."""

    @property
    def path_matters(self) -> bool:
        """Where there is friction springs keep what slid on the way: load them slowly."""
        return self.friction > 0

    def loads_as_asked(self, ramp: int) -> bool:
        """Whether errors of runs loaded in ``ramp`` steps are those to compare by stiffness."""
        return ramp in (SLOW, SLOW_QUICK) if self.path_matters else ramp == 0


SCENES = (
    Scene("beam on three supports", beam, 0.0, False),
    Scene("wedge in a V", wedge, 0.0, False),
    Scene("wedge in a V, sticking", wedge, 5.0, False),
    Scene("disc in a groove, sticking", groove, 5.0, True),
    Scene("pyramid of 15", lambda: pyramid(5, walls=True), 0.0, True),
    Scene("pyramid of 55", lambda: pyramid(10, walls=True), 0.0, True),
    Scene("pyramid of 15, friction 0.3", lambda: pyramid(5, walls=True), 0.3, True, True),
    Scene("pyramid of 55, friction 0.3", lambda: pyramid(10, walls=True), 0.3, True, True),
)


@dataclass(frozen=True)
class Row:
    """One way to the forces of one scene, at one setting."""

    scene: str
    method: str
    stiffness: float | None
    """Springs: ``k L / W`` with L = 1 m and the weight W of all [-]."""
    ramp: int
    """Steps in which gravity grew."""
    tolerance: float | None
    """Relaxation: asked residual.  Direct limit begun at the springs: how far these are from it."""
    error: float
    """See the module [-]; of the direct limit: against dense least squares; NaN where contacts
    slide."""
    residual: float
    """Scale-free natural residual of the forces in the rigid problem [-]."""
    cpu_s: float
    steps: int
    contacts: int
    redundant: int
    """Forces that carry less the equations of balance that bind them."""
    sliding: int


def sliding_contacts(force: Floats, friction: float) -> int:
    """Contacts that are at Coulomb's limit; ``force`` (nc, 2)."""
    at_limit = np.abs(force[:, 1]) >= friction * force[:, 0] * (1 - 1e-9)
    return int((at_limit & (force[:, 0] > 0)).sum()) if friction > 0 else 0


def redundancy(problem: FrictionProblem, force: Floats) -> int:
    """Free parameters of the forces of closed contacts: their number less the rank of J there."""
    closed = force[:, 0] > 1e-12 * force.max()
    kept = np.column_stack([closed, closed & (problem.friction > 0)]).ravel()
    assert problem.bodies is not None
    rows = problem.bodies.jacobian.toarray()[kept]
    return int(kept.sum() - np.linalg.matrix_rank(rows))


def least_energy(problem: FrictionProblem, force: Floats, fall: Floats) -> Floats:
    """``argmin sum f^2`` in balance with ``fall`` (ndof,), over the contacts that ``force`` (nc, 2)
    says are closed, by dense least squares."""
    assert problem.bodies is not None
    closed = force[:, 0] > 1e-12 * force.max()
    kept = np.column_stack([closed, closed & (problem.friction > 0)]).ravel()
    rows = problem.bodies.jacobian.toarray()
    found = np.zeros(len(kept))
    found[kept] = np.linalg.lstsq(rows[kept].T, -fall, rcond=1e-12)[0]
    return found


def cpu_of(work: Callable[[], object], repeats: int = 5) -> float:
    """Median processor time [s] of a warm call."""
    work()
    times = []
    for _ in range(repeats):
        began = process_time()
        work()
        times.append(process_time() - began)
    return float(median(times))


def scene_rows(scene: Scene, quick: bool) -> Iterator[Row]:
    """All ways to the forces of a scene."""
    grains = scene.make()
    problem, weight = grains.problem(scene.friction), grains.weight
    answer = elastic_limit(problem)
    if not answer.solved:
        raise RuntimeError(f"{scene.name}: {answer.message}")
    limit = answer.r.reshape(-1, 2)
    spare, sliding = redundancy(problem, limit), sliding_contacts(limit, scene.friction)

    def row(
        method: str, force: Floats, cpu: float, steps: int, *, stiffness: float | None = None,
        ramp: int = 0, tolerance: float | None = None, error: float | None = None,
    ) -> Row:  # fmt: skip
        if error is None:
            error = float(np.abs(force - limit).max()) / weight
        return Row(
            scene.name, method, stiffness, ramp, tolerance, error,
            problem.residual(force.ravel()), cpu, steps, problem.contacts, spare, sliding,
        )  # fmt: skip

    dense = float("nan")
    if not scene.mobilised:
        fall = np.column_stack([grains.mass[:, None] * grains.gravity, 0.0 * grains.mass]).ravel()
        dense = float(np.abs(least_energy(problem, limit, fall) - answer.r).max()) / weight
    repeats = 1 if quick else 5
    cpu = cpu_of(lambda: elastic_limit(problem), repeats)
    yield row(LIMIT, limit, cpu, answer.iterations, error=dense)
    for tolerance in (1e-6,) if quick else (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        began = process_time()
        relaxed = micro_displacements(problem, tolerance=tolerance, iterations_max=30_000)
        cpu = process_time() - began
        yield row(
            RELAXATION, relaxed.r.reshape(-1, 2), cpu, relaxed.iterations, tolerance=tolerance
        )
    yield from damped_rows(scene, grains, row) if not quick else ()
    for stiffness, ramp in settings(scene, quick):
        began = process_time()
        rest = springs_rest(
            grains, stiffness * weight, scene.friction, ramp=ramp,
            tolerance=max(1e-11, 1e-14 * stiffness), steps_max=40_000 + ramp,
        )  # fmt: skip
        cpu = process_time() - began
        yield row(SPRINGS, rest.force, cpu, rest.steps, stiffness=stiffness, ramp=ramp)
        if scene.mobilised and ramp >= 30_000:
            # whether the springs' forces are those of another state of eq. 38
            other = state_reached_from(problem, stiffness * weight * rest.displacement)
            apart = float(np.abs(rest.force - other.r.reshape(-1, 2)).max()) / weight
            yield row(
                FROM_SPRINGS, other.r.reshape(-1, 2), 0.0, other.iterations, stiffness=stiffness,
                ramp=ramp, tolerance=apart,
            )  # fmt: skip
        if scene.discs and liggghts_there():
            steps = 40_000 + ramp
            force, _, cpu = liggghts_rest(
                grains, stiffness * weight, scene.friction, ramp=ramp, steps=steps
            )
            yield row(LIGGGHTS, force, cpu, steps, stiffness=stiffness, ramp=ramp)


def damped_rows(scene: Scene, grains: Grains, row: Callable[..., Row]) -> Iterator[Row]:
    """Springs whose contacts are damped as LIGGGHTS damps its, by the steps of loading."""
    if not scene.path_matters or scene.mobilised:
        return
    for ramp in LOADINGS:
        began = process_time()
        rest = springs_rest(
            grains, 1e6 * grains.weight, scene.friction, ramp=ramp, tolerance=1e-8,
            steps_max=40_000 + ramp, damping=2 * DAMPING,
        )  # fmt: skip
        cpu = process_time() - began
        yield row(DAMPED, rest.force, cpu, rest.steps, stiffness=1e6, ramp=ramp)


def settings(scene: Scene, quick: bool) -> list[tuple[float, int]]:
    """Stiffness and steps of loading of the springs' runs."""
    stiffness = (1e4, 1e6) if quick else (1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10)
    if not scene.path_matters:
        return [(k, 0) for k in stiffness]
    if scene.mobilised:
        ramps = (0, 3_000, 30_000) if quick else (0, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000)
        return [(1e7, ramp) for ramp in ramps]
    if quick:
        return [(1e6, 0), *((k, SLOW_QUICK) for k in stiffness)]
    others = [(1e6, ramp) for ramp in LOADINGS if ramp != SLOW]
    return [*others, *((k, SLOW) for k in stiffness)]


@dataclass(frozen=True)
class OrderRow:
    """Whether the forces of a pile depend on how it is written down or begun."""

    scene: str
    contacts: int
    sliding: int
    found: bool
    """The limit was found, for every order and start."""
    order: float
    """Relative difference (2-norm) with contacts and bodies in random order [-]."""
    start: float
    """As well, with random displacements of a tenth of the final ones given as a start [-]."""


def order_rows(sizes: tuple[int, ...]) -> Iterator[OrderRow]:
    """Independence of the order of contacts, the numbers of bodies and the start, on pyramids.

    ``sizes``: rows of discs; friction of 0 and 0.3 (between walls; 0.3 slides) and 5.
    """
    for rows in sizes:
        for friction in (0.0, 0.3, 5.0):
            grains = pyramid(rows, walls=friction < 1, seed=rows)
            problem = grains.problem(friction)
            rng = np.random.default_rng(rows)
            contact, body = rng.permutation(problem.contacts), rng.permutation(len(grains.mass))
            mixed = renumbered(grains, contact, body).problem(friction)
            first = elastic_limit(problem)
            begun = 0.1 * rng.normal(size=len(first.displacement)) * np.abs(first.r).max()
            differences, found = [], first.solved
            for start in (None, begun) if first.solved else ():
                other = elastic_limit(mixed, start=start)
                back = np.empty((problem.contacts, 2))
                back[contact] = other.r.reshape(-1, 2)
                apart = float(np.linalg.norm(back.ravel() - first.r) / np.linalg.norm(first.r))
                differences.append(apart)
                found = found and other.solved
            sliding = sliding_contacts(first.r.reshape(-1, 2), friction)
            yield OrderRow(
                f"pyramid of {len(grains.mass)}, friction {friction:g}", problem.contacts, sliding,
                found, *(differences or [float("nan")] * 2),
            )  # fmt: skip


def renumbered(grains: Grains, contact: NDArray[np.int64], body: NDArray[np.int64]) -> Grains:
    """The same grains with contacts and bodies in another order."""
    number = np.append(np.argsort(body), len(body))
    return Grains(
        grains.centre[body], grains.mass[body], grains.inertia[body],
        number[grains.body_a][contact], number[grains.body_b][contact], grains.place_a[contact],
        grains.radius_a[contact], grains.place_b[contact], grains.radius_b[contact],
        grains.face[contact], grains.gravity,
    )  # fmt: skip


def warm_up() -> None:
    """Compile, so that no cost holds the time of it."""
    springs_rest(groove(), 1e4, 0.0, steps_max=400)
    elastic_limit(groove().problem(0.5))
