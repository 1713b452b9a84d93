"""Frames that move with free bodies, so that single precision holds strains and not journeys.

A displacement in single precision is right to 6e-8 of itself: of a stone that has flown ten
metres, to the strain that breaks it.  So the kernel sees a free body from a frame of its own,
``x = c + d + R (X - c + u')`` and ``v = V + R v'``, with d, R and V in double precision.  Between
two renewals the frame goes on at V without turning (under gravity it falls, and the body in it is
weightless), so that no force of inertia appears; forces of an objective law turn along with R.

Bodies with held nodes, rollers or periodic faces stay in the frame of the laboratory, and the
law of small strain, which a rotation strains, is not turned.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qdem_fem.files import Floats, Integers
from qdem_fem.kernel.cpu import Loads, Probes

FAR = 1 / 16
"""Displacement in the frame, over the size of an element, at which the frame is renewed.

Rounding of the displacement strains the body in proportion to it.  What no frame mends: a body
that spins fast adds a small change to a velocity of another size in every step, and single
precision makes its spin drift, by 4e-4 in 15,000 steps at 37 rad/s.
"""


@dataclass(frozen=True)
class Journey:
    """Frames within a window of ``k`` steps: where and how fast, less what they began with."""

    fall_velocity: Floats  # ``dt sum g`` up to each half step [m/s], (k, 3); zero without gravity
    fall: Floats  # ``dt sum`` of it, at each step's end [m], (k, 3)


class BodyFrames:
    """A frame for each body, and last the laboratory's, which never moves.

    ``nodes`` (n, 3) [m] of all bodies; ``mass`` (n,) [kg]; ``first_node`` (bodies + 1,);
    ``sizes`` (bodies,) [m]: of their elements; ``turning``: whether frames may turn.
    """

    def __init__(
        self, nodes: Floats, mass: Floats, first_node: Integers, sizes: Floats, turning: bool
    ) -> None:
        self.count = len(first_node) - 1
        self.first_node, self.turning = first_node, turning
        self.body = np.repeat(np.arange(self.count), np.diff(first_node))
        self.mass, self.far = mass, FAR * sizes
        centre = self._sum(mass[:, None] * nodes) / self._sum(mass)[:, None]
        self.arm = nodes - centre[self.body]
        """``X - c`` of the nodes [m], (n, 3)."""
        self.of_node = np.full(len(nodes), self.count)
        """Number of each node's frame, (n,)."""
        self.turns = False
        """Whether frames may turn under the present conditions."""
        self.falls = False
        """Whether gravity acts on the frames and not on the nodes."""
        self.rotation = np.tile(np.eye(3), (self.count + 1, 1, 1))
        """R, (bodies + 1, 3, 3)."""
        self.shift = np.zeros((self.count + 1, 3))
        """d [m], (bodies + 1, 3)."""
        self.velocity = np.zeros((self.count + 1, 3))
        """V [m/s], (bodies + 1, 3)."""

    def _sum(self, values: Floats) -> Floats:
        """Sums over the nodes of each body."""
        return np.add.reduceat(values, self.first_node[:-1], axis=0)

    def choose(self, tied: NDArray[np.bool_], gravity: bool) -> None:
        """Which bodies get a frame: those without any ``tied`` node, (n,).

        Gravity falls upon frames only where all bodies have one; else the kernel brings it to
        all nodes alike, and frames move on without turning.
        """
        free = ~np.logical_or.reduceat(tied, self.first_node[:-1])
        self.of_node = np.where(free[self.body] & (self.mass > 0), self.body, self.count)
        self.falls = gravity and bool(free.all())
        self.turns = self.turning and (self.falls or not gravity)
        self.moving = np.append(free, False)

    def fit(self, displacement: Floats, velocity: Floats) -> None:
        """Renew the frames: the best rigid motion of a displacement (n, 3), its mean velocity.

        R by the polar decomposition of ``sum m (x - x_mean)(X - c)^T``, weighted by mass.
        """
        total = self._sum(self.mass)[:, None]
        moving = self.moving[:-1]
        shift = self._sum(self.mass[:, None] * displacement) / total
        self.shift[:-1] = np.where(moving[:, None], shift, 0.0)
        mean = self._sum(self.mass[:, None] * velocity) / total
        self.velocity[:-1] = np.where(moving[:, None], mean, 0.0)
        self.rotation[:] = np.eye(3)
        if self.turns:
            turned = self.arm + displacement - shift[self.body]
            outer = self.mass[:, None, None] * turned[:, :, None] * self.arm[:, None, :]
            left, _, right = np.linalg.svd(self._sum(outer))
            left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
            self.rotation[:-1][moving] = (left @ right)[moving]

    def displacement_world(self, own: Floats, nodes: slice = slice(None)) -> Floats:
        """``u`` of ``u'`` (n, 3) [m] of all nodes or some; in the laboratory's frame to the same
        bits."""
        return self._displacement_at(nodes, own, self.shift)

    def _displacement_at(self, nodes: slice | Integers, own: Floats, shift: Floats) -> Floats:
        frame = self.of_node[nodes]
        turn = self.rotation[frame]
        rigid = np.einsum("nij,nj->ni", turn - np.eye(3), self.arm[nodes]) + shift[frame]
        return np.einsum("nij,nj->ni", turn, own) + rigid

    def displacement_own(self, world: Floats) -> Floats:
        """``u'`` of ``u`` (n, 3) [m]."""
        back = self.rotation[self.of_node].transpose(0, 2, 1)
        moved = np.einsum("nij,nj->ni", back, world - self.shift[self.of_node])
        return moved + np.einsum("nij,nj->ni", back - np.eye(3), self.arm)

    def velocity_world(self, own: Floats, nodes: slice = slice(None)) -> Floats:
        """``v`` of ``v'`` (n, 3) [m/s] of all nodes or some."""
        return self.turn_vectors(own, nodes) + self.velocity[self.of_node[nodes]]

    def velocity_own(self, world: Floats) -> Floats:
        """``v'`` of ``v`` (n, 3) [m/s]."""
        back = self.rotation[self.of_node].transpose(0, 2, 1)
        return np.einsum("nij,nj->ni", back, world - self.velocity[self.of_node])

    def turn_vectors(self, own: Floats, nodes: slice = slice(None)) -> Floats:
        """Vectors of the frames (n, 3), at all nodes or some, as the laboratory sees them."""
        return np.einsum("nij,nj->ni", self.rotation[self.of_node[nodes]], own)

    def turn_loads(self, loads: Loads, user_node: Integers) -> Loads:
        """Loads in the directions of the frames; ``user_node`` (n,): number by kernel number.

        Each component that acts on a node of a turned frame becomes three.
        """
        if not self.turns or not loads.node_at.size:
            return loads
        node, component = np.divmod(loads.node_at, 4)
        parts = self.rotation[self.of_node[user_node[node]], component]  # row c of R: (L, 3)
        first = loads.node_at - component
        window = (loads.force_at - loads.node_at)[:, None]
        at = first[:, None] + np.arange(3)
        return Loads(
            force_at=(at + window).ravel(),
            node_at=at.ravel(),
            series=np.repeat(loads.series, 3),
            weight=(loads.weight[:, None] * parts).ravel(),
        )

    def journey(self, steps: int, step: float, gravity: Floats | None) -> Journey:
        """Where frames go in ``steps`` under ``gravity`` (3,) [m/s^2]."""
        if gravity is None or not self.falls:
            return Journey(np.zeros((steps, 3)), np.zeros((steps, 3)))
        faster = step * np.cumsum(np.tile(gravity, (steps, 1)), axis=0)
        return Journey(faster, step * np.cumsum(faster, axis=0))

    def shift_after(self, steps: int, step: float, journey: Journey) -> Floats:
        """d after some steps (at least one) of a window [m], (bodies + 1, 3)."""
        gone = step * steps * self.velocity + journey.fall[steps - 1]
        return self.shift + np.where(self.moving[:, None], gone, 0.0)

    def advance(self, steps: int, step: float, journey: Journey) -> None:
        """Move the frames by ``steps``, at least one."""
        self.shift = self.shift_after(steps, step, journey)
        faster = np.where(self.moving[:, None], journey.fall_velocity[steps - 1], 0.0)
        self.velocity = self.velocity + faster

    def turn_probes(
        self, probes: Probes, user_node: Integers, done: int, step: float, journey: Journey
    ) -> None:
        """Turn the samples of a window of ``done`` steps into displacements of the laboratory."""
        nodes = user_node[probes.node_at // 4]
        for sample in range(len(probes.record)):
            steps = probes.first + sample * probes.stride
            if steps > done:
                return
            shift = self.shift_after(steps, step, journey)
            probes.record[sample] = self._displacement_at(nodes, probes.record[sample], shift)

    def find_frame_work(
        self, loads: Loads, user_node: Integers, table: Floats, step: float, journey: Journey
    ) -> float:
        """Work of the loads along the frames' own way [J]: ``dt sum_k F(t_k) (V- + V+)/2``.

        ``table`` (k, series): amplitudes at the steps done; ``loads`` in directions of the
        laboratory.
        """
        node, component = np.divmod(loads.node_at, 4)
        frame = self.of_node[user_node[node]]
        on = frame < self.count
        if not on.any():
            return 0.0
        loaded, slot = np.unique(frame[on], return_inverse=True)
        resultant = np.zeros((len(loaded), 3, table.shape[1]))
        np.add.at(resultant, (slot, component[on], loads.series[on]), loads.weight[on])
        force = np.einsum("bcs,ks->kbc", resultant, table)
        after = journey.fall_velocity[: len(table)]
        before = np.concatenate([np.zeros((1, 3)), after[:-1]])
        mean = self.velocity[loaded] + (0.5 * (before + after))[:, None, :]
        return float(step * (force * mean).sum())

    def count_near_steps(self, own_velocity: Floats, step: float) -> int:
        """Steps in which no node moves further than `FAR` in its frame; at least one."""
        speed = np.sqrt((own_velocity**2).sum(axis=1))
        fastest = np.maximum.reduceat(speed, self.first_node[:-1])[self.moving[:-1]]
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = self.far[self.moving[:-1]] / (step * fastest)
        steps = steps[np.isfinite(steps)]
        return max(1, int(min(steps.min(initial=2**31), 2**31)))

    def is_far(self, own: Floats) -> bool:
        """Whether a displacement (n, 3) in the frames is due for new ones."""
        distance = np.maximum.reduceat(abs(own).max(axis=1), self.first_node[:-1])
        return bool((distance > self.far)[self.moving[:-1]].any())
