"""Rest by kinetic damping: a march whose velocities are set to zero at every peak of the motion.

Undamped motion under constant loads turns potential energy into kinetic and back; at a peak of the
kinetic energy the potential has its least, so what moves is stopped there and begins again
(Cundall 1976).  It needs no coefficient and no viscosity, and serves bodies in frictional contact,
rigid or not, which have no static answer in `qdem_fem.march.dynamic_relaxation`.

The peak is that of all bodies together (``each=False``), or of each body by itself: grains in a bed
strike at different times, and while one falls the sum of all grows, so that the others go on
rattling; stopped one by one, each lands as if it did not bounce.  Where they ``fall``, what is in
the air is left alone, together with what it meets there (`find_grounded`): stopped at each
collision on its way, a heap of loose grains sinks like snow.  Where springs throw bodies up, that
loses time.

What is at rest is said by two numbers (`Rest`), never by a number of steps.  Time goes on while a
simulation is damped, so its loads should be constant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from qdem_fem.files import ConditionError, Floats, NotConverged
from qdem_fem.march.energies import find_energy
from qdem_fem.march.state import State
from qdem_fem.march.steps import march


@dataclass(frozen=True)
class KineticNumbers:
    """Looks at the kinetic energy, peaks, judgements of rest."""

    look: int = 40  # steps between two looks [-]
    wait: int = 4  # looks without a greater energy that tell a peak [-]; what topples goes on
    looks: int = 25  # between two judgements of the state [-]
    slow_after: int = 15
    """Judgements without rest [-] after which bodies are left twice as long, up to
    ``longest_wait``: what slides comes to g t/2 between two stops, millimetres a second on hard
    springs.  Every other judgement is of a stretch with the short ``wait``: what trembles meanwhile
    would pass for loose.  Bodies that are stopped all together are, behind as many, stopped one by
    one every other judgement: where some ring, out of step or fed by their sliders, the sum of all
    has no peak."""
    longest_wait: float = 5e-3  # [s]


KINETIC = KineticNumbers()


@dataclass(frozen=True)
class Rest:
    """How near to equilibrium bodies in contact are, and what it took."""

    unbalanced: float
    """Root mean square of `find_resultants` over the mean contact force on a vertex [-]."""
    kinetic: float
    """Kinetic energy over that of springs and elements [-]; greatest since the last judgement."""
    loose: float  # share of bodies on which `find_resultants` exceed half the weight [-]
    touching: int  # vertices that touch
    peaks: int  # times that a body was stopped, or all together
    steps: int
    time: float  # simulated [s]


def find_resultants(run: State) -> Floats:
    """Contact force, weight and loads on each body now [N], (bodies, 3); zero along what is held.

    Zero in equilibrium: elastic and viscous forces cancel within a body and are not in it.
    """
    contacts = run.contacts
    if contacts is None:
        raise ConditionError("bodies that do not touch", where="kinetic damping", remedy="contact=")
    contacts.refresh()
    total = np.zeros((len(run.bodies), 3))
    np.add.at(total, find_bodies_of(run, contacts.nodes), contacts.kernel.force)
    now = np.array([run.time])
    if run.gravity_vector is not None:
        total += compute_masses(run)[:, None] * run.gravity_vector
    for load in run.conditions.loads:
        force = load.weights * load.driver.sample(now)[0]
        np.add.at(total, find_bodies_of(run, load.nodes), force)
    for held in run.conditions.held:
        for component in held.components:
            total[find_bodies_of(run, held.nodes), component] = 0.0
    for roller in run.conditions.rollers:
        mine = np.unique(find_bodies_of(run, roller.nodes))
        total[mine] -= np.outer(total[mine] @ roller.normal, roller.normal)
    return total


def find_bodies_of(run: State, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of the bodies that nodes, in the numbers of all bodies, belong to."""
    return np.asarray(np.searchsorted(run.first_node, nodes, side="right") - 1)


def compute_masses(run: State) -> Floats:
    """Mass of each body [kg], (bodies,)."""
    return np.array(
        [float((b.material.density * b.gradients[1]).sum()) for b in run.bodies], dtype=float
    )


def find_kinetic_each(run: State) -> Floats:
    """Kinetic energy of each body by the velocities as they are, half a step behind [J], (b,)."""
    own = np.asarray(run.assembly.state.velocity).reshape(-1, 4)[run.assembly.place, :3]
    nodal = 0.5 * run.assembly.mass * np.einsum("nc,nc->n", own, own)
    each = np.add.reduceat(nodal, run.first_node[:-1])
    if run.rigid is not None:
        each[[body.rigid is not False for body in run.bodies]] += run.rigid.find_kinetic_each()
    return np.asarray(each)


def stop(run: State, bodies: NDArray[np.bool_]) -> None:
    """Set the velocities of some bodies (b,) to zero; the account of energies does not see it."""
    still = np.repeat(bodies, np.diff(run.first_node))
    at = run.assembly.place[still]
    run.assembly.state.velocity.reshape(-1, 4)[at] = 0.0
    if run.rigid is not None:
        run.rigid.stop(bodies[[body.rigid is not False for body in run.bodies]])


def find_grounded(run: State) -> NDArray[np.bool_]:
    """Which bodies stand on a wall, or on one held against gravity, over any number of others (b,).

    All of them without gravity: nothing falls there.
    """
    assert run.contacts is not None
    gravity, count = run.gravity_vector, len(run.bodies)
    if gravity is None:
        return np.ones(count, bool)
    pairs, walled = run.contacts.find_touching_bodies()
    held = [one.nodes for one in run.conditions.held if gravity[list(one.components)].any()]
    held += [one.nodes for one in run.conditions.rollers if one.normal @ gravity]
    on = np.unique(np.concatenate([walled, *(find_bodies_of(run, nodes) for nodes in held)]))
    one = np.concatenate([pairs[:, 0], on])
    other = np.concatenate([pairs[:, 1], np.full(len(on), count)])  # the ground is one more
    graph = coo_array((np.ones(len(one), bool), (one, other)), shape=(count + 1, count + 1))
    label = connected_components(graph, directed=False)[1]
    return np.asarray(label[:count] == label[count])


@dataclass
class Damping:
    """How far a march with kinetic damping is: all that `find_rest` goes on from, to the bit."""

    peak: Floats
    """Kinetic energy of each body, or of all, since it was stopped, the greatest [J], (b,)."""
    since: NDArray[np.int64]  # looks since then, (b,)
    landed: NDArray[np.bool_]  # which have been `find_grounded` since then, (b,)
    first: int  # steps done when it began
    begun: float  # time then [s]
    peaks: int = 0
    wait: int = KINETIC.wait  # looks without a greater kinetic energy after which a body is stopped
    judged: int = 0

    def stops_each(self, each: bool) -> bool:
        """Whether bodies are stopped one by one until the next judgement."""
        return each or (self.judged >= KINETIC.slow_after and self.judged % 2 == 1)

    @property
    def waits(self) -> int:
        """``wait``, and the short one every other judgement."""
        return KINETIC.wait if self.judged % 2 else self.wait

    @classmethod
    def from_run(cls, run: State) -> Damping:
        """Of a simulation that is not damped yet."""
        count = len(run.bodies)
        return cls(
            np.zeros(count), np.zeros(count, int), np.zeros(count, bool), run.steps_done, run.time
        )

    def pack_state(self) -> dict[str, NDArray[Any]]:
        """As arrays."""
        return {name: np.asarray(value) for name, value in vars(self).items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Damping:
        """What `pack_state` gave."""
        given: list[Any] = [arrays[field.name] for field in fields(cls)]
        return cls(*(value if value.ndim else value.item() for value in given))


def find_rest(
    run: State, unbalanced: float, kinetic: float, loose: float, most: float,
    progress: Callable[[Rest], None] | None = None, look: int = KINETIC.look, each: bool = True,
    damping: Damping | None = None, keep: Callable[[Damping], None] | None = None,
    fall: bool = False,
) -> Rest:  # fmt: skip
    """March with kinetic damping until the bodies are in equilibrium; they are at rest then.

    ``unbalanced``, ``kinetic`` and ``loose``: greatest shares of `Rest` that are equilibrium;
    ``most``: simulated time [s] after which `NotConverged` is raised, the state reached being
    kept; ``look``: steps between two looks at the motion, some per period of a grain on its
    contacts; ``each``: bodies are stopped one by one, with ``fall`` only behind they have landed.
    ``damping``: of a simulation that was restored; ``keep`` is called with it behind every
    judgement, and is to save both.
    The account of energies knows nothing of what is taken at peaks.
    """
    state = Damping.from_run(run) if damping is None else damping
    greatest, looks = 0.0, 0
    every = np.ones(len(run.bodies), bool)
    while True:
        march(run, look, look, np.zeros(0, np.int64), None)
        now = find_kinetic_each(run)
        greatest, looks = max(greatest, float(now.sum())), looks + 1
        alone = state.stops_each(each)
        if not alone:
            now = np.full_like(now, now.sum())
        more = now > state.peak
        state.since = np.where(more, 0, state.since + 1)
        state.peak = np.maximum(state.peak, now)
        past = state.since >= (state.waits if alone else 1)
        if fall:
            state.landed = find_grounded(run) | (state.landed & ~more)
            past &= state.landed
        if past.any():
            stop(run, past)
            state.peaks += int(past.sum()) if alone else 1
            state.peak[past] = 0.0
            state.since[past] = 0
        if looks < KINETIC.looks:
            continue
        done, time = run.steps_done - state.first, run.time - state.begun
        rest = _judge_rest(run, greatest, state.peaks, done, time)
        looks, greatest = 0, 0.0
        state.judged += 1
        if state.judged % KINETIC.slow_after == 0:
            longest = int(KINETIC.longest_wait / (look * run.step))
            state.wait = max(state.wait, min(2 * state.wait, longest))
        if not each and state.judged >= KINETIC.slow_after:  # peaks of bodies are none of their sum
            state.peak[:], state.since[:] = 0.0, 0
        if progress is not None:
            progress(rest)
        if rest.unbalanced <= unbalanced and rest.kinetic <= kinetic and rest.loose <= loose:
            stop(run, every)
            return rest
        if keep is not None:
            keep(state)
        if rest.time > most:
            raise NotConverged(
                f"no equilibrium after {rest.time:.4g} s: unbalanced force "
                f"{rest.unbalanced:.3g} of the mean contact force ({unbalanced:g} asked), kinetic "
                f"energy {rest.kinetic:.3g} of that of springs ({kinetic:g} asked), "
                f"{rest.loose:.3g} of the bodies loose ({loose:g} asked)",
                where=f"kinetic damping, {state.peaks} peaks",
                remedy="give it more time, or ask for less",
            )


def _judge_rest(run: State, greatest: float, peaks: int, steps: int, time: float) -> Rest:
    energy = find_energy(run)
    stored = energy.elastic + energy.contact
    assert run.contacts is not None
    forces = np.linalg.norm(run.contacts.kernel.force, axis=1)
    forces = forces[forces > 0]  # on vertices that touch something, walls included
    size = np.linalg.norm(find_resultants(run), axis=1)
    gravity = run.gravity_vector
    weight = 0.0 if gravity is None else compute_masses(run) * float(np.linalg.norm(gravity))
    return Rest(
        unbalanced=float(np.sqrt((size**2).mean()) / forces.mean()) if len(forces) else np.inf,
        kinetic=greatest / stored if stored > 0 else np.inf,
        loose=float((size > 0.5 * weight).mean()),
        touching=len(forces), peaks=peaks, steps=steps, time=time,
    )  # fmt: skip
